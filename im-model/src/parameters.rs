//! Parameters of the base machine, in the forms that the literature uses, and exact conversions between them.
//!
//! All quantities are star-equivalent, per phase. The T circuit is the home form; Γ and inverse-Γ have one inductance less, so that
//! the way back needs the ratio of the leakages, L_ls/L_lr. Derived constants carry the names of the papers:
//! Kwon et al. (Table II), Kenné et al. (after (19)), Jadot et al. ((6), (7)).

use crate::error::{Bound, ModelError};
use crate::scalar::Scalar;

const RESISTANCES_OHM: Bound = Bound::OfMachines(1e-7, 1e5);
const INDUCTANCES_H: Bound = Bound::OfMachines(1e-8, 1e4);
const INERTIAS_KG_M2: Bound = Bound::OfMachines(1e-10, 1e8);

/// The T circuit with mechanics: the base machine.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TParameters<T> {
    /// R_s, Ω.
    pub stator_resistance_ohm: T,
    /// R_r, Ω.
    pub rotor_resistance_ohm: T,
    /// L_ls, H.
    pub stator_leakage_inductance_h: T,
    /// L_lr, H.
    pub rotor_leakage_inductance_h: T,
    /// L_m, H (unsaturated).
    pub magnetizing_inductance_h: T,
    /// J, kg m²: machine and everything on the shaft.
    pub inertia_kg_m2: T,
    /// D, N m s/rad.
    pub viscous_friction_nm_s_per_rad: T,
}

/// One of the seven base parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[allow(missing_docs)]
pub enum BaseParameter {
    StatorResistance,
    RotorResistance,
    StatorLeakageInductance,
    RotorLeakageInductance,
    MagnetizingInductance,
    Inertia,
    ViscousFriction,
}

impl BaseParameter {
    /// All, in the order of [`TParameters`].
    pub const ALL: [Self; 7] = [
        Self::StatorResistance,
        Self::RotorResistance,
        Self::StatorLeakageInductance,
        Self::RotorLeakageInductance,
        Self::MagnetizingInductance,
        Self::Inertia,
        Self::ViscousFriction,
    ];

    /// The key in `motor.toml`, with the unit.
    pub const fn key(self) -> &'static str {
        match self {
            Self::StatorResistance => "stator_resistance_ohm",
            Self::RotorResistance => "rotor_resistance_ohm",
            Self::StatorLeakageInductance => "stator_leakage_inductance_h",
            Self::RotorLeakageInductance => "rotor_leakage_inductance_h",
            Self::MagnetizingInductance => "magnetizing_inductance_h",
            Self::Inertia => "inertia_kg_m2",
            Self::ViscousFriction => "viscous_friction_nm_s_per_rad",
        }
    }

    /// The usual symbol.
    pub const fn symbol(self) -> &'static str {
        match self {
            Self::StatorResistance => "R_s",
            Self::RotorResistance => "R_r",
            Self::StatorLeakageInductance => "L_ls",
            Self::RotorLeakageInductance => "L_lr",
            Self::MagnetizingInductance => "L_m",
            Self::Inertia => "J",
            Self::ViscousFriction => "D",
        }
    }

    /// The unit.
    pub const fn unit(self) -> &'static str {
        match self {
            Self::StatorResistance | Self::RotorResistance => "Ω",
            Self::Inertia => "kg m²",
            Self::ViscousFriction => "N m s/rad",
            _ => "H",
        }
    }

    /// The allowed range: a factor of a hundred and more beyond the machines that are built, from milliwatts to tens of megawatts.
    pub const fn bound(self) -> Bound {
        match self {
            Self::StatorResistance | Self::RotorResistance => RESISTANCES_OHM,
            Self::StatorLeakageInductance | Self::RotorLeakageInductance | Self::MagnetizingInductance => INDUCTANCES_H,
            Self::Inertia => INERTIAS_KG_M2,
            Self::ViscousFriction => Bound::Within(0.0, 1e6),
        }
    }
}

impl<T: Scalar> TParameters<T> {
    /// The values in the order of [`BaseParameter::ALL`].
    pub fn values(&self) -> [T; 7] {
        [
            self.stator_resistance_ohm,
            self.rotor_resistance_ohm,
            self.stator_leakage_inductance_h,
            self.rotor_leakage_inductance_h,
            self.magnetizing_inductance_h,
            self.inertia_kg_m2,
            self.viscous_friction_nm_s_per_rad,
        ]
    }

    /// From the values in the order of [`BaseParameter::ALL`].
    pub fn from_values([r_s, r_r, l_ls, l_lr, l_m, j, d]: [T; 7]) -> Self {
        Self {
            stator_resistance_ohm: r_s,
            rotor_resistance_ohm: r_r,
            stator_leakage_inductance_h: l_ls,
            rotor_leakage_inductance_h: l_lr,
            magnetizing_inductance_h: l_m,
            inertia_kg_m2: j,
            viscous_friction_nm_s_per_rad: d,
        }
    }

    /// The same numbers in another scalar type.
    pub fn cast<U: Scalar>(&self) -> TParameters<U> {
        TParameters::from_values(self.values().map(|x| U::from_f64(x.value())))
    }

    /// Checks every quantity: of a size that machines have; friction may be zero.
    pub fn validate(&self) -> Result<(), ModelError> {
        for (p, x) in BaseParameter::ALL.into_iter().zip(self.values()) {
            p.bound().check(p.key(), x.value())?;
        }
        Ok(())
    }

    /// L_s = L_ls + L_m, H.
    pub fn stator_inductance_h(&self) -> T {
        self.stator_leakage_inductance_h + self.magnetizing_inductance_h
    }

    /// L_r = L_lr + L_m, H.
    pub fn rotor_inductance_h(&self) -> T {
        self.rotor_leakage_inductance_h + self.magnetizing_inductance_h
    }

    /// L_ls/L_lr, the ratio that Γ and inverse-Γ forms cannot express.
    pub fn leakage_ratio(&self) -> T {
        self.stator_leakage_inductance_h / self.rotor_leakage_inductance_h
    }

    /// Self- and mutual inductances.
    pub fn windings(&self) -> WindingParameters<T> {
        WindingParameters {
            stator_resistance_ohm: self.stator_resistance_ohm,
            rotor_resistance_ohm: self.rotor_resistance_ohm,
            stator_inductance_h: self.stator_inductance_h(),
            rotor_inductance_h: self.rotor_inductance_h(),
            mutual_inductance_h: self.magnetizing_inductance_h,
            inertia_kg_m2: self.inertia_kg_m2,
            viscous_friction_nm_s_per_rad: self.viscous_friction_nm_s_per_rad,
        }
    }

    /// Γ form: all leakage on the rotor side, rotor referred by L_s/L_m.
    pub fn gamma(&self) -> GammaParameters<T> {
        let l_s = self.stator_inductance_h();
        let g = l_s / self.magnetizing_inductance_h;
        GammaParameters {
            stator_resistance_ohm: self.stator_resistance_ohm,
            rotor_resistance_ohm: g * g * self.rotor_resistance_ohm,
            leakage_inductance_h: g * self.stator_leakage_inductance_h + g * g * self.rotor_leakage_inductance_h,
            stator_inductance_h: l_s,
        }
    }

    /// Inverse-Γ form: all leakage on the stator side, rotor referred by L_m/L_r.
    pub fn inverse_gamma(&self) -> InverseGammaParameters<T> {
        let k = self.magnetizing_inductance_h / self.rotor_inductance_h();
        let l_big_m = k * self.magnetizing_inductance_h;
        InverseGammaParameters {
            stator_resistance_ohm: self.stator_resistance_ohm,
            rotor_resistance_ohm: k * k * self.rotor_resistance_ohm,
            leakage_inductance_h: self.stator_inductance_h() - l_big_m,
            magnetizing_inductance_h: l_big_m,
        }
    }
}

/// Γ form: magnetizing inductance L_s at the stator, leakage in the rotor branch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GammaParameters<T> {
    /// R_s, Ω.
    pub stator_resistance_ohm: T,
    /// R_R = R_r (L_s/L_m)², Ω.
    pub rotor_resistance_ohm: T,
    /// L_ℓ = L_ls (L_s/L_m) + L_lr (L_s/L_m)², H.
    pub leakage_inductance_h: T,
    /// L_s, H.
    pub stator_inductance_h: T,
}

impl<T: Scalar> GammaParameters<T> {
    /// The T circuit whose leakages stand in the ratio `leakage_ratio` = L_ls/L_lr, with the given mechanics.
    pub fn to_t(&self, leakage_ratio: T, inertia_kg_m2: T, viscous_friction_nm_s_per_rad: T) -> TParameters<T> {
        // With γ = L_s/L_m:  L_ls = L_s(γ−1)/γ,  L_lr = (L_ℓ − L_s(γ−1))/γ²,  L_ls = ρ L_lr.
        let (l_s, rho) = (self.stator_inductance_h, leakage_ratio);
        let two = T::from_f64(2.0);
        let half_b = (rho - T::one()) * l_s / two;
        let g = ((half_b * half_b + l_s * rho * (l_s + self.leakage_inductance_h)).sqrt() - half_b) / l_s;
        TParameters {
            stator_resistance_ohm: self.stator_resistance_ohm,
            rotor_resistance_ohm: self.rotor_resistance_ohm / (g * g),
            stator_leakage_inductance_h: l_s * (g - T::one()) / g,
            rotor_leakage_inductance_h: (self.leakage_inductance_h - l_s * (g - T::one())) / (g * g),
            magnetizing_inductance_h: l_s / g,
            inertia_kg_m2,
            viscous_friction_nm_s_per_rad,
        }
    }
}

/// Inverse-Γ form, and with it the four parameters of Jadot et al. (7): R_req, L, R_s, L_f.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InverseGammaParameters<T> {
    /// R_s, Ω.
    pub stator_resistance_ohm: T,
    /// R_R = R_req = R_r L_m²/L_r², Ω.
    pub rotor_resistance_ohm: T,
    /// L_σ = L_f = L_s − L_m²/L_r = σL_s, H.
    pub leakage_inductance_h: T,
    /// L_M = L = L_m²/L_r, H.
    pub magnetizing_inductance_h: T,
}

impl<T: Scalar> InverseGammaParameters<T> {
    /// 1/T_r = R_req/L, 1/s (Jadot (6)).
    pub fn inverse_rotor_time_constant(&self) -> T {
        self.rotor_resistance_ohm / self.magnetizing_inductance_h
    }

    /// The T circuit whose leakages stand in the ratio `leakage_ratio` = L_ls/L_lr, with the given mechanics.
    pub fn to_t(&self, leakage_ratio: T, inertia_kg_m2: T, viscous_friction_nm_s_per_rad: T) -> TParameters<T> {
        // With k = L_m/L_r:  (L_σ+L_M)k² + (ρ−1)L_M k − ρL_M = 0.
        let (l_big_m, rho) = (self.magnetizing_inductance_h, leakage_ratio);
        let l_s = l_big_m + self.leakage_inductance_h;
        let half_b = (rho - T::one()) * l_big_m / T::from_f64(2.0);
        let k = ((half_b * half_b + l_s * rho * l_big_m).sqrt() - half_b) / l_s;
        TParameters {
            stator_resistance_ohm: self.stator_resistance_ohm,
            rotor_resistance_ohm: self.rotor_resistance_ohm / (k * k),
            stator_leakage_inductance_h: l_s - l_big_m / k,
            rotor_leakage_inductance_h: l_big_m * (T::one() - k) / (k * k),
            magnetizing_inductance_h: l_big_m / k,
            inertia_kg_m2,
            viscous_friction_nm_s_per_rad,
        }
    }
}

/// Self- and mutual inductances, the form in which the papers print their machines. The rotor may be referred by any turns ratio,
/// so that L_r < L_m is possible here (Kenné et al., App. II), though not in a T circuit with positive leakages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WindingParameters<T> {
    /// R_s, Ω.
    pub stator_resistance_ohm: T,
    /// R_r, Ω.
    pub rotor_resistance_ohm: T,
    /// L_s, H.
    pub stator_inductance_h: T,
    /// L_r, H.
    pub rotor_inductance_h: T,
    /// L_m (Kenné: M), H.
    pub mutual_inductance_h: T,
    /// J (Kenné: m), kg m².
    pub inertia_kg_m2: T,
    /// D (Kenné: α), N m s/rad.
    pub viscous_friction_nm_s_per_rad: T,
}

impl<T: Scalar> WindingParameters<T> {
    /// Checks that every quantity is in range and that L_m² < L_s L_r.
    pub fn validate(&self) -> Result<(), ModelError> {
        for (quantity, x, bound) in [
            ("stator_resistance_ohm", self.stator_resistance_ohm, RESISTANCES_OHM),
            ("rotor_resistance_ohm", self.rotor_resistance_ohm, RESISTANCES_OHM),
            ("stator_inductance_h", self.stator_inductance_h, INDUCTANCES_H),
            ("rotor_inductance_h", self.rotor_inductance_h, INDUCTANCES_H),
            ("mutual_inductance_h", self.mutual_inductance_h, INDUCTANCES_H),
            ("inertia_kg_m2", self.inertia_kg_m2, INERTIAS_KG_M2),
        ] {
            bound.check(quantity, x.value())?;
        }
        BaseParameter::ViscousFriction
            .bound()
            .check("viscous_friction_nm_s_per_rad", self.viscous_friction_nm_s_per_rad.value())?;
        let squared = (self.mutual_inductance_h * self.mutual_inductance_h).value();
        let product = (self.stator_inductance_h * self.rotor_inductance_h).value();
        if squared < product { Ok(()) } else { Err(ModelError::CouplingNotPhysical { squared, product }) }
    }

    /// The same machine with the rotor referred anew: L_m → k L_m, L_r → k² L_r, R_r → k² R_r. Nothing measurable changes.
    pub fn referred(&self, k: T) -> Self {
        Self {
            rotor_resistance_ohm: self.rotor_resistance_ohm * k * k,
            rotor_inductance_h: self.rotor_inductance_h * k * k,
            mutual_inductance_h: self.mutual_inductance_h * k,
            ..*self
        }
    }

    /// The T circuit of these windings, referred such that L_ls = L_lr: the usual choice, always with positive leakages.
    pub fn to_t(&self) -> Result<TParameters<T>, ModelError> {
        self.validate()?;
        let k = (self.stator_inductance_h / self.rotor_inductance_h).sqrt();
        let w = self.referred(k);
        Ok(TParameters {
            stator_resistance_ohm: w.stator_resistance_ohm,
            rotor_resistance_ohm: w.rotor_resistance_ohm,
            stator_leakage_inductance_h: w.stator_inductance_h - w.mutual_inductance_h,
            rotor_leakage_inductance_h: w.rotor_inductance_h - w.mutual_inductance_h,
            magnetizing_inductance_h: w.mutual_inductance_h,
            inertia_kg_m2: w.inertia_kg_m2,
            viscous_friction_nm_s_per_rad: w.viscous_friction_nm_s_per_rad,
        })
    }

    /// The derived constants of Kwon et al., Table II.
    pub fn derived(&self, pole_pairs: u32) -> DerivedConstants<T> {
        let (l_m, l_r, l_s) = (self.mutual_inductance_h, self.rotor_inductance_h, self.stator_inductance_h);
        let sigma = T::one() - l_m * l_m / (l_r * l_s);
        let n_p = T::from_f64(f64::from(pole_pairs));
        DerivedConstants {
            sigma,
            eta: self.rotor_resistance_ohm / l_r,
            beta: l_m / (sigma * l_r * l_s),
            mu: T::from_f64(1.5) * n_p * l_m / (self.inertia_kg_m2 * l_r),
            gamma: (self.stator_resistance_ohm + l_m * l_m / (l_r * l_r) * self.rotor_resistance_ohm) / (sigma * l_s),
            sigma_l_s: sigma * l_s,
            eta_l_m: self.rotor_resistance_ohm / l_r * l_m,
            n_p,
        }
    }

    /// The constants of Kenné et al. (after (19) and (27)).
    pub fn kenne(&self, pole_pairs: u32) -> KenneConstants<T> {
        let c = self.derived(pole_pairs);
        let (m_big, l_r, l_s) = (self.mutual_inductance_h, self.rotor_inductance_h, self.stator_inductance_h);
        let (r_s, m) = (self.stator_resistance_ohm, self.inertia_kg_m2);
        let sigma_l_s = c.sigma_l_s;
        let k_1 = m_big / (sigma_l_s * l_r);
        let k_2 = r_s * m_big / sigma_l_s;
        KenneConstants {
            mu: c.mu,
            k: [
                sigma_l_s / (m * c.mu),
                k_1,
                k_2,
                m_big / (c.sigma * l_r),
                m_big * m_big / l_r,
                m_big / l_r * k_1,
                c.n_p * m_big / (m * c.mu),
                r_s / k_2,
            ],
            beta: [c.n_p, c.n_p * r_s / sigma_l_s, -c.n_p / sigma_l_s],
            gamma: [
                T::one() / sigma_l_s,
                T::one() / (c.sigma * l_s * l_r),
                r_s / (c.sigma * l_s * l_r),
                T::one() / (c.sigma * l_r),
            ],
        }
    }
}

/// Derived constants of Kwon et al., Table II.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DerivedConstants<T> {
    /// σ = 1 − L_m²/(L_r L_s).
    pub sigma: T,
    /// η = R_r/L_r, 1/s.
    pub eta: T,
    /// β = L_m/(σ L_r L_s), 1/H.
    pub beta: T,
    /// μ = (3/2) n_p L_m/(J L_r), 1/(kg m²).
    pub mu: T,
    /// γ = (R_s + R_r L_m²/L_r²)/(σ L_s), 1/s.
    pub gamma: T,
    /// σ L_s, H.
    pub sigma_l_s: T,
    /// η L_m, Ω.
    pub eta_l_m: T,
    /// n_p.
    pub n_p: T,
}

/// Constants of Kenné et al.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KenneConstants<T> {
    /// μ = (3/2) n_p M/(m L_r).
    pub mu: T,
    /// k₀ … k₇ (after (19)).
    pub k: [T; 8],
    /// β₁ … β₃ (after (27)).
    pub beta: [T; 3],
    /// γ₁ … γ₄ (after (27)).
    pub gamma: [T; 4],
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use proptest::prelude::*;

    fn any_machine() -> impl Strategy<Value = TParameters<f64>> {
        (0.01..10.0f64, 0.01..10.0f64, 1e-4..2e-2f64, 1e-4..2e-2f64, 0.01..1.0f64)
            .prop_map(|(r_s, r_r, l_ls, l_lr, l_m)| TParameters::from_values([r_s, r_r, l_ls, l_lr, l_m, 0.02, 1e-3]))
    }

    proptest! {
        #[test]
        fn every_form_round_trips(t in any_machine()) {
            let (rho, j, d) = (t.leakage_ratio(), t.inertia_kg_m2, t.viscous_friction_nm_s_per_rad);
            for back in [t.gamma().to_t(rho, j, d), t.inverse_gamma().to_t(rho, j, d)] {
                for (a, b) in back.values().into_iter().zip(t.values()) {
                    assert_relative_eq!(a, b, max_relative = 1e-9);
                }
            }
            let w = t.windings();
            let (a, b) = (w.to_t().unwrap().inverse_gamma(), t.inverse_gamma());
            assert_relative_eq!(a.leakage_inductance_h, b.leakage_inductance_h, max_relative = 1e-9);
            assert_relative_eq!(a.rotor_resistance_ohm, b.rotor_resistance_ohm, max_relative = 1e-9);
            assert_relative_eq!(a.magnetizing_inductance_h, b.magnetizing_inductance_h, max_relative = 1e-9);
        }

        /// Γ, inverse-Γ and T circuits have the same stator impedance at any frequency and slip.
        #[test]
        fn every_form_has_the_same_impedance(t in any_machine(), w in 1.0..1e3f64, slip in 0.01..1.0f64) {
            use num_complex::Complex64 as C;
            let j = C::i();
            let par = |a: C, b: C| a * b / (a + b);
            let z_t = t.stator_resistance_ohm + j * w * t.stator_leakage_inductance_h
                + par(j * w * t.magnetizing_inductance_h, t.rotor_resistance_ohm / slip + j * w * t.rotor_leakage_inductance_h);
            let g = t.gamma();
            let z_g = g.stator_resistance_ohm
                + par(j * w * g.stator_inductance_h, g.rotor_resistance_ohm / slip + j * w * g.leakage_inductance_h);
            let i = t.inverse_gamma();
            let z_i = i.stator_resistance_ohm + j * w * i.leakage_inductance_h
                + par(j * w * i.magnetizing_inductance_h, C::from(i.rotor_resistance_ohm / slip));
            prop_assert!((z_t - z_g).norm() < 1e-9 * z_t.norm());
            prop_assert!((z_t - z_i).norm() < 1e-9 * z_t.norm());
        }
    }

    #[test]
    fn bad_parameters_are_named_with_their_bound() {
        let good = TParameters::from_values([1.0, 1.0, 0.01, 0.01, 0.2, 0.01, 0.0]);
        assert_eq!(good.validate(), Ok(()));
        for (i, bad) in [(0, -1.0), (4, 0.0), (5, f64::NAN), (6, -1e-9), (2, f64::INFINITY)] {
            let mut v = good.values();
            v[i] = bad;
            let text = TParameters::from_values(v).validate().unwrap_err().to_string();
            assert!(text.starts_with(BaseParameter::ALL[i].key()), "{text}");
        }
        let w = WindingParameters { mutual_inductance_h: 0.5, ..good.windings() };
        assert!(w.validate().unwrap_err().to_string().contains("L_s·L_r"));
    }
}
