//! Instructions of a step in `f32` on a Cortex-M4 with a floating-point unit.
//!
//! QEMU is run with `-icount shift=0`: every instruction takes one nanosecond of its time. The timer SysTick counts at 25 MHz, a tick is 40
//! instructions; a thousand steps are counted at once, so that a step is known to 0.1 instructions. The samples are those of the drive itself on a
//! simulated machine, recorded before, and the drive is as it was at the first of them; what the loop around the step takes is counted with a
//! step that does nothing, and taken off.
//!
//! A program for each step that a firmware has in its interrupt, with one call of it, as there: the compiler then joins its parts. `parts` counts
//! observers and controllers alone, each behind a call. `scripts/instruction-count` builds and runs them and holds the limits.

#![no_std]

use core::hint::black_box;
use core::panic::PanicInfo;

pub use cortex_m::peripheral::SYST;
use cortex_m::peripheral::{Peripherals, syst::SystClkSource};
use cortex_m_semihosting::debug;
pub use cortex_m_semihosting::hprintln;
use im_control::modulation::{DeadTimeCompensation, Duty, ZeroSequence, duty_cycles};
use im_control::{DriveLimits, FieldOriented, FieldOrientedGains, MachineData, Sensorless};
use im_model::simulation::{Command, Controller, Measured, Reference};
use im_model::{Bench, Complex, Machine, PlantInput, State, machines};
use im_observers::{Basis, Input, Named, Observer, StartingGains};

/// The sampling time, s.
pub const T: f64 = 1e-4;
const STEPS: usize = 1000;
/// A tick of SysTick, in instructions.
const TICK: f32 = 40.0;
/// The machine.
pub const M: machines::NamedMachine = machines::MOTULATOR_2_2_KW;

/// What was recorded.
pub type Samples = [Measured<f32>; STEPS];

#[panic_handler]
fn halt(_: &PanicInfo<'_>) -> ! {
    hprintln!("panic");
    debug::exit(debug::EXIT_FAILURE);
    loop {}
}

/// The machine, without effects.
pub fn machine() -> Option<Machine<f64>> {
    Machine::base(M.parameters(), M.pole_pairs).ok()
}

/// What its drives know of it.
pub fn data(machine: &Machine<f64>) -> MachineData<f32> {
    let current = 1.5 * M.rating.current_peak_a(machine.parameters(), M.pole_pairs);
    MachineData::of(machine, current).cast()
}

/// What they are asked for.
pub fn reference(omega_m: f32) -> Reference<f32> {
    Reference { omega_m, rotor_flux_vs: M.rating.rotor_flux_vs as f32, torque_nm: 0.0 }
}

/// Field orientation with the gains to start from.
pub fn field_oriented(machine: &Machine<f64>) -> Option<FieldOriented<f32>> {
    let data = data(machine);
    FieldOriented::try_new(&data, &FieldOrientedGains::typical(&data, M.rating.rotor_flux_vs as f32, T as f32)).ok()
}

/// A drive without a speed sensor, with dead-time compensation.
fn sensorless<O: Named<f32>>(machine: &Machine<f64>) -> Option<Sensorless<f32, FieldOriented<f32>, O>> {
    let basis = Basis::try_new(machine, &M.rating, T).ok()?;
    let observer = O::made(basis, machine, &M.rating, &StartingGains).ok()?;
    let data = data(machine);
    let limits =
        DriveLimits::generous(&data, M.rating.synchronous_speed_rad_s(M.pole_pairs) as f32, M.rating.rotor_flux_vs as f32);
    let dead_time = DeadTimeCompensation {
        dead_time_s: 2e-6,
        switching_period_s: T as f32,
        drop_v: 1.0,
        on_resistance_ohm: 0.0,
        soft_current_a: 0.2,
    };
    Sensorless::try_new(field_oriented(machine)?, observer, &data, &limits, T as f32).ok()?.compensating(&dead_time).ok()
}

/// An observer and field orientation with its speed, and nothing around them.
#[derive(Clone)]
pub struct Bare<O: Observer<f32>> {
    observer: O,
    state: O::State,
    controller: FieldOriented<f32>,
}

impl<O: Named<f32>> Bare<O> {
    /// For the machine.
    pub fn new(machine: &Machine<f64>) -> Option<Self> {
        let observer = O::made(Basis::try_new(machine, &M.rating, T).ok()?, machine, &M.rating, &StartingGains).ok()?;
        Some(Self { observer, state: O::State::default(), controller: field_oriented(machine)? })
    }
}

impl<O: Observer<f32>> Controller<f32> for Bare<O> {
    #[inline(never)]
    fn step(&mut self, m: &Measured<f32>, r: &Reference<f32>) -> Command<f32> {
        let e = self.observer.step(&mut self.state, &Input::new(m.u_s, m.i_s));
        self.controller.step(&Measured { omega_m: e.omega_m, ..*m }, r)
    }
}

/// The whole step of the interrupt: observer, supervision, control, dead time and duty cycles.
#[derive(Clone)]
pub struct Whole<O: Observer<f32>> {
    drive: Sensorless<f32, FieldOriented<f32>, O>,
    duty: Option<Duty<f32>>,
}

impl<O: Named<f32>> Whole<O> {
    /// For the machine.
    pub fn new(machine: &Machine<f64>) -> Option<Self> {
        Some(Self { drive: sensorless(machine)?, duty: None })
    }
}

impl<O: Observer<f32>> Controller<f32> for Whole<O> {
    #[inline(never)]
    fn step(&mut self, m: &Measured<f32>, r: &Reference<f32>) -> Command<f32> {
        let command = self.drive.step(m, r);
        if let Command::Voltage(u) = command {
            self.duty = Some(duty_cycles(u, m.dc_voltage_v, ZeroSequence::Centred));
        }
        command
    }
}

/// A loaded drive at speed: what it measured over a thousand samples, and the drive before them.
pub fn recorded<C: Controller<f32> + Clone>(machine: &Machine<f64>, drive: &mut C, samples: &mut Samples) -> (C, f32) {
    let mut bench = Bench::new(&machine.cast::<f32>(), State::default(), T as f32);
    let mut u_s = Complex::new(0.0, 0.0);
    let mut before = drive.clone();
    for k in 0..9000 + STEPS {
        let o = bench.output();
        let m = Measured { i_s: o.i_s, omega_m: o.omega_m, u_s, dc_voltage_v: 560.0, sample_time_s: T as f32 };
        if k == 9000 {
            before = drive.clone();
        }
        if let Some(sample) = k.checked_sub(9000).and_then(|k| samples.get_mut(k)) {
            *sample = m;
        }
        if let Command::Voltage(u) = drive.step(&m, &reference(100.0)) {
            u_s = u;
        }
        bench.advance(&PlantInput::new(u_s, if k < 5000 { 0.0 } else { 10.0 }));
    }
    (before, bench.output().omega_m)
}

/// Instructions of a step, the loop around it included.
pub fn counted(timer: &mut SYST, samples: &Samples, mut step: impl FnMut(&Measured<f32>)) -> f32 {
    timer.clear_current();
    let before = SYST::get_current();
    for m in samples {
        step(black_box(m));
    }
    let after = SYST::get_current();
    // It counts down, from a 24-bit reload.
    (before.wrapping_sub(after) & 0x00ff_ffff) as f32 * TICK / STEPS as f32
}

/// Instructions of a controller's step on samples.
#[inline(never)]
pub fn controlled(timer: &mut SYST, samples: &Samples, controller: &mut impl Controller<f32>) -> f32 {
    let r = reference(100.0);
    counted(timer, samples, |m| {
        black_box(controller.step(m, black_box(&r)));
    })
}

/// What the loop takes without a step.
pub fn around(timer: &mut SYST, samples: &Samples) -> f32 {
    counted(timer, samples, |m| {
        black_box(m);
    })
}

/// No samples.
pub fn no_samples() -> Samples {
    let zero = Complex::new(0.0, 0.0);
    [Measured { i_s: zero, omega_m: 0.0, u_s: zero, dc_voltage_v: 560.0, sample_time_s: T as f32 }; STEPS]
}

/// Runs a drive, and then counts its step on what it did.
pub fn count_drive<C: Controller<f32> + Clone>(timer: &mut SYST, name: &str, drive: Option<C>) -> Option<()> {
    let mut samples = no_samples();
    let (mut drive, speed) = recorded(&machine()?, &mut drive?, &mut samples);
    if !(99.0..101.0).contains(&speed) {
        hprintln!("{}: speed {:.2} rad/s of 100 asked for", name, speed);
        return None;
    }
    let n = controlled(timer, &samples, &mut drive) - around(timer, &samples);
    hprintln!("{} {:.0}", name, n);
    Some(())
}

/// The root instruction gives roots.
fn roots() -> bool {
    let near = [1e-38f32, 2.0, 3.0, 0.5, 1e-3, 123.456, 1e30].iter().all(|x| {
        let root = im_model::Scalar::sqrt(black_box(*x));
        let off = root * root / *x - 1.0;
        off < 3e-7 && off > -3e-7
    });
    near && im_model::Scalar::sqrt(black_box(0.0f32)) == 0.0 && im_model::Scalar::sqrt(black_box(-1.0f32)).is_nan()
}

/// Starts the timer, counts, and ends QEMU.
pub fn program(count: fn(&mut SYST) -> Option<()>) -> ! {
    let done = Peripherals::take().and_then(|mut p| {
        let timer = &mut p.SYST;
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(0x00ff_ffff);
        timer.clear_current();
        timer.enable_counter();
        if roots() {
            count(timer)
        } else {
            hprintln!("the square root is none");
            None
        }
    });
    debug::exit(if done.is_some() { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
    loop {}
}
