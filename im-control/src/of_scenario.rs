//! The controllers that a `scenario.toml` can name.

use im_model::simulation::{Inverter, Scenario, Source};
use im_model::{Machine, MotorFile};

use crate::modulation::DeadTimeCompensation;
use crate::named::{NAMES, Setting, Supervised, named};
use crate::{Iron, MachineData, MtpaLaw};

/// Largest current over rated current.
const OVERLOAD: f64 = 1.5;

/// The controller of a scenario, where it names one: made for the motor's base parameters and rating, with its effects unknown (but for saturation and iron loss, where the
/// flux is optimal), behind the motor's voltage delay. `least_current` makes the law of `mtpa`.
///
/// # Errors
/// The name is unknown, or scenario and controller do not fit together.
pub fn of_scenario(
    scenario: &Scenario,
    motor: &MotorFile,
    least_current: impl FnOnce(&MotorFile) -> Result<MtpaLaw<f64>, String>,
) -> Result<Option<Box<dyn Supervised>>, String> {
    let Source::Controller { name, observer, references } = &scenario.source else { return Ok(None) };
    let flux = motor.rating.rotor_flux_vs;
    if name != "mtpa" && NAMES.iter().any(|(known, _)| known == name) && references.rotor_flux_vs.largest() <= 0.0 {
        return Err(format!(
            "[controller] rotor_flux_vs is zero: the controller {name} builds up the flux it is asked for; rated flux is {flux:.3} Vs"
        ));
    }
    let rated = motor.rating.current_peak_a(motor.machine.parameters(), motor.machine.pole_pairs());
    let (dc_voltage_v, dead_time) = match scenario.inverter {
        Inverter::Averaged { dc_voltage_v } => (dc_voltage_v, None),
        Inverter::CarrierPwm(pwm, bridge) => {
            (Some(bridge.dc_voltage_v), Some(DeadTimeCompensation::of(&bridge, 2.0 * pwm.half_period_s, 0.03 * rated)))
        }
        Inverter::DeltaModulation(_, bridge) => (Some(bridge.dc_voltage_v), None),
    };
    let law = |motor| least_current(motor).map_err(|e| format!("[controller] {e}"));
    let setting = Setting {
        machine: MachineData::of(&motor.machine, OVERLOAD * rated).delayed(motor.machine.effects().voltage_delay.delay_s),
        rating: motor.rating,
        // Without a limit the sliding gains still need a size: the link that gives the rated voltage.
        dc_voltage_v: dc_voltage_v.unwrap_or(motor.rating.phase_voltage_peak_v * 3f64.sqrt()),
        sample_time_s: scenario.sampling_time_s(),
        dead_time,
        iron: Iron::of(&motor.machine),
        mtpa: if name == "mtpa" { Some(law(motor)?) } else { None },
        observer: observer.as_deref().map(|name| known_observer(name, motor)).transpose()?,
    };
    named(name, &setting).map(Some).map_err(|e| format!("[controller] {e}"))
}

/// The observer of a name, which knows the motor but for its effects: the T circuit, and saturated iron.
fn known_observer(name: &str, motor: &MotorFile) -> Result<(&'static str, Machine<f64>), String> {
    let known = im_observers::NAMES.into_iter().find(|known| *known == name);
    let found = known.ok_or_else(|| {
        format!("[controller] there is no observer named \"{name}\"; there are {}", im_observers::NAMES.join(", "))
    })?;
    Ok((found, motor.machine))
}
