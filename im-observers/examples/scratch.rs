//! Scratch.
#[path = "../lab/mod.rs"]
mod lab;
use im_model::machines::JADOT_TABLE_I;
use im_model::simulation::*;
use im_model::space_vector::unit;
use im_observers::*;
use lab::*;
fn main() {
    let m = JADOT_TABLE_I;
    let machine = machine(&m);
    for (speed, slip) in [(20.0, -16.0), (10.0, -8.0), (10.0, -12.0)] {
        let truth = Truth::of(&machine, &held(&m, speed, slip, 6.0));
        println!(
            "speed {speed} slip {slip} flux {:.3} at 1 s {:.3} 1.2 s {:.3}",
            truth.flux[truth.len() - 1].norm(),
            truth.flux[truth.at(1.0)].norm(),
            truth.flux[truth.at(1.2)].norm()
        );
        for (rho, bw, ki) in [
            (0.5, 100.0, 1.0),
            (0.5, 400.0, 1.0),
            (0.2, 100.0, 1.0),
            (0.2, 400.0, 1.0),
            (1.0, 400.0, 1.0),
            (0.5, 400.0, 0.1),
            (0.2, 400.0, 0.1),
        ] {
            let (p, i) = KubotaGains::speed_law(&machine, &m.rating, bw);
            let o = Kubota::try_new(basis(&m, 1e-4), KubotaGains::mended(&machine, rho, p, i * ki).unwrap()).unwrap();
            let first = truth.at(1.0);
            let st = o.state_at(truth.flux[first] * unit(0.05), truth.recording.i_s[first], 1.05 * speed);
            let e = truth.observe_from(&o, first + 1, st);
            let at = |t: f64| {
                format!(
                    "{:.2} ({:.3})",
                    e[(t / 1e-4) as usize].omega_m - speed,
                    (e[(t / 1e-4) as usize].rotor_flux_vs - truth.flux[first + 1 + (t / 1e-4) as usize]).norm()
                )
            };
            println!(
                "  rho {rho} bw {bw} ki {ki}: {} {} {} {} {} {} {}",
                at(0.01),
                at(0.05),
                at(0.1),
                at(0.3),
                at(1.0),
                at(2.0),
                at(4.9)
            );
        }
    }
}
