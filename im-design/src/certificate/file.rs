//! The certificate file.

use super::check::{CheckError, Margin, Obligation, decide};
use crate::error::DesignError;
use crate::exact::{Field, Rational};
use crate::machine::{Constants, Machine};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// What a design was made for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Plant {
    /// A machine by its parameters; the checker derives the constants exactly.
    Machine(Machine),
    /// The derived constants themselves, e.g. those a paper prints.
    Constants(Constants<f64>),
}

impl Plant {
    /// The derived constants, exact over the rationals.
    pub fn constants<F: Field>(&self) -> Constants<F> {
        match self {
            Plant::Machine(machine) => machine.constants(),
            Plant::Constants(constants) => constants.over(),
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
}

/// A design with its proof, as written to a file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Certificate {
    /// Version of the file format.
    pub schema: u32,
    /// SHA-256 of everything else, in canonical text.
    pub digest: String,
    /// What the design is for.
    pub plant: Plant,
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
    pub fn seal(plant: Plant, design: impl Into<Design>) -> Result<Self, DesignError> {
        let mut certificate = Certificate { schema: 1, digest: String::new(), plant, design: design.into(), margins: Vec::new() };
        certificate.margins = certificate.prove()?;
        certificate.digest = certificate.content_digest()?;
        Ok(certificate)
    }

    /// Decide every obligation in exact arithmetic, whatever the digest says.
    ///
    /// # Errors
    /// The first obligation that is false.
    pub fn prove(&self) -> Result<Vec<Margin>, CheckError> {
        if let Plant::Machine(machine) = &self.plant {
            machine.validate().map_err(|e| CheckError::Malformed(e.to_string()))?;
        }
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
            return Err(CheckError::Altered { written: self.digest.clone(), computed });
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

    /// Read a file's text and check it.
    ///
    /// # Errors
    /// Why it is refused.
    pub fn check_text(text: &str) -> Result<(Self, Vec<Margin>), CheckError> {
        let certificate: Certificate = toml::from_str(text).map_err(|e| CheckError::Malformed(e.to_string()))?;
        if certificate.schema != 1 {
            return Err(CheckError::Malformed(format!("schema {} is not known here", certificate.schema)));
        }
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
