//! State-space forms of the base machine for design, as in Kwon et al. (1), (9), (10).
//!
//! x = [ω λ_a λ_b i_a i_b]ᵀ,  ẋ = A x + B₁ u₁ + B₂ u₂(x, τ_L),  y = C x.
//!
//! The paper prints (9) incompletely and omits u₂. Derived from (1), with the printed B₂:
//!
//! u₂ = [λ_a i_b − λ_b i_a − τ_L/(μJ),  ω λ_b,  ω λ_a]ᵀ
//!
//! row 1: μ u₂₁ = μ(λ_a i_b − λ_b i_a) − τ_L/J; rows 2 and 3: −n_p ω λ_b and +n_p ω λ_a; rows 4 and 5: +n_pβ ω λ_b, −n_pβ ω λ_a.

use nalgebra::{SMatrix, SVector};

use crate::machine::Machine;
use crate::parameters::{DerivedConstants, WindingParameters};
use crate::scalar::Scalar;
use crate::state::State;

/// A, B₁, B₂, C of the fifth-order model, and what u₂ needs.
#[derive(Clone, Debug, PartialEq)]
pub struct StateSpace<T: Scalar> {
    /// A, 5×5.
    pub a: SMatrix<T, 5, 5>,
    /// B₁, 5×2: stator voltage.
    pub b_1: SMatrix<T, 5, 2>,
    /// B₂, 5×3: nonlinearities.
    pub b_2: SMatrix<T, 5, 3>,
    /// C, 2×5: stator currents.
    pub c: SMatrix<T, 2, 5>,
    /// μJ, 1/H·…: torque over λ × i is μJ.
    pub mu_j: T,
}

impl<T: Scalar> StateSpace<T> {
    /// The matrices of a machine given by its windings.
    pub fn new(w: &WindingParameters<T>, pole_pairs: u32) -> Self {
        let DerivedConstants { eta, beta, mu, gamma, sigma_l_s, eta_l_m, n_p, .. } = w.derived(pole_pairs);
        let o = T::zero();
        let one = T::one();
        let d_j = w.viscous_friction_nm_s_per_rad / w.inertia_kg_m2;
        let eb = eta * beta;
        #[rustfmt::skip]
        let a = SMatrix::<T, 5, 5>::from_row_slice(&[
            -d_j, o,    o,    o,       o,
            o,    -eta, o,    eta_l_m, o,
            o,    o,    -eta, o,       eta_l_m,
            o,    eb,   o,    -gamma,  o,
            o,    o,    eb,   o,       -gamma,
        ]);
        let g = one / sigma_l_s;
        let b_1 = SMatrix::<T, 5, 2>::from_row_slice(&[o, o, o, o, o, o, g, o, o, g]);
        let b = n_p * beta;
        let b_2 = SMatrix::<T, 5, 3>::from_row_slice(&[mu, o, o, o, -n_p, o, o, o, n_p, o, b, o, o, o, -b]);
        let c = SMatrix::<T, 2, 5>::from_row_slice(&[o, o, o, one, o, o, o, o, o, one]);
        Self { a, b_1, b_2, c, mu_j: mu * w.inertia_kg_m2 }
    }

    /// u₂(x, τ_L).
    pub fn u_2(&self, x: &SVector<T, 5>, tau_load: T) -> SVector<T, 3> {
        let [omega, la, lb, ia, ib] = [x[0], x[1], x[2], x[3], x[4]];
        SVector::<T, 3>::new(la * ib - lb * ia - tau_load / self.mu_j, omega * lb, omega * la)
    }

    /// A x + B₁ u₁ + B₂ u₂(x, τ_L).
    pub fn rates(&self, x: &SVector<T, 5>, u_1: &SVector<T, 2>, tau_load: T) -> SVector<T, 5> {
        self.a * x + self.b_1 * u_1 + self.b_2 * self.u_2(x, tau_load)
    }
}

/// [ω λ_a λ_b i_a i_b]ᵀ of a state of the T circuit (rotor flux referred as the machine's parameters are).
pub fn kwon_state<T: Scalar>(machine: &Machine<T>, x: &State<T>) -> SVector<T, 5> {
    let i = crate::Plant::new(machine).currents(x).i_s;
    SVector::<T, 5>::new(x.omega_m, x.psi_r.re, x.psi_r.im, i.re, i.im)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machines::{KWON_PRINTED_MATRICES, KWON_TABLE_IV};
    use crate::{Effects, Plant, PlantInput};
    use num_complex::Complex;
    use proptest::prelude::*;

    /// The entries printed in Sec. VII, to the digits printed; the paper's slips in B₂ corrected (docs/background/errata.md).
    #[test]
    fn printed_matrices_follow_from_their_set_and_not_from_table_iv() {
        let printed_a = [-0.238, -11.946, 0.109, 1169.869, -42.044];
        let entries = |m: &crate::machines::NamedMachine| {
            let s = StateSpace::new(&m.windings, m.pole_pairs);
            ([s.a[(0, 0)], s.a[(1, 1)], s.a[(1, 3)], s.a[(3, 1)], s.a[(3, 3)]], s.b_1[(3, 0)], s.b_2)
        };
        let (a, b_1, b_2) = entries(&KWON_PRINTED_MATRICES);
        for (x, y) in a.into_iter().zip(printed_a) {
            assert!((x - y).abs() < 6e-4, "{x} printed as {y}");
        }
        assert!((b_1 - 142.454).abs() < 6e-4);
        assert!((b_2[(0, 0)] - 4.907).abs() < 6e-4 && (b_2[(3, 1)] - 195.861).abs() < 6e-4);
        assert_eq!((b_2[(1, 1)], b_2[(2, 2)]), (-2.0, 2.0));

        let (a, b_1, _) = entries(&KWON_TABLE_IV);
        assert!((a[1] + 1.661).abs() < 1e-3, "Table IV gives η = 1.661, seven times less than the printed 11.946");
        assert!((b_1 - 121.719).abs() < 1e-3);
    }

    proptest! {
        /// The paper's form and the flux form are the same differential equation.
        #[test]
        fn state_space_agrees_with_the_equations_of_motion(
            f in prop::array::uniform4(-1.5..1.5f64), omega in -300.0..300.0f64, u in -300.0..300.0f64, tau in -30.0..30.0f64,
        ) {
            let w = KWON_TABLE_IV.windings;
            let p = w.to_t().unwrap();
            let machine = Machine::try_new(p, 2, Effects::none()).unwrap();
            let plant = Plant::new(&machine);
            let x = State { psi_s: Complex::new(f[0], f[1]), psi_r: Complex::new(f[2], f[3]), omega_m: omega, ..State::default() };
            let input = PlantInput::new(Complex::new(u, -0.3 * u), tau);
            let rates = plant.evaluate(&x, &input).rates;
            // Currents are linear in the fluxes: di/dt = i(dψ/dt).
            let di = plant.currents(&rates).i_s;
            let expected = SVector::<f64, 5>::new(rates.omega_m, rates.psi_r.re, rates.psi_r.im, di.re, di.im);
            let space = StateSpace::new(&p.windings(), 2);
            let got = space.rates(&kwon_state(&machine, &x), &SVector::<f64, 2>::new(u, -0.3 * u), tau);
            prop_assert!((got - expected).norm() <= 1e-9 * (1.0 + expected.norm()), "{got} {expected}");
        }
    }
}
