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
use regions::read;
use std::str::FromStr;

mod regions;

pub use regions::{BoxRequest, DerdiyokRequest, KubotaFile, LoopRequest, SampledRequest, ThauRequest, UtkinRequest};

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

    /// The name, as in the command line.
    pub fn name(self) -> &'static str {
        Kind::ALL.iter().find(|(kind, _)| *kind == self).map_or("", |(_, name)| name)
    }

    /// A region file to start from, commented; feasible for a 4-kW machine of 400 V and 50 Hz.
    pub const fn example_region(self) -> &'static str {
        match self {
            Kind::Thau => include_str!("examples/thau.toml"),
            Kind::ThauBox => include_str!("examples/thau-box.toml"),
            Kind::Kubota => include_str!("examples/kubota.toml"),
            Kind::KubotaLoop => include_str!("examples/kubota-loop.toml"),
            Kind::Derdiyok => include_str!("examples/derdiyok.toml"),
            Kind::Utkin => include_str!("examples/utkin.toml"),
            Kind::Kenne => include_str!("examples/kenne.toml"),
            Kind::Jadot => include_str!("examples/jadot.toml"),
            Kind::Sampled => include_str!("examples/sampled.toml"),
        }
    }
}

impl FromStr for Kind {
    type Err = DesignError;
    fn from_str(name: &str) -> Result<Self, DesignError> {
        let known = || Kind::ALL.map(|(_, name)| name).join(", ");
        let found = Kind::ALL.iter().find(|(_, known)| *known == name);
        found.map(|(kind, _)| *kind).ok_or_else(|| DesignError::request(format!("no design {name}; there are {}", known())))
    }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Machine;

    /// The machine of `examples/motor.toml`.
    fn plant() -> Plant {
        Plant::Machine(Machine {
            stator_resistance_ohm: 1.5,
            rotor_resistance_ohm: 0.9,
            stator_inductance_h: 0.16,
            rotor_inductance_h: 0.16,
            mutual_inductance_h: 0.156,
            pole_pairs: 2,
            inertia_kg_m2: 0.045,
            viscous_friction_n_m_s: 0.002,
        })
    }

    #[test]
    fn every_example_region_makes_a_design_that_reads_back() {
        for (kind, name) in Kind::ALL {
            let made = design(kind, plant(), kind.example_region());
            let text = made.unwrap_or_else(|e| panic!("{name}: {e}")).to_text().unwrap();
            let (read, _) = Certificate::check_text(&text).unwrap_or_else(|e| panic!("{name}: {e}"));
            assert!(crate::gains::GainSet::from(&read.design).to_toml().parse::<toml::Table>().is_ok());
            // Any digit changed anywhere is seen.
            let altered = text.replacen("0.16", "0.17", 1);
            assert!(altered != text && Certificate::check_text(&altered).is_err(), "{name}");
        }
    }

    #[test]
    fn errors_name_the_line_and_the_choices() {
        let error = design(Kind::Kubota, plant(), "speed_rad_per_s = [-1.0, 1.0]\nrate = 0.8").unwrap_err();
        assert!(matches!(&error, DesignError::Region { line: Some(2), what } if what.contains("rate_per_s")), "{error}");
        let missing = design(Kind::Kubota, plant(), "rate_per_s = 0.8").unwrap_err().to_string();
        assert!(missing.contains("speed_rad_per_s"), "{missing}");
        assert!("luenberger".parse::<Kind>().unwrap_err().to_string().contains("thau-box"));
    }
}
