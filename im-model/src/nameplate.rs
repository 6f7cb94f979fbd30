//! A first guess of all parameters from the nameplate, good enough to start a fit.
//!
//! Per star-equivalent phase, with U, I the phase values (rms), φ their angle, P the shaft power, s the slip:
//!
//! - pole pairs: the most that leave the rated speed below the synchronous one;
//! - copper of the stator: the losses √3 U_L I cos φ − P, less a fifth for iron and friction, less the rotor's s P_δ with
//!   P_δ = P/(1 − s);
//! - leakages: the locked-rotor current is I_A ≈ 6 I unless the data sheet says otherwise (catalogues of standard machines: 5 to 8,
//!   below 1.5 kW about 4), so that X_σ = √((U/I_A)² − R²); where the breakdown torque is given, those with which the circuit has it: its
//!   currents saturate the leakage paths less. Shared between stator and rotor by [`DesignClass`], alike where that is not known;
//! - rotor resistance: the air-gap power, E² (R_r/s)/((R_r/s)² + X_lr²) = P_δ/3 with E = |U − (R_s + jX_ls) I|;
//! - magnetizing reactance: what is left of the current, I − E/(R_r/s + jX_lr), its reactive part;
//! - inertia: ½ J Ω²/P ≈ 0.14 s, the middle of 0.08 to 0.3 s of the machines in [`machines`](crate::machines); friction: half a
//!   percent of rated torque at rated speed.
//!
//! Star or delta does not matter: the line quantities of either give the star-equivalent circuit.

use num_complex::Complex;

use crate::error::{Bound, ModelError};
use crate::parameters::TParameters;
use crate::rating::{INERTIA_CONSTANT_S, Rating};
use crate::scalar::Scalar;

/// Locked-rotor over rated current when the data sheet does not say: of small machines, and from `SMALL_W` up.
const LOCKED_ROTOR_CURRENT_RATIO: [f64; 2] = [4.0, 6.0];
const SMALL_W: f64 = 1500.0;
/// Leakages looked at for a breakdown torque, over that by the locked-rotor current.
const LEAKAGES: [f64; 2] = [0.2, 5.0];
/// Iron, friction and stray losses over all losses.
const CONSTANT_LOSS_SHARE: f64 = 0.2;

/// How the rotor of a machine is designed: by NEMA MG 1 (A to D) and IEC 60034-12 (N, H). Standard machines are B or N.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DesignClass {
    /// Normal starting torque and current, low slip; also machines with a wound rotor.
    A,
    /// Normal starting torque, low starting current; IEC design N.
    B,
    /// High starting torque; IEC design H.
    C,
    /// High slip.
    D,
}

impl DesignClass {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::A, Self::B, Self::C, Self::D];
    /// What [`from_name`](Self::from_name) takes.
    pub const NAMES: &'static str = "A, B, C or D (NEMA), N or H (IEC), or wound";

    /// Its letter.
    pub fn name(self) -> &'static str {
        ["A", "B", "C", "D"][self as usize]
    }

    /// By its letter, IEC's too.
    pub fn from_name(name: &str) -> Option<Self> {
        Some(match name {
            "A" | "a" | "wound" => Self::A,
            "B" | "b" | "N" | "n" => Self::B,
            "C" | "c" | "H" | "h" => Self::C,
            "D" | "d" => Self::D,
            _ => return None,
        })
    }

    /// L_ls/L_lr (IEEE 112, the impedance tests: 1.0, 0.67, 0.43 and 1.0).
    pub fn leakage_ratio(self) -> f64 {
        match self {
            Self::A | Self::D => 1.0,
            Self::B => 0.67,
            Self::C => 0.43,
        }
    }

    /// Standard deviation of ln(L_ls/L_lr) where a machine is said to have the ratio `given`. A class is known by its ratio when that is nearer
    /// to its own than to the next one's, which is half again as large or as small: within a factor √1.5, in 95 of 100 cases. Without a class
    /// all of them are possible: to the farther end of theirs in 95 of 100 cases.
    pub fn leakage_ratio_std(class: Option<Self>, given: f64) -> f64 {
        let within = match class {
            Some(_) => 0.5 * Scalar::ln(1.5f64),
            None => Self::ALL.iter().fold(0.0, |far: f64, c| far.max(Scalar::ln(c.leakage_ratio() / given).abs())),
        };
        within / 1.96
    }
}

/// What stands on a motor's nameplate, and in its data sheet.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Nameplate {
    /// Rated shaft power, W.
    pub power_w: f64,
    /// Line-to-line voltage, V rms, of the connection in use.
    pub line_voltage_rms_v: f64,
    /// Line current, A rms, of the same connection.
    pub line_current_rms_a: f64,
    /// Rated speed, rpm.
    pub speed_rpm: f64,
    /// Supply frequency, Hz.
    pub frequency_hz: f64,
    /// Power factor cos φ.
    pub power_factor: f64,
    /// Locked-rotor over rated current (I_A/I_N), where the data sheet gives it.
    pub locked_rotor_current_ratio: Option<f64>,
    /// Locked-rotor over rated torque (T_A/T_N), where the data sheet gives it.
    pub locked_rotor_torque_ratio: Option<f64>,
    /// Breakdown over rated torque (T_K/T_N), where the data sheet gives it.
    pub breakdown_torque_ratio: Option<f64>,
    /// The design class, which shares the leakage between stator and rotor; alike where it is not known.
    pub design: Option<DesignClass>,
}

/// What is guessed from a nameplate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NameplateGuess {
    /// The T circuit.
    pub parameters: TParameters<f64>,
    /// Pole pairs.
    pub pole_pairs: u32,
    /// The rating, with the rotor flux of the guessed circuit at the rated point.
    pub rating: Rating,
    /// Rotor resistance with the rotor locked over that at the rated point, where current and torque of the locked rotor are given: above one,
    /// the bars are deep.
    pub locked_rotor_resistance_ratio: Option<f64>,
}

/// The circuit per phase with the leakage as it is taken: what follows from the rated point.
#[derive(Clone, Copy)]
struct Circuit {
    x_ls: f64,
    x_lr: f64,
    x_m: f64,
    r_over_s: f64,
    /// Voltage across the magnetizing branch, V.
    e: Complex<f64>,
    /// Current into the rotor branch, A.
    i_r: Complex<f64>,
}

/// The rated point per phase.
#[derive(Clone, Copy)]
struct RatedPoint {
    u: f64,
    i_s: Complex<f64>,
    r_s: f64,
    /// Air-gap power, W.
    gap: f64,
    leakage_ratio: f64,
}

impl RatedPoint {
    fn circuit(&self, x_sigma: f64) -> Circuit {
        let x_ls = x_sigma * self.leakage_ratio / (1.0 + self.leakage_ratio);
        let x_lr = x_sigma - x_ls;
        let e = Complex::from(self.u) - Complex::new(self.r_s, x_ls) * self.i_s;
        let e_squared = e.norm_sqr();
        let root = e_squared * e_squared - 4.0 * self.gap * self.gap * x_lr * x_lr;
        let r_over_s = (e_squared + Scalar::sqrt(root.max(0.0))) / (2.0 * self.gap);
        let i_r = e / Complex::new(r_over_s, x_lr);
        // Admittance of the magnetizing branch; at most 1.2, at least 0.1 of the rated admittance.
        let rated = Scalar::sqrt(self.i_s.norm_sqr()) / self.u;
        let y_m = (-((self.i_s - i_r) / e).im).clamp(0.1 * rated, 1.2 * rated);
        Circuit { x_ls, x_lr, x_m: 1.0 / y_m, r_over_s, e, i_r }
    }

    /// Breakdown torque times synchronous speed, W: T_K = 3 U_t²/(2Ω (R_t + √(R_t² + (X_t + X_lr)²))), the source seen from the rotor branch.
    fn breakdown_power(&self, c: &Circuit) -> f64 {
        let stator = Complex::new(self.r_s, c.x_ls);
        let divided = Complex::new(0.0, c.x_m) / (stator + Complex::new(0.0, c.x_m));
        let z = stator * divided;
        let u_squared = self.u * self.u * divided.norm_sqr();
        let x = z.im + c.x_lr;
        3.0 * u_squared / (2.0 * (z.re + Scalar::sqrt(z.re * z.re + x * x)))
    }

    /// The leakage reactance, a fifth to five times `about`, with which the circuit has a breakdown power.
    fn leakage_for(&self, breakdown_power: f64, about: f64) -> f64 {
        let (mut low, mut high) = (LEAKAGES[0] * about, LEAKAGES[1] * about);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if self.breakdown_power(&self.circuit(middle)) < breakdown_power {
                high = middle;
            } else {
                low = middle;
            }
        }
        0.5 * (low + high)
    }
}

impl Nameplate {
    /// All losses at the rated point, W: what goes in, √3 U I cos φ, less the shaft power.
    pub fn losses_w(&self) -> f64 {
        Scalar::sqrt(3.0f64) * self.line_voltage_rms_v * self.line_current_rms_a * self.power_factor - self.power_w
    }

    /// The guess.
    ///
    /// # Errors
    ///
    /// A quantity that is not positive, a speed that is no motor speed of 1 to 100 pole pairs with up to 20 % slip, a power factor or
    /// an efficiency (shaft power over √3 U I cos φ) that is not below one, a locked-rotor current not between 2 and 15 times rated, torques of
    /// the data sheet outside 0.2 to 6 times rated, or a breakdown torque that no leakage gives or that is less than the locked-rotor torque.
    pub fn guess(&self) -> Result<NameplateGuess, ModelError> {
        for (quantity, x) in [
            ("power_w", self.power_w),
            ("line_voltage_rms_v", self.line_voltage_rms_v),
            ("line_current_rms_a", self.line_current_rms_a),
            ("speed_rpm", self.speed_rpm),
            ("frequency_hz", self.frequency_hz),
        ] {
            Bound::Positive.check(quantity, x)?;
        }
        Bound::Within(0.2, 0.99).check("power_factor", self.power_factor)?;
        let ratio = self.locked_rotor_current_ratio.unwrap_or(LOCKED_ROTOR_CURRENT_RATIO[usize::from(self.power_w >= SMALL_W)]);
        Bound::Within(2.0, 15.0).check("locked_rotor_current_ratio", ratio)?;
        for (quantity, x) in [
            ("locked_rotor_torque_ratio", self.locked_rotor_torque_ratio),
            ("breakdown_torque_ratio", self.breakdown_torque_ratio),
        ] {
            Bound::Within(0.2, 6.0).check(quantity, x.unwrap_or(1.0))?;
        }

        if let (Some(locked), Some(breakdown)) = (self.locked_rotor_torque_ratio, self.breakdown_torque_ratio) {
            Bound::Within(0.2, breakdown).check("locked_rotor_torque_ratio", locked)?;
        }

        let pole_pairs = 60.0 * self.frequency_hz / self.speed_rpm;
        Bound::Within(1.0, 100.999).check("pole pairs (60 frequency_hz/speed_rpm)", pole_pairs)?;
        let pole_pairs = pole_pairs as u32;
        let n_p = f64::from(pole_pairs);
        let slip = 1.0 - n_p * self.speed_rpm / (60.0 * self.frequency_hz);
        Bound::Within(1e-4, 0.2).check("slip (1 − pole pairs · speed_rpm/(60 frequency_hz))", slip)?;

        let u = self.line_voltage_rms_v / Scalar::sqrt(3.0f64);
        let current = self.line_current_rms_a;
        let input = 3.0 * u * current * self.power_factor;
        // In as many digits as are worth a word.
        let efficiency = libm::round(1e4 * self.power_w / input) / 1e4;
        Bound::Within(0.2, 0.995).check("efficiency (power_w/(√3 U I cos φ))", efficiency)?;

        let omega = 2.0 * core::f64::consts::PI * self.frequency_hz;
        // Per phase, W.
        let gap = self.power_w / (1.0 - slip) / 3.0;
        let losses = (input - self.power_w) / 3.0;
        let stator_copper = (losses * (1.0 - CONSTANT_LOSS_SHARE) - slip * gap).max(0.2 * losses);
        let r_s = stator_copper / (current * current);
        let locked = u / (ratio * current);
        // Roughly twice the stator's resistance stands beside the leakages.
        let x_sigma = Scalar::sqrt((locked * locked - 4.0 * r_s * r_s).max(0.25 * locked * locked));

        let sine = Scalar::sqrt(1.0 - self.power_factor * self.power_factor);
        let i_s = Complex::new(self.power_factor, -sine) * current;
        let point = RatedPoint { u, i_s, r_s, gap, leakage_ratio: self.design.map_or(1.0, DesignClass::leakage_ratio) };
        let synchronous = omega / n_p;
        let rated_torque = self.power_w / (self.speed_rpm * core::f64::consts::PI / 30.0);
        let x_sigma = match self.breakdown_torque_ratio {
            None => x_sigma,
            Some(k) => {
                let rated = rated_torque * synchronous;
                let [most, least] = LEAKAGES.map(|x| point.breakdown_power(&point.circuit(x * x_sigma)) / rated);
                Bound::Within(least, most).check("breakdown_torque_ratio", k)?;
                point.leakage_for(k * rated, x_sigma)
            }
        };
        let Circuit { x_ls, x_lr, x_m, r_over_s, e, i_r } = point.circuit(x_sigma);
        let resistance_ratio = self.locked_rotor_torque_ratio.zip(self.locked_rotor_current_ratio).map(|(torque, ratio)| {
            // Of the locked current, the magnetizing branch takes a part.
            let rotor = ratio * current * x_m / (x_m + x_lr);
            torque * rated_torque * synchronous / (3.0 * rotor * rotor) / (r_over_s * slip)
        });

        let omega_m = self.speed_rpm * core::f64::consts::PI / 30.0;
        let torque = self.power_w / omega_m;
        let parameters = TParameters {
            stator_resistance_ohm: r_s,
            rotor_resistance_ohm: r_over_s * slip,
            stator_leakage_inductance_h: x_ls / omega,
            rotor_leakage_inductance_h: x_lr / omega,
            magnetizing_inductance_h: x_m / omega,
            inertia_kg_m2: 2.0 * INERTIA_CONSTANT_S * self.power_w / (synchronous * synchronous),
            viscous_friction_nm_s_per_rad: 0.005 * torque / omega_m,
        };
        parameters.validate()?;
        // ψ_r = ψ_m − L_lr i_r', with i_r' the current into the rotor branch; peak.
        let psi_r = (e - Complex::new(0.0, x_lr) * i_r) / omega * core::f64::consts::SQRT_2;
        let rating = Rating {
            torque_nm: torque,
            electrical_frequency_hz: self.frequency_hz,
            phase_voltage_peak_v: u * core::f64::consts::SQRT_2,
            rotor_flux_vs: Scalar::sqrt(psi_r.norm_sqr()),
        };
        Ok(NameplateGuess { parameters, pole_pairs, rating, locked_rotor_resistance_ratio: resistance_ratio })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machines::{self, NamedMachine};
    use crate::{Held, Machine, Plant, steady_state};

    /// The nameplate that a machine's own circuit gives at its rated torque, and its locked-rotor current ratio.
    fn nameplate_of(m: &NamedMachine) -> (Nameplate, f64) {
        of_circuit(m.parameters(), m)
    }

    /// The same with another circuit.
    fn of_circuit(p: TParameters<f64>, m: &NamedMachine) -> (Nameplate, f64) {
        let machine = Machine::base(p, m.pole_pairs).unwrap();
        let plant = Plant::new(&machine);
        let (u, f) = (m.rating.phase_voltage_peak_v, m.rating.electrical_frequency_hz);
        let x = steady_state(&machine, u, f, Held::Load(m.rating.torque_nm)).unwrap();
        let i = plant.currents(&x).i_s;
        let locked = plant.currents(&steady_state(&machine, u, f, Held::Speed(0.0)).unwrap()).i_s;
        let plate = Nameplate {
            power_w: m.rating.torque_nm * x.omega_m,
            line_voltage_rms_v: u * 1.5f64.sqrt(),
            line_current_rms_a: i.norm() / 2f64.sqrt(),
            speed_rpm: x.omega_m * 30.0 / std::f64::consts::PI,
            frequency_hz: f,
            power_factor: i.re / i.norm(),
            ..Nameplate::default()
        };
        (plate, locked.norm() / i.norm())
    }

    /// Guess over truth of R_s, R_r, σ-leakage, L_M (inverse-Γ, which does not depend on how the rotor is referred) and J.
    fn ratios(guess: &TParameters<f64>, truth: &TParameters<f64>) -> [f64; 5] {
        let (a, b) = (guess.inverse_gamma(), truth.inverse_gamma());
        [
            a.stator_resistance_ohm / b.stator_resistance_ohm,
            a.rotor_resistance_ohm / b.rotor_resistance_ohm,
            a.leakage_inductance_h / b.leakage_inductance_h,
            a.magnetizing_inductance_h / b.magnetizing_inductance_h,
            guess.inertia_kg_m2 / truth.inertia_kg_m2,
        ]
    }

    /// The machines of Kwon et al. are left out: with the printed inductances they cannot carry rated torque at rated voltage
    /// (docs/background/errata.md).
    #[test]
    fn named_machines_are_guessed_within_a_factor_of_two() {
        for m in [machines::KENNE_APPENDIX_II, machines::JADOT_TABLE_I, machines::MOTULATOR_2_2_KW, machines::MODELICA_IMC_DOL] {
            let (plate, locked) = nameplate_of(&m);
            let mut truth = m.parameters();
            if m.name == machines::MODELICA_IMC_DOL.name {
                // Half of its inertia is the load's, which no nameplate tells.
                truth.inertia_kg_m2 *= 0.5;
            }
            let guess = plate.guess().unwrap();
            assert_eq!(guess.pole_pairs, m.pole_pairs);
            assert!((guess.rating.torque_nm / m.rating.torque_nm - 1.0).abs() < 1e-9);
            let by_rule = ratios(&guess.parameters, &truth);
            assert!(by_rule.iter().all(|r| (0.5..2.0).contains(r)), "{}: {by_rule:?}", m.name);
            // With the locked-rotor current given, leakage, rotor resistance and magnetizing inductance are close.
            let known = Nameplate { locked_rotor_current_ratio: Some(locked), ..plate };
            let by_data_sheet = ratios(&known.guess().unwrap().parameters, &truth);
            assert!(by_data_sheet[1..4].iter().all(|r| (0.9..1.1).contains(r)), "{}: {by_data_sheet:?}", m.name);
        }
    }

    #[test]
    fn a_data_sheet_leads_back_to_the_circuit_that_it_was_made_from() {
        // Design B, with the torques that the circuit itself has.
        let m = machines::MOTULATOR_2_2_KW;
        let mut truth = m.parameters();
        truth.rotor_leakage_inductance_h = truth.stator_leakage_inductance_h / DesignClass::B.leakage_ratio();
        let (plate, locked) = of_circuit(truth, &m);
        let (u, f, rated) = (m.rating.phase_voltage_peak_v, m.rating.electrical_frequency_hz, m.rating.torque_nm);
        let synchronous = std::f64::consts::TAU * f / f64::from(m.pole_pairs);
        // Torque with the rotor locked, and the most at any speed.
        let torques = |p: TParameters<f64>| {
            let machine = Machine::base(p, m.pole_pairs).unwrap();
            let at = |part: f64| {
                Plant::new(&machine).torque(&steady_state(&machine, u, f, Held::Speed(synchronous * part)).unwrap()) / rated
            };
            (at(0.0), (0..1000).map(|k| at(f64::from(k) * 1e-3)).fold(0.0, f64::max))
        };
        let (standing, breakdown) = torques(truth);
        let sheet = Nameplate {
            locked_rotor_current_ratio: Some(locked),
            locked_rotor_torque_ratio: Some(standing),
            breakdown_torque_ratio: Some(breakdown),
            design: Some(DesignClass::B),
            ..plate
        };
        let guess = sheet.guess().unwrap();
        let p = guess.parameters;
        assert!((p.leakage_ratio() / 0.67 - 1.0).abs() < 1e-9);
        let again = torques(p).1;
        assert!((again / breakdown - 1.0).abs() < 0.01, "{again} {breakdown}");
        // No deep bars: as much resistance locked as in use.
        let rise = guess.locked_rotor_resistance_ratio.unwrap();
        assert!((rise - 1.0).abs() < 0.1, "{rise}");
        let e = Nameplate { breakdown_torque_ratio: Some(5.9), ..sheet }.guess().unwrap_err();
        assert!(e.to_string().contains("breakdown_torque_ratio"), "{e}");
    }

    #[test]
    fn the_machines_of_kwon_cannot_carry_rated_torque() {
        for m in [machines::KWON_TABLE_IV, machines::KWON_PRINTED_MATRICES] {
            let machine = Machine::base(m.parameters(), m.pole_pairs).unwrap();
            let at_rated = Held::Load(m.rating.torque_nm);
            assert!(steady_state(&machine, m.rating.phase_voltage_peak_v, m.rating.electrical_frequency_hz, at_rated).is_err());
        }
    }

    #[test]
    fn impossible_nameplates_are_refused_by_quantity() {
        let good = nameplate_of(&machines::MOTULATOR_2_2_KW).0;
        for (bad, name) in [
            (Nameplate { power_w: 0.0, ..good }, "power_w"),
            (Nameplate { power_factor: 1.2, ..good }, "power_factor"),
            (Nameplate { speed_rpm: 4000.0, ..good }, "pole pairs"),
            (Nameplate { speed_rpm: 1100.0, ..good }, "slip"),
            (Nameplate { speed_rpm: 1500.0, ..good }, "slip"),
            (Nameplate { power_w: 4000.0, ..good }, "efficiency"),
            (Nameplate { line_current_rms_a: f64::NAN, ..good }, "line_current_rms_a"),
            (Nameplate { locked_rotor_current_ratio: Some(0.5), ..good }, "locked_rotor_current_ratio"),
            (
                Nameplate { locked_rotor_torque_ratio: Some(2.5), breakdown_torque_ratio: Some(2.4), ..good },
                "locked_rotor_torque_ratio",
            ),
        ] {
            let text = bad.guess().unwrap_err().to_string();
            assert!(text.starts_with(name), "{text}");
        }
    }
}
