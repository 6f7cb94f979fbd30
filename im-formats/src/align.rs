//! Channels of several rates on one time axis.
//!
//! The axis is that of the group with the most rows per second, over the time that every group covers. Other channels are drawn to it
//! by straight lines between their samples; a channel on the very same axis keeps its values.

use crate::{Format, FormatError, Table};

/// A channel.
#[derive(Clone, Debug)]
pub(crate) struct Column {
    pub name: String,
    pub unit: String,
    pub values: Vec<f64>,
}

impl Column {
    pub fn new(name: impl Into<String>, unit: impl Into<String>, values: Vec<f64>) -> Self {
        Self { name: name.into(), unit: unit.into(), values }
    }

    fn title(&self) -> String {
        let name = self.name.trim();
        match self.unit.trim() {
            "" => name.to_owned(),
            unit if name.contains(['(', '[']) && name.contains(unit) => name.to_owned(),
            unit => format!("{name} ({unit})"),
        }
    }
}

/// Channels sampled together, all of one length, which is that of the time.
#[derive(Clone, Debug, Default)]
pub(crate) struct Group {
    pub name: String,
    pub time: Option<Column>,
    pub columns: Vec<Column>,
}

impl Group {
    fn rows(&self) -> usize {
        self.columns.first().map_or(0, |c| c.values.len())
    }

    fn seconds(&self) -> f64 {
        let unit = self.time.as_ref().map_or("", |t| t.unit.trim());
        match unit {
            "ms" => 1e-3,
            "us" | "µs" | "μs" => 1e-6,
            "ns" => 1e-9,
            _ => 1.0,
        }
    }
}

/// Columns of one length are a group, with their time where there is one.
pub(crate) fn by_length(name: String, columns: Vec<Column>) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for column in columns {
        let n = column.values.len();
        match groups.iter_mut().find(|g| g.columns[0].values.len() == n) {
            Some(group) => group.columns.push(column),
            None => groups.push(Group { name: name.clone(), time: None, columns: vec![column] }),
        }
    }
    for group in &mut groups {
        let time = time_of(&group.columns);
        group.time = time.map(|k| group.columns.remove(k));
    }
    groups.retain(|g| !g.columns.is_empty());
    groups
}

/// The column that is the time of the others: named like one, and increasing.
fn time_of(columns: &[Column]) -> Option<usize> {
    const EXACT: [&str; 8] = ["t", "time", "tout", "zeit", "t_s", "time_s", "timestamp", "timestamps"];
    let last = |name: &str| name.rsplit('.').next().unwrap_or(name).trim().to_lowercase();
    let exact = |name: &str| EXACT.contains(&last(name).split(['(', '[']).next().unwrap_or("").trim());
    let alike = |name: &str| {
        let name = last(name);
        let words: Vec<&str> = name.split(|c: char| !c.is_alphabetic()).filter(|w| !w.is_empty()).collect();
        let is = |w: Option<&&str>| w.is_some_and(|w| ["t", "time", "zeit"].contains(w));
        is(words.first()) || is(words.last())
    };
    let increases = |c: &Column| c.values.windows(2).all(|w| w[0] < w[1]);
    let named = |test: &dyn Fn(&str) -> bool| columns.iter().position(|c| test(&c.name) && increases(c));
    named(&exact).or_else(|| named(&alike))
}

/// The table of all groups that can be brought together; what cannot is listed in it.
pub(crate) fn table(format: Format, groups: Vec<Group>, mut left_out: Vec<String>) -> Result<Table, FormatError> {
    let (mut groups, short): (Vec<Group>, Vec<Group>) = groups.into_iter().partition(|g| g.rows() >= 2);
    left_out.extend(names(&short, "fewer than two values"));
    let timed = groups.iter().any(|g| g.time.is_some());
    if timed {
        let (with, without): (Vec<_>, Vec<_>) = groups.into_iter().partition(|g| g.time.is_some());
        left_out.extend(names(&without, "no time of its own, and another length than what has one"));
        groups = with;
    } else if let Some(largest) = (0..groups.len()).max_by_key(|&k| (groups[k].columns.len(), groups[k].rows())) {
        let one = groups.swap_remove(largest);
        left_out.extend(names(&groups, "no time, and another length than most"));
        groups = vec![one];
    }
    if groups.is_empty() {
        return Err(FormatError::NoChannels { format, left_out });
    }
    if groups.len() > 1 {
        to_one_axis(format, &mut groups)?;
    }
    let time = groups.iter_mut().find_map(|g| g.time.take());
    let mut columns: Vec<(String, Column)> = time.into_iter().map(|c| (String::new(), c)).collect();
    for group in groups {
        columns.extend(group.columns.into_iter().map(|c| (group.name.clone(), c)));
    }
    let titles: Vec<String> = columns.iter().map(|(_, c)| c.title()).collect();
    let mut table = Table { left_out, ..Table::default() };
    for (k, (group, column)) in columns.into_iter().enumerate() {
        let twice = titles.iter().filter(|t| **t == titles[k]).count() > 1;
        let mut name = if twice && !group.is_empty() { format!("{group} {}", titles[k]) } else { titles[k].clone() };
        while table.names.contains(&name) || name.is_empty() {
            name += &format!("_{}", k + 1);
        }
        table.names.push(name);
        table.columns.push(column.values);
    }
    Ok(table)
}

fn names<'a>(groups: &'a [Group], why: &'a str) -> impl Iterator<Item = String> + 'a {
    groups.iter().flat_map(|g| &g.columns).map(move |c| format!("{} ({why})", c.name))
}

/// Leaves every group with the columns on the common axis; the time stays with the first.
fn to_one_axis(format: Format, groups: &mut [Group]) -> Result<(), FormatError> {
    let mut axes = Vec::new();
    for group in groups.iter_mut() {
        let scale = group.seconds();
        let time = group.time.take().map(|t| t.values).unwrap_or_default();
        axes.push(time.into_iter().map(|t| t * scale).collect::<Vec<f64>>());
    }
    if axes.iter().any(|t| *t != axes[0]) {
        for (time, group) in axes.iter().zip(groups.iter()) {
            if let Some(k) = time.windows(2).position(|w| !matches!(w[0].partial_cmp(&w[1]), Some(std::cmp::Ordering::Less))) {
                let whose = group.columns.first().map_or("", |c| c.name.as_str());
                let reason =
                    format!("the time of {whose:?} does not increase at its value {}, so that it cannot be aligned", k + 2);
                return Err(FormatError::Invalid { format, reason });
            }
        }
        let ends = |t: &Vec<f64>| (t[0], t[t.len() - 1]);
        let from = axes.iter().map(|t| ends(t).0).fold(f64::NEG_INFINITY, f64::max);
        let to = axes.iter().map(|t| ends(t).1).fold(f64::INFINITY, f64::min);
        let rate = |t: &Vec<f64>| (t.len() - 1) as f64 / (ends(t).1 - ends(t).0);
        let fastest = (0..axes.len()).max_by(|&a, &b| rate(&axes[a]).total_cmp(&rate(&axes[b]))).unwrap_or(0);
        let axis: Vec<f64> = axes[fastest].iter().copied().filter(|t| (from..=to).contains(t)).collect();
        if axis.len() < 2 {
            let reason = format!("its channels have no time in common: the last begins at {from} s, the first ends at {to} s");
            return Err(FormatError::Invalid { format, reason });
        }
        for (time, group) in axes.iter().zip(groups.iter_mut()) {
            group.columns.iter_mut().for_each(|c| c.values = drawn(time, &c.values, &axis));
        }
        axes = vec![axis];
    }
    groups[0].time = Some(Column::new("t", "s", axes.swap_remove(0)));
    Ok(())
}

/// Straight lines between the samples `(time, values)`, at the times of `axis`, which increase and lie within.
pub fn drawn(time: &[f64], values: &[f64], axis: &[f64]) -> Vec<f64> {
    let mut k = 0;
    let at = |t: &f64| {
        while k + 2 < time.len() && time[k + 1] <= *t {
            k += 1;
        }
        let share = (t - time[k]) / (time[k + 1] - time[k]);
        // At a sample its own value, also beside a missing one.
        match share {
            0.0 => values[k],
            1.0 => values[k + 1],
            _ => values[k] + share * (values[k + 1] - values[k]),
        }
    };
    axis.iter().map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn group(name: &str, unit: &str, step: f64, n: usize, slope: f64) -> Group {
        let t: Vec<f64> = (0..n).map(|k| k as f64 * step).collect();
        let values = t.iter().map(|t| slope * t).collect();
        Group { name: name.into(), time: Some(Column::new("time", unit, t)), columns: vec![Column::new("x", "V", values)] }
    }

    #[test]
    fn a_line_sampled_slowly_in_ms_is_the_same_line_on_the_fast_axis() {
        let table =
            table(Format::Mdf, vec![group("slow", "ms", 10.0, 6, 2e-3), group("fast", "s", 0.001, 41, 3.0)], vec![]).unwrap();
        assert_eq!(table.names, ["t (s)", "slow x (V)", "fast x (V)"]);
        assert_eq!(table.rows(), 41);
        for k in 0..41 {
            let t = table.columns[0][k];
            assert!((table.columns[1][k] - 2.0 * t).abs() < 1e-12 && table.columns[2][k] == 3.0 * t, "row {k}");
        }
    }

    #[test]
    fn only_the_common_span_is_kept_and_missing_samples_stay_missing() {
        let mut slow = group("slow", "s", 1.0, 5, 1.0);
        slow.columns[0].values[1] = f64::NAN;
        slow.time.as_mut().unwrap().values.iter_mut().for_each(|t| *t += 2.0);
        let table = table(Format::Mdf, vec![slow, group("fast", "s", 0.5, 9, 1.0)], vec![]).unwrap();
        assert_eq!(table.columns[0], [2.0, 2.5, 3.0, 3.5, 4.0]);
        let missing: Vec<bool> = table.columns[1].iter().map(|x| x.is_nan()).collect();
        assert_eq!(missing, [false, true, true, true, false]);
    }

    #[test]
    fn axes_apart_and_axes_that_stand_still_are_refused() {
        let mut late = group("late", "s", 0.1, 5, 1.0);
        late.time.as_mut().unwrap().values.iter_mut().for_each(|t| *t += 100.0);
        let apart = table(Format::Tdms, vec![late, group("early", "s", 0.1, 9, 1.0)], vec![]).unwrap_err();
        assert!(apart.to_string().contains("no time in common"), "{apart}");
        let still =
            table(Format::Tdms, vec![group("still", "s", 0.0, 5, 1.0), group("b", "s", 0.1, 9, 1.0)], vec![]).unwrap_err();
        assert!(still.to_string().contains("does not increase at its value 2"), "{still}");
    }

    #[test]
    fn a_unit_in_the_name_is_not_written_twice() {
        assert_eq!(Column::new("Speed [rpm]", "rpm", vec![]).title(), "Speed [rpm]");
        assert_eq!(Column::new("Speed", "rpm", vec![]).title(), "Speed (rpm)");
        assert_eq!(Column::new("u_a_V", "", vec![]).title(), "u_a_V");
    }
}
