//! The air gap of the alternative q-d model (AQDM) of Kwon and Sudhoff: iron and rotor leakage both saturate with the air-gap flux λ = |ψ_m|.
//!
//! ```text
//! Γ_m(λ) = m₁ − m₂λ + e^{m₃(λ − m₄)} + e^{m₅(λ − m₆)},   L_lr(λ) = l_r1 + l_r2/(1 + l_r3 λ^{l_r4})      (Kwon et al., Section VIII)
//! i_s = (ψ_s − ψ_m)/L_ls,   i_r = (ψ_r − ψ_m)/L_r(λ),   i_s + i_r + i_c = Γ(λ) ψ_m
//! ```
//!
//! The T circuit of the machine is what holds at a reference flux λ_N: Γ(λ) = 1/L_m + Γ_m(λ) − Γ_m(λ_N), L_r(λ) = L_lr + L_lr(λ) − L_lr(λ_N). So m₁ and
//! l_r1 stand in L_m and L_lr, and whoever knows the T circuit alone (controllers, observers) knows the machine at that flux.
//!
//! Γ and L_r depend on λ alone, so that the node equation is one equation for λ: λ D(λ) = |N(λ)|, N = ψ_s/L_ls + ψ_r/L_r + ψ_c/L_c,
//! D = Γ + 1/L_ls + 1/L_r + 1/L_c, and ψ_m = N/D.
//!
//! A leakage that follows another branch's flux has no energy function: a lossless one would add −½|i_r|² dL_lr/dλ along ψ_m to the magnetizing
//! current, which Fig. 6 of the paper has not. In a steady state powers balance; in a transient what is stored does so but for that term.

use num_complex::Complex;

use crate::error::{Bound, ModelError};
use crate::integral::integral;
use crate::parameters::TParameters;
use crate::scalar::Scalar;
use crate::space_vector::{dot, norm2};

/// How the air-gap flux saturates iron and rotor leakage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AirGapSaturation<T> {
    /// λ_N: the flux at which the T circuit holds, Vs peak.
    pub reference_flux_vs: T,
    /// m₂ (1/(H Vs)), m₃ (1/Vs), m₄ (Vs), m₅ (1/Vs), m₆ (Vs).
    pub magnetizing: [T; 5],
    /// l_r2 (H), l_r3 (Vs^−l_r4), l_r4.
    pub rotor_leakage: [T; 3],
}

impl<T: Scalar> AirGapSaturation<T> {
    /// Keys in files, in the order of [`Self::values`], with their bounds.
    pub const KEYS: [(&'static str, Bound); 9] = [
        ("reference_flux_vs", Bound::OfMachines(1e-6, 1e4)),
        ("m2_per_h_vs", Bound::NotNegative),
        ("m3_per_vs", Bound::NotNegative),
        ("m4_vs", Bound::Within(-1e3, 1e3)),
        ("m5_per_vs", Bound::NotNegative),
        ("m6_vs", Bound::Within(-1e3, 1e3)),
        ("l_r2_h", Bound::NotNegative),
        ("l_r3", Bound::NotNegative),
        ("l_r4", Bound::Within(1.0, 20.0)),
    ];

    /// The values in the order of [`Self::KEYS`].
    pub fn values(&self) -> [T; 9] {
        let ([m2, m3, m4, m5, m6], [l2, l3, l4]) = (self.magnetizing, self.rotor_leakage);
        [self.reference_flux_vs, m2, m3, m4, m5, m6, l2, l3, l4]
    }

    /// From values in the order of [`Self::KEYS`].
    pub fn from_values([n, m2, m3, m4, m5, m6, l2, l3, l4]: [T; 9]) -> Self {
        Self { reference_flux_vs: n, magnetizing: [m2, m3, m4, m5, m6], rotor_leakage: [l2, l3, l4] }
    }

    /// In another scalar type.
    pub fn cast<U: Scalar>(&self) -> AirGapSaturation<U> {
        AirGapSaturation::from_values(self.values().map(|x| U::from_f64(x.value())))
    }

    /// Γ_m(λ) − m₁ and its slope.
    fn magnetizing(&self, flux: T) -> (T, T) {
        let [m2, m3, m4, m5, m6] = self.magnetizing;
        let (a, b) = ((m3 * (flux - m4)).exp(), (m5 * (flux - m6)).exp());
        (a + b - m2 * flux, m3 * a + m5 * b - m2)
    }

    /// L_lr(λ) − l_r1 and its slope.
    fn rotor_leakage(&self, flux: T) -> (T, T) {
        let [l2, l3, l4] = self.rotor_leakage;
        if flux.value() <= 0.0 {
            return (l2, T::zero());
        }
        let grown = l3 * flux.powf(l4);
        let share = T::one() / (T::one() + grown);
        (l2 * share, -(l2 * l4 * grown * share * share / flux))
    }

    /// Γ(λ), 1/H, and its slope.
    pub fn inverse_magnetizing(&self, p: &TParameters<T>, flux: T) -> (T, T) {
        let (here, slope) = self.magnetizing(flux);
        (T::one() / p.magnetizing_inductance_h + here - self.magnetizing(self.reference_flux_vs).0, slope)
    }

    /// Γ_m(0) − m₁, 1/H.
    pub fn inverse_magnetizing_at_zero(&self) -> T {
        self.magnetizing(T::zero()).0
    }

    /// L_r(λ), H, and its slope.
    pub fn leakage(&self, p: &TParameters<T>, flux: T) -> (T, T) {
        let (here, slope) = self.rotor_leakage(flux);
        (p.rotor_leakage_inductance_h + here - self.rotor_leakage(self.reference_flux_vs).0, slope)
    }

    /// Checks the values by themselves and with the T circuit: up to three times the reference flux more flux must take more current,
    /// and a rotor leakage must be left at any flux.
    ///
    /// # Errors
    /// Names the quantity out of bounds.
    pub fn validate(&self, p: &TParameters<T>) -> Result<(), ModelError> {
        for ((key, bound), x) in Self::KEYS.into_iter().zip(self.values()) {
            bound.check(key, x.value())?;
        }
        let (own, p) = (self.cast::<f64>(), p.cast::<f64>());
        let least = p.rotor_leakage_inductance_h - own.rotor_leakage(own.reference_flux_vs).0;
        Bound::Positive.check("rotor_leakage_inductance_h less l_r2_h/(1 + l_r3 reference_flux_vs^l_r4)", least)?;
        for k in 0..=300 {
            let flux = 0.01 * f64::from(k) * own.reference_flux_vs;
            let (gamma, slope) = own.inverse_magnetizing(&p, flux);
            Bound::Positive.check("rise of the magnetizing current with the air-gap flux, 1/H", gamma + flux * slope)?;
        }
        Ok(())
    }
}

/// An air gap with the T circuit around it, prepared.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PreparedGap<T> {
    gap: AirGapSaturation<T>,
    inv_ls: T,
    /// Γ(λ) less what depends on the flux, and the same of L_r(λ).
    base: [T; 2],
}

/// The node equation at a flux.
struct Node<T> {
    numerator: Complex<T>,
    denominator: T,
    /// λD − |N| and its slope.
    residual: T,
    slope: T,
}

impl<T: Scalar> PreparedGap<T> {
    pub(crate) fn new(gap: &AirGapSaturation<T>, p: &TParameters<T>) -> Self {
        let n = gap.reference_flux_vs;
        let base =
            [T::one() / p.magnetizing_inductance_h - gap.magnetizing(n).0, p.rotor_leakage_inductance_h - gap.rotor_leakage(n).0];
        Self { gap: *gap, inv_ls: T::one() / p.stator_leakage_inductance_h, base }
    }

    pub(crate) fn gap(&self) -> &AirGapSaturation<T> {
        &self.gap
    }

    /// `core` is ψ_c/L_c, `inv_c` is 1/L_c; `added` the magnetizing current per flux of effects, with its slope.
    #[inline]
    fn node(&self, flux: T, psi_s: Complex<T>, psi_r: Complex<T>, core: Complex<T>, inv_c: T, added: (T, T)) -> Node<T> {
        let (gamma, d_gamma) = self.gap.magnetizing(flux);
        let (leakage, d_leakage) = self.gap.rotor_leakage(flux);
        let inv_lr = T::one() / (leakage + self.base[1]);
        let d_inv_lr = -(d_leakage * inv_lr * inv_lr);
        let numerator = psi_s * self.inv_ls + psi_r * inv_lr + core;
        let denominator = gamma + self.base[0] + added.0 + self.inv_ls + inv_lr + inv_c;
        // Without flux there is no direction, nor a slope of the root.
        let squared = norm2(numerator);
        let size = if squared.value() > 0.0 { squared.sqrt() } else { T::zero() };
        let turned = if squared.value() > 0.0 { dot(numerator, psi_r) / size } else { T::zero() };
        let slope = denominator + flux * (d_gamma + added.1 + d_inv_lr) - turned * d_inv_lr;
        Node { numerator, denominator, residual: flux * denominator - size, slope }
    }

    /// i_s, i_r and ψ_m. `added(λ)` is what effects add to Γ, with its slope.
    #[inline(never)]
    pub(crate) fn currents(
        &self,
        psi_s: Complex<T>,
        psi_r: Complex<T>,
        core: Complex<T>,
        inv_c: T,
        added: impl Fn(T) -> (T, T),
    ) -> [Complex<T>; 3] {
        let apart = |z: Complex<T>| Complex::new(T::from_real(z.re.real()), T::from_real(z.im.real()));
        // Values first, within a bracket: below the root the residual is negative.
        let (s, r, c) = (apart(psi_s), apart(psi_r), apart(core));
        let mut flux = T::from_real(norm2(s).sqrt().real());
        let (mut low, mut high) = (0.0, f64::INFINITY);
        for _ in 0..60 {
            let n = self.node(flux, s, r, c, inv_c, added(flux));
            let x = flux.value();
            if n.residual.value() < 0.0 {
                low = x
            } else {
                high = x
            }
            let mut next = x - n.residual.value() / n.slope.value();
            if !(low..=high).contains(&next) {
                next = if high.is_finite() { 0.5 * (low + high) } else { 2.0 * x + 1e-6 };
            }
            flux = T::from_f64(next);
            if (next - x).abs() <= 1e-11 * next.abs() {
                break;
            }
        }
        // One step more carries the derivatives; without them it polishes.
        let n = self.node(flux, psi_s, psi_r, core, inv_c, added(flux));
        flux = (flux - n.residual / T::from_f64(n.slope.value())).max(T::zero());
        let n = self.node(flux, psi_s, psi_r, core, inv_c, added(flux));
        let psi_m = n.numerator * (T::one() / n.denominator);
        let inv_lr = T::one() / (self.gap.rotor_leakage(flux).0 + self.base[1]);
        [(psi_s - psi_m) * self.inv_ls, (psi_r - psi_m) * inv_lr, psi_m]
    }

    /// The least rotor leakage over that of the T circuit at the reference flux, inverted: how much more steeply currents can rise.
    pub(crate) fn steepest(&self) -> T {
        (self.base[1] + self.gap.rotor_leakage(self.gap.reference_flux_vs).0) / self.base[1]
    }

    /// Energy in the fields without the branches across the core and the 3/2, J: the rotor leakage at the flux that there is.
    pub(crate) fn energy(&self, psi_s: Complex<T>, psi_r: Complex<T>, psi_m: Complex<T>) -> T {
        let flux = norm2(psi_m).sqrt();
        let inv_lr = T::one() / (self.gap.rotor_leakage(flux).0 + self.base[1]);
        let half = T::from_f64(0.5);
        // ∫Γ λ dλ, over λ².
        let iron = integral(flux * flux, |q| self.base[0] + self.gap.magnetizing(q.sqrt()).0);
        half * (norm2(psi_s - psi_m) * self.inv_ls + norm2(psi_r - psi_m) * inv_lr + iron)
    }
}

impl<T: Scalar> AirGapSaturation<T> {
    /// An air gap that does not saturate.
    pub fn linear(reference_flux_vs: T) -> Self {
        let o = T::zero();
        Self { reference_flux_vs, magnetizing: [o; 5], rotor_leakage: [o, o, T::one()] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machines::{JADOT_TABLE_I, KWON_TABLE_V};
    use crate::{Dual, Effects, Machine, Plant, State};
    use proptest::prelude::*;

    fn state(psi_s: Complex<f64>, psi_r: Complex<f64>) -> State<f64> {
        State { psi_s, psi_r, ..State::default() }
    }

    proptest! {
        /// The node equation of the head, as printed.
        #[test]
        fn currents_solve_the_node_equation(a in -2.0..2.0f64, b in -2.0..2.0f64, c in -0.1..0.1f64, d in -0.1..0.1f64) {
            let machine = KWON_TABLE_V.machine(1.75).unwrap();
            let (psi_s, psi_r) = (Complex::new(a, b), Complex::new(a + c, b + d));
            let now = Plant::new(&machine).currents(&state(psi_s, psi_r));
            let (p, gap) = (machine.parameters(), machine.air_gap().unwrap());
            let flux = now.psi_m.norm();
            let [m1, m2, m3, m4, m5, m6] = KWON_TABLE_V.magnetizing;
            let gamma = m1 - m2 * flux + (m3 * (flux - m4)).exp() + (m5 * (flux - m6)).exp();
            let node = now.i_s + now.i_r - now.psi_m * gamma;
            prop_assert!(node.norm() < 1e-8 * (1.0 + now.i_s.norm()), "{node}");
            prop_assert!((psi_s - now.psi_m - now.i_s * p.stator_leakage_inductance_h).norm() < 1e-10);
            prop_assert!((psi_r - now.psi_m - now.i_r * gap.leakage(p, flux).0).norm() < 1e-10);
        }
    }

    /// Without saturation it is the T circuit.
    #[test]
    fn a_linear_gap_is_the_t_circuit() {
        let m = Machine::base(JADOT_TABLE_I.parameters(), 2).unwrap();
        let gap = m.with_air_gap(Some(AirGapSaturation::linear(0.9))).unwrap();
        let x = state(Complex::new(0.8, 0.1), Complex::new(0.75, -0.05));
        let (a, b) = (Plant::new(&m).currents(&x), Plant::new(&gap).currents(&x));
        assert!((a.i_s - b.i_s).norm() < 1e-9 && (a.i_r - b.i_r).norm() < 1e-9);
        let energies = [&m, &gap].map(|m| Plant::new(m).stored_energy(&x));
        assert!((energies[0] / energies[1] - 1.0).abs() < 1e-9);
    }

    /// Derivatives by a base parameter agree with differences.
    #[test]
    fn derivatives_are_exact() {
        let machine = KWON_TABLE_V.machine(1.75).unwrap();
        let x = state(Complex::new(1.7, 0.1), Complex::new(1.65, -0.08));
        let seeded = machine.map(|id, v| match id {
            crate::ParameterId::Base(crate::BaseParameter::MagnetizingInductance) => Dual::<4>::seeded(v, 0, 1.0),
            crate::ParameterId::Base(crate::BaseParameter::RotorLeakageInductance) => Dual::seeded(v, 1, 1.0),
            _ => Dual::from_f64(v),
        });
        let own = State { psi_s: lift(x.psi_s), psi_r: lift(x.psi_r), ..State::default() };
        let exact = Plant::new(&seeded).currents(&own).i_s.re;
        for (k, id) in
            [crate::BaseParameter::MagnetizingInductance, crate::BaseParameter::RotorLeakageInductance].into_iter().enumerate()
        {
            let at = |factor: f64| {
                let id = crate::ParameterId::Base(id);
                let m = machine.with(&[(id, machine.get(id) * factor)]).unwrap();
                Plant::new(&m).currents(&x).i_s.re
            };
            let h = 1e-5;
            let size = machine.get(crate::ParameterId::Base(id));
            let difference = (at(1.0 + h) - at(1.0 - h)) / (2.0 * h * size);
            assert!((exact.eps[k] / difference - 1.0).abs() < 1e-6, "{k}: {} {difference}", exact.eps[k]);
        }
    }

    fn lift(z: Complex<f64>) -> Complex<Dual<4>> {
        Complex::new(Dual::from_f64(z.re), Dual::from_f64(z.im))
    }

    /// What has no place beside it, and what is no air gap, is refused by name.
    #[test]
    fn what_is_no_air_gap_is_refused() {
        let machine = KWON_TABLE_V.machine(1.75).unwrap();
        let gap = *machine.air_gap().unwrap();
        let mut effects = Effects::none();
        effects.leakage_flux_saturation.drop = 0.5;
        assert!(machine.with_effects(effects).unwrap_err().to_string().contains("leakage_flux_saturation"));
        let falls = AirGapSaturation { magnetizing: [20.0, 0.0, 0.0, 0.0, 0.0], ..gap };
        assert!(machine.with_air_gap(Some(falls)).unwrap_err().to_string().contains("magnetizing current"));
        let none_left = AirGapSaturation { rotor_leakage: [0.1, 0.1, 2.0], ..gap };
        assert!(machine.with_air_gap(Some(none_left)).unwrap_err().to_string().contains("rotor_leakage_inductance_h"));
    }
}
