//! The machine of the tests, effects of usual sizes, and a supply to run it from.

use core::f64::consts::PI;

use im_model::effects::Role;
use im_model::machines::{MOTULATOR_2_2_KW, NamedMachine};
use im_model::space_vector::unit;
use im_model::{Bench, Complex, EffectId, Effects, Held, Machine, Output, PlantInput, State, steady_state};

pub const MACHINE: NamedMachine = MOTULATOR_2_2_KW;
/// Sampling time, s.
pub const T: f64 = 1e-4;
/// Synchronous speed at 50 Hz, rad/s.
pub const SYNCHRONOUS: f64 = 50.0 * PI;
/// Rated phase voltage, peak, V.
pub const RATED_V: f64 = 326.6;

/// The machine with the effects that `set` switches on, scaled to its rating.
pub fn machine(set: impl FnOnce(&mut Effects<f64>)) -> Machine<f64> {
    let p = MACHINE.parameters();
    let mut e = Effects::scaled(&MACHINE.rating, &p, MACHINE.pole_pairs);
    set(&mut e);
    Machine::try_new(p, MACHINE.pole_pairs, e).unwrap()
}

/// The machine without effects.
pub fn base() -> Machine<f64> {
    machine(|_| ())
}

/// Sets the first strength of an effect to a place within its typical range, 0 to 1 on a logarithmic scale; returns its value.
pub fn set_typical(e: &mut Effects<f64>, id: EffectId, place: f64) -> f64 {
    let index = id.parameters().iter().position(|p| p.role == Role::Strength).unwrap();
    let info = &id.parameters()[index];
    let (lo, hi) = info.typical;
    let size = lo * (hi / lo).powf(place) * MACHINE.rating.unit_of(info.scale, &MACHINE.parameters(), MACHINE.pole_pairs);
    e.set(id, index, size);
    size
}

/// The machine with one effect in the middle of its typical range.
pub fn with(id: EffectId) -> Machine<f64> {
    machine(|e| {
        set_typical(e, id, 0.5);
    })
}

/// A sinusoidal supply.
#[derive(Clone, Copy)]
pub struct Supply {
    pub peak: f64,
    pub hz: f64,
}

impl Supply {
    /// At rated flux: constant voltage per frequency.
    pub fn rated_flux(hz: f64) -> Self {
        Self { peak: RATED_V * hz / 50.0, hz }
    }

    /// The mean over sample `k`, which is what a held sample stands for.
    pub fn mean(&self, k: usize) -> Complex<f64> {
        let w = 2.0 * PI * self.hz;
        let half = 0.5 * w * T;
        let hold = if half == 0.0 { 1.0 } else { half.sin() / half };
        unit(w * T * (k as f64 + 0.5)) * (self.peak * hold)
    }
}

/// What the shaft does.
#[derive(Clone, Copy)]
pub enum Shaft {
    Load(f64),
    Speed(f64),
}

/// What was measured, from the end of the settling time.
pub struct Trace {
    pub start: usize,
    pub out: Vec<Output<f64>>,
    pub torque: Vec<f64>,
    pub command: Vec<Complex<f64>>,
    pub state: State<f64>,
}

/// Runs from the steady state of the machine without ripple, `settle_s` unrecorded.
pub fn run(m: &Machine<f64>, supply: Supply, shaft: Shaft, settle_s: f64, record_s: f64) -> Trace {
    let held = match shaft {
        Shaft::Load(t) => Held::Load(t),
        Shaft::Speed(w) => Held::Speed(w),
    };
    let x = steady_state(m, supply.peak, supply.hz, held).unwrap();
    run_from(m, x, supply, shaft, settle_s, record_s)
}

/// Runs from a state.
pub fn run_from(m: &Machine<f64>, x: State<f64>, supply: Supply, shaft: Shaft, settle_s: f64, record_s: f64) -> Trace {
    let mut bench = Bench::new(m, x, T);
    // What was commanded before the start, so that a delay does not begin with a gap.
    bench.set_past_command(supply.mean(0));
    let (settle, record) = ((settle_s / T).round() as usize, (record_s / T).round() as usize);
    let mut trace = Trace { start: settle, out: vec![], torque: vec![], command: vec![], state: x };
    for k in 0..settle + record {
        let u = supply.mean(k);
        if k >= settle {
            trace.out.push(bench.output());
            trace.torque.push(bench.plant().torque(bench.state()));
            trace.command.push(u);
        }
        let (tau_load, imposed_speed) = match shaft {
            Shaft::Load(t) => (t, None),
            Shaft::Speed(w) => (0.0, Some([w, w])),
        };
        bench.advance(&PlantInput { tau_load, imposed_speed, ..PlantInput::new(u, 0.0) });
    }
    trace.state = *bench.state();
    trace
}

impl Trace {
    /// Component of the shown current that turns with `hz` (negative: backwards), A. The record must hold whole periods.
    pub fn current(&self, hz: f64) -> Complex<f64> {
        let at = |k: usize| unit(-2.0 * PI * hz * T * (self.start + k) as f64);
        self.out.iter().enumerate().map(|(k, y)| y.i_s * at(k)).sum::<Complex<f64>>() / self.out.len() as f64
    }

    /// Amplitude of the component of the shown speed at `hz`, rad/s.
    pub fn speed_ripple(&self, hz: f64) -> f64 {
        let mean = self.speed();
        let at = |k: usize| unit(-2.0 * PI * hz * T * (self.start + k) as f64);
        let sum: Complex<f64> = self.out.iter().enumerate().map(|(k, y)| at(k) * (y.omega_m - mean)).sum();
        2.0 * sum.norm() / self.out.len() as f64
    }

    /// Mean speed shown, rad/s.
    pub fn speed(&self) -> f64 {
        self.out.iter().map(|y| y.omega_m).sum::<f64>() / self.out.len() as f64
    }

    /// Mean torque, Nm.
    pub fn mean_torque(&self) -> f64 {
        self.torque.iter().sum::<f64>() / self.torque.len() as f64
    }
}

/// The steady current at the supply's frequency, A, over 0.2 s.
pub fn phasor(m: &Machine<f64>, supply: Supply, shaft: Shaft) -> Complex<f64> {
    run(m, supply, shaft, 0.6, 0.2).current(supply.hz)
}
