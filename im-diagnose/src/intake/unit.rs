//! Units as they stand in the names of columns: `i1_mA`, `Speed (rpm)`, `u [kV]`.

use std::f64::consts::{PI, TAU};

/// Units of speed that are taken for each other: what is read over what is, the unit that it is in, and that it is read in.
pub(crate) const SPEEDS_MISREAD: [(f64, &str, &str); 5] = [
    (30.0 / PI, "rpm", "rad/s"),
    (PI / 30.0, "rad/s", "rpm"),
    (1.0 / TAU, "Hz", "rad/s"),
    (1.0 / 60.0, "Hz", "rpm"),
    (60.0, "rpm", "Hz"),
];

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Time.
    Time,
    /// Voltage.
    Voltage,
    /// Current.
    Current,
    /// Speed or frequency of rotation.
    Speed,
    /// Torque.
    Torque,
    /// Angle.
    Angle,
}

impl Quantity {
    /// Name and SI unit.
    pub fn words(self) -> (&'static str, &'static str) {
        match self {
            Self::Time => ("a time", "s"),
            Self::Voltage => ("a voltage", "V"),
            Self::Current => ("a current", "A"),
            Self::Speed => ("a speed", "rad/s"),
            Self::Torque => ("a torque", "Nm"),
            Self::Angle => ("an angle", "rad"),
        }
    }
}

/// A unit: what it measures, and its size in the SI unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// As written.
    pub text: &'static str,
    /// What it measures.
    pub quantity: Quantity,
    /// One of it in s, V, A, rad/s, Nm.
    pub si: f64,
}

const fn unit(text: &'static str, quantity: Quantity, si: f64) -> Unit {
    Unit { text, quantity, si }
}

/// Every unit that is understood; the first of each quantity is the SI unit.
pub const UNITS: &[Unit] = &[
    unit("s", Quantity::Time, 1.0),
    unit("sec", Quantity::Time, 1.0),
    unit("ms", Quantity::Time, 1e-3),
    unit("us", Quantity::Time, 1e-6),
    unit("µs", Quantity::Time, 1e-6),
    unit("μs", Quantity::Time, 1e-6),
    unit("ns", Quantity::Time, 1e-9),
    unit("V", Quantity::Voltage, 1.0),
    unit("mV", Quantity::Voltage, 1e-3),
    unit("kV", Quantity::Voltage, 1e3),
    unit("A", Quantity::Current, 1.0),
    unit("mA", Quantity::Current, 1e-3),
    unit("kA", Quantity::Current, 1e3),
    unit("rad/s", Quantity::Speed, 1.0),
    unit("rad_s", Quantity::Speed, 1.0),
    unit("rpm", Quantity::Speed, PI / 30.0),
    unit("1/min", Quantity::Speed, PI / 30.0),
    unit("min-1", Quantity::Speed, PI / 30.0),
    unit("U/min", Quantity::Speed, PI / 30.0),
    unit("r/min", Quantity::Speed, PI / 30.0),
    unit("Hz", Quantity::Speed, 2.0 * PI),
    unit("1/s", Quantity::Speed, 2.0 * PI),
    unit("deg/s", Quantity::Speed, PI / 180.0),
    unit("Nm", Quantity::Torque, 1.0),
    unit("N·m", Quantity::Torque, 1.0),
    unit("N*m", Quantity::Torque, 1.0),
    unit("mNm", Quantity::Torque, 1e-3),
    unit("kNm", Quantity::Torque, 1e3),
    unit("rad", Quantity::Angle, 1.0),
    unit("deg", Quantity::Angle, PI / 180.0),
    unit("turn", Quantity::Angle, 2.0 * PI),
];

/// The unit as a mapping writes it.
pub fn named(text: &str) -> Option<Unit> {
    let text = text.trim();
    // Upper and lower case part mV from MV: exactly first, then forgivingly where that is without doubt.
    UNITS
        .iter()
        .find(|u| u.text == text)
        .or_else(|| UNITS.iter().find(|u| u.text.len() > 2 && u.text.eq_ignore_ascii_case(text)))
        .copied()
}

/// The unit in a column's name: in brackets, or behind the last underscore or space.
pub fn in_name(name: &str) -> Option<Unit> {
    let name = name.trim();
    for (open, close) in [('(', ')'), ('[', ']'), ('{', '}'), ('/', ' ')] {
        if let Some(from) = name.rfind(open)
            && let inside = name[from + open.len_utf8()..].trim_end_matches(close)
            && let Some(u) = named(inside)
        {
            return Some(u);
        }
    }
    UNITS
        .iter()
        .filter(|u| {
            name.strip_suffix(u.text).is_some_and(|before| before.ends_with(['_', ' ', '.', '-']))
                || (name == u.text && u.text.len() > 1)
        })
        .max_by_key(|u| u.text.len())
        .copied()
}

/// What a column's name says in brackets where it is a share of a rated value, which has no size without that value: `I1 [pu]`, `n (%)`.
pub fn share_in_name(name: &str) -> Option<&str> {
    let inside = ['(', '[', '{'].iter().filter_map(|open| name.rfind(*open)).max().map(|at| &name[at + 1..])?;
    let inside = inside.trim().trim_end_matches([')', ']', '}']).trim();
    let letters: String = inside.chars().filter(|c| !c.is_whitespace() && *c != '.').collect();
    matches!(letters.to_ascii_lowercase().as_str(), "pu" | "perunit" | "%" | "percent").then_some(inside)
}

/// As [`in_name`], among the names of the other columns: beside `I_U` and `I_W`, `I_V` is a phase and no voltage.
pub fn in_name_among(name: &str, all: &[String]) -> Option<Unit> {
    if is_phase_v(name, all) { None } else { in_name(name) }
}

/// The size of the unit of a quantity by the name of its column among the others.
///
/// # Errors
/// The name has the unit of another quantity: what was found and what is expected.
pub fn by_name(name: &str, all: &[String], quantity: Quantity) -> Result<Option<f64>, [String; 2]> {
    let (words, si) = quantity.words();
    match in_name_among(name, all) {
        Some(u) if u.quantity != quantity => Err([
            format!("not given, and column {name} is in {} by its name", u.text),
            format!("{words}; if it is one, say unit = \"{si}\" or whatever it is in"),
        ]),
        unit => Ok(unit.map(|u| u.si)),
    }
}

/// Whether a name ends in the V of phases U, V and W.
fn is_phase_v(name: &str, all: &[String]) -> bool {
    let is = |stem: &str, phase: char| all.iter().any(|n| n.trim().strip_suffix(phase) == Some(stem));
    name.trim().strip_suffix('V').is_some_and(|stem| is(stem, 'U') && is(stem, 'W'))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_read_from_names() {
        let of = |n: &str| in_name(n).map(|u| (u.quantity, u.si));
        for (name, quantity, si) in [
            ("t_s", Quantity::Time, 1.0),
            ("Time (ms)", Quantity::Time, 1e-3),
            ("time_µs", Quantity::Time, 1e-6),
            ("i1_mA", Quantity::Current, 1e-3),
            ("Phase A [A]", Quantity::Current, 1.0),
            ("u_kV", Quantity::Voltage, 1e3),
            ("n_rpm", Quantity::Speed, PI / 30.0),
            ("speed 1/min", Quantity::Speed, PI / 30.0),
            ("n / 1/min", Quantity::Speed, PI / 30.0),
            ("omega_m_rad_s", Quantity::Speed, 1.0),
            ("Speed (RPM)", Quantity::Speed, PI / 30.0),
            ("tau_load_Nm", Quantity::Torque, 1.0),
        ] {
            assert_eq!(of(name), Some((quantity, si)), "{name}");
        }
        for name in ["A", "V", "n_raw", "n_rpm_uncal", "iA", "comment", "", "s"] {
            assert_eq!(of(name), None, "{name}");
        }
    }

    #[test]
    fn shares_of_rated_values_are_seen_in_names() {
        for (name, share) in [("I1 [pu]", "pu"), ("i_a (p.u.)", "p.u."), ("n (motor 1) [%]", "%"), ("u {per unit}", "per unit")] {
            assert_eq!(share_in_name(name), Some(share), "{name}");
        }
        for name in ["I1 [A]", "input", "i_pu", "n (motor 1)", ""] {
            assert_eq!(share_in_name(name), None, "{name}");
        }
    }

    #[test]
    fn a_v_beside_u_and_w_is_a_phase_and_no_voltage() {
        let names = |list: &[&str]| -> Vec<String> { list.iter().map(|n| (*n).to_owned()).collect() };
        let phases = names(&["t_s", "I_U", "I_V ", "I_W", "V_V", "V_U"]);
        assert!(is_phase_v("I_V ", &phases) && in_name_among("I_V ", &phases).is_none());
        assert_eq!(by_name("I_V ", &phases, Quantity::Current), Ok(None));
        // Two of the three say nothing, and small letters are no unit anyhow.
        assert!(!is_phase_v("V_V", &phases) && !is_phase_v("I_U", &phases) && !is_phase_v("I_V", &names(&["I_V", "I_U"])));
        assert_eq!(in_name_among("V_V", &phases).map(|u| u.text), Some("V"));
        let wrong = by_name("V_V", &phases, Quantity::Current).unwrap_err();
        assert!(wrong[0].contains("column V_V is in V by its name"), "{wrong:?}");
    }
}
