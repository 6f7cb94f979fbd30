//! A measured signal of a run.

/// What a channel shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ChannelKind {
    /// The projection of the stator current on a direction: Re(i e^{−jφ}), φ in rad. α is 0, β is π/2, phase b is 2π/3.
    Current {
        /// φ, rad.
        direction_rad: f64,
    },
    /// The mechanical speed.
    Speed,
    /// Root mean square of the phase current; steady states only.
    RmsCurrent,
    /// Active power of three phases; steady states only.
    ActivePower,
    /// Reactive power of three phases; steady states only.
    ReactivePower,
}

/// One measured signal.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Name with unit, as in files: `i_alpha_A`.
    pub name: String,
    /// What it shows.
    pub kind: ChannelKind,
    /// One value per row.
    pub values: Vec<f64>,
    /// Rows that may be used; all when absent.
    pub valid: Option<Vec<bool>>,
    /// Standard deviation of its noise, in its unit: the weight in the fit.
    pub sigma: f64,
}

impl Channel {
    /// Whether row `k` counts.
    #[inline]
    pub fn is_valid(&self, k: usize) -> bool {
        self.valid.as_ref().is_none_or(|v| v[k])
    }

    /// Number of rows that count.
    pub fn count(&self) -> usize {
        self.valid.as_ref().map_or(self.values.len(), |v| v.iter().filter(|x| **x).count())
    }
}
