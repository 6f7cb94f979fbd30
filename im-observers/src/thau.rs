//! The fifth-order observer of Kwon, Sudhoff, Żak and Hui (Section VI), after Thau: x̂' = Ax̂ + B₁u + B₂u₂(x̂, τ̂_L) + L(y − Cx̂).
//!
//! ```text
//! ω̂' = μ λ̂ × î − (D/J)ω̂ − τ̂_L/J + L_ω e,   λ̂' = aλ̂ + ηL_m î + L_λ e,   î' = −βaλ̂ − γî + u/σL_s + L_i e,   e = i − î
//! ```
//!
//! The paper runs it with L = 0 ([`ThauGains::published`]) and with two load torques:
//! * τ̂_L = kω̂ ([`LoadTorqueModel::Proportional`]): a copy of the drive. Errors decay with its friction, (D + k)/J, and with its own torque.
//! * τ̂_L = (3/2)n_p(L_m/L_r) λ̂ × i with the *measured* current ([`LoadTorqueModel::EqualToTorque`]). Then ω̂' = μ λ̂ × (î − i) − (D/J)ω̂: this *is*
//!   Kubota's integral law with K_I = μ/(n_pβ), and a leak D/J that needs a current error of Dω/(Jμ|λ|) to hold a speed ω. The paper's
//!   "deviation in the stator current" is this. [`LoadTorqueModel::Balanced`] takes friction as part of the load: no leak, no such error.
//!
//! **Shifted eigenvalues** ([`ThauGains::shifted`]). (A, C) of (9), (10) is detectable: −D/J of the speed stays whatever L is, and "the designer … may decide to
//! shift the observable eigenvalues of A". With L_λ = l₁, L_i = l₂ in both axes A − LC is, beside −D/J, twice
//!
//! ```text
//! [ −η   ηL_m − l₁ ]
//! [ ηβ    −γ − l₂  ],   det(s − …) = s² + (η + γ + l₂)s + η(γ + l₂) − ηβ(ηL_m − l₁)
//! ```
//!
//! which is s² + 2ζω₀s + ω₀² for l₂ = 2ζω₀ − γ − η, l₁ = ηL_m − (γ + l₂)/β + ω₀²/(ηβ).
//!
//! Designed gains: constant in the frame at rest (`im-design`, `thau`), or certified over a box of frame speed, slip and flux in the frame of the
//! estimated flux, affine in its speed (`thau_box`). For negative frame speed the gain is mirrored, since the machine is.
//!
//! With a box gain the torque is μ λ̂ × i, with the *measured* current. The certificate is for this choice: the speed error then obeys
//! ė_ω = μ(λ̂ − λ) × i − (D/J)e_ω − L_ω e_i, without the first term where the load torque equals the estimated torque. With the estimated current,
//! μ λ̂ × î, there would be a further term μ λ̂ × e_i, which grows with the flux and is not in the vertices of the box. L_ω already holds the gain on e_i.
//!
//! **Forward Euler** takes everything at the beginning of the sample; with a box gain in the frame of the estimated flux, z⁺ = e^{jhω_f}(z + h(ż − jω_fz)), ω_f
//! the speed at which the flux stays on the d axis: the step that `im_design::sampled::over_box` certifies, of a machine stepped alike. In this frame
//! a steady state stands still, so that the step leaves it where it is, which forward Euler in the frame at rest does not.
//!
//! **Step limits.** The electrical part by the warped trapezoidal rule, any step. The correction is implicit, e at the end of the sample,
//! x̂ = x̂_p + hL(1 + hL_i)⁻¹(i − î_p): exact where e = 0, whatever the step. The speed is stepped after the currents: h²μn_pβ|λ|² < 1, with a box gain
//! h²|L_ω|n_pβ|λ| < 1 (checked at the largest flux).

use im_model::space_vector::{cross, j, norm2, turn};
use im_model::{Bound, Complex, Machine, Rating, Scalar};
use num_traits::Zero;

use crate::basis::{Basis, Discretization, Watch};
use crate::error::{ObserverError, finite};
use crate::interface::{Estimate, Input, Observer};
use crate::named::{Gains, Named};
use crate::tustin::{Flow, warped};

/// What the observer takes the load torque to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LoadTorqueModel {
    /// τ̂_L = kω̂ (Kwon et al., first study).
    Proportional {
        /// k, N m s/rad; zero is no load.
        coefficient_nm_s_per_rad: f64,
    },
    /// τ̂_L equal to the estimated torque with the measured current (second study and experiments).
    EqualToTorque,
    /// τ̂_L and friction together equal to it: the speed stands still but for what the current error says.
    Balanced,
}

/// A gain in the frame at rest, as `im-design` gives it (`thau`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThauGains {
    /// L, rows (ω, λ_a, λ_b, i_a, i_b), columns (i_a, i_b).
    pub gain: [[f64; 2]; 5],
}

impl ThauGains {
    /// L = 0, as in the paper's implementation.
    pub const fn published() -> Self {
        Self { gain: [[0.0; 2]; 5] }
    }

    /// The gain that puts the observable eigenvalues of A − LC to the roots of s² + 2ζω₀s + ω₀², each twice.
    ///
    /// # Errors
    /// A natural frequency ω₀ (rad/s) or a damping ζ that is not positive and finite.
    pub fn shifted(machine: &Machine<f64>, natural_rad_s: f64, damping: f64) -> Result<Self, ObserverError> {
        Bound::Positive.check("natural_rad_s", natural_rad_s)?;
        Bound::Positive.check("damping", damping)?;
        let c = machine.parameters().windings().derived(machine.pole_pairs());
        let l_2 = 2.0 * damping * natural_rad_s - c.gamma - c.eta;
        let l_1 = c.eta_l_m - (c.gamma + l_2) / c.beta + natural_rad_s * natural_rad_s / (c.eta * c.beta);
        Ok(Self { gain: [[0.0, 0.0], [l_1, 0.0], [0.0, l_1], [l_2, 0.0], [0.0, l_2]] })
    }
}

/// A gain in the frame of the estimated flux, affine in its speed, as `im-design` gives it (`thau_box`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThauBoxGains {
    /// Frame speeds covered, electrical rad/s; held to at the ends. Positive: negative speeds mirror it.
    pub frame_rad_s: [f64; 2],
    /// L₀, rows (ω, λ_d, λ_q, i_d, i_q), columns (i_d, i_q).
    pub gain: [[f64; 2]; 5],
    /// L₁: the gain at the frame speed ω_f (rad/s) is L₀ + ω_f L₁.
    pub gain_per_frame_speed: [[f64; 2]; 5],
}

/// The correction's gain.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Gain<T> {
    None,
    AtRest([[T; 2]; 5]),
    InFluxFrame { range: [T; 2], at_zero: [[T; 2]; 5], slope: [[T; 2]; 5] },
}

/// What drives the estimated speed, over μ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Torque {
    /// λ̂ × î: the copy of the drive.
    Copied,
    /// λ̂ × (î − i): the copy less a load torque from the measured current.
    Difference,
    /// λ̂ × i, a box gain's torque.
    Measured,
    /// Nothing: the same less the same.
    Cancelled,
}

/// The observer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thau<T> {
    basis: Basis<T>,
    gain: Gain<T>,
    /// (D + k)/J, 1/s.
    damping: T,
    torque: Torque,
    discretization: Discretization,
}

/// ω̂, λ̂, î.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThauState<T> {
    omega_m: T,
    lambda: Complex<T>,
    i_hat: Complex<T>,
    watch: Watch<T>,
}

impl<T: Scalar> Default for ThauState<T> {
    fn default() -> Self {
        Self { omega_m: T::zero(), lambda: Complex::zero(), i_hat: Complex::zero(), watch: Watch::default() }
    }
}

impl<T: Scalar> Thau<T> {
    /// With a gain in the frame at rest and [`Discretization::Implicit`].
    ///
    /// # Errors
    /// A gain that is not finite, a load torque out of bounds, a sampling time too long for the torque loop.
    pub fn try_new(basis: Basis<T>, gains: ThauGains, load: LoadTorqueModel) -> Result<Self, ObserverError> {
        Self::discretized(basis, gains, load, Discretization::Implicit)
    }

    /// With a chosen discretization.
    ///
    /// # Errors
    /// As [`try_new`](Self::try_new).
    pub fn discretized(
        basis: Basis<T>,
        gains: ThauGains,
        load: LoadTorqueModel,
        discretization: Discretization,
    ) -> Result<Self, ObserverError> {
        finite("gain", &gains.gain)?;
        let gain = if gains == ThauGains::published() { Gain::None } else { Gain::AtRest(cast(&gains.gain)) };
        Self::build(basis, gain, load, discretization)
    }

    /// With a gain certified over a box, in the frame of the estimated flux: the loop of the certificate, torque by the measured current (see the module).
    ///
    /// [`LoadTorqueModel::EqualToTorque`] is the certificate's case without currents, [`LoadTorqueModel::Proportional`] (k = 0) that with currents.
    /// [`LoadTorqueModel::Balanced`] leaves −(D/J)e_ω out, for no error at constant speed: of the rate α it keeps α − (D/J)√(P₁₁(P⁻¹)₁₁).
    ///
    /// # Errors
    /// A gain that is not finite, a range that is not positive and ordered, otherwise as [`try_new`](Self::try_new).
    pub fn in_box(basis: Basis<T>, gains: ThauBoxGains, load: LoadTorqueModel) -> Result<Self, ObserverError> {
        Self::in_box_discretized(basis, gains, load, Discretization::Implicit)
    }

    /// The same with a chosen discretization: [`Discretization::ForwardEuler`] for a gain that was certified for the sampling time (`im design thau-box --period`).
    ///
    /// # Errors
    /// As [`in_box`](Self::in_box).
    pub fn in_box_discretized(
        basis: Basis<T>,
        gains: ThauBoxGains,
        load: LoadTorqueModel,
        discretization: Discretization,
    ) -> Result<Self, ObserverError> {
        finite("gain", &gains.gain)?;
        finite("gain_per_frame_speed", &gains.gain_per_frame_speed)?;
        let [low, high] = gains.frame_rad_s;
        Bound::NotNegative.check("frame_rad_s (lower)", low)?;
        Bound::Within(low, 1e6).check("frame_rad_s (upper)", high)?;
        let gain = Gain::InFluxFrame {
            range: [T::from_f64(low), T::from_f64(high)],
            at_zero: cast(&gains.gain),
            slope: cast(&gains.gain_per_frame_speed),
        };
        Self::build(basis, gain, load, discretization)
    }

    fn build(
        basis: Basis<T>,
        gain: Gain<T>,
        load: LoadTorqueModel,
        discretization: Discretization,
    ) -> Result<Self, ObserverError> {
        let boxed = matches!(gain, Gain::InFluxFrame { .. });
        let (damping, follows) = match load {
            LoadTorqueModel::Proportional { coefficient_nm_s_per_rad: k } => {
                Bound::NotNegative.check("coefficient_nm_s_per_rad", k)?;
                (basis.friction_rate.value() + k * basis.inverse_inertia.value(), false)
            }
            LoadTorqueModel::EqualToTorque => (basis.friction_rate.value(), true),
            LoadTorqueModel::Balanced => (0.0, true),
        };
        let torque = match (boxed, follows) {
            (false, false) => Torque::Copied,
            (false, true) => Torque::Difference,
            (true, false) => Torque::Measured,
            (true, true) => Torque::Cancelled,
        };
        let h = basis.sample_time_s.value();
        let flux = basis.limits.flux_max_vs.value();
        // What a current error does to the speed: μ|λ|, or L_ω at either end of the frame speeds.
        let (push, what) = match &gain {
            Gain::InFluxFrame { range, at_zero, slope } => {
                let at = |w: T| [0, 1].map(|k| (at_zero[0][k] + w * slope[0][k]).value());
                let size = |[d, q]: [f64; 2]| Scalar::sqrt(d * d + q * q);
                (size(at(range[0])).max(size(at(range[1]))), "the speed gain at the largest flux")
            }
            _ => (basis.nominal.torque.value() * basis.inverse_inertia.value() * flux, "the torque loop at the largest flux"),
        };
        let limit_s = 1.0 / Scalar::sqrt(push * basis.n_p.value() * basis.nominal.beta.value() * flux);
        if h > limit_s {
            let remedy = "sample faster, or lower flux_max_vs";
            return Err(ObserverError::StepTooLong { what, sample_time_s: h, limit_s, remedy });
        }
        Ok(Self { basis, gain, damping: T::from_f64(damping), torque, discretization })
    }

    /// The frame of the estimated flux, which turns with what this current drives; none without flux.
    #[inline(always)]
    fn flux_frame(&self, lambda: Complex<T>, omega_m: T, i_s: Complex<T>, eta_l_m: T) -> Option<FluxFrame<T>> {
        let flux2 = norm2(lambda);
        let least = self.basis.limits.flux_min_vs;
        if flux2 < least * least {
            return None;
        }
        let speed = self.basis.n_p * omega_m + eta_l_m * cross(lambda, i_s) / flux2;
        let inverse_flux = T::one() / flux2.sqrt();
        Some(FluxFrame { d: lambda.scale(inverse_flux), inverse_flux, speed: speed.abs(), backward: speed < T::zero() })
    }

    /// h L e at the end of the sample as (ω, λ, i), e being the error before the correction.
    #[inline(always)]
    fn correction(
        &self,
        lambda: Complex<T>,
        omega_m: T,
        i_s: Complex<T>,
        eta_l_m: T,
        e: Complex<T>,
    ) -> (T, Complex<T>, Complex<T>) {
        let h = self.basis.sample_time_s;
        match &self.gain {
            Gain::None => (T::zero(), Complex::zero(), Complex::zero()),
            Gain::AtRest(gain) => apply(gain, implicit(gain, e, h)),
            Gain::InFluxFrame { range, at_zero, slope } => match self.flux_frame(lambda, omega_m, i_s, eta_l_m) {
                None => (T::zero(), Complex::zero(), Complex::zero()),
                Some(frame) => {
                    let gain = scheduled(*range, at_zero, slope, frame.speed);
                    frame.back(apply(&gain, implicit(&gain, frame.seen(e), h)))
                }
            },
        }
    }

    /// L e at the beginning of the sample as (ω, λ, i), and the speed of the frame in which forward Euler steps, rad/s: with a box gain
    /// that at which the flux stays on the d axis, |λ̂|ω_f = Im λ̂'.
    #[inline(always)]
    fn explicit(&self, s: &ThauState<T>, eta_l_m: T, e: Complex<T>) -> ((T, Complex<T>, Complex<T>), T) {
        let none = ((T::zero(), Complex::zero(), Complex::zero()), T::zero());
        match &self.gain {
            Gain::None => none,
            Gain::AtRest(gain) => (apply(gain, e), T::zero()),
            Gain::InFluxFrame { range, at_zero, slope } => {
                let Some(frame) = self.flux_frame(s.lambda, s.omega_m, s.i_hat, eta_l_m) else { return none };
                let e = frame.seen(e);
                // ω_f = ω + (L₀ + ω_f L₁)_λq e/|λ̂|
                let pulled = |l: &[[T; 2]; 5]| (l[2][0] * e.re + l[2][1] * e.im) * frame.inverse_flux;
                let own = (T::one() - pulled(slope)).max(T::from_f64(0.5));
                let gain = scheduled(*range, at_zero, slope, (frame.speed + pulled(at_zero)) / own);
                let (omega, flux, current) = apply(&gain, e);
                let speed = frame.speed + flux.im * frame.inverse_flux;
                (frame.back((omega, flux, current)), if frame.backward { -speed } else { speed })
            }
        }
    }
}

/// The frame of the estimated flux; of a flux that turns backward its mirror image.
struct FluxFrame<T> {
    /// λ̂/|λ̂|.
    d: Complex<T>,
    /// 1/|λ̂|.
    inverse_flux: T,
    /// |n_pω̂ + ηL_m i_q/|λ̂||, electrical rad/s.
    speed: T,
    backward: bool,
}

impl<T: Scalar> FluxFrame<T> {
    #[inline(always)]
    fn mirrored(&self, z: Complex<T>) -> Complex<T> {
        if self.backward { z.conj() } else { z }
    }

    /// From the frame at rest.
    #[inline(always)]
    fn seen(&self, z: Complex<T>) -> Complex<T> {
        self.mirrored(z * self.d.conj())
    }

    /// To the frame at rest.
    #[inline(always)]
    fn back(&self, (omega, flux, current): (T, Complex<T>, Complex<T>)) -> (T, Complex<T>, Complex<T>) {
        let omega = if self.backward { -omega } else { omega };
        (omega, self.mirrored(flux) * self.d, self.mirrored(current) * self.d)
    }
}

/// L₀ + ω_f L₁, the speed held to its range.
#[inline(always)]
fn scheduled<T: Scalar>(range: [T; 2], at_zero: &[[T; 2]; 5], slope: &[[T; 2]; 5], speed: T) -> [[T; 2]; 5] {
    let speed = speed.max(range[0]).min(range[1]);
    core::array::from_fn(|r| [0, 1].map(|k| at_zero[r][k] + speed * slope[r][k]))
}

fn cast<T: Scalar>(gain: &[[f64; 2]; 5]) -> [[T; 2]; 5] {
    gain.map(|row| row.map(T::from_f64))
}

/// h(1 + hL_i)⁻¹ e: what a correction by the error after it makes of the error before it.
#[inline(always)]
fn implicit<T: Scalar>(l: &[[T; 2]; 5], e: Complex<T>, h: T) -> Complex<T> {
    let one = T::one();
    let [[a, b], [c, d]] = [l[3].map(|x| x * h), l[4].map(|x| x * h)];
    let share = h / ((one + a) * (one + d) - b * c);
    Complex::new(((one + d) * e.re - b * e.im) * share, ((one + a) * e.im - c * e.re) * share)
}

/// L e as (ω, λ, i).
#[inline(always)]
fn apply<T: Scalar>(l: &[[T; 2]; 5], e: Complex<T>) -> (T, Complex<T>, Complex<T>) {
    let row = |r: [T; 2]| r[0] * e.re + r[1] * e.im;
    (row(l[0]), Complex::new(row(l[1]), row(l[2])), Complex::new(row(l[3]), row(l[4])))
}

impl<T: Scalar> Observer<T> for Thau<T> {
    type State = ThauState<T>;

    fn state_at(&self, rotor_flux_vs: Complex<T>, i_s: Complex<T>, omega_m: T) -> ThauState<T> {
        ThauState { omega_m, lambda: rotor_flux_vs, i_hat: i_s, watch: Watch::from_current(i_s) }
    }

    #[inline]
    fn step(&self, s: &mut ThauState<T>, input: &Input<T>) -> Estimate<T> {
        let b = &self.basis;
        let sample = b.admit(&s.watch, input, s.i_hat);
        let c = b.electrical(s.lambda, sample.i_mean);
        let (h, mu) = (b.sample_time_s, c.torque * b.inverse_inertia);
        let drive = sample.u_s.scale(c.inverse_sigma_l_s);
        let a = Complex::new(-c.eta, b.n_p * s.omega_m);
        let d_lambda = a * s.lambda + s.i_hat.scale(c.eta_l_m);
        let d_psi = drive - s.i_hat.scale(c.stator_rate);
        let before = (s.lambda, s.i_hat);
        let pull = |lambda: Complex<T>, i_hat: Complex<T>, i_s: Complex<T>| match self.torque {
            Torque::Copied => cross(lambda, i_hat),
            Torque::Difference => cross(lambda, i_hat - i_s),
            Torque::Measured => cross(lambda, i_s),
            Torque::Cancelled => T::zero(),
        };
        match self.discretization {
            Discretization::Implicit => {
                let flow = Flow { a, c: c.eta_l_m, g: c.stator_rate, beta: c.beta };
                [s.lambda, s.i_hat] = flow.step([s.lambda, s.i_hat], [d_lambda, d_psi], warped(h, a.im));
                let torque = if self.torque == Torque::Difference {
                    pull(s.lambda, s.i_hat, sample.i_s)
                } else {
                    (pull(before.0, before.1, sample.i_before) + pull(s.lambda, s.i_hat, sample.i_s)) * T::from_f64(0.5)
                };
                s.omega_m = (s.omega_m + h * mu * torque) / (T::one() + h * self.damping);
                if sample.measured {
                    let e = sample.i_s - s.i_hat;
                    let (omega, flux, current) = self.correction(s.lambda, s.omega_m, sample.i_s, c.eta_l_m, e);
                    s.omega_m += omega;
                    s.lambda += flux;
                    s.i_hat += current;
                }
            }
            Discretization::ForwardEuler => {
                let ((omega, flux, current), frame) = self.explicit(s, c.eta_l_m, sample.i_before - s.i_hat);
                let torque = pull(s.lambda, s.i_hat, sample.i_before);
                s.omega_m += (mu * torque - self.damping * s.omega_m + omega) * h;
                let turned = turn(h * frame);
                let stepped = |z: Complex<T>, rate: Complex<T>| (z + (rate - j(z).scale(frame)).scale(h)) * turned;
                s.lambda = stepped(s.lambda, d_lambda + flux);
                s.i_hat = stepped(s.i_hat, d_psi - d_lambda.scale(c.beta) + current);
            }
        }
        let (estimate, finite) = b.conclude(&mut s.watch, &sample, &c, &mut s.lambda, &mut s.i_hat, &mut s.omega_m);
        if !finite {
            *s = ThauState::default();
        }
        estimate
    }
}

impl<T: Scalar> Named<T> for Thau<T> {
    const NAME: &'static str = "thau";
    const TITLE: &'static str = "Thau";
    const TABLES: &'static [&'static str] = &["thau_box", "sampled_thau_box", "thau", "sampled_thau"];

    fn made<G: Gains>(basis: Basis<T>, _: &Machine<f64>, _: &Rating, gains: &G) -> Result<Self, G::Error> {
        let proportional = gains.number("load_coefficient_nm_s_per_rad")?;
        let load = |usual| {
            proportional.map_or(usual, |coefficient_nm_s_per_rad| LoadTorqueModel::Proportional { coefficient_nm_s_per_rad })
        };
        Ok(match gains.table() {
            None => Self::try_new(basis, ThauGains::published(), load(LoadTorqueModel::EqualToTorque))?,
            Some(name) if name.ends_with("_box") => {
                let given = ThauBoxGains {
                    frame_rad_s: gains.range("frame_rad_s")?,
                    gain: gains.rows("gain")?,
                    gain_per_frame_speed: gains.rows("gain_per_frame_speed")?,
                };
                Self::in_box_discretized(basis, given, load(LoadTorqueModel::Balanced), gains.discretization())?
            }
            Some(_) => {
                let given = ThauGains { gain: gains.rows("gain")? };
                Self::discretized(basis, given, load(LoadTorqueModel::EqualToTorque), gains.discretization())?
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_model::machines::{JADOT_TABLE_I, KENNE_APPENDIX_II, KWON_TABLE_IV};
    use im_model::state_space::StateSpace;

    /// A − LC of (9), (10), (12) has −D/J and twice the roots of s² + 2ζω₀s + ω₀².
    #[test]
    fn the_observable_eigenvalues_are_where_they_are_shifted_to() {
        for m in [KWON_TABLE_IV, KENNE_APPENDIX_II, JADOT_TABLE_I] {
            let machine = Machine::<f64>::base(m.parameters(), m.pole_pairs).unwrap();
            let space = StateSpace::new(&machine.parameters().windings(), m.pole_pairs);
            for (natural, damping) in [(60.0, 0.8), (300.0, 0.5), (900.0, 0.95)] {
                let gain = ThauGains::shifted(&machine, natural, damping).unwrap().gain;
                let mut l = space.b_1;
                for (r, row) in gain.iter().enumerate() {
                    (l[(r, 0)], l[(r, 1)]) = (row[0], row[1]);
                }
                let found = (space.a - l * space.c).complex_eigenvalues();
                let root = Complex::new(-damping * natural, natural * Scalar::sqrt(1.0 - damping * damping));
                let friction = machine.parameters().viscous_friction_nm_s_per_rad / machine.parameters().inertia_kg_m2;
                for (wanted, times) in [(root, 2), (root.conj(), 2), (Complex::new(-friction, 0.0), 1)] {
                    // Double roots are found to the root of the rounding.
                    let near = found.iter().filter(|z| (**z - wanted).norm() < 1e-4 * natural).count();
                    assert_eq!(near, times, "{}: {found} {wanted}", m.name);
                }
            }
        }
        let machine = Machine::<f64>::base(JADOT_TABLE_I.parameters(), 2).unwrap();
        assert!(ThauGains::shifted(&machine, 0.0, 0.7).is_err() && ThauGains::shifted(&machine, 50.0, f64::NAN).is_err());
    }
}
