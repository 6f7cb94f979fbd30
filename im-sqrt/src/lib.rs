//! √x by the instruction of 32-bit ARM, where stable Rust has no way to it without `std`. Empty on other targets.

#![no_std]

/// √x, NaN below zero.
#[cfg(all(target_arch = "arm", target_abi = "eabihf"))]
#[inline(always)]
pub fn sqrtf(x: f32) -> f32 {
    let mut bits = x.to_bits();
    // Through a core register: the class of single floats asks for a feature that units of single precision alone do not have.
    // SAFETY: from one register to another; every target with hardware floats has it.
    unsafe {
        core::arch::asm!(
            "vmov s0, {bits}", "vsqrt.f32 s0, s0", "vmov {bits}, s0",
            bits = inout(reg) bits, out("s0") _, options(pure, nomem, nostack)
        );
    }
    f32::from_bits(bits)
}

/// The example of the README is a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
