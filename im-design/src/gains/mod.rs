//! Gain sets for programs: a TOML table, or Rust source for firmware.

mod rounded;
mod rust;

pub use rust::{Precision, Provenance};

use crate::certificate::Design;
use crate::jadot::JadotDesign;
use crate::kenne::{KenneDesign, KenneRegion};
use crate::kubota_loop::LoopGains;
use crate::matrix::Matrix;
use crate::mtpa::Law;
use crate::sliding::{DerdiyokDesign, UtkinDesign};
use crate::thau_box::BoxRegion;
use std::fmt::Write;

/// One value of a gain set.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A number.
    Scalar(f64),
    /// A lower and an upper bound.
    Range([f64; 2]),
    /// A matrix, row by row.
    Matrix(Matrix<f64>),
    /// A list of numbers.
    List(Vec<f64>),
}

/// A named value with what it means.
#[derive(Clone, Debug, PartialEq)]
pub struct Gain {
    /// Field name, lower case.
    pub name: String,
    /// Meaning and unit.
    pub meaning: String,
    /// The value.
    pub value: Value,
}

/// The gains of one design, without its proof.
#[derive(Clone, Debug, PartialEq)]
pub struct GainSet {
    /// Name of the design, lower case with underscores.
    pub kind: String,
    /// The gains.
    pub gains: Vec<Gain>,
}

impl GainSet {
    /// An empty set.
    pub fn new(kind: &str) -> Self {
        GainSet { kind: kind.into(), gains: Vec::new() }
    }

    /// Add one gain.
    #[must_use]
    pub fn with(mut self, name: &str, meaning: &str, value: Value) -> Self {
        self.gains.push(Gain { name: name.into(), meaning: meaning.into(), value });
        self
    }

    /// A TOML table named after the design.
    pub fn to_toml(&self) -> String {
        let list = |x: &[f64]| listed(x, literal);
        let mut text = format!("[{}]\n", self.kind);
        for gain in &self.gains {
            let value = match &gain.value {
                Value::Scalar(x) => literal(*x),
                Value::Range(x) => list(x),
                Value::List(x) => list(x),
                Value::Matrix(m) => nested(m, literal),
            };
            // Writing to a String cannot fail.
            let _ = writeln!(text, "# {}\n{} = {value}", gain.meaning, gain.name);
        }
        text
    }
}

/// Shortest text that reads back as the same float, in TOML and in Rust.
fn literal(x: f64) -> String {
    format!("{x:?}")
}

fn listed(x: &[f64], literal: impl Fn(f64) -> String) -> String {
    format!("[{}]", x.iter().map(|x| literal(*x)).collect::<Vec<_>>().join(", "))
}

fn nested(m: &Matrix<f64>, literal: impl Fn(f64) -> String + Copy) -> String {
    let row = |i: usize| listed(&(0..m.cols()).map(|j| m[(i, j)]).collect::<Vec<_>>(), literal);
    format!("[{}]", (0..m.rows()).map(row).collect::<Vec<_>>().join(", "))
}

impl From<&Design> for GainSet {
    fn from(design: &Design) -> Self {
        let of = GainSet::new;
        match design {
            Design::Thau(d) => of("thau").thau(d.lipschitz, &d.gain),
            Design::SampledThau(d) => of("sampled_thau").contracting(d.period_s, d.contraction).thau(d.lipschitz, &d.gain),
            Design::ThauBox(d) => of("thau_box").rate(d.rate_per_s).boxed(&d.region, &d.gain, &d.gain_per_frame_speed),
            Design::SampledThauBox(d) => {
                of("sampled_thau_box").contracting(d.period_s, d.contraction).boxed(&d.region, &d.gain, &d.gain_per_frame_speed)
            }
            Design::Kubota(d) => of("kubota").speeds(d.speed_rad_s).rate(d.rate_per_s).scheduled(&d.gain, &d.gain_per_speed),
            Design::Sampled(d) => {
                let set = of("sampled").speeds(d.speed_rad_s).contracting(d.period_s, d.contraction);
                set.scheduled(&d.gain, &d.gain_per_speed)
            }
            Design::KubotaLoop(d) => {
                let set = of("kubota_loop").rate(least(d.cells.iter().map(|cell| cell.rate_per_s)));
                set.adaptive(d.speed_rad_s, d.slip_rad_s, d.flux_vs, &d.gains)
            }
            Design::SampledKubotaLoop(d) => {
                let worst = -least(d.cells.iter().map(|cell| -cell.contraction));
                let set = of("sampled_kubota_loop").contracting(d.period_s, worst);
                set.adaptive(d.speed_rad_s, d.slip_rad_s, d.flux_vs, &d.gains)
            }
            Design::Derdiyok(d) => of("derdiyok").derdiyok(d),
            Design::SampledDerdiyok(d) => of("sampled_derdiyok").period(d.period_s).derdiyok(&d.continuous).scalar(
                "boundary_layer_a",
                "half width of the linear part of the switching function, A",
                d.boundary_layer_a,
            ),
            Design::Utkin(d) => of("utkin").utkin(d),
            Design::SampledUtkin(d) => of("sampled_utkin")
                .period(d.period_s)
                .utkin(&d.continuous)
                .scalar("flux_max_vs", "estimated flux up to this, Wb", d.flux_max_vs)
                .scalar("voltage_max_v", "stator voltage covered, V", d.voltage_max_v)
                .scalar(
                    "boundary_layer_avs",
                    "half width of the linear part of the switching function, A Wb",
                    d.boundary_layer_avs,
                ),
            Design::Kenne(d) => of("kenne").kenne(d),
            Design::SampledKenne(d) => of("sampled_kenne")
                .period(d.period_s)
                .kenne(&d.continuous)
                .scalar("boundary_omega", "half width of the layer of sign(s_omega), rad/s^2", d.boundary_omega)
                .scalar("boundary_lambda", "half width of the layer of sign(s_lambda), Wb^2/s", d.boundary_lambda),
            Design::Jadot(d) => of("jadot").jadot(d, [d.electrical_rate_per_s, d.outer_rate_per_s]),
            Design::SampledJadot(d) => {
                let electrical = least(d.electrical.iter().map(|cell| cell.proof.rate_per_s));
                of("sampled_jadot").period(d.period_s).jadot(&d.continuous, [electrical, d.outer.rate_per_s])
            }
            Design::Mtpa(d) => {
                let set = of("mtpa").scalar("tolerance", "of current and slip against the optimum", d.tolerance);
                set.laws(d.torque_n_m, &d.law)
            }
        }
    }
}

/// The least of what the cells of a proof claim.
fn least(of_cells: impl Iterator<Item = f64>) -> f64 {
    of_cells.fold(f64::INFINITY, f64::min)
}

/// The parts that sets are made of; a sampled set is the continuous one with its period.
impl GainSet {
    fn scalar(self, name: &str, meaning: &str, value: f64) -> Self {
        self.with(name, meaning, Value::Scalar(value))
    }

    fn range(self, name: &str, meaning: &str, value: [f64; 2]) -> Self {
        self.with(name, meaning, Value::Range(value))
    }

    fn matrix(self, name: &str, meaning: &str, value: &Matrix<f64>) -> Self {
        self.with(name, meaning, Value::Matrix(value.clone()))
    }

    fn rate(self, rate_per_s: f64) -> Self {
        self.scalar("rate_per_s", "proven decay rate, 1/s", rate_per_s)
    }

    fn period(self, period_s: f64) -> Self {
        self.scalar("period_s", "sampling period, s", period_s)
    }

    fn contracting(self, period_s: f64, contraction: f64) -> Self {
        let rate = -contraction.ln() / period_s;
        let meaning = format!("per sample of forward Euler, in the norm of P: {rate:.4} 1/s");
        self.period(period_s).scalar("contraction", &meaning, contraction)
    }

    fn speeds(self, speed_rad_s: [f64; 2]) -> Self {
        self.range("speed_rad_s", "mechanical speeds covered, rad/s", speed_rad_s)
    }

    fn thau(self, lipschitz: f64, gain: &Matrix<f64>) -> Self {
        self.scalar("lipschitz", "Lipschitz constant of u2 that is tolerated (SI units)", lipschitz).matrix(
            "gain",
            "L, rows (omega, lambda_a, lambda_b, i_a, i_b), columns (i_a, i_b)",
            gain,
        )
    }

    fn boxed(self, region: &BoxRegion, gain: &Matrix<f64>, slope: &Matrix<f64>) -> Self {
        self.range("frame_rad_s", "frame speeds covered, electrical rad/s", region.frame_rad_s)
            .range("slip_rad_s", "slips covered, electrical rad/s", region.slip_rad_s)
            .range("flux_d_vs", "d fluxes covered, Wb", region.flux_d_vs)
            .range("flux_q_vs", "q fluxes covered, Wb", region.flux_q_vs)
            .range("current_d_a", "measured d currents covered, A; zero where the torque is not modelled", region.current_d_a)
            .range("current_q_a", "measured q currents covered, A; zero where the torque is not modelled", region.current_q_a)
            .matrix("gain", "L0 in the frame of the estimated flux", gain)
            .matrix("gain_per_frame_speed", "L = L0 + frame speed (rad/s) L1", slope)
    }

    fn scheduled(self, gain: &Matrix<f64>, slope: &Matrix<f64>) -> Self {
        self.matrix("gain", "L0, rows (lambda_a, lambda_b, i_a, i_b), columns (i_a, i_b)", gain).matrix(
            "gain_per_speed",
            "L = L0 + speed (rad/s) L1",
            slope,
        )
    }

    fn adaptive(self, speed: [f64; 2], slip: [f64; 2], flux_vs: f64, gains: &LoopGains) -> Self {
        self.speeds(speed)
            .range("slip_rad_s", "slips covered, electrical rad/s", slip)
            .scalar("flux_vs", "rotor flux linkage amplitude, Wb", flux_vs)
            .scalar("proportional", "K_P of the speed law", gains.proportional)
            .scalar("integral", "K_I of the speed law", gains.integral)
            .scheduled(&gains.gain, &gains.gain_per_speed)
    }

    fn derdiyok(self, d: &DerdiyokDesign) -> Self {
        self.scalar("speed_max_rad_s", "mechanical speed covered, rad/s", d.speed_max_rad_s)
            .scalar("flux_max_vs", "rotor flux linkage covered, Wb", d.flux_max_vs)
            .scalar("nu0", "switching gain, V", d.nu0)
            .scalar("reserve", "nu0 less its bound, V: sliding begins within the current error over beta times this", d.reserve)
    }

    fn utkin(self, d: &UtkinDesign) -> Self {
        self.scalar("speed_max_rad_s", "mechanical speed covered, rad/s", d.region.speed_max_rad_s)
            .scalar("flux_min_vs", "estimated flux from this on, Wb", d.region.flux_min_vs)
            .scalar("flux_error_max_vs", "error of the flux covered, Wb", d.region.flux_error_max_vs)
            .scalar("current_error_max_a", "error of the current covered, A", d.region.current_error_max_a)
            .scalar("current_max_a", "stator current covered, A", d.region.current_max_a)
            .scalar("omega0_rad_s", "switching amplitude of the speed, mechanical rad/s", d.omega0_rad_s)
    }

    fn kenne(self, d: &KenneDesign) -> Self {
        self.scalar("k_sq", "of (25), V", d.k_sq)
            .scalar("k_sd", "of (26), V", d.k_sd)
            .scalar("k_x", "K of (34), A/s^2", d.k_x)
            .scalar("k_rr_per_s", "k_Rr over the nominal rotor resistance, 1/s", d.k_rr_per_s)
            .within(&d.region)
    }

    fn within(self, r: &KenneRegion) -> Self {
        self.scalar("c_omega", "of (17), decay of the speed error on its surface, 1/s", r.c_omega)
            .scalar("c_lambda", "of (17), decay of the flux error on its surface, 1/s", r.c_lambda)
            .scalar("reach_omega", "of (24): s_omega falls by this, rad/s^3", r.reach_omega)
            .scalar("reach_lambda", "of (24): s_lambda falls by this, Wb^2/s^2", r.reach_lambda)
            .scalar("speed_max_rad_s", "mechanical speed covered, rad/s", r.speed_max_rad_s)
            .range("flux_vs", "rotor flux linkages covered, Wb", r.flux_vs)
            .scalar("flux_uncertainty", "relative error of the estimated flux covered", r.flux_uncertainty)
            .scalar("current_max_a", "stator current covered, A", r.current_max_a)
            .scalar("voltage_max_v", "stator voltage covered, V", r.voltage_max_v)
            .range("stator_resistance_ratio", "stator resistance over nominal covered", r.stator_resistance_ratio)
            .range("rotor_resistance_ratio", "rotor resistance over nominal covered", r.rotor_resistance_ratio)
            .scalar("rotor_resistance_rate_per_s", "its change over nominal covered, 1/s", r.rotor_resistance_rate_per_s)
            .scalar("acceleration_max_rad_s2", "acceleration covered, rad/s^2", r.acceleration_max_rad_s2)
            .scalar(
                "reference_max_rad_s3",
                "reference's second derivative and c_omega times its first, rad/s^3",
                r.reference_max_rad_s3,
            )
            .scalar("load_error_rad_s2", "error of the load torque over the inertia, rad/s^2", r.load_error_rad_s2)
            .scalar("load_rate_rad_s3", "change of the load torque over the inertia, rad/s^3", r.load_rate_rad_s3)
    }

    fn jadot(self, d: &JadotDesign, [electrical, outer]: [f64; 2]) -> Self {
        self.range("electrical_speed_rad_s", "electrical rotor speeds covered, rad/s", d.electrical_speed_rad_s)
            .range("slip_rad_s", "slips covered, electrical rad/s", d.slip_rad_s)
            .scalar("flux_vs", "flux set point (L_m/L_r) psi_r, Wb", d.flux_vs)
            .scalar("electrical_rate_per_s", "proven decay rate of the electrical errors, 1/s", electrical)
            .scalar("outer_rate_per_s", "proven decay rate of the loop of speed and flux, 1/s", outer)
            .scalar("current_proportional_ohm", "K_P of (25), ohm", d.current_proportional_ohm)
            .scalar("current_integral_per_s", "K_I of (25), 1/s", d.current_integral_per_s)
            .scalar("speed_proportional", "k_p of (12)", d.speed_proportional)
            .scalar("speed_integral_per_s", "k_i of (12), 1/s", d.speed_integral_per_s)
            .scalar("lambda_h", "lambda of (22), H", d.lambda_h)
            .scalar("adaptation_rate_per_s", "K_B = this/|B|^2 in (34), 1/s", d.adaptation_rate_per_s)
            .scalar("adaptation_frequency_rad_s", "K_W = this^2/|W|^2 in (47), rad/s", d.adaptation_frequency_rad_s)
    }

    fn laws(self, torque_n_m: [f64; 2], law: &Law) -> Self {
        use Value::List;
        match law {
            Law::Series { current, slip } => self
                .range("torque_n_m", "torques covered, N m; x = (2 ln T - ln lo - ln hi)/(ln hi - ln lo)", torque_n_m)
                .with("current", "Chebyshev coefficients of ln I_s over x (rms A)", List(current.clone()))
                .with("slip", "Chebyshev coefficients of ln omega_s over x (electrical rad/s)", List(slip.clone())),
            Law::Kwon { a, b, c } => self
                .range("torque_n_m", "torques covered, N m", torque_n_m)
                .with("a", "I_s = a1 T + a2 T^b1 + a3 T^b2, rms A", List(a.to_vec()))
                .with("b", "exponents of the current law", List(b.to_vec()))
                .with("c", "omega_s = c0 + c1 T + ... + c4 T^4, electrical rad/s", List(c.to_vec())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kubota::{KubotaRequest, closed_form};
    use crate::{DesignModel, LinearMachine};

    #[test]
    fn toml_reads_back() {
        let request = KubotaRequest { speed_rad_s: [-100.0, 100.0], rate_per_s: 1.0, flux_weight: 1.0 };
        let (design, certificate) = closed_form(DesignModel::Machine(LinearMachine::kwon_table_iv()), &request).unwrap();
        let set = GainSet::from(&certificate.design);
        let table: toml::Table = set.to_toml().parse().unwrap();
        let back = table["kubota"]["gain"][0][0].as_float().unwrap();
        assert_eq!(back, design.gain[(0, 0)]);
    }
}
