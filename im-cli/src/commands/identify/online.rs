//! `im identify --online`: a recording through the identifiers.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use im_chart::{COLOURS, INK, Panel, Series, panels_with_marks, spans};
use im_identify::online::{IdentifierStatus, RegulationParameters, ReplayRow, replay};
use im_model::{MotorFile, write_atomically};
use serde_json::json;

use super::super::inputs::Replayed;
use super::Args;
use crate::failure::Failure;
use crate::interrupt::together;
use crate::spinner::spinning;
use crate::terminal::{rounded, stdout, wrapped};

/// Rows printed.
const SHOWN: usize = 8;

/// Replays the recording and prints the estimates.
pub fn run(motor: &MotorFile, path: &Path, args: &Args) -> Result<(), Failure> {
    let file = path.display();
    let data = Replayed::read(path, args.mapping.as_deref(), motor, args.out.as_deref())?;
    let recording = &data.recording;
    if !data.has_speed() {
        let what = "the identifiers need a measured speed; name its column under [speed], or say locked = true";
        return Err(Failure::Input(format!("{file}: {what}")));
    }
    let rows = spinning("identifying", || replay(motor, recording, args.scheme.into(), |_| true))
        .map_err(|e| Failure::Input(format!("{file} with {}: {e}; the identifiers need it", args.motor.display())))?;
    let p = motor.machine.parameters();
    let start = RegulationParameters::from(p.inverse_gamma());
    // R_req to R_r: (L_r/L_m)².
    let to_rotor = p.rotor_resistance_ohm / start.rotor_resistance_ohm;
    let files = args.out.as_deref().map(|dir| together(|| write(dir, &rows, motor, to_rotor))).transpose()?;
    let share =
        |adapting: &dyn Fn(&ReplayRow) -> bool| rows.iter().filter(|r| adapting(r)).count() as f64 / rows.len().max(1) as f64;
    let adapting =
        [share(&|r| r.rotor.adapting[0]), share(&|r| r.both.adapting[1]), share(&|r| !r.regulation.status.is_frozen())];
    let bounds = at_bounds(&rows);
    let mut text = stdout();
    if args.json {
        let last = rows.last().map(|row| {
            let [r_req, l, r_s, l_f] = row.regulation.values;
            json!({
                "kenne": {"rotor_resistance_ohm": row.rotor.values[0]},
                "kenne_both": {"rotor_resistance_ohm": row.both.values[0], "stator_resistance_ohm": row.both.values[1]},
                "jadot": {
                    "rotor_resistance_ohm": r_req * to_rotor, "magnetizing_inductance_h": l,
                    "stator_resistance_ohm": r_s, "leakage_inductance_h": l_f,
                },
            })
        });
        let report = json!({
            "schema": 1, "machine": motor.name, "rows": recording.len(), "sample_time_s": recording.sample_time_s, "final": last,
            "adapting_share": {
                "kenne": adapting[0], "kenne_both_stator": adapting[1], "jadot": adapting[2],
            },
            "at_bound_share": bounds.iter().map(|b| (b.key.to_owned(), json!(b.share))).collect::<serde_json::Map<_, _>>(),
            "lost_rows": data.lost_rows(), "guessed": data.guessed, "data_quality": data.findings,
        });
        return Ok(writeln!(text, "{report}")?);
    }
    data.print(&mut text)?;
    writeln!(text, "{}: {} rows of {} s", recording.name, recording.len(), rounded(recording.sample_time_s))?;
    writeln!(
        text,
        "\n{:>8} | {:>8} | {:>8} {:>8} | {:>8} {:>8} {:>8} {:>8} {:>8}",
        "t", "R_r", "R_r", "R_s", "R_r", "L", "R_s", "L_f", "known"
    )?;
    writeln!(text, "{:>8} | {:>8} | {:>17} | {:>44}", "s", "Kenné", "Kenné, both", "Jadot")?;
    for k in 0..=SHOWN {
        let Some(row) = rows.get((rows.len() - 1) * k / SHOWN) else { continue };
        let [r_req, l, r_s, l_f] = row.regulation.values;
        let mark = |x: f64, moves: bool, at_bound: bool| {
            format!(
                "{}{}",
                rounded(x),
                if at_bound {
                    '!'
                } else if moves {
                    ' '
                } else {
                    '*'
                }
            )
        };
        let four = |k: usize, x: f64| mark(x, row.regulation.adapting[k], row.regulation.at_bound[k]);
        let both = |k: usize| mark(row.both.values[k], row.both.adapting[k], row.both.at_bound[k]);
        writeln!(
            text,
            "{:>8} | {:>8} | {:>8} {:>8} | {:>8} {:>8} {:>8} {:>8} {:>8}",
            rounded(row.time_s),
            mark(row.rotor.values[0], row.rotor.adapting[0], row.rotor.at_bound[0]),
            both(0),
            both(1),
            four(0, r_req * to_rotor),
            four(1, l),
            four(2, r_s),
            four(3, l_f),
            rounded(row.regulation.excitation.smallest),
        )?;
    }
    writeln!(
        text,
        "\n* held: too little excitation, or not in the scheme. known: smallest eigenvalue of the last second's information"
    )?;
    let on_bounds: Vec<_> = bounds.iter().filter(|b| b.share > 0.0).collect();
    if !on_bounds.is_empty() {
        let each: Vec<_> =
            on_bounds.iter().map(|b| format!("{} in {} % of the rows", b.name, rounded(100.0 * b.share))).collect();
        let what = format!(
            "on a bound of their range, marked with an exclamation mark, and no estimate there: {}. Something else is taken for them: dead time \
             that the voltage of the recording has not been cleared of for R_s, wrong inductances, a wrong speed.",
            each.join("; ")
        );
        write!(text, "{}", wrapped("! ", &what))?;
    }
    let [r_r, r_s, four] = adapting.map(|share| 100.0 * share);
    writeln!(text, "adapting: R_r {r_r:.0} %, R_s {r_s:.0} %, the four {four:.0} % of the time")?;
    if data.lost_rows() > 0 {
        writeln!(text, "{} rows had no usable current: estimates are held there, and filters fill anew", data.lost_rows())?;
    }
    if let Some([table, picture]) = files {
        writeln!(text, "{}: every row", table.display())?;
        writeln!(text, "{}: the same over time", picture.display())?;
    }
    Ok(())
}

/// How much of the time an estimate was held by its range.
struct AtBound {
    key: &'static str,
    name: &'static str,
    share: f64,
}

fn at_bounds(rows: &[ReplayRow]) -> Vec<AtBound> {
    type Held = fn(&ReplayRow) -> bool;
    let each: [(&'static str, &'static str, Held); 7] = [
        ("kenne_rotor_resistance", "R_r (Kenné)", |r| r.rotor.at_bound[0]),
        ("kenne_both_rotor_resistance", "R_r (Kenné, both)", |r| r.both.at_bound[0]),
        ("kenne_both_stator_resistance", "R_s (Kenné, both)", |r| r.both.at_bound[1]),
        ("jadot_rotor_resistance", "R_r (Jadot)", |r| r.regulation.at_bound[0]),
        ("jadot_magnetizing_inductance", "L (Jadot)", |r| r.regulation.at_bound[1]),
        ("jadot_stator_resistance", "R_s (Jadot)", |r| r.regulation.at_bound[2]),
        ("jadot_leakage_inductance", "L_f (Jadot)", |r| r.regulation.at_bound[3]),
    ];
    let share = |held: Held| rows.iter().filter(|r| held(r)).count() as f64 / rows.len().max(1) as f64;
    each.map(|(key, name, held)| AtBound { key, name, share: share(held) }).into()
}

/// Writes every row and the picture; where they are.
fn write(dir: &Path, rows: &[ReplayRow], motor: &MotorFile, to_rotor: f64) -> Result<[PathBuf; 2], Failure> {
    let [table, drawn] = ["estimates.csv", "estimates.svg"].map(|name| dir.join(name));
    write_atomically(&table, |w| csv(w, rows, to_rotor))?;
    let svg = picture(rows, motor);
    write_atomically(&drawn, |w| w.write_all(svg.as_bytes()))?;
    Ok([table, drawn])
}

/// The estimates over time, pale where they are held; and what the last second says of the four.
fn picture(rows: &[ReplayRow], motor: &MotorFile) -> String {
    let p = motor.machine.parameters();
    let known = RegulationParameters::from(p.inverse_gamma());
    let to_rotor = p.rotor_resistance_ohm / known.rotor_resistance_ohm;
    let [blue, red, green, ..] = COLOURS;
    let time = || rows.iter().map(|r| r.time_s);
    let line = |name: &str, colour, value: &dyn Fn(&ReplayRow) -> f64, live: &dyn Fn(&ReplayRow) -> bool| {
        let points = rows.iter().map(|r| (r.time_s, value(r)));
        Series::line(name, points).coloured(colour).pale_in(spans(time(), |n| !live(&rows[n])))
    };
    let jadot = |k: usize, scale: f64| line("Jadot", green, &|r| scale * r.regulation.values[k], &|r| r.regulation.adapting[k]);
    let both = |k: usize| line("Kenné, both", blue, &|r| r.both.values[k], &|r| r.both.adapting[k]);
    let alone = line("Kenné", red, &|r| r.rotor.values[0], &|r| r.rotor.adapting[0]);
    let excitation = line("", INK, &|r| r.regulation.excitation.smallest, &|_| true);
    let panel = |label, series: Vec<Series>, level| Panel::new(label, series).with_level(level, "motor file").tall(120.0);
    let panels = [
        panel("R_r, Ω:", vec![jadot(0, to_rotor), both(0), alone], p.rotor_resistance_ohm),
        panel("R_s, Ω:", vec![jadot(2, 1.0), both(1)], p.stator_resistance_ohm),
        panel("L, H:", vec![jadot(1, 1.0)], known.magnetizing_inductance_h),
        panel("L_f, H:", vec![jadot(3, 1.0)], known.leakage_inductance_h),
        Panel::new("least information about the four in the last second", [excitation]).tall(60.0),
    ];
    let lost = spans(time(), |n| rows[n].regulation.status == IdentifierStatus::LostSample);
    panels_with_marks("Estimates over time, pale where they are held", "time, s", &panels, "lost samples", &lost)
}

fn csv(w: &mut dyn Write, rows: &[ReplayRow], to_rotor: f64) -> io::Result<()> {
    writeln!(
        w,
        "t_s,kenne_rotor_resistance_ohm,kenne_adapting,kenne_both_rotor_resistance_ohm,kenne_both_stator_resistance_ohm,\
         kenne_both_rotor_adapting,kenne_both_stator_adapting,kenne_both_smallest_eigenvalue,jadot_rotor_resistance_ohm,\
         jadot_magnetizing_inductance_h,jadot_stator_resistance_ohm,jadot_leakage_inductance_h,jadot_adapting,\
         jadot_smallest_eigenvalue,jadot_information_rotor_resistance,jadot_information_magnetizing_inductance,\
         jadot_information_stator_resistance,jadot_information_leakage_inductance,kenne_at_bound,kenne_both_rotor_at_bound,\
         kenne_both_stator_at_bound,jadot_rotor_at_bound,jadot_magnetizing_at_bound,jadot_stator_at_bound,jadot_leakage_at_bound"
    )?;
    for r in rows {
        let [r_req, l, r_s, l_f] = r.regulation.values;
        let [a, b, c, d] = r.regulation.excitation.of_each;
        let one = |x: bool| u8::from(x);
        let all = |held: &[bool]| held.iter().map(|&x| one(x).to_string()).collect::<Vec<_>>().join(",");
        let [both, four] = [all(&r.both.at_bound), all(&r.regulation.at_bound)];
        writeln!(
            w,
            "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}",
            r.time_s,
            r.rotor.values[0],
            one(r.rotor.adapting[0]),
            r.both.values[0],
            r.both.values[1],
            one(r.both.adapting[0]),
            one(r.both.adapting[1]),
            r.both.excitation.smallest,
            r_req * to_rotor,
            l,
            r_s,
            l_f,
            one(!r.regulation.status.is_frozen()),
            r.regulation.excitation.smallest,
            a,
            b,
            c,
            d,
            one(r.rotor.at_bound[0]),
            both,
            four
        )?;
    }
    Ok(())
}
