//! Gains from a file that `im design` wrote, or those one starts from.

use std::path::{Path, PathBuf};

use im_model::MotorFile;
use im_observers::{
    Basis, Derdiyok, DerdiyokGains, Discretization, Kubota, KubotaGains, LoadTorqueModel, ObserverError, Thau, ThauBoxGains,
    ThauGains, Utkin, UtkinGains,
};

use crate::failure::Failure;

/// A file's tables, or none.
pub struct Gains {
    file: Option<(PathBuf, toml::Table)>,
}

/// Either the file is not as it should be, or the observer refuses what it says.
pub enum Refused {
    File(Failure),
    Observer(ObserverError),
}

impl Refused {
    pub fn or(self, told: impl Fn(ObserverError) -> Failure) -> Failure {
        match self {
            Self::File(e) => e,
            Self::Observer(e) => told(e),
        }
    }
}

impl From<ObserverError> for Refused {
    fn from(e: ObserverError) -> Self {
        Self::Observer(e)
    }
}

impl From<Failure> for Refused {
    fn from(e: Failure) -> Self {
        Self::File(e)
    }
}

impl Gains {
    pub fn of(path: Option<&Path>) -> Result<Self, Failure> {
        let Some(path) = path else { return Ok(Self { file: None }) };
        let named = |what: String| Failure::Input(format!("{}: {what}", path.display()));
        let text = std::fs::read_to_string(path).map_err(|e| named(format!("cannot be read: {e}")))?;
        let table = text.parse::<toml::Table>().map_err(|e| named(e.message().to_owned()))?;
        let table = if table.contains_key("design") { proven(&text).map_err(named)? } else { table };
        Ok(Self { file: Some((path.to_owned(), table)) })
    }

    pub fn none_for(&self, who: &str) -> Result<(), Failure> {
        match &self.file {
            None => Ok(()),
            Some((path, _)) => Err(Failure::Input(format!("{}: {who} has no gains; leave out --gains", path.display()))),
        }
    }

    /// The first of some tables that the file has.
    fn table(&self, names: &[&'static str]) -> Result<Option<Table<'_>>, Failure> {
        let Some((path, tables)) = &self.file else { return Ok(None) };
        let found = names.iter().find_map(|name| Some((*name, tables.get(*name)?.as_table()?)));
        let (name, values) = found.ok_or_else(|| {
            let present: Vec<&str> = tables.keys().map(String::as_str).collect();
            let wanted = names.join("] or [");
            Failure::Input(format!("{}: [{wanted}] is missing; the file has {}", path.display(), present.join(", ")))
        })?;
        Ok(Some(Table { path, name, values }))
    }

    pub fn kubota(&self, motor: &MotorFile, basis: Basis<f64>) -> Result<Kubota<f64>, Refused> {
        let usual = KubotaGains::for_machine(&motor.machine, &motor.rating)?;
        let table = self.table(&["kubota_loop", "kubota", "sampled", "sampled_kubota_loop"])?;
        let rule = discretization(&table, &basis)?;
        let gains = match table {
            None => usual,
            Some(t) => KubotaGains {
                gain: t.matrix("gain")?,
                gain_per_speed: t.matrix("gain_per_speed")?,
                // A table of the observer's gain alone leaves the speed law to us.
                proportional: t.number("proportional")?.unwrap_or(usual.proportional),
                integral: t.number("integral")?.unwrap_or(usual.integral),
                fade_a: t.number("fade_a")?.unwrap_or(0.0),
            },
        };
        Ok(Kubota::discretized(basis, gains, rule)?)
    }

    pub fn derdiyok(&self, motor: &MotorFile, basis: Basis<f64>) -> Result<Derdiyok<f64>, Refused> {
        let usual = DerdiyokGains::for_machine(&motor.machine, &motor.rating);
        let table = self.table(&["derdiyok", "sampled_derdiyok"])?;
        let rule = discretization(&table, &basis)?;
        let gains = match table {
            None => usual,
            Some(t) => DerdiyokGains {
                nu0: t.needed("nu0")?,
                boundary_layer_a: t.number("boundary_layer_a")?.unwrap_or(usual.boundary_layer_a),
                filter_rad_s: t.number("filter_rad_s")?.unwrap_or(usual.filter_rad_s),
                anchor_per_s: t.number("anchor_per_s")?.unwrap_or(usual.anchor_per_s),
            },
        };
        Ok(Derdiyok::discretized(basis, gains, rule)?)
    }

    pub fn utkin(&self, motor: &MotorFile, basis: Basis<f64>) -> Result<Utkin<f64>, Refused> {
        let usual = UtkinGains::for_machine(&motor.machine, &motor.rating);
        let table = self.table(&["utkin", "sampled_utkin"])?;
        let rule = discretization(&table, &basis)?;
        let gains = match table {
            None => usual,
            Some(t) => UtkinGains {
                omega0_rad_s: t.needed("omega0_rad_s")?,
                boundary_layer_avs: t.number("boundary_layer_avs")?.unwrap_or(usual.boundary_layer_avs),
                filter_rad_s: t.number("filter_rad_s")?.unwrap_or(usual.filter_rad_s),
            },
        };
        Ok(Utkin::discretized(basis, gains, rule)?)
    }

    pub fn thau(&self, basis: Basis<f64>, load_coefficient: Option<f64>) -> Result<Thau<f64>, Refused> {
        let law = |other| match load_coefficient {
            Some(coefficient_nm_s_per_rad) => LoadTorqueModel::Proportional { coefficient_nm_s_per_rad },
            None => other,
        };
        let table = self.table(&["thau_box", "sampled_thau_box", "thau", "sampled_thau"])?;
        let rule = discretization(&table, &basis)?;
        Ok(match table {
            None => Thau::try_new(basis, ThauGains::published(), law(LoadTorqueModel::EqualToTorque))?,
            Some(t) if t.name.ends_with("_box") => {
                let gains = ThauBoxGains {
                    frame_rad_s: t.range("frame_rad_s")?,
                    gain: t.matrix("gain")?,
                    gain_per_frame_speed: t.matrix("gain_per_frame_speed")?,
                };
                Thau::in_box_discretized(basis, gains, law(LoadTorqueModel::Balanced), rule)?
            }
            Some(t) => {
                let gains = ThauGains { gain: t.matrix("gain")? };
                Thau::discretized(basis, gains, law(LoadTorqueModel::EqualToTorque), rule)?
            }
        })
    }
}

/// The gains of a file that `im design` wrote, whose proof is checked first.
#[cfg(feature = "design")]
fn proven(text: &str) -> Result<toml::Table, String> {
    let (certificate, _) = im_design::Certificate::check_text(text).map_err(|e| format!("refused: {e}"))?;
    im_design::gains::GainSet::from(&certificate.design).to_toml().parse::<toml::Table>().map_err(|e| e.message().to_owned())
}

#[cfg(not(feature = "design"))]
fn proven(_: &str) -> Result<toml::Table, String> {
    Err("holds gains with their proof, which this build cannot check: it was made without the feature `design`".into())
}

/// Gains proven for forward Euler are stepped by it, at the period that they are proven for.
fn discretization(table: &Option<Table<'_>>, basis: &Basis<f64>) -> Result<Discretization, Failure> {
    let Some(t) = table.as_ref().filter(|t| t.name.starts_with("sampled")) else { return Ok(Discretization::Implicit) };
    let (of_data, proven) = (basis.sample_time_s(), t.number("period_s")?);
    match proven.filter(|h| (h / of_data - 1.0).abs() > 1e-3) {
        Some(h) => Err(Failure::Input(format!(
            "{}: proven for a sampling period of {h} s, the recording's is {of_data} s; design for that with --period {of_data}",
            t.path.display()
        ))),
        None => Ok(Discretization::ForwardEuler),
    }
}

/// A table with its place, for messages.
struct Table<'a> {
    path: &'a Path,
    name: &'static str,
    values: &'a toml::Table,
}

fn float(value: &toml::Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|x| x as f64))
}

impl Table<'_> {
    fn wrong(&self, key: &str, expected: &str) -> Failure {
        Failure::Input(format!("{}: {key} of [{}] must be {expected}", self.path.display(), self.name))
    }

    fn number(&self, key: &str) -> Result<Option<f64>, Failure> {
        self.values.get(key).map(|v| float(v).ok_or_else(|| self.wrong(key, "a number"))).transpose()
    }

    fn needed(&self, key: &str) -> Result<f64, Failure> {
        self.number(key)?.ok_or_else(|| self.wrong(key, "given: a number"))
    }

    fn range(&self, key: &str) -> Result<[f64; 2], Failure> {
        let pair = |v: &toml::Value| v.as_array()?.iter().map(float).collect::<Option<Vec<_>>>()?.try_into().ok();
        self.values.get(key).and_then(pair).ok_or_else(|| self.wrong(key, "two numbers, [lower, upper]"))
    }

    fn matrix<const R: usize>(&self, key: &str) -> Result<[[f64; 2]; R], Failure> {
        let row = |v: &toml::Value| -> Option<[f64; 2]> {
            v.as_array()?.iter().map(float).collect::<Option<Vec<_>>>()?.try_into().ok()
        };
        let rows = |v: &toml::Value| v.as_array()?.iter().map(row).collect::<Option<Vec<_>>>()?.try_into().ok();
        self.values.get(key).and_then(rows).ok_or_else(|| self.wrong(key, &format!("{R} rows of two numbers")))
    }
}
