//! Curves of flux over current, ψ(i) = L∞ i + (L₀ − L∞) I₀ g(i/I₀), with g(0) = 0 and g'(0) = 1.
//!
//! Several shapes g, so that no fitted law can match all of them exactly.

use super::chance::Chance;
use super::plane::{Symmetric, Vector};

/// Shape g(x) of the part of a flux curve that saturates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// g = atan x.
    Arctangent,
    /// g = x / (1 + x), after Fröhlich.
    Froehlich,
    /// g = x / √(1 + x²).
    Root,
    /// g = ln(1 + x).
    Logarithm,
    /// Two straight lines that meet at x = 1, joined by a hyperbola of the given width.
    Knee {
        /// Width of the bend in units of its place.
        width: f64,
    },
}

impl Shape {
    /// Name for the record of the truth.
    pub fn name(self) -> &'static str {
        match self {
            Self::Arctangent => "arctangent",
            Self::Froehlich => "froehlich",
            Self::Root => "root",
            Self::Logarithm => "logarithm",
            Self::Knee { .. } => "knee",
        }
    }

    /// g(x), g'(x) and ∫g for x ≥ 0.
    fn values(self, x: f64) -> (f64, f64, f64) {
        match self {
            Self::Arctangent => {
                let g = x.atan();
                (g, 1.0 / (1.0 + x * x), x * g - 0.5 * (x * x).ln_1p())
            }
            Self::Froehlich => {
                let d = 1.0 / (1.0 + x);
                (x * d, d * d, x - x.ln_1p())
            }
            Self::Root => {
                let r = (1.0 + x * x).sqrt();
                (x / r, 1.0 / (r * r * r), r - 1.0)
            }
            Self::Logarithm => {
                let l = x.ln_1p();
                (l, 1.0 / (1.0 + x), (1.0 + x) * l - x)
            }
            Self::Knee { width } => {
                let w2 = width * width;
                // Scaled so that the slope at the origin is one.
                let s0 = (1.0 + w2).sqrt();
                let scale = 2.0 / (1.0 + 1.0 / s0);
                let y = x - 1.0;
                let s = (y * y + w2).sqrt();
                let area = |y: f64, s: f64| 0.5 * (y * s + w2 * (y / width).asinh());
                let value = 0.5 * (x + s0 - s);
                let integral = 0.5 * (0.5 * x * x + s0 * x - area(y, s) + area(-1.0, s0));
                (scale * value, scale * 0.5 * (1.0 - y / s), scale * integral)
            }
        }
    }
}

/// A flux curve of one winding or of the main path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FluxCurve {
    /// Inductance at the origin, H.
    pub unsaturated_h: f64,
    /// The part that saturates; `None` is a straight line.
    pub saturation: Option<Saturation>,
}

/// The part of a flux curve that saturates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Saturation {
    /// Shape of the bend.
    pub shape: Shape,
    /// Slope far beyond the bend over the slope at the origin.
    pub final_slope: f64,
    /// Current I₀ that scales the bend, A.
    pub current_a: f64,
}

/// Flux, incremental inductances and co-energy of a curve at one current.
#[derive(Clone, Copy, Debug)]
pub struct CurvePoint {
    /// ψ/i, H.
    pub chord_h: f64,
    /// dψ/di, H.
    pub slope_h: f64,
    /// ∫ψ di, J (of one axis of the plane; three phases carry 3/2).
    pub coenergy_j: f64,
}

impl FluxCurve {
    /// A straight line.
    pub fn linear(inductance_h: f64) -> Self {
        Self { unsaturated_h: inductance_h, saturation: None }
    }

    /// A curve whose chord has fallen by `drop` (a fraction) at the current `at_a`.
    pub fn with_drop(unsaturated_h: f64, drop: f64, at_a: f64, shape: Shape, final_slope: f64) -> Self {
        let target = (1.0 - drop - final_slope) / (1.0 - final_slope);
        assert!(target > 0.0 && drop > 0.0, "a curve cannot fall below its final slope");
        // g(x)/x falls from one: bisect on ln x.
        let (mut low, mut high) = (-12.0_f64, 8.0_f64);
        for _ in 0..80 {
            let middle = 0.5 * (low + high);
            let x = middle.exp();
            if shape.values(x).0 / x > target { low = middle } else { high = middle }
        }
        let current_a = at_a / (0.5 * (low + high)).exp();
        Self { unsaturated_h, saturation: Some(Saturation { shape, final_slope, current_a }) }
    }

    /// The same curve with all inductances multiplied.
    pub fn scaled(self, k: f64) -> Self {
        Self { unsaturated_h: k * self.unsaturated_h, ..self }
    }

    /// The curve at a current of the given length, A.
    pub fn at(&self, current_a: f64) -> CurvePoint {
        let l = self.unsaturated_h;
        let straight = |l: f64| CurvePoint { chord_h: l, slope_h: l, coenergy_j: 0.5 * l * current_a * current_a };
        let Some(s) = self.saturation else { return straight(l) };
        let x = current_a / s.current_a;
        if x < 1e-9 {
            return straight(l);
        }
        let (g, slope, integral) = s.shape.values(x);
        let (a, b) = (s.final_slope * l, (1.0 - s.final_slope) * l);
        CurvePoint {
            chord_h: a + b * g / x,
            slope_h: a + b * slope,
            coenergy_j: 0.5 * a * current_a * current_a + b * s.current_a * s.current_a * integral,
        }
    }

    /// Matrix of incremental inductances for a current vector.
    pub fn incremental(&self, current: Vector) -> Symmetric {
        if self.saturation.is_none() {
            return Symmetric::isotropic(self.unsaturated_h);
        }
        let p = self.at(current.length());
        Symmetric::along_across(current, p.slope_h, p.chord_h)
    }
}

/// A random shape for the main flux, with a random slope beyond the bend.
pub fn random_main_shape(chance: &mut Chance) -> (Shape, f64) {
    let final_slope = chance.between(0.08, 0.2);
    let width = chance.between(0.25, 0.5);
    let shape = match chance.one_of(4) {
        0 => Shape::Arctangent,
        1 => Shape::Froehlich,
        2 => Shape::Root,
        _ => Shape::Knee { width },
    };
    (shape, final_slope)
}

/// A random shape for leakage flux: gradual, with about half of the leakage left at the end.
pub fn random_leakage_shape(chance: &mut Chance) -> (Shape, f64) {
    let final_slope = chance.between(0.35, 0.5);
    let shape = match chance.one_of(3) {
        0 => Shape::Arctangent,
        1 => Shape::Froehlich,
        _ => Shape::Logarithm,
    };
    (shape, final_slope)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHAPES: [Shape; 5] = [Shape::Arctangent, Shape::Froehlich, Shape::Root, Shape::Logarithm, Shape::Knee { width: 0.3 }];

    #[test]
    fn slope_and_coenergy_belong_to_the_flux() {
        for shape in SHAPES {
            let curve = FluxCurve::with_drop(0.2, 0.25, 5.0, shape, 0.1);
            for i in [0.5, 3.0, 5.0, 12.0] {
                let h = 1e-4;
                let flux = |i: f64| curve.at(i).chord_h * i;
                let p = curve.at(i);
                assert!(((flux(i + h) - flux(i - h)) / (2.0 * h) - p.slope_h).abs() < 1e-7, "{shape:?}");
                let slope = (curve.at(i + h).coenergy_j - curve.at(i - h).coenergy_j) / (2.0 * h);
                assert!((slope - flux(i)).abs() < 1e-7, "{shape:?} at {i}: {slope} against {}", flux(i));
            }
        }
    }

    #[test]
    fn chord_falls_by_the_stated_drop() {
        for shape in SHAPES {
            let curve = FluxCurve::with_drop(0.2, 0.25, 5.0, shape, 0.1);
            assert!((curve.at(5.0).chord_h - 0.15).abs() < 1e-9);
            assert!((curve.at(1e-6).chord_h - 0.2).abs() < 1e-5);
            assert!(curve.at(9.0).slope_h < curve.at(9.0).chord_h);
        }
    }
}
