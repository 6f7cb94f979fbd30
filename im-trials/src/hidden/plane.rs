//! Vectors and 2×2 matrices of the α-β plane, in real numbers.

use std::ops::{Add, Mul, Neg, Sub};

/// A vector of the plane: `x` along α, `y` along β.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vector {
    /// Component along α.
    pub x: f64,
    /// Component along β.
    pub y: f64,
}

impl Vector {
    /// The zero vector.
    pub const ZERO: Self = Self { x: 0.0, y: 0.0 };

    /// A vector from its components.
    pub const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// A vector of the given length and angle (rad).
    pub fn polar(length: f64, angle_rad: f64) -> Self {
        let (s, c) = angle_rad.sin_cos();
        Self::new(length * c, length * s)
    }

    /// Euclidean length.
    pub fn length(self) -> f64 {
        self.dot(self).sqrt()
    }

    /// Scalar product.
    pub fn dot(self, other: Self) -> f64 {
        self.x * other.x + self.y * other.y
    }

    /// Third component of the cross product, `self × other`.
    pub fn cross(self, other: Self) -> f64 {
        self.x * other.y - self.y * other.x
    }

    /// The vector turned by +90°.
    pub fn quarter_turn(self) -> Self {
        Self::new(-self.y, self.x)
    }

    /// The vector turned by the angle whose cosine and sine are given.
    pub fn turn(self, (cos, sin): (f64, f64)) -> Self {
        Self::new(cos * self.x - sin * self.y, sin * self.x + cos * self.y)
    }

    /// The vector turned back by the angle whose cosine and sine are given.
    pub fn turn_back(self, (cos, sin): (f64, f64)) -> Self {
        self.turn((cos, -sin))
    }

    /// Phase values a, b, c of a star without neutral.
    pub fn phases(self) -> [f64; 3] {
        let half = 0.5 * self.x;
        let across = 0.75_f64.sqrt() * self.y;
        [self.x, -half + across, -half - across]
    }

    /// The space vector (peak value) of three phase values; what they have in common drops out.
    pub fn from_phases([a, b, c]: [f64; 3]) -> Self {
        Self::new((2.0 * a - b - c) / 3.0, (b - c) / 3.0_f64.sqrt())
    }
}

impl Add for Vector {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self::new(self.x + o.x, self.y + o.y)
    }
}

impl Sub for Vector {
    type Output = Self;
    fn sub(self, o: Self) -> Self {
        Self::new(self.x - o.x, self.y - o.y)
    }
}

impl Neg for Vector {
    type Output = Self;
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y)
    }
}

impl Mul<f64> for Vector {
    type Output = Self;
    fn mul(self, k: f64) -> Self {
        Self::new(k * self.x, k * self.y)
    }
}

/// A symmetric 2×2 matrix: inductances, resistances and their inverses.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Symmetric {
    /// Entry α-α.
    pub xx: f64,
    /// Entry α-β.
    pub xy: f64,
    /// Entry β-β.
    pub yy: f64,
}

impl Symmetric {
    /// The same value in every direction.
    pub const fn isotropic(k: f64) -> Self {
        Self { xx: k, xy: 0.0, yy: k }
    }

    /// `along` in the direction of `n` (any length), `across` at right angles to it.
    pub fn along_across(n: Vector, along: f64, across: f64) -> Self {
        let square = n.dot(n);
        if square < 1e-300 {
            return Self::isotropic(along);
        }
        let k = (along - across) / square;
        Self { xx: across + k * n.x * n.x, xy: k * n.x * n.y, yy: across + k * n.y * n.y }
    }

    /// The inverse.
    pub fn inverse(self) -> Self {
        let k = 1.0 / (self.xx * self.yy - self.xy * self.xy);
        Self { xx: k * self.yy, xy: -k * self.xy, yy: k * self.xx }
    }

    /// `p · self · p`.
    pub fn between(self, p: Self) -> Self {
        let column_x = p * (self * Vector::new(p.xx, p.xy));
        let column_y = p * (self * Vector::new(p.xy, p.yy));
        Self { xx: column_x.x, xy: column_x.y, yy: column_y.y }
    }
}

impl Add for Symmetric {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self { xx: self.xx + o.xx, xy: self.xy + o.xy, yy: self.yy + o.yy }
    }
}

impl Mul<f64> for Symmetric {
    type Output = Self;
    fn mul(self, k: f64) -> Self {
        Self { xx: k * self.xx, xy: k * self.xy, yy: k * self.yy }
    }
}

impl Mul<Vector> for Symmetric {
    type Output = Vector;
    fn mul(self, v: Vector) -> Vector {
        Vector::new(self.xx * v.x + self.xy * v.y, self.xy * v.x + self.yy * v.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phases_and_back() {
        let v = Vector::new(3.0, -7.0);
        let [a, b, c] = v.phases();
        assert!((a + b + c).abs() < 1e-14);
        let w = Vector::from_phases([a + 5.0, b + 5.0, c + 5.0]);
        assert!((v - w).length() < 1e-14);
    }

    #[test]
    fn inverse_undoes_a_matrix() {
        let m = Symmetric::along_across(Vector::new(1.0, 2.0), 0.3, 0.9);
        let v = Vector::new(-2.0, 0.7);
        assert!((m.inverse() * (m * v) - v).length() < 1e-14);
    }
}
