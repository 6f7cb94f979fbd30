//! What region files hold, design by design.

use crate::error::DesignError;
use crate::kenne::KenneRegion;
use crate::sliding::UtkinRegion;
use crate::thau_box::BoxRegion;
use im_model::FileKind;
use im_model::toml_text::TomlText;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::collections::BTreeMap;
use toml::Spanned;

/// Reads a region file's text.
///
/// # Errors
/// [`DesignError::Region`] with the line and what was expected there.
pub(super) fn read<T: DeserializeOwned>(region: &str) -> Result<T, DesignError> {
    let toml = TomlText::new(region, "region file", &[]).of_kind(FileKind::Region);
    pairs(region, &toml)?;
    sizes(&toml)?;
    toml.read().map_err(DesignError::Region)
}

/// The largest number that a region of operation has in SI units.
const LARGEST: f64 = 1e12;

/// Every number is one, also of a key that this design does not need.
fn sizes(toml: &TomlText<'_>) -> Result<(), DesignError> {
    fn is_one(value: &toml::Value) -> bool {
        match value {
            toml::Value::Float(x) => x.abs() <= LARGEST,
            toml::Value::Array(items) => items.iter().all(is_one),
            toml::Value::Table(table) => table.values().all(is_one),
            _ => true,
        }
    }
    // What does not read is refused with its place by the reader of the design.
    let values = toml.read::<BTreeMap<String, Spanned<toml::Value>>>().unwrap_or_default();
    values.values().find(|value| !is_one(value.get_ref())).map_or(Ok(()), |value| {
        let expected = format!("numbers of a size up to {LARGEST:e}");
        Err(DesignError::Region(toml.unexpected(value.span(), None, expected)))
    })
}

/// Every list at the top of a region file is a range, of which the reader would take the first two numbers without a word.
fn pairs(region: &str, toml: &TomlText<'_>) -> Result<(), DesignError> {
    let Ok(table) = toml::de::DeTable::parse(region) else { return Ok(()) };
    let long = |(_, value): &(_, &toml::Spanned<toml::de::DeValue<'_>>)| value.get_ref().as_array().is_some_and(|a| a.len() > 2);
    table.get_ref().iter().find(long).map_or(Ok(()), |(_, value)| {
        Err(DesignError::Region(toml.unexpected(value.span(), None, "a range: two numbers, [lower, upper]")))
    })
}

/// A key that only a sampled proof needs.
///
/// # Errors
/// [`DesignError::Region`] that names it when it is missing.
pub(super) fn needed<T>(key: &str, value: Option<T>) -> Result<T, DesignError> {
    let what = format!("{key} is missing: a proof for a sampling period needs it");
    value.ok_or_else(|| DesignError::region(what))
}

/// A key that a sampled proof has no use for.
///
/// # Errors
/// [`DesignError::Region`] that names it when it is given.
pub(super) fn unused<T>(key: &str, value: Option<T>) -> Result<(), DesignError> {
    let what = format!("{key} has no part in a proof for a sampling period, which finds its own norm: leave it out");
    value.map_or(Ok(()), |_| Err(DesignError::region(what)))
}

/// Region of `thau`.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ThauRequest {
    /// How far below the largest κ the proven one stays, relative; 0.001 when not given.
    #[serde(default = "thousandth")]
    pub slack: f64,
}

fn thousandth() -> f64 {
    1e-3
}

/// Region of `thau-box`.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoxRequest {
    /// Speed of the frame, electrical rad/s.
    pub frame_rad_s: [f64; 2],
    /// Slip, electrical rad/s.
    pub slip_rad_s: [f64; 2],
    /// Flux along d, Wb.
    pub flux_d_vs: [f64; 2],
    /// Flux along q, Wb.
    pub flux_q_vs: [f64; 2],
    /// Measured current along d, A; zero when not given: the torque is not modelled.
    #[serde(default)]
    pub current_d_a: [f64; 2],
    /// Measured current along q, A; zero when not given.
    #[serde(default)]
    pub current_q_a: [f64; 2],
    /// Wanted rate, 1/s; the fastest when not given.
    pub rate_per_s: Option<f64>,
    /// Limit of the gain in scaled states, 1/s; 10⁴ when not given. For a sampling period the period limits the gain.
    #[serde(default = "ten_thousand")]
    pub gain_limit_per_s: f64,
}

impl BoxRequest {
    /// The box alone.
    pub(super) fn region(&self) -> BoxRegion {
        BoxRegion {
            frame_rad_s: self.frame_rad_s,
            slip_rad_s: self.slip_rad_s,
            flux_d_vs: self.flux_d_vs,
            flux_q_vs: self.flux_q_vs,
            current_d_a: self.current_d_a,
            current_q_a: self.current_q_a,
        }
    }
}

fn ten_thousand() -> f64 {
    1e4
}

/// Region of `kubota`.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KubotaFile {
    /// Mechanical speeds, rad/s.
    pub speed_rad_s: [f64; 2],
    /// Wanted rate, 1/s, below η.
    pub rate_per_s: f64,
    /// w of P = diag(w, w, 1, 1); β² when not given; 1 is the paper's (3).
    pub flux_weight: Option<f64>,
}

/// Region of `kubota-loop`.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoopRequest {
    /// Mechanical speeds, rad/s.
    pub speed_rad_s: [f64; 2],
    /// Slips, electrical rad/s.
    pub slip_rad_s: [f64; 2],
    /// Rotor flux linkage amplitude, Wb.
    pub flux_vs: f64,
    /// K_P of the speed law.
    pub proportional: f64,
    /// K_I of the speed law.
    pub integral: f64,
    /// ρ of the mending gain; 1 when not given.
    #[serde(default = "one")]
    pub rho: f64,
    /// l₂ of the mending gain, 1/s; 0 when not given.
    #[serde(default)]
    pub l2_per_s: f64,
    /// How often cells may be halved; 6 when not given.
    #[serde(default = "six")]
    pub depth: u32,
    /// Wanted rate for a sampling period, 1/s; 0.1 when not given: any decay.
    #[serde(default = "tenth")]
    pub rate_per_s: f64,
}

fn tenth() -> f64 {
    0.1
}

fn one() -> f64 {
    1.0
}

fn six() -> u32 {
    6
}

/// Region of `derdiyok`.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DerdiyokRequest {
    /// |ω| up to this mechanical speed, rad/s.
    pub speed_max_rad_s: f64,
    /// |λ| up to this, Wb.
    pub flux_max_vs: f64,
    /// What ν₀ has to spare, V.
    pub reserve: f64,
    /// φ, A, for a sampling period; the smallest when not given.
    pub boundary_layer_a: Option<f64>,
}

/// Region of `utkin`; see [`crate::sliding::UtkinRegion`].
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UtkinRequest {
    /// |ω| up to this mechanical speed, rad/s.
    pub speed_max_rad_s: f64,
    /// |λ̂| from this on, Wb.
    pub flux_min_vs: f64,
    /// |λ − λ̂| up to this, Wb.
    pub flux_error_max_vs: f64,
    /// |î − i| up to this, A.
    pub current_error_max_a: f64,
    /// |i| up to this, A.
    pub current_max_a: f64,
    /// |λ̂| up to this, Wb; for a sampling period.
    pub flux_max_vs: Option<f64>,
    /// |u_s| up to this, V; for a sampling period.
    pub voltage_max_v: Option<f64>,
    /// φ, A Wb, for a sampling period; the smallest when not given.
    pub boundary_layer_avs: Option<f64>,
}

impl UtkinRequest {
    /// The region alone.
    pub(super) fn region(&self) -> UtkinRegion {
        UtkinRegion {
            speed_max_rad_s: self.speed_max_rad_s,
            flux_min_vs: self.flux_min_vs,
            flux_error_max_vs: self.flux_error_max_vs,
            current_error_max_a: self.current_error_max_a,
            current_max_a: self.current_max_a,
        }
    }
}

/// Region of `kenne`, and the boundary layers [boundary_omega (rad/s²), boundary_lambda (Wb²/s)] for a sampling period, where given.
pub(super) fn kenne(region: &str) -> Result<(KenneRegion, Option<[f64; 2]>), DesignError> {
    #[derive(Deserialize)]
    struct Layers {
        boundary_omega: Option<f64>,
        boundary_lambda: Option<f64>,
    }
    let Layers { boundary_omega, boundary_lambda } = read(region)?;
    let layers = match (boundary_omega, boundary_lambda) {
        (Some(omega), Some(lambda)) => Some([omega, lambda]),
        (None, None) => None,
        _ => {
            let what = "boundary_omega and boundary_lambda belong together: give both, or neither for the smallest";
            return Err(DesignError::region(what));
        }
    };
    // The region's own keys alone, each in its line.
    let own = |line: &str| if line.trim_start().starts_with("boundary_") { String::new() } else { line.to_owned() };
    let rest: Vec<String> = region.lines().map(own).collect();
    Ok((read(&rest.join("\n"))?, layers))
}

/// Region of `sampled`.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SampledRequest {
    /// Mechanical speeds, rad/s.
    pub speed_rad_s: [f64; 2],
    /// Sampling period, s.
    pub period_s: f64,
    /// Wanted rate, 1/s.
    pub rate_per_s: f64,
}
