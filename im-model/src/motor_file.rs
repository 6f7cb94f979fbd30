//! `motor.toml`: a machine with its name, its rating and its effects.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use serde::Deserialize;
use toml::Spanned;

use crate::air_gap::AirGapSaturation;
use crate::atomic_file::write_atomically;
use crate::effects::{CustomId, EffectId, Effects, FreeForm, MAX_CUSTOM, Role};
use crate::error::{Bound, ModelError};
use crate::file_error::FileError;
use crate::file_kind::FileKind;
use crate::machine::{Machine, ParameterId};
use crate::nameplate::{DesignClass, Nameplate, NameplateGuess};
use crate::parameters::{BaseParameter, TParameters};
use crate::prediction::{Prediction, PredictionToml};
use crate::rating::Rating;
use crate::text_file::read_text;
use crate::toml_text::{TomlText, Whole, Within, exact, quoted};
use crate::winding::Conductor;

/// The content of a `motor.toml`.
///
/// ```toml
/// [machine]
/// name = "pump drive 7"
/// pole_pairs = 2
/// winding_c = 25.0                      # may be left out: the temperature of the windings, °C, at which R_s and R_r are those below
/// design = "B"                          # may be left out: A, B, C, D (NEMA), N, H (IEC) or wound; how well L_ls/L_lr is known
///
/// [machine.parameters]                  # star-equivalent, T circuit; all seven
/// stator_resistance_ohm = 1.5
/// rotor_resistance_ohm = 0.9
/// stator_leakage_inductance_h = 0.004
/// rotor_leakage_inductance_h = 0.004
/// magnetizing_inductance_h = 0.156
/// inertia_kg_m2 = 0.045
/// viscous_friction_nm_s_per_rad = 0.004
///
/// [machine.rating]                      # may be left out: then guessed
/// torque_nm = 26.0
/// electrical_frequency_hz = 50.0
/// phase_voltage_peak_v = 320.0
/// rotor_flux_vs = 0.95
///
/// [machine.air_gap]                     # only for machines whose air-gap flux saturates iron and leakage by laws of their own
/// reference_flux_vs = 0.9               # where the T circuit holds; the other keys are those of [`AirGapSaturation`](crate::AirGapSaturation)
///
/// [effects.iron_loss]                   # one table for each effect that is on
/// conductance_s = 0.001
///
/// [prediction]                          # of a fitted motor: half widths of the bands that hold 95 % of readings, √(first² + (second·|i|)²)
/// current_a = 0.21                      # of each axis of the current, A
/// current_per_ampere = 0.013            # A per A peak of stator current
/// speed_rad_s = 0.4                     # of the speed, rad/s; both keys of the speed may be left out
/// speed_rad_s_per_ampere = 0.02
/// ```
///
/// Parameters of an effect that are left out take the value usual for a machine of this rating; a strength left out is zero.
///
/// Any parameter may be `{ value = 1.5, tolerance = 0.02 }` in place of its number: known to ± 2 % (95 % of cases), which fits then
/// respect; 0 holds it. `measured` gives what was measured where `value` is something else, as in a refined motor.
///
/// `[prediction]` is of the model that was fitted, and stays as it is when somebody edits the numbers above it.
#[derive(Clone, Debug, PartialEq)]
pub struct MotorFile {
    /// What the machine is called.
    pub name: String,
    /// Base parameters, pole pairs and effects, checked.
    pub machine: Machine<f64>,
    /// What the machine is built for; guessed where the file gives none.
    pub rating: Rating,
    /// What is known of parameters beside their values here.
    pub known: BTreeMap<ParameterId, Known>,
    /// Temperature of stator winding and rotor at which R_s and R_r hold, °C, where it is known.
    pub winding_c: Option<f64>,
    /// Design of the rotor, where it is known.
    pub design: Option<DesignClass>,
    /// What the model left of the recordings that it was fitted to, where it was.
    pub prediction: Option<Prediction>,
}

/// What is known of a parameter before any recording: measured, from a data sheet, or of such machines in general.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Known {
    /// The value, in the parameter's unit.
    pub value: f64,
    /// By how much of it the truth may differ, in 95 of 100 cases; zero: it is held.
    pub tolerance: f64,
}

/// A wider tolerance says nothing.
const WIDEST_TOLERANCE: f64 = 10.0;

/// Part of the losses on a nameplate that the copper of the stator makes at least: less is a resistance in another unit.
const LEAST_COPPER_SHARE: f64 = 0.02;

/// By how much guesses by rules of thumb are off (0.5 to 2 times on the named machines; `nameplate.rs`), R_s, R_r, L_ls, L_lr, L_m, J.
const BY_RULE: [f64; 6] = [1.0, 1.0, 1.0, 1.0, 1.0, 1.5];
/// The same with the locked-rotor current or the breakdown torque.
const BY_DATA_SHEET: [f64; 6] = [1.0, 0.2, 0.3, 0.3, 0.2, 1.5];
/// Of a resistance between terminals, measured cold: the winding is warmer in use.
pub const WARMER_IN_USE: f64 = 0.3;
/// The same at a temperature that is known: instruments, and two kelvin.
const MEASURED: f64 = 0.02;
/// Temperatures of windings, °C.
pub const WINDING_C: Bound = Bound::Within(-100.0, 300.0);
/// A machine that has not run, °C: what standards refer resistances to.
const COLD_C: f64 = 25.0;
/// A motor's rotor at its rated point, °C: the reference of thermal class 130 (B), as warm as most are used (IEC 60034-2-1).
const RATED_C: f64 = 95.0;

/// Numbers by key; which keys there are is in the registry of effects and parameters.
type Numbers = Spanned<BTreeMap<Spanned<String>, Spanned<toml::Value>>>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MotorToml {
    machine: Head,
    #[serde(default)]
    effects: BTreeMap<Spanned<String>, Numbers>,
    prediction: Option<Spanned<PredictionToml>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Head {
    name: Option<String>,
    pole_pairs: Whole<1, 100>,
    winding_c: Option<Within<-100, 300>>,
    design: Option<Spanned<String>>,
    parameters: Numbers,
    rating: Option<Numbers>,
    air_gap: Option<Numbers>,
}

const RATING: [&str; 4] = ["torque_nm", "electrical_frequency_hz", "phase_voltage_peak_v", "rotor_flux_vs"];

/// A resistance between two terminals, measured with direct current.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TerminalResistance {
    /// Ω.
    pub ohm: f64,
    /// Temperature of the winding then, °C, where it is known.
    pub at_c: Option<f64>,
}

impl MotorFile {
    /// A motor of which nothing is known beside its parameters and its rating.
    pub fn new(name: impl Into<String>, machine: Machine<f64>, rating: Rating) -> Self {
        Self { name: name.into(), machine, rating, known: BTreeMap::new(), winding_c: None, design: None, prediction: None }
    }

    /// Standard deviation of ln(L_ls/L_lr): how well the ratio of the leakages is known ([`DesignClass::leakage_ratio_std`]).
    pub fn leakage_ratio_std(&self) -> f64 {
        DesignClass::leakage_ratio_std(self.design, self.machine.parameters().leakage_ratio())
    }

    /// The temperature at which R_s and R_r hold: where none is known, that of a cold machine.
    pub fn reference_c(&self) -> f64 {
        self.winding_c.unwrap_or(COLD_C)
    }

    /// R_s and R_r with windings of these temperatures, over those of the machine.
    pub fn warmth(&self, stator_c: f64, rotor_c: f64) -> [f64; 2] {
        let from = self.reference_c();
        [Conductor::Copper.warmed(from, stator_c), Conductor::Aluminium.warmed(from, rotor_c)]
    }

    /// A first motor from its nameplate, every parameter with the tolerance of such a guess, and the guess itself; a measured `resistance`
    /// replaces that of the stator.
    ///
    /// # Errors
    /// As [`Nameplate::guess`]; a resistance whose heat at the rated current is more than all losses; a temperature that no winding has.
    pub fn from_nameplate(
        name: &str,
        plate: &Nameplate,
        resistance: Option<TerminalResistance>,
    ) -> Result<(Self, NameplateGuess), ModelError> {
        let guess = plate.guess()?;
        // More digits than a guess has would say that it is more.
        let mut p = TParameters::from_values(guess.parameters.values().map(four_digits));
        let r = guess.rating;
        let [torque_nm, phase_voltage_peak_v, rotor_flux_vs] =
            [r.torque_nm, r.phase_voltage_peak_v, r.rotor_flux_vs].map(four_digits);
        let rating = Rating { torque_nm, phase_voltage_peak_v, rotor_flux_vs, ..r };
        let data_sheet = plate.locked_rotor_current_ratio.or(plate.breakdown_torque_ratio).is_some();
        let mut tolerances = if data_sheet { BY_DATA_SHEET } else { BY_RULE };
        let winding_c = resistance.and_then(|r| r.at_c);
        if let Some(r) = resistance {
            BaseParameter::StatorResistance.bound().check("terminal_resistance_ohm", r.ohm)?;
            let most = 2.0 * plate.losses_w() / (3.0 * plate.line_current_rms_a * plate.line_current_rms_a);
            Bound::Within(four_digits(LEAST_COPPER_SHARE * most), four_digits(most)).check("terminal_resistance_ohm", r.ohm)?;
            // Star or delta: the star-equivalent phase has half of what two terminals show.
            p.stator_resistance_ohm = 0.5 * r.ohm;
            tolerances[0] = if winding_c.is_some() { MEASURED } else { WARMER_IN_USE };
        }
        if let Some(at_c) = winding_c {
            WINDING_C.check("temperature of the winding, °C,", at_c)?;
            // The rated point is a warm one.
            p.rotor_resistance_ohm = four_digits(p.rotor_resistance_ohm * Conductor::Aluminium.warmed(RATED_C, at_c));
        }
        let machine = Machine::try_new(p, guess.pole_pairs, Effects::scaled(&rating, &p, guess.pole_pairs))?;
        let known = BaseParameter::ALL.into_iter().zip(p.values()).zip(tolerances);
        let known = known.map(|((id, value), tolerance)| (ParameterId::Base(id), Known { value, tolerance })).collect();
        Ok((Self { known, winding_c, design: plate.design, ..Self::new(name, machine, rating) }, guess))
    }

    /// The same motor with an effect at the geometric middle of its usual sizes.
    ///
    /// # Errors
    /// That is none which the machine can have.
    pub fn with_usual(&self, effect: EffectId) -> Result<Self, ModelError> {
        let mut machine = self.machine;
        for (k, info) in effect.parameters().iter().enumerate().filter(|(_, p)| p.role == Role::Strength) {
            let unit = self.rating.unit_of(info.scale, machine.parameters(), machine.pole_pairs());
            let middle = (info.typical.0 * info.typical.1).sqrt() * unit;
            machine = machine.with(&[(ParameterId::Effect(effect, k), middle)])?;
        }
        Ok(Self { machine, ..self.clone() })
    }

    /// Reads a file.
    ///
    /// # Errors
    /// The file cannot be read, is not TOML, has an unknown key, lacks one, or a value is of the wrong type or outside its bound;
    /// the error carries line and key.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, FileError> {
        Self::read_with(path, &[])
    }

    /// As [`read`](Self::read), with effects of the user's own, which may then have a table in the file.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn read_with(path: impl AsRef<Path>, custom: &[CustomId]) -> Result<Self, FileError> {
        let path = path.as_ref();
        let text = read_text(path)?;
        let label = path.display().to_string();
        Self::parse_with(&text, &label, custom)
    }

    /// Reads text; `label` names the file in messages.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(text: &str, label: &str) -> Result<Self, FileError> {
        Self::parse_with(text, label, &[])
    }

    /// As [`parse`](Self::parse), with effects of the user's own.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse_with(text: &str, label: &str, custom: &[CustomId]) -> Result<Self, FileError> {
        let keys = BaseParameter::ALL.map(BaseParameter::key).join(", ");
        let hints = [
            ("machine", "write [machine] with pole_pairs, and [machine.parameters]"),
            ("pole_pairs", "a whole number, 2 for a machine of nearly 1500 rpm at 50 Hz"),
            ("parameters", &format!("write [machine.parameters] with {keys}")),
            PredictionToml::HINTS[0],
            PredictionToml::HINTS[1],
        ];
        let toml = TomlText::new(text, label, &hints).of_kind(FileKind::Motor);
        let MotorToml { machine: head, effects: tables, prediction } = toml.read()?;
        let pole_pairs = head.pole_pairs.0 as u32;
        let mut known = BTreeMap::new();
        let p = parameters(&toml, &head.parameters, &mut known)?;
        let rating = match &head.rating {
            Some(table) => rating(&toml, table)?,
            None => Rating::guess(&p, pole_pairs),
        };
        if head.rating.is_some() {
            check_run_up_time(&toml, &head.parameters, &p, &rating, pole_pairs)?;
        }
        let mut effects = Effects::none();
        for &id in custom {
            effects.add_custom(id);
        }
        effects.rescale(&rating, &p, pole_pairs);
        add_free_forms(&toml, &tables, &mut effects)?;
        read_effects(&toml, &tables, &mut effects, &mut known)?;
        let gap = head.air_gap.as_ref().map(|table| air_gap(&toml, table)).transpose()?;
        let machine = Machine::try_new(p, pole_pairs, effects).and_then(|m| m.with_air_gap(gap)).map_err(|e| toml.value(e))?;
        let design = head.design.map(|name| {
            let class = DesignClass::from_name(name.get_ref());
            class.ok_or_else(|| toml.unexpected(name.span(), None, DesignClass::NAMES))
        });
        let prediction = prediction.map(|table| Prediction::read(&toml, table)).transpose()?;
        let name = head.name.unwrap_or_else(|| "motor".to_owned());
        let winding_c = head.winding_c.map(|c| c.0);
        Ok(Self { name, machine, rating, known, winding_c, design: design.transpose()?, prediction })
    }

    /// The file's text. Reading it gives the same machine, bit for bit, with effects that are off at their defaults.
    pub fn to_toml(&self) -> String {
        let mut out = String::new();
        let p = self.machine.parameters();
        // Writing to a string cannot fail.
        let _ = writeln!(out, "# star-equivalent, T circuit, SI units");
        if !self.known.is_empty() {
            let _ = writeln!(
                out,
                "# tolerance: in 95 of 100 cases the value is within a factor of 1 + tolerance; measured: of this value instead, known before a fit"
            );
        }
        let _ = writeln!(out, "[machine]\nname = {}\npole_pairs = {}", quoted(&self.name), self.machine.pole_pairs());
        if let Some(at_c) = self.winding_c {
            let _ = writeln!(out, "winding_c = {}", exact(at_c));
        }
        if let Some(design) = self.design {
            let _ = writeln!(out, "design = {}", quoted(design.name()));
        }
        let _ = writeln!(out, "\n[machine.parameters]");
        for (parameter, x) in BaseParameter::ALL.into_iter().zip(p.values()) {
            let _ = writeln!(out, "{} = {}", parameter.key(), self.number(ParameterId::Base(parameter), x));
        }
        let r = &self.rating;
        let _ = writeln!(out, "\n[machine.rating]");
        for (key, x) in RATING.into_iter().zip([r.torque_nm, r.electrical_frequency_hz, r.phase_voltage_peak_v, r.rotor_flux_vs])
        {
            let _ = writeln!(out, "{key} = {}", exact(x));
        }
        if let Some(gap) = self.machine.air_gap() {
            let _ = writeln!(out, "\n[machine.air_gap]");
            for ((key, _), x) in AirGapSaturation::<f64>::KEYS.into_iter().zip(gap.values()) {
                let _ = writeln!(out, "{key} = {}", exact(x));
            }
        }
        for id in self.machine.effects().active() {
            let _ = writeln!(out, "\n[effects.{id}]");
            for (k, info) in id.parameters().iter().enumerate() {
                let x = self.machine.effects().get(id, k);
                let _ = writeln!(out, "{} = {}", info.key, self.number(ParameterId::Effect(id, k), x));
            }
        }
        if let Some(prediction) = &self.prediction {
            let _ = writeln!(
                out,
                "\n# 95 % of readings lie within sqrt(first^2 + (second |i|)^2) of the model as it was fitted\n[prediction]"
            );
            for (key, x) in prediction.entries() {
                let _ = writeln!(out, "{key} = {}", exact(x));
            }
        }
        out
    }

    /// A number, with what is known of it.
    fn number(&self, id: ParameterId, x: f64) -> String {
        let Some(k) = self.known.get(&id) else { return exact(x) };
        let measured = if k.value == x { String::new() } else { format!(", measured = {}", exact(k.value)) };
        format!("{{ value = {}{measured}, tolerance = {} }}", exact(x), exact(k.tolerance))
    }

    /// Writes the file, as a whole or not at all.
    ///
    /// # Errors
    /// The system refuses; the old file is then unchanged.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), FileError> {
        write_atomically(path.as_ref(), |out| out.write_all(self.to_toml().as_bytes()))
    }
}

/// A number, or `{ value, tolerance }` with `measured` where that is another value.
fn known_number(
    toml: &TomlText<'_>,
    given: &Spanned<toml::Value>,
    key: &'static str,
    bound: Bound,
) -> Result<(f64, Option<Known>), FileError> {
    let Some(table) = given.get_ref().as_table() else { return Ok((toml.number(given, key, bound)?, None)) };
    const KEYS: [&str; 3] = ["value", "measured", "tolerance"];
    if let Some(other) = table.keys().find(|k| !KEYS.contains(&k.as_str())) {
        let expected = format!("no more than {}", KEYS.join(", "));
        return Err(toml.unexpected(given.span(), Some(&format!("given with {other}")), expected));
    }
    // What stands inside a table has the place of the table.
    let part = |key: &str| table.get(key).map(|v| Spanned::new(given.span(), v.clone()));
    let missing = |key| toml.missing(given.span(), key, "{ value = a number, tolerance = 0.02 for ± 2 %; 0 holds it }");
    let value = toml.number(&part("value").ok_or_else(|| missing("value"))?, key, bound)?;
    let measured = part("measured").map(|m| toml.number(&m, key, bound)).transpose()?.unwrap_or(value);
    let tolerance = part("tolerance").ok_or_else(|| missing("tolerance"))?;
    let tolerance = toml.number(&tolerance, "tolerance", Bound::Within(0.0, WIDEST_TOLERANCE))?;
    Ok((value, Some(Known { value: measured, tolerance })))
}

/// The numbers of a table, in the order of `keys`; none where one is left out. What is known of them is noted under the name of each.
fn numbers(
    toml: &TomlText<'_>,
    table: &Numbers,
    keys: &[(&'static str, Bound)],
    mut note: impl FnMut(usize, Known),
) -> Result<Vec<Option<f64>>, FileError> {
    let mut values = vec![None; keys.len()];
    for (key, value) in table.get_ref() {
        let Some(k) = keys.iter().position(|(known, _)| known == key.get_ref()) else {
            let known: Vec<&str> = keys.iter().map(|(k, _)| *k).collect();
            return Err(toml.unknown(key.span(), key.get_ref(), &known));
        };
        let (x, known) = known_number(toml, value, keys[k].0, keys[k].1)?;
        values[k] = Some(x);
        known.into_iter().for_each(|x| note(k, x));
    }
    Ok(values)
}

type KnownBy = BTreeMap<ParameterId, Known>;

fn parameters(toml: &TomlText<'_>, table: &Numbers, known: &mut KnownBy) -> Result<TParameters<f64>, FileError> {
    let note = |k: usize, x| {
        known.insert(ParameterId::Base(BaseParameter::ALL[k]), x);
    };
    let given = numbers(toml, table, &BaseParameter::ALL.map(|p| (p.key(), p.bound())), note)?;
    let mut values = [0.0; 7];
    for ((x, given), p) in values.iter_mut().zip(given).zip(BaseParameter::ALL) {
        let expected = || format!("a number, {}; {} of the T circuit", p.bound(), p.symbol());
        *x = given.ok_or_else(|| toml.missing(table.span(), p.key(), expected()))?;
    }
    Ok(TParameters::from_values(values))
}

fn rating(toml: &TomlText<'_>, table: &Numbers) -> Result<Rating, FileError> {
    let given = numbers(toml, table, &Rating::BOUNDS, |_, _| ())?;
    let mut values = [0.0; 4];
    for ((x, given), (key, _)) in values.iter_mut().zip(given).zip(Rating::BOUNDS) {
        let expected = "give all four of the rating, or leave the table out and the rating is guessed";
        *x = given.ok_or_else(|| toml.missing(table.span(), key, expected))?;
    }
    let [torque_nm, electrical_frequency_hz, phase_voltage_peak_v, rotor_flux_vs] = values;
    Ok(Rating { torque_nm, electrical_frequency_hz, phase_voltage_peak_v, rotor_flux_vs })
}

/// A number as it is printed with four digits.
fn four_digits(x: f64) -> f64 {
    format!("{x:.3e}").parse().unwrap_or(x)
}

/// Seconds in which rated torque brings a machine alone to rated speed; machines take milliseconds to minutes.
const RUN_UP_S: [f64; 2] = [1e-4, 1e5];

/// Refuses an inertia that no machine of such a rating has.
fn check_run_up_time(
    toml: &TomlText<'_>,
    parameters: &Numbers,
    p: &TParameters<f64>,
    rating: &Rating,
    pole_pairs: u32,
) -> Result<(), FileError> {
    let (key, unit) = (BaseParameter::Inertia.key(), rating.synchronous_speed_rad_s(pole_pairs) / rating.torque_nm);
    let run_up_s = p.inertia_kg_m2 * unit;
    let [low, high] = RUN_UP_S;
    if (low..=high).contains(&run_up_s) {
        return Ok(());
    }
    let expected = format!(
        "an inertia that rated torque brings to rated speed in {low} s to {high} s, which is {:.1e} to {:.1e} kg m² with this rating; it takes {run_up_s:.1e} s",
        low / unit,
        high / unit
    );
    let given = parameters.get_ref().iter().find(|(k, _)| k.get_ref() == key);
    let at = given.map_or_else(|| parameters.span(), |(_, value)| value.span());
    Err(toml.unexpected(at, None, expected))
}

fn air_gap(toml: &TomlText<'_>, table: &Numbers) -> Result<AirGapSaturation<f64>, FileError> {
    let given = numbers(toml, table, &AirGapSaturation::<f64>::KEYS, |_, _| ())?;
    let mut values = [0.0; 9];
    for ((x, given), (key, _)) in values.iter_mut().zip(given).zip(AirGapSaturation::<f64>::KEYS) {
        let expected = "give all nine of the air gap, or leave the table out";
        *x = given.ok_or_else(|| toml.missing(table.span(), key, expected))?;
    }
    Ok(AirGapSaturation::from_values(values))
}

/// Defines the free-form effects that the file has a table of, each on the range that stands there.
fn add_free_forms(
    toml: &TomlText<'_>,
    tables: &BTreeMap<Spanned<String>, Numbers>,
    effects: &mut Effects<f64>,
) -> Result<(), FileError> {
    for (name, table) in tables {
        let Some((acts, over)) = FreeForm::of_name(name.get_ref()) else { continue };
        let unplaced = FreeForm::define(acts, over, (0.0, 1.0), 1.0);
        let keys: Vec<(&'static str, Bound)> = unplaced.parameters().iter().map(|p| (p.key, p.bound)).collect();
        let given = numbers(toml, table, &keys, |_, _| ())?;
        let missing = |k: usize| toml.missing(table.span(), keys[k].0, "where the learned curve lies");
        let place = |k: usize| given[k].ok_or_else(|| missing(k));
        let first = place(FreeForm::SPREAD + 1)?;
        let id = if over.is_angle() {
            FreeForm::define(acts, over, (0.0, 1.0), first)
        } else {
            let last = place(FreeForm::SPREAD + 2)?;
            if last <= first {
                let key = keys[FreeForm::SPREAD + 2].0;
                let expected = format!("more than {first}, where the curve begins");
                return Err(toml.unexpected(table.span(), Some(&format!("given with {key} = {last}")), expected));
            }
            FreeForm::define(acts, over, (first, last), 1.0)
        };
        if !effects.add_custom(id) {
            let expected = format!("at most {MAX_CUSTOM} effects that are learned or one's own");
            return Err(toml.unexpected(name.span(), Some("one too many"), expected));
        }
    }
    Ok(())
}

fn read_effects(
    toml: &TomlText<'_>,
    tables: &BTreeMap<Spanned<String>, Numbers>,
    effects: &mut Effects<f64>,
    known: &mut KnownBy,
) -> Result<(), FileError> {
    let ids: Vec<EffectId> = effects.ids().collect();
    for (name, table) in tables {
        let Some(&id) = ids.iter().find(|id| id.name() == name.get_ref()) else {
            let known: Vec<&str> = ids.iter().map(|id| id.name()).collect();
            return Err(toml.unknown(name.span(), name.get_ref(), &known));
        };
        let keys: Vec<(&'static str, Bound)> = id.parameters().iter().map(|p| (p.key, p.bound)).collect();
        let note = |k: usize, x| {
            known.insert(ParameterId::Effect(id, k), x);
        };
        for (k, x) in numbers(toml, table, &keys, note)?.into_iter().enumerate() {
            if let Some(x) = x {
                effects.set(id, k, x);
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prediction::ErrorBand;
    use proptest::prelude::*;

    const GOOD: &str = "[machine]\nname = \"m\"\npole_pairs = 2\n\n[machine.parameters]\nstator_resistance_ohm = 1.5\n\
        rotor_resistance_ohm = 0.9\nstator_leakage_inductance_h = 0.004\nrotor_leakage_inductance_h = 0.004\n\
        magnetizing_inductance_h = 0.156\ninertia_kg_m2 = 0.045\nviscous_friction_nm_s_per_rad = 0\n";

    fn error(text: &str) -> String {
        MotorFile::parse(text, "motor.toml").unwrap_err().to_string()
    }

    /// 4 kW at 400 V, 8.1 A, cos φ 0.83 leave 658 W of losses: 6.7 Ω between two terminals would take them all.
    #[test]
    fn a_resistance_that_loses_more_than_the_nameplate_is_refused() {
        let plate = Nameplate {
            power_w: 4000.0,
            line_voltage_rms_v: 400.0,
            line_current_rms_a: 8.1,
            speed_rpm: 1440.0,
            power_factor: 0.83,
            frequency_hz: 50.0,
            locked_rotor_current_ratio: None,
            locked_rotor_torque_ratio: None,
            breakdown_torque_ratio: None,
            design: None,
        };
        let made = |ohm| MotorFile::from_nameplate("m", &plate, Some(TerminalResistance { ohm, at_c: Some(20.0) }));
        assert_eq!(made(2.7).unwrap().0.machine.parameters().stator_resistance_ohm, 1.35);
        let refused = made(270.0).unwrap_err().to_string();
        assert!(refused.contains("terminal_resistance_ohm = 270 must be from 0.1337 to 6.68"), "{refused}");
        assert!(made(0.0027).is_err());
    }

    #[test]
    fn a_rating_left_out_is_guessed_and_effects_are_scaled_to_it() {
        let m = MotorFile::parse(GOOD, "motor.toml").unwrap();
        assert_eq!(m.rating, Rating::guess(m.machine.parameters(), 2));
        assert_eq!(*m.machine.effects(), Effects::scaled(&m.rating, m.machine.parameters(), 2));
        let with = format!("{GOOD}[effects.inverter_nonlinearity]\nvoltage_v = 3\n");
        let with = MotorFile::parse(&with, "motor.toml").unwrap();
        assert!(with.machine.effects().is_on(EffectId::InverterNonlinearity));
        assert_eq!(
            with.machine.effects().inverter_nonlinearity.zero_crossing_current_a,
            m.machine.effects().inverter_nonlinearity.zero_crossing_current_a
        );
    }

    #[test]
    fn errors_point_at_line_and_key() {
        let bad = |from: &str, to: &str| error(&GOOD.replace(from, to));
        assert_eq!(
            bad("magnetizing_inductance_h = 0.156", "magnetizing_inductance_h = -0.2"),
            "motor.toml:10: magnetizing_inductance_h = -0.2 must be positive and finite"
        );
        assert_eq!(
            bad("rotor_resistance_ohm", "rotor_resistence_ohm"),
            "motor.toml:7: unknown key rotor_resistence_ohm in [machine.parameters]; did you mean rotor_resistance_ohm?"
        );
        assert_eq!(
            bad("= 0.045", "= \"heavy\""),
            "motor.toml:11: inertia_kg_m2 is the text \"heavy\", expected a number, from 1e-10 to 1e8, where all machines are"
        );
        assert_eq!(
            bad("pole_pairs = 2", "pole_pairs = 2.5"),
            "motor.toml:3: pole_pairs is 2.5, expected a whole number from 1 to 100"
        );
        assert_eq!(bad("0.045", "nan"), "motor.toml:11: inertia_kg_m2 = NaN must be positive and finite");
        let missing = bad("inertia_kg_m2 = 0.045\n", "");
        assert!(missing.starts_with("motor.toml:5: inertia_kg_m2 is missing in [machine.parameters]: "), "{missing}");
        let syntax = bad("0.045", "0.0.45");
        assert!(syntax.starts_with("motor.toml:11: not TOML"), "{syntax}");
        assert!(error("").starts_with("motor.toml: machine is missing at the top of the file"), "{}", error(""));
        let effect = error(&format!("{GOOD}[effects.iron_los]\nconductance_s = 1e-3\n"));
        assert_eq!(effect, "motor.toml:13: unknown key iron_los in [effects]; did you mean iron_loss?");
        let bound = error(&format!("{GOOD}[effects.iron_loss]\nconductance_s = -1e-3\n"));
        assert_eq!(bound, "motor.toml:14: conductance_s = -0.001 must be zero or positive, and finite");
        let rating = error(&format!("{GOOD}[machine.rating]\ntorque_nm = 20\n"));
        assert!(rating.contains("electrical_frequency_hz is missing in [machine.rating]"), "{rating}");
        let rated = |j: &str| {
            let rating = "torque_nm = 20\nelectrical_frequency_hz = 50\nphase_voltage_peak_v = 320\nrotor_flux_vs = 0.95\n";
            MotorFile::parse(&format!("{}[machine.rating]\n{rating}", GOOD.replace("0.045", j)), "motor.toml")
        };
        assert!(rated("0.045").is_ok() && rated("1e-4").is_ok());
        let light = rated("1e-8").unwrap_err().to_string();
        let begins =
            "motor.toml:11: inertia_kg_m2 is 1e-8, expected an inertia that rated torque brings to rated speed in 0.0001 s";
        assert!(light.starts_with(begins) && light.ends_with("it takes 7.9e-8 s"), "{light}");
        assert!(rated("1e7").is_err());
        let nowhere = MotorFile::read("/no/such/motor.toml").unwrap_err();
        assert_eq!(nowhere.to_string(), "/no/such/motor.toml: cannot read it: no such file or folder");
    }

    #[test]
    fn a_parameter_may_come_with_a_tolerance() {
        let with = |text: &str| MotorFile::parse(&GOOD.replace("_ohm = 1.5", &format!("_ohm = {text}")), "motor.toml");
        let id = ParameterId::Base(BaseParameter::StatorResistance);
        let m = with("{ value = 1.5, tolerance = 0.02 }").unwrap();
        assert_eq!((m.machine.get(id), m.known[&id]), (1.5, Known { value: 1.5, tolerance: 0.02 }));
        let m = with("{ value = 1.6, measured = 1.5, tolerance = 0 }").unwrap();
        assert_eq!((m.machine.get(id), m.known[&id]), (1.6, Known { value: 1.5, tolerance: 0.0 }));
        let e = |text| with(text).unwrap_err().to_string();
        assert_eq!(e("{ value = 1.5, tolerance = -0.1 }"), "motor.toml:6: tolerance = -0.1 must be from 0 to 10");
        assert!(e("{ value = 1.5 }").starts_with("motor.toml:6: tolerance is missing"), "{}", e("{ value = 1.5 }"));
        assert!(
            e("{ value = 1.5, tol = 1 }").contains("is given with tol, expected no more than value"),
            "{}",
            e("{ value = 1.5, tol = 1 }")
        );
    }

    fn positive() -> impl Strategy<Value = f64> {
        (-6.0..3.0f64).prop_map(|e| 10f64.powf(e))
    }

    proptest! {
        /// Whatever the numbers, the name and the set of effects: the text reads back as the same bits.
        #[test]
        fn write_then_read_round_trips_exactly(
            values in prop::array::uniform7(positive()),
            run_up_s in (-3.0..3.0f64).prop_map(|e| 10f64.powf(e)),
            rating in prop::array::uniform4(positive().prop_map(|x| x.max(1e-3))),
            pole_pairs in 1u32..=100,
            name in any::<String>(),
            on in any::<u32>(),
            tolerances in any::<u8>(),
            sizes in prop::collection::vec(0.0..1.0f64, 100),
        ) {
            let [torque_nm, electrical_frequency_hz, phase_voltage_peak_v, rotor_flux_vs] = rating;
            let rating = Rating { torque_nm, electrical_frequency_hz, phase_voltage_peak_v, rotor_flux_vs };
            let p = TParameters {
                inertia_kg_m2: run_up_s * torque_nm / rating.synchronous_speed_rad_s(pole_pairs),
                ..TParameters::from_values(values)
            };
            let values = p.values();
            let mut e = Effects::scaled(&rating, &p, pole_pairs);
            let mut size = sizes.into_iter().cycle();
            for (_, &id) in EffectId::ALL.iter().enumerate().filter(|(bit, _)| on >> bit & 1 == 1) {
                for (k, info) in id.parameters().iter().enumerate() {
                    let s = size.next().unwrap_or(0.5);
                    let typical = info.typical.0 + s * (info.typical.1 - info.typical.0);
                    let x = match info.bound {
                        Bound::Within(a, b) if info.role == Role::Strength => typical.clamp(a, b),
                        Bound::Within(a, b) => a + s * (b - a),
                        Bound::Whole(..) => typical.round(),
                        // Scaled to a machine of any size, a usual number may be none that a machine has.
                        _ => (typical * rating.unit_of(info.scale, &p, pole_pairs)).clamp(Bound::SMALLEST, Bound::LARGEST),
                    };
                    e.set(id, k, x);
                }
            }
            // Nor may the default of an effect that is off.
            let machine = Machine::try_new(p, pole_pairs, e);
            prop_assume!(!matches!(machine, Err(ModelError::OutOfBounds { .. })));
            let machine = machine.unwrap();
            let mut known = BTreeMap::new();
            for (k, p) in BaseParameter::ALL.into_iter().enumerate().filter(|(k, _)| tolerances >> k & 1 == 1) {
                let value = if k % 2 == 0 { values[k] } else { 1.1 * values[k] };
                known.insert(ParameterId::Base(p), Known { value, tolerance: f64::from(k as u8) * 0.01 });
            }
            let winding_c = (on & 1 == 1).then_some(100.0 * run_up_s.sin());
            let design = [None, Some(DesignClass::B), Some(DesignClass::C)][on as usize % 3];
            let band = |k: usize| ErrorBand { fixed: values[k], per_ampere: values[k + 1] };
            let prediction = (on & 2 == 2).then(|| Prediction { current: band(0), speed: (on & 4 == 4).then(|| band(2)) });
            let file = MotorFile { name, machine, rating, known, winding_c, design, prediction };
            let text = file.to_toml();
            let back = MotorFile::parse(&text, "again").map_err(|e| TestCaseError::fail(format!("{e}\n{text}")))?;
            prop_assert_eq!(&back, &file);
            prop_assert_eq!(back.to_toml(), text);
        }

        /// No text makes the reader panic.
        #[test]
        fn any_text_is_read_or_refused(cut in 0usize..400, junk in ".{0,12}") {
            let cut = GOOD.char_indices().map(|(k, _)| k).take_while(|k| *k <= cut).last().unwrap_or(0);
            let _ = MotorFile::parse(&format!("{}{junk}{}", &GOOD[..cut], &GOOD[cut..]), "x");
            let _ = MotorFile::parse(&junk, "x");
        }
    }

    #[test]
    fn a_file_is_written_and_read_back() {
        let path = std::env::temp_dir().join(format!("im-model-motor-{}.toml", std::process::id()));
        let m = MotorFile::parse(GOOD, "motor.toml").unwrap();
        m.write(&path).unwrap();
        assert_eq!(MotorFile::read(&path).unwrap(), m);
        std::fs::remove_file(&path).unwrap();
    }
}
