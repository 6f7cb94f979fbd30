//! Tracking, limits and disturbance rejection over random machines with effects that the controllers do not know, with typical gains and with
//! those of the design crate.
//!
//! More cases: `PROPTEST_CASES=600 cargo test -p im-lab drive::random`.

use im_control::named::Supervised;
use im_control::{Drive, Jadot, JadotGains, Kenne, KenneGains};
use im_design::kenne::KenneRegion;
use im_identify::online::{Fixed, Lambda, RegulationParameters};
use im_model::simulation::Simulation;
use im_model::{Effects, Machine, Nameplate, Rating};
use proptest::prelude::*;

use super::common::{DriveCase, points};

/// A machine as a catalogue has it: efficiency and power factor grow with size, slip falls.
pub fn any_machine() -> impl Strategy<Value = (Machine<f64>, Rating)> {
    (0.0..1.0f64, 1u32..=4, -1.0..1.0f64, 0.5..2.0f64).prop_map(|(size, pairs, spread, inertia)| {
        // 0.4 to 75 kW, evenly in the logarithm.
        let power_w = 400.0 * (75_000.0f64 / 400.0).powf(size);
        let efficiency = 0.70 + 0.24 * size + 0.01 * spread;
        let power_factor = 0.74 + 0.13 * size + 0.02 * spread - 0.02 * f64::from(pairs - 1);
        let slip = 0.07 - 0.055 * size + 0.005 * spread;
        let nameplate = Nameplate {
            power_w,
            line_voltage_rms_v: 400.0,
            line_current_rms_a: power_w / (3f64.sqrt() * 400.0 * efficiency * power_factor),
            speed_rpm: 3000.0 / f64::from(pairs) * (1.0 - slip),
            frequency_hz: 50.0,
            power_factor,
            ..Nameplate::default()
        };
        let mut guess = nameplate.guess().unwrap();
        guess.parameters.inertia_kg_m2 *= inertia;
        (Machine::base(guess.parameters, guess.pole_pairs).unwrap(), guess.rating)
    })
}

/// Effects in typical sizes: saturation, dead time, one sample of delay.
pub fn with_effects(machine: &Machine<f64>, rating: &Rating) -> Machine<f64> {
    let mut e = Effects::scaled(rating, machine.parameters(), machine.pole_pairs());
    e.main_flux_saturation.excess = 0.4;
    e.inverter_nonlinearity.voltage_v = 0.015 * rating.phase_voltage_peak_v;
    e.voltage_delay.delay_s = 1e-4;
    machine.with_effects(e).unwrap()
}

fn check(name: &str, drive: &mut dyn Supervised, truth: &Machine<f64>, case: &DriveCase) -> Result<(), TestCaseError> {
    let (rating, w) = (case.rating, 0.7 * case.speed_rad_s());
    // Magnetized for five rotor time constants, up, loaded with 0.8 of rated torque, down and backwards.
    let t_m = (5.0 * truth.parameters().rotor_inductance_h() / truth.parameters().rotor_resistance_ohm).clamp(0.3, 1.5);
    let t_j = (1.5 * truth.parameters().inertia_kg_m2 * w / rating.torque_nm).max(0.3);
    let (up, down) = (t_m, t_m + t_j + 1.5);
    let speed = points(&[[0.0, 0.0], [up, 0.0], [up + t_j, w], [down, w], [down + 2.0 * t_j, -w]]);
    let load = 0.8 * rating.torque_nm;
    let on = up + t_j + 0.5;
    let off = on + 0.7;
    let torque = points(&[[0.0, 0.0], [on, 0.0], [on, load], [off, load], [off, 0.0]]);
    let mut s = case.scenario(speed, torque, down + 2.0 * t_j + 0.5);
    s.sensors.current_noise_a = 0.005 * case.known.current_max_a;
    s.sensors.speed_noise_rad_s = 5e-4 * case.speed_rad_s();
    let run = Simulation::new(truth, &s).controlled_by(drive).run().unwrap();
    let at = |t: f64| (t / case.sample_time_s) as usize;
    let mean = |a: usize, b: usize| run.recording.omega_m[a..b].iter().sum::<f64>() / (b - a) as f64;
    let before = mean(at(on) - 500, at(on));
    prop_assert!((before / w - 1.0).abs() < 0.005, "{name}: {before} rad/s of {w} before the load");
    let under = mean(at(off) - 500, at(off));
    prop_assert!((under / w - 1.0).abs() < 0.005, "{name}: {under} rad/s of {w} under load");
    let n = run.recording.len();
    let end = mean(n - 500, n);
    prop_assert!((end / w + 1.0).abs() < 0.005, "{name}: {end} rad/s of {} at the end", -w);
    let peak = run.recording.i_s.iter().fold(0.0f64, |p, i| p.max(i.norm()));
    prop_assert!(peak < 1.2 * case.known.current_max_a, "{name}: {peak} A of {}", case.known.current_max_a);
    Ok(())
}

fn seal<D>(of: Result<(D, im_design::Certificate), im_design::DesignError>) -> D {
    let (design, certificate) = of.unwrap_or_else(|e| panic!("{e}"));
    certificate.check().unwrap_or_else(|e| panic!("{e}"));
    design
}

/// The drives whose gains the design crate makes, with its certificates checked: over speeds to 0.75 of synchronous speed, slips to twice rated,
/// and for Kenné's switching gains resistances within 10 %, a flux estimate within 10 % and a load unknown by a fifth of rated torque.
fn designed(machine: &Machine<f64>, case: &DriveCase) -> [(&'static str, Box<dyn Supervised>); 2] {
    let (known, rating) = (&case.known, &case.rating);
    let (n_p, w) = (f64::from(known.pole_pairs), 0.75 * case.speed_rad_s());
    let plant = || im_design::DesignModel::Machine(im_design::LinearMachine::from(machine));
    let windings = &known.windings;
    let k_r = windings.mutual_inductance_h / windings.rotor_inductance_h;
    let flux = 0.95 * rating.rotor_flux_vs;

    let typical = JadotGains::typical(known, rating.rotor_flux_vs, case.sample_time_s);
    let l_f = windings.stator_inductance_h - k_r * windings.mutual_inductance_h;
    // ω_g = R_r τ/((3/2) n_p ψ²)
    let slip = 2.0 * windings.rotor_resistance_ohm * rating.torque_nm / (1.5 * n_p * flux * flux);
    let j = seal(im_design::jadot::design(
        plant(),
        &im_design::jadot::JadotRequest {
            electrical_speed_rad_s: [-n_p * w, n_p * w],
            slip_rad_s: [-slip, slip],
            flux_vs: k_r * rating.rotor_flux_vs,
            current_bandwidth_rad_s: (typical.current_integral_per_s * typical.current_proportional_ohm / l_f).sqrt(),
            speed_bandwidth_rad_s: typical.speed_integral_per_s * 2f64.sqrt(),
            damping: 0.5f64.sqrt(),
        },
    ));
    let gains = JadotGains {
        current_proportional_ohm: j.current_proportional_ohm,
        current_integral_per_s: j.current_integral_per_s,
        speed_proportional: j.speed_proportional,
        speed_integral_per_s: j.speed_integral_per_s,
        lambda: Lambda::Constant(j.lambda_h),
        ..typical
    };
    let parameters = RegulationParameters::from(machine.parameters().inverse_gamma());
    let jadot = Jadot::try_new(known, &gains, Fixed::try_new(parameters).unwrap()).unwrap();

    let mut gains = KenneGains::typical(known, rating.rotor_flux_vs, case.dc_voltage_v, case.sample_time_s);
    let acceleration = gains.reference.acceleration_max_rad_s2;
    let load = rating.torque_nm / windings.inertia_kg_m2;
    let k = seal(im_design::kenne::design(
        plant(),
        &KenneRegion {
            flux_uncertainty: 0.1,
            stator_resistance_ratio: [0.9, 1.1],
            rotor_resistance_ratio: [0.9, 1.1],
            acceleration_max_rad_s2: acceleration,
            reference_max_rad_s3: acceleration * (gains.reference.bandwidth_rad_s + gains.c_omega),
            load_error_rad_s2: 0.2 * load,
            load_rate_rad_s3: load,
            c_omega: gains.c_omega,
            c_lambda: gains.c_lambda,
            reach_omega: 10.0 * acceleration,
            reach_lambda: 10.0 * flux * flux,
            ..KenneRegion::certain(w, [0.9 * flux, 1.1 * flux], known.current_max_a, 2.0 / 3.0 * case.dc_voltage_v)
        },
        0.05,
    ));
    (gains.k_sq, gains.k_sd) = (k.k_sq, k.k_sd);
    gains.set_boundary_layers(known, rating.rotor_flux_vs, 0.2 / (case.sample_time_s + known.voltage_delay_s));
    let kenne = Kenne::try_new(known, &gains).unwrap();
    let limits = case.limits();
    [
        ("jadot by design", Box::new(Drive::try_new(jadot, &limits).unwrap())),
        ("kenne by design", Box::new(Drive::try_new(kenne, &limits).unwrap())),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: std::env::var("PROPTEST_CASES").ok().and_then(|n| n.parse().ok()).unwrap_or(4), ..ProptestConfig::default() })]
    #[test]
    fn every_drive_follows_and_rejects_on_any_machine((machine, rating) in any_machine()) {
        let truth = with_effects(&machine, &rating);
        let case = DriveCase::new(&machine, &rating, 1e-4);
        for (name, mut drive) in case.drives().chain(designed(&machine, &case)) {
            check(name, drive.as_mut(), &truth, &case)?;
        }
    }
}
