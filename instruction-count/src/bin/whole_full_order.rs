//! The whole step with the full-order observer.

#![no_std]
#![no_main]

use im_observers::FullOrder;
use instruction_count::{Whole, count_drive, machine, program};

#[cortex_m_rt::entry]
fn main() -> ! {
    program(|timer| count_drive(timer, "whole full-order", Whole::<FullOrder<f32>>::new(&machine()?)))
}
