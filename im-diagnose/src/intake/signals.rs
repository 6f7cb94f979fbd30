//! A mapping applied to a file: columns become quantities in SI units.

use im_model::{
    Complex, FileError, Problem, sampling_time,
    space_vector::{from_line_to_line, from_phases},
};

use super::encoder;
use super::load_plan::LoadPlan;
use super::mapping::{Calibration, CurrentForm, Instant, Line, Load, Mapping, Offset, Signal, Speed, VoltageForm};
use super::raw::{RawTable, place};
use super::repair;
use super::sampled::{Switch, means, switches};
use super::trace::Trace;
use super::unit::{Quantity, by_name};
use crate::statistics::median;

/// A current and what else shows it.
#[derive(Clone, Debug, PartialEq)]
pub struct CurrentTrace {
    /// The sensor.
    pub main: Trace,
    /// A second sensor.
    pub alternate: Option<Trace>,
}

/// What was measured of the speed.
#[derive(Clone, Debug, PartialEq)]
pub enum SpeedTrace {
    /// Nothing.
    Absent,
    /// The rotor stands.
    Locked,
    /// Mechanical speed, rad/s.
    Measured(Trace),
}

/// What a recording holds, in SI units, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Signals {
    /// Name of the recording.
    pub name: String,
    /// Time of the first row, s.
    pub start_s: f64,
    /// Sampling time, s.
    pub sample_time_s: f64,
    /// Largest deviation of a step of time from the sampling time, over the sampling time.
    pub jitter: f64,
    /// Rows that were missing and are filled in.
    pub filled: Vec<bool>,
    /// Columns of the voltage, as they stand.
    pub voltage: Vec<Trace>,
    /// What the columns of the voltage are.
    pub voltage_form: VoltageForm,
    /// Which instant the voltage belongs to.
    pub instant: Instant,
    /// Columns of the current.
    pub current: Vec<CurrentTrace>,
    /// What the columns of the current are.
    pub current_form: CurrentForm,
    /// Speed.
    pub speed: SpeedTrace,
    /// Load torque, Nm, where it is known.
    pub tau_load: Option<Trace>,
    /// What is known of the load beside that.
    pub load: LoadPlan,
    /// First row's line in the file.
    pub first_line: Option<usize>,
}

impl Signals {
    /// Applies `mapping`; `pole_pairs` is the machine's.
    ///
    /// # Errors
    /// A column that is not there, time that does not advance evenly, a unit that does not fit or is needed and not given, a window
    /// without rows.
    pub fn new(table: &mut RawTable, mapping: &Mapping, pole_pairs: u32) -> Result<Self, FileError> {
        let n = table.len();
        let mut time = time_of(table, mapping)?;
        let name = mapping.time.signal.as_ref().map_or(Ok("time"), |s| Ok(&table.names[place(&table.names, s, mapping)?]))?;
        let at = |k: usize, problem| FileError::new(&table.label, table.line_of(k), Some(name), problem);
        let from = time.partition_point(|t| *t < mapping.time.from_s);
        let to = time.partition_point(|t| *t < mapping.time.to_s);
        if to - from < 2 {
            let found = format!("a window from {} s to {} s", mapping.time.from_s, mapping.time.to_s);
            let expected = format!("rows in it: the recording goes from {} s to {} s", time[0], time[n - 1]);
            return Err(mapping.error(None, "time", Problem::Unexpected { found, expected }));
        }
        let grid = Grid::new(&time[from..to], mapping.time.fill_gaps).map_err(|(k, problem)| at(from + k, problem))?;
        let sample_time_s = mapping.time.sample_time_s.unwrap_or(grid.sample_time_s);
        let first_line = table.line_of(from);
        let mut read = Read { table, mapping, time: &mut time, from, to, grid: &grid };
        let mut voltage: Vec<Trace> = {
            let duty = matches!(mapping.voltage.form, VoltageForm::Duty(..));
            let signals = mapping.voltage.form.signals();
            let last = signals.len() - 1;
            let quantity = |k: usize| (!duty || k == last).then_some(Quantity::Voltage);
            signals.iter().enumerate().map(|(k, s)| read.trace(s, quantity(k))).collect::<Result<_, _>>()?
        };
        if let Some(times) = &mapping.voltage.times {
            let times = read.trace(times, None)?;
            for u in &mut voltage {
                u.values.iter_mut().zip(&times.values).for_each(|(u, x)| *u *= x);
            }
        }
        let currents = mapping.current.signals();
        let mut current = currents
            .iter()
            .map(|s| {
                let alternate = s.alternate.as_deref().map(|a| read.trace(a, Some(Quantity::Current))).transpose()?;
                Ok(CurrentTrace { main: read.trace(s, Some(Quantity::Current))?, alternate })
            })
            .collect::<Result<Vec<_>, FileError>>()?;
        if let Some(angle) = &mapping.angle {
            let angle = read.trace(angle, Some(Quantity::Angle))?;
            if let (VoltageForm::Dq(_), [d, q, ..]) = (&mapping.voltage.form, &mut voltage[..]) {
                turn(d, q, &angle);
            }
            if let (CurrentForm::Dq(_), [d, q]) = (&mapping.current, &mut current[..]) {
                turn(&mut d.main, &mut q.main, &angle);
            }
        }
        let speed = match &mapping.speed {
            Speed::Absent => SpeedTrace::Absent,
            Speed::Locked => SpeedTrace::Locked,
            Speed::Counts { signal, per_turn, wraps_at } => {
                let counts = read.trace(signal, None)?;
                SpeedTrace::Measured(encoder::speed(counts, *per_turn, *wraps_at, sample_time_s))
            }
            Speed::Measured { signal, electrical } => {
                let mut trace = read.trace(signal, Some(Quantity::Speed))?;
                if *electrical {
                    trace.values.iter_mut().for_each(|w| *w /= f64::from(pole_pairs));
                }
                SpeedTrace::Measured(trace)
            }
        };
        let tau_load = match &mapping.load {
            Load::Unstated | Load::Unknown => None,
            Load::Absent | Load::Law { .. } => {
                Some(Trace { column: "load".into(), values: vec![0.0; grid.rows], gain: 1.0, offset: 0.0 })
            }
            Load::Constant(x) => Some(Trace { column: "torque_nm".into(), values: vec![*x; grid.rows], gain: 1.0, offset: 0.0 }),
            Load::Measured { signal, times } => {
                let mut trace = read.trace(signal, times.is_none().then_some(Quantity::Torque))?;
                if let Some(other) = times {
                    let other = read.trace(other, None)?;
                    trace.values.iter_mut().zip(&other.values).for_each(|(x, y)| *x *= y);
                    trace.column = format!("{}·{}", trace.column, other.column);
                }
                Some(trace)
            }
        };
        Ok(Self {
            name: stem(&table.label),
            start_s: time[from],
            sample_time_s,
            jitter: grid.jitter,
            filled: grid.filled,
            voltage,
            voltage_form: mapping.voltage.form.clone(),
            instant: mapping.voltage.instant,
            current,
            current_form: mapping.current.clone(),
            speed,
            tau_load,
            load: LoadPlan::of(mapping),
            first_line,
        })
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.voltage[0].values.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The voltage of row `k` as the columns give it, V.
    pub fn u(&self, k: usize) -> Complex<f64> {
        let v = |c: usize| self.voltage[c].values[k];
        match &self.voltage_form {
            VoltageForm::Phases(_) => from_phases([v(0), v(1), v(2)]),
            VoltageForm::TwoPhases(_) => from_phases([v(0), v(1), -v(0) - v(1)]),
            // What stood in d and q was turned on the way in.
            VoltageForm::AlphaBeta(_) | VoltageForm::Dq(_) => Complex::new(v(0), v(1)),
            // What the three have in common is an error of the sensors: their sum is zero.
            VoltageForm::ThreeLines(_) => from_phases([(v(0) - v(2)) / 3.0, (v(1) - v(0)) / 3.0, (v(2) - v(1)) / 3.0]),
            VoltageForm::Lines(lines, _) => {
                let (ab, bc) = match lines {
                    [Line::Ab, Line::Bc] => (v(0), v(1)),
                    [Line::Ab, _] => (v(0), -v(0) - v(1)),
                    _ => (-v(0) - v(1), v(0)),
                };
                from_line_to_line(ab, bc)
            }
            VoltageForm::Duty(..) => from_phases([v(0), v(1), v(2)]) * v(3),
        }
    }

    /// The voltages of all rows as the columns give them, V.
    pub fn voltages(&self) -> Vec<Complex<f64>> {
        (0..self.len()).map(|k| self.u(k)).collect()
    }

    /// Where a sampled voltage was switched; nothing of one that is held.
    pub fn switches(&self) -> Vec<Switch> {
        if self.instant == Instant::Sample { switches(&self.voltages()) } else { Vec::new() }
    }

    /// The average voltage over the sample that begins at each row, V; one row less than there are where it takes the next row to
    /// know it.
    pub fn held_voltage(&self) -> Vec<Complex<f64>> {
        let mut u = self.voltages();
        match self.instant {
            Instant::HeldFromRow => u,
            Instant::HeldUntilRow => u.split_off(1),
            Instant::Sample => means(&u, &switches(&u)),
        }
    }

    /// Time of row `k`, s.
    pub fn time_s(&self, k: usize) -> f64 {
        self.start_s + k as f64 * self.sample_time_s
    }

    /// A time for `to_s` that ends the recording before row `k`, s: of those after the row before it, that with the fewest digits.
    pub fn end_before(&self, k: usize) -> String {
        let t = self.time_s(k);
        let cut = |decimals: usize| {
            let unit = 10f64.powi(decimals as i32);
            // What a sum of sampling times is off by is no digit.
            ((t * unit + 1e-6).floor() / unit, decimals)
        };
        let after = |(x, _): &(f64, usize)| *x > t - 0.99 * self.sample_time_s;
        let (x, decimals) = (0..12).map(cut).find(after).unwrap_or((t, 12));
        format!("{x:.decimals$}")
    }

    /// What to use where everything from row `k` on is wrong, for advice.
    pub fn part_before(&self, k: usize) -> String {
        format!("use what comes before, to_s = {} under [time]", self.end_before(k))
    }

    /// The same where everything before row `k` is.
    pub fn part_after(&self, k: usize) -> String {
        format!("use what comes after, from_s = {} under [time]", self.end_before(k))
    }
}

/// From a turning frame into the stationary one.
fn turn(d: &mut Trace, q: &mut Trace, angle: &Trace) {
    for ((d, q), phi) in d.values.iter_mut().zip(&mut q.values).zip(&angle.values) {
        let x = Complex::new(*d, *q) * Complex::from_polar(1.0, *phi);
        (*d, *q) = (x.re, x.im);
    }
}

fn stem(label: &str) -> String {
    std::path::Path::new(label).file_stem().map_or_else(|| label.to_owned(), |s| s.to_string_lossy().into_owned())
}

/// Reads columns on the even grid.
struct Read<'a> {
    table: &'a mut RawTable,
    mapping: &'a Mapping,
    time: &'a mut Vec<f64>,
    from: usize,
    to: usize,
    grid: &'a Grid,
}

impl Read<'_> {
    fn trace(&mut self, signal: &Signal, quantity: Option<Quantity>) -> Result<Trace, FileError> {
        let unit = unit_of(signal, self.table, self.mapping, quantity)?;
        let k = place(&self.table.names, signal, self.mapping)?;
        let x = &self.table.columns[k];
        let mean = |from: f64, to: f64, what: &str| {
            let rows = self.time.partition_point(|t| *t < from)..self.time.partition_point(|t| *t < to);
            let used = &x[rows];
            if used.is_empty() {
                let found = format!("{what}, where there are no rows");
                let (first, last) = (self.time[0], self.time[x.len() - 1]);
                let problem = Problem::Unexpected { found, expected: format!("a time between {first} s and {last} s") };
                return Err(self.mapping.error(signal.line, what, problem));
            }
            Ok(used.iter().sum::<f64>() / used.len() as f64)
        };
        let offset = match signal.offset {
            Offset::Value(x) => x,
            Offset::Mean => x[self.from..self.to].iter().sum::<f64>() / (self.to - self.from) as f64,
            Offset::MeanBefore(t) => mean(f64::NEG_INFINITY, t, "mean_before_s")?,
        };
        let gain = match signal.calibrate {
            None => signal.gain,
            Some(Calibration { from_s, to_s, value }) => {
                let shown = mean(from_s, to_s, "calibrate")? - offset;
                if shown.abs() < 1e-9 * value.abs() || shown == 0.0 {
                    let found = format!("about a stretch where the column shows {shown}");
                    let problem = Problem::Unexpected { found, expected: "a stretch where it is not zero".to_owned() };
                    return Err(self.mapping.error(signal.line, "calibrate", problem));
                }
                value / shown
            }
        } * unit;
        // Columns that need no change keep every bit.
        let mut values = if signal.reciprocal {
            // A counter that shows nothing stands for a standstill.
            self.grid.spread(&x[self.from..self.to], |x| if x == offset { 0.0 } else { gain / (x - offset) })
        } else if gain == 1.0 && offset == 0.0 {
            self.grid.spread(&x[self.from..self.to], |x| x)
        } else {
            self.grid.spread(&x[self.from..self.to], |x| gain * (x - offset))
        };
        if signal.spikes {
            repair::remove_spikes(&mut values);
        }
        if signal.delay_s != 0.0 {
            values = repair::earlier(&values, signal.delay_s / self.grid.sample_time_s);
        }
        Ok(Trace { column: self.table.names[k].clone(), values, gain, offset })
    }
}

/// The time of every row, s: of the mapping's column, or by its sampling time.
pub(super) fn time_of(table: &RawTable, mapping: &Mapping) -> Result<Vec<f64>, FileError> {
    match (&mapping.time.signal, mapping.time.sample_time_s) {
        (Some(s), _) => seconds(table, s, mapping),
        (None, dt) => Ok((0..table.len()).map(|k| k as f64 * dt.unwrap_or(1.0)).collect()),
    }
}

/// A column of time, s, which goes forward.
pub(super) fn seconds(table: &RawTable, time: &Signal, mapping: &Mapping) -> Result<Vec<f64>, FileError> {
    let column = place(&table.names, time, mapping)?;
    let unit = if table.clocks[column] { 1.0 } else { unit_of(time, table, mapping, Some(Quantity::Time))? };
    let t: Vec<f64> = table.columns[column].iter().map(|t| t * unit).collect();
    match (1..t.len()).find(|&k| !matches!(t[k - 1].partial_cmp(&t[k]), Some(std::cmp::Ordering::Less))) {
        None => Ok(t),
        Some(k) => {
            let problem = Problem::TimeNotForward { before_s: t[k - 1], now_s: t[k] };
            Err(FileError::new(&table.label, table.line_of(k), Some(&table.names[column]), problem))
        }
    }
}

/// The unit of a signal in SI: as the mapping says, else as the column's name says.
pub(super) fn unit_of(
    signal: &Signal,
    table: &RawTable,
    mapping: &Mapping,
    quantity: Option<Quantity>,
) -> Result<f64, FileError> {
    let Some(quantity) = quantity else { return Ok(signal.unit.unwrap_or(1.0)) };
    if let Some(unit) = signal.unit {
        return Ok(unit);
    }
    let name = &table.names[place(&table.names, signal, mapping)?];
    let fail = |[found, expected]: [String; 2]| mapping.error(signal.line, "unit", Problem::Unexpected { found, expected });
    match by_name(name, &table.names, quantity).map_err(fail)? {
        Some(si) => Ok(si),
        // Speeds come in rpm as often as in rad/s: an error of a factor of ten is not to be risked.
        None if quantity == Quantity::Speed => {
            Err(fail([format!("missing for column {name}"), "\"rpm\", \"rad/s\" or \"Hz\"".to_owned()]))
        }
        None => Ok(1.0),
    }
}

/// The even grid of time that a recording is put on.
struct Grid {
    sample_time_s: f64,
    rows: usize,
    jitter: f64,
    filled: Vec<bool>,
    /// Row of the grid of every row of the file; empty when they are the same.
    at: Vec<usize>,
}

/// No more rows are filled in a row: the voltage in a longer gap is not known well enough.
const LONGEST_GAP: usize = 10;

impl Grid {
    fn new(time: &[f64], fill: bool) -> Result<Self, (usize, Problem)> {
        let n = time.len();
        match sampling_time(time) {
            Ok(dt) => {
                let jitter = time.windows(2).map(|w| ((w[1] - w[0]) / dt - 1.0).abs()).fold(0.0, f64::max);
                Ok(Self { sample_time_s: dt, rows: n, jitter, filled: Vec::new(), at: Vec::new() })
            }
            Err((k, problem)) if fill => {
                let mut steps: Vec<f64> = time.windows(2).map(|w| w[1] - w[0]).collect();
                let dt = median(&mut steps);
                let mut at = vec![0];
                let mut jitter: f64 = 0.0;
                for w in time.windows(2) {
                    let step = (w[1] - w[0]) / dt;
                    let whole = step.round();
                    jitter = jitter.max((step - whole).abs());
                    if whole < 1.0 || (step - whole).abs() > 0.25 || whole as usize > LONGEST_GAP {
                        return Err((at.len(), Problem::TimeUneven { step_s: w[1] - w[0], usual_s: dt }));
                    }
                    at.push(at[at.len() - 1] + whole as usize);
                }
                let rows = at[n - 1] + 1;
                let mut filled = vec![true; rows];
                at.iter().for_each(|&k| filled[k] = false);
                // A quarter of the rows missing is no gap, it is another sampling.
                if filled.iter().filter(|f| **f).count() * 4 > rows {
                    return Err((k, problem));
                }
                let dt = (time[n - 1] - time[0]) / (rows - 1) as f64;
                Ok(Self { sample_time_s: dt, rows, jitter, filled, at })
            }
            Err(e) => Err(e),
        }
    }

    /// Values on the grid; straight lines over missing rows.
    fn spread(&self, x: &[f64], f: impl Fn(f64) -> f64) -> Vec<f64> {
        if self.at.is_empty() {
            return x.iter().map(|x| f(*x)).collect();
        }
        let mut out = vec![0.0; self.rows];
        for (k, w) in self.at.windows(2).enumerate() {
            for (j, place) in (w[0]..w[1]).enumerate() {
                let share = j as f64 / (w[1] - w[0]) as f64;
                out[place] = f(x[k] + share * (x[k + 1] - x[k]));
            }
        }
        out[self.rows - 1] = f(x[x.len() - 1]);
        out
    }
}
