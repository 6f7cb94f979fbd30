//! The certificate file.

use super::check::{CheckError, Margin, Obligation, decide};
use super::validity;
use crate::error::DesignError;
use crate::exact::{Field, Rational};
use crate::machine::{Constants, LinearMachine};
use im_model::toml_text::TomlText;
use im_model::{FileError, FileKind};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// What a design was made for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum DesignModel {
    /// A machine by its parameters; the checker derives the constants exactly.
    Machine(LinearMachine),
    /// The derived constants themselves, e.g. those a paper prints.
    Constants(Constants<f64>),
}

impl DesignModel {
    /// The derived constants, exact over the rationals.
    pub fn constants<F: Field>(&self) -> Constants<F> {
        match self {
            DesignModel::Machine(machine) => machine.constants(),
            DesignModel::Constants(constants) => constants.over(),
        }
    }
}

/// A design that can say what must hold for its claim to be true.
pub trait Claim {
    /// The obligations, over floats to look at or over the rationals to decide.
    ///
    /// # Errors
    /// A message when shapes or ranges in the data are impossible.
    fn obligations<F: Field>(&self, constants: &Constants<F>) -> Result<Vec<Obligation<F>>, String>;
}

macro_rules! designs {
    ($($(#[$doc:meta])* $variant:ident($path:path)),* $(,)?) => {
        /// Every kind of certified design.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(rename_all = "snake_case", deny_unknown_fields)]
        #[allow(clippy::large_enum_variant)]
        pub enum Design {
            $($(#[$doc])* $variant($path),)*
        }

        impl Claim for Design {
            fn obligations<F: Field>(&self, constants: &Constants<F>) -> Result<Vec<Obligation<F>>, String> {
                match self { $(Design::$variant(design) => design.obligations(constants),)* }
            }
        }

        $(impl From<$path> for Design {
            fn from(design: $path) -> Self { Design::$variant(design) }
        })*
    };
}

designs! {
    /// Thau observer under a Lipschitz bound.
    Thau(crate::thau::ThauDesign),
    /// Thau-type observer over a box of speed and flux.
    ThauBox(crate::thau_box::BoxDesign),
    /// Luenberger gain of Kubota's observer over a speed range.
    Kubota(crate::kubota::KubotaDesign),
    /// Kubota's adaptive loop over a region of speed and stator frequency.
    KubotaLoop(crate::kubota_loop::LoopDesign),
    /// Sliding gain ν₀ of Derdiyok et al.
    Derdiyok(crate::sliding::DerdiyokDesign),
    /// Speed amplitude ω₀ of Utkin et al.
    Utkin(crate::sliding::UtkinDesign),
    /// Switching gains of Kenné et al.
    Kenne(crate::kenne::KenneDesign),
    /// Passivity-based controller of Jadot et al.
    Jadot(crate::jadot::JadotDesign),
    /// Observer gain for a sampling period under forward Euler.
    Sampled(crate::sampled::SampledDesign),
    /// Observer over a box for a sampling period under forward Euler.
    SampledThauBox(crate::sampled::SampledBoxDesign),
    /// Thau observer for a sampling period under forward Euler.
    SampledThau(crate::sampled::SampledThauDesign),
    /// Sliding gain ν₀ with the boundary layer for a sampling period.
    SampledDerdiyok(crate::sampled::SampledDerdiyokDesign),
    /// Kubota's adaptive loop at a sampling period.
    SampledKubotaLoop(crate::sampled::SampledLoopDesign),
    /// Speed amplitude ω₀ with the boundary layer for a sampling period.
    SampledUtkin(crate::sampled::SampledUtkinDesign),
    /// Switching gains of Kenné et al. with the boundary layers for a sampling period.
    SampledKenne(crate::sampled::SampledKenneDesign),
    /// Controller of Jadot et al. with its control held over a sampling period.
    SampledJadot(crate::sampled::SampledJadotDesign),
    /// Laws of maximum torque per ampere.
    Mtpa(crate::mtpa::MtpaDesign),
}

/// Version of the file format.
const SCHEMA: u32 = 2;

/// A design with its proof, as written to a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Certificate {
    /// Version of the file format.
    pub schema: u32,
    /// SHA-256 of everything else, in canonical text.
    pub digest: String,
    /// What the design is for.
    pub plant: DesignModel,
    /// Region, gains and proof.
    pub design: Design,
    /// How clearly each obligation holds.
    pub margins: Vec<Margin>,
}

impl Certificate {
    /// Prove a design and seal it.
    ///
    /// # Errors
    /// [`DesignError::Unproven`] when an obligation is false in exact arithmetic.
    pub fn seal(plant: DesignModel, design: impl Into<Design>) -> Result<Self, DesignError> {
        let mut certificate =
            Certificate { schema: SCHEMA, digest: String::new(), plant, design: design.into(), margins: Vec::new() };
        certificate.margins = certificate.prove()?;
        certificate.digest = certificate.content_digest()?;
        Ok(certificate)
    }

    /// Decide every obligation in exact arithmetic, whatever the digest says.
    ///
    /// # Errors
    /// The first obligation that is false.
    pub fn prove(&self) -> Result<Vec<Margin>, CheckError> {
        let malformed = |e: toml::ser::Error| CheckError::Malformed(e.to_string());
        self.plant.check()?;
        validity::check("design", &toml::Value::try_from(&self.design).map_err(malformed)?)?;
        let constants = self.plant.constants::<Rational>();
        decide(&self.design.obligations(&constants).map_err(CheckError::Malformed)?)
    }

    /// Check digest, obligations and margins.
    ///
    /// # Errors
    /// Why the certificate is refused.
    pub fn check(&self) -> Result<Vec<Margin>, CheckError> {
        let computed = self.content_digest()?;
        if computed != self.digest {
            return Err(CheckError::Altered { written: self.digest.clone(), computed, now: self.as_it_stands() });
        }
        let margins = self.prove()?;
        if margins.len() != self.margins.len() {
            return Err(CheckError::Margin("all obligations together".into()));
        }
        match margins.iter().zip(&self.margins).find(|(a, b)| a != b) {
            Some((_, b)) => Err(CheckError::Margin(b.name.clone())),
            None => Ok(margins),
        }
    }

    /// What an altered file says by now, in a sentence or two.
    fn as_it_stands(&self) -> String {
        let margins = match self.prove() {
            Ok(margins) => margins,
            Err(e) => return format!("As it stands it is refused too: {e}"),
        };
        let pairs = || margins.iter().zip(&self.margins).filter(|(now, then)| now.name == then.name);
        let other: Vec<_> = pairs().filter(|(now, then)| now.margin != then.margin).collect();
        let changed = match other.first() {
            _ if margins.len() != self.margins.len() => {
                " The margins in the file are not those of so many obligations.".to_owned()
            }
            None => " Every margin is the one in the file.".to_owned(),
            Some((now, then)) => format!(
                " {} of the margins are others than in the file, first that of {}: {:.3e} there, {:.3e} now.",
                other.len(),
                now.name,
                then.margin,
                now.margin
            ),
        };
        let n = margins.len();
        format!(
            "As it stands {} in exact arithmetic, but nobody designed it so.{changed} Take the file as it was written, or design again",
            if n == 1 { "its one obligation holds".to_owned() } else { format!("all {n} obligations hold") }
        )
    }

    /// Read a file's text and check it.
    ///
    /// # Errors
    /// Why it is refused.
    pub fn check_text(text: &str) -> Result<(Self, Vec<Margin>), CheckError> {
        #[derive(Deserialize)]
        struct Version {
            schema: u32,
        }
        let toml = TomlText::new(text, "certificate", &[]).of_kind(FileKind::Certificate);
        let malformed = |e: FileError| CheckError::Malformed(e.without_file());
        let Version { schema } = toml.read().map_err(malformed)?;
        if schema != SCHEMA {
            let what = format!("schema {schema} is not {SCHEMA}, the one decided here: make the design again with this version");
            return Err(CheckError::Malformed(what));
        }
        let certificate: Certificate = toml.read().map_err(malformed)?;
        let margins = certificate.check()?;
        Ok((certificate, margins))
    }

    /// The file's text.
    ///
    /// # Errors
    /// [`CheckError::Malformed`] when a value cannot be written (a NaN).
    pub fn to_text(&self) -> Result<String, CheckError> {
        toml::to_string(self).map_err(|e| CheckError::Malformed(e.to_string()))
    }

    fn content_digest(&self) -> Result<String, CheckError> {
        let text = Certificate { digest: String::new(), ..self.clone() }.to_text()?;
        Ok(Sha256::digest(text.as_bytes()).iter().map(|byte| format!("{byte:02x}")).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kubota::{KubotaRequest, closed_form};

    #[test]
    fn numbers_without_a_value_and_negative_rates_are_refused() {
        let plant = DesignModel::Machine(LinearMachine::jadot_table_i());
        let request = KubotaRequest { speed_rad_s: [-100.0, 100.0], rate_per_s: 1.0, flux_weight: 1.0 };
        let (design, _) = closed_form(plant, &request).unwrap();
        for rate_per_s in [f64::NAN, f64::NEG_INFINITY, -1.0] {
            let forged = crate::kubota::KubotaDesign { rate_per_s, ..design.clone() };
            assert!(Certificate::seal(plant, forged).is_err(), "{rate_per_s}");
        }
        let endless = crate::kubota::KubotaDesign { speed_rad_s: [-100.0, f64::INFINITY], ..design };
        assert!(Certificate::seal(plant, endless).is_err());
    }

    #[test]
    fn an_altered_file_is_refused_with_what_it_says_by_now() {
        let plant = DesignModel::Machine(LinearMachine::jadot_table_i());
        let request = KubotaRequest { speed_rad_s: [-100.0, 100.0], rate_per_s: 1.0, flux_weight: 1.0 };
        let certificate = closed_form(plant, &request).unwrap().1;
        let Design::Kubota(design) = certificate.design.clone() else { panic!() };
        let said = |rate_per_s: f64| {
            let design = crate::kubota::KubotaDesign { rate_per_s, ..design.clone() };
            let forged = Certificate { design: Design::Kubota(design), ..certificate.clone() };
            forged.check().unwrap_err().to_string()
        };
        let (weaker, stronger) = (said(0.5), said(1e6));
        assert!(weaker.contains("As it stands all ") && weaker.contains(" obligations hold in exact arithmetic"), "{weaker}");
        assert!(stronger.contains("As it stands it is refused too: false: "), "{stronger}");
    }

    #[test]
    fn a_file_with_unknown_or_missing_fields_is_not_a_certificate() {
        let plant = DesignModel::Machine(LinearMachine::jadot_table_i());
        let request = KubotaRequest { speed_rad_s: [-100.0, 100.0], rate_per_s: 1.0, flux_weight: 1.0 };
        let text = closed_form(plant, &request).unwrap().1.to_text().unwrap();
        assert!(Certificate::check_text(&text).is_ok());
        let refused = |text: &str| matches!(Certificate::check_text(text), Err(CheckError::Malformed(_)));
        assert!(refused(&text.replacen("schema = 2", "schema = 1", 1)));
        assert!(refused(&text.replacen("schema = 2", "schema = 2\nextra = 2", 1)));
        assert!(refused(&text.replacen("rate_per_s", "rate", 1)));
        // Whoever read the file names it: here its line is enough.
        let Err(said) = Certificate::check_text("[machine]\npole_pairs = 2\n") else { panic!("a motor file is no certificate") };
        assert!(said.to_string().starts_with("not a certificate: a file of gains"), "{said}");
        assert!(Certificate::check_text(&format!("# a comment changes nothing\n{text}")).is_ok());
    }
}
