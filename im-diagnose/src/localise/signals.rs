//! What a model got wrong, row by row, beside what the machine was doing at the time.

use std::borrow::Cow;

use im_identify::offline::{ChannelKind, Experiment, residuals};
use im_model::{Complex, Machine, State};

use super::Quantity;

/// One row of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Measured minus predicted current, stator frame, A; `None` where it was not measured.
    pub current_error: Option<Complex<f64>>,
    /// Measured minus predicted speed, rad/s.
    pub speed_error: Option<f64>,
    /// The model's stator current, stator frame, A.
    pub current: Complex<f64>,
    /// The model's magnetizing flux linkage, stator frame, Vs.
    pub flux: Complex<f64>,
    /// Mechanical speed, rad/s.
    pub speed: f64,
    /// Air-gap torque, Nm.
    pub torque: f64,
    /// Frequency at which the rotor flux overtakes the rotor, electrical, Hz.
    pub slip_hz: f64,
    /// Applied voltage, stator frame, V.
    pub voltage: Complex<f64>,
    /// Load torque, Nm.
    pub load: f64,
}

/// One run.
#[derive(Clone, Debug, PartialEq)]
pub struct Run {
    /// Name of the recording.
    pub name: String,
    /// Sampling time, s.
    pub sample_time_s: f64,
    /// Row by row.
    pub rows: Vec<Row>,
}

/// All runs, and how exact the sensors are.
#[derive(Clone, Debug, PartialEq)]
pub struct Signals {
    /// The runs.
    pub runs: Vec<Run>,
    /// Noise of a current channel, A.
    pub current_noise_a: f64,
    /// Noise of the speed, rad/s.
    pub speed_noise_rad_s: f64,
    /// Pole pairs.
    pub pole_pairs: u32,
}

impl Signals {
    /// Simulates `machine` on `experiments` and takes the errors apart.
    pub fn of(machine: &Machine<f64>, experiments: &[Experiment], starts: &[State<f64>]) -> Self {
        let noise = |speed: bool| {
            let all = experiments.iter().flat_map(|e| &e.channels).filter(|c| (c.kind == ChannelKind::Speed) == speed);
            let found: Vec<f64> = all.map(|c| c.sigma * c.sigma).collect();
            if found.is_empty() { 0.0 } else { (found.iter().sum::<f64>() / found.len() as f64).sqrt() }
        };
        Self {
            runs: experiments.iter().zip(starts).filter(|(e, _)| !e.is_table()).map(|(e, x)| run(machine, e, x)).collect(),
            current_noise_a: noise(false),
            speed_noise_rad_s: noise(true),
            pole_pairs: machine.pole_pairs(),
        }
    }

    /// The rows of a channel that has fewer samples than there are rows, at even distances: what stands between them has no error. The runs with every
    /// row where it has all.
    pub(super) fn at_samples_of(&self, q: Quantity) -> Cow<'_, Self> {
        let distance = |run: &Run| {
            let at: Vec<usize> = (0..run.rows.len()).filter(|&k| q.squared(&run.rows[k]).is_some()).collect();
            let mut gaps: Vec<usize> = at.windows(2).map(|w| w[1] - w[0]).collect();
            let middle = gaps.len() / 2;
            if gaps.is_empty() { 1 } else { *gaps.select_nth_unstable(middle).1 }
        };
        if self.runs.iter().all(|run| distance(run) == 1) {
            return Cow::Borrowed(self);
        }
        let sampled = |run: &Run| {
            let rows: Vec<Row> = run.rows.iter().filter(|r| q.squared(r).is_some()).copied().collect();
            let rows_each = run.rows.len() as f64 / rows.len().max(1) as f64;
            Run { name: run.name.clone(), sample_time_s: run.sample_time_s * rows_each, rows }
        };
        Cow::Owned(Self { runs: self.runs.iter().map(sampled).collect(), ..self.clone() })
    }

    /// All rows of all runs.
    pub fn rows(&self) -> impl Iterator<Item = &Row> {
        self.runs.iter().flat_map(|r| &r.rows)
    }
}

/// The frequency of the rotor flux over the rotor's, ω_slip = R_r Im(i_r ψ̄_r)/|ψ_r|², in Hz.
pub fn slip_hz(machine: &Machine<f64>, x: &State<f64>, i_r: Complex<f64>) -> f64 {
    let cross = i_r.re * x.psi_r.im - i_r.im * x.psi_r.re;
    machine.parameters().rotor_resistance_ohm * cross / x.psi_r.norm_sqr().max(1e-6) / std::f64::consts::TAU
}

fn run(machine: &Machine<f64>, e: &Experiment, start: &State<f64>) -> Run {
    let errors = residuals(machine, e, start);
    let speed = e.channels.iter().position(|c| c.kind == ChannelKind::Speed);
    let mut bench = e.bench(machine, start);
    let mut rows = Vec::with_capacity(e.len());
    for (k, &voltage) in e.u_s.iter().enumerate() {
        let x = *bench.state();
        let currents = bench.plant().currents(&x);
        rows.push(Row {
            current_error: e.current_vector(k, |c| errors[c][k] * e.channels[c].sigma),
            speed_error: speed.filter(|&c| e.channels[c].is_valid(k)).map(|c| errors[c][k] * e.channels[c].sigma),
            current: currents.i_s,
            flux: currents.psi_m,
            speed: x.omega_m,
            torque: bench.plant().torque(&x),
            slip_hz: slip_hz(machine, &x, currents.i_r),
            voltage,
            load: e.tau_load[k],
        });
        bench.advance(&e.input(k, bench.plant()));
    }
    Run { name: e.name.clone(), sample_time_s: e.sample_time_s, rows }
}
