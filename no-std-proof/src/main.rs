//! Proof that the machine model, the observers, the identifiers and the controllers link without the standard library and without an allocator: a program of
//! `core` alone with its own panic handler. Any use of `std` or `alloc` in the crates below would fail to link.
//!
//! It starts a machine with every kind of state from standstill and exits with 0 when it runs up and the five observers
//! follow another one, when an identifier finds its rotor resistance, and when two drives reach their speed.

#![no_std]
#![no_main]

use core::panic::PanicInfo;

use im_control::{
    BeginsAt, Drive, DriveLimits, FieldOriented, FieldOrientedGains, FlyingStart, Kenne, KenneGains, MachineData, Mtpa,
    MtpaGains, MtpaLaw, Reports, Sensorless,
};
use im_identify::online::{Identifier, KenneRotorResistance, KenneSettings, Sample};
use im_model::simulation::{Command, Controller, Measured, Reference};
use im_model::{Bench, Complex, Effects, Machine, PlantInput, State, machines};
use im_observers::{Basis, Input, LoadTorqueModel, Named, Observer, StartingGains, Thau, ThauGains, Visit, each};

// The C runtime that calls `main`, and memcpy.
#[link(name = "c")]
unsafe extern "C" {}

#[panic_handler]
fn halt(_: &PanicInfo<'_>) -> ! {
    loop {}
}

/// Speed in rad/s of a machine after a second on the grid, in single precision as in firmware.
fn run_up() -> Option<f32> {
    let m = machines::MOTULATOR_2_2_KW;
    let mut e = Effects::scaled(&m.rating, &m.parameters(), m.pole_pairs);
    e.main_flux_saturation.excess = 0.5;
    e.leakage_flux_saturation.drop = 0.3;
    e.rotor_skin_effect.resistance_rise = 1.0;
    e.iron_loss.conductance_s = 1e-3;
    e.rotor_asymmetry.unbalance_direct = 0.02;
    e.coulomb_friction.torque_nm = 0.2;
    let machine = Machine::try_new(m.parameters(), m.pole_pairs, e).ok()?.cast::<f32>();
    let mut bench = Bench::new(&machine, State::default(), 1e-4f32);
    let turn = im_model::space_vector::unit(0.031_415_927_f32);
    let mut u = Complex::new(326.6, 0.0);
    for _ in 0..10_000 {
        bench.advance(&PlantInput::new(u, 1.0));
        u *= turn;
    }
    Some(bench.output().omega_m)
}

/// The largest error in speed, rad/s, of all observers over a loaded start, in single precision.
fn observed() -> Option<f32> {
    struct Worst {
        machine: Machine<f64>,
        basis: Basis<f32>,
        error: Option<f32>,
    }
    impl Visit<f32> for Worst {
        fn visit<O: Named<f32> + 'static>(&mut self) {
            let made = O::made(self.basis, &self.machine, &machines::MOTULATOR_2_2_KW.rating, &StartingGains);
            self.error = self.error.zip(made.ok()).map(|(worst, o)| worst.max(error(&self.machine, &o)));
        }
    }
    let m = machines::MOTULATOR_2_2_KW;
    let machine = Machine::base(m.parameters(), m.pole_pairs).ok()?;
    let basis = Basis::try_new(&machine, &m.rating, 1e-4).ok()?;
    let mut worst = Worst { machine, basis, error: Some(0.0) };
    each(&mut worst);
    worst.error
}

/// The error of one after a second and a half; infinite when the estimate is not valid.
fn error(machine: &Machine<f64>, observer: &impl Observer<f32>) -> f32 {
    let mut bench = Bench::new(&machine.cast::<f32>(), State::default(), 1e-4f32);
    let turn = im_model::space_vector::unit(0.031_415_927_f32);
    let mut state = Default::default();
    let mut u = Complex::new(326.6, 0.0);
    let mut error = f32::INFINITY;
    for _ in 0..15_000 {
        bench.advance(&PlantInput::new(u, 5.0));
        let shown = bench.output();
        let estimate = observer.step(&mut state, &Input::new(u, shown.i_s).with_speed(shown.omega_m));
        let off = estimate.omega_m - shown.omega_m;
        error = if estimate.status.is_valid() { off.max(-off) } else { f32::INFINITY };
        u *= turn;
    }
    error
}

/// The estimate of a loaded machine's rotor resistance over the truth, begun with half of it, in single precision.
fn identified() -> Option<f32> {
    let m = machines::MOTULATOR_2_2_KW;
    let machine = Machine::base(m.parameters(), m.pole_pairs).ok()?.cast::<f32>();
    let windings = machine.parameters().windings();
    let settings = KenneSettings::for_rating(&windings, m.pole_pairs, &m.rating, 1e-4);
    let truth = windings.rotor_resistance_ohm;
    let identifier =
        KenneRotorResistance::try_new(&windings, m.pole_pairs, &KenneSettings { start_ohm: 0.5 * truth, ..settings }, 1e-4)
            .ok()?;
    let mut bench = Bench::new(&machine, State::default(), 1e-4f32);
    let turn = im_model::space_vector::unit(0.031_415_927_f32);
    let mut state = identifier.start();
    let mut u_s = Complex::new(326.6, 0.0);
    let mut estimate = 0.0;
    for _ in 0..15_000 {
        bench.advance(&PlantInput::new(u_s, 14.0));
        let shown = bench.output();
        estimate = identifier.step(&mut state, &Sample { i_s: shown.i_s, u_s, omega_m: shown.omega_m }).values[0];
        u_s *= turn;
    }
    Some(estimate / truth)
}

/// Speed in rad/s of a machine after a second on a controller that is asked for 100 rad/s.
fn controlled<C: Controller<f32> + BeginsAt<f32> + Reports + Clone>(
    known: &MachineData<f32>,
    machine: &Machine<f32>,
    controller: C,
) -> Option<f32> {
    let controller = FlyingStart::try_new(controller, known, 1e-4).ok()?;
    let mut drive = Drive::try_new(controller, &DriveLimits::generous(known, 157.0, 0.9)).ok()?;
    let mut bench = Bench::new(machine, State::default(), 1e-4f32);
    let mut u_s = Complex::new(0.0, 0.0);
    for _ in 0..10_000 {
        let shown = bench.output();
        let measured = Measured { i_s: shown.i_s, omega_m: shown.omega_m, u_s, dc_voltage_v: 560.0, sample_time_s: 1e-4 };
        let (Command::Voltage(u) | Command::Current(u)) =
            drive.step(&measured, &Reference { omega_m: 100.0, rotor_flux_vs: 0.9, torque_nm: 0.0 });
        u_s = u;
        bench.advance(&PlantInput::new(u, 0.0));
    }
    Some(bench.output().omega_m)
}

/// Both, in single precision.
fn drives() -> Option<[f32; 2]> {
    let m = machines::MOTULATOR_2_2_KW;
    let machine = Machine::base(m.parameters(), m.pole_pairs).ok()?.cast::<f32>();
    let known = MachineData::of(&machine, 12.0);
    let oriented = FieldOriented::try_new(&known, &FieldOrientedGains::typical(&known, 0.9, 1e-4)).ok()?;
    let kenne = Kenne::try_new(&known, &KenneGains::typical(&known, 0.9, 560.0, 1e-4)).ok()?;
    Some([controlled(&known, &machine, oriented)?, controlled(&known, &machine, kenne)?])
}

/// The sensorless drive of least current after a tenth of a second on a machine that takes the current commanded: whether all of it is finite.
fn sensorless() -> Option<bool> {
    let m = machines::MOTULATOR_2_2_KW;
    let machine = Machine::base(m.parameters(), m.pole_pairs).ok()?;
    let known = MachineData::of(&machine.cast::<f32>(), 12.0);
    let law = MtpaLaw::series([1.0, 20.0], &[1.5, 0.5], &[1.0]).ok()?;
    let mtpa = Mtpa::try_new(&known, &law, &MtpaGains::typical(&known)).ok()?;
    let basis = Basis::<f32>::try_new(&machine, &m.rating, 1e-4).ok()?;
    let thau = Thau::try_new(basis, ThauGains::published(), LoadTorqueModel::EqualToTorque).ok()?;
    let limits = DriveLimits::generous(&known, 157.0, 0.9);
    let mut drive = Sensorless::try_new(mtpa, thau, &known, &limits, 1e-4).ok()?.tracking_currents();
    let reference = Reference { omega_m: 0.0, rotor_flux_vs: 0.0, torque_nm: 5.0 };
    let mut i_s = Complex::new(0.0, 0.0);
    for _ in 0..1000 {
        let measured = Measured { i_s, omega_m: 0.0, u_s: i_s * 3.7, dc_voltage_v: 560.0, sample_time_s: 1e-4 };
        let Command::Current(command) = drive.step(&measured, &reference) else { return None };
        i_s = command;
    }
    Some(i_s.re.is_finite() && i_s.im.is_finite() && drive.estimate()?.omega_m.is_finite())
}

/// Called by the C runtime.
#[unsafe(no_mangle)]
pub extern "C" fn main(_argc: i32, _argv: *const *const u8) -> i32 {
    match (run_up(), observed(), identified(), drives(), sensorless()) {
        (Some(speed), Some(error), Some(ratio), Some(drives), Some(true))
            if (150.0..158.0).contains(&speed)
                && error < 1.0
                && (0.98..1.02).contains(&ratio)
                && drives.iter().all(|w| (99.0..101.0).contains(w)) =>
        {
            0
        }
        _ => 1,
    }
}
