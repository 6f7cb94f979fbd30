//! Designs asked for by name and a region file: what a command line needs.
//!
//! ```
//! use im_design::{Machine, Plant, request::{Kind, design}};
//! let region = "speed_rad_per_s = [-190.0, 190.0]\nrate_per_s = 0.8\n";
//! let certificate = design("kubota".parse().unwrap(), Plant::Machine(Machine::kwon_table_iv()), region).unwrap();
//! certificate.check().unwrap();
//! assert_eq!(Kind::ALL.len(), 9);
//! ```

use crate::certificate::{Certificate, Plant};
use crate::error::DesignError;
use crate::sliding::UtkinDesign;
use crate::{jadot, kenne, kubota, kubota_loop, sampled, sliding, thau, thau_box};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use std::str::FromStr;

/// The designs, by the names of the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// `thau`: [`thau::maximize`]; region: `slack` (optional, default 0.001).
    Thau,
    /// `thau-box`: [`thau_box::design`], or [`thau_box::fastest`] without `rate_per_s`; region: [`BoxRequest`].
    ThauBox,
    /// `kubota`: [`kubota::least_norm`]; region: [`KubotaFile`].
    Kubota,
    /// `kubota-loop`: [`kubota_loop::mended`] and [`kubota_loop::certify`]; region: [`LoopRequest`].
    KubotaLoop,
    /// `derdiyok`: [`sliding::derdiyok`]; region: [`DerdiyokRequest`].
    Derdiyok,
    /// `utkin`: [`sliding::utkin`]; region: [`UtkinRequest`].
    Utkin,
    /// `kenne`: [`kenne::design`]; region: [`kenne::KenneRegion`].
    Kenne,
    /// `jadot`: [`jadot::design`]; region: [`jadot::JadotRequest`].
    Jadot,
    /// `sampled`: [`sampled::design`]; region: [`SampledRequest`].
    Sampled,
}

impl Kind {
    /// All, with their names.
    pub const ALL: [(Kind, &'static str); 9] = [
        (Kind::Thau, "thau"),
        (Kind::ThauBox, "thau-box"),
        (Kind::Kubota, "kubota"),
        (Kind::KubotaLoop, "kubota-loop"),
        (Kind::Derdiyok, "derdiyok"),
        (Kind::Utkin, "utkin"),
        (Kind::Kenne, "kenne"),
        (Kind::Jadot, "jadot"),
        (Kind::Sampled, "sampled"),
    ];
}

impl FromStr for Kind {
    type Err = DesignError;
    fn from_str(name: &str) -> Result<Self, DesignError> {
        let known = || Kind::ALL.map(|(_, name)| name).join(", ");
        let found = Kind::ALL.iter().find(|(_, known)| *known == name);
        found.map(|(kind, _)| *kind).ok_or_else(|| DesignError::request(format!("no design {name}; there are {}", known())))
    }
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
    pub frame_rad_per_s: [f64; 2],
    /// Slip, electrical rad/s.
    pub slip_rad_per_s: [f64; 2],
    /// Flux along d, Wb.
    pub flux_d_wb: [f64; 2],
    /// Flux along q, Wb.
    pub flux_q_wb: [f64; 2],
    /// Measured current along d, A; zero when not given: the torque is not modelled.
    #[serde(default)]
    pub current_d_a: [f64; 2],
    /// Measured current along q, A; zero when not given.
    #[serde(default)]
    pub current_q_a: [f64; 2],
    /// Wanted rate, 1/s; the fastest when not given.
    pub rate_per_s: Option<f64>,
    /// Limit of the gain in scaled states, 1/s; 10⁴ when not given.
    #[serde(default = "ten_thousand")]
    pub gain_limit_per_s: f64,
}

fn ten_thousand() -> f64 {
    1e4
}

/// Region of `kubota`.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KubotaFile {
    /// Mechanical speeds, rad/s.
    pub speed_rad_per_s: [f64; 2],
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
    pub speed_rad_per_s: [f64; 2],
    /// Slips, electrical rad/s.
    pub slip_rad_per_s: [f64; 2],
    /// Rotor flux linkage amplitude, Wb.
    pub flux_wb: f64,
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
    pub speed_max_rad_per_s: f64,
    /// |λ| up to this, Wb.
    pub flux_max_wb: f64,
    /// What ν₀ has to spare, V.
    pub reserve: f64,
}

/// Region of `utkin`; see [`UtkinDesign`].
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct UtkinRequest {
    /// |ω| up to this mechanical speed, rad/s.
    pub speed_max_rad_per_s: f64,
    /// |λ̂| from this on, Wb.
    pub flux_min_wb: f64,
    /// |λ − λ̂| up to this, Wb.
    pub flux_error_max_wb: f64,
    /// |î − i| up to this, A.
    pub current_error_max_a: f64,
    /// |i| up to this, A.
    pub current_max_a: f64,
}

/// Region of `sampled`.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SampledRequest {
    /// Mechanical speeds, rad/s.
    pub speed_rad_per_s: [f64; 2],
    /// Sampling period, s.
    pub period_s: f64,
    /// Wanted rate, 1/s.
    pub rate_per_s: f64,
}

/// Make a design from the text of a region file (TOML).
///
/// # Errors
/// A region file that does not fit the design, with line and key; whatever the design itself refuses.
pub fn design(kind: Kind, plant: Plant, region: &str) -> Result<Certificate, DesignError> {
    if let Plant::Machine(machine) = &plant {
        machine.validate()?;
    }
    match kind {
        Kind::Thau => thau::maximize(plant, read::<ThauRequest>(region)?.slack).map(|d| d.1),
        Kind::ThauBox => {
            let r: BoxRequest = read(region)?;
            let at = thau_box::BoxRegion {
                frame_rad_per_s: r.frame_rad_per_s,
                slip_rad_per_s: r.slip_rad_per_s,
                flux_d_wb: r.flux_d_wb,
                flux_q_wb: r.flux_q_wb,
                current_d_a: r.current_d_a,
                current_q_a: r.current_q_a,
            };
            match r.rate_per_s {
                Some(rate) => thau_box::design(plant, &at, rate, r.gain_limit_per_s),
                None => thau_box::fastest(plant, &at, r.gain_limit_per_s, r.gain_limit_per_s),
            }
            .map(|d| d.1)
        }
        Kind::Kubota => {
            let r: KubotaFile = read(region)?;
            let beta = plant.constants::<f64>().beta;
            let flux_weight = r.flux_weight.unwrap_or(beta * beta);
            let request = kubota::KubotaRequest { speed_rad_per_s: r.speed_rad_per_s, rate_per_s: r.rate_per_s, flux_weight };
            kubota::least_norm(plant, &request).map(|d| d.1)
        }
        Kind::KubotaLoop => {
            let r: LoopRequest = read(region)?;
            let gains = kubota_loop::mended(plant, r.rho, r.l2_per_s, r.proportional, r.integral)?;
            kubota_loop::certify(plant, &gains, r.speed_rad_per_s, r.slip_rad_per_s, r.flux_wb, r.depth).map(|d| d.1)
        }
        Kind::Derdiyok => {
            let r: DerdiyokRequest = read(region)?;
            sliding::derdiyok(plant, r.speed_max_rad_per_s, r.flux_max_wb, r.reserve).map(|d| d.1)
        }
        Kind::Utkin => {
            let r: UtkinRequest = read(region)?;
            let region = UtkinDesign {
                speed_max_rad_per_s: r.speed_max_rad_per_s,
                flux_min_wb: r.flux_min_wb,
                flux_error_max_wb: r.flux_error_max_wb,
                current_error_max_a: r.current_error_max_a,
                current_max_a: r.current_max_a,
                omega0_rad_per_s: 0.0,
                root_bound: 0.0,
            };
            sliding::utkin(plant, &region).map(|d| d.1)
        }
        Kind::Kenne => kenne::design(plant, &read(region)?, 0.05).map(|d| d.1),
        Kind::Jadot => jadot::design(plant, &read(region)?).map(|d| d.1),
        Kind::Sampled => {
            let r: SampledRequest = read(region)?;
            sampled::design(plant, r.speed_rad_per_s, r.period_s, r.rate_per_s).map(|d| d.1)
        }
    }
}

fn read<T: DeserializeOwned>(region: &str) -> Result<T, DesignError> {
    toml::from_str(region).map_err(|e| DesignError::request(format!("region file: {}", e.to_string().trim_end())))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Machine;

    /// One region file for each design.
    const FILES: [(&str, &str); 9] = [
        ("thau", ""),
        (
            "thau-box",
            "frame_rad_per_s = [100.0, 300.0]\nslip_rad_per_s = [-5.0, 5.0]\nflux_d_wb = [0.9, 1.0]\nflux_q_wb = [-0.02, 0.02]\nrate_per_s = 2.0",
        ),
        ("kubota", "speed_rad_per_s = [-190.0, 190.0]\nrate_per_s = 0.8"),
        (
            "kubota-loop",
            "speed_rad_per_s = [20.0, 60.0]\nslip_rad_per_s = [-10.0, 10.0]\nflux_wb = 0.9\nproportional = 0.05\nintegral = 20.0\nrho = 0.2",
        ),
        ("derdiyok", "speed_max_rad_per_s = 190.0\nflux_max_wb = 1.1\nreserve = 1.0"),
        (
            "utkin",
            "speed_max_rad_per_s = 190.0\nflux_min_wb = 0.6\nflux_error_max_wb = 0.05\ncurrent_error_max_a = 5.0\ncurrent_max_a = 80.0",
        ),
        (
            "kenne",
            "speed_max_rad_per_s = 150.0\nflux_wb = [0.8, 1.0]\nflux_uncertainty = 0.05\ncurrent_max_a = 50.0\nstator_resistance_ratio = [0.5, 1.5]\nrotor_resistance_ratio = [0.5, 2.0]\nacceleration_max_rad_per_s2 = 1000.0\nreference_max_rad_per_s3 = 0.0\nload_error_rad_per_s2 = 0.0\nload_rate_rad_per_s3 = 0.0\nrotor_resistance_rate_per_s = 1.0\nc_omega = 15.0\nc_lambda = 10.0\nreach_omega = 100.0\nreach_lambda = 1.0",
        ),
        (
            "jadot",
            "electrical_speed_rad_per_s = [-320.0, 320.0]\nslip_rad_per_s = [-5.0, 5.0]\nflux_wb = 0.9\ncurrent_bandwidth_rad_per_s = 800.0\nspeed_bandwidth_rad_per_s = 10.0\ndamping = 0.8",
        ),
        ("sampled", "speed_rad_per_s = [-190.0, 190.0]\nperiod_s = 10e-6\nrate_per_s = 0.2"),
    ];

    #[test]
    fn every_design_is_made_from_its_file_and_reads_back() {
        for (name, region) in FILES {
            let made = design(name.parse().unwrap(), Plant::Machine(Machine::kwon_table_iv()), region);
            let text = made.unwrap_or_else(|e| panic!("{name}: {e}")).to_text().unwrap();
            let (read, _) = Certificate::check_text(&text).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert!(crate::gains::GainSet::from(&read.design).to_toml().parse::<toml::Table>().is_ok());
            // Any digit changed anywhere is seen.
            let altered = text.replacen("0.22", "0.23", 1);
            assert!(altered != text && Certificate::check_text(&altered).is_err(), "{name}");
        }
    }

    #[test]
    fn errors_name_the_key_and_the_choices() {
        let plant = Plant::Machine(Machine::kwon_table_iv());
        let error = design(Kind::Kubota, plant, "speed_rad_per_s = [-1.0, 1.0]\nrate = 0.8").unwrap_err().to_string();
        assert!(error.contains("line 2") && error.contains("rate"), "{error}");
        assert!("luenberger".parse::<Kind>().unwrap_err().to_string().contains("thau-box"));
    }
}
