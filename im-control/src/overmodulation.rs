//! Beyond the circle: the voltage to be modulated so that its fundamental is the one asked for, up to six steps.
//!
//! The nearest point of the hexagon to a vector of r inscribed radii R = U_dc/√3 has, over a turn, the fundamental
//!
//! ```text
//! F(r) = (6/π)(sin θ + r(θ/2 − sin 2θ/4) + r(π/6 − θ)),             θ = arccos(1/r),   1 ≤ r ≤ 2/√3
//! F(r) = (6/π)(sin θ + r(θ/2 − sin 2θ/4) + (2/√3) sin(π/6 − θ)),    θ = arcsin(1/(√3 r)),   beyond
//! ```
//!
//! from 1 to 6/(π√3) = 1.1027, that of six steps. Its inverse is tabulated. The price is harmonics of the order 6k ± 1: 1.0 % of the fundamental at F = 1.02, 5 % at
//! 1.055, where the vertices are reached, a fifth and a seventh of it at six steps.
//!
//! After S. Bolognani, M. Zigliotto, "Novel digital continuous control of SVM inverters in the overmodulation range", IEEE Trans. Ind. Appl. 33 (1997).

use im_model::{Complex, Scalar};

use crate::vector::norm;

/// 6/(π√3): the fundamental of six steps over the inscribed radius.
pub const SIX_STEP: f64 = 1.102_657_790_843_584_2;

/// 1/r at F = 1 + (SIX_STEP − 1)(1 − (1 − x)²), x = 0, 1/16, … 1.
const INVERSE: [f64; 17] = [
    1.0,
    0.984_196_4,
    0.965_102_0,
    0.942_516_4,
    0.914_471_8,
    0.871_457_9,
    0.795_549_0,
    0.718_350_4,
    0.640_392_1,
    0.561_767_6,
    0.482_566_7,
    0.402_876_6,
    0.322_782_0,
    0.242_366_0,
    0.161_710_1,
    0.080_894_8,
    1e-4,
];
/// The normals of three sides.
const NORMALS: [[f64; 2]; 3] = [[0.866_025_403_784_438_6, 0.5], [0.0, 1.0], [-0.866_025_403_784_438_6, 0.5]];

/// The vector on the hexagon of a link for a voltage whose fundamental is u over a turn, at most that of six steps. Within the circle it is u itself; so it is without a link, and
/// where its size is no number: [`duty_cycles`](crate::modulation::duty_cycles) knows what to do with that.
#[inline]
pub fn overmodulated<T: Scalar>(u: Complex<T>, dc_voltage_v: T) -> Complex<T> {
    let c = T::from_f64;
    let radius = dc_voltage_v * c(0.577_350_269_189_625_8);
    let size = norm(u);
    let beyond = size > radius && radius > T::zero() && size.is_finite();
    if !beyond {
        return u;
    }
    let left = ((c(SIX_STEP) - size / radius) / c(SIX_STEP - 1.0)).max(T::zero());
    let place = (T::one() - left.sqrt()) * c(16.0);
    let k = (place.value() as usize).min(15);
    let at = |k: usize| c(INVERSE.get(k).copied().unwrap_or(1.0));
    let share = place - c(k as f64);
    let z = u * (radius / size / (at(k) + (at(k + 1) - at(k)) * share));
    // The side that it is beyond most.
    let mut side = (T::zero(), Complex::new(T::zero(), T::zero()));
    for [x, y] in NORMALS {
        let (n, along) = (Complex::new(c(x), c(y)), z.re * c(x) + z.im * c(y));
        if along.abs() > side.0 {
            side = (along.abs(), if along < T::zero() { -n } else { n });
        }
    }
    let (x, n) = side;
    if x <= radius {
        return z;
    }
    let half = radius * c(0.577_350_269_189_625_8);
    let y = (z.im * n.re - z.re * n.im).max(-half).min(half);
    n * Complex::new(radius, y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modulation::{ZeroSequence, duty_cycles};
    use im_model::space_vector::unit;
    use proptest::prelude::*;

    const DC: f64 = 540.0;

    /// The fundamental, and the rms of the harmonics over it.
    fn turn(size: f64) -> (f64, f64) {
        let n = 7200;
        let points: Vec<_> = (0..n)
            .map(|k| {
                let e = unit(std::f64::consts::TAU * (f64::from(k) + 0.5) / f64::from(n));
                (e, overmodulated(e * size, DC))
            })
            .collect();
        let fundamental = points.iter().map(|(e, z)| z * e.conj()).sum::<Complex<f64>>() / f64::from(n);
        let rest = points.iter().map(|(e, z)| (z - fundamental * e).norm_sqr()).sum::<f64>() / f64::from(n);
        (fundamental.norm(), rest.sqrt() / fundamental.norm())
    }

    /// The fundamental is the one asked for within 0.1 %, from the circle to six steps; with the voltage shortened in its direction it ends at 1.05.
    #[test]
    fn the_fundamental_is_linear_up_to_six_steps() {
        let radius = DC / 3f64.sqrt();
        for f in [0.5, 0.99, 1.0, 1.01, 1.02, 1.04, 1.055, 1.07, 1.09, 1.1, SIX_STEP] {
            let (got, _) = turn(f * radius);
            assert!((got / (f * radius) - 1.0).abs() < 1e-3, "{f}: {}", got / radius);
        }
        let (six, harmonics) = turn(2.0 * radius);
        assert!((six / radius - SIX_STEP).abs() < 1e-3 && (harmonics - 0.311).abs() < 0.005, "{six} {harmonics}");
        // What the head of the file says.
        let rms = [1.02, 1.055].map(|f| turn(f * radius).1);
        assert!((rms[0] - 0.011).abs() < 0.002 && (rms[1] - 0.05).abs() < 0.01, "{rms:?}");
    }

    proptest! {
        /// Whatever is asked for, it can be made.
        #[test]
        fn it_can_be_made(size in 0.0..5e3f64, angle in -7.0..7.0f64) {
            let z = overmodulated(unit(angle) * size, DC);
            let duty = duty_cycles(z, DC, ZeroSequence::Centred);
            prop_assert!((duty.u_s - z).norm() < 1e-9 * DC, "{z} {duty:?}");
            let single = overmodulated(Complex::new((unit(angle) * size).re as f32, (unit(angle) * size).im as f32), DC as f32);
            prop_assert!((f64::from(single.re) - z.re).abs() + (f64::from(single.im) - z.im).abs() < 0.05 * DC);
        }

        /// What has a size comes onto the hexagon; what has none, or no link, goes through as it is, and the timers get a share of their period.
        #[test]
        fn whatever_comes_in_the_timers_get_a_share(u in prop::array::uniform2(crate::tests::anything()), dc in crate::tests::anything()) {
            let is_one = u[0].hypot(u[1]) < 1e150;
            for dc in [dc, DC] {
                let z = overmodulated(Complex::new(u[0], u[1]), dc);
                let single = overmodulated(Complex::new(u[0] as f32, u[1] as f32), dc as f32);
                if is_one && dc == DC {
                    prop_assert!(z.norm() <= DC * (2.0 / 3.0 + 1e-9), "{z}");
                }
                let (a, b) = (duty_cycles(z, dc, ZeroSequence::Centred), duty_cycles(single, dc as f32, ZeroSequence::Centred));
                prop_assert!(a.duty.iter().all(|d| (0.0..=1.0).contains(d)) && a.u_s.norm().is_finite(), "{z} {a:?}");
                prop_assert!(b.duty.iter().all(|d| (0.0..=1.0).contains(d)) && b.u_s.norm().is_finite(), "{single} {b:?}");
            }
        }
    }
}
