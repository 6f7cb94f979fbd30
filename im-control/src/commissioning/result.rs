//! What a commissioning is made for, what it finds, and why it ends early.

use im_model::{Bound, ModelError, Rating, Scalar, TParameters};
use thiserror::Error;

use super::fit::{Fitted, Found, fit};

/// What is known before: the nameplate, and the inverter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CommissioningPlan {
    /// Rated torque, frequency and voltage; the rotor flux is that at which the drive is to work.
    pub rating: Rating,
    /// Rated current, peak, A: the largest dc current and the unit of the tests.
    pub rated_current_a: f64,
    /// n_p.
    pub pole_pairs: u32,
    /// No reference is beyond this, A; a measured current a third beyond it ends the commissioning.
    pub current_max_a: f64,
    /// From the beginning of a sample until its command acts, s.
    pub voltage_delay_s: f64,
    /// What the bridge's timer waits between two switches of a leg, s; zero where it does not, or is not known. What it takes of the voltage is found without it; the sampled current is
    /// that of the middle of a zero vector only but for half of it. Zero, too, where the sampling comes half a dead time later.
    pub dead_time_s: f64,
    /// The bridge's switching period, one edge up and one down of each leg, s; zero where it is not known. With it the dead-time curve is that of the ripple wherever the
    /// machine is, not that of standstill alone.
    pub switching_period_s: f64,
    /// Sampling time, s.
    pub sample_time_s: f64,
}

impl CommissioningPlan {
    /// For a rating, with a current limit of 1.2 times the rated one.
    pub fn of(rating: Rating, rated_current_a: f64, pole_pairs: u32, sample_time_s: f64) -> Self {
        let current_max_a = 1.2 * rated_current_a;
        let [voltage_delay_s, dead_time_s, switching_period_s] = [0.0; 3];
        Self {
            rating,
            rated_current_a,
            pole_pairs,
            current_max_a,
            voltage_delay_s,
            dead_time_s,
            switching_period_s,
            sample_time_s,
        }
    }

    /// The same behind a delay of the voltage.
    #[must_use]
    pub fn delayed(self, voltage_delay_s: f64) -> Self {
        Self { voltage_delay_s, ..self }
    }

    /// The same behind a bridge with a dead time.
    #[must_use]
    pub fn with_dead_time(self, dead_time_s: f64) -> Self {
        Self { dead_time_s, ..self }
    }

    /// The same behind a bridge with centred pulses and a switching period.
    #[must_use]
    pub fn switching_every(self, switching_period_s: f64) -> Self {
        Self { switching_period_s, ..self }
    }

    /// r of the current's ripple at a leakage inductance, A/V: `InverterNonlinearity::ripple_a_per_v`.
    pub(super) fn ripple_a_per_v(&self, leakage_inductance_h: f64) -> f64 {
        0.5 * self.switching_period_s / leakage_inductance_h
    }

    pub(super) fn validate(&self) -> Result<(), ModelError> {
        self.rating.validate()?;
        Bound::Within(1.0, 100.0).check("pole_pairs", f64::from(self.pole_pairs))?;
        Bound::OfMachines(1e-6, 1e6).check("rated_current_a", self.rated_current_a)?;
        Bound::Within(self.rated_current_a, 1e3 * self.rated_current_a)
            .check("current_max_a (at least the rated current)", self.current_max_a)?;
        Bound::OfMachines(1e-5, 1e-3).check("sample_time_s", self.sample_time_s)?;
        Bound::Within(0.0, self.sample_time_s).check("dead_time_s", self.dead_time_s)?;
        Bound::Within(0.0, 1e-2).check("switching_period_s", self.switching_period_s)?;
        Bound::Within(0.0, 6.0 * self.sample_time_s).check("voltage_delay_s", self.voltage_delay_s)
    }

    /// Z_N = U_N/I_N, Ω.
    pub(super) fn impedance_ohm(&self) -> f64 {
        self.rating.phase_voltage_peak_v / self.rated_current_a
    }

    /// ω_N, electrical, rad/s.
    pub(super) fn omega_rad_s(&self) -> f64 {
        core::f64::consts::TAU * self.rating.electrical_frequency_hz
    }
}

/// Why a commissioning ended without a result. The bridge is then at zero current, or has faded out.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum CommissioningFault {
    /// There is current without voltage.
    #[error(
        "a current flows without voltage: the shaft turns with flux, or the offset of a current sensor is a tenth of the rated current or more"
    )]
    NotAtRest,
    /// Voltage pulses give no current.
    #[error("voltage pulses give no current: no machine is connected, or the current is not measured")]
    NoCurrent,
    /// Voltage pulses along the three phases are answered differently.
    #[error("the three phases answer voltage pulses differently: a phase is open, or a current sensor is dead")]
    PhasesDiffer,
    /// The current does not follow its regulator.
    #[error("the current does not follow its regulator: a current sensor has failed, or a phase has opened")]
    CurrentNotFollowed,
    /// A dc current is not reached.
    #[error("a direct current is not reached: the voltage of the link is too low, or a phase has opened")]
    CurrentNotReached,
    /// More than ten samples in a row were no numbers.
    #[error("the measurement was lost for more than ten samples")]
    MeasurementLost,
    /// The current went beyond its limit.
    #[error("the current went a third beyond its limit")]
    Overcurrent,
    /// The shaft does not accelerate.
    #[error("the shaft does not accelerate under torque: it is locked, or braked")]
    DoesNotTurn,
    /// The drive lost the machine while it turned.
    #[error("the drive lost the speed of the machine")]
    DriveLost,
    /// What was measured at standstill is no induction machine's impedance.
    #[error("what was measured at standstill does not determine resistances and inductances")]
    NoImpedance,
    /// Inertia and friction do not follow from the speed under torque.
    #[error("inertia and magnetizing inductance do not follow from the machine that turns: a varying load, or a locked shaft")]
    NoMechanics,
    /// Longer than two minutes.
    #[error("it takes longer than two minutes")]
    TooLong,
}

/// A point of the magnetizing curve.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MagnetizingPoint {
    /// ψ_m, peak, Vs.
    pub flux_vs: f64,
    /// i_m, peak, A.
    pub current_a: f64,
}

/// Flux levels of the no-load run.
pub const NO_LOAD_LEVELS: usize = 6;

/// How well points of the curve lie on a law, relative.
pub(super) const ON_LAW: f64 = 3e-3;

/// The laws i_m = ψ/L and i_m = ψ/L (1 + k(ψ/ψ_N)^S) through the points, ψ_N the flux of the plan; L is looked for from `start`, H.
pub(super) fn magnetizing_laws(
    points: &[MagnetizingPoint; NO_LOAD_LEVELS],
    flux_vs: f64,
    start: f64,
) -> (Option<Fitted<1>>, Option<Fitted<3>>) {
    let off = |l: f64, k: f64, s: f64, row: usize| {
        points.get(row).map_or(0.0, |p| {
            let bent = 1.0 + k * Scalar::powf(p.flux_vs / flux_vs, s);
            (p.flux_vs / l * bent / p.current_a - 1.0) / ON_LAW
        })
    };
    let straight = fit([start], NO_LOAD_LEVELS, |[l], row| off(*l, 0.0, 1.0, row));
    (straight, fit([start, 0.1, 6.0], NO_LOAD_LEVELS, |[l, k, s], row| off(*l, *k, *s, row)))
}

/// The machine as found: a T circuit referred so that L_ls = L_lr. Nothing at the terminals tells the division of the leakage, or another turns ratio; what is seen
/// whatever the division are the inverse-Γ values ([`inverse_gamma`](Self::inverse_gamma)).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Commissioned {
    /// R_s, Ω, at the temperature of the test.
    pub stator_resistance_ohm: Found,
    /// R_r at low slip frequency, Ω.
    pub rotor_resistance_ohm: Found,
    /// L_ls = L_lr, H.
    pub leakage_inductance_h: Found,
    /// L_m = ψ_m/i_m at the flux of the plan, H.
    pub magnetizing_inductance_h: Found,
    /// The magnetizing curve at no load.
    pub magnetizing: [MagnetizingPoint; NO_LOAD_LEVELS],
    /// J, kg m².
    pub inertia_kg_m2: Found,
    /// Friction in proportion to speed, Nm s/rad.
    pub viscous_friction_nm_s_per_rad: Found,
    /// Friction whatever the speed, Nm.
    pub coulomb_friction_nm: Found,
    /// k of the windage k ω², Nm s²; zero where it is not told from friction, with what it may be.
    pub windage_nm_s2: Found,
    /// Voltage that dead time and devices take per phase at large current, V.
    pub inverter_voltage_v: Found,
    /// Phase current at which 71 % of it is taken, A.
    pub inverter_current_a: Found,
    /// Relative rise of R_r at high slip frequency, and the diffusion time of the bars, s; where seen.
    pub skin_effect: Option<[Found; 2]>,
    /// Conductance of the iron loss across the magnetizing branch, S.
    pub iron_conductance_s: Found,
    /// What the current sensors show of no current, α and β, A.
    pub current_offset_a: [Found; 2],
    /// What reaches the terminals beside what is commanded, u = u* + u_0, where it is seen: u_0, α and β, V.
    pub voltage_offset_v: [Found; 2],
    /// What the resistance differs by with the direction of the current, u = R_s i + N ī: N, α and β, Ω. Standstill does not tell whether winding, leads, the voltage or
    /// the current sensor of a phase is the cause.
    pub resistance_asymmetry_ohm: [Found; 2],
    /// Voltage of the dc link, V.
    pub dc_voltage_v: f64,
    /// How long the drive took, s.
    pub drive_time_s: f64,
}

impl Commissioned {
    /// The T circuit at the flux of the plan.
    pub fn parameters(&self) -> TParameters<f64> {
        TParameters {
            stator_resistance_ohm: self.stator_resistance_ohm.value,
            rotor_resistance_ohm: self.rotor_resistance_ohm.value,
            stator_leakage_inductance_h: self.leakage_inductance_h.value,
            rotor_leakage_inductance_h: self.leakage_inductance_h.value,
            magnetizing_inductance_h: self.magnetizing_inductance_h.value,
            inertia_kg_m2: self.inertia_kg_m2.value,
            viscous_friction_nm_s_per_rad: self.viscous_friction_nm_s_per_rad.value.max(0.0),
        }
    }

    /// The T circuit at another flux, Vs: L_m by the magnetizing curve.
    pub(super) fn parameters_at(&self, flux_vs: f64) -> TParameters<f64> {
        let p = self.parameters();
        let (straight, bent) = magnetizing_laws(&self.magnetizing, flux_vs, p.magnetizing_inductance_h);
        let magnetizing_inductance_h = match (straight, bent) {
            (Some(s), Some(b)) if b.cost < s.cost => b.parameters[0].value / (1.0 + b.parameters[1].value),
            (Some(s), _) => s.parameters[0].value,
            _ => p.magnetizing_inductance_h,
        };
        TParameters { magnetizing_inductance_h, ..p }
    }

    /// What the stator resistance differs by with the direction of the current, over itself, where that is seen and is one per cent or more.
    pub fn unlike_phases(&self) -> Option<f64> {
        let [alpha, beta] = self.resistance_asymmetry_ohm.map(|f| f.value);
        let share = Scalar::sqrt(alpha * alpha + beta * beta) / self.stator_resistance_ohm.value;
        (share > 0.01 && self.resistance_asymmetry_ohm.iter().any(Found::is_seen)).then_some(share)
    }

    /// R_R, L_σ, L_M, with their intervals.
    pub fn inverse_gamma(&self) -> [Found; 3] {
        let g = self.parameters().inverse_gamma();
        [
            Found::relative(g.rotor_resistance_ohm, self.rotor_resistance_ohm.tolerance()),
            Found::relative(g.leakage_inductance_h, self.leakage_inductance_h.tolerance()),
            Found::relative(g.magnetizing_inductance_h, self.magnetizing_inductance_h.tolerance()),
        ]
    }
}
