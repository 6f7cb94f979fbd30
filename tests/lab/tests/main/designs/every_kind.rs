//! Every kind of design on random machines: what it certifies checks exactly, holds in simulation, and cannot be forged.

use std::sync::LazyLock;

use super::support::{cases, decay, machine, region, t_parameters};
use im_design::certificate::{Certificate, Design};
use im_design::matrix::Matrix;
use im_design::mtpa::{AirGap, Circuit, TCircuit};
use im_design::request::{Kind, Period, design, design_for, design_sampled};
use im_design::{DesignError, DesignModel, LinearMachine, model};
use proptest::prelude::*;

/// The box gain for a sampled observer. Not every machine need have one over the whole box at this period:
/// such a machine is rejected, and `cases` bounds how many may be.
fn sampled_box(machine: &LinearMachine) -> Result<Certificate, TestCaseError> {
    let plant = DesignModel::Machine(*machine);
    let c = plant.constants::<f64>();
    let text = region(Kind::ThauBox, machine) + &format!("\nrate_per_s = {}", 0.2 * c.eta);
    match design_sampled(Kind::ThauBox, plant, &text, short_period(machine)) {
        Err(DesignError::Infeasible { .. }) => Err(TestCaseError::reject("no sampled gain over the box")),
        made => Ok(made.unwrap_or_else(|e| panic!("sampled thau-box: {e} on {machine:?}"))),
    }
}

/// 20 us, or less where the currents are too fast for forward Euler.
fn short_period(machine: &LinearMachine) -> Period {
    Period::At(2e-5_f64.min(0.2 / DesignModel::Machine(*machine).constants::<f64>().gamma))
}

/// The adaptive loop's, of Jadot's machine: of any machine not every region has a sampled proof.
fn sampled_adaptive() -> &'static Certificate {
    static MADE: LazyLock<Certificate> = LazyLock::new(|| {
        let text =
            "speed_rad_s = [8.0, 20.0]\nslip_rad_s = [-8.0, 8.0]\nflux_vs = 0.9\nproportional = 0.05\nintegral = 20.0\nrho = 0.2";
        design_sampled(Kind::KubotaLoop, DesignModel::Machine(LinearMachine::jadot_table_i()), text, Period::At(5e-5))
            .expect("feasible")
    });
    &MADE
}

/// A certificate of each kind, and of each that is made for a sampling period.
fn every(machine: &LinearMachine) -> Result<Vec<(String, Certificate)>, TestCaseError> {
    let plant = DesignModel::Machine(*machine);
    let named = |name: &str, made: Result<Certificate, DesignError>| {
        (name.to_owned(), made.unwrap_or_else(|e| panic!("{name}: {e} on {machine:?}")))
    };
    let made = Kind::ALL.map(|(kind, name)| named(name, design(kind, plant, &region(kind, machine))));
    let sampled = [Kind::Thau, Kind::Derdiyok, Kind::Utkin, Kind::Kenne, Kind::Jadot].map(|kind| {
        let made = design_sampled(kind, plant, &region(kind, machine), short_period(machine));
        named(&format!("sampled {}", kind.name()), made)
    });
    let boxed = ("sampled thau-box".to_owned(), sampled_box(machine)?);
    let adaptive = ("sampled kubota-loop".to_owned(), sampled_adaptive().clone());
    Ok(made.into_iter().chain(sampled).chain([boxed, adaptive]).collect())
}

/// Every number of a certificate in order of writing, with its place; `change` may replace one.
fn numbers(value: &mut toml::Value, place: &str, change: &mut impl FnMut(&str, &mut toml::Value)) {
    match value {
        toml::Value::Float(_) | toml::Value::Integer(_) => change(place, value),
        toml::Value::Array(items) => items.iter_mut().for_each(|item| numbers(item, place, change)),
        toml::Value::Table(table) => table.iter_mut().for_each(|(key, item)| numbers(item, &format!("{place}.{key}"), change)),
        _ => {}
    }
}

/// The certificate with number `at` replaced, where it still reads as one, and the number's place.
fn with(text: &str, at: usize, new: impl Fn(f64) -> f64) -> (String, Option<Certificate>) {
    let mut value: toml::Value = toml::from_str(text).unwrap();
    let (mut k, mut found) = (0, String::new());
    numbers(&mut value, "", &mut |place, x| {
        if k == at {
            place.clone_into(&mut found);
            *x = match &*x {
                toml::Value::Integer(i) => toml::Value::Integer(new(*i as f64).round() as i64),
                toml::Value::Float(f) => toml::Value::Float(new(*f)),
                other => other.clone(),
            };
        }
        k += 1;
    });
    (found, toml::from_str(&toml::to_string(&value).unwrap()).ok())
}

fn count(text: &str) -> usize {
    let (mut value, mut n): (toml::Value, usize) = (toml::from_str(text).unwrap(), 0);
    numbers(&mut value, "", &mut |_, _| n += 1);
    n
}

/// Numbers that may be anything, as no claim of that kind is about them, and why.
fn no_claim(kind: &str, place: &str) -> Option<&'static str> {
    let mechanical = place.ends_with("inertia_kg_m2") || place.ends_with("viscous_friction_n_m_s");
    let electrical = ["kubota", "kubota-loop", "derdiyok", "utkin", "sampled", "mtpa"];
    let kind = kind.trim_start_matches("sampled ");
    if mechanical && electrical.contains(&kind) {
        return Some("fluxes and currents at any speed: the shaft has no part in them");
    }
    match kind {
        "derdiyok" if place.ends_with("_resistance_ohm") || place.ends_with("_inductance_h") => {
            Some("the bound is in eta and n_p alone")
        }
        "utkin" if place.ends_with("_resistance_ohm") => Some("gamma and R_s only help"),
        "thau-box" if place.ends_with("inertia_kg_m2") || place.ends_with("friction_n_m_s") => {
            Some("friction only helps the speed error")
        }
        "mtpa" if place.contains("plant") => Some("the circuit has parameters of its own; only the pole pairs are compared"),
        // What switches an effect of strength zero off has no size.
        "mtpa" if place.ends_with("_saturation") || place.ends_with("skin_effect") => Some("an effect of strength zero"),
        _ => None,
    }
}

/// The design with a claim that is false, as `beyond` > 1.
fn forged(certificate: &Certificate, beyond: f64) -> Design {
    let c = certificate.plant.constants::<f64>();
    let mut forged = certificate.design.clone();
    match &mut forged {
        Design::Thau(d) => d.lipschitz *= beyond,
        Design::ThauBox(d) => d.rate_per_s += beyond * c.gamma.max(1.0) * 100.0,
        Design::Kubota(d) => d.rate_per_s = beyond * c.eta,
        Design::KubotaLoop(d) => d.cells[0].rate_per_s = beyond * (2.0 * c.gamma + 1e4),
        Design::Derdiyok(d) => d.nu0 /= beyond,
        Design::Utkin(d) => d.omega0_rad_s /= beyond,
        Design::Kenne(d) => d.k_sd /= beyond,
        Design::Jadot(d) => d.electrical_rate_per_s = beyond * (2.0 * c.gamma + 1e4),
        Design::Sampled(d) => d.contraction = 0.5 / beyond,
        Design::SampledThauBox(d) => d.contraction = 0.1 / beyond,
        Design::SampledThau(d) => d.lipschitz *= 2.0 * beyond,
        Design::SampledDerdiyok(d) => d.boundary_layer_a /= beyond,
        Design::SampledUtkin(d) => d.boundary_layer_avs /= beyond,
        Design::SampledKenne(d) => d.boundary_lambda /= beyond,
        Design::SampledJadot(d) => d.outer.rate_per_s = beyond * (2.0 * c.gamma + 1e4),
        Design::SampledKubotaLoop(d) => d.cells[0].contraction = 0.5 / beyond,
        // Asking for 2 % more or less current than there must be.
        Design::Mtpa(d) => {
            let im_design::mtpa::Law::Series { current, .. } = &mut d.law else { unreachable!() };
            current[0] += 0.02 * beyond;
        }
    }
    forged
}

proptest! {
    #![proptest_config(cases(1))] // each makes a certificate of every kind

    /// One number anywhere changed: seen. And by a forger who makes digest and margins anew: refused once the claim is false, which
    /// every number can make it, except those that no claim is about. What is accepted on the way is true: harmless, as more friction is.
    /// The claim itself made false is refused of every kind.
    #[test]
    fn every_certificate_checks_exactly_and_any_number_changed_is_refused(
        machine in machine(), which in prop::collection::vec(0.0..1.0f64, 17), relative in 1e-14..1e-2f64, beyond in 1.02..3.0f64
    ) {
        for ((name, certificate), which) in every(&machine)?.into_iter().zip(which) {
            let text = certificate.to_text().unwrap();
            let (_, margins) = Certificate::check_text(&text).unwrap_or_else(|e| panic!("{name}: {e}"));
            prop_assert!(margins.iter().all(|m| m.margin > 0.0), "{name}");
            prop_assert!(Certificate::seal(certificate.plant, forged(&certificate, beyond)).is_err(), "{name}: a false claim sealed");
            let n = count(&text);
            let at = (which * n as f64) as usize;
            // By a hair: machine, region, gain, P, rate or margin.
            let hair = |x: f64| if x == 0.0 { relative } else if x.fract() == 0.0 && x.abs() > 1e4 { x + 1.0 } else { moved(x, relative) };
            let (place, altered) = with(&text, at, |x| if x == x.round() && x.abs() < 100.0 { x + 1.0 } else { hair(x) });
            prop_assert!(altered.is_none_or(|c| c.check().is_err()), "{name}: {place} changed unseen");
            if place.starts_with(".margins") || place == ".schema" {
                continue;
            }
            let far: [fn(f64) -> f64; 9] =
                [|x| 4.0 * x, |x| 0.25 * x, |x| -x - 1.0, |x| 1e4 * x, |x| 1e-4 * x, |x| x + 1e3, |x| x - 1e3, |_| 0.0, |_| 1e9];
            let refused = |new: &fn(f64) -> f64| with(&text, at, new).1.is_none_or(|c| Certificate::seal(c.plant, c.design).is_err());
            prop_assert!(
                no_claim(&name, &place).is_some() || far.iter().any(refused),
                "{name}: {place} may be anything, and the file is accepted"
            );
        }
    }
}

/// Another float, at least the next.
fn moved(x: f64, relative: f64) -> f64 {
    let far = x * (1.0 + relative);
    if far == x { x.next_up() } else { far }
}

proptest! {
    #![proptest_config(cases(2))]

    /// Saturated machines, deep bars: the laws are proven, and no point of a blind search is better.
    #[test]
    fn mtpa_of_saturated_machines_is_proven(
        machine in machine(), saturation in 0.0..1.5f64, leakage in 0.0..1.2f64, bars in 0.0..2.0f64
    ) {
        let t = t_parameters(&machine);
        let rating = im_model::Rating::guess(&t, machine.pole_pairs);
        let mut effects = im_model::Effects::scaled(&rating, &t, machine.pole_pairs);
        effects.main_flux_saturation.excess = saturation;
        effects.leakage_flux_saturation.drop = leakage;
        effects.rotor_skin_effect.resistance_rise = bars;
        let model = im_model::Machine::try_new(t, machine.pole_pairs, effects).unwrap();
        let text = region(Kind::Mtpa, &machine);
        let certificate = design_for(Kind::Mtpa, &model, &text).unwrap();
        Certificate::check_text(&certificate.to_text().unwrap()).unwrap();
        let Design::Mtpa(d) = &certificate.design else { unreachable!() };
        prop_assert_eq!(d.circuit, Circuit::T(TCircuit::from(&model)));
        for point in &d.points {
            let [least, _] = d.law.at(d.torque_n_m, point.torque_n_m);
            for k in 0..60 {
                for l in 0..60 {
                    let (x, slip) = (1e-3 * least * 1.15f64.powi(k), 0.05 * 1.13f64.powi(l));
                    let (current, torque) = d.circuit.operate(x, slip);
                    prop_assert!(torque < point.torque_n_m || current > (1.0 - d.tolerance) * least);
                }
            }
        }
    }
}

proptest! {
    #![proptest_config(cases(8))]

    /// Utkin: from the machine's and the observer's own equations, s_n falls from both sides everywhere in the region.
    #[test]
    fn utkins_surface_attracts_from_random_states(
        machine in machine(), states in prop::collection::vec((prop::array::uniform8(-1.0..1.0f64), 0.0..1.0f64), 200)
    ) {
        let certificate = design(Kind::Utkin, DesignModel::Machine(machine), &region(Kind::Utkin, &machine)).unwrap();
        let Design::Utkin(d) = &certificate.design else { unreachable!() };
        let c = certificate.plant.constants::<f64>();
        for ([speed, angle, flux, dx, dy, along, ix, iy], side) in states {
            let disc = |x: f64, y: f64, r: f64| { let n = x.hypot(y).max(1.0); [r * x / n, r * y / n] };
            // Near the surface: ê along λ̂, and a hair to one side.
            let size = d.region.flux_min_vs * (1.0 + flux.abs());
            let (sin, cos) = (3.2 * angle).sin_cos();
            let hat = [size * cos, size * sin];
            let hair = if side < 0.5 { -1e-9 } else { 1e-9 };
            let e = d.region.current_error_max_a * along;
            let error = [e * cos - hair * sin, e * sin + hair * cos];
            let gap = disc(dx, dy, d.region.flux_error_max_vs);
            let lambda = [hat[0] + gap[0], hat[1] + gap[1]];
            let i = disc(ix, iy, d.region.current_max_a);
            let omega_hat = d.omega0_rad_s * hair.signum();
            let truth = model::derivative(&c, &[speed * d.region.speed_max_rad_s, lambda[0], lambda[1], i[0], i[1]], [0.0; 2], 0.0);
            let estimate = [omega_hat, hat[0], hat[1], i[0] + error[0], i[1] + error[1]];
            let estimated = model::derivative(&c, &estimate, [0.0; 2], 0.0);
            let e_rate = [estimated[3] - truth[3], estimated[4] - truth[4]];
            let slope = estimated[1] * error[1] - estimated[2] * error[0] + hat[0] * e_rate[1] - hat[1] * e_rate[0];
            prop_assert!(slope * hair < 0.0, "{slope} {hair}");
        }
    }

    /// Box: two nonlinear machines, one corrected, in the turning frame; while their mean is in the box the distance falls.
    #[test]
    fn nonlinear_states_in_the_box_contract_at_the_certified_rate(
        machine in machine(), start in prop::array::uniform5(-1.0..1.0f64), at in prop::array::uniform2(0.2..0.8f64)
    ) {
        let certificate = design(Kind::ThauBox, DesignModel::Machine(machine), &region(Kind::ThauBox, &machine)).unwrap();
        let Design::ThauBox(d) = &certificate.design else { unreachable!() };
        let c = certificate.plant.constants::<f64>();
        let between = |[low, high]: [f64; 2], x: f64| low + x * (high - low);
        let frame = between(d.region.frame_rad_s, at[0]);
        let slip = between(d.region.slip_rad_s, at[1]);
        let flux = between(d.region.flux_d_vs, 0.5);
        let speed = (frame - slip) / c.n_p;
        // Both in the frame: steady truth, with (η + jω_s)λ = ηL_m i; estimate as far off as the box is wide.
        let i = [c.eta * flux / c.eta_l_m, slip * flux / c.eta_l_m];
        let truth = [speed, flux, 0.0, i[0], i[1]];
        let wide = [0.4 * c.eta / c.n_p, 0.1, 0.04, 0.02 * c.beta, 0.02 * c.beta];
        let mut x: [f64; 5] = std::array::from_fn(|k| truth[k] + wide[k] * start[k]);
        let gain = &d.gain + &d.gain_per_frame_speed.scaled(&frame);
        let flow = |x: &[f64; 5]| {
            let mut f = model::derivative(&c, x, [0.0; 2], 0.0);
            // The load torque is taken equal to the torque.
            f[0] = -c.friction_rate * x[0];
            for k in [1, 3] {
                (f[k], f[k + 1]) = (f[k] + frame * x[k + 1], f[k + 1] - frame * x[k]);
            }
            f
        };
        let still = flow(&truth);
        let rates = |x: &[f64; 5]| -> [f64; 5] {
            let f = flow(x);
            let e = [truth[3] - x[3], truth[4] - x[4]];
            std::array::from_fn(|k| f[k] - still[k] + gain[(k, 0)] * e[0] + gain[(k, 1)] * e[1])
        };
        let size = |x: &[f64; 5]| {
            let e: Vec<f64> = (0..5).map(|k| x[k] - truth[k]).collect();
            (0..5).flat_map(|k| (0..5).map(move |l| (k, l))).map(|(k, l)| e[k] * d.p[(k, l)] * e[l]).sum::<f64>().sqrt()
        };
        let inside = |x: &[f64; 5]| {
            let mean: Vec<f64> = (0..5).map(|k| 0.5 * (x[k] + truth[k])).collect();
            let within = |[low, high]: [f64; 2], x: f64| low <= x && x <= high;
            within(d.region.slip_rad_s, frame - c.n_p * mean[0])
                && within(d.region.flux_d_vs, mean[1])
                && within(d.region.flux_q_vs, mean[2])
        };
        let step = 0.02 / (gain.norm() + c.gamma + frame);
        for _ in 0..400 {
            let (before, was_inside) = (size(&x), inside(&x));
            im_lab::observer_error::rk4(&mut x, step, rates);
            if was_inside && inside(&x) {
                let bound = before * (-d.rate_per_s * step).exp();
                prop_assert!(size(&x) <= bound * (1.0 + 1e-9) + 1e-12, "{} {bound}", size(&x));
            }
        }
    }

    /// Jadot: the electrical errors while speed and slip jump about in the region.
    #[test]
    fn jadots_electrical_errors_decay_at_the_certified_rate_while_speed_jumps(
        machine in machine(), start in prop::array::uniform6(-1.0..1.0f64), jumps in prop::collection::vec((0.0..1.0f64, 0.0..1.0f64), 4)
    ) {
        let certificate = design(Kind::Jadot, DesignModel::Machine(machine), &region(Kind::Jadot, &machine)).unwrap();
        let Design::Jadot(d) = &certificate.design else { unreachable!() };
        let c = certificate.plant.constants::<f64>();
        let mut e = Matrix::from_fn(6, 1, |i, _| start[i]);
        for (w, g) in jumps {
            let [w_low, w_high] = d.electrical_speed_rad_s;
            let [g_low, g_high] = d.slip_rad_s;
            let a = d.electrical(&c, w_low + w * (w_high - w_low), g_low + g * (g_high - g_low));
            let (before, after) = decay(&a, &d.electrical_p, &mut e, 2e-3);
            prop_assert!(after <= before * (-d.electrical_rate_per_s * 2e-3).exp() * (1.0 + 1e-9));
        }
    }

    /// Stepped by forward Euler, random errors shrink by the certified factor every sample.
    #[test]
    fn sampled_errors_contract_every_sample(
        machine in machine(), start in prop::array::uniform5(-1.0..1.0f64), at in prop::collection::vec(prop::array::uniform4(0.0..1.0f64), 20)
    ) {
        let certificate = sampled_box(&machine)?;
        let c = certificate.plant.constants::<f64>();
        let Design::SampledThauBox(d) = &certificate.design else { unreachable!() };
        let size = |e: &Matrix<f64>| (&(&e.t() * &d.p) * e)[(0, 0)].sqrt();
        let mut e = Matrix::from_fn(5, 1, |i, _| start[i] * [1.0, 0.1, 0.1, 10.0, 10.0][i]);
        for [f, s, x, y] in at {
            let between = |[low, high]: [f64; 2], x: f64| low + x * (high - low);
            let r = &d.region;
            let here = [between(r.frame_rad_s, f), between(r.slip_rad_s, s), between(r.flux_d_vs, x), between(r.flux_q_vs, y), 0.0, 0.0];
            let next = &d.step_matrix(&c, &here) * &e;
            prop_assert!(size(&next) <= d.contraction * size(&e) * (1.0 + 1e-9));
            e = next;
        }
    }
}
