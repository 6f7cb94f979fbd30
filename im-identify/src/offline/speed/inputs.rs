//! Noise of a measured voltage, and a switch that closed between two samples of it: the machine is driven by what its sensors show. What that is off by
//! makes currents that last for the leakage time constant and, where the shaft turns freely, a speed that lasts longer still. No noise of the other
//! sensors does.

use im_model::{EffectId, Machine, State};

use super::flux::{Electrical, Fluxes};
use super::voltage::Seen;
use super::{Unknown, UnsureInputs, Volts, Wandering};
use crate::offline::channel::ChannelKind;
use crate::offline::experiment::Experiment;
use crate::offline::load::Load;

/// The variance that the noise of the voltage adds to the currents, over that of their sensors, from which on it is counted.
pub(super) const SEEN: f64 = 1e-3;

/// Over the noise of a current sensor, what that of the voltage may make of the current within a row. It is in the slopes as well, and a machine that passes
/// less of it, by more leakage or a delay, fits better, true or not: estimates lean by the square of this part, and beyond it noise is not counted.
const LEANS: f64 = 0.3;

impl Experiment {
    /// The same run with what `machine` says of its inputs: how its speed moves where the load is unknown, and which part of currents and speed their
    /// noise makes.
    pub fn with_inputs_by(self, machine: &Machine<f64>, start: &State<f64>) -> Self {
        self.smoothed_by_torque(machine, start).with_speed_found_by(machine, start).with_voltage_noise_by(machine, start)
    }

    /// The same run with its speed nudged towards these values, one per row, rad/s, at a rate, 1/s.
    pub fn nudged_towards(mut self, omega_m: Vec<f64>, rate: f64) -> Self {
        self.speed_nudge = Some((omega_m, rate));
        if let Some(Seen { omega_m, unsure }) = self.voltage_noise.seen.take() {
            let (speed, t) = (self.coasting(&unsure.electrical), self.sample_time_s);
            let unknown =
                Unknown { speed: if unsure.unknown.shaft_is_free { speed } else { unsure.unknown.speed }, ..unsure.unknown };
            let run = (omega_m.iter().copied(), unsure.psi);
            let unsure = UnsureInputs::new(&self.channels, unsure.electrical, run, t, unknown);
            self.voltage_noise.seen = Some(Seen { omega_m, unsure });
        }
        self
    }

    /// Whether what the noise of the voltage makes of the currents shows beside that of their sensors.
    pub fn shows_voltage_noise(&self, machine: &Machine<f64>) -> bool {
        let electrical = Electrical::of(&self.machine_of(machine, 0));
        let made = electrical.noise_by(self.voltage_noise.volts.sigma_v, self.sample_time_s);
        let mut currents = self.channels.iter().filter(|c| matches!(c.kind, ChannelKind::Current { .. }));
        currents.any(|c| made > SEEN * c.sigma.powi(2))
    }

    /// What the noise of the voltage makes of the current within a row, over the noise of the current sensors.
    pub fn voltage_noise_in_a_row(&self, machine: &Machine<f64>) -> f64 {
        let leakage_h = machine.parameters().inverse_gamma().leakage_inductance_h;
        let made_a = self.voltage_noise.volts.sigma_v * self.sample_time_s / leakage_h;
        let currents = self.channels.iter().filter(|c| matches!(c.kind, ChannelKind::Current { .. }));
        currents.map(|c| made_a / c.sigma).fold(0.0, f64::max)
    }

    /// Whether that is too much to be counted as noise.
    pub fn is_voltage_too_noisy(&self, machine: &Machine<f64>) -> bool {
        self.voltage_noise_in_a_row(machine) > LEANS
    }

    fn with_voltage_noise_by(mut self, machine: &Machine<f64>, start: &State<f64>) -> Self {
        let t = self.sample_time_s;
        self.voltage_noise.seen = None;
        let electrical = Electrical::of(&self.machine_of(machine, 0));
        let mut voltage = self.voltage_noise.volts.clone();
        if !self.shows_voltage_noise(machine) || self.is_voltage_too_noisy(machine) {
            voltage.sigma_v = 0.0;
        }
        if self.is_table() || voltage == Volts::default() {
            return self;
        }
        let (omega_m, psi) = self.turns(machine, start);
        let known = (self.coasting(&electrical), self.imposed_speed.is_none());
        let (speed, shaft_is_free) = match &self.load {
            Load::Known | Load::Law { .. } => known,
            Load::Unknown(shown) => (shown.noise.clone(), false),
            Load::Unseen(found) => (found.unsure.unknown.speed.clone(), false),
        };
        let is_noisy = voltage.sigma_v > 0.0 || voltage.taken_v > 0.0;
        let unknown = Unknown { speed, voltage, shaft_is_free, fluxes: 0.0 };
        let unsure = UnsureInputs::new(&self.channels, electrical, (omega_m.iter().copied(), psi), t, unknown);
        self.voltage_noise.seen = Some(Seen { omega_m, unsure });
        if is_noisy {
            // No command is: the terminals were measured.
            self.inert = Some(EffectId::InverterNonlinearity);
        }
        self
    }

    /// How a change of the speed goes on where nothing but the machine moves it.
    fn coasting(&self, electrical: &Electrical) -> Wandering {
        let nudge = self.speed_nudge.as_ref().map_or(0.0, |(_, rate)| *rate);
        Wandering::coasting(electrical.coasting(nudge, self.sample_time_s), self.len())
    }

    /// Speed and fluxes of `machine` at every row, on the speed that was measured where one was.
    fn turns(&self, machine: &Machine<f64>, start: &State<f64>) -> (Vec<f64>, Vec<Fluxes>) {
        let measured = self.channels.iter().find(|c| c.kind == ChannelKind::Speed && c.valid.is_none());
        let shown = self.imposed_speed.as_ref().or(measured.map(|c| &c.values));
        let mut bench = self.bench(machine, start);
        let at = |k: usize| {
            let mut input = self.input(k, bench.plant());
            if let Some(w) = shown {
                input.imposed_speed = Some([w[k], w[(k + 1).min(w.len() - 1)]]);
            }
            let omega_m = input.imposed_speed.map_or(bench.state().omega_m, |w| w[0]);
            let psi = [bench.state().psi_s, bench.state().psi_r];
            bench.advance(&input);
            (omega_m, psi)
        };
        (0..self.len()).map(at).unzip()
    }
}
