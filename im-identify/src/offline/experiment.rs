//! One run as the fitting sees it.

use im_model::{Bench, Complex, EffectId, LoadLaw, Machine, Plant, PlantInput, Recording, Scalar, State};
use thiserror::Error;

use super::channel::{Channel, ChannelKind};
use super::load::{Load, ShownSpeed};
use super::speed::{UnsureInputs, VoltageNoise};

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
    /// Whether the voltage runs smoothly through its rows, as that of the mains does; the above is then its mean.
    pub is_smooth: bool,
    /// Noise of that voltage.
    pub voltage_noise: VoltageNoise,
    /// Load torque, Nm; zero where nothing is known.
    pub tau_load: Vec<f64>,
    /// What is known of the load torque beside that.
    pub load: Load,
    /// Speed imposed on the rotor, rad/s: the mechanics are then not simulated.
    pub imposed_speed: Option<Vec<f64>>,
    /// Nudges the simulated speed towards these values, rad/s, at a rate, 1/s ([`PlantInput::speed_nudge`](im_model::PlantInput)).
    pub speed_nudge: Option<(Vec<f64>, f64)>,
    /// R_s and R_r over those of the machine, by the temperature of the windings: for each row of a table, or once for a whole run; empty where
    /// nothing is known of it.
    pub warmth: Vec<[f64; 2]>,
    /// An effect that the way of recording takes out: an inverter's between command and terminals, where the terminals were measured; the zero of a
    /// voltage sensor, where the command was recorded.
    pub inert: Option<EffectId>,
    /// The part of the usual rate at which its speed may be nudged towards the measured one, 0 to 1: less where the noise of that would show.
    pub nudge_part: f64,
    /// What was measured.
    pub channels: Vec<Channel>,
    /// How it starts.
    pub start: Start,
}

/// Angle, rad, that fluxes turn by in a step of the fourth order so that its phase is right to 10⁻⁵ of it: a speed that is off by so little is no slip.
const TURN: f64 = 0.2;

/// Steps in a row at most: of more, a period has too few rows to say what a voltage does in between.
const SUBSTEPS: u32 = 4;

/// A voltage without derivatives.
#[inline(always)]
pub(super) fn constant<T: Scalar>(u: Complex<f64>) -> Complex<T> {
    Complex::new(T::from_f64(u.re), T::from_f64(u.im))
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
            is_smooth: false,
            voltage_noise: VoltageNoise::default(),
            tau_load: r.tau_load.clone().unwrap_or_else(|| vec![0.0; r.len()]),
            load: Load::Known,
            imposed_speed: None,
            speed_nudge: None,
            warmth: Vec::new(),
            inert: None,
            nudge_part: 1.0,
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

    /// The same run with the load taken as unknown: the measured speed is no longer compared, it drives the machine. Without a measured
    /// speed nothing changes.
    pub fn driven_by_speed(mut self) -> Self {
        let Some(k) = self.channels.iter().position(|c| c.kind == ChannelKind::Speed) else { return self };
        if self.is_table() || self.imposed_speed.is_some() {
            return self;
        }
        let shown = ShownSpeed::new(self.channels.remove(k), self.sample_time_s);
        // What the noise of the voltage does was said for a shaft that the torque moves.
        self.voltage_noise = VoltageNoise::of(self.voltage_noise.volts);
        self.load = Load::Unknown(shown);
        self
    }

    /// Whether the rotor turns at a given speed, whatever the torque.
    pub fn speed_is_imposed(&self) -> bool {
        self.imposed_speed.is_some() || matches!(self.load, Load::Unknown(_) | Load::Unseen(_))
    }

    /// What of its inputs is not known, once a machine says what that does.
    pub(super) fn unsure_inputs(&self) -> Option<&UnsureInputs> {
        self.voltage_noise.unsure().or_else(|| self.load.unsure_speed())
    }

    /// The state at the first row as far as it is known, the sizes of the load with it.
    pub fn start_state(&self) -> State<f64> {
        let mut x = self.start.state();
        if let Load::Law { constant, fan } = self.load {
            x.load = LoadLaw { constant_nm: constant.start(), fan_nm_s2: fan.start() };
        }
        x
    }

    /// The rotor's speed at the begin and the end of the sample that begins at row `k`, where it is imposed.
    #[inline(always)]
    pub(super) fn imposed<T: Scalar>(&self, plant: &Plant<T>, k: usize) -> Option<[T; 2]> {
        match (&self.imposed_speed, &self.load) {
            (Some(w), _) => Some([w[k], w[(k + 1).min(w.len() - 1)]].map(T::from_f64)),
            (None, Load::Unknown(shown)) => Some([shown.behind(plant, k), shown.behind(plant, k + 1)]),
            (None, Load::Unseen(found)) => Some([found.at(k), found.at(k + 1)]),
            _ => None,
        }
    }

    /// What the voltage changes by over the sample that begins at row `k`, V, where it is smooth: half of that between the means before and after; none
    /// across a row in which it was switched.
    #[inline(always)]
    fn rise(&self, k: usize) -> Option<Complex<f64>> {
        if !self.is_smooth {
            return None;
        }
        let is_known = |k: usize| self.voltage_noise.volts.switched.binary_search_by_key(&k, |x| x.0).is_err();
        let or_here = |other: usize| if is_known(other) { other } else { k };
        let (before, after) = (or_here(k.saturating_sub(1)), or_here((k + 1).min(self.u_s.len() - 1)));
        (is_known(k) && before < after).then(|| (self.u_s[after] - self.u_s[before]) / (after - before) as f64)
    }

    /// What drives a machine over the sample that begins at row `k`.
    #[inline(always)]
    pub fn input<T: Scalar>(&self, k: usize, plant: &Plant<T>) -> PlantInput<T> {
        let mut input = PlantInput::new(constant(self.u_s[k]), T::from_f64(self.tau_load[k]));
        input.u_rise = self.rise(k).map(constant);
        input.speed_nudge = self.speed_nudge.as_ref().map(|(w, rate)| [w[k], *rate].map(T::from_f64));
        input.imposed_speed = self.imposed(plant, k);
        input
    }

    /// The machine as this run has it: its windings as warm as at a row, and without what cannot act.
    #[inline(always)]
    pub fn machine_of<T: Scalar>(&self, machine: &Machine<T>, row: usize) -> Machine<T> {
        let warm = self.warmth.get(row).or(self.warmth.last()).map_or(*machine, |w| machine.warmed(*w));
        match self.inert.filter(|e| warm.effects().is_on(*e)) {
            // A machine without an effect is as valid as with it.
            Some(inert) => warm.without([inert]).unwrap_or(warm),
            None => warm,
        }
    }

    /// A machine at the start of the run, its windings as warm as they were.
    pub fn bench<T: Scalar>(&self, machine: &Machine<T>, start: &State<T>) -> Bench<T> {
        Bench::new(&self.machine_of(machine, 0), *start, T::from_f64(self.sample_time_s)).with_substeps(self.substeps())
    }

    /// Steps that a sample of a smooth voltage needs: in each it turns by [`TURN`] at most, as the fluxes do with it. A voltage that is held is that of a
    /// drive, which samples more often.
    fn substeps(&self) -> u32 {
        if !self.is_smooth {
            return 1;
        }
        let sum = |each: &mut dyn Iterator<Item = Complex<f64>>| each.map(|u| u.norm_sqr()).sum::<f64>();
        let steps = sum(&mut self.u_s.windows(2).map(|w| w[1] - w[0]));
        let turn = (steps / sum(&mut self.u_s.iter().copied()).max(f64::MIN_POSITIVE)).sqrt();
        ((turn / TURN).ceil() as u32).clamp(1, SUBSTEPS)
    }

    /// Ends the run after so many rows.
    pub fn end_after(&mut self, rows: usize) {
        self.u_s.truncate(rows);
        self.tau_load.truncate(rows);
        self.imposed_speed.iter_mut().for_each(|w| w.truncate(rows));
        self.warmth.truncate(rows.max(1));
        for c in &mut self.channels {
            c.values.truncate(rows);
            c.valid.iter_mut().for_each(|v| v.truncate(rows));
        }
        self.voltage_noise = VoltageNoise::of(self.voltage_noise.volts.up_to(rows));
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
        if self.warmth.len() > 1 {
            length("temperature of the windings", self.warmth.len())?;
        }
        if let Load::Unknown(shown) = &self.load {
            length("shown speed", shown.smooth.len())?;
            length(&shown.channel.name, shown.channel.values.len())?;
        }
        if let Load::Unseen(found) = &self.load {
            length("found speed", found.omega_m.len())?;
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
