//! One run as the fitting sees it.

use im_model::{Complex, PlantInput, Recording, State};
use thiserror::Error;

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

/// How a run starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Start {
    /// At rest, unmagnetized, cold.
    Rest,
    /// In this state, known.
    State(State<f64>),
    /// In motion, about in this state: [`start_parameters`](super::start_parameters) fit its fluxes and speed with everything else.
    Estimated(State<f64>),
}

impl Start {
    /// The state.
    pub fn state(&self) -> State<f64> {
        match self {
            Self::Rest => State::default(),
            Self::State(x) | Self::Estimated(x) => *x,
        }
    }
}

/// Inputs and measured channels of one run, or of a table of steady states, all of the same length.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    /// Name for messages.
    pub name: String,
    /// Sampling time, s.
    pub sample_time_s: f64,
    /// Set for a table of steady states, Hz: each row then stands on its own, on a sinusoidal supply of this frequency and of the
    /// peak value |u_s|.
    pub supply_frequency_hz: Option<f64>,
    /// Voltage held over the sample that begins at the row, V.
    pub u_s: Vec<Complex<f64>>,
    /// Load torque, Nm; zero where nothing is known.
    pub tau_load: Vec<f64>,
    /// Speed imposed on the rotor, rad/s: the mechanics are then not simulated.
    pub imposed_speed: Option<Vec<f64>>,
    /// Nudges the simulated speed towards these values, rad/s, at a rate, 1/s ([`PlantInput::speed_nudge`](im_model::PlantInput)).
    pub speed_nudge: Option<(Vec<f64>, f64)>,
    /// What was measured.
    pub channels: Vec<Channel>,
    /// How it starts.
    pub start: Start,
}

/// An experiment that does not fit together.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum ExperimentError {
    /// Signals of unequal length.
    #[error("{experiment}: {signal} has {found} rows, the voltage has {expected}")]
    Length {
        /// Which experiment.
        experiment: String,
        /// Which signal.
        signal: String,
        /// Its rows.
        found: usize,
        /// Rows of the voltage.
        expected: usize,
    },
    /// Nothing to fit to.
    #[error("{experiment}: no channel has a usable row")]
    Empty {
        /// Which experiment.
        experiment: String,
    },
    /// A noise level that is not positive.
    #[error("{experiment}: the noise of {signal} is {sigma}; it must be positive and finite")]
    Sigma {
        /// Which experiment.
        experiment: String,
        /// Which signal.
        signal: String,
        /// The value.
        sigma: f64,
    },
}

impl Experiment {
    /// The α and β currents and the speed of a canonical recording, with the given noise (A, rad/s).
    pub fn from_recording(r: &Recording, sigma_current_a: [f64; 2], sigma_speed_rad_s: f64) -> Self {
        let channel = |name: &str, kind, values, sigma| Channel { name: name.into(), kind, values, valid: None, sigma };
        let current = |direction_rad| ChannelKind::Current { direction_rad };
        Self {
            name: r.name.clone(),
            sample_time_s: r.sample_time_s,
            supply_frequency_hz: None,
            u_s: r.u_s.clone(),
            tau_load: r.tau_load.clone().unwrap_or_else(|| vec![0.0; r.len()]),
            imposed_speed: None,
            speed_nudge: None,
            channels: vec![
                channel("i_alpha_A", current(0.0), r.i_s.iter().map(|i| i.re).collect(), sigma_current_a[0]),
                channel(
                    "i_beta_A",
                    current(core::f64::consts::FRAC_PI_2),
                    r.i_s.iter().map(|i| i.im).collect(),
                    sigma_current_a[1],
                ),
                channel("omega_m_rad_s", ChannelKind::Speed, r.omega_m.clone(), sigma_speed_rad_s),
            ],
            start: Start::Rest,
        }
    }

    /// The stator current vector whose projections fit the channels of row `k` best, with `value(c)` for channel c: (Σ d dᵀ) i = Σ d y.
    /// `None` where fewer than two directions count.
    pub fn current_vector(&self, k: usize, value: impl Fn(usize) -> f64) -> Option<Complex<f64>> {
        let (mut aa, mut ab, mut bb, mut ya, mut yb) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (c, channel) in self.channels.iter().enumerate() {
            if let ChannelKind::Current { direction_rad } = channel.kind
                && channel.is_valid(k)
            {
                let (b, a) = direction_rad.sin_cos();
                let y = value(c);
                aa += a * a;
                ab += a * b;
                bb += b * b;
                ya += a * y;
                yb += b * y;
            }
        }
        let det = aa * bb - ab * ab;
        (det > 1e-6).then(|| Complex::new((bb * ya - ab * yb) / det, (aa * yb - ab * ya) / det))
    }

    /// What drives the machine over the sample that begins at row `k`.
    pub fn input(&self, k: usize) -> PlantInput<f64> {
        let mut input = PlantInput::new(self.u_s[k], self.tau_load[k]);
        input.speed_nudge = self.speed_nudge.as_ref().map(|(w, rate)| [w[k], *rate]);
        input.imposed_speed = self.imposed_speed.as_ref().map(|w| [w[k], w[(k + 1).min(w.len() - 1)]]);
        input
    }

    /// Whether the rows are steady states of their own, not samples of one run.
    pub fn is_table(&self) -> bool {
        self.supply_frequency_hz.is_some()
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.u_s.len()
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.u_s.is_empty()
    }

    /// Number of residuals: usable rows over all channels.
    pub fn count(&self) -> usize {
        self.channels.iter().map(Channel::count).sum()
    }

    /// Checks lengths, noise levels, and that there is something to fit to.
    pub fn validate(&self) -> Result<(), ExperimentError> {
        let expected = self.len();
        let experiment = || self.name.clone();
        let length = |signal: &str, found: usize| {
            if found == expected {
                Ok(())
            } else {
                Err(ExperimentError::Length { experiment: experiment(), signal: signal.into(), found, expected })
            }
        };
        length("tau_load_Nm", self.tau_load.len())?;
        if let Some(w) = &self.imposed_speed {
            length("imposed speed", w.len())?;
        }
        if let Some((w, _)) = &self.speed_nudge {
            length("nudged speed", w.len())?;
        }
        for c in &self.channels {
            length(&c.name, c.values.len())?;
            if let Some(v) = &c.valid {
                length(&c.name, v.len())?;
            }
            if !(c.sigma > 0.0 && c.sigma.is_finite()) {
                return Err(ExperimentError::Sigma { experiment: experiment(), signal: c.name.clone(), sigma: c.sigma });
            }
        }
        if self.count() == 0 { Err(ExperimentError::Empty { experiment: experiment() }) } else { Ok(()) }
    }
}
