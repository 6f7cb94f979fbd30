//! The figures of `docs/background/design.md`: `cargo run --release -p im-design --example figures`.

use im_design::certificate::Design;
use im_design::kubota::{KubotaRequest, best_rate, closed_form, least_norm};
use im_design::kubota_loop::{certify, no_feedback, stabilized, unstable_fraction};
use im_design::machine::Constants;
use im_design::mtpa::{Aqdm, CurrentLaw, LogLaw, SlipLaw, for_torque, laws};
use im_design::request::{Kind, Period, design_sampled};
use im_design::sliding::{UtkinRegion, derdiyok, utkin};
use im_design::thau_box::{BoxRegion, any_box, fastest, largest_box};
use im_design::{DesignError, DesignModel, LinearMachine, jadot, kenne, model, sampled, thau};

fn main() -> Result<(), DesignError> {
    thau_figures()?;
    kubota_figures()?;
    loop_figures()?;
    sliding_figures()?;
    controller_figures()?;
    sampled_figures()?;
    mtpa_figures()
}

fn thau_figures() -> Result<(), DesignError> {
    println!("## Thau");
    let c = Constants::kwon_printed();
    let mut a = model::linear_part(&c);
    // Section VII prints 1169.869 where n_pβη from B2 gives 1169.878: use what is printed.
    (a[(3, 1)], a[(4, 2)]) = (1169.869, 1169.869);
    println!("paper's bound (15), printed A and B2: kappa < {:.6e}", thau::paper_bound(&a, &thau::printed_b2())?.kappa);
    println!("limit (D/J)/mu: {:.6}", thau::limit(&c));
    let (design, _) = thau::maximize(DesignModel::Constants(c), 1e-4)?;
    println!("LMI, proven exactly: kappa = {:.6}, |L| = {:.1}", design.lipschitz, design.gain.norm());

    let plant = DesignModel::Machine(LinearMachine::kwon_table_iv());
    let (design, _) = any_box(plant, 400.0, 2.0, 0.23)?;
    println!("frame at rest, |omega| <= 400 rad/s, |flux| <= 2 Wb per axis: rate {:.3} 1/s", design.rate_per_s);
    println!("turning frame (machine | frame rad/s | slip rad/s | flux d Wb | flux q Wb | proven rate 1/s | |L| at the top):");
    for (name, machine) in [("kwon_table_iv", LinearMachine::kwon_table_iv()), ("jadot_table_i", LinearMachine::jadot_table_i())]
    {
        for frame in [[30.0, 400.0], [60.0, 400.0], [100.0, 400.0], [200.0, 400.0]] {
            for (slip, flux) in [(8.0, [0.8, 1.1]), (4.0, [0.9, 1.0])] {
                let region = BoxRegion {
                    frame_rad_s: frame,
                    slip_rad_s: [-slip, slip],
                    flux_d_vs: flux,
                    flux_q_vs: [-0.05, 0.05],
                    current_d_a: [0.0; 2],
                    current_q_a: [0.0; 2],
                };
                match fastest(DesignModel::Machine(machine), &region, 2000.0, 1e4) {
                    Ok((d, _)) => {
                        let gain = &d.gain + &d.gain_per_frame_speed.scaled(&frame[1]);
                        println!("{name} | {frame:?} | ±{slip} | {flux:?} | ±0.05 | {:.2} | {:.0}", d.rate_per_s, gain.norm());
                    }
                    Err(_) => println!("{name} | {frame:?} | ±{slip} | {flux:?} | ±0.05 | none"),
                }
            }
        }
        let centre = BoxRegion {
            frame_rad_s: [215.0 - 18.5, 215.0 + 18.5],
            slip_rad_s: [-0.8, 0.8],
            flux_d_vs: [0.935, 0.965],
            flux_q_vs: [-0.005, 0.005],
            current_d_a: [0.0; 2],
            current_q_a: [0.0; 2],
        };
        for rate in [0.5, 1.0, 2.0] {
            if let Ok((d, _)) = largest_box(DesignModel::Machine(machine), &centre, 12.0, rate, 1e4) {
                let r = d.region;
                println!(
                    "{name}: largest box of rate {rate}: frame {:.0?}, slip {:.1?}, flux d {:.3?}, flux q {:.3?}",
                    r.frame_rad_s, r.slip_rad_s, r.flux_d_vs, r.flux_q_vs
                );
            }
        }
    }
    Ok(())
}

fn kubota_figures() -> Result<(), DesignError> {
    println!("\n## Kubota, ±190 rad/s, half of eta");
    println!("machine | norm | gain | |L(190)| | rate with its own best P | Euler period, us");
    for (name, machine) in [("kwon_table_iv", LinearMachine::kwon_table_iv()), ("jadot_table_i", LinearMachine::jadot_table_i())]
    {
        let plant = DesignModel::Machine(machine);
        let c = plant.constants::<f64>();
        for (norm, flux_weight) in [("I", 1.0), ("diag(b²,b²,1,1)", c.beta * c.beta)] {
            let request = KubotaRequest { speed_rad_s: [-190.0, 190.0], rate_per_s: 0.5 * c.eta, flux_weight };
            for (gain, (d, _)) in [("closed form", closed_form(plant, &request)?), ("least norm", least_norm(plant, &request)?)] {
                let best = best_rate(plant, &d).map_or("none".into(), |(d, _)| format!("{:.3}", d.rate_per_s));
                let period = sampled::largest_period(plant, &d, 0.25 * c.eta, 1e-3)
                    .map_or("none".into(), |(d, _)| format!("{:.2}", 1e6 * d.period_s));
                println!("{name} | {norm} | {gain} | {:.3e} | {best} | {period}", d.gain_at(190.0).norm());
            }
        }
        let designed = sampled::design(plant, [-190.0, 190.0], 1e-3, 0.25 * c.eta);
        println!("{name}: gain made for Euler: {}", designed.map_or_else(|e| e.to_string(), |_| "feasible at 1 ms".into()));
    }
    Ok(())
}

fn loop_figures() -> Result<(), DesignError> {
    println!("\n## Kubota's adaptive loop, Jadot's machine, 0.9 Wb, K_P = 0.05, K_I = 20: decay rate, 1/s");
    let plant = DesignModel::Machine(LinearMachine::jadot_table_i());
    println!(
        "unstable without feedback for stator frequency between 0 and {:.4} of the rotor's",
        unstable_fraction(&plant.constants())
    );
    let (speeds, slips) = ([5.0, 10.0, 20.0, 40.0, 80.0], [-24.0, -16.0, -12.0, -8.0, -4.0, 4.0, 12.0]);
    let stabilizing = stabilized(plant, 0.2, 0.0, 0.05, 20.0)?;
    for (name, gains) in [("no feedback", no_feedback(0.05, 20.0)), ("stabilized, rho = 0.2", stabilizing.clone())] {
        println!("{name}: speed rad/s \\ slip rad/s {slips:?}");
        for (speed, row) in speeds.iter().zip(gains.map(plant, &speeds, &slips, 0.9)) {
            println!("{speed} | {}", row.iter().map(|d| format!("{d:.2}")).collect::<Vec<_>>().join(" | "));
        }
    }
    for (speed, slip) in [([5.0, 10.0], [-8.0, -2.0]), ([10.0, 40.0], [-15.0, 15.0])] {
        match certify(plant, &stabilizing, speed, slip, 0.9, 6) {
            Ok((d, _)) => println!("certified: speed {speed:?}, slip {slip:?} in {} cells", d.cells.len()),
            Err(e) => println!("{e}"),
        }
    }
    Ok(())
}

fn sliding_figures() -> Result<(), DesignError> {
    println!("\n## Sliding modes, Kwon's machine to 190 rad/s");
    let plant = DesignModel::Machine(LinearMachine::kwon_table_iv());
    let (d, _) = derdiyok(plant, 190.0, 1.1, 1.0)?;
    let (sampled, _) = sampled::derdiyok(plant, 190.0, 1.1, 1.0, None, Some(1e-4))?;
    println!("Derdiyok: nu0 = {:.2} V to 1.1 Wb; boundary layer at 100 us: {:.2} A", d.nu0, sampled.boundary_layer_a);
    let region = UtkinRegion {
        speed_max_rad_s: 190.0,
        flux_min_vs: 0.6,
        flux_error_max_vs: 0.05,
        current_error_max_a: 5.0,
        current_max_a: 80.0,
    };
    println!("Utkin: omega0 = {:.2} rad/s", utkin(plant, &region)?.0.omega0_rad_s);
    Ok(())
}

fn controller_figures() -> Result<(), DesignError> {
    println!("\n## Controllers");
    let region = kenne::KenneRegion {
        stator_resistance_ratio: [0.5, 1.5],
        rotor_resistance_ratio: [0.5, 2.0],
        rotor_resistance_rate_per_s: 5.0,
        ..kenne::KenneRegion::certain(150.0, [0.24, 0.27], 5.0, 311.0)
    };
    let (d, _) = kenne::design(DesignModel::Machine(LinearMachine::kenne_appendix_ii()), &region, 0.05)?;
    println!("Kenné: k_sq = {:.1} V, k_sd = {:.1} V, K = {:.0} A/s², k_Rr = {:.2} 1/s", d.k_sq, d.k_sd, d.k_x, d.k_rr_per_s);
    println!("Kenné: high-gain observer at 106 us: {:.0?} 1/s", kenne::high_gain_limits(106e-6));
    for current in [400.0, 837.0, 1500.0] {
        let request = jadot::JadotRequest {
            electrical_speed_rad_s: [-320.0, 320.0],
            slip_rad_s: [-12.0, 12.0],
            flux_vs: 0.9,
            current_bandwidth_rad_s: current,
            speed_bandwidth_rad_s: 20.0,
            damping: std::f64::consts::FRAC_1_SQRT_2,
        };
        let (d, _) = jadot::design(DesignModel::Machine(LinearMachine::jadot_table_i()), &request)?;
        println!(
            "Jadot, {current} rad/s: K_P = {:.3}, K_I = {:.1}, k_p = {:.4}, k_i = {:.3}, rates {:.2} and {:.2} 1/s",
            d.current_proportional_ohm,
            d.current_integral_per_s,
            d.speed_proportional,
            d.speed_integral_per_s,
            d.electrical_rate_per_s,
            d.outer_rate_per_s
        );
    }
    Ok(())
}

/// Each design of its example region for the machine of Table I, continuous and at two periods.
fn sampled_figures() -> Result<(), DesignError> {
    println!("\n## Sampled, Jadot's machine, example regions");
    let plant = DesignModel::Machine(LinearMachine::jadot_table_i());
    println!("design | period us | gains and layers, or rates in 1/s");
    for period in [10e-6, 50e-6] {
        let at = |kind: Kind| design_sampled(kind, plant, kind.example_region(), Period::At(period));
        for kind in [Kind::Derdiyok, Kind::Utkin, Kind::Kenne, Kind::Jadot, Kind::KubotaLoop] {
            let said = match at(kind).map(|certificate| certificate.design) {
                Err(e) => e.to_string(),
                Ok(Design::SampledDerdiyok(d)) => format!("nu0 {:.1} V, layer {:.3} A", d.continuous.nu0, d.boundary_layer_a),
                Ok(Design::SampledUtkin(d)) => {
                    format!("omega0 {:.1} rad/s, layer {:.3} A Wb", d.continuous.omega0_rad_s, d.boundary_layer_avs)
                }
                Ok(Design::SampledKenne(d)) => format!(
                    "k_sq {:.0} V, k_sd {:.0} V, layers {:.0} rad/s², {:.1} Wb²/s",
                    d.continuous.k_sq, d.continuous.k_sd, d.boundary_omega, d.boundary_lambda
                ),
                Ok(Design::SampledJadot(d)) => {
                    let slowest = d.electrical.iter().map(|cell| cell.proof.rate_per_s).fold(f64::INFINITY, f64::min);
                    let [inner, outer] = [d.continuous.electrical_rate_per_s, d.continuous.outer_rate_per_s];
                    format!(
                        "electrical {slowest:.2} in {} cells (continuous {inner:.2}), outer {:.2} ({outer:.2})",
                        d.electrical.len(),
                        d.outer.rate_per_s
                    )
                }
                Ok(Design::SampledKubotaLoop(d)) => {
                    let rate = |rho: f64| -rho.ln() / d.period_s;
                    let slowest = d.cells.iter().map(|cell| rate(cell.contraction)).fold(f64::INFINITY, f64::min);
                    format!("{slowest:.2} in {} cells", d.cells.len())
                }
                Ok(_) => continue,
            };
            println!("{} | {:.0} | {said}", kind.name(), 1e6 * period);
        }
    }
    for kind in [Kind::Jadot, Kind::KubotaLoop] {
        let largest = design_sampled(kind, plant, kind.example_region(), Period::Largest).map(|c| c.design);
        let period = match largest {
            Ok(Design::SampledJadot(d)) => format!("{:.1} us", 1e6 * d.period_s),
            Ok(Design::SampledKubotaLoop(d)) => format!("{:.1} us", 1e6 * d.period_s),
            Ok(_) => continue,
            Err(e) => e.to_string(),
        };
        println!("{}: largest period {period}", kind.name());
    }
    Ok(())
}

fn mtpa_figures() -> Result<(), DesignError> {
    println!("\n## MTPA, Table V");
    let circuit = Aqdm::kwon_table_v();
    let law: LogLaw = laws::fit_log(&circuit, [1.0, 510.0], 0.01)?;
    let points = laws::data(&circuit, 70.0, 70)?;
    let (current, slip) = (laws::fit_current(&points)?, laws::fit_slip(&points)?);
    println!("(27) fitted: {current:?}\n(29) fitted: {slip:?}");
    println!("series: {} terms in current, {} in slip", law.current.len(), law.slip.len());
    println!("T N m | I A | (30) % | (27) fitted % | series % | slip rad/s | (31) % | (29) fitted % | series %");
    let percent = |x: f64, of: f64| 100.0 * (x / of - 1.0);
    for torque in [1.0, 3.0, 9.0, 19.0, 50.0, 100.0, 150.0, 215.0, 257.0, 350.0, 510.0] {
        let o = for_torque(&circuit, torque)?;
        let (i, w) = (o.current_rms_a, o.slip_rad_s);
        println!(
            "{torque} | {i:.3} | {:.1} | {:.1} | {:.2} | {w:.3} | {:.1} | {:.1} | {:.2}",
            percent(CurrentLaw::KWON.at(torque), i),
            percent(current.at(torque), i),
            percent(law.current_at(torque), i),
            percent(SlipLaw::KWON.at(torque), w),
            percent(slip.at(torque), w),
            percent(law.slip_at(torque), w)
        );
    }
    Ok(())
}
