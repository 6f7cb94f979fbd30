//! What the names of columns say: the quantity, the phase or axis, and whether a sensor measured it.

use super::unit::{Quantity, Unit};

/// Who made a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Origin {
    /// A sensor, as far as the name says.
    Sensor,
    /// A filter behind a sensor.
    Filter,
    /// A controller: a command or a reference.
    Command,
    /// An observer or a simulation.
    Estimate,
}

/// Who made a column of this name.
pub(super) fn origin(name: &str) -> Origin {
    let words = words(name);
    let has = |list: &[&str]| words.iter().any(|w| list.contains(&w.as_str()));
    if has(&["est", "estimate", "estimated", "hat", "obs", "observer", "observed", "model", "sim", "simulated", "predicted"]) {
        Origin::Estimate
    } else if has(&["ref", "reference", "cmd", "command", "commanded", "set", "setpoint", "sp", "soll", "demand", "target"]) {
        Origin::Command
    } else if has(&["filt", "filter", "filtered", "lpf", "smooth", "smoothed", "avg"]) {
        Origin::Filter
    } else {
        Origin::Sensor
    }
}

/// Whether a name says the torque in the air gap, which a drive computes: no sensor measures it, and it is not the load's.
pub(super) fn is_air_gap_torque(name: &str) -> bool {
    let words = words(name);
    let gap = ["em", "el", "elec", "electric", "electrical", "electromagnetic", "emag", "airgap", "gap", "te", "tem", "mel"];
    words.iter().any(|w| gap.contains(&w.as_str()))
}

/// Whether a name says the voltage of a dc link.
pub(super) fn is_dc_link(name: &str) -> bool {
    let words = words(name);
    let link = ["dc", "udc", "vdc", "bus", "vbus", "ubus", "dclink", "zk", "uzk"];
    words.iter().any(|w| link.contains(&w.as_str())) && !words.iter().any(|w| w.starts_with('i'))
}

/// Which axis of a turning frame a name says: `id`, `u_q`, `Isd_ref`.
pub(super) fn axis(name: &str) -> Option<&'static str> {
    let words = words(name);
    let is = |letter: &str| {
        words.iter().any(|w| {
            let stem = w.strip_prefix(['u', 'v', 'i']).map_or(w.as_str(), |r| r.strip_prefix('s').unwrap_or(r));
            stem == letter
        })
    };
    ["d", "q"].into_iter().find(|l| is(l))
}

/// Whether a name says the angle of a turning frame.
pub(super) fn is_frame_angle(name: &str) -> bool {
    words(name).iter().any(|w| ["theta", "tita", "angle", "phi", "winkel", "gamma"].iter().any(|a| w.starts_with(a)))
}

/// Whether a name says counts, those of an encoder.
pub(super) fn is_count(name: &str) -> bool {
    let counts = ["count", "counts", "cnt", "enc", "encoder", "qep", "tick", "ticks", "pulses", "impulse", "geber", "inkremente"];
    words(name).iter().any(|w| counts.contains(&w.trim_end_matches(|c: char| c.is_ascii_digit())))
}

/// Whether a name says a duty cycle.
pub(super) fn is_duty(name: &str) -> bool {
    words(name).iter().any(|w| w.starts_with("duty") || w == "pwm" || w == "tast")
}

/// The words of a name in small letters: `iAlphaRef`, `v_alpha_ref` and `v alpha.ref` have the same.
fn words(name: &str) -> Vec<String> {
    let mut out: Vec<String> = vec![String::new()];
    let mut small = false;
    for c in name.chars() {
        if !c.is_alphanumeric() || (small && c.is_uppercase()) {
            out.push(String::new());
        }
        if c.is_alphanumeric() {
            out.iter_mut().last().into_iter().for_each(|w| w.extend(c.to_lowercase()));
        }
        small = c.is_lowercase();
    }
    out.retain(|w| !w.is_empty());
    out
}

/// What a name without a unit says of the quantity.
pub(super) fn quantity(name: &str) -> Option<Quantity> {
    let low = name.to_lowercase();
    let has = |words: &[&str]| words.iter().any(|w| low.contains(w));
    let marked = place(name, None).is_some();
    let starts = |words: &[&str]| {
        words.iter().any(|w| {
            low == *w
                || low.strip_prefix(w).is_some_and(|r| {
                    let phase =
                        r.starts_with(|c: char| !c.is_alphabetic() || "abcuvwrst".contains(c)) || ["l1", "l2", "l3"].contains(&r);
                    phase && (r.len() <= 8 || marked)
                })
        })
    };
    if is_dc_link(name) || is_duty(name) || is_frame_angle(name) {
        None
    } else if has(&["time", "zeit", "temps"]) || low == "t" {
        Some(Quantity::Time)
    } else if has(&["torque", "moment", "load", "m_l"]) || name == "M" {
        Some(Quantity::Torque)
    } else if has(&["speed", "omega", "rpm", "drehzahl", "tacho", "encoder", "vitesse", "velocity"])
        || low == "n"
        || low.starts_with("n_")
        || low.strip_prefix("vel").is_some_and(|r| !r.starts_with(char::is_alphabetic))
        || low == "w"
        || low.starts_with("w_")
    {
        Some(Quantity::Speed)
    } else if has(&["volt", "spannung", "tension", "spg"]) || starts(&["u", "v"]) {
        Some(Quantity::Voltage)
    } else if has(&["curr", "strom", "amp"]) || starts(&["i"]) {
        Some(Quantity::Current)
    } else {
        None
    }
}

/// Which phase or axis a name says that has this unit in it.
pub(super) fn place(name: &str, unit: Option<Unit>) -> Option<usize> {
    // The A of ib_A is no phase; that of "phase A" is.
    let unit = unit.filter(|u| name.strip_suffix(u.text).is_some_and(|before| before.ends_with('_')));
    let low = unit.and_then(|u| name.strip_suffix(u.text)).unwrap_or(name).to_lowercase();
    if low.contains("alpha") || low.contains('α') {
        return Some(3);
    }
    if low.contains("beta") || low.contains('β') {
        return Some(4);
    }
    // Without unit, brackets and words.
    let stem: String = low.split(['(', '[']).next().unwrap_or("").to_owned();
    let parts: Vec<&str> = stem.split(['_', ' ', '.', '-', '/']).filter(|p| !p.is_empty()).collect();
    let mark = |m: &str| match m {
        "ab" | "uv" | "rs" | "12" => Some(5),
        "bc" | "vw" | "st" | "23" => Some(6),
        "ca" | "wu" | "tr" | "31" => Some(7),
        "a" | "u" | "r" | "1" | "l1" => Some(0),
        "b" | "v" | "s" | "2" | "l2" => Some(1),
        "c" | "w" | "t" | "3" | "l3" => Some(2),
        _ => None,
    };
    // U L1-L2: two phases of one kind.
    let line = |pair: &[&str]| {
        ["abc", "uvw", "rst", "123"].iter().find_map(|kind| {
            let [p, q] = [pair[0], pair[1]].map(|m| kind.find(m.strip_prefix('l').unwrap_or(m)).filter(|_| mark(m).is_some()));
            [(0, 1), (1, 2), (2, 0)].iter().position(|&(a, b)| (p, q) == (Some(a), Some(b))).map(|k| k + 5)
        })
    };
    // Ia, u12; behind a word only what is no word itself: Spannung U12.
    let in_one = |k: usize| {
        let tail = parts[k].strip_prefix(['u', 'v', 'i', 'e'])?;
        mark(tail).filter(|_| k == 0 || tail.len() > 1 || tail.starts_with(|c: char| c.is_ascii_digit()))
    };
    // i_a, u_ab, phase a, channel 1.
    parts
        .windows(2)
        .find_map(line)
        .or_else(|| parts.iter().skip(1).find_map(|p| mark(p)))
        .or_else(|| (0..parts.len()).find_map(in_one))
}

#[cfg(test)]
mod tests {
    use super::super::unit::in_name;
    use super::*;

    #[test]
    fn names_say_who_made_a_column() {
        for (name, made) in [
            ("ia", Origin::Sensor),
            ("iA_est", Origin::Estimate),
            ("omegaHat", Origin::Estimate),
            ("v_alpha_ref", Origin::Command),
            ("uAlphaCmd", Origin::Command),
            ("omega_filt", Origin::Filter),
            ("n_rpm", Origin::Sensor),
            ("offset_A", Origin::Sensor),
        ] {
            assert_eq!(origin(name), made, "{name}");
        }
    }

    #[test]
    fn a_unit_is_no_phase() {
        let all = [
            ("ib_A", Some(1)),
            ("ia2_A", None),
            ("phase A", Some(0)),
            ("u_ab_V", Some(5)),
            ("Channel A", Some(0)),
            ("Spannung U12 [V]", Some(5)),
            ("U L2-L3", Some(6)),
            ("U_w_u", Some(7)),
            ("i_a_2", Some(0)),
            ("Strom I3 [A]", Some(2)),
            ("current is high", None),
            ("i_V", None),
        ];
        for (name, phase) in all {
            assert_eq!(place(name, in_name(name)), phase, "{name}");
        }
        assert_eq!((axis("id_A"), axis("u_q"), axis("Isd"), axis("idle")), (Some("d"), Some("q"), Some("d"), None));
        assert!(is_frame_angle("theta_rad") && is_duty("duty_a") && !is_duty("induct"));
    }

    #[test]
    fn counts_are_told_by_their_name() {
        for name in ["enc_count", "QEP1", "Encoder", "encCnt", "Geber Impulse"] {
            assert!(is_count(name), "{name}");
        }
        for name in ["n_rpm", "current", "discount", "country"] {
            assert!(!is_count(name), "{name}");
        }
    }

    #[test]
    fn a_torque_of_the_air_gap_is_told_by_its_name() {
        for name in ["T_em_Nm", "Te (Nm)", "M_el", "torque_airgap"] {
            assert!(is_air_gap_torque(name), "{name}");
        }
        for name in ["T_Nm", "tau_load_Nm", "M_Welle", "torque (Nm)"] {
            assert!(!is_air_gap_torque(name), "{name}");
        }
    }

    #[test]
    fn a_dc_link_is_no_phase() {
        for name in ["v_dc", "Udc", "vBus", "DC link (V)"] {
            assert!(is_dc_link(name), "{name}");
        }
        for name in ["u_d", "i_dc", "udca", "v_a"] {
            assert!(!is_dc_link(name), "{name}");
        }
    }

    #[test]
    fn quantities_are_read_from_names() {
        for (name, quantity_of) in [
            ("vel1", Some(Quantity::Speed)),
            ("velocity", Some(Quantity::Speed)),
            ("v_alpha_ref", Some(Quantity::Voltage)),
            ("v_dc", None),
            ("ib", Some(Quantity::Current)),
            ("UL1", Some(Quantity::Voltage)),
            ("fault_flag", None),
        ] {
            assert_eq!(quantity(name), quantity_of, "{name}");
        }
    }
}
