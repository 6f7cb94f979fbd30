//! The run itself.

use std::cell::Cell;

use num_complex::Complex;
use num_traits::Zero;
use thiserror::Error;

use crate::bench::Bench;
use crate::error::ModelError;
use crate::instant::PlantInput;
use crate::machine::Machine;
use crate::plant::Plant;
use crate::recording::Recording;
use crate::simulation::bridge::{Bridge, Fed, Legs};
use crate::simulation::carrier_pwm::CarrierPwm;
use crate::simulation::controller::{Command, Controller, Measured};
use crate::simulation::scenario::{Inverter, Scenario, Source, Start};
use crate::simulation::supply::{Mains, turn};
use crate::space_vector::unit;
use crate::state::State;
use crate::steady_state::steady_state;

/// How often progress is reported, in samples.
const REPORT_EVERY: usize = 2048;
/// Steps per turn of the mains, at least: the voltage is held at its mean over each, an error of (2π/n)²/24.
const STEPS_PER_TURN: f64 = 2000.0;

/// Why a simulation cannot be run, or ended early.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum SimulationError {
    /// A value of the scenario is out of bounds, or there is no steady state to start from.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The sampling time is not a whole multiple of the inverter's period.
    #[error(
        "a sample of {sample_time_s} s holds {periods:.3} periods of {period_s:.4e} s of the inverter, expected a whole number (the \
         period is half a carrier period, or that of the delta modulator)"
    )]
    PeriodDoesNotDivide {
        /// Sampling time, s.
        sample_time_s: f64,
        /// Period of the inverter, s.
        period_s: f64,
        /// Their ratio.
        periods: f64,
    },
    /// The source and the inverter do not fit together.
    #[error("{0}")]
    Mismatch(&'static str),
    /// The scenario is for a controller and none was given.
    #[error("the scenario asks for the controller {0}, and none was given")]
    NoController(String),
    /// The numbers left the finite range.
    #[error(
        "the simulation left the finite range at t = {} s: an unstable controller, or a sampling time too long for the machine",
        (time_s * 1e6).round() / 1e6
    )]
    Diverged {
        /// When, s.
        time_s: f64,
    },
}

/// What a run gives.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// The recording: commands as averages over the sample, outputs as the sensors show them.
    pub recording: Recording,
    /// What no sensor shows, where asked for.
    pub internals: Option<Internals>,
    /// The state at the end.
    pub state: State<f64>,
}

/// Quantities inside the machine at the rows of the recording.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Internals {
    /// Electromagnetic torque, Nm.
    pub torque_nm: Vec<f64>,
    /// States.
    pub states: Vec<State<f64>>,
    /// Magnetizing flux linkage, Vs.
    pub psi_m: Vec<Complex<f64>>,
}

/// A machine, a scenario, and how to run them.
pub struct Simulation<'a> {
    machine: &'a Machine<f64>,
    scenario: &'a Scenario,
    controller: Option<&'a mut dyn Controller<f64>>,
    progress: Option<&'a mut dyn FnMut(usize, usize)>,
    ended: Option<&'a Cell<bool>>,
    internals: bool,
}

impl<'a> Simulation<'a> {
    /// A simulation of `machine` in `scenario`.
    pub fn new(machine: &'a Machine<f64>, scenario: &'a Scenario) -> Self {
        Self { machine, scenario, controller: None, progress: None, ended: None, internals: false }
    }

    /// The controller for a scenario whose source is [`Source::Controller`].
    pub fn controlled_by(mut self, controller: &'a mut dyn Controller<f64>) -> Self {
        self.controller = Some(controller);
        self
    }

    /// Calls `tell(samples done, samples in all)` now and then, and at the end.
    pub fn with_progress(mut self, tell: &'a mut dyn FnMut(usize, usize)) -> Self {
        self.progress = Some(tell);
        self
    }

    /// Ends before the duration of the scenario is over, once this is set: by a controller that has done its work.
    pub fn until(mut self, ended: &'a Cell<bool>) -> Self {
        self.ended = Some(ended);
        self
    }

    /// Keeps torque, fluxes, temperatures and the other states too.
    pub fn with_internals(mut self) -> Self {
        self.internals = true;
        self
    }

    /// Runs.
    ///
    /// # Errors
    /// The scenario is not valid, its parts do not fit together, the start is no steady state, or the numbers leave the finite range.
    pub fn run(mut self) -> Result<Run, SimulationError> {
        let s = self.scenario;
        s.validate()?;
        let t_s = s.sampling_time_s();
        let periods = periods(s)?;
        let dc_voltage_v = match s.inverter {
            Inverter::Averaged { dc_voltage_v } => dc_voltage_v.unwrap_or(0.0),
            Inverter::CarrierPwm(_, b) | Inverter::DeltaModulation(_, b) => b.dc_voltage_v,
        };
        if matches!(s.source, Source::Mains(_)) && s.inverter != (Inverter::Averaged { dc_voltage_v: None }) {
            return Err(SimulationError::Mismatch("the mains feed the machine directly: there is no inverter to describe"));
        }
        Plant::new(self.machine).followed(t_s)?;
        let (start, past) = self.start()?;
        let mut bench = Bench::new(self.machine, start, t_s);
        bench.set_past_command(past);
        let mut sensors = s.sensors.reader();
        let mut legs = Legs::default();
        let mut vector = [first_frequency(s), 0.0];
        let mut u_before = past;

        let n = s.samples();
        let every = s.record_every as usize;
        let rows = n.div_ceil(every);
        let mut recording = Recording {
            name: s.name.clone(),
            start_s: if let Source::Recording(r) = &s.source { r.start_s } else { 0.0 },
            sample_time_s: t_s * every as f64,
            u_s: Vec::with_capacity(rows),
            i_s: Vec::with_capacity(rows),
            omega_m: Vec::with_capacity(rows),
            tau_load: s.imposed_speed.is_none().then(|| Vec::with_capacity(rows)),
        };
        let mut internals = self.internals.then(Internals::default);
        let mut u_sum = Complex::zero();

        for k in 0..n {
            if self.ended.is_some_and(Cell::get) {
                // A row that has begun has no voltage yet.
                let rows = recording.u_s.len();
                recording.i_s.truncate(rows);
                recording.omega_m.truncate(rows);
                recording.tau_load.iter_mut().for_each(|tau| tau.truncate(rows));
                if let Some(i) = &mut internals {
                    i.torque_nm.truncate(rows);
                    i.psi_m.truncate(rows);
                    i.states.truncate(rows);
                }
                break;
            }
            let t = t_s * k as f64;
            let shown = sensors.read(bench.output());
            if !(shown.i_s.re.is_finite() && shown.i_s.im.is_finite() && shown.omega_m.is_finite()) {
                return Err(SimulationError::Diverged { time_s: t });
            }
            let state = bench.state();
            let recorded_load = if let Source::Recording(r) = &s.source { r.tau_load.as_ref().map(|x| x[k]) } else { None };
            let tau_load = recorded_load.unwrap_or(0.0) + s.load.at(t, bench.plant().load_speed(state));
            let imposed_speed = s.imposed_speed.as_ref().map(|p| [p.at(t), p.at(t + t_s)]);
            if k % every == 0 {
                recording.i_s.push(shown.i_s);
                recording.omega_m.push(shown.omega_m);
                if let Some(tau) = &mut recording.tau_load {
                    tau.push(sensors.torque(tau_load));
                }
                if let Some(i) = &mut internals {
                    i.torque_nm.push(bench.plant().torque(state));
                    i.psi_m.push(bench.plant().currents(state).psi_m);
                    i.states.push(*state);
                }
            }
            let command = match &s.source {
                Source::Recording(r) => Command::Voltage(r.u_s[k]),
                Source::Mains(mains) => Command::Voltage(mains.mean(t, t + t_s)),
                Source::VoltsPerHertz(v, profile) => Command::Voltage(v.step(&mut vector, profile.at(t), t_s)),
                Source::RotatingCurrent { amplitude_a, frequency_hz } => {
                    Command::Current(turn(&mut vector[1], frequency_hz.at(t), t_s) * amplitude_a.at(t))
                }
                Source::Controller { name, references, .. } => {
                    let Some(controller) = &mut self.controller else {
                        return Err(SimulationError::NoController(name.clone()));
                    };
                    let measured =
                        Measured { i_s: shown.i_s, omega_m: shown.omega_m, u_s: u_before, dc_voltage_v, sample_time_s: t_s };
                    controller.step(&measured, &references.at(t))
                }
            };
            let input = |u_s| PlantInput { imposed_speed, ..PlantInput::new(u_s, tau_load) };
            let applied = match (&s.source, s.inverter, command) {
                (Source::Mains(mains), _, Command::Voltage(u)) => {
                    let delay = bench.transport_delay();
                    let steps = (t_s * mains.frequency_hz.abs() * STEPS_PER_TURN).ceil().max(1.0) as u32;
                    let steps = steps.max(bench.substeps());
                    bench.advance_with(u, |plant, x, _| along_mains(plant, x, mains, t - delay, t_s, steps, &input(u)));
                    u
                }
                (_, Inverter::Averaged { dc_voltage_v }, Command::Voltage(u)) => {
                    let u = dc_voltage_v.map_or(u, |v| Bridge::ideal(v).limited(u));
                    bench.advance(&input(u));
                    u
                }
                (_, Inverter::CarrierPwm(pwm, bridge), Command::Voltage(u)) => {
                    let limited = bridge.limited(u);
                    bench.advance_with(limited, |plant, x, late| {
                        let mut fed = FedMachine::new(plant, x, input(late), t_s);
                        let duty = CarrierPwm::duty_cycles(&bridge, late);
                        for half in 0..periods {
                            pwm.half_period(&bridge, &mut legs, duty, (k * periods + half).is_multiple_of(2), &mut fed);
                        }
                    });
                    limited
                }
                (_, Inverter::DeltaModulation(delta, bridge), Command::Current(wanted)) => {
                    bench.advance_with(Complex::zero(), |plant, x, _| {
                        let mut fed = FedMachine::new(plant, x, input(Complex::zero()), t_s);
                        for _ in 0..periods {
                            delta.period(&bridge, &mut legs, wanted, &mut fed, |i| plant.measured_current(i));
                        }
                    });
                    legs.take_commanded_vs() / t_s
                }
                (_, Inverter::DeltaModulation(..), Command::Voltage(_)) => {
                    return Err(SimulationError::Mismatch("delta modulation follows a current; the source gives a voltage"));
                }
                (_, _, Command::Current(_)) => {
                    return Err(SimulationError::Mismatch("a current reference needs delta modulation as the inverter"));
                }
            };
            if !(applied.re.is_finite() && applied.im.is_finite()) {
                return Err(SimulationError::Diverged { time_s: t });
            }
            u_before = applied;
            u_sum += applied;
            if (k + 1) % every == 0 || k + 1 == n {
                recording.u_s.push(u_sum / (k % every + 1) as f64);
                u_sum = Complex::zero();
            }
            if let Some(tell) = self.progress.as_mut().filter(|_| (k + 1) % REPORT_EVERY == 0 || k + 1 == n) {
                tell(k + 1, n);
            }
        }
        if !bench.state().is_finite() {
            return Err(SimulationError::Diverged { time_s: t_s * n as f64 });
        }
        Ok(Run { recording, internals, state: *bench.state() })
    }

    /// The first state, and the voltage before it.
    fn start(&self) -> Result<(State<f64>, Complex<f64>), SimulationError> {
        let held = match &self.scenario.start {
            Start::Rest => return Ok((State::default(), Complex::zero())),
            Start::State(x) => return Ok((*x, Complex::zero())),
            Start::SteadyState(held) => *held,
        };
        let (u, frequency, phase) = match &self.scenario.source {
            Source::Mains(m) if m.closing_s <= 0.0 => (m.voltage_peak_v, m.frequency_hz, m.phase_rad),
            Source::VoltsPerHertz(v, profile) => (v.amplitude_v(profile.at(0.0)), profile.at(0.0), 0.0),
            _ => {
                let why = "a steady start needs the mains, closed from the beginning, or volts per hertz";
                return Err(SimulationError::Mismatch(why));
            }
        };
        let x = steady_state(self.machine, u, frequency, held)?.in_frame(-phase);
        let half = core::f64::consts::PI * frequency * self.scenario.sampling_time_s();
        Ok((x, unit(phase - half) * u))
    }
}

/// From standstill the frequency ramps up too.
fn first_frequency(s: &Scenario) -> f64 {
    match (&s.source, &s.start) {
        (_, Start::Rest) => 0.0,
        (Source::VoltsPerHertz(_, profile), _) => profile.at(0.0),
        _ => 0.0,
    }
}

/// How many periods of the inverter a sample holds.
fn periods(s: &Scenario) -> Result<usize, SimulationError> {
    let Some(period_s) = s.inverter.period_s() else { return Ok(1) };
    let sample_time_s = s.sampling_time_s();
    let periods = sample_time_s / period_s;
    if (periods - periods.round()).abs() > 1e-6 {
        return Err(SimulationError::PeriodDoesNotDivide { sample_time_s, period_s, periods });
    }
    Ok(periods.round() as usize)
}

/// Integrates over a sample with the mains' voltage at its mean over each step.
fn along_mains(
    plant: &Plant<f64>,
    x: &mut State<f64>,
    mains: &Mains<f64>,
    t: f64,
    t_s: f64,
    steps: u32,
    input: &PlantInput<f64>,
) {
    let h = t_s / f64::from(steps);
    for k in 0..steps {
        let begin = t + h * f64::from(k);
        let share = [f64::from(k) / f64::from(steps), f64::from(k + 1) / f64::from(steps)];
        let imposed_speed = input.imposed_speed.map(|[a, b]| share.map(|s| a + (b - a) * s));
        *x = plant.step(x, &PlantInput { u_s: mains.mean(begin, begin + h), imposed_speed, ..*input }, h);
    }
}

/// A machine on a bridge, within a sample.
struct FedMachine<'a> {
    plant: &'a Plant<f64>,
    state: &'a mut State<f64>,
    input: PlantInput<f64>,
    elapsed_s: f64,
    sample_time_s: f64,
}

impl<'a> FedMachine<'a> {
    fn new(plant: &'a Plant<f64>, state: &'a mut State<f64>, input: PlantInput<f64>, sample_time_s: f64) -> Self {
        Self { plant, state, input, elapsed_s: 0.0, sample_time_s }
    }

    fn step(&mut self, u_s: Complex<f64>, h: f64) {
        let share = [self.elapsed_s, self.elapsed_s + h].map(|t| t / self.sample_time_s);
        let imposed_speed = self.input.imposed_speed.map(|[a, b]| share.map(|s| a + (b - a) * s));
        *self.state = self.plant.step(self.state, &PlantInput { u_s, imposed_speed, ..self.input }, h);
        self.elapsed_s += h;
    }
}

impl Fed<f64> for FedMachine<'_> {
    fn i_s(&self) -> Complex<f64> {
        self.plant.currents(self.state).i_s
    }

    fn hold(&mut self, u_s: Complex<f64>, duration: f64) {
        let n = self.plant.substeps(duration);
        for _ in 0..n {
            self.step(u_s, duration / f64::from(n));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machines::MOTULATOR_2_2_KW as M;
    use crate::{Effects, Machine};

    #[test]
    fn an_imposed_speed_runs_evenly_through_a_sample_however_it_is_cut() {
        let machine = Machine::try_new(M.parameters(), M.pole_pairs, Effects::none()).unwrap();
        let plant = Plant::new(&machine);
        let mut x = State::default();
        let input = PlantInput { imposed_speed: Some([10.0, 14.0]), ..PlantInput::new(Complex::default(), 0.0) };
        let mut fed = FedMachine::new(&plant, &mut x, input, 1e-4);
        for (duration, speed) in [(0.25e-4, 11.0), (0.5e-4, 13.0), (0.25e-4, 14.0)] {
            fed.hold(Complex::default(), duration);
            assert!((fed.state.omega_m - speed).abs() < 1e-12, "{} {speed}", fed.state.omega_m);
        }
        // The angle is the integral of the speed: 12 rad/s in the mean.
        assert!((x.theta_m - 12e-4).abs() < 1e-12, "{}", x.theta_m);
    }
}
