//! The alternative q-d model (AQDM) of Kwon and Sudhoff as its table prints it, and the machine that it is.
//!
//! ```text
//! L_ls = l_s1,   L_lr(λ_m) and Γ_m(λ_m) of the air gap (`AirGapSaturation`),   Y_r(s) = Σ y_ak/(y_τk s + 1)           (Kwon et al., Section VIII)
//! ```
//!
//! Two branches of Y_r are a resistance, a leakage and a bar that the current diffuses into, exactly: with R = 1/(y₁ + y₂) and
//! τ = R(y₁τ₂ + y₂τ₁),
//!
//! ```text
//! 1/Y_r(s) = R + s L_a + kR τs/(1 + τs),   L_a = Rτ₁τ₂/τ,   kτ = τ₁ + τ₂ − τ − τ₁τ₂/τ
//! ```
//!
//! which is the rotor of the T circuit with the effect `rotor_skin_effect`. A third branch is joined to the one before it; that of Table V, 0.06 % of the
//! conductance with a time constant of 88 ns, is a resistance at every frequency that a drive has.

use crate::air_gap::AirGapSaturation;
use crate::effects::Effects;
use crate::error::ModelError;
use crate::machine::Machine;
use crate::parameters::TParameters;
use crate::scalar::Scalar;

/// A table of the model, with the stator resistance and the mechanics, per winding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aqdm {
    /// R_s, Ω.
    pub stator_resistance_ohm: f64,
    /// l_s1, H.
    pub stator_leakage_h: f64,
    /// l_r1 (H), l_r2 (H), l_r3 (Vs^−l_r4), l_r4.
    pub rotor_leakage: [f64; 4],
    /// m₁ (1/H), m₂ (1/(H Vs)), m₃ (1/Vs), m₄ (Vs), m₅ (1/Vs), m₆ (Vs).
    pub magnetizing: [f64; 6],
    /// (y_a in S, y_τ in s) of each branch of Y_r, the slowest first.
    pub rotor: [[f64; 2]; 3],
    /// J, kg m².
    pub inertia_kg_m2: f64,
    /// D, N m s/rad.
    pub viscous_friction_nm_s_per_rad: f64,
    /// n_p.
    pub pole_pairs: u32,
}

/// The rotor of two branches as the T circuit has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeriesRotor {
    /// R, Ω.
    pub resistance_ohm: f64,
    /// L_a, H.
    pub leakage_h: f64,
    /// k.
    pub resistance_rise: f64,
    /// τ, s.
    pub time_constant_s: f64,
}

impl Aqdm {
    /// Γ_m(λ), 1/H.
    pub fn inverse_magnetizing(&self, flux_vs: f64) -> f64 {
        let [m1, m2, m3, m4, m5, m6] = self.magnetizing;
        m1 - m2 * flux_vs + Scalar::exp(m3 * (flux_vs - m4)) + Scalar::exp(m5 * (flux_vs - m6))
    }

    /// L_lr(λ), H.
    pub fn rotor_leakage(&self, flux_vs: f64) -> f64 {
        let [l1, l2, l3, l4] = self.rotor_leakage;
        l1 + l2 / (1.0 + l3 * Scalar::powf(flux_vs, l4))
    }

    /// The rotor in series form, the third branch with the second.
    pub fn series_rotor(&self) -> SeriesRotor {
        let [[y1, t1], [y2, t2], [y3, _]] = self.rotor;
        let y2 = y2 + y3;
        let r = 1.0 / (y1 + y2);
        let tau = r * (y1 * t2 + y2 * t1);
        let slow = t1 * t2 / tau;
        SeriesRotor {
            resistance_ohm: r,
            leakage_h: r * slow,
            resistance_rise: (t1 + t2 - tau - slow) / tau,
            time_constant_s: tau,
        }
    }

    /// A delta machine's table for its equivalent star: impedances over 3, fluxes over √3.
    pub fn per_star(&self) -> Self {
        let root = Scalar::sqrt(3.0f64);
        let ([l1, l2, l3, l4], [m1, m2, m3, m4, m5, m6]) = (self.rotor_leakage, self.magnetizing);
        // 3 e^{m₃(√3λ − m₄)} = e^{√3m₃(λ − (m₄ − ln 3/m₃)/√3)}
        let shifted = |rate: f64, at: f64| (at - Scalar::ln(3.0f64) / rate) / root;
        Self {
            stator_resistance_ohm: self.stator_resistance_ohm / 3.0,
            stator_leakage_h: self.stator_leakage_h / 3.0,
            rotor_leakage: [l1 / 3.0, l2 / 3.0, l3 * Scalar::powf(root, l4), l4],
            magnetizing: [3.0 * m1, 3.0 * root * m2, root * m3, shifted(m3, m4), root * m5, shifted(m5, m6)],
            rotor: self.rotor.map(|[y, tau]| [3.0 * y, tau]),
            ..*self
        }
    }

    /// The machine, whose T circuit is what holds at a reference flux (Vs peak).
    ///
    /// # Errors
    /// The table is none of a machine: names the quantity.
    pub fn machine(&self, reference_flux_vs: f64) -> Result<Machine<f64>, ModelError> {
        let rotor = self.series_rotor();
        let parameters = TParameters {
            stator_resistance_ohm: self.stator_resistance_ohm,
            rotor_resistance_ohm: rotor.resistance_ohm,
            stator_leakage_inductance_h: self.stator_leakage_h,
            rotor_leakage_inductance_h: rotor.leakage_h + self.rotor_leakage(reference_flux_vs),
            magnetizing_inductance_h: 1.0 / self.inverse_magnetizing(reference_flux_vs),
            inertia_kg_m2: self.inertia_kg_m2,
            viscous_friction_nm_s_per_rad: self.viscous_friction_nm_s_per_rad,
        };
        let mut effects = Effects::none();
        effects.rotor_skin_effect.resistance_rise = rotor.resistance_rise;
        effects.rotor_skin_effect.time_constant_s = rotor.time_constant_s;
        let ([_, m @ ..], [_, l @ ..]) = (self.magnetizing, self.rotor_leakage);
        let gap = AirGapSaturation { reference_flux_vs, magnetizing: m, rotor_leakage: l };
        Machine::try_new(parameters, self.pole_pairs, effects)?.with_air_gap(Some(gap))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machines::KWON_TABLE_V;
    use crate::{Complex, Held, Plant, PlantInput, steady_state};

    /// 1/Y_r of the two branches and of the series form at any frequency.
    #[test]
    fn two_branches_are_the_skin_effect() {
        let [[y1, t1], [y2, t2], [y3, _]] = KWON_TABLE_V.rotor;
        let s = KWON_TABLE_V.series_rotor();
        for w in [0.0, 1.0, 30.0, 400.0, 1e4, 1e6] {
            let branch = |y: f64, tau: f64| Complex::new(y, 0.0) / Complex::new(1.0, w * tau);
            let printed = Complex::new(1.0, 0.0) / (branch(y1, t1) + branch(y2 + y3, t2));
            let bar = Complex::new(0.0, w * s.time_constant_s);
            let series =
                Complex::new(s.resistance_ohm, w * s.leakage_h) + bar / (bar + 1.0) * (s.resistance_rise * s.resistance_ohm);
            assert!((printed - series).norm() < 1e-9 * printed.norm(), "{w}: {printed} {series}");
        }
    }

    /// The machine's steady states are those of the circuit of Fig. 6 with (22) to (25): torque and current at a flux and a slip.
    #[test]
    fn the_machine_settles_on_the_circuit_of_fig_6() {
        let machine = KWON_TABLE_V.machine(1.75).unwrap();
        let plant = Plant::new(&machine);
        for (voltage, frequency, speed) in [(650.0, 60.0, 186.0), (325.0, 31.0, 95.5), (100.0, 10.0, 29.0), (300.0, 60.0, 0.0)] {
            let x = steady_state(&machine, voltage, frequency, Held::Speed(speed)).unwrap();
            let now = plant.evaluate(&x, &PlantInput::new(Complex::new(voltage, 0.0), 0.0));
            let (flux, w) = (now.currents.psi_m.norm(), core::f64::consts::TAU * frequency - 2.0 * speed);
            let y = KWON_TABLE_V
                .rotor
                .iter()
                .map(|[y, tau]| Complex::new(*y, 0.0) / Complex::new(1.0, tau * w))
                .sum::<Complex<f64>>();
            let rotor = Complex::new(0.0, w * KWON_TABLE_V.rotor_leakage(flux)) + Complex::new(1.0, 0.0) / y;
            let admittance = Complex::new(0.0, -KWON_TABLE_V.inverse_magnetizing(flux)) + Complex::new(w, 0.0) / rotor;
            let (current, torque) = (flux * admittance.norm(), 3.0 * flux * flux * admittance.re);
            // The third branch, 0.06 % of the conductance at low slip, is taken to be as slow as the second: that is 0.2 % with the rotor locked.
            assert!((now.currents.i_s.norm() / current - 1.0).abs() < 3e-3, "{speed}: {} {current}", now.currents.i_s.norm());
            assert!((now.torque / torque - 1.0).abs() < 5e-3, "{speed}: {} {torque}", now.torque);
            // In the steady state every power is accounted for.
            assert!(now.powers.net().abs() < 1e-6 * now.powers.values()[0].abs() + 1e-6 || speed > 0.0);
        }
    }

    /// The equivalent star takes √3 times the current at 1/√3 of the voltage, and gives the same torque.
    #[test]
    fn the_equivalent_star_is_the_same_machine() {
        let (delta, star) = (KWON_TABLE_V.machine(1.75).unwrap(), KWON_TABLE_V.per_star().machine(1.75 / 3f64.sqrt()).unwrap());
        let at = |m: &Machine<f64>, u: f64| {
            let x = steady_state(m, u, 60.0, Held::Speed(186.0)).unwrap();
            let plant = Plant::new(m);
            (plant.currents(&x).i_s.norm(), plant.torque(&x))
        };
        let ((i_delta, t_delta), (i_star, t_star)) = (at(&delta, 650.0), at(&star, 650.0 / 3f64.sqrt()));
        assert!((i_star / i_delta / 3f64.sqrt() - 1.0).abs() < 1e-9 && (t_star / t_delta - 1.0).abs() < 1e-9);
    }
}
