//! The configuration: which channels there are, how they are scaled, when they were sampled.

use super::invalid;
use crate::FormatError;
use crate::numbers::Number;

/// How the samples are written.
pub(super) enum Samples {
    Ascii,
    /// Numbers, and the one that says that there is none.
    Binary(Number, f64),
}

pub(super) struct Channel {
    pub name: String,
    pub unit: String,
    pub gain: f64,
    pub offset: f64,
    /// Of its sample behind that of the row, s.
    pub skew_s: f64,
}

pub(super) struct Config {
    pub station: String,
    pub analog: Vec<Channel>,
    /// How many channels of 0 and 1 there are.
    pub status: usize,
    /// Rates, Hz, each with the last row that has it.
    rates: Vec<(f64, usize)>,
    pub samples: Samples,
    /// Of the number in a time stamp, s.
    pub stamp_s: f64,
    /// Before 2013 a missing sample is 99999.
    pub marks_missing: bool,
}

/// The counts in the second line: all, those with an A, those with a D.
fn counts(line: &str) -> Option<(usize, usize)> {
    let fields: Vec<String> = line.split(',').map(|f| f.trim().to_uppercase()).collect();
    let [all, analog, status] = fields.as_slice() else { return None };
    let of = |field: &str, letter: char| field.strip_suffix(letter)?.parse::<usize>().ok();
    let (analog, status) = (of(analog, 'A')?, of(status, 'D')?);
    (analog.checked_add(status) == all.parse().ok()).then_some((analog, status))
}

/// Whether a text begins as one does.
pub(super) fn looks_like(first: &[u8]) -> bool {
    String::from_utf8_lossy(first).lines().nth(1).is_some_and(|line| counts(line).is_some())
}

struct Lines<'a> {
    lines: std::str::Lines<'a>,
    number: usize,
}

impl<'a> Lines<'a> {
    fn next(&mut self, what: &str) -> Result<Vec<&'a str>, FormatError> {
        self.number += 1;
        let line = self.lines.next().ok_or_else(|| invalid(format!("its .cfg ends before line {}, {what}", self.number)))?;
        Ok(line.split(',').map(str::trim).collect())
    }

    fn wrong(&self, what: &str) -> FormatError {
        invalid(format!("line {} of its .cfg is not {what}", self.number))
    }
}

impl Config {
    pub fn parse(text: &str) -> Result<Self, FormatError> {
        let mut lines = Lines { lines: text.trim_start_matches('\u{feff}').lines(), number: 0 };
        let head = lines.next("the station")?;
        let year: u32 = head.get(2).and_then(|y| y.parse().ok()).unwrap_or(1991);
        let what = "the counts of channels, like 8,6A,2D";
        let (count, status) = counts(&lines.next(what)?.join(",")).ok_or_else(|| lines.wrong(what))?;
        let mut analog = Vec::new();
        for _ in 0..count {
            let what = "an analog channel (number, name, phase, circuit, unit, a, b, skew, …)";
            let fields = lines.next(what)?;
            analog.push(Channel::parse(&fields).ok_or_else(|| lines.wrong(what))?);
        }
        for _ in 0..status {
            lines.next("a status channel")?;
        }
        lines.next("the line frequency")?;
        let what = "the number of sampling rates";
        let number = lines.next(what)?;
        let number: usize = number[0].parse().map_err(|_| lines.wrong(what))?;
        let mut rates = Vec::new();
        // Without a rate there is one line all the same, with the rate 0.
        for _ in 0..number.max(1) {
            let what = "a sampling rate and its last row";
            let fields = lines.next(what)?;
            let rate = fields[0].parse::<f64>().ok().filter(|r| *r >= 0.0 && r.is_finite());
            let last = fields.get(1).and_then(|f| f.parse::<usize>().ok());
            let (Some(rate), Some(last)) = (rate, last) else { return Err(lines.wrong(what)) };
            if rate > 0.0 {
                rates.push((rate, last));
            }
        }
        // Written to the nanosecond, the times count nanoseconds.
        let mut tick_s = 1e-6;
        for what in ["the time of the first row", "the time of the trigger"] {
            let fraction = lines.next(what)?.get(1).and_then(|t| t.split_once('.')).map_or(0, |(_, fraction)| fraction.len());
            tick_s = if fraction > 6 { 1e-9 } else { tick_s };
        }
        let kind = lines.next("the type of its data")?;
        let samples = match kind[0].to_uppercase().as_str() {
            "ASCII" => Samples::Ascii,
            "BINARY" => Samples::Binary(Number::I16, f64::from(i16::MIN)),
            "BINARY32" => Samples::Binary(Number::I32, f64::from(i32::MIN)),
            // Missing is what is no number.
            "FLOAT32" => Samples::Binary(Number::F32, f64::NAN),
            _ => return Err(lines.wrong("ASCII, BINARY, BINARY32 or FLOAT32")),
        };
        let multiple = lines.next("the unit of time").ok().and_then(|f| f[0].parse::<f64>().ok()).filter(|m| *m > 0.0);
        let station = head[0].to_owned();
        Ok(Self {
            station,
            analog,
            status,
            rates,
            samples,
            stamp_s: tick_s * multiple.unwrap_or(1.0),
            marks_missing: year < 2013,
        })
    }

    /// How many fields a row of text has.
    pub fn fields(&self) -> usize {
        2 + self.analog.len() + self.status
    }

    /// The times of `rows` rows by their rates, or of as many as have one; `None` where there are no rates.
    pub fn times(&self, rows: usize) -> Option<Vec<f64>> {
        let mut times = Vec::new();
        let mut start = 0.0;
        for &(rate, last) in &self.rates {
            let from = times.len();
            times.extend((from..last.min(rows)).map(|k| start + (k - from) as f64 / rate));
            start += (times.len() - from) as f64 / rate;
        }
        (!self.rates.is_empty()).then_some(times)
    }
}

impl Channel {
    fn parse(fields: &[&str]) -> Option<Self> {
        let number = |k: usize, empty: f64| match fields.get(k).copied().unwrap_or("") {
            "" => Some(empty),
            text => text.parse::<f64>().ok().filter(|x| x.is_finite()),
        };
        let name = *fields.get(1)?;
        let unit = *fields.get(4)?;
        // From the secondary side, where the sensor is, to the primary.
        let secondary = fields.get(12).is_some_and(|side| side.eq_ignore_ascii_case("s"));
        let (over, under) = (number(10, 1.0)?, number(11, 1.0)?);
        let ratio = if secondary && over > 0.0 && under > 0.0 { over / under } else { 1.0 };
        Some(Self {
            name: name.to_owned(),
            unit: unit.to_owned(),
            gain: ratio * number(5, 1.0)?,
            offset: ratio * number(6, 0.0)?,
            skew_s: 1e-6 * number(7, 0.0)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CFG: &str = "here,recorder,1999\n2,1A,1D\n1,IA,A,,A,0.5,1,0,-99999,99998,100,5,S\n1,TRIP,,,0\n50\n2\n1000,3\n500,5\n\
                       01/02/2020,00:00:00.0\n01/02/2020,00:00:00.0\nASCII\n2\n";

    #[test]
    fn secondary_values_are_brought_to_the_primary_and_rates_follow_each_other() {
        let config = Config::parse(CFG).unwrap();
        assert_eq!((config.analog[0].gain, config.analog[0].offset), (10.0, 20.0));
        assert_eq!(config.times(5).unwrap(), [0.0, 0.001, 0.002, 0.003, 0.005]);
        assert_eq!((config.stamp_s, config.status, config.marks_missing), (2e-6, 1, true));
        assert!(looks_like(CFG.as_bytes()) && !looks_like(b"[section]\nkey=1,2,3\n"));
    }

    #[test]
    fn what_is_wrong_is_said_with_its_line() {
        let wrong = |from: &str, to: &str| Config::parse(&CFG.replace(from, to)).err().unwrap().to_string();
        assert!(wrong("2,1A,1D", "3,1A,1D").contains("line 2 of its .cfg"));
        assert!(wrong(",0.5,1,", ",half,1,").contains("line 3 of its .cfg"));
        assert!(wrong("ASCII", "TEXT").contains("line 11 of its .cfg is not ASCII, BINARY"));
        let short = Config::parse(&CFG[..60]).err().unwrap().to_string();
        assert!(short.contains("ends before line"), "{short}");
    }
}
