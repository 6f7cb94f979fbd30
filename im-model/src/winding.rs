//! The resistance of windings over their temperature.
//!
//! R(θ)/R(θ_0) = (k + θ)/(k + θ_0),   k = 235 °C for copper, 225 °C for the aluminium of cast cages (IEC 60034-2-1, 6.1.3 and 8.2.2.3.2)

/// What a winding is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Conductor {
    /// Stator windings.
    Copper,
    /// Cages, as nearly all of them are cast.
    Aluminium,
}

impl Conductor {
    /// Resistance at `to_c` over that at `from_c`, °C.
    pub fn warmed(self, from_c: f64, to_c: f64) -> f64 {
        let k = match self {
            Self::Copper => 235.0,
            Self::Aluminium => 225.0,
        };
        (k + to_c) / (k + from_c)
    }
}
