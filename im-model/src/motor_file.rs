//! `motor.toml`: a machine with its name, its rating and its effects.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

use crate::atomic_file::write_atomically;
use crate::effects::{CustomId, EffectId, Effects};
use crate::error::Bound;
use crate::file_error::{FileError, Problem};
use crate::machine::{Machine, Rating};
use crate::parameters::{BaseParameter, TParameters};
use crate::toml_reader::{Document, Table, exact, quoted};

/// The content of a `motor.toml`.
///
/// ```toml
/// [machine]
/// name = "pump drive 7"
/// pole_pairs = 2
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
/// [effects.iron_loss]                   # one table for each effect that is on
/// conductance_s = 0.001
/// ```
///
/// Parameters of an effect that are left out take the value usual for a machine of this rating; a strength left out is zero.
#[derive(Clone, Debug, PartialEq)]
pub struct MotorFile {
    /// What the machine is called.
    pub name: String,
    /// Base parameters, pole pairs and effects, checked.
    pub machine: Machine<f64>,
    /// What the machine is built for; guessed where the file gives none.
    pub rating: Rating,
}

const RATING: [&str; 4] = ["torque_nm", "electrical_frequency_hz", "phase_voltage_peak_v", "rotor_flux_vs"];

impl MotorFile {
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
        let label = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(|e| FileError::io(&label, "read", &e))?;
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
        let document = Document::parse(text, label)?;
        let top = document.top(&["machine", "effects"])?;
        let head = top
            .table("machine", &["name", "pole_pairs", "parameters", "rating"])?
            .ok_or_else(|| top.missing("machine", "write [machine] with pole_pairs, and [machine.parameters]"))?;
        let name = head.text("name")?.unwrap_or("motor").to_owned();
        let pole_pairs = head
            .whole("pole_pairs", (1, 100))?
            .ok_or_else(|| head.missing("pole_pairs", "a whole number, 2 for a machine of nearly 1500 rpm at 50 Hz"))?;
        let pole_pairs = pole_pairs as u32;
        let p = parameters(&head)?;
        let rating = rating(&head)?.unwrap_or_else(|| Rating::guess(&p, pole_pairs));
        let mut effects = Effects::none();
        for &id in custom {
            effects.add_custom(id);
        }
        effects.rescale(&rating, &p, pole_pairs);
        read_effects(&top, &mut effects)?;
        let machine =
            Machine::try_new(p, pole_pairs, effects).map_err(|e| FileError::new(label, None, None, Problem::Value(e)))?;
        Ok(Self { name, machine, rating })
    }

    /// The file's text. Reading it gives the same machine, bit for bit, with effects that are off at their defaults.
    pub fn to_toml(&self) -> String {
        let mut out = String::new();
        let p = self.machine.parameters();
        // Writing to a string cannot fail.
        let _ = writeln!(out, "# star-equivalent, T circuit, SI units");
        let _ = writeln!(out, "[machine]\nname = {}\npole_pairs = {}\n", quoted(&self.name), self.machine.pole_pairs());
        let _ = writeln!(out, "[machine.parameters]");
        for (parameter, x) in BaseParameter::ALL.into_iter().zip(p.values()) {
            let _ = writeln!(out, "{} = {}", parameter.key(), exact(x));
        }
        let r = &self.rating;
        let _ = writeln!(out, "\n[machine.rating]");
        for (key, x) in RATING.into_iter().zip([r.torque_nm, r.electrical_frequency_hz, r.phase_voltage_peak_v, r.rotor_flux_vs])
        {
            let _ = writeln!(out, "{key} = {}", exact(x));
        }
        for id in self.machine.effects().active() {
            let _ = writeln!(out, "\n[effects.{id}]");
            for (k, info) in id.parameters().iter().enumerate() {
                let _ = writeln!(out, "{} = {}", info.key, exact(self.machine.effects().get(id, k)));
            }
        }
        out
    }

    /// Writes the file, as a whole or not at all.
    ///
    /// # Errors
    /// The system refuses; the old file is then unchanged.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), FileError> {
        write_atomically(path.as_ref(), |out| out.write_all(self.to_toml().as_bytes()))
    }
}

fn parameters(head: &Table<'_>) -> Result<TParameters<f64>, FileError> {
    let keys = BaseParameter::ALL.map(BaseParameter::key);
    let table = head
        .table("parameters", &keys)?
        .ok_or_else(|| head.missing("parameters", format!("write [machine.parameters] with {}", keys.join(", "))))?;
    let mut values = [0.0; 7];
    for (x, p) in values.iter_mut().zip(BaseParameter::ALL) {
        *x = table
            .number(p.key(), p.bound())?
            .ok_or_else(|| table.missing(p.key(), format!("a number, {}; {} of the T circuit", p.bound(), p.symbol())))?;
    }
    Ok(TParameters::from_values(values))
}

fn rating(head: &Table<'_>) -> Result<Option<Rating>, FileError> {
    let Some(table) = head.table("rating", &RATING)? else { return Ok(None) };
    let mut values = [0.0; 4];
    for (x, key) in values.iter_mut().zip(RATING) {
        *x = table
            .number(key, Bound::Positive)?
            .ok_or_else(|| table.missing(key, "give all four of the rating, or leave the table out and the rating is guessed"))?;
    }
    let [torque_nm, electrical_frequency_hz, phase_voltage_peak_v, rotor_flux_vs] = values;
    Ok(Some(Rating { torque_nm, electrical_frequency_hz, phase_voltage_peak_v, rotor_flux_vs }))
}

fn read_effects(top: &Table<'_>, effects: &mut Effects<f64>) -> Result<(), FileError> {
    let ids: Vec<EffectId> = effects.ids().collect();
    let names: Vec<&'static str> = ids.iter().map(|id| id.name()).collect();
    let Some(all) = top.table("effects", &names)? else { return Ok(()) };
    for id in ids {
        let keys: Vec<&'static str> = id.parameters().iter().map(|p| p.key).collect();
        let Some(table) = all.table(id.name(), &keys)? else { continue };
        for (k, info) in id.parameters().iter().enumerate() {
            if let Some(x) = table.number(info.key, info.bound)? {
                effects.set(id, k, x);
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::Role;
    use proptest::prelude::*;

    const GOOD: &str = "[machine]\nname = \"m\"\npole_pairs = 2\n\n[machine.parameters]\nstator_resistance_ohm = 1.5\n\
        rotor_resistance_ohm = 0.9\nstator_leakage_inductance_h = 0.004\nrotor_leakage_inductance_h = 0.004\n\
        magnetizing_inductance_h = 0.156\ninertia_kg_m2 = 0.045\nviscous_friction_nm_s_per_rad = 0\n";

    fn error(text: &str) -> String {
        MotorFile::parse(text, "motor.toml").unwrap_err().to_string()
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
            "motor.toml:11: inertia_kg_m2 is the text \"heavy\", expected a number, positive and finite"
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
        let nowhere = MotorFile::read("/no/such/motor.toml").unwrap_err();
        assert_eq!(nowhere.to_string(), "/no/such/motor.toml: cannot read it: no such file or folder");
    }

    fn positive() -> impl Strategy<Value = f64> {
        (-6.0..3.0f64).prop_map(|e| 10f64.powf(e))
    }

    proptest! {
        /// Whatever the numbers, the name and the set of effects: the text reads back as the same bits.
        #[test]
        fn write_then_read_round_trips_exactly(
            values in prop::array::uniform7(positive()),
            rating in prop::array::uniform4(positive()),
            pole_pairs in 1u32..=100,
            name in any::<String>(),
            on in any::<u32>(),
            sizes in prop::collection::vec(0.0..1.0f64, 100),
        ) {
            let p = TParameters::from_values(values);
            let [torque_nm, electrical_frequency_hz, phase_voltage_peak_v, rotor_flux_vs] = rating;
            let rating = Rating { torque_nm, electrical_frequency_hz, phase_voltage_peak_v, rotor_flux_vs };
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
                        _ => typical * rating.unit_of(info.scale, &p, pole_pairs),
                    };
                    e.set(id, k, x);
                }
            }
            let machine = Machine::try_new(p, pole_pairs, e).unwrap();
            let file = MotorFile { name, machine, rating };
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
