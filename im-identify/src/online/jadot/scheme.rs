//! What the schemes share: their input, their settings, when they hold still.

use super::super::{Estimate, ExcitationMonitor, Identifier, IdentifierStatus, Range, finite};
use super::parameters::RegulationParameters;
use im_model::space_vector::norm2;
use im_model::{Bound, Complex, ModelError, Scalar};

/// How the reference generator is followed at the end of a sample; vectors in its frame, which turns at ω_s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tracking<T> {
    /// Δi = i_s − i_ref, A.
    pub delta_i: Complex<T>,
    /// K_Pη: the voltage held by the integral action of (25), V.
    pub held_v: Complex<T>,
    /// i_ref, A.
    pub i_ref: Complex<T>,
    /// di_ref/dt in the frame, A/s.
    pub i_ref_rate: Complex<T>,
    /// φ_ref, Vs.
    pub phi_ref: Complex<T>,
    /// ω_r = n_p ω_m, rad/s.
    pub omega_r: T,
    /// ω_g = ω_s − ω_r, rad/s.
    pub omega_g: T,
    /// The measurement of this sample was lost: Δi is not one.
    pub lost: bool,
}

impl<T: Scalar> Tracking<T> {
    fn is_finite(&self) -> bool {
        // A sum is finite only if all of it is.
        let sum = self.delta_i + self.held_v + self.i_ref + self.i_ref_rate + self.phi_ref;
        !self.lost && finite(sum + self.omega_r + self.omega_g)
    }

    /// ω_s, rad/s.
    pub fn omega_s(&self) -> T {
        self.omega_r + self.omega_g
    }
}

/// An identifier that a reference generator can take its parameters from.
pub trait Adaptation<T: Scalar>: Identifier<T, 4, Input = Tracking<T>> {
    /// The parameters to use in the sample that begins.
    fn parameters(&self, state: &Self::State) -> RegulationParameters<T>;

    /// χ₁ dΔθ₁/dt + χ₂ dΔθ₂/dt of (43), V: to be subtracted from v_r.
    fn flux_injection(&self, _state: &Self::State) -> Complex<T> {
        Complex::new(T::zero(), T::zero())
    }

    /// Rate at which the integral action (25) is to forget, 1/s.
    fn integral_leak_per_s(&self, _state: &Self::State) -> T {
        T::zero()
    }
}

/// (53): no adaptation where |ω_s| or |ω_g| is small against 1/T_r.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeadZone<T> {
    /// ε₀: least |T_r ω_s|.
    pub least_turn: T,
    /// ε₁: least |T_r ω_g|.
    pub least_slip: T,
}

impl<T: Scalar> DeadZone<T> {
    /// The paper's ε₀ = 4, ε₁ = 1/4.
    pub fn of_the_paper() -> Self {
        Self { least_turn: T::from_f64(4.0), least_slip: T::from_f64(0.25) }
    }

    fn holds(&self, inverse_t_r: T, t: &Tracking<T>) -> bool {
        t.omega_s().abs() <= self.least_turn * inverse_t_r || t.omega_g.abs() <= self.least_slip * inverse_t_r
    }
}

/// What the schemes have in common.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SchemeSettings<T> {
    /// The estimates at the start.
    pub start: RegulationParameters<T>,
    /// Where they are kept, in the order R_req, L, R_s, L_f: the projection that the paper leaves open.
    pub ranges: [Range<T>; 4],
    /// Gains of the four against each other; zero holds a parameter. The reduced scheme is 1, 1, 0, 0.
    pub weights: [T; 4],
    /// (53), if wanted.
    pub dead_zone: Option<DeadZone<T>>,
    /// ‖B‖, V, below which nothing is learnt: standstill without current, no flux. A few times what dead time and noise leave.
    pub least_regressor_v: T,
    /// Window of the excitation monitor, s.
    pub excitation_window_s: T,
    /// Sampling time, s.
    pub sample_time_s: T,
}

impl<T: Scalar> SchemeSettings<T> {
    /// All four parameters, kept within a third and three times `start`, with 2 V as the least regressor and a window of 1 s.
    pub fn full(start: RegulationParameters<T>, sample_time_s: T) -> Self {
        let three = T::from_f64(3.0);
        Self {
            start,
            ranges: start.values().map(|x| Range::around(x, three)),
            weights: [T::one(); 4],
            dead_zone: None,
            least_regressor_v: T::from_f64(2.0),
            excitation_window_s: T::one(),
            sample_time_s,
        }
    }

    /// The reduced scheme of Section VI: R_req and L only, off in the paper's dead zone.
    pub fn reduced(start: RegulationParameters<T>, sample_time_s: T) -> Self {
        let (one, zero) = (T::one(), T::zero());
        Self { weights: [one, one, zero, zero], dead_zone: Some(DeadZone::of_the_paper()), ..Self::full(start, sample_time_s) }
    }

    fn validate(&self) -> Result<(), ModelError> {
        self.start.validate()?;
        for ((name, x), range) in RegulationParameters::<T>::NAMES.into_iter().zip(self.start.values()).zip(self.ranges) {
            Bound::Positive.check(name, range.low().value())?;
            Bound::Within(range.low().value(), range.high().value()).check(name, x.value())?;
        }
        for w in self.weights {
            Bound::Within(0.0, 1e3).check("weights", w.value())?;
        }
        if let Some(zone) = self.dead_zone {
            Bound::NotNegative.check("least_turn", zone.least_turn.value())?;
            Bound::NotNegative.check("least_slip", zone.least_slip.value())?;
        }
        Bound::Positive.check("least_regressor_v", self.least_regressor_v.value())?;
        Bound::Positive.check("excitation_window_s", self.excitation_window_s.value())?;
        Bound::Within(1e-7, 1e-2).check("sample_time_s", self.sample_time_s.value())
    }
}

/// The estimates and the monitor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Adapted<T> {
    pub values: [T; 4],
    monitor: ExcitationMonitor<T, 4>,
    status: IdentifierStatus,
}

/// Checked settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Scheme<T> {
    ranges: [Range<T>; 4],
    weights: [T; 4],
    dead_zone: Option<DeadZone<T>>,
    least_regressor2: T,
    window_share: T,
    start: [T; 4],
    pub sample_time: T,
}

impl<T: Scalar> Scheme<T> {
    pub fn try_new(s: &SchemeSettings<T>) -> Result<Self, ModelError> {
        s.validate()?;
        Ok(Self {
            ranges: s.ranges,
            weights: s.weights,
            dead_zone: s.dead_zone,
            least_regressor2: s.least_regressor_v * s.least_regressor_v,
            window_share: T::one() - (-s.sample_time_s / s.excitation_window_s).exp(),
            start: s.start.values(),
            sample_time: s.sample_time_s,
        })
    }

    pub fn start(&self) -> Adapted<T> {
        Adapted { values: self.start, monitor: ExcitationMonitor::default(), status: IdentifierStatus::Filling }
    }

    pub fn parameters(&self, x: &Adapted<T>) -> RegulationParameters<T> {
        RegulationParameters::from_values(x.values)
    }

    /// Moves the estimates by their relative rates, `relative(1/‖regressor‖²)` times the weights, where there is something to learn from:
    /// returns the relative change of each, zero if held.
    pub fn adapt(
        &self,
        x: &mut Adapted<T>,
        tracking: &Tracking<T>,
        regressor: &[Complex<T>; 4],
        relative: impl FnOnce(T) -> [T; 4],
    ) -> [T; 4] {
        let zero = T::zero();
        let size = regressor.iter().fold(zero, |s, b| s + norm2(*b));
        if !tracking.is_finite() || !size.is_finite() {
            x.status = IdentifierStatus::LostSample;
            return [zero; 4];
        }
        x.monitor.add(regressor, self.least_regressor2, self.window_share);
        x.status = if size <= self.least_regressor2 {
            IdentifierStatus::NoExcitation
        } else if self.dead_zone.is_some_and(|zone| zone.holds(x.values[0] / x.values[1], tracking)) {
            IdentifierStatus::DeadZone
        } else {
            IdentifierStatus::Adapting
        };
        if x.status.is_frozen() {
            return [zero; 4];
        }
        let wanted = relative(T::one() / size);
        core::array::from_fn(|k| {
            let before = x.values[k];
            // A sample in which the law is no number changes nothing.
            let step = if wanted[k].is_finite() { wanted[k] * self.weights[k] } else { zero };
            x.values[k] = self.ranges[k].project(before + before * step);
            x.values[k] / before - T::one()
        })
    }

    pub fn estimate(&self, x: &Adapted<T>) -> Estimate<T, 4> {
        let moves = x.status == IdentifierStatus::Adapting;
        Estimate {
            values: x.values,
            adapting: self.weights.map(|w| moves && w > T::zero()),
            at_bound: core::array::from_fn(|k| self.ranges[k].binds(x.values[k])),
            excitation: x.monitor.excitation(),
            status: x.status,
        }
    }
}
