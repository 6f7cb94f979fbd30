//! Effects that a sinusoidal steady state shows.

use im_model::{Evaluation, Held, Machine, ModelError, Plant, PlantInput, State, steady_state};

use super::{Picture, Studio, pair};

/// A curve over `x`: a steady state for each, and what is read from it.
fn curve(
    machine: &Machine<f64>,
    range: [f64; 2],
    supply: impl Fn(f64) -> (f64, f64, Held),
    read: impl Fn(&Evaluation<f64>, &State<f64>) -> f64,
) -> Result<Vec<(f64, f64)>, ModelError> {
    let plant = Plant::new(machine);
    (0..=60)
        .map(|k| {
            let x = range[0] + (range[1] - range[0]) * f64::from(k) / 60.0;
            let (voltage, frequency, held) = supply(x);
            let state = steady_state(machine, voltage, frequency, held)?;
            let e = plant.evaluate(&state, &PlantInput::new(im_model::Complex::new(voltage, 0.0), 0.0));
            Ok((x, read(&e, &state)))
        })
        .collect()
}

fn current(e: &Evaluation<f64>, _: &State<f64>) -> f64 {
    e.currents.i_s.norm()
}

/// Both machines over the voltage, at rated frequency without load.
fn no_load(s: &Studio, machine: &Machine<f64>) -> Result<Vec<(f64, f64)>, ModelError> {
    let r = &s.rating;
    curve(machine, [0.1, 1.2], |x| (x * r.phase_voltage_peak_v, r.electrical_frequency_hz, Held::Load(0.0)), current)
}

pub fn main_flux_saturation(s: &Studio) -> Result<Picture, ModelError> {
    let with = s.with(|e| e.main_flux_saturation.excess = 0.8)?;
    let parts = vec![pair("current, A peak", no_load(s, &s.base)?, no_load(s, &with)?)];
    Ok(("No load at rated frequency; k = 0.8, S = 7", "voltage over rated voltage", parts))
}

pub fn voltage_gain(s: &Studio) -> Result<Picture, ModelError> {
    // The voltage of a steady state is that at the terminals: the gain is on the way there.
    let with = s.with(|e| e.voltage_gain.gain = -0.08)?;
    let parts = vec![pair("current, A peak", no_load(s, &s.base)?, no_load(s, &with)?)];
    Ok(("No load at rated frequency; g = −0.08", "commanded voltage over rated voltage", parts))
}

pub fn leakage_flux_saturation(s: &Studio) -> Result<Picture, ModelError> {
    let with = s.with(|e| e.leakage_flux_saturation.drop = 0.8)?;
    let r = &s.rating;
    let locked = |machine: &Machine<f64>| {
        curve(machine, [0.05, 1.0], |x| (x * r.phase_voltage_peak_v, r.electrical_frequency_hz, Held::Speed(0.0)), current)
    };
    let parts = vec![pair("current, A peak", locked(&s.base)?, locked(&with)?)];
    Ok(("Locked rotor at rated frequency; κ = 0.8", "voltage over rated voltage", parts))
}

pub fn rotor_skin_effect(s: &Studio) -> Result<Picture, ModelError> {
    let with = s.with(|e| e.rotor_skin_effect.resistance_rise = 1.5)?;
    let r = &s.rating;
    let supply = |x: f64| (r.phase_voltage_peak_v, r.electrical_frequency_hz, Held::Speed(x * s.synchronous));
    let torque = |machine: &Machine<f64>| curve(machine, [0.0, 1.0], supply, |e, _| e.torque);
    let parts = vec![pair("torque, Nm", torque(&s.base)?, torque(&with)?)];
    Ok(("Rated voltage and frequency; k = 1.5, τ = 3 ms", "speed over synchronous speed", parts))
}

pub fn iron_loss(s: &Studio) -> Result<Picture, ModelError> {
    let with = s.with(|e| e.iron_loss.conductance_s = 1.5e-3)?;
    let r = &s.rating;
    let at_constant_flux = |x: f64| (x / r.electrical_frequency_hz * r.phase_voltage_peak_v, x, Held::Load(0.0));
    let input = |machine: &Machine<f64>| curve(machine, [5.0, 50.0], at_constant_flux, |e, _| e.powers.electrical_input);
    let parts = vec![pair("input power, W", input(&s.base)?, input(&with)?)];
    Ok(("No load at constant flux; G = 1.5 mS", "frequency, Hz", parts))
}

/// The brake of friction over speed, from its power.
fn brake(machine: &Machine<f64>, range: [f64; 2]) -> Vec<(f64, f64)> {
    let plant = Plant::new(machine);
    let speeds = (0..=400).map(|k| range[0] + (range[1] - range[0]) * f64::from(k) / 400.0);
    let at = |omega_m: f64| {
        let e = plant.evaluate(&State { omega_m, ..State::default() }, &PlantInput::new(im_model::Complex::new(0.0, 0.0), 0.0));
        (omega_m, e.powers.friction / omega_m)
    };
    speeds.filter(|w| w.abs() > 1e-6).map(at).collect()
}

pub fn coulomb_friction(s: &Studio) -> Result<Picture, ModelError> {
    let with = s.with(|e| {
        e.coulomb_friction.torque_nm = 0.5;
        e.coulomb_friction.stribeck_rise = 0.5;
    })?;
    let range = [-0.25 * s.synchronous, 0.25 * s.synchronous];
    let parts = vec![pair("brake, Nm", brake(&s.base, range), brake(&with, range))];
    Ok(("Torque of the friction; T_C = 0.5 Nm, s = 0.5", "speed, rad/s", parts))
}

pub fn windage(s: &Studio) -> Result<Picture, ModelError> {
    let with = s.with(|e| e.windage.coefficient_nm_s2 = 6e-5)?;
    let range = [-s.synchronous, s.synchronous];
    let parts = vec![pair("brake, Nm", brake(&s.base, range), brake(&with, range))];
    Ok(("Torque of the drag; c = 6·10⁻⁵ Nm s²", "speed, rad/s", parts))
}
