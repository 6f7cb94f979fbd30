//! Properties of controllers. The controller is the caller's: one of `im-control` or another implementation of [`Controller`].

use im_control::MachineData;
use im_model::simulation::{Command, Controller, Measured, Reference};
use im_model::{Machine, Plant, PlantInput, State};

use crate::claim::{C, ClaimCase};
use crate::verdict::Verdict;

/// Sampling time of the loops here, s.
pub const STEP: f64 = 1e-4;

/// The largest current of the drives here over the rated one.
pub const OVERLOAD: f64 = 1.5;

/// What a controller may know of a case's machine: everything, 1.5 times the rated current, no delay.
pub fn known(case: &ClaimCase) -> MachineData<f64> {
    MachineData::of(case.machine(), OVERLOAD * case.current())
}

/// A dc link that gives the rated voltage with a twelfth to spare, V.
pub fn dc_voltage_v(case: &ClaimCase) -> f64 {
    case.rating().phase_voltage_peak_v * 3f64.sqrt() / 0.92
}

/// Time in which a machine is magnetized, and in which its flux settles: six rotor time constants, 0.3 s at least.
pub fn magnetizing_s(case: &ClaimCase) -> f64 {
    (6.0 / case.constants().eta).max(0.3)
}

/// Time in which two thirds of rated torque run it up to rated speed, s; at least 0.3 s.
pub fn run_up_s(case: &ClaimCase) -> f64 {
    (1.5 * case.parameters().inertia_kg_m2 * case.speed() / case.rating().torque_nm).max(0.3)
}

/// A machine under a controller in sampled time; the machine may change on the way.
#[derive(Clone, Debug)]
pub struct Loop {
    plant: Plant<f64>,
    /// The state of the machine.
    pub state: State<f64>,
    u_s: C,
    dc_voltage_v: f64,
    /// Sampling time, s.
    pub sample_time_s: f64,
}

impl Loop {
    /// At rest without flux, behind an inverter with this dc voltage; zero for no limit.
    pub fn new(machine: &Machine<f64>, dc_voltage_v: f64, sample_time_s: f64) -> Self {
        Self { plant: Plant::new(machine), state: State::default(), u_s: C::new(0.0, 0.0), dc_voltage_v, sample_time_s }
    }

    /// What is measured now.
    pub fn measured(&self) -> Measured<f64> {
        Measured {
            i_s: self.plant.currents(&self.state).i_s,
            omega_m: self.state.omega_m,
            u_s: self.u_s,
            dc_voltage_v: self.dc_voltage_v,
            sample_time_s: self.sample_time_s,
        }
    }

    /// One sample with what was measured (with noise, perhaps). Controllers that command currents are not for this loop: they get zero volts.
    pub fn advance(
        &mut self,
        controller: &mut impl Controller<f64>,
        measured: &Measured<f64>,
        reference: &Reference<f64>,
        load_nm: f64,
    ) {
        self.u_s = match controller.step(measured, reference) {
            Command::Voltage(u) => u,
            Command::Current(_) => C::new(0.0, 0.0),
        };
        self.state = self.plant.step(&self.state, &PlantInput::new(self.u_s, load_nm), self.sample_time_s);
    }
}

/// Limits of [`follows_speed`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Following {
    /// Largest error of the mean speed over the speed asked for, before and under load.
    pub speed: f64,
    /// Largest error of the rotor flux over the flux asked for, in the steady states.
    pub flux: f64,
    /// Largest current over the largest that the controller may use.
    pub current: f64,
}

/// Magnetized, run up to `speed_share` of the rated speed, loaded with `load_share` of the rated torque: speed and flux follow, and the
/// current stays within its limit. `truth` is the machine under control: the case's, or one that differs from what the controller knows.
pub fn follows_speed(
    case: &ClaimCase,
    truth: &Machine<f64>,
    controller: &mut impl Controller<f64>,
    [speed_share, load_share]: [f64; 2],
    limits: &Following,
) -> Verdict {
    let (w, flux) = (speed_share * case.speed(), 0.95 * case.rating().rotor_flux_vs);
    let up = magnetizing_s(case);
    // One rotor time constant and the slowest loop of a drive each have their time.
    let hold = up.max(2.0);
    let on = up + run_up_s(case) + hold;
    let end = on + hold;
    let mut drive = Loop::new(truth, dc_voltage_v(case), STEP);
    let [mut speed_error, mut flux_error, mut peak] = [0.0f64; 3];
    let mut window = (0.0, 0);
    for k in 0..(end / STEP) as usize {
        let t = STEP * k as f64;
        let asked = w * ((t - up) / run_up_s(case)).clamp(0.0, 1.0);
        let reference = Reference { omega_m: asked, rotor_flux_vs: flux, torque_nm: 0.0 };
        let measured = drive.measured();
        drive.advance(controller, &measured, &reference, if t > on { load_share * case.rating().torque_nm } else { 0.0 });
        peak = peak.max(measured.i_s.norm());
        // The last 50 ms before the load and before the end.
        let left = if t < on { on - t } else { end - t };
        if left < 0.05 {
            window = (window.0 + drive.state.omega_m, window.1 + 1);
            flux_error = flux_error.max((drive.state.psi_r.norm() / flux - 1.0).abs());
        } else if window.1 > 0 {
            speed_error = speed_error.max((window.0 / f64::from(window.1) / w - 1.0).abs());
            window = (0.0, 0);
        }
    }
    speed_error = speed_error.max((window.0 / f64::from(window.1.max(1)) / w - 1.0).abs());
    Verdict::at_most("speed error", speed_error, limits.speed)
        .and(Verdict::at_most("flux error", flux_error, limits.flux))
        .and(Verdict::at_most("current over the limit", peak / (OVERLOAD * case.current()), limits.current))
}
