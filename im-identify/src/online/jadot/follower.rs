//! The reference generator (17), (18) with the voltage of another drive: an adaptation plugs into any of them, and into a recording.
//!
//! The generator turns with its own flux, ω_g = R̂ Im(φ̄_ref i_ref)/|φ_ref|² (13): in the steady state the frame turns with the supply,
//! ω_g is the true slip whatever the parameters, and the integral action sees constants. Over a sample it is advanced by the
//! trapezoidal rule (stable at any period, exact in the steady state), the voltage turned to the middle of the sample.

use super::super::{Belief, Estimate, Identifier, IdentifierStatus, Reach, Sample, finite};
use super::parameters::RegulationParameters;
use super::scheme::{Adaptation, Tracking};
use im_model::space_vector::{cross, j, norm2, turn};
use im_model::{Bound, Complex, ModelError, Scalar};

/// λ of (22), H.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lambda<T> {
    /// One value at all speeds: the Lyapunov function (23) holds as it stands.
    Constant(T),
    /// R̂_req/√(T̂_r⁻² + ω_r²): Section V with the unit put right, |v_r| ≤ 2R̂_req|Δi| at any speed.
    Scheduled,
}

impl<T: Scalar> Lambda<T> {
    /// v_r of (22), V, for a current error Δi.
    #[inline]
    pub fn flux_correction(&self, r_req: T, inverse_t_r: T, omega_r: T, delta_i: Complex<T>) -> Complex<T> {
        let coupling = Complex::new(inverse_t_r, omega_r);
        let lambda = match *self {
            Self::Constant(lambda) => lambda,
            Self::Scheduled => r_req / norm2(coupling).sqrt(),
        };
        -(delta_i * r_req) - coupling * delta_i * lambda
    }

    /// Checks the value.
    ///
    /// # Errors
    /// λ is not positive.
    pub fn validate(&self) -> Result<(), ModelError> {
        if let Self::Constant(x) = self { Bound::Positive.check("lambda_h", x.value()) } else { Ok(()) }
    }
}

/// Gains of (25) and (22), and pole pairs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FollowerGains<T> {
    /// Pole pairs.
    pub pole_pairs: u32,
    /// K_P, Ω.
    pub current_proportional_ohm: T,
    /// K_I, 1/s.
    pub current_integral_per_s: T,
    /// λ.
    pub lambda: Lambda<T>,
    /// Sampling time, s.
    pub sample_time_s: T,
}

impl<T: Scalar> FollowerGains<T> {
    /// Current errors with natural frequency ω = `bandwidth_rad_s` and damping 1/√2, as far as the resistances allow:
    /// L_f s² + (R_s + R_req + K_P)s + K_PK_I. λ follows the speed.
    pub fn for_bandwidth(p: &RegulationParameters<T>, pole_pairs: u32, bandwidth_rad_s: T, sample_time_s: T) -> Self {
        let wanted = p.leakage_inductance_h * bandwidth_rad_s;
        let resistance = p.stator_resistance_ohm + p.rotor_resistance_ohm;
        let k_p = (wanted * T::from_f64(core::f64::consts::SQRT_2) - resistance).max(wanted * T::from_f64(0.3));
        Self {
            pole_pairs,
            current_proportional_ohm: k_p,
            current_integral_per_s: wanted * bandwidth_rad_s / k_p,
            lambda: Lambda::Scheduled,
            sample_time_s,
        }
    }
}

/// A reference generator that follows a machine, with an adaptation in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Follower<T, A> {
    gains: FollowerGains<T>,
    n_p: T,
    /// 1/h.
    per_s: T,
    adaptation: A,
}

/// What [`Follower`] remembers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FollowerState<T, S> {
    /// φ_ref, Vs, and i_ref, A, in the frame.
    pub phi_ref: Complex<T>,
    /// i_ref, A.
    pub i_ref: Complex<T>,
    /// η, A.
    pub eta: Complex<T>,
    /// e^{jθ}: where the frame stands.
    pub direction: Complex<T>,
    v_r: Complex<T>,
    v_s: Complex<T>,
    omega_r: T,
    omega_g: T,
    belief: Belief<T>,
    /// Of the adaptation.
    pub adaptation: S,
}

impl<T: Scalar, A: Adaptation<T>> Follower<T, A> {
    /// A follower around `adaptation`, which must have been made for the same sampling time.
    ///
    /// # Errors
    /// Names the quantity out of bounds.
    pub fn try_new(gains: FollowerGains<T>, adaptation: A) -> Result<Self, ModelError> {
        Bound::Within(1.0, 1e3).check("pole_pairs", f64::from(gains.pole_pairs))?;
        Bound::Positive.check("current_proportional_ohm", gains.current_proportional_ohm.value())?;
        Bound::NotNegative.check("current_integral_per_s", gains.current_integral_per_s.value())?;
        Bound::Within(1e-7, 1e-2).check("sample_time_s", gains.sample_time_s.value())?;
        gains.lambda.validate()?;
        let n_p = T::from_f64(f64::from(gains.pole_pairs));
        Ok(Self { gains, n_p, per_s: T::one() / gains.sample_time_s, adaptation })
    }

    /// The generator over a sample, u in the frame: (17) as it stands, (18) as the stator flux φ_ref + L_f i_ref that it is the sum of,
    ///
    /// φ' = −(a + jω_g)φ + R i − v_r,   (φ + L_f i)' = −jω_s(φ + L_f i) − R_s i + u − v_r − v_s
    fn generate(&self, x: &mut FollowerState<T, A::State>, u: Complex<T>, omega_r: T, omega_s: T) {
        let p = self.adaptation.parameters(&x.adaptation);
        let (h, one) = (self.gains.sample_time_s, T::one());
        let k = h * T::from_f64(0.5);
        let (a, r, l_f) = (p.inverse_rotor_time_constant(), p.rotor_resistance_ohm, p.leakage_inductance_h);
        let turning = Complex::new(-a, omega_r - omega_s);
        let rate_phi = turning * x.phi_ref + x.i_ref * r - x.v_r;
        let rate_psi = u - x.v_r - x.v_s - x.i_ref * p.stator_resistance_ohm - j(x.phi_ref + x.i_ref * l_f) * omega_s;
        // [n, −kR; s, sL_f + kR_s] (Δφ, Δi) = h (φ', ψ'), by Cramer's rule.
        let (n, s) = (Complex::new(one, T::zero()) - turning * k, Complex::new(one, omega_s * k));
        let (k_r, d) = (r * k, s * l_f + p.stator_resistance_ohm * k);
        let determinant = n * d + s * k_r;
        let scale = determinant.conj() * (h / norm2(determinant));
        x.phi_ref += (d * rate_phi + rate_psi * k_r) * scale;
        x.i_ref += (n * rate_psi - s * rate_phi) * scale;
    }
}

impl<T: Scalar, A: Adaptation<T>> Identifier<T, 4> for Follower<T, A> {
    type State = FollowerState<T, A::State>;
    type Input = Sample<T>;

    fn start(&self) -> Self::State {
        let zero = Complex::new(T::zero(), T::zero());
        FollowerState {
            phi_ref: zero,
            i_ref: zero,
            eta: zero,
            direction: Complex::new(T::one(), T::zero()),
            v_r: zero,
            v_s: zero,
            omega_r: T::zero(),
            omega_g: T::zero(),
            belief: Belief::new(),
            adaptation: self.adaptation.start(),
        }
    }

    fn step(&self, x: &mut Self::State, input: &Sample<T>) -> Estimate<T, 4> {
        let (g, h, half) = (&self.gains, self.gains.sample_time_s, T::from_f64(0.5));
        let reach = Reach::new(self.adaptation.parameters(&x.adaptation).leakage_inductance_h, h);
        let mut lost = !x.belief.admits(input, &reach);
        let mut i_ref_rate = x.i_ref;
        if !lost {
            let omega_r = input.omega_m * self.n_p;
            let middle = (x.omega_r + omega_r) * half;
            let omega_s = middle + x.omega_g;
            let half_turn = turn(omega_s * h * half);
            let at_middle = x.direction * half_turn;
            self.generate(x, input.u_s * at_middle.conj(), middle, omega_s);
            x.direction = at_middle * half_turn;
            // Rounding neither lengthens nor shortens it.
            x.direction *= T::from_f64(1.5) - norm2(x.direction) * half;
            x.omega_r = omega_r;
            if !(finite(x.phi_ref) && finite(x.i_ref)) {
                // Inputs near the end of the number range: begin again, with the parameters as they are.
                *x = FollowerState { adaptation: x.adaptation, belief: x.belief, ..self.start() };
                lost = true;
            }
        }
        let delta_i = if lost { Complex::new(T::zero(), T::zero()) } else { input.i_s * x.direction.conj() - x.i_ref };
        i_ref_rate = if lost { delta_i } else { (x.i_ref - i_ref_rate) * self.per_s };
        let leak = self.adaptation.integral_leak_per_s(&x.adaptation) * h;
        x.eta += delta_i * (g.current_integral_per_s * h) - x.eta * leak.min(T::one());
        let tracking = Tracking {
            delta_i,
            held_v: x.eta * g.current_proportional_ohm,
            i_ref: x.i_ref,
            i_ref_rate,
            phi_ref: x.phi_ref,
            omega_r: x.omega_r,
            omega_g: x.omega_g,
            lost,
        };
        let estimate = self.adaptation.step(&mut x.adaptation, &tracking);
        let p = self.adaptation.parameters(&x.adaptation);
        let (r, a) = (p.rotor_resistance_ohm, p.inverse_rotor_time_constant());
        x.v_s = -(delta_i + x.eta) * g.current_proportional_ohm;
        x.v_r = g.lambda.flux_correction(r, a, x.omega_r, delta_i) - self.adaptation.flux_injection(&x.adaptation);
        // (13); where there is hardly any flux the frame turns with the rotor. Beyond ten pull-out slips the flux is no guide.
        let flux2 = norm2(x.phi_ref);
        let most = a * T::from_f64(10.0);
        let slip = cross(x.phi_ref, x.i_ref) * r / flux2;
        x.omega_g = if slip.is_finite() { slip.max(-most).min(most) } else { T::zero() };
        if lost { Estimate { adapting: [false; 4], status: IdentifierStatus::LostSample, ..estimate } } else { estimate }
    }
}
