//! The whole step with Kubota's observer.

#![no_std]
#![no_main]

use im_observers::Kubota;
use instruction_count::{Whole, count_drive, machine, program};

#[cortex_m_rt::entry]
fn main() -> ! {
    program(|timer| count_drive(timer, "whole kubota", Whole::<Kubota<f32>>::new(&machine()?)))
}
