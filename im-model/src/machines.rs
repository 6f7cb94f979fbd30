//! The machines of the papers and of public references, as named constants.

use crate::aqdm::Aqdm;
use crate::parameters::{TParameters, WindingParameters};
use crate::rating::Rating;

/// A named machine in the form its source prints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NamedMachine {
    /// Short name.
    pub name: &'static str,
    /// Where the numbers stand.
    pub source: &'static str,
    /// Self- and mutual inductances, resistances, mechanics.
    pub windings: WindingParameters<f64>,
    /// Pole pairs.
    pub pole_pairs: u32,
    /// Rating; fields the source does not give are derived, as the source line says. The rotor flux is referred as in [`Self::parameters`].
    pub rating: Rating,
}

impl NamedMachine {
    /// The T circuit, referred such that L_ls = L_lr.
    pub fn parameters(&self) -> TParameters<f64> {
        // The inductances below are checked by `every_named_machine_is_valid`.
        self.windings.to_t().unwrap_or_else(|_| unreachable!("named machines are valid"))
    }
}

/// Kwon et al., Table IV: 50-hp, 460-V, 60-Hz Baldor ZDM4115T-AM1. J is 0.42 kg m² (the printed exponent is an erratum: D/J = 0.238).
pub const KWON_TABLE_IV: NamedMachine = NamedMachine {
    name: "kwon_table_iv",
    source: "Kwon, Sudhoff, Żak, Hui, Tables III and IV (J = 0.4203 kg m², see errata); rating from 37.3 kW at 1775 rpm, 460 V",
    windings: WindingParameters {
        stator_resistance_ohm: 0.22,
        rotor_resistance_ohm: 0.159,
        stator_inductance_h: 0.0957,
        rotor_inductance_h: 0.0957,
        mutual_inductance_h: 0.0915,
        inertia_kg_m2: 0.4203,
        viscous_friction_nm_s_per_rad: 0.1,
    },
    pole_pairs: 2,
    rating: Rating { torque_nm: 200.7, electrical_frequency_hz: 60.0, phase_voltage_peak_v: 375.6, rotor_flux_vs: 0.93 },
};

/// Kwon et al., Table V: the alternative q-d model (AQDM) of the same machine, per delta winding. R_s, J and D, which the table has not, are Table IV's.
pub const KWON_TABLE_V: Aqdm = Aqdm {
    stator_resistance_ohm: 0.22,
    stator_leakage_h: 9.06e-4,
    rotor_leakage: [1.40e-4, 4.15e-3, 7.35e-1, 2.59],
    magnetizing: [6.79, 6.62e-1, 5.03, 1.85, 8.68e-1, 1.29e-1],
    rotor: [[5.65, 3.21e-2], [4.40e-2, 4.78e-4], [3.17e-3, 8.76e-8]],
    inertia_kg_m2: 0.4203,
    viscous_friction_nm_s_per_rad: 0.1,
    pole_pairs: 2,
};

/// The set that the printed A, B₁, B₂ of Kwon et al. follow from: a tenth of Table IV's L_m with the same leakage.
pub const KWON_PRINTED_MATRICES: NamedMachine = NamedMachine {
    name: "kwon_printed_matrices",
    source: "fitted to the printed A, B1, B2 of Kwon, Sudhoff, Żak, Hui, Sec. VII (docs/background/errata.md)",
    windings: WindingParameters {
        stator_resistance_ohm: 0.22,
        rotor_resistance_ohm: 0.159,
        stator_inductance_h: 0.01331,
        rotor_inductance_h: 0.01331,
        mutual_inductance_h: 0.00915,
        inertia_kg_m2: 0.4203,
        viscous_friction_nm_s_per_rad: 0.1,
    },
    ..KWON_TABLE_IV
};

/// Kenné et al., Appendix II: 1 kW, 1385 rpm. The rotor is referred such that L_r < M; m is the total inertia; no friction is given.
pub const KENNE_APPENDIX_II: NamedMachine = NamedMachine {
    name: "kenne_appendix_ii",
    source: "Kenné, Ahmed-Ali, Nkwawo, Lamnabhi-Lagarrigue, Appendix II; flux √0.0645 Wb from Sec. IV, referred anew; friction not given: 0",
    windings: WindingParameters {
        stator_resistance_ohm: 8.65,
        rotor_resistance_ohm: 0.7,
        stator_inductance_h: 0.828,
        rotor_inductance_h: 0.082,
        mutual_inductance_h: 0.246,
        inertia_kg_m2: 0.0112,
        viscous_friction_nm_s_per_rad: 0.0,
    },
    pole_pairs: 2,
    rating: Rating { torque_nm: 6.89, electrical_frequency_hz: 50.0, phase_voltage_peak_v: 311.0, rotor_flux_vs: 0.807 },
};

/// Jadot et al., Table I: the 4-kW machine, with inductances in H (the printed "mH" is an erratum); no friction is given.
pub const JADOT_TABLE_I: NamedMachine = NamedMachine {
    name: "jadot_table_i",
    source: "Jadot, Malrait, Moreno-Valenzuela, Sepulchre, Table I (inductances in H, see errata); rating from Sec. VI: 400 V, 50 Hz",
    windings: WindingParameters {
        stator_resistance_ohm: 1.5,
        rotor_resistance_ohm: 0.9,
        stator_inductance_h: 0.16,
        rotor_inductance_h: 0.16,
        mutual_inductance_h: 0.156,
        inertia_kg_m2: 0.045,
        viscous_friction_nm_s_per_rad: 0.0,
    },
    pole_pairs: 2,
    rating: Rating { torque_nm: 26.0, electrical_frequency_hz: 50.0, phase_voltage_peak_v: 326.6, rotor_flux_vs: 0.95 },
};

/// motulator's 2.2-kW machine: inverse-Γ 3.7 Ω, 2.1 Ω, 0.021 H, 0.224 H, here as the T circuit with equal leakages.
pub const MOTULATOR_2_2_KW: NamedMachine = NamedMachine {
    name: "motulator_2_2_kw",
    source: "motulator, 2.2-kW induction machine: inverse-Γ R_s 3.7 Ω, R_R 2.1 Ω, L_σ 0.021 H, L_M 0.224 H; J 0.015 kg m²; 400 V, 50 Hz, 14.6 Nm",
    windings: WindingParameters {
        stator_resistance_ohm: 3.7,
        // With L_s = L_r = 0.245 H: L_m = √(L_M L_r), R_r = R_R L_r/L_M.
        rotor_resistance_ohm: 2.1 * 0.245 / 0.224,
        stator_inductance_h: 0.245,
        rotor_inductance_h: 0.245,
        // √(0.224·0.245): the root is not const, its digits are checked in the tests.
        mutual_inductance_h: 0.234_264_807_429_541_14,
        inertia_kg_m2: 0.015,
        viscous_friction_nm_s_per_rad: 0.0,
    },
    pole_pairs: 2,
    rating: Rating { torque_nm: 14.6, electrical_frequency_hz: 50.0, phase_voltage_peak_v: 326.6, rotor_flux_vs: 0.95 },
};

/// The machine of the Modelica Standard Library's IMC_DOL example, per delta winding, with the load's inertia.
pub const MODELICA_IMC_DOL: NamedMachine = NamedMachine {
    name: "modelica_imc_dol",
    source: "Modelica Standard Library 4.1, Electrical.Machines IMC_DOL: 100 V, 50 Hz windings, 0.29 + 0.29 kg m²",
    windings: {
        // L_m = 3 √(1 − 0.0667)/(2π·50), L_σ = 3 (1 − √(1 − 0.0667))/(2π·50)
        const ROOT: f64 = 0.966_074_531_286_277_1;
        const X: f64 = 3.0 / (2.0 * core::f64::consts::PI * 50.0);
        WindingParameters {
            stator_resistance_ohm: 0.03,
            rotor_resistance_ohm: 0.04,
            stator_inductance_h: X,
            rotor_inductance_h: X,
            mutual_inductance_h: X * ROOT,
            inertia_kg_m2: 0.58,
            viscous_friction_nm_s_per_rad: 0.0,
        }
    },
    pole_pairs: 2,
    rating: Rating {
        torque_nm: 161.4,
        electrical_frequency_hz: 50.0,
        phase_voltage_peak_v: core::f64::consts::SQRT_2 * 100.0,
        rotor_flux_vs: 0.42,
    },
};

/// All named machines.
pub const ALL: [NamedMachine; 6] =
    [KWON_TABLE_IV, KWON_PRINTED_MATRICES, KENNE_APPENDIX_II, JADOT_TABLE_I, MOTULATOR_2_2_KW, MODELICA_IMC_DOL];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::Machine;
    use approx::assert_relative_eq;

    #[test]
    fn every_named_machine_is_valid() {
        for m in ALL {
            Machine::base(m.parameters(), m.pole_pairs).unwrap();
            m.rating.validate().unwrap();
        }
    }

    /// Rotor fluxes refer by √(L_s/L_r), like M; the stator's current at rated torque and flux does not know of it, and is no more than the printed 2.5 A.
    #[test]
    fn rated_flux_of_kenne_is_referred_as_its_parameters_are() {
        let (m, printed) = (KENNE_APPENDIX_II, 0.0645f64.sqrt());
        let w = m.windings;
        let turns = m.parameters().magnetizing_inductance_h / w.mutual_inductance_h;
        // To the three digits of the constant.
        assert_relative_eq!(m.rating.rotor_flux_vs, turns * printed, max_relative = 5e-4);
        // ψ_r = M i_d and τ = (3/2) n_p (M/L_r) ψ_r i_q, as printed.
        let i_d = printed / w.mutual_inductance_h;
        let i_q = m.rating.torque_nm / (1.5 * f64::from(m.pole_pairs) * w.mutual_inductance_h / w.rotor_inductance_h * printed);
        let current = m.rating.current_peak_a(&m.parameters(), m.pole_pairs);
        assert_relative_eq!(current, i_d.hypot(i_q), max_relative = 5e-4);
        assert!((2.0..2.5).contains(&(current / 2f64.sqrt())), "{current} A peak");
    }

    #[test]
    fn digits_of_roots() {
        assert_relative_eq!(MOTULATOR_2_2_KW.windings.mutual_inductance_h, (0.224f64 * 0.245).sqrt(), max_relative = 1e-15);
        let root = MODELICA_IMC_DOL.windings.mutual_inductance_h / MODELICA_IMC_DOL.windings.stator_inductance_h;
        assert_relative_eq!(root, (1.0f64 - 0.0667).sqrt(), max_relative = 1e-12);
        let g = MOTULATOR_2_2_KW.parameters().inverse_gamma();
        assert_relative_eq!(g.leakage_inductance_h, 0.021, max_relative = 1e-12);
        assert_relative_eq!(g.magnetizing_inductance_h, 0.224, max_relative = 1e-12);
        assert_relative_eq!(g.rotor_resistance_ohm, 2.1, max_relative = 1e-12);
    }
}
