//! Recordings as text: one line of column names, one row per sample.
//!
//! Rows are read one by one into the recording itself, so that memory stays at about the size of the data.

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Write};
use std::path::Path;

use num_complex::Complex;

use crate::atomic_file::write_atomically;
use crate::file_error::{FileError, Problem};
use crate::recording::Recording;
use crate::space_vector::from_phases;
use crate::toml_reader::nearest;

const T: &str = "t_s";
const OMEGA: &str = "omega_m_rad_s";
const TAU: &str = "tau_load_Nm";
const U: Names = Names { vector: ["u_alpha_V", "u_beta_V"], phases: ["u_a_V", "u_b_V", "u_c_V"], third_needed: true };
const I: Names = Names { vector: ["i_alpha_A", "i_beta_A"], phases: ["i_a_A", "i_b_A", "i_c_A"], third_needed: false };

/// No line of numbers is longer: a file without line ends is refused before it fills the memory.
const LONGEST_LINE: u64 = 1 << 20;
/// How far a step of time may lie from the usual one: written times are rounded, missing rows are a whole step.
const UNEVEN: f64 = 0.25;

/// How a space vector stands in a file.
struct Names {
    vector: [&'static str; 2],
    phases: [&'static str; 3],
    third_needed: bool,
}

/// Where a space vector is found in a row.
enum Source {
    Vector([usize; 2]),
    Phases([usize; 3]),
    TwoPhases([usize; 2]),
}

impl Source {
    fn read(&self, row: &[f64]) -> Complex<f64> {
        match *self {
            Self::Vector([a, b]) => Complex::new(row[a], row[b]),
            Self::Phases([a, b, c]) => from_phases([row[a], row[b], row[c]]),
            Self::TwoPhases([a, b]) => from_phases([row[a], row[b], -row[a] - row[b]]),
        }
    }
}

impl Recording {
    /// Reads a file of one line of column names and one row per sample:
    /// `t_s,u_alpha_V,u_beta_V,i_alpha_A,i_beta_A,omega_m_rad_s,tau_load_Nm`, in any order; `tau_load_Nm` may be missing. Phase
    /// quantities are read too: `u_a_V,u_b_V,u_c_V` and `i_a_A,i_b_A,i_c_A`, of which `i_c_A` may be missing (the star point floats:
    /// i_c = −i_a − i_b). Other columns are passed over, as are empty lines and lines that begin with `#`. Columns are separated by
    /// commas, semicolons or tabs; numbers have a decimal point.
    ///
    /// # Errors
    /// The file cannot be read, is empty, lacks a column or has one twice, or a row is cut, holds something that is not a finite
    /// number, or does not follow its predecessor by the sampling time; the error carries the line and the column.
    pub fn read_csv(path: impl AsRef<Path>) -> Result<Self, FileError> {
        let path = path.as_ref();
        let label = path.display().to_string();
        let io = |e: io::Error| FileError::io(&label, "read", &e);
        let file = File::open(path).map_err(io)?;
        let bytes = file.metadata().map_err(io)?.len();
        let mut recording = Reader::new(BufReader::with_capacity(1 << 17, file), &label, bytes)?.all()?;
        if let Some(stem) = path.file_stem() {
            recording.name = stem.to_string_lossy().into_owned();
        }
        Ok(recording)
    }

    /// Reads from anywhere; `label` names the source in messages and the recording.
    ///
    /// # Errors
    /// As [`read_csv`](Self::read_csv).
    pub fn from_csv(source: impl BufRead, label: &str) -> Result<Self, FileError> {
        Reader::new(source, label, 0)?.all()
    }

    /// Writes a file in the canonical columns, as a whole or not at all. Numbers read back as the same bits.
    ///
    /// # Errors
    /// The system refuses; the old file is then unchanged.
    pub fn write_csv(&self, path: impl AsRef<Path>) -> Result<(), FileError> {
        write_atomically(path.as_ref(), |out| self.to_csv(out))
    }

    /// Writes to anywhere, in the canonical columns.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn to_csv(&self, out: &mut impl Write) -> io::Result<()> {
        let [u_alpha, u_beta] = U.vector;
        let [i_alpha, i_beta] = I.vector;
        write!(out, "{T},{u_alpha},{u_beta},{i_alpha},{i_beta},{OMEGA}")?;
        if self.tau_load.is_some() {
            write!(out, ",{TAU}")?;
        }
        writeln!(out)?;
        let rows = self.u_s.iter().zip(&self.i_s).zip(&self.omega_m).enumerate();
        for (k, ((u, i), omega_m)) in rows {
            write_time(out, self.time_s(k))?;
            // `{:?}` is the shortest text that reads back as the same bits.
            write!(out, ",{:?},{:?},{:?},{:?},{omega_m:?}", u.re, u.im, i.re, i.im)?;
            if let Some(tau) = self.tau_load.as_ref().and_then(|tau| tau.get(k)) {
                write!(out, ",{tau:?}")?;
            }
            writeln!(out)?;
        }
        Ok(())
    }
}

/// 0.3 rather than 0.30000000000000004: rounded to the picosecond where that is only noise of the product k·T.
fn write_time(out: &mut impl Write, t: f64) -> io::Result<()> {
    let rounded = (t * 1e12).round() / 1e12;
    let noise = 4.0 * f64::EPSILON * t.abs();
    write!(out, "{}", if (rounded - t).abs() <= noise { rounded } else { t })
}

struct Reader<'a, R> {
    source: R,
    label: &'a str,
    /// Length of the source, if known.
    bytes: u64,
    line: Vec<u8>,
    line_number: usize,
    bytes_read: u64,
    separator: u8,
    names: Vec<String>,
    /// The columns that are read.
    needed: Vec<bool>,
    t: usize,
    omega: usize,
    tau: Option<usize>,
    u: Source,
    i: Source,
}

impl<'a, R: BufRead> Reader<'a, R> {
    /// Reads the line of column names.
    fn new(source: R, label: &'a str, bytes: u64) -> Result<Self, FileError> {
        let mut this = Self {
            source,
            label,
            bytes,
            line: Vec::new(),
            line_number: 0,
            bytes_read: 0,
            separator: b',',
            names: Vec::new(),
            needed: Vec::new(),
            t: 0,
            omega: 0,
            tau: None,
            u: Source::Vector([0; 2]),
            i: Source::Vector([0; 2]),
        };
        if !this.next_line()? {
            return Err(FileError::new(label, None, None, Problem::NoRows { found: "the file is empty" }));
        }
        let head = this.text()?.trim_start_matches('\u{feff}').to_owned();
        this.separator = [b',', b';', b'\t'].into_iter().find(|s| head.as_bytes().contains(s)).unwrap_or(b',');
        this.names = head.split(char::from(this.separator)).map(|n| n.trim().trim_matches('"').to_owned()).collect();
        if this.names.iter().all(|n| n.parse::<f64>().is_ok()) {
            let found = "the first line holds numbers";
            return Err(this.error(None, Problem::NoRows { found }));
        }
        this.t = this.need(T)?;
        this.u = this.need_vector(&U)?;
        this.i = this.need_vector(&I)?;
        this.omega = this.need(OMEGA)?;
        this.tau = this.find(TAU)?;
        // A slip of the pen in an optional column would otherwise pass in silence.
        if this.tau.is_none() && this.like(TAU).is_some() {
            return Err(this.missing(TAU));
        }
        this.needed = (0..this.names.len()).map(|k| this.is_needed(k)).collect();
        Ok(this)
    }

    fn all(mut self) -> Result<Recording, FileError> {
        let mut r = Recording {
            name: self.label.to_owned(),
            start_s: 0.0,
            sample_time_s: 0.0,
            u_s: Vec::new(),
            i_s: Vec::new(),
            omega_m: Vec::new(),
            tau_load: self.tau.map(|_| Vec::new()),
        };
        let mut time = Vec::new();
        let mut row = vec![0.0; self.names.len()];
        // Lines skipped so far, to find the line of a row again.
        let mut skipped: Vec<(usize, usize)> = Vec::new();
        let before_rows = self.bytes_read;
        while self.next_line()? {
            let offset = self.line_number - time.len();
            if skipped.last().is_none_or(|(_, o)| *o != offset) {
                skipped.push((time.len(), offset));
            }
            self.row(&mut row)?;
            if let Some(&before_s) = time.last().filter(|t| **t >= row[self.t]) {
                return Err(self.error(Some(T), Problem::TimeNotForward { before_s, now_s: row[self.t] }));
            }
            time.push(row[self.t]);
            r.u_s.push(self.u.read(&row));
            r.i_s.push(self.i.read(&row));
            r.omega_m.push(row[self.omega]);
            if let (Some(tau), Some(column)) = (&mut r.tau_load, self.tau) {
                tau.push(row[column]);
            }
            if time.len() == 1000 {
                // From here the length of the file foretells the number of rows: no vector grows by doubling.
                let per_row = ((self.bytes_read - before_rows) / 1000).max(1);
                let more = (self.bytes.saturating_sub(self.bytes_read) / per_row) as usize;
                let more = more + more / 50;
                time.reserve_exact(more);
                r.u_s.reserve_exact(more);
                r.i_s.reserve_exact(more);
                r.omega_m.reserve_exact(more);
                if let Some(tau) = &mut r.tau_load {
                    tau.reserve_exact(more);
                }
            }
        }
        if time.len() < 2 {
            let found = if time.is_empty() { "no rows under the header" } else { "only one row: the sampling time needs two" };
            return Err(self.error(None, Problem::NoRows { found }));
        }
        r.start_s = time[0];
        r.sample_time_s = sampling_time(&time).map_err(|(k, problem)| {
            let offset = skipped.iter().rev().find(|(from, _)| *from <= k).map_or(0, |(_, o)| *o);
            FileError::new(self.label, Some(k + offset), Some(T), problem)
        })?;
        r.u_s.shrink_to_fit();
        r.i_s.shrink_to_fit();
        r.omega_m.shrink_to_fit();
        if let Some(tau) = &mut r.tau_load {
            tau.shrink_to_fit();
        }
        Ok(r)
    }

    /// The next line with content; `false` at the end.
    fn next_line(&mut self) -> Result<bool, FileError> {
        loop {
            self.line.clear();
            let n = (&mut self.source)
                .take(LONGEST_LINE)
                .read_until(b'\n', &mut self.line)
                .map_err(|e| FileError::io(self.label, "read", &e))?;
            if n == 0 {
                return Ok(false);
            }
            self.bytes_read += n as u64;
            self.line_number += 1;
            if n as u64 == LONGEST_LINE && self.line.last() != Some(&b'\n') {
                return Err(self.not_text());
            }
            let content = self.line.trim_ascii();
            if !content.is_empty() && content[0] != b'#' {
                return Ok(true);
            }
        }
    }

    /// The line as text.
    fn text(&self) -> Result<&str, FileError> {
        match std::str::from_utf8(self.line.trim_ascii()) {
            Ok(text) if !text.contains('\0') => Ok(text),
            _ => Err(self.not_text()),
        }
    }

    fn not_text(&self) -> FileError {
        let reason = "not a text of lines in UTF-8; export the recording as CSV".to_owned();
        self.error(None, Problem::Syntax { reason })
    }

    /// The numbers of the line.
    fn row(&mut self, row: &mut [f64]) -> Result<(), FileError> {
        let mut found = 0;
        for field in self.line.trim_ascii_end().split(|&b| b == self.separator) {
            if let Some(x) = row.get_mut(found) {
                let text = std::str::from_utf8(field).unwrap_or("unreadable").trim_ascii();
                match text.parse() {
                    Ok(value) if f64::is_finite(value) => *x = value,
                    _ if !self.needed[found] => {}
                    _ => return Err(self.bad_field(found, text)),
                }
            }
            found += 1;
        }
        if found == row.len() { Ok(()) } else { self.row_length(found) }
    }

    fn is_needed(&self, column: usize) -> bool {
        let of = |s: &Source| match s {
            Source::Vector(c) | Source::TwoPhases(c) => c.contains(&column),
            Source::Phases(c) => c.contains(&column),
        };
        column == self.t || column == self.omega || Some(column) == self.tau || of(&self.u) || of(&self.i)
    }

    #[cold]
    fn bad_field(&self, column: usize, text: &str) -> FileError {
        let fields = self.line.trim_ascii_end().split(|&b| b == self.separator).count();
        let cut = self.line.last() != Some(&b'\n') && fields < self.names.len();
        if cut {
            let problem = Problem::RowLength { found: fields, expected: self.names.len(), last: true };
            return self.error(None, problem);
        }
        let found = match text.parse::<f64>() {
            _ if text.is_empty() => String::new(),
            Ok(x) => x.to_string(),
            Err(_) => format!("\"{}\"", text.chars().take(40).collect::<String>()),
        };
        self.error(self.names.get(column).map(String::as_str), Problem::NotANumber { found })
    }

    #[cold]
    fn row_length(&mut self, found: usize) -> Result<(), FileError> {
        let at = self.line_number;
        let last = !self.next_line()?;
        let problem = Problem::RowLength { found, expected: self.names.len(), last };
        Err(FileError::new(self.label, Some(at), None, problem))
    }

    fn error(&self, column: Option<&str>, problem: Problem) -> FileError {
        FileError::new(self.label, (self.line_number > 0).then_some(self.line_number), column, problem)
    }

    fn find(&self, name: &str) -> Result<Option<usize>, FileError> {
        let mut places = self.names.iter().enumerate().filter(|(_, n)| *n == name).map(|(k, _)| k);
        match (places.next(), places.next()) {
            (Some(a), Some(b)) => Err(self.error(Some(name), Problem::DuplicateColumn { places: [a + 1, b + 1] })),
            (first, _) => Ok(first),
        }
    }

    fn need(&self, name: &str) -> Result<usize, FileError> {
        self.find(name)?.ok_or_else(|| self.missing(name))
    }

    fn missing(&self, name: &str) -> FileError {
        let nearest = self.like(name).map(str::to_owned);
        self.error(Some(name), Problem::MissingColumn { present: self.names.clone(), nearest })
    }

    /// A column that is not known and looks like `name`.
    fn like(&self, name: &str) -> Option<&str> {
        let known = |n: &str| {
            let vectors = U.vector.iter().chain(&I.vector).chain(&U.phases).chain(&I.phases);
            [T, OMEGA, TAU].iter().chain(vectors).any(|k| *k == n)
        };
        nearest(name, self.names.iter().map(String::as_str).filter(|n| !known(n)))
    }

    fn need_vector(&self, names: &Names) -> Result<Source, FileError> {
        let phases = [self.find(names.phases[0])?, self.find(names.phases[1])?, self.find(names.phases[2])?];
        let vector = [self.find(names.vector[0])?, self.find(names.vector[1])?];
        match (vector, phases) {
            ([Some(_), _] | [_, Some(_)], [Some(_), ..] | [_, Some(_), _] | [.., Some(_)]) => {
                let found = format!("given beside {}", names.phases.join(", "));
                let expected = "one form or the other; drop one of them".to_owned();
                Err(self.error(Some(&names.vector.join(", ")), Problem::Unexpected { found, expected }))
            }
            ([Some(a), Some(b)], _) => Ok(Source::Vector([a, b])),
            (_, [Some(a), Some(b), Some(c)]) => Ok(Source::Phases([a, b, c])),
            (_, [Some(a), Some(b), None]) if !names.third_needed => Ok(Source::TwoPhases([a, b])),
            ([None, None], [None, None, None]) => Err(self.missing(names.vector[0])),
            ([None, None], _) => {
                let absent = names.phases.into_iter().zip(phases).find(|(_, p)| p.is_none()).map_or(names.phases[2], |(n, _)| n);
                Err(self.missing(absent))
            }
            ([a, _], _) => Err(self.missing(names.vector[usize::from(a.is_some())])),
        }
    }
}

/// The sampling time of evenly spaced times, or the row where they are not.
fn sampling_time(time: &[f64]) -> Result<f64, (usize, Problem)> {
    // The median of the first thousand steps: a single gap does not move it.
    let mut steps: Vec<f64> = time.windows(2).take(1000).map(|w| w[1] - w[0]).collect();
    let middle = steps.len() / 2;
    let usual_s = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
    for (k, w) in time.windows(2).enumerate() {
        let step_s = w[1] - w[0];
        if (step_s - usual_s).abs() > UNEVEN * usual_s {
            return Err((k + 1, Problem::TimeUneven { step_s, usual_s }));
        }
    }
    let (first, last) = (time[0], time[time.len() - 1]);
    let n = (time.len() - 1) as f64;
    let mean = (last - first) / n;
    // Steps can be even one by one and still change over the run.
    let drift = |k: &usize| (time[*k] - first - mean * *k as f64).abs() > mean;
    if let Some(k) = (0..time.len()).find(drift) {
        return Err((k, Problem::TimeUneven { step_s: (time[k] - first) / k as f64, usual_s: mean }));
    }
    // The shortest number, or whole frequency, that gives the last time as well as the mean does: 1e-4, not 1.0000000000000002e-4.
    let ulp = 4.0 * f64::EPSILON * first.abs().max(last.abs());
    let decimals = (0..=12).filter_map(|digits| format!("{mean:.digits$e}").parse::<f64>().ok());
    let whole_frequency = 1.0 / (1.0 / mean).round();
    let fits = |t: &f64| (first + n * t - last).abs() <= ulp;
    Ok(decimals.chain([whole_frequency]).find(fits).unwrap_or(mean))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const GOOD: &str = "t_s,u_alpha_V,u_beta_V,i_alpha_A,i_beta_A,omega_m_rad_s,tau_load_Nm\n\
        0,1,2,3,4,5,6\n0.0001,7,8,9,10,11,12\n0.0002,1,2,3,4,5,6\n0.0003,7,8,9,10,11,12\n";

    fn read(text: &str) -> Result<Recording, FileError> {
        Recording::from_csv(text.as_bytes(), "run.csv")
    }
    fn error(text: &str) -> String {
        read(text).unwrap_err().to_string()
    }

    #[test]
    fn canonical_columns_in_any_order_with_comments_and_other_separators() {
        let r = read(GOOD).unwrap();
        assert_eq!((r.len(), r.sample_time_s, r.start_s), (4, 1e-4, 0.0));
        assert_eq!(r.u_s[1], Complex::new(7.0, 8.0));
        assert_eq!(r.tau_load.as_ref().unwrap()[3], 12.0);
        for (from, to) in
            [(",", ";"), (",", "\t"), (",", " , "), ("\n", "\r\n"), ("\n0", "\n\n# remark\n0"), ("t_s", "\u{feff}t_s")]
        {
            assert_eq!(read(&GOOD.replace(from, to)).unwrap(), r, "{from:?} → {to:?}");
        }
        let turned = "omega_m_rad_s,comment,t_s,i_beta_A,i_alpha_A,u_beta_V,u_alpha_V\n5,start,0,4,3,2,1\n11,,1e-4,10,9,8,7\n";
        let t = read(turned).unwrap();
        assert_eq!((t.u_s[1], t.i_s[1], t.omega_m[1], t.tau_load.clone()), (r.u_s[1], r.i_s[1], r.omega_m[1], None));
    }

    #[test]
    fn phases_become_space_vectors() {
        let text = "t_s,u_a_V,u_b_V,u_c_V,i_a_A,i_b_A,omega_m_rad_s\n0,101,-49,-49,2,-1,0\n1e-3,1,1,1,0,1,0\n";
        let r = read(text).unwrap();
        assert!((r.u_s[0] - Complex::new(100.0, 0.0)).norm() < 1e-12, "the common mode drops out: {}", r.u_s[0]);
        assert!(r.u_s[1].norm() < 1e-12);
        assert!((r.i_s[0] - Complex::new(2.0, 0.0)).norm() < 1e-12);
    }

    #[test]
    fn errors_name_line_column_and_cure() {
        let bad = |from: &str, to: &str| error(&GOOD.replacen(from, to, 1));
        assert_eq!(
            bad("0.0001,7,8,9", "0.0001,7,8,x9"),
            "run.csv:3: i_alpha_A is \"x9\", expected a finite number with a decimal point; repair the row or cut the recording there"
        );
        assert!(bad("0.0001,7,8,9", "0.0001,7,8,").starts_with("run.csv:3: i_alpha_A is empty, "));
        assert!(bad("0.0001,7,8,9", "0.0001,7,8,nan").starts_with("run.csv:3: i_alpha_A is NaN, "));
        assert!(bad("0.0001,7,8,9", "0.0001,7,8,-inf").starts_with("run.csv:3: i_alpha_A is -inf, "));
        assert_eq!(
            bad("7,8,9,10,11,12", "7,8,9"),
            "run.csv:3: the row has 4 fields, the header 7; repair the row or cut the recording there"
        );
        for cut in [3, 5, 9] {
            let e = error(&GOOD[..GOOD.len() - cut]);
            if cut < 4 {
                assert!(e.contains("run.csv:5:") || read(&GOOD[..GOOD.len() - cut]).is_ok(), "{e}");
            } else {
                assert!(e.starts_with("run.csv:5: the file ends within this row: "), "{cut}: {e}");
            }
        }
        assert_eq!(
            bad("i_beta_A", "i_beta"),
            "run.csv:1: column i_beta_A is missing; is i_beta meant for it? Rename it; the file has \
             t_s, u_alpha_V, u_beta_V, i_alpha_A, i_beta, omega_m_rad_s, tau_load_Nm"
        );
        assert!(bad("tau_load_Nm", "tau_load_nm").contains("is tau_load_nm meant for it?"));
        assert_eq!(
            bad("tau_load_Nm", "i_beta_A"),
            "run.csv:1: column i_beta_A stands twice, as columns 5 and 7; drop or rename one"
        );
        assert!(bad("0.0002", "0.00005").starts_with("run.csv:4: t_s = 0.00005 after 0.0001: time must advance"));
        assert_eq!(
            bad("0.0003", "0.0013"),
            "run.csv:5: t_s advances by 0.0011 s here, by 0.0001 s elsewhere: rows are missing or the sampling time changes; cut the \
             recording there, or resample it evenly"
        );
        assert_eq!(error(""), "run.csv: the file is empty, expected a line of column names and rows of numbers below");
        assert!(error(&GOOD[..GOOD.find('\n').unwrap()]).contains("no rows under the header"));
        assert!(error("0,1,2,3,4,5,6\n1,1,2,3,4,5,6\n").starts_with("run.csv:1: the first line holds numbers"));
        assert!(error(&GOOD.lines().take(2).collect::<Vec<_>>().join("\n")).contains("only one row"));
        assert!(bad("u_alpha_V", "u_a_V").contains("one form or the other"), "{}", bad("u_alpha_V", "u_a_V"));
        let binary = Recording::from_csv(&[0xff, 0xfe, b't', 0, b'\n'][..], "run.csv").unwrap_err();
        assert!(binary.to_string().contains("UTF-8"), "{binary}");
        let endless = Recording::from_csv(io::BufReader::new(io::repeat(b'7')), "run.csv").unwrap_err();
        assert!(endless.to_string().contains("not a text of lines"), "{endless}");
    }

    #[test]
    fn an_uneven_row_is_found_behind_remarks() {
        let text = GOOD.replace("0.0002,", "# remark\n\n0.0002,").replace("0.0003", "0.0005");
        assert!(error(&text).starts_with("run.csv:7: t_s advances"), "{}", error(&text));
    }

    #[test]
    fn a_slow_change_of_the_sampling_time_is_found() {
        let mut text = String::from("t_s,u_alpha_V,u_beta_V,i_alpha_A,i_beta_A,omega_m_rad_s\n");
        let mut t = 0.0;
        for k in 0..4000 {
            text += &format!("{t},0,0,0,0,0\n");
            t += if k < 2000 { 1e-4 } else { 1.1e-4 };
        }
        assert!(error(&text).contains("sampling time changes"), "{}", error(&text));
    }

    proptest! {
        /// Samples read back as the same bits; so do start and sampling time where they are round numbers.
        #[test]
        fn write_then_read_round_trips(
            n in 2usize..60,
            frequency in prop::sample::select(vec![1.0, 500.0, 3000.0, 10_000.0, 16_000.0, 44_100.0, 1e6]),
            start in 0u32..1000,
            load in any::<bool>(),
            seed in prop::collection::vec(-1e9..1e9f64, 60),
            tiny in -300..0i32,
        ) {
            let x = |k: usize| seed[k % 60] * if k.is_multiple_of(7) { 10f64.powi(tiny) } else { 1.0 };
            let r = Recording {
                name: "run.csv".into(),
                start_s: f64::from(start) / 8.0,
                sample_time_s: 1.0 / frequency,
                u_s: (0..n).map(|k| Complex::new(x(k), x(k + 1))).collect(),
                i_s: (0..n).map(|k| Complex::new(x(k + 2), x(k + 3))).collect(),
                omega_m: (0..n).map(|k| x(k + 4)).collect(),
                tau_load: load.then(|| (0..n).map(|k| x(k + 5)).collect()),
            };
            let mut text = Vec::new();
            r.to_csv(&mut text).unwrap();
            let back = Recording::from_csv(&text[..], "run.csv").unwrap();
            // Each of the two times that it is taken from is rounded to its own last bit.
            let rounding = 8.0 * f64::EPSILON * (r.time_s(n) + 1.0) / (n - 1) as f64;
            let off = (back.sample_time_s - r.sample_time_s).abs();
            prop_assert!(off <= rounding, "{} is not {}", back.sample_time_s, r.sample_time_s);
            prop_assert_eq!(&Recording { sample_time_s: r.sample_time_s, ..back }, &r);
        }

        /// No bytes make the reader panic.
        #[test]
        fn any_bytes_are_read_or_refused(at in 0usize..300, junk in prop::collection::vec(any::<u8>(), 0..12), cut in 0usize..300) {
            let mut bytes = GOOD.as_bytes().to_vec();
            let at = at.min(bytes.len());
            bytes.splice(at..at, junk.iter().copied());
            bytes.truncate(cut.max(1));
            let _ = Recording::from_csv(&bytes[..], "x");
            let _ = Recording::from_csv(&junk[..], "x");
        }
    }

    #[test]
    fn a_file_is_written_and_read_back_and_named_after() {
        let dir = std::env::temp_dir().join(format!("im-model-csv-{}", std::process::id()));
        std::fs::create_dir_all(&dir).unwrap();
        let path = dir.join("run.csv");
        let r = Recording { name: "run".into(), ..read(GOOD).unwrap() };
        r.write_csv(&path).unwrap();
        assert_eq!(Recording::read_csv(&path).unwrap(), r);
        std::fs::remove_dir_all(&dir).unwrap();
    }
}
