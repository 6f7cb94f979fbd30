//! A first mapping for a file that has none: what its columns probably mean, by their names, their units and their numbers.

use std::f64::consts::PI;
use std::fmt::Write as _;

use im_model::{Complex, MotorFile, TextFormat, space_vector::from_phases, toml_text::quoted};

use super::instant::{Choice, Named};
use super::mapping::{Begin, Instant, Preface};
use super::names::{self, Origin};
use super::quality::steady;
use super::raw::RawTable;
use super::sniff::Sniffed;
use super::unit::{Quantity, Unit, in_name_among, named, share_in_name};
use crate::statistics::median;

/// Rows that are looked at.
pub const ROWS: usize = 100_000;

/// A mapping as a text to edit, and why it says what it says.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Draft {
    /// The text of the recording.toml.
    pub text: String,
    /// What was guessed and why, a sentence each.
    pub guesses: Vec<String>,
    /// The mapping that names no column and is completed by this one.
    pub completes: Option<String>,
    /// What could not be guessed and must be filled in, a sentence each; without any the mapping can be used as it is.
    pub missing: Vec<String>,
    /// What the voltages are by their names.
    pub(super) named: Option<Named>,
}

/// A column as the guessing sees it.
struct Seen<'a> {
    name: &'a str,
    /// As the mapping names it: a name in quotes, or a number.
    key: String,
    x: &'a [f64],
    unit: Option<Unit>,
    /// The same where the mapping must say it, for the name does not.
    said: Option<Unit>,
    quantity: Option<Quantity>,
    /// Which phase or axis its name says: a, b, c (0 to 2) or α, β (3, 4); line to line 5 to 7.
    place: Option<usize>,
    size: f64,
    /// Who made it, by its name.
    origin: Origin,
    taken: bool,
}

/// Drafts the mapping of a table whose columns have been read as far as they are numbers, of a file or, else, from memory; `said` is kept.
pub fn draft(table: &RawTable, name: &str, is_file: bool, sniffed: &Sniffed, said: &Preface, motor: &MotorFile) -> Draft {
    let format = &sniffed.format;
    let has_names = format.header != Some(false);
    let completes = Some(said.label.clone()).filter(|l| !l.is_empty());
    let mut d = Draft { completes, ..Draft::default() };
    let n = table.len();
    let mut seen: Vec<Seen<'_>> = table
        .names
        .iter()
        .zip(&table.columns)
        .enumerate()
        .filter(|(_, (_, x))| x.len() == n && x.iter().all(|v| v.is_finite()))
        .map(|(k, (name, x))| {
            let under = sniffed.units.get(k).and_then(|u| named(u)).filter(|_| !table.clocks[k]);
            // "Channel A" is no current where the line of units says V.
            let named_unit = if table.clocks[k] { named("s") } else { in_name_among(name, &table.names) };
            let unit = under.or(named_unit);
            let said = under.filter(|u| named_unit != Some(*u));
            let quantity = unit.map(|u| u.quantity).or_else(|| names::quantity(name));
            let mean = x.iter().sum::<f64>() / n as f64;
            let size = (x.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n as f64).sqrt();
            let key = if has_names { quoted(name) } else { (k + 1).to_string() };
            Seen {
                name,
                key,
                x,
                unit,
                said,
                quantity,
                place: names::place(name, named_unit),
                size,
                origin: names::origin(name),
                taken: false,
            }
        })
        .collect();
    let mut text = String::new();
    // A name with a line end in it would end the comment.
    let shown = name.replace(char::is_control, "?");
    let _ = writeln!(text, "# What the columns of {shown} mean: a draft by im. Check every line.");
    if is_file {
        let _ = writeln!(text, "# Saved as recording.toml it holds for every file of the folder.\n\n{}", Draft::names(name));
    } else {
        text.push('\n');
    }
    let other = if said.begin == Begin::Auto { "      # \"at_rest\", \"in_motion\"" } else { "" };
    let _ = writeln!(text, "start = {:?}{other}", said.begin.word());
    if let Some(c) = said.winding_c {
        let _ = writeln!(text, "winding_c = {c:?}");
    }
    text.push('\n');
    text_section(&mut text, format, has_names);
    let dt = time_section(&mut text, &mut d, &mut seen);
    let rated_v = motor.rating.phase_voltage_peak_v;
    let duty = duty_section(&mut text, &mut d, &mut seen);
    let voltage =
        if duty.is_some() { duty } else { set_section(&mut text, &mut d, &mut seen, Quantity::Voltage, None, dt, rated_v) };
    let dt = time_unit(&mut text, &mut d, voltage.as_deref(), dt, motor);
    let current = set_section(&mut text, &mut d, &mut seen, Quantity::Current, voltage.as_deref(), dt, rated_v);
    let turning = match (&voltage, &current, dt) {
        (Some(u), Some(i), Some(dt)) => {
            let stretches = steady::stretches(u, i, None, dt);
            stretches.into_iter().max_by(|a, b| a.u.norm().total_cmp(&b.u.norm()))
        }
        _ => None,
    };
    frame_section(&mut text, &mut d, &mut seen);
    if let Some(t) = turning.as_ref() {
        current_sign(&mut text, &mut d, t, motor);
    }
    speed_section(&mut text, &mut d, &mut seen, turning.as_ref(), dt, motor);
    let turns = text.contains("\n[speed]");
    load_section(&mut text, &mut d, &mut seen, turns);
    let braked = text.contains("\n[load]\ncolumn");
    if voltage.is_none() && current.is_none() && (turns || braked) {
        let what = "it has no voltages and currents: if it is of the same run as another recording, by another instrument, name it under [[also]] \
                    in that one's mapping";
        d.missing.insert(0, what.to_owned());
    } else if is_file && !(turns && braked) {
        text.push_str(
            "# [[also]]                     # speed or torque in another instrument's file: file = \"…\", time = \"…\"\n\n",
        );
    }
    let rest: Vec<&str> = seen.iter().filter(|s| !s.taken).map(|s| s.name).collect();
    if !rest.is_empty() {
        let _ = writeln!(text, "# Not used: {}", rest.join(", "));
        d.guesses.push(format!("Not used: {}", rest.join(", ")));
    }
    if !sniffed.left_out.is_empty() {
        let _ = writeln!(text, "# Not read: {}", sniffed.left_out.join(", ").replace(char::is_control, "?"));
        d.guesses.push(format!("Not read from the file: {}", sniffed.left_out.join(", ")));
    }
    d.text = text;
    d
}

fn unit_line(s: &Seen<'_>) -> String {
    s.said.map_or_else(String::new, |u| format!("\nunit = {:?}", u.text))
}

fn text_section(text: &mut String, format: &TextFormat, has_names: bool) {
    let mut lines = String::new();
    if let Some(s) = format.separator {
        let word = match s {
            b'\t' => "tab".to_owned(),
            b' ' => "space".to_owned(),
            other => char::from(other).to_string(),
        };
        let _ = writeln!(lines, "separator = {word:?}");
    }
    if format.decimal_comma {
        let _ = writeln!(lines, "decimal = \",\"");
    }
    if !has_names {
        let _ = writeln!(lines, "header = false");
    }
    if format.comment != TextFormat::default().comment {
        let _ = writeln!(lines, "comment = {:?}", char::from(format.comment).to_string());
    }
    if format.skip_lines > 0 {
        let _ = writeln!(lines, "skip_lines = {}", format.skip_lines);
    }
    if format.skip_after_header > 0 {
        let _ = writeln!(lines, "skip_after_header = {}", format.skip_after_header);
    }
    if !lines.is_empty() {
        let _ = writeln!(text, "[text]\n{lines}");
    }
}

/// Units in brackets of what is no time and no quantity of a recording either.
const NO_TIMES: [&str; 9] = ["W", "kW", "VA", "kVA", "var", "kvar", "VAr", "°C", "%"];

fn time_section(text: &mut String, d: &mut Draft, seen: &mut [Seen<'_>]) -> Option<f64> {
    let rises = |s: &Seen<'_>| s.x.windows(2).all(|w| w[1] > w[0]);
    let inside = |s: &Seen<'_>| s.name.rsplit(['(', '[']).next().unwrap_or_default().trim_end_matches([')', ']']).to_owned();
    let is = |quantity| move |s: &Seen<'_>| s.quantity == quantity && rises(s) && !NO_TIMES.contains(&inside(s).as_str());
    // A current or a power that rises from row to row is no time.
    let chosen = [Some(Quantity::Time), None].into_iter().find_map(|q| seen.iter().position(is(q)));
    let Some(k) = chosen else {
        d.missing.push("[time]: no column advances from row to row; give sample_time_s (a table of steady states goes to im fit or im diagnose as --table)".to_owned());
        let _ = writeln!(text, "[time]\nsample_time_s = FILL_IN        # no column advances from row to row\n");
        return None;
    };
    seen[k].taken = true;
    let s = &seen[k];
    let step = median(&mut s.x.windows(2).map(|w| w[1] - w[0]).collect::<Vec<_>>());
    let whole = s.unit.is_none() && s.x.iter().take(100).all(|v| v.fract() == 0.0);
    let _ = writeln!(text, "[time]\ncolumn = {}{}", s.key, unit_line(s));
    let mut unit = s.unit.map_or(1.0, |u| u.si);
    if whole {
        d.missing.push(format!(
            "[time] unit: {} counts in whole numbers; say \"s\", \"ms\" or \"µs\", or give sample_time_s instead",
            s.name
        ));
        let _ = writeln!(text, "unit = FILL_IN                 # \"s\", \"ms\", \"µs\"; or sample_time_s instead of column");
        unit = f64::NAN;
    } else {
        if s.unit.is_none() {
            text.push_str(TIME_UNIT);
        }
        // How often it is sampled is said when its unit is known.
        d.guesses.push(match s.unit {
            Some(_) => format!("{} is the time (by its name), {}", s.name, sampled(step * unit)),
            None => format!("{} is the time (the column that advances from row to row)", s.name),
        });
    }
    let _ = writeln!(text);
    unit.is_finite().then_some(step * unit)
}

/// How often a row comes.
fn sampled(step_s: f64) -> String {
    format!("sampled at {} Hz", crate::format::number(1.0 / step_s, 4))
}

/// Names of voltages in canonical columns, which are means from their row to the next.
const CANONICAL_VOLTAGES: [&str; 5] = ["u_alpha_V", "u_beta_V", "u_a_V", "u_b_V", "u_c_V"];

/// The line of a draft that says which instant the voltages belong to, until a fit has decided.
const INSTANT: &str = "instant = \"held_from_row\"      # \"held_from_row\", \"sample\", \"held_until_row\"\n";

impl Draft {
    /// The line that would say it is of one file alone.
    fn names(file: &str) -> String {
        format!("# file = {}   # of this file alone", quoted(file))
    }

    /// The text where neither its name nor its place says of which file it is: with the way to it from there.
    pub fn text_naming(&self, file: &str, way: &str) -> String {
        self.text.replacen(&Self::names(file), &format!("file = {}", quoted(way)), 1)
    }

    /// The guesses as a list, one to a line.
    pub fn listed(&self) -> String {
        self.guesses.iter().map(|g| format!("  - {g}")).collect::<Vec<_>>().join("\n")
    }

    /// Who does not say what the columns mean.
    pub fn nobody_says(&self) -> String {
        match &self.completes {
            Some(label) => format!("{label} does not say"),
            None => "no recording.toml says".to_owned(),
        }
    }

    /// Whether a fit has to say which instant the voltages belong to.
    pub(super) fn leaves_the_instant_open(&self) -> bool {
        self.text.contains(INSTANT)
    }

    /// Notes which instant of the voltages fits better.
    pub(super) fn decide_instant(&mut self, choice: &Choice) {
        self.text = self.text.replace(INSTANT, &INSTANT.replacen(Instant::HeldFromRow.word(), choice.instant.word(), 1));
        self.guesses.push(choice.sentence.clone());
    }
}

/// Finds the three phases, two phases or the vector of a quantity; what they are in SI.
fn set_section(
    text: &mut String,
    d: &mut Draft,
    seen: &mut [Seen<'_>],
    quantity: Quantity,
    voltage: Option<&[Complex<f64>]>,
    dt: Option<f64>,
    rated_v: f64,
) -> Option<Vec<Complex<f64>>> {
    let (section, word) = if quantity == Quantity::Voltage { ("voltage", "voltages") } else { ("current", "currents") };
    let alternating = |s: &Seen<'_>| s.size > 0.0 && !s.taken;
    let of = |origin: Origin| -> Vec<usize> {
        let is =
            |s: &Seen<'_>| alternating(s) && s.quantity == Some(quantity) && s.origin == origin && !names::is_dc_link(s.name);
        (0..seen.len()).filter(|&k| is(&seen[k])).collect()
    };
    let mut candidates = [of(Origin::Sensor), of(Origin::Filter)].concat();
    // What a drive commands stands for a voltage that nobody measured; a current that nobody measured is not there.
    let commanded = quantity == Quantity::Voltage && candidates.len() < 2;
    if commanded {
        candidates.extend(of(Origin::Command));
    }
    let with = |place: usize| candidates.iter().copied().find(|&k| seen[k].place == Some(place));
    let one_each = (0..3).all(|place| candidates.iter().filter(|&&k| seen[k].place == Some(place)).count() == 1);
    let axis = |letter: &str| candidates.iter().copied().find(|&k| names::axis(seen[k].name) == Some(letter));
    let _ = writeln!(text, "[{section}]");
    let (keys, chosen, why): (Vec<&str>, Vec<usize>, String) = if let (Some(a), Some(b)) = (with(3), with(4)) {
        (vec!["alpha", "beta"], vec![a, b], "by their names".into())
    } else if let (Some(a), Some(b), Some(c)) = (with(5), with(6), with(7)) {
        (vec!["ab", "bc", "ca"], vec![a, b, c], "by their names".into())
    } else if let (Some(d), Some(q), true) = (axis("d"), axis("q"), seen.iter().any(|s| names::is_frame_angle(s.name))) {
        (vec!["d", "q"], vec![d, q], "by their names".into())
    } else if let (true, Some(a), Some(b), Some(c)) = (one_each, with(0), with(1), with(2)) {
        (vec!["a", "b", "c"], vec![a, b, c], "by their names".into())
    } else if let Some(set) = balanced(seen, &candidates) {
        (vec!["a", "b", "c"], set.to_vec(), "of equal size, and their sum nearly vanishes".into())
    } else if let (Some(a), Some(b)) = (with(5), with(6)) {
        (vec!["ab", "bc"], vec![a, b], "by their names".into())
    } else if let Some((keys, two)) = two_phases(quantity, with) {
        (keys.to_vec(), two.to_vec(), "by their names; the third is taken as minus their sum".into())
    } else {
        let found: Vec<&str> = candidates.iter().map(|&k| seen[k].name).collect();
        let found = if found.is_empty() {
            "no column looks like one by name or unit".into()
        } else {
            format!("candidates are {}", found.join(", "))
        };
        let lines = if quantity == Quantity::Voltage { ", or ab, bc where they are line to line" } else { "" };
        d.missing.push(format!("[{section}] a, b, c{lines}: {found}"));
        let instead = if quantity == Quantity::Voltage {
            "instead: two or three of ab, bc, ca; a and b against the star point; alpha, beta; d, q; duty_a, duty_b, duty_c and dc_link"
        } else {
            "two of them do; instead: alpha, beta; d, q"
        };
        let _ = writeln!(text, "a = FILL_IN                    # {found}\nb = FILL_IN\nc = FILL_IN\n# {instead}");
        let _ = writeln!(
            text,
            "# gain = 1                     # what one of the file's numbers is in the unit, of a probe or a clamp\n"
        );
        return None;
    };
    chosen.iter().for_each(|&k| seen[k].taken = true);
    let names: Vec<&str> = chosen.iter().map(|&k| seen[k].name).collect();
    let why = if commanded { format!("{why}; commanded, not measured") } else { why };
    let unit = |k: usize| seen[k].unit.filter(|u| u.quantity == quantity);
    let named = chosen.iter().find_map(|&k| unit(k));
    let si = quantity.words().1;
    let share = chosen.iter().find_map(|&k| share_in_name(seen[k].name));
    let measured_in = match (named, share) {
        (Some(u), _) => format!("in {}", u.text),
        (None, Some(share)) => format!("in {share}, and taken as {si}: write what one of them is in {si} as gain of [{section}]"),
        (None, None) => format!("taken as {si}"),
    };
    d.guesses.push(format!("{} are the {word} {}, {measured_in} ({why})", names.join(", "), keys.join(", ")));
    let n = seen[chosen[0]].x.len();
    let at = |c: usize, k: usize| seen[chosen[c]].x[k] * unit(chosen[c]).map_or(1.0, |u| u.si);
    let angle = seen.iter().position(|s| names::is_frame_angle(s.name));
    let turned = |k: usize| {
        let unit = angle.map_or(1.0, |a| frame_unit(&seen[a]).1);
        Complex::from_polar(1.0, angle.map_or(0.0, |a| seen[a].x[k] * unit))
    };
    let mut vector: Vec<Complex<f64>> = (0..n)
        .map(|k| match keys[..] {
            ["alpha", _] => Complex::new(at(0, k), at(1, k)),
            ["d", _] => Complex::new(at(0, k), at(1, k)) * turned(k),
            ["ab", _, _] => from_phases([(at(0, k) - at(2, k)) / 3.0, (at(1, k) - at(0, k)) / 3.0, (at(2, k) - at(1, k)) / 3.0]),
            ["ab", _] => from_phases([at(0, k), 0.0, -at(1, k)]),
            [_, _, _] => from_phases([at(0, k), at(1, k), at(2, k)]),
            ["a", "c"] => from_phases([at(0, k), -at(0, k) - at(1, k), at(1, k)]),
            ["b", _] => from_phases([-at(0, k) - at(1, k), at(0, k), at(1, k)]),
            _ => from_phases([at(0, k), at(1, k), -at(0, k) - at(1, k)]),
        })
        .collect();
    if let Some(u) = chosen.iter().find_map(|&k| seen[k].said) {
        let _ = writeln!(text, "unit = {:?}", u.text);
    }
    if let Some(share) = share.filter(|_| named.is_none()) {
        let _ = writeln!(text, "gain = 1                     # what one {share} is in {si}");
    }
    let mut order = chosen.clone();
    if let (Some(u), 3, true) = (voltage, keys.len(), dt.is_some()) {
        // The currents turn with the voltages, or two of them are exchanged.
        let turn = |x: &[Complex<f64>]| x.windows(2).map(|w| (w[1] * w[0].conj()).im).sum::<f64>();
        if turn(u) * turn(&vector) < 0.0 {
            order.swap(1, 2);
            vector.iter_mut().for_each(|i| *i = i.conj());
            d.guesses
                .push(format!("{} and {} are exchanged: else the currents would turn against the voltages", names[1], names[2]));
        }
    }
    for (key, &k) in keys.iter().zip(&order) {
        let second = (0..seen.len()).find(|&o| {
            quantity == Quantity::Current && !seen[o].taken && seen[o].origin == Origin::Sensor && twin(seen[k].x, seen[o].x)
        });
        match second {
            None => {
                let _ = writeln!(text, "{key} = {}", seen[k].key);
            }
            Some(o) => {
                seen[o].taken = true;
                d.guesses.push(format!(
                    "{} is a second sensor of {} (they agree wherever both are small)",
                    seen[o].name, seen[k].name
                ));
                let _ = writeln!(text, "{key} = {{ column = {}, alternate = {} }}", seen[k].key, seen[o].key);
            }
        }
    }
    if quantity == Quantity::Voltage {
        per_unit(text, d, seen, &names, &mut vector, rated_v);
        if names.iter().all(|n| CANONICAL_VOLTAGES.contains(n)) {
            d.named = Some(Named::Mean);
        } else if commanded {
            d.named = Some(Named::Command);
        }
        text.push_str(INSTANT);
        if commanded {
            let _ =
                writeln!(text, "measured = false                # a drive's commands: what its inverter makes of them is open");
        }
    }
    let _ = writeln!(text);
    Some(vector)
}

/// Two phases of three: any of currents, which sum to nothing; of voltages those from which a mapping has the third.
fn two_phases(quantity: Quantity, with: impl Fn(usize) -> Option<usize>) -> Option<([&'static str; 2], [usize; 2])> {
    let pairs = [(["a", "b"], [0, 1]), (["a", "c"], [0, 2]), (["b", "c"], [1, 2])];
    let some = if quantity == Quantity::Current { &pairs[..] } else { &pairs[..1] };
    some.iter().find_map(|&(keys, [p, q])| Some((keys, [with(p)?, with(q)?])))
}

/// The legs' duty cycles and the voltage of the dc link.
fn duty_section(text: &mut String, d: &mut Draft, seen: &mut [Seen<'_>]) -> Option<Vec<Complex<f64>>> {
    let share = |s: &Seen<'_>| s.size > 0.0 && s.x.iter().all(|x| (-0.01..=1.01).contains(x));
    let leg = |place: usize| seen.iter().position(|s| names::is_duty(s.name) && s.place == Some(place) && share(s));
    let link = seen.iter().position(|s| names::is_dc_link(s.name) && s.x.iter().all(|x| *x > 0.0))?;
    let legs = [leg(0)?, leg(1)?, leg(2)?];
    let unit = seen[link].unit.map_or(1.0, |u| u.si);
    let at = |k: usize| from_phases(legs.map(|l| seen[l].x[k])) * (seen[link].x[k] * unit);
    let vector = (0..seen[link].x.len()).map(at).collect();
    let keys = legs.map(|l| seen[l].key.clone());
    let names = legs.map(|l| seen[l].name).join(", ");
    d.guesses.push(format!(
        "{names} are the legs' duty cycles, of {}, the voltage of the dc link; commanded, not measured",
        seen[link].name
    ));
    d.named = Some(Named::Command);
    let [a, b, c] = keys;
    let _ = writeln!(text, "[voltage]\nduty_a = {a}\nduty_b = {b}\nduty_c = {c}\ndc_link = {}\n{INSTANT}", seen[link].key);
    legs.into_iter().chain([link]).for_each(|k| seen[k].taken = true);
    Some(vector)
}

/// A time without a unit is in that with which the voltage turns about as fast as the motor is rated for.
fn time_unit(
    text: &mut String,
    d: &mut Draft,
    voltage: Option<&[Complex<f64>]>,
    dt: Option<f64>,
    motor: &MotorFile,
) -> Option<f64> {
    let seconds = dt?;
    if !text.contains(TIME_UNIT) {
        return dt;
    }
    let Some(u) = voltage else {
        *text = text.replacen(TIME_UNIT, "# unit = \"s\"                   # \"s\", \"ms\", \"µs\"\n", 1);
        d.guesses.push(format!(
            "The unit of the time is open; without one it is s, and a row every {} s",
            crate::format::number(seconds, 4)
        ));
        return dt;
    };
    let turn: Complex<f64> = u.windows(2).map(|w| w[1] * w[0].conj()).sum();
    let speed = turn.arg().abs() / seconds / (2.0 * PI * motor.rating.electrical_frequency_hz);
    let usual = |si: f64| (0.02..5.0).contains(&(speed / si));
    let found = [("s", 1.0), ("ms", 1e-3), ("us", 1e-6)].into_iter().find(|(_, si)| usual(*si)).filter(|(name, _)| *name != "s");
    let line = found
        .map_or_else(String::new, |(name, _)| format!("unit = {name:?}                    # by the frequency of the voltage\n"));
    *text = text.replacen(TIME_UNIT, &line, 1);
    let step_s = seconds * found.map_or(1.0, |(_, si)| si);
    d.guesses.push(match found {
        Some((name, _)) => {
            format!("The time is in {name}, {}: the voltage then turns about as fast as the motor is rated for", sampled(step_s))
        }
        None => format!("The time is taken as s, {}", sampled(step_s)),
    });
    Some(step_s)
}

/// Where a unit of time may have to stand.
const TIME_UNIT: &str = "# unit of time\n";

/// Currents that fit the motor only when they are turned round have the other sign.
fn current_sign(text: &mut String, d: &mut Draft, steady: &steady::Steady, motor: &MotorFile) {
    let (z, model) = impedances(steady, motor);
    let (as_is, turned) = (model.fit(z).off, model.fit(-z).off);
    if as_is > 0.5 && turned < 0.4 * as_is && turned < 0.5 {
        d.guesses.push("The currents point the other way against the voltages: turned back they fit the motor".to_owned());
        *text =
            text.replacen("[current]\n", "[current]\ngain = -1                      # else they point against the voltages\n", 1);
    }
}

/// The unit of a frame's angle, by its name or its range.
fn frame_unit(s: &Seen<'_>) -> (&'static str, f64) {
    let largest = s.x.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    match s.unit.filter(|u| u.quantity == Quantity::Angle) {
        Some(u) => (u.text, u.si),
        None if largest <= 1.01 => ("turn", 2.0 * PI),
        None if largest > 20.0 => ("deg", PI / 180.0),
        None => ("rad", 1.0),
    }
}

fn frame_section(text: &mut String, d: &mut Draft, seen: &mut [Seen<'_>]) {
    if !text.contains("\nd = ") {
        return;
    }
    let Some(s) = seen.iter_mut().find(|s| names::is_frame_angle(s.name)) else { return };
    s.taken = true;
    let unit = frame_unit(s).0;
    d.guesses.push(format!("{} is the angle of d and q in {unit}", s.name));
    let _ = writeln!(text, "[frame]\nangle = {{ column = {}, unit = {unit:?} }}\n", s.key);
}

/// Voltages far below the rated one are shares of something: of the dc link's voltage where a column has it.
fn per_unit(text: &mut String, d: &mut Draft, seen: &mut [Seen<'_>], names: &[&str], vector: &mut [Complex<f64>], rated_v: f64) {
    let largest = |v: &[Complex<f64>]| v.iter().map(|u| u.norm()).fold(0.0, f64::max);
    if largest(vector) > SHARE * rated_v {
        return;
    }
    let link = |s: &Seen<'_>| !s.taken && names::is_dc_link(s.name) && s.x.iter().all(|x| *x > 0.0);
    if let Some(k) = (0..seen.len()).find(|&k| link(&seen[k])) {
        seen[k].taken = true;
        let s = &seen[k];
        let unit = s.unit.map_or(1.0, |u| u.si);
        vector.iter_mut().zip(s.x).for_each(|(u, dc)| *u *= dc * unit);
        d.guesses.push(format!("{} are shares of {}, the voltage of the dc link", names.join(", "), s.name));
        let _ = writeln!(text, "times = {}", s.key);
    }
    let reached = largest(vector);
    if reached <= SHARE * rated_v {
        let reached = crate::format::number(reached, 3);
        d.missing.push(format!(
            "[voltage] gain: {} reach {reached} where {} V is rated: say what voltage one is",
            names.join(", "),
            crate::format::number(rated_v, 3)
        ));
        let _ = writeln!(text, "gain = FILL_IN                 # what voltage, V, one is: they reach {reached}");
    }
}

/// Voltages within this part of the rated one are in per unit.
const SHARE: f64 = 0.06;

/// The three of the candidates that are of nearly equal size and have the smallest sum.
fn balanced(seen: &[Seen<'_>], candidates: &[usize]) -> Option<[usize; 3]> {
    let step = (seen.first()?.x.len() / 5000).max(1);
    let mut best: Option<(f64, [usize; 3])> = None;
    let some = &candidates[..candidates.len().min(12)];
    for (p, &a) in some.iter().enumerate() {
        for (q, &b) in some.iter().enumerate().skip(p + 1) {
            for &c in &some[q + 1..] {
                let sizes = [seen[a].size, seen[b].size, seen[c].size];
                let (low, high) =
                    (sizes.iter().fold(f64::INFINITY, |m, x| m.min(*x)), sizes.iter().fold(0.0, |m: f64, x| m.max(*x)));
                if low < 0.6 * high {
                    continue;
                }
                let rows = (0..seen[a].x.len()).step_by(step);
                let mean = |k: usize| seen[k].x.iter().step_by(step).sum::<f64>() / rows.len() as f64;
                let middle = mean(a) + mean(b) + mean(c);
                let sum: f64 = rows.clone().map(|k| (seen[a].x[k] + seen[b].x[k] + seen[c].x[k] - middle).powi(2)).sum();
                let relative = (sum / rows.len() as f64).sqrt() / high;
                // What the names say first counts where two sets are as good.
                if relative < 0.35 && best.is_none_or(|(r, _)| relative < 0.7 * r) {
                    best = Some((relative, [a, b, c]));
                }
            }
        }
    }
    best.map(|(_, set)| set)
}

/// Whether two columns are sensors of one current: they agree where both are small, and both move.
fn twin(x: &[f64], y: &[f64]) -> bool {
    let largest = x.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    let (mut xy, mut xx, mut yy) = (0.0, 0.0, 0.0);
    for (a, b) in x.iter().zip(y).filter(|(a, b)| a.abs().max(b.abs()) < 0.4 * largest) {
        (xy, xx, yy) = (xy + a * b, xx + a * a, yy + b * b);
    }
    xx > 0.0 && yy > 0.0 && xy / (xx * yy).sqrt() > 0.98 && (0.5..2.0).contains(&(xy / xx))
}

/// Whether the machine draws at reduced voltage what it draws with its rotor locked: beyond breakdown no machine runs steadily.
fn stands(steady: &steady::Steady, motor: &MotorFile) -> bool {
    let (z, model) = impedances(steady, motor);
    let fit = model.fit(z);
    steady.u.norm() < REDUCED * motor.rating.phase_voltage_peak_v && fit.slip > BREAKDOWN && fit.off < 0.5
}

/// Share of the rated voltage up to which rotors are locked, and a slip beyond that of breakdown.
const REDUCED: f64 = 0.6;
const BREAKDOWN: f64 = 0.4;

/// Voltage over current, and the motor's impedances on that supply.
fn impedances(steady: &steady::Steady, motor: &MotorFile) -> (Complex<f64>, steady::Impedances) {
    let z = steady.u / steady.i;
    let z = if steady.omega < 0.0 { z.conj() } else { z };
    (z, steady::Impedances::of(&motor.machine, steady.u.norm(), steady))
}

/// Whether a column counts the lines of an encoder.
fn is_count(s: &Seen<'_>) -> bool {
    names::is_count(s.name) && s.unit.is_none() && s.size > 0.0 && s.x.iter().all(|x| x.fract() == 0.0)
}

fn counts_section(
    text: &mut String,
    d: &mut Draft,
    s: &Seen<'_>,
    turning: Option<&steady::Steady>,
    dt: Option<f64>,
    motor: &MotorFile,
) {
    let _ = writeln!(text, "[speed]\ncolumn = {}", s.key);
    let (low, high) = s.x.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(*x), h.max(*x)));
    let n_p = f64::from(motor.machine.pole_pairs());
    // Counts to a turn of a rotor that turns with the supply; steps back to the beginning are left out.
    let synchronous = turning.zip(dt).map(|(t, dt)| {
        let steps = s.x[t.rows.clone()].windows(2).map(|w| w[1] - w[0]).filter(|step| step.abs() < 0.5 * (high - low));
        let (sum, count) = steps.fold((0.0, 0.0), |(sum, n), step| (sum + step, n + 1.0));
        sum / count / dt * 2.0 * PI * n_p / t.omega
    });
    match synchronous.filter(|p| p.abs() >= 1.0) {
        Some(p) if (0.85..1.02).contains(&(p.abs() / (high - low + 1.0))) => {
            d.guesses.push(format!("{} counts an encoder's lines, and begins anew at each turn", s.name));
            let _ = writeln!(text, "counts_per_turn = {}", high - low + 1.0);
        }
        other => {
            let about = other.map(|p| crate::format::number(p.abs(), 3));
            let [turn, note] = about.map_or_else(Default::default, |x| {
                [format!(", about {x} to a turn at synchronous speed"), format!("; about {x} by the voltage's frequency")]
            });
            d.missing.push(format!(
                "[speed] counts_per_turn: {} counts an encoder's lines{turn}: say how many (lines times 4)",
                s.name
            ));
            let _ = writeln!(text, "counts_per_turn = FILL_IN      # lines times 4{note}");
        }
    }
    if synchronous.is_some_and(|p| p < 0.0) {
        d.guesses.push(format!("{} counts against the phases: gain = -1; or two phases are exchanged", s.name));
        let _ = writeln!(text, "gain = -1                      # or exchange two phases");
    }
    let _ = writeln!(text);
}

fn speed_section(
    text: &mut String,
    d: &mut Draft,
    seen: &mut [Seen<'_>],
    turning: Option<&steady::Steady>,
    dt: Option<f64>,
    motor: &MotorFile,
) {
    let is_speed = |s: &Seen<'_>| s.quantity == Some(Quantity::Speed) && s.origin <= Origin::Filter && !is_count(s);
    let speeds = (0..seen.len()).filter(|&k| !seen[k].taken && is_speed(&seen[k]));
    let Some(k) = speeds.min_by_key(|&k| seen[k].origin) else {
        if let Some(s) = seen.iter_mut().find(|s| !s.taken && is_count(s)) {
            s.taken = true;
            return counts_section(text, d, s, turning, dt, motor);
        }
        d.guesses.push("No column looks like a speed: the currents alone are compared, and the speed is unknown".to_owned());
        if turning.is_some_and(|t| stands(t, motor)) {
            d.guesses.push(
                "The impedance is that of a rotor that stands, at reduced voltage: if it was locked, say locked = true in [speed]"
                    .to_owned(),
            );
        }
        let _ = writeln!(text, "# [speed]                      # column = …, unit = \"rpm\"; or locked = true\n");
        return;
    };
    seen[k].taken = true;
    let s = &seen[k];
    let _ = writeln!(text, "[speed]\ncolumn = {}{}", s.key, unit_line(s));
    let n_p = f64::from(motor.machine.pole_pairs());
    // Its mean where the machine runs steadily, against the synchronous speed.
    let shown = turning.map(|t| (s.x[t.rows.clone()].iter().sum::<f64>() / t.rows.len() as f64, t.omega));
    let units = [("rad/s", 1.0), ("rpm", PI / 30.0), ("Hz", 2.0 * PI)];
    match (s.unit, shown) {
        (Some(u), shown) => {
            let electrical = shown.map(|(x, w)| x * u.si / w).is_some_and(|r| n_p > 1.0 && (0.85..1.02).contains(&r));
            d.guesses.push(format!("{} is the speed in {} (by its name)", s.name, u.text));
            if electrical {
                d.guesses.push(format!("{} is electrical: it equals the supply's angular frequency", s.name));
                let _ = writeln!(text, "electrical = true");
            }
        }
        (None, Some((x, w))) => {
            let fits = |ratio: f64| (0.85..1.02).contains(&ratio.abs());
            let mechanical = units.iter().find(|(_, si)| fits(n_p * x * si / w));
            let electrical = units.iter().find(|(_, si)| fits(x * si / w));
            match (mechanical, electrical) {
                (Some((unit, _)), _) => {
                    d.guesses.push(format!("{} is the speed in {unit}: it then turns nearly synchronously", s.name));
                    let _ = writeln!(text, "unit = {unit:?}");
                }
                (None, Some((unit, _))) => {
                    d.guesses
                        .push(format!("{} is the electrical speed in {unit}: it then equals the supply's frequency", s.name));
                    let _ = writeln!(text, "unit = {unit:?}\nelectrical = true");
                }
                (None, None) if x.abs() > 0.0 => {
                    let rpm = w / n_p * 30.0 / PI;
                    d.missing.push(format!(
                        "[speed] unit, and gain or calibrate, or locked = true: {} shows {x:.4} where {rpm:.0} rpm is synchronous",
                        s.name
                    ));
                    let _ = writeln!(
                        text,
                        "unit = FILL_IN                 # \"rpm\", \"rad/s\", \"Hz\"\n# calibrate = {{ from_s = …, to_s = …, value = … }}"
                    );
                }
                _ => {
                    d.missing
                        .push(format!("[speed] unit: {} stands; say \"rpm\", \"rad/s\" or \"Hz\", or locked = true", s.name));
                    let _ = writeln!(text, "unit = FILL_IN");
                }
            }
            if x * w < 0.0 {
                d.guesses.push(format!("{} turns against the phases: gain = -1; or two phases are exchanged", s.name));
                let _ = writeln!(text, "gain = -1                      # or exchange two phases");
            }
        }
        (None, None) => {
            d.missing.push(format!("[speed] unit of {}: say \"rpm\", \"rad/s\" or \"Hz\"", s.name));
            let _ = writeln!(text, "unit = FILL_IN                 # \"rpm\", \"rad/s\", \"Hz\"");
        }
    }
    let _ = writeln!(text);
}

fn load_section(text: &mut String, d: &mut Draft, seen: &mut [Seen<'_>], turns: bool) {
    let torques = || (0..seen.len()).filter(|&k| !seen[k].taken && seen[k].quantity == Some(Quantity::Torque));
    let measured = |k: &usize| seen[*k].origin <= Origin::Filter && !names::is_air_gap_torque(seen[*k].name);
    let computed: Vec<&str> = torques().filter(|k| !measured(k)).map(|k| seen[k].name).collect();
    if !computed.is_empty() {
        d.guesses.push(format!("No torque sensor by the name, and not taken for the load: {}", computed.join(", ")));
    }
    match torques().filter(measured).min_by_key(|&k| seen[k].origin) {
        Some(k) => {
            seen[k].taken = true;
            d.guesses.push(format!("{} is the load torque, positive against positive rotation", seen[k].name));
            let _ = writeln!(text, "[load]\ncolumn = {}{}\n", seen[k].key, unit_line(&seen[k]));
        }
        None if turns => {
            d.guesses
                .push("No column looks like a torque: the load is taken as unknown, and the speed drives the machine".to_owned());
            let _ = writeln!(
                text,
                "[load]\nunknown = true                 # none = true where nothing was driven; constant = \"fit\", fan = \"fit\"; column = …\n"
            );
        }
        None => {
            d.guesses.push("No column looks like a torque: the load is taken as unknown".to_owned());
            let _ = writeln!(
                text,
                "# [load]                       # column = …, times = …, gain = …; or constant = …, fan = …, none = true\n"
            );
        }
    }
}
