//! A sensorless drive without `std`: one function before the timer starts, one in its interrupt. Links into any firmware.
//!
//! The machine, its rating and the period are those of `examples/motor.toml`; the gains of the observer have a proof, made by
//!
//! ```text
//! im design example-region kubota-loop > region.toml
//! im design kubota-loop --motor examples/motor.toml --region region.toml -o examples/firmware/gains.toml --rust examples/firmware/src/gains.rs
//! ```
//!
//! for 10 to 60 rad/s and slips of 10 rad/s; `im design check examples/firmware/gains.f32.toml` decides it again. For more, widen the two ranges in `region.toml`; what cannot be proven is refused with what can.
#![cfg_attr(not(test), no_std)]

use im_control::modulation::{ZeroSequence, duty_cycles};
use im_control::{ControlError, DriveLimits, DriveStatus, FieldOriented, FieldOrientedGains, MachineData, Reports, Sensorless};
use im_model::simulation::{Command, Controller, Measured, Reference};
use im_model::space_vector::from_phases;
use im_model::{Complex, Machine, Rating, TParameters};
use im_observers::{Basis, Kubota};

mod gains;

/// Time between two calls, s.
const PERIOD_S: f64 = 1e-4;
/// From the sample to where its command begins to act, s: one period, as timers are reloaded at the next sample.
const VOLTAGE_DELAY_S: f64 = PERIOD_S;
/// Rotor flux to keep, Vs.
const FLUX_VS: f32 = 0.9;
/// The machine: the keys of its `motor.toml`.
const PARAMETERS: TParameters<f64> = TParameters {
    stator_resistance_ohm: 1.5,
    rotor_resistance_ohm: 0.9,
    stator_leakage_inductance_h: 0.004,
    rotor_leakage_inductance_h: 0.004,
    magnetizing_inductance_h: 0.156,
    inertia_kg_m2: 0.045,
    viscous_friction_nm_s_per_rad: 0.002,
};
const POLE_PAIRS: u32 = 2;
const RATING: Rating =
    Rating { torque_nm: 26.0, electrical_frequency_hz: 50.0, phase_voltage_peak_v: 326.6, rotor_flux_vs: 0.95 };

/// The drive, and the voltage that the bridge made last. It begins at the first step, with a search for the machine, at rest or turning: keep a
/// clone of it from before, to begin anew with after the bridge was open.
#[derive(Clone)]
pub struct Drive {
    controller: Sensorless<f32, FieldOriented<f32>, Kubota<f32>>,
    made: Complex<f32>,
}

impl Drive {
    /// Once, before the timer starts: everything is checked here.
    ///
    /// # Errors
    /// A quantity that no drive has; the message names it.
    pub fn try_new() -> Result<Self, ControlError> {
        let machine = Machine::base(PARAMETERS, POLE_PAIRS)?;
        let period_s = PERIOD_S as f32;
        let current_a = 1.5 * RATING.current_peak_a(machine.parameters(), POLE_PAIRS);
        let data = MachineData::of(&machine, current_a).delayed(VOLTAGE_DELAY_S).cast::<f32>();
        let controller = FieldOriented::try_new(&data, &FieldOrientedGains::typical(&data, FLUX_VS, period_s))?;
        let observer = Kubota::try_new(Basis::try_new(&machine, &RATING, PERIOD_S)?, gains::kubota_loop::GAINS)?;
        let limits = DriveLimits::generous(&data, RATING.synchronous_speed_rad_s(POLE_PAIRS) as f32, FLUX_VS);
        let controller = Sensorless::try_new(controller, observer, &data, &limits, period_s)?;
        Ok(Self { controller, made: Complex::new(0.0, 0.0) })
    }

    /// In the interrupt: two phase currents and the dc link in, the duty cycles of the legs out; `None` keeps the last ones.
    pub fn step(&mut self, i_a: f32, i_b: f32, dc_voltage_v: f32, speed_rad_s: f32) -> Option<[f32; 3]> {
        let measured = Measured {
            i_s: from_phases([i_a, i_b, -i_a - i_b]),
            omega_m: f32::NAN,
            u_s: self.made,
            dc_voltage_v,
            sample_time_s: PERIOD_S as f32,
        };
        let reference = Reference { omega_m: speed_rad_s, rotor_flux_vs: FLUX_VS, torque_nm: 0.0 };
        let Command::Voltage(u) = self.controller.step(&measured, &reference) else { return None };
        let duty = duty_cycles(u, dc_voltage_v, ZeroSequence::Centred);
        self.made = duty.u_s;
        Some(duty.duty)
    }

    /// What the last step says of itself. Open the bridge on [`DriveStatus::BLOCKED`] and [`DriveStatus::OVERCURRENT`].
    pub fn status(&self) -> DriveStatus {
        self.controller.status()
    }

    /// The estimated speed, mechanical rad/s, once the machine has been found and while the estimate may be used.
    pub fn speed_rad_s(&self) -> Option<f32> {
        let found = !self.status().has(DriveStatus::CATCHING);
        self.controller.estimate().filter(|e| found && e.status.is_valid()).map(|e| e.omega_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_model::space_vector::to_phases;
    use im_model::{Bench, PlantInput, State};

    /// The machine itself for the hardware, as `cargo test` runs it on a host.
    fn run(drive: &mut Drive, hardware: &mut Bench<f32>, samples: usize, speed: f32) {
        // What the timers hold: the command of the sample before.
        let mut held = drive.made;
        for _ in 0..samples {
            let [i_a, i_b, _] = to_phases(hardware.output().i_s);
            let legs = drive.step(i_a, i_b, 560.0, speed).unwrap();
            assert!(legs.iter().all(|d| (0.0..=1.0).contains(d)), "{legs:?}");
            hardware.advance(&PlantInput::new(held, 0.0));
            held = drive.made;
        }
    }

    fn hardware(state: State<f32>) -> Bench<f32> {
        Bench::new(&Machine::base(PARAMETERS, POLE_PAIRS).unwrap().cast::<f32>(), state, PERIOD_S as f32)
    }

    #[test]
    fn the_drive_reaches_its_speed_and_says_so() {
        let mut machine = hardware(State::default());
        let mut drive = Drive::try_new().unwrap();
        run(&mut drive, &mut machine, 20_000, 50.0);
        assert!((machine.output().omega_m - 50.0).abs() < 1.0, "{}", machine.output().omega_m);
        assert!((drive.speed_rad_s().unwrap() - 50.0).abs() < 1.0 && drive.status() == DriveStatus::OK, "{}", drive.status());
    }

    /// The bridge was open: the shaft still turns, with what is left of the flux or without. A drive that has not stepped yet finds it.
    #[test]
    fn a_drive_begins_on_a_shaft_that_coasts() {
        let first = Drive::try_new().unwrap();
        assert_eq!(first.speed_rad_s(), None);
        for flux in [0.0f32, 0.4] {
            let stator = (PARAMETERS.magnetizing_inductance_h
                / (PARAMETERS.magnetizing_inductance_h + PARAMETERS.rotor_leakage_inductance_h)) as f32;
            let psi_r = Complex::new(flux, 0.0);
            let mut machine = hardware(State { psi_r, psi_s: psi_r * stator, ..State::turning(40.0) });
            let mut drive = first.clone();
            run(&mut drive, &mut machine, 100, 50.0);
            assert!(drive.status().has(DriveStatus::CATCHING) && drive.speed_rad_s().is_none());
            run(&mut drive, &mut machine, 20_000, 50.0);
            assert!((machine.output().omega_m - 50.0).abs() < 1.0 && drive.status() == DriveStatus::OK, "{}", drive.status());
        }
    }
}
