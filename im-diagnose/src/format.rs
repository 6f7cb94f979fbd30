//! Numbers as people read them.

use im_model::EffectId;

/// A number with so many significant digits, without needless zeros: 0.0371, 12.4, 1.4·10⁻⁵.
pub fn number(x: f64, digits: usize) -> String {
    if x == 0.0 {
        return "0".into();
    }
    if !x.is_finite() {
        return "–".into();
    }
    let exponent = x.abs().log10().floor() as i32;
    if !(-4..6).contains(&exponent) {
        let text = format!("{x:.*e}", digits.saturating_sub(1));
        let (mantissa, e) = text.split_once('e').unwrap_or((&text, "0"));
        return format!("{}·10{}", trimmed(mantissa.into()), superscript(e)).replace('-', "−");
    }
    let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
    let text = format!("{x:.decimals$}");
    let text = if decimals > 0 { trimmed(text) } else { text };
    text.replace('-', "−")
}

fn trimmed(s: String) -> String {
    if s.contains('.') { s.trim_end_matches('0').trim_end_matches('.').to_owned() } else { s }
}

/// What is read where it is a factor of what is: "8 % too much".
pub(crate) fn too_much(scale: f64) -> String {
    format!("{} % too {}", number(100.0 * (scale - 1.0).abs(), 2), much(scale > 1.0))
}

/// After "too".
pub(crate) fn much(more: bool) -> &'static str {
    if more { "much" } else { "little" }
}

/// A power of ten as probabilities are written: 10⁻²⁶.
pub fn power_of_ten(e: f64) -> String {
    format!("10{}", superscript(&format!("{}", e.round() as i32)))
}

/// A probability of which −log₁₀ is known, after "a probability": beyond 10⁻¹⁰⁰ no model of noise holds.
pub fn chance(log_p: f64) -> String {
    if log_p > 100.0 { format!("below {}", power_of_ten(-100.0)) } else { format!("of {}", power_of_ten(-log_p)) }
}

fn superscript(digits: &str) -> String {
    digits
        .chars()
        .map(|c| match c {
            '-' => '⁻',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            d => char::from_u32('⁰' as u32 + d.to_digit(10).unwrap_or(0)).unwrap_or(d),
        })
        .collect()
}

/// A number with its unit, with a prefix where the unit takes one: 3.47 mH.
pub fn quantity(x: f64, unit: &str, digits: usize) -> String {
    let (factor, prefix) = prefix(x.abs(), unit);
    let gap = if unit.is_empty() { "" } else { "\u{a0}" };
    format!("{}{gap}{prefix}{unit}", number(x * factor, digits))
}

/// An interval of so many times the value says nothing of it; and one beyond every quantity's size.
const NOTHING_KNOWN: f64 = 100.0;
const BEYOND_ALL: f64 = 1e30;

/// A value with the half width of its interval in the same prefix: 3.47 ± 0.02 mH.
pub fn interval(x: f64, half: f64, unit: &str) -> String {
    let (factor, prefix) = prefix(x.abs(), unit);
    let gap = if unit.is_empty() { "" } else { "\u{a0}" };
    if half.is_nan() || half <= 0.0 {
        return quantity(x, unit, 4);
    }
    if half > NOTHING_KNOWN * x.abs() && x != 0.0 || half > BEYOND_ALL {
        return format!("{}, not determined", quantity(x, unit, 2));
    }
    // Two digits of the interval, and the value to the same place, with at most seven digits.
    let exponent = (half * factor).log10().floor() as i32;
    let decimals = (1 - exponent).clamp(0, 7) as usize;
    let value = format!("{:.decimals$}", x * factor);
    let text = if value.trim_start_matches('-').len() > 9 {
        format!("{} ± {}", number(x * factor, 6), number(half * factor, 2))
    } else {
        format!("{value} ± {:.decimals$}", half * factor)
    };
    format!("{}{gap}{prefix}{unit}", text.replace('-', "−"))
}

fn prefix(x: f64, unit: &str) -> (f64, &'static str) {
    if !["Ω", "H", "s", "S", "V"].contains(&unit) || x == 0.0 || !x.is_finite() {
        (1.0, "")
    } else if x < 0.9e-4 {
        (1e6, "µ")
    } else if x < 0.09 {
        (1e3, "m")
    } else {
        (1.0, "")
    }
}

/// A number with its sign and so many decimals: −3.4, +0.2.
pub fn signed(x: f64, decimals: usize) -> String {
    format!("{x:+.decimals$}").replace('-', "−")
}

/// A ratio as percent with a sign.
pub fn percent_change(before: f64, after: f64) -> String {
    let p = 100.0 * (after / before - 1.0);
    if !p.is_finite() {
        return "new".into();
    }
    if p.abs() < 0.05 {
        return "±0\u{a0}%".into();
    }
    format!("{}\u{a0}%", signed(p, if p.abs() >= 10.0 { 0 } else { 1 }))
}

/// An effect's name in a sentence: "main-flux saturation".
pub fn effect_name(e: EffectId) -> String {
    let title = e.card().title;
    // A person's name keeps its capital.
    if title.starts_with("Coulomb") {
        return title.to_owned();
    }
    let mut c = title.chars();
    c.next().map_or(String::new(), |f| f.to_lowercase().chain(c).collect())
}

/// A shorter one, without the parenthesis.
pub fn short_effect_name(e: EffectId) -> String {
    let name = effect_name(e);
    name.split(" (").next().unwrap_or(&name).to_owned()
}

/// The first letter large.
pub fn sentence(s: &str) -> String {
    let mut c = s.chars();
    let mut out: String = c.next().map_or(String::new(), |f| f.to_uppercase().chain(c).collect());
    if !out.is_empty() && !out.ends_with(['.', '?', '!', ':']) {
        out.push('.');
    }
    out
}

/// Named rows of many cells as text, as many columns side by side as a width holds, the rest below.
pub fn side_by_side(rows: &[(String, Vec<String>)], width: usize) -> String {
    let chars = |s: &String| s.chars().count();
    let name = rows.iter().map(|(name, _)| chars(name)).max().unwrap_or(0);
    let cell = 2 + rows.iter().flat_map(|(_, cells)| cells).map(chars).max().unwrap_or(0);
    let columns = rows.first().map_or(0, |(_, cells)| cells.len());
    let at_once = (width.saturating_sub(name) / cell).max(1);
    let block = |first: usize| {
        let line = |(label, cells): &(String, Vec<String>)| {
            let cells: String = cells.iter().skip(first).take(at_once).map(|c| format!("{c:>cell$}")).collect();
            format!("{label:name$}{cells}\n")
        };
        rows.iter().map(line).collect::<String>()
    };
    (0..columns).step_by(at_once).map(block).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        assert_eq!(number(0.0371234, 3), "0.0371");
        assert_eq!(number(12.0, 3), "12");
        assert_eq!(number(-445.51, 3), "−446");
        assert_eq!(number(1200.0, 3), "1200");
        assert_eq!(number(1.41e-5, 3), "1.41·10⁻⁵");
        assert_eq!(number(9.996e-6, 3), "1·10⁻⁵");
        assert_eq!(number(5e-324, 3), "4.94·10⁻³²⁴");
        assert_eq!(number(f64::NAN, 3), "–");
        assert_eq!(quantity(0.00347, "H", 3), "3.47\u{a0}mH");
        assert_eq!(interval(0.00347, 5e-5, "H"), "3.470 ± 0.050\u{a0}mH");
        assert_eq!(interval(1.46622, 5.56e-5, "Ω"), "1.466220 ± 0.000056\u{a0}Ω");
        assert_eq!(interval(0.004, 388.693, "s"), "4\u{a0}ms, not determined");
        assert_eq!(interval(0.0, 1e60, ""), "0, not determined");
        assert_eq!(percent_change(1.0, 1.35), "+35\u{a0}%");
        assert_eq!(percent_change(0.0, 1.0), "new");
    }
}
