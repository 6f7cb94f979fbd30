//! Kubota's observer and field orientation.

#![no_std]
#![no_main]

use im_observers::Kubota;
use instruction_count::{Bare, count_drive, machine, program};

#[cortex_m_rt::entry]
fn main() -> ! {
    program(|timer| count_drive(timer, "bare kubota+foc", Bare::<Kubota<f32>>::new(&machine()?)))
}
