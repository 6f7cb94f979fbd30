//! Instructions of a step in `f32` on a Cortex-M4 with a floating-point unit.
//!
//! QEMU is run with `-icount shift=0`: every instruction takes one nanosecond of its time. The timer SysTick counts at 25 MHz, a tick is 40
//! instructions; a thousand steps are counted at once, so that a step is known to 0.1 instructions. The samples are those of a drive on a simulated machine, recorded
//! before; what the loop around the step takes is counted with a step that does nothing, and taken off.
//!
//! `scripts/instruction-count` builds and runs it and holds the limits.

#![no_std]
#![no_main]

use core::hint::black_box;
use core::panic::PanicInfo;

use cortex_m::peripheral::{Peripherals, SYST, syst::SystClkSource};
use cortex_m_semihosting::{debug, hprintln};
use im_control::modulation::{DeadTimeCompensation, Duty, ZeroSequence, duty_cycles};
use im_control::{
    DirectTorque, DirectTorqueGains, DriveLimits, FieldOriented, FieldOrientedGains, MachineData, Sensorless, VoltsPerHertz,
    VoltsPerHertzGains,
};
use im_model::simulation::{Command, Controller, Measured, Reference};
use im_model::{Bench, Complex, Machine, PlantInput, State, machines};
use im_observers::{Basis, FullOrder, Input, Kubota, Named, Observer, StartingGains, Visit, each};

const T: f64 = 1e-4;
const STEPS: usize = 1000;
/// A tick of SysTick, in instructions.
const TICK: f32 = 40.0;
const M: machines::NamedMachine = machines::MOTULATOR_2_2_KW;

type Samples = [Measured<f32>; STEPS];

#[panic_handler]
fn halt(_: &PanicInfo<'_>) -> ! {
    hprintln!("panic");
    debug::exit(debug::EXIT_FAILURE);
    loop {}
}

fn machine() -> Option<Machine<f64>> {
    Machine::base(M.parameters(), M.pole_pairs).ok()
}

fn data(machine: &Machine<f64>) -> MachineData<f32> {
    let current = 1.5 * M.rating.current_peak_a(machine.parameters(), M.pole_pairs);
    MachineData::of(machine, current).cast()
}

fn reference(omega_m: f32) -> Reference<f32> {
    Reference { omega_m, rotor_flux_vs: M.rating.rotor_flux_vs as f32, torque_nm: 0.0 }
}

fn field_oriented(machine: &Machine<f64>) -> Option<FieldOriented<f32>> {
    let data = data(machine);
    FieldOriented::try_new(&data, &FieldOrientedGains::typical(&data, M.rating.rotor_flux_vs as f32, T as f32)).ok()
}

fn sensorless<O: Named<f32>>(machine: &Machine<f64>) -> Option<Sensorless<f32, FieldOriented<f32>, O>> {
    let basis = Basis::try_new(machine, &M.rating, T).ok()?;
    let observer = O::made(basis, machine, &M.rating, &StartingGains).ok()?;
    let data = data(machine);
    let limits = DriveLimits::generous(&data, M.rating.synchronous_speed_rad_s(M.pole_pairs) as f32, M.rating.rotor_flux_vs as f32);
    let dead_time = DeadTimeCompensation {
        dead_time_s: 2e-6,
        switching_period_s: T as f32,
        drop_v: 1.0,
        on_resistance_ohm: 0.0,
        soft_current_a: 0.2,
    };
    Sensorless::try_new(field_oriented(machine)?, observer, &data, &limits, T as f32).ok()?.compensating(&dead_time).ok()
}

/// A loaded drive at speed: what it measured over a thousand samples, and the drive before them.
fn recorded<C: Controller<f32> + Clone>(machine: &Machine<f64>, drive: &mut C, samples: &mut Samples) -> (C, f32) {
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
fn counted(timer: &mut SYST, samples: &Samples, mut step: impl FnMut(&Measured<f32>)) -> f32 {
    timer.clear_current();
    let before = SYST::get_current();
    for m in samples {
        step(black_box(m));
    }
    let after = SYST::get_current();
    // It counts down, from a 24-bit reload.
    (before.wrapping_sub(after) & 0x00ff_ffff) as f32 * TICK / STEPS as f32
}

struct Observers<'a> {
    timer: &'a mut SYST,
    samples: &'a Samples,
    machine: Machine<f64>,
    around: f32,
}

impl Visit<f32> for Observers<'_> {
    fn visit<O: Named<f32> + 'static>(&mut self) {
        let made = Basis::try_new(&self.machine, &M.rating, T).ok().and_then(|b| O::made(b, &self.machine, &M.rating, &StartingGains).ok());
        let Some(observer) = made else { return hprintln!("observer {}: not made", O::NAME) };
        let n = observed(self.timer, self.samples, &observer) - self.around;
        hprintln!("observer {} {:.0}", O::NAME, n);
    }
}

#[inline(never)]
fn observed<O: Observer<f32>>(timer: &mut SYST, samples: &Samples, observer: &O) -> f32 {
    let mut state = O::State::default();
    counted(timer, samples, |m| {
        black_box(observer.step(&mut state, &Input::new(m.u_s, m.i_s).with_speed(m.omega_m)));
    })
}

#[inline(never)]
fn controlled(timer: &mut SYST, samples: &Samples, controller: &mut impl Controller<f32>) -> f32 {
    let r = reference(100.0);
    counted(timer, samples, |m| {
        black_box(controller.step(m, black_box(&r)));
    })
}

/// The whole step of the interrupt: observer, supervision, control, dead time and duty cycles.
#[inline(never)]
fn whole(timer: &mut SYST, samples: &Samples, drive: &mut impl Controller<f32>) -> f32 {
    let r = reference(100.0);
    counted(timer, samples, |m| {
        let Command::Voltage(u) = drive.step(m, black_box(&r)) else { return };
        let duty: Duty<f32> = duty_cycles(u, m.dc_voltage_v, ZeroSequence::Centred);
        black_box(duty);
    })
}

/// Kubota's observer and field orientation with its speed, and nothing around them.
#[inline(never)]
fn bare(timer: &mut SYST, samples: &Samples, observer: &Kubota<f32>, controller: &mut FieldOriented<f32>) -> f32 {
    let r = reference(100.0);
    let mut state = Default::default();
    counted(timer, samples, |m| {
        let e = observer.step(&mut state, &Input::new(m.u_s, m.i_s));
        black_box(controller.step(&Measured { omega_m: e.omega_m, ..*m }, black_box(&r)));
    })
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

fn run(timer: &mut SYST) -> Option<()> {
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(0x00ff_ffff);
    timer.clear_current();
    timer.enable_counter();
    if !roots() {
        hprintln!("the square root is none");
        return None;
    }
    let machine = machine()?;
    let zero = Complex::new(0.0, 0.0);
    let mut samples = [Measured { i_s: zero, omega_m: 0.0, u_s: zero, dc_voltage_v: 560.0, sample_time_s: T as f32 }; STEPS];
    let around = counted(timer, &samples, |m| {
        black_box(m);
    });

    let (mut drive, speed) = recorded(&machine, &mut sensorless::<FullOrder<f32>>(&machine)?, &mut samples);
    hprintln!("speed {:.2} rad/s of 100 asked for", speed);
    hprintln!("whole full-order {:.0}", whole(timer, &samples, &mut drive) - around);
    let (mut drive, _) = recorded(&machine, &mut sensorless::<Kubota<f32>>(&machine)?, &mut samples);
    hprintln!("whole kubota {:.0}", whole(timer, &samples, &mut drive) - around);

    let observer = Kubota::made(Basis::try_new(&machine, &M.rating, T).ok()?, &machine, &M.rating, &StartingGains).ok()?;
    let (mut controller, _) = recorded(&machine, &mut field_oriented(&machine)?, &mut samples);
    hprintln!("bare kubota+foc {:.0}", bare(timer, &samples, &observer, &mut controller.clone()) - around);
    hprintln!("controller field_oriented {:.0}", controlled(timer, &samples, &mut controller) - around);
    let data = data(&machine);
    let flux = M.rating.rotor_flux_vs as f32;
    let mut vhz = VoltsPerHertz::try_new(&data, &VoltsPerHertzGains::typical(&data, flux), T as f32).ok()?;
    hprintln!("controller volts_per_hertz {:.0}", {
        let (mut c, _) = recorded(&machine, &mut vhz, &mut samples);
        controlled(timer, &samples, &mut c) - around
    });
    let mut dtc = DirectTorque::try_new(&data, &DirectTorqueGains::typical(&data, flux, 560.0, T as f32)).ok()?;
    hprintln!("controller direct_torque {:.0}", {
        let (mut c, _) = recorded(&machine, &mut dtc, &mut samples);
        controlled(timer, &samples, &mut c) - around
    });
    hprintln!("modulation duty_cycles {:.0}", counted(timer, &samples, |m| {
        black_box(duty_cycles(m.u_s, m.dc_voltage_v, ZeroSequence::Centred));
    }) - around);
    each(&mut Observers { timer, samples: &samples, machine, around });
    Some(())
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let done = Peripherals::take().and_then(|mut p| run(&mut p.SYST));
    debug::exit(if done.is_some() { debug::EXIT_SUCCESS } else { debug::EXIT_FAILURE });
    loop {}
}
