//! Designs asked for by name and a region file: what a command line needs.
//!
//! ```
//! use im_design::{LinearMachine, DesignModel, request::{Kind, design}};
//! let region = "speed_rad_s = [-190.0, 190.0]\nrate_per_s = 0.8\n";
//! let certificate = design("kubota".parse().unwrap(), DesignModel::Machine(LinearMachine::kwon_table_iv()), region).unwrap();
//! certificate.check().unwrap();
//! assert_eq!(Kind::ALL.len(), 10);
//! ```

use crate::certificate::{Certificate, DesignModel};
use crate::error::DesignError;
use crate::mtpa::{Aqdm, Circuit, TCircuit};
use crate::{jadot, kenne, kubota, kubota_loop, mtpa, sampled, sliding, thau, thau_box};
use regions::{needed, read, unused};
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
    /// `kubota-loop`: [`kubota_loop::stabilized`] and [`kubota_loop::certify`]; region: [`LoopRequest`].
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
    /// `mtpa`: [`mtpa::design`]; region: [`mtpa::MtpaRequest`].
    Mtpa,
}

impl Kind {
    /// All, with their names.
    pub const ALL: [(Kind, &'static str); 10] = [
        (Kind::Thau, "thau"),
        (Kind::ThauBox, "thau-box"),
        (Kind::Kubota, "kubota"),
        (Kind::KubotaLoop, "kubota-loop"),
        (Kind::Derdiyok, "derdiyok"),
        (Kind::Utkin, "utkin"),
        (Kind::Kenne, "kenne"),
        (Kind::Jadot, "jadot"),
        (Kind::Sampled, "sampled"),
        (Kind::Mtpa, "mtpa"),
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
            Kind::Mtpa => include_str!("examples/mtpa.toml"),
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
pub fn design(kind: Kind, plant: DesignModel, region: &str) -> Result<Certificate, DesignError> {
    if let DesignModel::Machine(machine) = &plant {
        machine.validate()?;
    }
    match kind {
        Kind::Thau => thau::maximize(plant, read::<ThauRequest>(region)?.slack).map(|d| d.1),
        Kind::ThauBox => {
            let r: BoxRequest = read(region)?;
            let at = r.region();
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
            let request = kubota::KubotaRequest { speed_rad_s: r.speed_rad_s, rate_per_s: r.rate_per_s, flux_weight };
            kubota::least_norm(plant, &request).map(|d| d.1)
        }
        Kind::KubotaLoop => {
            let r: LoopRequest = read(region)?;
            let gains = kubota_loop::stabilized(plant, r.rho, r.l2_per_s, r.proportional, r.integral)?;
            kubota_loop::certify(plant, &gains, r.speed_rad_s, r.slip_rad_s, r.flux_vs, r.depth).map(|d| d.1)
        }
        Kind::Derdiyok => {
            let r: DerdiyokRequest = read(region)?;
            sliding::derdiyok(plant, r.speed_max_rad_s, r.flux_max_vs, r.reserve).map(|d| d.1)
        }
        Kind::Utkin => {
            let r: UtkinRequest = read(region)?;
            sliding::utkin(plant, &r.region()).map(|d| d.1)
        }
        Kind::Kenne => kenne::design(plant, &regions::kenne(region)?.0, 0.05).map(|d| d.1),
        Kind::Jadot => jadot::design(plant, &read(region)?).map(|d| d.1),
        Kind::Sampled => {
            let r: SampledRequest = read(region)?;
            sampled::design(plant, r.speed_rad_s, r.period_s, r.rate_per_s).map(|d| d.1)
        }
        Kind::Mtpa => match plant {
            DesignModel::Machine(m) => {
                let [l_r, l_m] = [m.rotor_inductance_h, m.mutual_inductance_h];
                {
                    let own = TCircuit::linear(m.rotor_resistance_ohm, l_r - l_m, l_m, m.pole_pairs);
                    maximum_torque(plant, Circuit::T(own), region)
                }
            }
            DesignModel::Constants(_) => Err(DesignError::request("mtpa needs a machine, not derived constants")),
        },
    }
}

/// Make a design for a machine model; `mtpa` takes its saturation and skin effect into account, the others its linear machine.
///
/// # Errors
/// As [`design`].
pub fn design_for(kind: Kind, machine: &im_model::Machine<f64>, region: &str) -> Result<Certificate, DesignError> {
    let plant = DesignModel::Machine(crate::LinearMachine::from(machine));
    match kind {
        Kind::Mtpa => maximum_torque(plant, Circuit::of(machine), region),
        kind => design(kind, plant, region),
    }
}

/// The sampling period that a proof is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Period {
    /// This one, s.
    At(f64),
    /// The largest at which there is a proof, to 1 %, below 1/γ.
    Largest,
}

impl FromStr for Period {
    type Err = DesignError;
    fn from_str(text: &str) -> Result<Self, DesignError> {
        match text.parse() {
            Ok(s) => sampled::usual(s).map(|()| Period::At(s)),
            _ if text == "largest" => Ok(Period::Largest),
            _ => Err(DesignError::request(format!("a period is a number of seconds such as 50e-6, or largest; not {text}"))),
        }
    }
}

/// Make a design for an observer stepped by forward Euler at a period: the gain and the proof are for the sampled observer.
///
/// # Errors
/// As [`design`]; a kind without a sampled proof; the largest period when the one asked for is too long.
pub fn design_sampled(kind: Kind, plant: DesignModel, region: &str, period: Period) -> Result<Certificate, DesignError> {
    if let DesignModel::Machine(machine) = &plant {
        machine.validate()?;
    }
    let at = match period {
        Period::At(s) => Some(s),
        Period::Largest => None,
    };
    match kind {
        Kind::Kubota => {
            let r: KubotaFile = read(region)?;
            unused("flux_weight", r.flux_weight)?;
            match at {
                Some(s) => sampled::design(plant, r.speed_rad_s, s, r.rate_per_s),
                None => sampled::design_for_largest_period(plant, r.speed_rad_s, r.rate_per_s, 1e-3),
            }
            .map(|d| d.1)
        }
        Kind::ThauBox => {
            let r: BoxRequest = read(region)?;
            let rate = needed("rate_per_s", r.rate_per_s)?;
            sampled::over_box(plant, &r.region(), at, rate).map(|d| d.1)
        }
        Kind::Thau => sampled::thau(plant, read::<ThauRequest>(region)?.slack, at).map(|d| d.1),
        Kind::Derdiyok => {
            let r: DerdiyokRequest = read(region)?;
            with_layer("boundary_layer_a", r.boundary_layer_a, at)?;
            let layer = r.boundary_layer_a;
            sampled::derdiyok(plant, r.speed_max_rad_s, r.flux_max_vs, r.reserve, layer, at).map(|d| d.1)
        }
        Kind::Utkin => {
            let r: UtkinRequest = read(region)?;
            with_layer("boundary_layer_avs", r.boundary_layer_avs, at)?;
            let limits = [needed("flux_max_vs", r.flux_max_vs)?, needed("voltage_max_v", r.voltage_max_v)?];
            sampled::utkin(plant, &r.region(), limits, r.boundary_layer_avs, at).map(|d| d.1)
        }
        Kind::KubotaLoop => {
            let r: LoopRequest = read(region)?;
            let gains = kubota_loop::stabilized(plant, r.rho, r.l2_per_s, r.proportional, r.integral)?;
            sampled::adaptive(plant, &gains, r.speed_rad_s, r.slip_rad_s, r.flux_vs, r.depth, r.rate_per_s, at).map(|d| d.1)
        }
        Kind::Kenne => {
            let (r, layers) = regions::kenne(region)?;
            with_layer("boundary_omega, boundary_lambda", layers, at)?;
            sampled::switching(plant, &r, 0.05, layers, at).map(|d| d.1)
        }
        Kind::Jadot => sampled::regulation(plant, &read(region)?, at).map(|d| d.1),
        Kind::Sampled => Err(DesignError::request("sampled has its period in the region file; leave --period out")),
        Kind::Mtpa => Err(DesignError::request("mtpa is of the steady state: it has no sampling period; leave --period out")),
    }
}

/// The largest period is the largest for a boundary layer: a wider one allows a longer period.
fn with_layer<T>(key: &str, layer: Option<T>, period_s: Option<f64>) -> Result<(), DesignError> {
    if layer.is_some() || period_s.is_some() {
        return Ok(());
    }
    let what = format!(
        "{key} is missing: each period has its own layer, so that the largest period needs the layer; or give the period"
    );
    Err(DesignError::region(what))
}

/// Laws for the circuit of the region file, or else for the machine's own.
fn maximum_torque(plant: DesignModel, own: Circuit, region: &str) -> Result<Certificate, DesignError> {
    let request: mtpa::MtpaRequest = read(region)?;
    let circuit = request.aqdm.map_or(own, |t| {
        let mtpa::AqdmTable { rotor_leakage, magnetizing, rotor } = t;
        Circuit::Aqdm(Aqdm { rotor_leakage, magnetizing, rotor, pole_pairs: own.pole_pairs() })
    });
    mtpa::design(plant, circuit, &request).map(|d| d.1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LinearMachine;

    /// The machine of `examples/motor.toml`.
    fn plant() -> DesignModel {
        DesignModel::Machine(LinearMachine {
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
        let error = design(Kind::Kubota, plant(), "speed_rad_s = [-1.0, 1.0]\nrate = 0.8").unwrap_err();
        assert!(matches!(&error, DesignError::Region(e) if e.line == Some(2) && e.to_string().contains("rate_per_s")), "{error}");
        let missing = design(Kind::Kubota, plant(), "rate_per_s = 0.8").unwrap_err().to_string();
        assert!(missing.contains("speed_rad_s"), "{missing}");
        let at = |kind: &str, period: &str| {
            let kind: Kind = kind.parse().unwrap();
            let region = kind.example_region().replace("# rate_per_s", "rate_per_s");
            design_sampled(kind, plant(), &region, period.parse().unwrap()).map(|c| c.check().unwrap())
        };
        at("kubota", "20e-6").unwrap();
        at("kubota", "largest").unwrap();
        at("derdiyok", "100e-6").unwrap();
        at("thau", "20e-6").unwrap();
        let error = at("thau-box", "0.1").unwrap_err().to_string();
        assert!(error.contains("periods up to"), "{error}");
        for kind in ["utkin", "kubota-loop", "kenne", "jadot"] {
            at(kind, "20e-6").unwrap();
        }
        assert!(at("utkin", "largest").unwrap_err().to_string().contains("boundary_layer_avs is missing"));
        assert!(at("mtpa", "1e-4").unwrap_err().to_string().contains("steady state"));
        assert!("luenberger".parse::<Kind>().unwrap_err().to_string().contains("thau-box"));
    }

    /// A region of one point is a region.
    #[test]
    fn points_are_designed_for_too() {
        for (kind, region) in [
            (Kind::Kubota, "speed_rad_s = [100.0, 100.0]\nrate_per_s = 3.0"),
            (Kind::Sampled, "speed_rad_s = [100.0, 100.0]\nperiod_s = 30e-6\nrate_per_s = 1.0"),
            (
                Kind::KubotaLoop,
                "speed_rad_s = [10.0, 10.0]\nslip_rad_s = [2.0, 2.0]\nflux_vs = 0.9\nproportional = 0.05\nintegral = 20.0\nrho = 0.2",
            ),
            (
                Kind::ThauBox,
                "frame_rad_s = [200.0, 200.0]\nslip_rad_s = [3.0, 3.0]\nflux_d_vs = [0.95, 0.95]\nflux_q_vs = [0.0, 0.0]",
            ),
            (
                Kind::Jadot,
                "electrical_speed_rad_s = [100.0, 100.0]\nslip_rad_s = [3.0, 3.0]\nflux_vs = 0.9\n\
                 current_bandwidth_rad_s = 800.0\nspeed_bandwidth_rad_s = 15.0\ndamping = 0.7",
            ),
        ] {
            let made = design(kind, plant(), region).unwrap_or_else(|e| panic!("{}: {e}", kind.name()));
            let picture = crate::plot::picture(&made);
            assert!(!picture.contains("NaN") && !picture.contains("inf"), "{}", kind.name());
        }
        let cell =
            "speed_rad_s = [10.0, 10.0]\nslip_rad_s = [2.0, 2.0]\nflux_vs = 0.9\nproportional = 0.05\nintegral = 20.0\nrho = 0.2";
        design_sampled(Kind::KubotaLoop, plant(), cell, Period::At(5e-5)).unwrap();
    }

    /// What cannot be had names what binds and what could be had; what makes no sense names its key.
    #[test]
    fn refusals_say_what_binds_and_what_would_be_feasible() {
        let jadot = "electrical_speed_rad_s = [-330.0, 330.0]\nslip_rad_s = [-10.0, 10.0]\nflux_vs = 0.9\n\
                     current_bandwidth_rad_s = 800.0\nspeed_bandwidth_rad_s = 1500.0\ndamping = 0.7";
        let with = |kind: Kind, from: &str, to: &str| {
            let region = kind.example_region();
            let changed = region.replace(from, to);
            assert!(changed != region, "{from}");
            design(kind, plant(), &changed).unwrap_err().to_string()
        };
        for (message, parts) in [
            (design(Kind::Jadot, plant(), jadot).unwrap_err().to_string(), ["unstable vertex", "a speed bandwidth up to"]),
            (with(Kind::Mtpa, "50.0", "5e6"), ["N m from this circuit", "torques up to"]),
            (with(Kind::Mtpa, "0.01 ", "1e-7 "), ["tolerance", "0.001"]),
            (with(Kind::Kubota, "165.0]", "165.0, 200.0]"), [":2:", "two numbers"]),
            (with(Kind::Kubota, "= 3.0", "= -3.0"), ["rate_per_s = -3", "not negative"]),
            (with(Kind::Sampled, "[-165.0, 165.0]", "[165.0, -165.0]"), ["speed_rad_s", "ascending"]),
            (with(Kind::KubotaLoop, "proportional = 0.05", "proportional = -0.05"), ["proportional = -0.05", "not negative"]),
            (with(Kind::Thau, "0.001", "1.5"), ["slack = 1.5", "between 0 and 1"]),
            (with(Kind::ThauBox, "1e4", "0.0"), ["gain_limit_per_s = 0", "positive"]),
            (with(Kind::Utkin, "= 0.05", "= -0.05"), ["flux_error_max_vs = -0.05", "not negative"]),
            (with(Kind::Kenne, "current_max_a = 15.0", "current_max_a = -15.0"), ["current_max_a = -15", "not negative"]),
        ] {
            assert!(parts.iter().all(|part| message.contains(part)), "{message}");
        }
        let message =
            design_sampled(Kind::Kubota, plant(), Kind::Kubota.example_region(), Period::At(6e-5)).unwrap_err().to_string();
        let largest =
            message.split("up to ").nth(1).and_then(|t| t.split(' ').next()).and_then(|t| t.parse::<f64>().ok()).unwrap();
        let made = |us: f64| design_sampled(Kind::Kubota, plant(), Kind::Kubota.example_region(), Period::At(1e-6 * us));
        assert!(made(largest - 0.01).is_ok() && made(1.02 * largest).is_err(), "{message}");
    }
}
