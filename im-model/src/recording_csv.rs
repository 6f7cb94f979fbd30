//! Recordings as text: one line of column names, one row per sample.
//!
//! Rows are read one by one into the recording itself, so that memory stays at about the size of the data.

use std::io::{self, Read, Write};
use std::path::Path;

use num_complex::Complex;

use crate::atomic_file::write_atomically;
use crate::file_error::{FileError, Problem};
use crate::recording::Recording;
use crate::rows::{Rows, TextFormat, sampling_time};
use crate::space_vector::from_phases;

const T: &str = "t_s";
const OMEGA: &str = "omega_m_rad_s";
const TAU: &str = "tau_load_Nm";
const U: Names = Names { vector: ["u_alpha_V", "u_beta_V"], phases: ["u_a_V", "u_b_V", "u_c_V"], third_needed: true };
const I: Names = Names { vector: ["i_alpha_A", "i_beta_A"], phases: ["i_a_A", "i_b_A", "i_c_A"], third_needed: false };

/// How a space vector stands in a file.
struct Names {
    vector: [&'static str; 2],
    phases: [&'static str; 3],
    third_needed: bool,
}

/// Where a space vector is found in a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VectorColumns {
    /// α and β.
    Vector([usize; 2]),
    /// Phases a, b, c.
    Phases([usize; 3]),
    /// Phases a and b; the three sum to zero.
    TwoPhases([usize; 2]),
}

/// The canonical columns in a file: places from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CanonicalColumns {
    /// `t_s`.
    pub time: usize,
    /// The voltage.
    pub u: VectorColumns,
    /// The current.
    pub i: VectorColumns,
    /// `omega_m_rad_s`.
    pub omega_m: usize,
    /// `tau_load_Nm`, where there is one.
    pub tau_load: Option<usize>,
}

impl VectorColumns {
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
    /// commas, semicolons or tabs and may be quoted; numbers have a decimal point.
    ///
    /// # Errors
    /// The file cannot be read, is empty, lacks a column or has one twice, or a row is cut, holds something that is not a finite
    /// number, or does not follow its predecessor by the sampling time; the error carries the line and the column.
    pub fn read_csv(path: impl AsRef<Path>) -> Result<Self, FileError> {
        let path = path.as_ref();
        let label = path.display().to_string();
        let mut recording = all(Rows::open(path, &label, TextFormat::default())?, &label)?;
        if let Some(stem) = path.file_stem() {
            recording.name = stem.to_string_lossy().into_owned();
        }
        Ok(recording)
    }

    /// Reads from anywhere; `label` names the source in messages and the recording.
    ///
    /// # Errors
    /// As [`read_csv`](Self::read_csv).
    pub fn from_csv(source: impl Read, label: &str) -> Result<Self, FileError> {
        all(Rows::new(source, label, 0, TextFormat::default())?, label)
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
        self.to_csv_with(&[], out)
    }

    /// As [`to_csv`](Self::to_csv), with columns more at the end, each of a number for every row. Whoever reads the recording passes over them.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn to_csv_with(&self, more: &[(&str, Vec<f64>)], out: &mut impl Write) -> io::Result<()> {
        let [u_alpha, u_beta] = U.vector;
        let [i_alpha, i_beta] = I.vector;
        write!(out, "{T},{u_alpha},{u_beta},{i_alpha},{i_beta},{OMEGA}")?;
        if self.tau_load.is_some() {
            write!(out, ",{TAU}")?;
        }
        more.iter().try_for_each(|(name, _)| write!(out, ",{name}"))?;
        writeln!(out)?;
        let rows = self.u_s.iter().zip(&self.i_s).zip(&self.omega_m).enumerate();
        for (k, ((u, i), omega_m)) in rows {
            write_time(out, self.time_s(k))?;
            // Numbers need no quotes: a line is written as it is. `{:?}` is the shortest text that reads back as the same bits.
            write!(out, ",{:?},{:?},{:?},{:?},{omega_m:?}", u.re, u.im, i.re, i.im)?;
            if let Some(tau) = self.tau_load.as_ref().and_then(|tau| tau.get(k)) {
                write!(out, ",{tau:?}")?;
            }
            more.iter().filter_map(|(_, x)| x.get(k)).try_for_each(|x| write!(out, ",{x:?}"))?;
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

impl CanonicalColumns {
    /// Whether a line of names is meant to be canonical: it has three of the names at least.
    pub fn meant(names: &[String]) -> bool {
        names.iter().filter(|n| known(n)).count() >= 3
    }

    /// Finds the columns, and requires them to hold numbers.
    ///
    /// # Errors
    /// A column is missing or stands twice, or a space vector stands in two forms.
    pub fn find<R: Read>(rows: &mut Rows<'_, R>) -> Result<Self, FileError> {
        if !rows.has_names() {
            return Err(rows.error(None, Problem::NoRows { found: "the first line holds numbers" }));
        }
        let this = Self {
            time: need(rows, T)?,
            u: need_vector(rows, &U)?,
            i: need_vector(rows, &I)?,
            omega_m: need(rows, OMEGA)?,
            tau_load: rows.find(TAU)?,
        };
        // A slip of the pen in an optional column would otherwise pass in silence.
        if this.tau_load.is_none() && rows.like(TAU, |n| !known(n)).is_some() {
            return Err(missing(rows, TAU));
        }
        this.all().for_each(|k| rows.require(k));
        rows.time_in(this.time);
        Ok(this)
    }

    /// Every column.
    pub fn all(&self) -> impl Iterator<Item = usize> + '_ {
        let of = |s: &VectorColumns| match *s {
            VectorColumns::Vector([a, b]) | VectorColumns::TwoPhases([a, b]) => [Some(a), Some(b), None],
            VectorColumns::Phases(c) => c.map(Some),
        };
        [Some(self.time), Some(self.omega_m), self.tau_load].into_iter().chain(of(&self.u)).chain(of(&self.i)).flatten()
    }
}

fn all<R: Read>(mut rows: Rows<'_, R>, label: &str) -> Result<Recording, FileError> {
    let columns = CanonicalColumns::find(&mut rows)?;
    let mut r = Recording {
        name: label.to_owned(),
        start_s: 0.0,
        sample_time_s: 0.0,
        u_s: Vec::new(),
        i_s: Vec::new(),
        omega_m: Vec::new(),
        tau_load: columns.tau_load.map(|_| Vec::new()),
    };
    let mut time = Vec::new();
    let mut row = vec![0.0; rows.names().len()];
    while rows.next(&mut row)? {
        let now_s = row[columns.time];
        if let Some(&before_s) = time.last().filter(|t| **t >= now_s) {
            return Err(rows.error(Some(T), Problem::TimeNotForward { before_s, now_s }));
        }
        time.push(now_s);
        r.u_s.push(columns.u.read(&row));
        r.i_s.push(columns.i.read(&row));
        r.omega_m.push(row[columns.omega_m]);
        if let (Some(tau), Some(column)) = (&mut r.tau_load, columns.tau_load) {
            tau.push(row[column]);
        }
        if time.len() == 1000 {
            // From here the length of the file foretells the number of rows: no vector grows by doubling.
            let more = rows.rows_ahead();
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
        return Err(rows.error(None, Problem::NoRows { found }));
    }
    r.start_s = time[0];
    r.sample_time_s =
        sampling_time(&time).map_err(|(k, problem)| FileError::new(label, Some(rows.line_of(k)), Some(T), problem))?;
    r.u_s.shrink_to_fit();
    r.i_s.shrink_to_fit();
    r.omega_m.shrink_to_fit();
    if let Some(tau) = &mut r.tau_load {
        tau.shrink_to_fit();
    }
    Ok(r)
}

fn need<R: Read>(rows: &Rows<'_, R>, name: &str) -> Result<usize, FileError> {
    rows.find(name)?.ok_or_else(|| missing(rows, name))
}

fn missing<R: Read>(rows: &Rows<'_, R>, name: &str) -> FileError {
    rows.missing(name, |n| !known(n))
}

fn known(name: &str) -> bool {
    let vectors = U.vector.iter().chain(&I.vector).chain(&U.phases).chain(&I.phases);
    [T, OMEGA, TAU].iter().chain(vectors).any(|k| *k == name)
}

fn need_vector<R: Read>(rows: &Rows<'_, R>, names: &Names) -> Result<VectorColumns, FileError> {
    let phases = [rows.find(names.phases[0])?, rows.find(names.phases[1])?, rows.find(names.phases[2])?];
    let vector = [rows.find(names.vector[0])?, rows.find(names.vector[1])?];
    match (vector, phases) {
        ([Some(_), _] | [_, Some(_)], [Some(_), ..] | [_, Some(_), _] | [.., Some(_)]) => {
            let found = format!("given beside {}", names.phases.join(", "));
            let expected = "one form or the other; drop one of them".to_owned();
            Err(rows.error(Some(&names.vector.join(", ")), Problem::Unexpected { found, expected }))
        }
        ([Some(a), Some(b)], _) => Ok(VectorColumns::Vector([a, b])),
        (_, [Some(a), Some(b), Some(c)]) => Ok(VectorColumns::Phases([a, b, c])),
        (_, [Some(a), Some(b), None]) if !names.third_needed => Ok(VectorColumns::TwoPhases([a, b])),
        ([None, None], [None, None, None]) => Err(missing(rows, names.vector[0])),
        ([None, None], _) => {
            let absent = names.phases.into_iter().zip(phases).find(|(_, p)| p.is_none()).map_or(names.phases[2], |(n, _)| n);
            Err(missing(rows, absent))
        }
        ([a, _], _) => Err(missing(rows, names.vector[usize::from(a.is_some())])),
    }
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

    /// 0.0003 is written so, not as the product 3 · 0.0001 with its noise; a time that is meant is written as it is.
    #[test]
    fn times_are_written_without_the_noise_of_their_product() {
        let written = |t: f64| {
            let mut out = Vec::new();
            write_time(&mut out, t).unwrap();
            String::from_utf8(out).unwrap()
        };
        assert_eq!([written(3.0 * 1e-4), written(0.1 + 0.2), written(-7.0 * 0.1), written(0.0)], ["0.0003", "0.3", "-0.7", "0"]);
        let odd = 1.0 / 3.0;
        assert_eq!(written(odd).parse(), Ok(odd));
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
            "run.csv:3: i_alpha_A is \"x9\" at t_s = 0.0001, expected a finite number with a decimal point; repair the row or cut the recording there"
        );
        assert!(bad("0.0001,7,8,9", "0.0001,7,8,").starts_with("run.csv:3: i_alpha_A is empty at t_s = 0.0001, "));
        assert!(bad("0.0001,7,8,9", "0.0001,7,8,nan").starts_with("run.csv:3: i_alpha_A is NaN at t_s = 0.0001, "));
        assert!(bad("0.0001,7,8,9", "0.0001,7,8,-inf").starts_with("run.csv:3: i_alpha_A is -inf at t_s = 0.0001, "));
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
             recording there, resample it evenly, or leave short gaps out: gaps = \"leave_out\" in [time] of its recording.toml"
        );
        assert!(bad("0.0003", "0.00034").contains("s elsewhere: the clock wavers"), "{}", bad("0.0003", "0.00034"));
        assert_eq!(error(""), "run.csv: the file is empty, expected a line of column names and rows of numbers below");
        assert!(error(&GOOD[..GOOD.find('\n').unwrap()]).contains("no rows under the header"));
        assert!(error("0,1,2,3,4,5,6\n1,1,2,3,4,5,6\n").starts_with("run.csv:1: the first line holds numbers"));
        assert!(error(&GOOD.lines().take(2).collect::<Vec<_>>().join("\n")).contains("only one row"));
        assert!(bad("u_alpha_V", "u_a_V").contains("one form or the other"), "{}", bad("u_alpha_V", "u_a_V"));
        let binary = Recording::from_csv(&[0xff, 0xfd, b't', 0, b'\n'][..], "run.csv").unwrap_err();
        assert!(binary.to_string().contains("no text in UTF-8"), "{binary}");
        let wide: Vec<u8> = [0xfeff].into_iter().chain(GOOD.encode_utf16()).flat_map(u16::to_le_bytes).collect();
        assert_eq!(Recording::from_csv(&wide[..], "run.csv").unwrap(), Recording::from_csv(GOOD.as_bytes(), "run.csv").unwrap());
        let endless = Recording::from_csv(io::BufReader::new(io::repeat(b'7')), "run.csv").unwrap_err();
        assert!(endless.to_string().contains("or Latin-1"), "{endless}");
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
