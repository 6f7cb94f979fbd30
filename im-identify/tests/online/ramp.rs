//! A field-oriented drive under load whose speed goes up and down a ramp: what the acceleration does to the estimates of Kenné et al., with the
//! term in (27) that it asks for, and without it as in the paper.

use crate::bench::{Bench, Point};
use im_identify::online::{Identifier, KenneResistances, KenneRotorResistance, ResistancesSettings};
use im_model::{Rating, TParameters};

/// The 4-kW machine of `examples/motor.toml` without its iron loss: R_s, R_r, L_sσ, L_rσ, L_m, J, friction.
const MACHINE: [f64; 7] = [1.5, 0.9, 0.004, 0.004, 0.156, 0.045, 0.0];
const POLE_PAIRS: u32 = 2;
const SAMPLE_TIME_S: f64 = 1e-4;
/// Between these speeds, rad/s.
const SPEEDS: [f64; 2] = [50.0, 140.0];

/// A load and how fast the speed changes.
#[derive(Clone, Copy, Debug)]
struct Ramp {
    load_nm: f64,
    /// Mechanical, positive.
    rate_rad_s2: f64,
}

/// Least and greatest estimates, Ω.
#[derive(Clone, Copy, Debug)]
struct Seen {
    /// R̂_r of the identifier of R_r alone.
    rotor: [f64; 2],
    /// R̂_r, R̂_s of the identifier of both.
    both: [[f64; 2]; 2],
}

fn rating() -> Rating {
    Rating { torque_nm: 26.0, electrical_frequency_hz: 50.0, phase_voltage_peak_v: 326.6, rotor_flux_vs: 0.95 }
}

fn settings(p: &TParameters<f64>) -> ResistancesSettings<f64> {
    ResistancesSettings::for_rating(&p.windings(), POLE_PAIRS, &rating(), SAMPLE_TIME_S)
}

/// By how much R̂_r alone, and R̂_r and R̂_s together, come to rest beside the truth, Ω, when (27) is taken for constant speed.
///
/// (27) then lacks M = −jω_e'βF²[ψ_r], and the estimates rest where e_r f₁ + e_s f₂ = M. At constant flux and slip, over Fψ_r, with
/// D = Γ² + ω_s²,
///
/// ```text
/// e_r βω_sω_g/R_r − e_s γ₁(η + jω_g)²/(ηL_m) = −ω_e'β(Γω_s + jΓ²)/D
/// ```
///
/// R_r alone takes the real part; both, both: to first order, where nothing stops them and the ramp lasts.
fn error_without_the_term(ramp: &Ramp, omega_m: f64, acceleration: f64) -> (f64, [f64; 2]) {
    let (p, point) = (TParameters::from_values(MACHINE), ramp.point(omega_m, acceleration));
    let omega_e_rate = f64::from(POLE_PAIRS) * acceleration;
    let (w, d) = (p.windings(), p.windings().derived(POLE_PAIRS));
    let (r_r, l_m) = (p.rotor_resistance_ohm, p.magnetizing_inductance_h);
    let (gain, omega_g) = (settings(&p).rotor.high_gain_per_s, point.omega_g);
    let omega_s = point.omega_r + omega_g;
    let size = gain * gain + omega_s * omega_s;
    let alone = -r_r * omega_e_rate * gain / (omega_g * size);
    let e_s = omega_e_rate * gain * gain * l_m * l_m / (2.0 * w.rotor_inductance_h * omega_g * size);
    // γ₁/β = L_r/L_m.
    let turned = (d.eta * d.eta - omega_g * omega_g) / (omega_s * omega_g * d.eta);
    let e_r = alone + e_s * r_r * w.rotor_inductance_h / (l_m * l_m) * turned;
    (alone, [e_r, e_s])
}

impl Ramp {
    /// At this speed, rad/s, accelerated by this much, rad/s²: rated flux, and the torque that does it.
    fn point(&self, omega_m: f64, acceleration: f64) -> Point {
        let p = TParameters::from_values(MACHINE);
        let (r, n_p) = (p.inverse_gamma(), f64::from(POLE_PAIRS));
        let flux_vs = rating().rotor_flux_vs * p.magnetizing_inductance_h / p.rotor_inductance_h();
        let torque = self.load_nm + p.inertia_kg_m2 * acceleration;
        // τ = (3/2) n_p φ²ω_g/R_req
        Point { omega_r: n_p * omega_m, omega_g: torque * r.rotor_resistance_ohm / (1.5 * n_p * flux_vs * flux_vs), flux_vs }
    }

    /// Half a second at the lower speed, then up, half a second, and down again. The estimates begin right.
    fn run(&self) -> Seen {
        let p = TParameters::from_values(MACHINE);
        let (h, settings) = (SAMPLE_TIME_S, settings(&p));
        let rotor = KenneRotorResistance::try_new(&p.windings(), POLE_PAIRS, &settings.rotor, h).unwrap();
        let both = KenneResistances::try_new(&p.windings(), POLE_PAIRS, &settings, h).unwrap();
        let (mut of_rotor, mut of_both) = (rotor.start(), both.start());
        let mut bench = Bench::new(p, POLE_PAIRS, h);
        bench.settle(&self.point(SPEEDS[0], 0.0));
        let mut seen = Seen { rotor: [f64::MAX, f64::MIN], both: [[f64::MAX, f64::MIN]; 2] };
        let widen = |range: &mut [f64; 2], x: f64| *range = [range[0].min(x), range[1].max(x)];
        let (rate, [low, high]) = (self.rate_rad_s2, SPEEDS);
        let slope = (high - low) / rate;
        let phases = [(0.5, low, 0.0), (slope, high, rate), (0.5, high, 0.0), (slope, low, -rate), (0.5, low, 0.0)];
        for (k, (seconds, speed, acceleration)) in phases.into_iter().enumerate() {
            let point = self.point(speed, acceleration);
            for _ in 0..(seconds / h).round() as usize {
                bench.advance(&point, rate * f64::from(POLE_PAIRS));
                let sample = bench.sample();
                let (r_r, values) = (rotor.step(&mut of_rotor, &sample).values[0], both.step(&mut of_both, &sample).values);
                // The filters' beginning is not the ramp's doing.
                if k > 0 {
                    widen(&mut seen.rotor, r_r);
                    seen.both.iter_mut().zip(values).for_each(|(range, x)| widen(range, x));
                }
            }
        }
        seen
    }
}

#[test]
fn estimates_stay_on_ramps_that_would_lead_them_astray_without_the_term_of_the_acceleration() {
    let p = TParameters::from_values(MACHINE);
    let (r_r, r_s) = (p.rotor_resistance_ohm, p.stator_resistance_ohm);
    for rate_rad_s2 in [50.0, 100.0, 200.0] {
        let ramp = Ramp { load_nm: 12.0, rate_rad_s2 };
        let seen = ramp.run();
        let [(up, [_, s_up]), (down, [_, s_down])] =
            [1.0, -1.0].map(|sign| error_without_the_term(&ramp, SPEEDS[0], sign * rate_rad_s2));
        let shown = |[low, high]: [f64; 2]| format!("{low:.3}–{high:.3}");
        let (alone, [rotor, stator]) = (shown(seen.rotor), seen.both.map(shown));
        let [[r_up, r_down], [s_up, s_down]] = [[r_r + up, r_r + down], [r_s + s_up, r_s + s_down]];
        println!("| {rate_rad_s2} | {alone} | {rotor}, {stator} | {r_up:.2}; {r_down:.2} | {s_up:.1}; {s_down:.1} |");
        let off = |[low, high]: [f64; 2], truth: f64| (high - truth).max(truth - low) / truth;
        // The voltage steps with the torque at both ends of a ramp: the machine's own transients, ten times weaker in R_r than in R_s.
        assert!(off(seen.rotor, r_r) < 0.015 && off(seen.both[0], r_r) < 0.015, "{ramp:?}: {seen:?}");
        assert!(off(seen.both[1], r_s) < 0.1, "{ramp:?}: {seen:?}");
        for acceleration in [rate_rad_s2, -rate_rad_s2] {
            let (alone, [_, e_s]) = error_without_the_term(&ramp, SPEEDS[0], acceleration);
            assert!(alone.abs() > 0.03 * r_r && e_s.abs() > r_s, "{ramp:?}: {alone} {e_s}");
        }
    }
}
