//! Proof that no step can panic: the steps of every observer, identifier and controller, f32 and f64, are linked (and not run), nothing is
//! constructed, and the panic handler calls a function that does not exist. Were any panic reachable from a step, this would not link:
//! `scripts/no-std-proof` tries that too.

#![no_std]
#![no_main]

use core::hint::black_box;
use core::panic::PanicInfo;

use im_control::{DirectTorque, Drive, FieldOriented, FlyingStart, Jadot, Kenne, Mtpa, VoltsPerHertz};
use im_identify::online::{
    Estimate as Identified, Follower, Identifier, KenneResistances, KenneRotorResistance, Sample, TimeScale, TimeVarying,
};
use im_model::Scalar;
use im_model::simulation::{Command, Controller, Measured, Reference};
use im_observers::{Estimate, Input, Named, Visit, each};

// The C runtime that calls `main`, and memcpy.
#[link(name = "c")]
unsafe extern "C" {}

unsafe extern "C" {
    fn a_step_that_can_panic_is_linked() -> !;
}

#[panic_handler]
fn halt(_: &PanicInfo<'_>) -> ! {
    // SAFETY: never linked.
    unsafe { a_step_that_can_panic_is_linked() }
}

/// Asks the linker for the step of every observer that is registered.
struct Asked;

impl<T: Scalar> Visit<T> for Asked {
    fn visit<O: Named<T> + 'static>(&mut self) {
        #[inline(never)]
        fn step<T: Scalar, O: Named<T>>(o: &O, x: &mut O::State, input: &Input<T>) -> Estimate<T> {
            o.step(x, input)
        }
        black_box(step::<T, O> as *const ());
    }
}

fn observers() {
    each::<f32>(&mut Asked);
    each::<f64>(&mut Asked);
}

macro_rules! identifiers {
    ($($name:ident: $identifier:ty, $n:literal, $t:ty;)*) => {$(
        #[inline(never)]
        fn $name(
            o: &$identifier,
            x: &mut <$identifier as Identifier<$t, $n>>::State,
            sample: &Sample<$t>,
        ) -> Identified<$t, $n> {
            o.step(x, sample)
        }
    )*
        /// Asks the linker for them.
        fn identifiers() {
            $(black_box($name as *const ());)*
        }
    };
}

identifiers! {
    rotor_resistance_f32: KenneRotorResistance<f32>, 1, f32; rotor_resistance_f64: KenneRotorResistance<f64>, 1, f64;
    resistances_f32: KenneResistances<f32>, 2, f32; resistances_f64: KenneResistances<f64>, 2, f64;
    time_scale_f32: Follower<f32, TimeScale<f32>>, 4, f32; time_scale_f64: Follower<f64, TimeScale<f64>>, 4, f64;
    time_varying_f32: Follower<f32, TimeVarying<f32>>, 4, f32; time_varying_f64: Follower<f64, TimeVarying<f64>>, 4, f64;
}

macro_rules! controllers {
    ($($name:ident: $controller:ty, $t:ty;)*) => {$(
        #[inline(never)]
        fn $name(o: &mut $controller, measured: &Measured<$t>, reference: &Reference<$t>) -> Command<$t> {
            o.step(measured, reference)
        }
    )*
        /// Asks the linker for them.
        fn controllers() {
            $(black_box($name as *const ());)*
        }
    };
}

controllers! {
    field_oriented_f32: Drive<f32, FlyingStart<f32, FieldOriented<f32>>>, f32;
    field_oriented_f64: Drive<f64, FlyingStart<f64, FieldOriented<f64>>>, f64;
    direct_torque_f32: DirectTorque<f32>, f32; direct_torque_f64: DirectTorque<f64>, f64;
    volts_per_hertz_f32: VoltsPerHertz<f32>, f32; volts_per_hertz_f64: VoltsPerHertz<f64>, f64;
    kenne_f32: Drive<f32, Kenne<f32>>, f32; kenne_f64: Drive<f64, Kenne<f64>>, f64;
    jadot_f32: Jadot<f32, TimeScale<f32>>, f32; jadot_f64: Jadot<f64, TimeScale<f64>>, f64;
    mtpa_f32: FlyingStart<f32, Mtpa<f32>>, f32; mtpa_f64: FlyingStart<f64, Mtpa<f64>>, f64;
}

/// Called by the C runtime.
#[unsafe(no_mangle)]
pub extern "C" fn main(_argc: i32, _argv: *const *const u8) -> i32 {
    observers();
    identifiers();
    controllers();
    #[cfg(feature = "panics")]
    black_box(panics as *const ());
    0
}

/// A step as it must not be: with it this does not link.
#[cfg(feature = "panics")]
fn panics(table: &[f32], place: usize) -> f32 {
    table[place]
}
