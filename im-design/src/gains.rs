//! Gain sets for programs: a TOML table, or Rust constants to paste into firmware.

use crate::certificate::Design;
use crate::matrix::Matrix;
use crate::mtpa::Law;
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
        let mut text = format!("[{}]\n", self.kind);
        for gain in &self.gains {
            let value = match &gain.value {
                Value::Scalar(x) => literal(*x),
                Value::Range(x) => list(x),
                Value::List(x) => list(x),
                Value::Matrix(m) => nested(m),
            };
            // Writing to a String cannot fail.
            let _ = writeln!(text, "# {}\n{} = {value}", gain.meaning, gain.name);
        }
        text
    }

    /// Rust constants of the scalar type `f32` or `f64`, documented, in a module named after the design.
    pub fn to_rust(&self, scalar: &str) -> String {
        let mut text = format!("/// Gains made by `im design`.\npub mod {} {{\n", self.kind);
        for gain in &self.gains {
            let (kind, value) = match &gain.value {
                Value::Scalar(x) => (scalar.to_string(), literal(*x)),
                Value::Range(x) => (format!("[{scalar}; 2]"), list(x)),
                Value::List(x) => (format!("[{scalar}; {}]", x.len()), list(x)),
                Value::Matrix(m) => (format!("[[{scalar}; {}]; {}]", m.cols(), m.rows()), nested(m)),
            };
            let name = gain.name.to_uppercase();
            let _ = writeln!(text, "    /// {}\n    pub const {name}: {kind} = {value};", gain.meaning);
        }
        text.push_str("}\n");
        text
    }
}

/// Shortest text that reads back as the same float, in TOML and in Rust.
fn literal(x: f64) -> String {
    format!("{x:?}")
}

fn list(x: &[f64]) -> String {
    format!("[{}]", x.iter().map(|x| literal(*x)).collect::<Vec<_>>().join(", "))
}

fn nested(m: &Matrix<f64>) -> String {
    let row = |i: usize| list(&(0..m.cols()).map(|j| m[(i, j)]).collect::<Vec<_>>());
    format!("[{}]", (0..m.rows()).map(row).collect::<Vec<_>>().join(", "))
}

impl From<&Design> for GainSet {
    fn from(design: &Design) -> Self {
        use Value::{List, Matrix as M, Range, Scalar};
        match design {
            Design::Thau(d) => GainSet::new("thau")
                .with("lipschitz", "Lipschitz constant of u2 that is tolerated (SI units)", Scalar(d.lipschitz))
                .with("gain", "L, rows (omega, lambda_a, lambda_b, i_a, i_b), columns (i_a, i_b)", M(d.gain.clone())),
            Design::ThauBox(d) => GainSet::new("thau_box")
                .with("rate_per_s", "proven decay rate, 1/s", Scalar(d.rate_per_s))
                .with("frame_rad_per_s", "frame speeds covered, electrical rad/s", Range(d.region.frame_rad_per_s))
                .with("slip_rad_per_s", "slips covered, electrical rad/s", Range(d.region.slip_rad_per_s))
                .with("flux_d_wb", "d fluxes covered, Wb", Range(d.region.flux_d_wb))
                .with("flux_q_wb", "q fluxes covered, Wb", Range(d.region.flux_q_wb))
                .with("gain", "L0 in the frame of the estimated flux", M(d.gain.clone()))
                .with("gain_per_frame_speed", "L = L0 + frame speed (rad/s) L1", M(d.gain_per_frame_speed.clone())),
            Design::Kubota(d) => GainSet::new("kubota")
                .with("speed_rad_per_s", "mechanical speeds covered, rad/s", Range(d.speed_rad_per_s))
                .with("rate_per_s", "proven decay rate, 1/s", Scalar(d.rate_per_s))
                .with("gain", "L0, rows (lambda_a, lambda_b, i_a, i_b), columns (i_a, i_b)", M(d.gain.clone()))
                .with("gain_per_speed", "L = L0 + speed (rad/s) L1", M(d.gain_per_speed.clone())),
            Design::KubotaLoop(d) => GainSet::new("kubota_loop")
                .with("speed_rad_per_s", "mechanical speeds covered, rad/s", Range(d.speed_rad_per_s))
                .with("slip_rad_per_s", "slips covered, electrical rad/s", Range(d.slip_rad_per_s))
                .with("flux_wb", "rotor flux linkage amplitude, Wb", Scalar(d.flux_wb))
                .with("proportional", "K_P of the speed law", Scalar(d.gains.proportional))
                .with("integral", "K_I of the speed law", Scalar(d.gains.integral))
                .with("gain", "L0, rows (lambda_a, lambda_b, i_a, i_b), columns (i_a, i_b)", M(d.gains.gain.clone()))
                .with("gain_per_speed", "L = L0 + speed (rad/s) L1", M(d.gains.gain_per_speed.clone())),
            Design::Derdiyok(d) => GainSet::new("derdiyok")
                .with("speed_max_rad_per_s", "mechanical speed covered, rad/s", Scalar(d.speed_max_rad_per_s))
                .with("flux_max_wb", "rotor flux linkage covered, Wb", Scalar(d.flux_max_wb))
                .with("nu0", "switching gain, V", Scalar(d.nu0)),
            Design::Utkin(d) => GainSet::new("utkin")
                .with("speed_max_rad_per_s", "mechanical speed covered, rad/s", Scalar(d.speed_max_rad_per_s))
                .with("flux_min_wb", "estimated flux from this on, Wb", Scalar(d.flux_min_wb))
                .with("omega0_rad_per_s", "switching amplitude of the speed, mechanical rad/s", Scalar(d.omega0_rad_per_s)),
            Design::Kenne(d) => GainSet::new("kenne")
                .with("k_sq", "of (25), V", Scalar(d.k_sq))
                .with("k_sd", "of (26), V", Scalar(d.k_sd))
                .with("k_x", "K of (34), A/s^2", Scalar(d.k_x))
                .with("k_rr_per_s", "k_Rr over the nominal rotor resistance, 1/s", Scalar(d.k_rr_per_s))
                .with("c_omega", "of (17), 1/s", Scalar(d.region.c_omega))
                .with("c_lambda", "of (17), 1/s", Scalar(d.region.c_lambda)),
            Design::Jadot(d) => GainSet::new("jadot")
                .with("current_proportional_ohm", "K_P of (25), ohm", Scalar(d.current_proportional_ohm))
                .with("current_integral_per_s", "K_I of (25), 1/s", Scalar(d.current_integral_per_s))
                .with("speed_proportional", "k_p of (12)", Scalar(d.speed_proportional))
                .with("speed_integral_per_s", "k_i of (12), 1/s", Scalar(d.speed_integral_per_s))
                .with("lambda_h", "lambda of (22), H", Scalar(d.lambda_h))
                .with("adaptation_rate_per_s", "K_B = this/|B|^2 in (34), 1/s", Scalar(d.adaptation_rate_per_s))
                .with(
                    "adaptation_frequency_rad_per_s",
                    "K_W = this^2/|W|^2 in (47), rad/s",
                    Scalar(d.adaptation_frequency_rad_per_s),
                ),
            Design::Sampled(d) => GainSet::new("sampled")
                .with("speed_rad_per_s", "mechanical speeds covered, rad/s", Range(d.speed_rad_per_s))
                .with("period_s", "sampling period of forward Euler, s", Scalar(d.period_s))
                .with("contraction", "per sample, in the norm of P", Scalar(d.contraction))
                .with("gain", "L0, rows (lambda_a, lambda_b, i_a, i_b), columns (i_a, i_b)", M(d.gain.clone()))
                .with("gain_per_speed", "L = L0 + speed (rad/s) L1", M(d.gain_per_speed.clone())),
            Design::SampledBox(d) => GainSet::new("sampled_box")
                .with("period_s", "sampling period of forward Euler, s", Scalar(d.period_s))
                .with("contraction", "per sample, in the norm of P", Scalar(d.contraction))
                .with("frame_rad_per_s", "frame speeds covered, electrical rad/s", Range(d.region.frame_rad_per_s))
                .with("slip_rad_per_s", "slips covered, electrical rad/s", Range(d.region.slip_rad_per_s))
                .with("flux_d_wb", "d fluxes covered, Wb", Range(d.region.flux_d_wb))
                .with("flux_q_wb", "q fluxes covered, Wb", Range(d.region.flux_q_wb))
                .with("gain", "L0 in the frame of the estimated flux", M(d.gain.clone()))
                .with("gain_per_frame_speed", "L = L0 + frame speed (rad/s) L1", M(d.gain_per_frame_speed.clone())),
            Design::SampledThau(d) => GainSet::new("sampled_thau")
                .with("period_s", "sampling period of forward Euler, s", Scalar(d.period_s))
                .with("contraction", "per sample, in the norm of P", Scalar(d.contraction))
                .with("lipschitz", "Lipschitz constant of u2 that is tolerated (SI units)", Scalar(d.lipschitz))
                .with("gain", "L, rows (omega, lambda_a, lambda_b, i_a, i_b), columns (i_a, i_b)", M(d.gain.clone())),
            Design::SampledDerdiyok(d) => GainSet::new("sampled_derdiyok")
                .with("period_s", "sampling period of forward Euler, s", Scalar(d.period_s))
                .with("speed_max_rad_per_s", "mechanical speed covered, rad/s", Scalar(d.continuous.speed_max_rad_per_s))
                .with("flux_max_wb", "rotor flux linkage covered, Wb", Scalar(d.continuous.flux_max_wb))
                .with("nu0", "switching gain, V", Scalar(d.continuous.nu0))
                .with(
                    "boundary_layer_a",
                    "half width of the linear part of the switching function, A",
                    Scalar(d.boundary_layer_a),
                ),
            Design::Mtpa(d) => {
                let set = GainSet::new("mtpa").with("tolerance", "of current and slip against the optimum", Scalar(d.tolerance));
                match &d.law {
                    Law::Series { current, slip } => set
                        .with(
                            "torque_n_m",
                            "torques covered, N m; x = (2 ln T - ln lo - ln hi)/(ln hi - ln lo)",
                            Range(d.torque_n_m),
                        )
                        .with("current", "Chebyshev coefficients of ln I_s over x (rms A)", List(current.clone()))
                        .with("slip", "Chebyshev coefficients of ln omega_s over x (electrical rad/s)", List(slip.clone())),
                    Law::Kwon { a, b, c } => set
                        .with("torque_n_m", "torques covered, N m", Range(d.torque_n_m))
                        .with("a", "I_s = a1 T + a2 T^b1 + a3 T^b2, rms A", List(a.to_vec()))
                        .with("b", "exponents of the current law", List(b.to_vec()))
                        .with("c", "omega_s = c0 + c1 T + ... + c4 T^4, electrical rad/s", List(c.to_vec())),
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kubota::{KubotaRequest, closed_form};
    use crate::{Machine, Plant};

    #[test]
    fn toml_reads_back_and_rust_has_the_shape() {
        let request = KubotaRequest { speed_rad_per_s: [-100.0, 100.0], rate_per_s: 1.0, flux_weight: 1.0 };
        let (design, certificate) = closed_form(Plant::Machine(Machine::kwon_table_iv()), &request).unwrap();
        let set = GainSet::from(&certificate.design);
        let table: toml::Table = set.to_toml().parse().unwrap();
        let back = table["kubota"]["gain"][0][0].as_float().unwrap();
        assert_eq!(back, design.gain[(0, 0)]);
        let rust = set.to_rust("f32");
        assert!(rust.contains("pub const GAIN: [[f32; 2]; 4] = [["), "{rust}");
        assert!(rust.contains("pub const RATE_PER_S: f32 = 1.0;"));
    }
}
