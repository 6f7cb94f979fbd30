//! (27): the second derivative of the current without the flux, through the high-gain observers (29), (30).
//!
//! With η = R_r/L_r, g = 1/(σL_sL_r), ω_e = n_pω, complex vectors in the stator frame, at constant speed and resistances
//!
//! ```text
//! d²i/dt² = f₀ + R_r f₁
//! f₀ = γ₁(du/dt − R_s di/dt) + jω_e(γ₁R_s i − γ₁u + di/dt),   f₁ = g(u − R_s i) − γ₄ di/dt = β di_r/dt
//! ```
//!
//! γ₁ = 1/(σL_s), γ₄ = 1/(σL_r), β = L_m/(σL_sL_r). The relation is linear with constant coefficients, so that it holds exactly for
//! filtered signals too if *all* of them pass the same filter. The paper filters the derivatives only, which turns them against i and u by
//! ω_s/Γ; here i and u pass the observer as well, Γ may be as low as the noise asks for, and nothing is lost. A sample integrates (27):
//!
//! ```text
//! Δx̃₁ = ∫f₀ + R_r ∫f₁,   x̃₁ = Γ(i − î)
//! ```
//!
//! Between samples the voltage is held and the current bends away from its chord by κ s(h − s)/2, κ = d²i/dt² − γ₁ du/dt, which shifts î
//! by cκ (c = h²/12 for slow filters) and x̃₁ by −Γcκ. κ, filtered, is Δx̃₁ − γ₁Δû over h: every term is put right by a difference of what
//! is there, and the error falls from second to fourth order in h.
//!
//! **Acceleration.** With y = γ₁(u − R_s i) − di/dt = β dψ_r/dt the rotor equation differentiated is y' = (−η + jω_e)y + jω_e'βψ_r + ηL_mβ i'; the
//! paper drops ω_e'. Filtered by F = Γ/(s + Γ), a ramp of ω_e turns F[ω_e y] into ω_eF[y] − (ω_e'/Γ)F²[y], and F²[βψ_r'] = Γβ(F − F²)ψ_r, so
//! that what (27) lacks is −jω_e'βF²[ψ_r], with βψ_r = (y − ηL_mβ i)/(−η + jω_e) by the estimates of the resistances.

use super::super::filter::HighGain;
use super::super::{Belief, Reach, Sample, finite};
use im_model::space_vector::{j, norm2};
use im_model::{Bound, Complex, ModelError, Scalar, WindingParameters};

/// Constants of the machine and of the filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CurrentModel<T> {
    filter: HighGain<T>,
    n_p: T,
    /// 1/(σL_s).
    gamma_1: T,
    /// 1/(σL_sL_r).
    g: T,
    /// 1/(σL_r).
    gamma_4: T,
    /// 1/L_r.
    inverse_l_r: T,
    /// L_mβ.
    l_m_beta: T,
    /// Samples until the filters have filled.
    filling: u32,
    reach: Reach<T>,
}

/// The filters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Filters<T> {
    i: Complex<T>,
    u: Complex<T>,
    i_before: Complex<T>,
    omega_before: T,
    derivative: Complex<T>,
    /// cκ of the last sample, A.
    bend: Complex<T>,
    /// F[ω_e], rad/s.
    omega_e: T,
    /// βF²[ψ_r].
    flux: Complex<T>,
    /// Samples until the filters have filled; then zero.
    pub filling: u32,
    begun: bool,
    belief: Belief<T>,
    /// Whether the last sample was left out.
    pub lost: bool,
}

/// (27) over a sample, with its term of the acceleration, less what depends on the resistances: Δx̃₁ − R_s p − R_r q + R_sR_r r = `known`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Balance<T> {
    /// Δx̃₁ − ∫(γ₁du/dt − jω_eγ₁u + jω_e di/dt − jω_e'βψ_r), A/s.
    pub known: Complex<T>,
    /// ∫γ₁(jω_e i − di/dt).
    pub p: Complex<T>,
    /// ∫(g u − γ₄ di/dt).
    pub q: Complex<T>,
    /// ∫g i.
    pub r: Complex<T>,
}

impl<T: Scalar> CurrentModel<T> {
    pub fn try_new(
        windings: &WindingParameters<T>,
        pole_pairs: u32,
        high_gain_per_s: T,
        sample_time_s: T,
    ) -> Result<Self, ModelError> {
        windings.validate()?;
        Bound::Within(1.0, 1e3).check("pole_pairs", f64::from(pole_pairs))?;
        Bound::Within(1e-7, 1e-2).check("sample_time_s", sample_time_s.value())?;
        Bound::Within(1.0, 1e7).check("high_gain_per_s", high_gain_per_s.value())?;
        let (c, beta) = (windings.kenne(pole_pairs), windings.derived(pole_pairs).beta);
        // e⁻¹⁶ of what the filters held before is left.
        let filling = (16.0 / (high_gain_per_s * sample_time_s).value()).min(1e6) as u32 + 1;
        Ok(Self {
            filter: HighGain::new(high_gain_per_s, sample_time_s),
            n_p: c.beta[0],
            gamma_1: c.gamma[0],
            g: c.gamma[1],
            gamma_4: c.gamma[3],
            inverse_l_r: T::one() / windings.rotor_inductance_h,
            l_m_beta: windings.mutual_inductance_h * beta,
            filling,
            reach: Reach::new(windings.derived(pole_pairs).sigma_l_s, sample_time_s),
        })
    }

    pub fn start(&self) -> Filters<T> {
        let zero = Complex::new(T::zero(), T::zero());
        Filters {
            i: zero,
            u: zero,
            i_before: zero,
            omega_before: T::zero(),
            derivative: zero,
            bend: zero,
            omega_e: T::zero(),
            flux: zero,
            filling: self.filling,
            begun: false,
            belief: Belief::new(),
            lost: false,
        }
    }

    /// Advances over the sample that ends with what `s` shows; `None` when there is nothing to compare yet, or the sample is lost. The estimates
    /// of R_s and R_r, Ω, serve the term of the acceleration alone.
    pub fn step(&self, x: &mut Filters<T>, s: &Sample<T>, [r_s, r_r]: [T; 2]) -> Option<Balance<T>> {
        x.lost = !x.belief.admits(s, &self.reach);
        if x.lost {
            // The filters missed something: begin again, from where the signals are then.
            (x.begun, x.filling) = (false, self.filling);
            return None;
        }
        if !x.begun {
            let (i, omega_m) = (s.i_s, s.omega_m);
            let omega_e = omega_m * self.n_p;
            *x = Filters {
                i,
                u: s.u_s,
                i_before: i,
                omega_before: omega_m,
                omega_e,
                begun: true,
                belief: x.belief,
                ..self.start()
            };
            return None;
        }
        let i = self.filter.ramp(&mut x.i, x.i_before, s.i_s);
        let u = self.filter.held(&mut x.u, s.u_s);
        let derivative = self.filter.derivative(x.i, s.i_s);
        let half = T::from_f64(0.5);
        let omega_e = (x.omega_before + s.omega_m) * self.n_p * half;
        let change = derivative - x.derivative;
        // From the chord to the current.
        let bend = (change - u.change * self.gamma_1) * self.filter.chord();
        let shift = bend - x.bend;
        let change = change + shift * self.filter.gain();
        let (i_change, i_integral) = (i.change - shift, i.integral - bend * self.filter.sample_time());
        (x.i_before, x.omega_before, x.derivative, x.bend) = (s.i_s, s.omega_m, derivative, bend);
        let accelerated = {
            let omega_change = (omega_e - x.omega_e) * self.filter.share();
            x.omega_e += omega_change;
            let y = (x.u - x.i * r_s) * self.gamma_1 - derivative;
            let eta = r_r * self.inverse_l_r;
            let turning = Complex::new(-eta, omega_e);
            // At standstill with R_r = 0 there is no telling.
            let size = norm2(turning).max(T::from_f64(1e-6));
            let flux = (y - x.i * (eta * self.l_m_beta)) * turning.conj() * (T::one() / size);
            let before = x.flux;
            x.flux += (flux - before) * self.filter.share();
            // The filter's rate and the ramp's: ω_e' h = Γh(ω_e − F[ω_e]).
            j(before + x.flux) * (half * (omega_e - x.omega_e) * self.filter.gain() * self.filter.sample_time())
        };
        let driven = (u.change - j(u.integral) * omega_e) * self.gamma_1 + j(i_change) * omega_e;
        let balance = Balance {
            known: change - driven + accelerated,
            p: (j(i_integral) * omega_e - i_change) * self.gamma_1,
            q: u.integral * self.g - i_change * self.gamma_4,
            r: i_integral * self.g,
        };
        if !(finite(balance.known) && finite(balance.q)) {
            // Measurements near the end of the number range.
            (x.begun, x.filling) = (false, self.filling);
            return None;
        }
        x.filling = x.filling.saturating_sub(1);
        Some(balance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_model::space_vector::unit;
    use im_model::{Held, Machine, Plant, PlantInput, State, machines, steady_state};

    /// (27) holds to the interpolation error for the simulated machine at constant speed, at any period, whatever the filter.
    #[test]
    fn balance_closes_for_the_machine_at_any_period_and_gain() {
        let m = machines::KENNE_APPENDIX_II;
        let p = m.parameters();
        let machine = Machine::base(p, m.pole_pairs).unwrap();
        let plant = Plant::new(&machine);
        let (volts, w) = (311.0, 100.0 * core::f64::consts::PI);
        // What the fourth order in h leaves, the more the higher Γ; with chords alone the third would be 0.12.
        let cases = [(10e-6, 31_000.0, 2e-4), (106e-6, 500.0, 5e-5), (106e-6, 31_000.0, 6e-3), (200e-6, 1000.0, 1e-3)];
        for (h, gain, tolerance) in cases {
            let model = CurrentModel::try_new(&p.windings(), m.pole_pairs, gain, h).unwrap();
            let mut x = steady_state(&machine, volts, 50.0, Held::Load(6.89)).unwrap();
            let (mut filters, mut worst, mut size) = (model.start(), 0.0f64, 0.0f64);
            let omega = x.omega_m;
            let mut u = Complex::new(0.0, 0.0);
            let (r_s, r_r) = (p.stator_resistance_ohm, p.rotor_resistance_ohm);
            for k in 0..(0.1 / h) as usize {
                let sample = Sample { i_s: plant.currents(&x).i_s, u_s: u, omega_m: omega };
                let balance = model.step(&mut filters, &sample, [r_s, r_r]);
                if let (Some(b), 0) = (balance, filters.filling) {
                    let f_1 = b.q - b.r * r_s;
                    worst = worst.max((b.known - b.p * r_s - f_1 * r_r).norm());
                    size = size.max((f_1 * r_r).norm());
                }
                u = unit(w * h * (k as f64 + 0.5)) * volts;
                let drive = PlantInput { imposed_speed: Some([omega; 2]), ..PlantInput::new(u, 0.0) };
                x = plant.step(&x, &drive, h);
            }
            assert!(worst < tolerance * size, "{h} s, {gain} 1/s: {worst} of {size}");
        }
    }

    /// On a ramp of the speed (27) as printed lacks −jω_e'βF²[ψ_r]; with the term it closes.
    #[test]
    fn balance_closes_on_a_ramp_of_the_speed_and_lacks_the_acceleration_without_its_term() {
        let m = machines::KENNE_APPENDIX_II;
        let p = m.parameters();
        let (c, n_p) = (p.windings().derived(m.pole_pairs), f64::from(m.pole_pairs));
        let plant = Plant::new(&Machine::base(p, m.pole_pairs).unwrap());
        let (r_s, r_r) = (p.stator_resistance_ohm, p.rotor_resistance_ohm);
        let (h, gain, flux, omega_g) = (1e-4, 628.0, 0.9, 6.0);
        // At constant flux and slip, in the frame of the flux: λ_r = ψ_r, i_s by the rotor equation, ψ_s by the stator's inductances.
        let i_s = Complex::new(c.eta, omega_g) * (flux / c.eta_l_m);
        let psi_s = i_s * c.sigma_l_s + flux * p.magnetizing_inductance_h / p.rotor_inductance_h();
        for rate in [-200.0, -50.0, 50.0, 200.0] {
            for with_term in [true, false] {
                let model = CurrentModel::try_new(&p.windings(), m.pole_pairs, gain, h).unwrap();
                let (mut filters, mut worst, mut angle, mut omega, mut u) =
                    (model.start(), 0.0f64, 0.0, 100.0, Complex::new(0.0, 0.0));
                let mut x = State { psi_s, psi_r: Complex::new(flux, 0.0), omega_m: omega, ..State::default() };
                for _ in 0..2500 {
                    let sample = Sample { i_s: plant.currents(&x).i_s, u_s: u, omega_m: omega };
                    if !with_term {
                        // A filter that has caught up with the speed knows of no acceleration.
                        filters.omega_e = (filters.omega_before + omega) * n_p * 0.5;
                    }
                    let balance = model.step(&mut filters, &sample, [r_s, r_r]);
                    if let (Some(b), 0) = (balance, filters.filling) {
                        let left = (b.known - b.p * r_s - (b.q - b.r * r_s) * r_r) / h;
                        let filter = Complex::new(gain, 0.0) / Complex::new(gain, n_p * omega + omega_g);
                        let lacking = -j(x.psi_r) * filter * filter * (n_p * rate * c.beta);
                        let rest = if with_term { left } else { left - lacking };
                        worst = worst.max(rest.norm() / lacking.norm());
                    }
                    let omega_s = n_p * (omega + 0.5 * rate * h) + omega_g;
                    u = (i_s * r_s + j(psi_s) * omega_s) * unit(angle + 0.5 * omega_s * h);
                    let drive = PlantInput { imposed_speed: Some([omega, omega + rate * h]), ..PlantInput::new(u, 0.0) };
                    (x, angle, omega) = (plant.step(&x, &drive, h), angle + omega_s * h, omega + rate * h);
                }
                // The flux turns by ω_sh = 2 % in a sample, and by ω_e'/Γ² while it is filtered, 0.1 %.
                assert!(worst < 0.05, "{rate} rad/s², term {with_term}: {worst}");
            }
        }
    }

    /// f₁ is β di_r/dt, and not (β/L_r) dψ_r/dt: at no load it vanishes although the flux turns.
    #[test]
    fn f_1_is_the_derivative_of_the_rotor_current() {
        let m = machines::JADOT_TABLE_I;
        let machine = Machine::base(m.parameters(), m.pole_pairs).unwrap();
        let (w, omega) = (m.parameters().windings(), 100.0 * core::f64::consts::PI);
        let c = w.kenne(m.pole_pairs);
        for load in [0.0, 5.0, 26.0] {
            let x = steady_state(&machine, 326.6, 50.0, Held::Load(load)).unwrap();
            let currents = Plant::new(&machine).currents(&x);
            // Everything turns with the supply, whose voltage points along α.
            let (u, i_rate) = (Complex::new(326.6, 0.0), j(currents.i_s) * omega);
            let f_1 = u * c.gamma[1] - currents.i_s * c.gamma[2] - i_rate * c.gamma[3];
            let truth = j(currents.i_r) * (omega * w.derived(m.pole_pairs).beta);
            let flux = j(x.psi_r) * (omega * w.derived(m.pole_pairs).beta / w.rotor_inductance_h);
            assert!((f_1 - truth).norm() < 1e-6 * flux.norm(), "{load}: {f_1} {truth}");
            assert!((f_1 - flux).norm() > 0.5 * flux.norm(), "{load}: {f_1} {flux}");
        }
    }
}
