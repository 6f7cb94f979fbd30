//! The controllers that a `scenario.toml` can name.

use im_control::MachineData;
use im_control::modulation::DeadTimeCompensation;
use im_control::named::{NAMES, Setting, Supervised, named};
use im_model::MotorFile;
use im_model::simulation::{Inverter, Scenario, Source};

/// Torque up to which the law of `mtpa` is made, over rated torque; and down to which.
#[cfg(feature = "design")]
const LAW_RANGE: [f64; 2] = [0.02, 1.5];
/// Largest current over rated current.
const OVERLOAD: f64 = 1.5;

/// The controller of a scenario, where it names one: made for the motor's base parameters and rating, with its effects unknown, behind the
/// motor's voltage delay.
///
/// # Errors
/// The name is unknown, or scenario and controller do not fit together.
pub fn of(scenario: &Scenario, motor: &MotorFile) -> Result<Option<Box<dyn Supervised>>, String> {
    let Source::Controller { name, observer, references } = &scenario.source else { return Ok(None) };
    let flux = motor.rating.rotor_flux_vs;
    if name != "mtpa" && NAMES.iter().any(|(known, _)| known == name) && references.rotor_flux_vs.largest() <= 0.0 {
        return Err(format!(
            "[controller] rotor_flux_vs is zero: the controller {name} builds up the flux it is asked for; rated flux is {flux:.3} Vs"
        ));
    }
    let (dc_voltage_v, dead_time) = match scenario.inverter {
        Inverter::Averaged { dc_voltage_v } => (dc_voltage_v, None),
        Inverter::CarrierPwm(pwm, bridge) => {
            let rated = motor.rating.current_peak_a(motor.machine.parameters(), motor.machine.pole_pairs());
            (Some(bridge.dc_voltage_v), Some(DeadTimeCompensation::of(&bridge, 2.0 * pwm.half_period_s, 0.03 * rated)))
        }
        Inverter::DeltaModulation(_, bridge) => (Some(bridge.dc_voltage_v), None),
    };
    let current = OVERLOAD * motor.rating.current_peak_a(motor.machine.parameters(), motor.machine.pole_pairs());
    let setting = Setting {
        machine: MachineData::of(&motor.machine, current).delayed(motor.machine.effects().voltage_delay.delay_s),
        rating: motor.rating,
        // Without a limit the sliding gains still need a size: the link that gives the rated voltage.
        dc_voltage_v: dc_voltage_v.unwrap_or(motor.rating.phase_voltage_peak_v * 3f64.sqrt()),
        sample_time_s: scenario.sampling_time_s(),
        dead_time,
        mtpa: if name == "mtpa" { law(motor)? } else { None },
        observer: observer.as_deref().map(|name| known_observer(name, motor)).transpose()?,
    };
    named(name, &setting).map(Some).map_err(|e| format!("[controller] {e}"))
}

/// The observer of a name, which knows the motor but for its effects: the T circuit, and saturated iron.
fn known_observer(name: &str, motor: &MotorFile) -> Result<(&'static str, im_model::Machine<f64>), String> {
    let known = im_observers::NAMES.into_iter().find(|known| *known == name);
    let found = known.ok_or_else(|| {
        format!("[controller] there is no observer named \"{name}\"; there are {}", im_observers::NAMES.join(", "))
    })?;
    Ok((found, motor.machine))
}

/// Least current for the torque, from the motor's circuit with its main-flux saturation.
#[cfg(feature = "design")]
fn law(motor: &MotorFile) -> Result<Option<im_control::MtpaLaw<f64>>, String> {
    let range = LAW_RANGE.map(|x| x * motor.rating.torque_nm);
    let refused = |e: String| format!("[controller] no law of least current for this motor: {e}");
    let fit = {
        let circuit = im_design::mtpa::Circuit::of(&motor.machine);
        im_design::mtpa::laws::fit_log(&circuit, range, 0.01).map_err(|e| refused(e.to_string()))?
    };
    im_control::MtpaLaw::series(fit.torque_n_m, &fit.current, &fit.slip).map(Some).map_err(|e| refused(e.to_string()))
}

#[cfg(not(feature = "design"))]
fn law(_: &MotorFile) -> Result<Option<im_control::MtpaLaw<f64>>, String> {
    Err("[controller] mtpa needs a law of least current: build this program with its feature \"design\"".to_owned())
}
