//! The constants of Kwon et al., Table II, where the main flux saturates.
//!
//! With the chord inductance L_m(|ψ_m|) = |ψ_m|/i_m the rotor equation keeps its form, λ' = (−η + jn_pω)λ + ηL_m i, exactly. The current
//! equation keeps it while |ψ_m| is constant, whatever the direction: exact in steady state, in error by dL_m/dt while the flux builds up.
//! ψ_m follows from what the observer knows without iteration: from i_s + (λ − ψ_m)/L_lr = ψ_m/L_m,
//!
//! ```text
//! ψ_m (1 + L_lr/L_m(|ψ_m|)) = λ + L_lr i_s,
//! ```
//!
//! so that every constant is a function of |λ + L_lr i_s|², tabulated when the observer is made.

use im_model::effects::{Hooks, MainFluxSaturation};
use im_model::space_vector::norm2;
use im_model::{Complex, Scalar, TParameters};

/// Intervals of the table.
const N: usize = 48;
/// The table ends at this multiple of the reference flux; beyond it the last entry holds.
const REACH: f64 = 1.5;

/// The electrical constants of one sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Electrical<T> {
    pub eta: T,
    pub beta: T,
    /// R_s/σL_s.
    pub stator_rate: T,
    pub eta_l_m: T,
    pub inverse_sigma_l_s: T,
    /// (3/2) n_p L_m/L_r.
    pub torque: T,
}

impl<T: Scalar> Electrical<T> {
    pub fn new(p: &TParameters<f64>, pole_pairs: u32) -> Self {
        let w = p.windings();
        let c = w.derived(pole_pairs);
        let f = T::from_f64;
        Self {
            eta: f(c.eta),
            beta: f(c.beta),
            stator_rate: f(p.stator_resistance_ohm / c.sigma_l_s),
            eta_l_m: f(c.eta_l_m),
            inverse_sigma_l_s: f(1.0 / c.sigma_l_s),
            torque: f(c.mu * p.inertia_kg_m2),
        }
    }

    pub fn cast<U: Scalar>(&self) -> Electrical<U> {
        let f = |x: T| U::from_f64(x.value());
        Electrical {
            eta: f(self.eta),
            beta: f(self.beta),
            stator_rate: f(self.stator_rate),
            eta_l_m: f(self.eta_l_m),
            inverse_sigma_l_s: f(self.inverse_sigma_l_s),
            torque: f(self.torque),
        }
    }

    /// γ = R_s/σL_s + βηL_m.
    #[inline(always)]
    pub fn gamma(&self) -> T {
        self.stator_rate + self.beta * self.eta_l_m
    }

    #[inline(always)]
    fn between(&self, other: &Self, share: T) -> Self {
        let mix = |a: T, b: T| a + (b - a) * share;
        Self {
            eta: mix(self.eta, other.eta),
            beta: mix(self.beta, other.beta),
            stator_rate: mix(self.stator_rate, other.stator_rate),
            eta_l_m: mix(self.eta_l_m, other.eta_l_m),
            inverse_sigma_l_s: mix(self.inverse_sigma_l_s, other.inverse_sigma_l_s),
            torque: mix(self.torque, other.torque),
        }
    }
}

/// The table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Saturation<T> {
    rotor_leakage_h: T,
    per_square: T,
    entries: [Electrical<T>; N + 1],
}

impl<T: Scalar> Saturation<T> {
    pub fn new(p: &TParameters<f64>, pole_pairs: u32, law: &MainFluxSaturation<f64>) -> Self {
        let l_lr = p.rotor_leakage_inductance_h;
        let chord = |psi: f64| p.magnetizing_inductance_h / law.reluctance((1.0, 0.0), psi * psi).0;
        let driver = |psi: f64| psi * (1.0 + l_lr / chord(psi));
        let end = driver(REACH * law.reference_flux_vs);
        let entries = core::array::from_fn(|k| {
            let y = Scalar::sqrt(end * end * k as f64 / N as f64);
            // The driver grows with the flux: bisect.
            let (mut low, mut high) = (0.0, REACH * law.reference_flux_vs);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if driver(middle) < y { low = middle } else { high = middle }
            }
            Electrical::new(&TParameters { magnetizing_inductance_h: chord(low), ..*p }, pole_pairs)
        });
        Self { rotor_leakage_h: T::from_f64(l_lr), per_square: T::from_f64(N as f64 / (end * end)), entries }
    }

    /// The constants at a rotor flux linkage (Vs) and stator current (A).
    #[inline]
    pub fn at(&self, lambda: Complex<T>, i_s: Complex<T>) -> Electrical<T> {
        let place =
            (norm2(lambda + i_s * self.rotor_leakage_h) * self.per_square).min(T::from_f64(N as f64 - 1e-3)).max(T::zero());
        let k = (place.value() as usize).min(N - 1);
        self.entries[k].between(&self.entries[k + 1], place - T::from_f64(k as f64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_model::{Effects, Machine, Plant, State, machines};

    #[test]
    fn the_table_gives_the_constants_that_the_flux_map_has() {
        let m = machines::MOTULATOR_2_2_KW;
        let mut e = Effects::scaled(&m.rating, &m.parameters(), m.pole_pairs);
        e.main_flux_saturation.excess = 0.6;
        let machine = Machine::try_new(m.parameters(), m.pole_pairs, e).unwrap();
        let table = Saturation::<f64>::new(machine.parameters(), 2, &e.main_flux_saturation);
        let plant = Plant::new(&machine);
        let p = machine.parameters();
        for size in [0.1, 0.5, 0.9, 1.1] {
            let (psi_s, psi_r) = (Complex::new(size, 0.02), Complex::new(0.95 * size, -0.05));
            let c = plant.currents(&State { psi_s, psi_r, ..State::default() });
            let l_m = c.psi_m.norm() / (c.i_s + c.i_r).norm();
            let expected = Electrical::<f64>::new(&TParameters { magnetizing_inductance_h: l_m, ..*p }, 2);
            let got = table.at(psi_r, c.i_s);
            // Forty-eight straight pieces: the knee is followed within 1 %.
            for (a, b) in [
                (got.eta, expected.eta),
                (got.beta, expected.beta),
                (got.eta_l_m, expected.eta_l_m),
                (got.torque, expected.torque),
            ] {
                assert!((a / b - 1.0).abs() < 0.01, "{size}: {a} {b}");
            }
        }
    }

    /// Pieces join: along the flux no constant jumps, from nothing to beyond the table's end.
    #[test]
    fn the_constants_change_without_jumps() {
        let m = machines::MOTULATOR_2_2_KW;
        let mut e = Effects::scaled(&m.rating, &m.parameters(), m.pole_pairs);
        e.main_flux_saturation.excess = 0.6;
        let table = Saturation::<f64>::new(&m.parameters(), 2, &e.main_flux_saturation);
        let at = |k: i32| table.at(Complex::new(0.0, 2e-4 * f64::from(k)), Complex::new(0.0, 0.0));
        // Beyond the table they stay.
        assert_eq!(at(50_000), at(100_000));
        for k in 0..15_000 {
            let (a, b) = (at(k), at(k + 1));
            for (a, b) in [(a.eta, b.eta), (a.beta, b.beta), (a.eta_l_m, b.eta_l_m), (a.stator_rate, b.stator_rate)] {
                // 0.2 mVs is a few thousandths of the knee.
                assert!((a / b - 1.0).abs() < 0.002, "{k}: {a} {b}");
            }
        }
    }
}
