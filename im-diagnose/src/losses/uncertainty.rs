//! Intervals: every reading moved by what its instrument may be off by, and what follows from it, added in squares.
//!
//! An instrument of class c is off by up to c % of its reading in all rows alike (its scale), and by up to c % of its largest reading in each row
//! for itself; either is evenly distributed, c/√3 in standard deviation. A speed is off by a revolution per minute.

use serde::Serialize;

use super::readings::{Reading, Readings};
use super::{ConstantBy, Losses, of};

/// A number with its 95-% interval.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// Half the width of the interval.
    pub half_95: f64,
}

impl From<f64> for Estimate {
    fn from(value: f64) -> Self {
        Self { value, half_95: 0.0 }
    }
}

/// Standard deviation of a speed, rad/s: one revolution per minute at most.
const SPEED_STD: f64 = std::f64::consts::PI / 30.0 / 1.732_050_807_568_877_2;

/// Fills in the intervals.
pub(super) fn fill(losses: &mut Losses, readings: &Readings) {
    let base: Vec<f64> = each(losses).iter().map(|e| e.value).collect();
    let mut variance = vec![0.0; base.len()];
    // With a point left out or a regression given up the losses are of another kind: both sides of each change are of the same.
    let mut add = |changed: Readings, deviation: f64| {
        if let Ok(mut other) = of(&changed)
            && deviation > 0.0
        {
            let moved = each(&mut other);
            if moved.len() == base.len() {
                for ((v, base), moved) in variance.iter_mut().zip(&base).zip(moved) {
                    *v += (moved.value - base).powi(2);
                }
            }
        }
    };
    for set in [Set::NoLoad, Set::Load] {
        let rows = set.of(readings);
        for quantity in Quantity::ALL {
            let largest = rows.iter().filter_map(|r| quantity.of(r)).fold(0.0, |m: f64, x| m.max(x.abs()));
            for (k, row) in rows.iter().enumerate() {
                let Some(present) = quantity.of(row) else { continue };
                let deviation = quantity.deviation(row, largest);
                let mut changed = readings.clone();
                quantity.set(&mut set.of_mut(&mut changed)[k], present + deviation);
                add(changed, deviation);
            }
        }
    }
    // The scale of an instrument is the same in all tests.
    for quantity in Quantity::ALL.into_iter().filter(|q| *q != Quantity::Speed) {
        let mut changed = readings.clone();
        let mut most: f64 = 0.0;
        for r in changed.no_load.iter_mut().chain(&mut changed.load) {
            let scale = 0.01 * r.class_percent / 3f64.sqrt();
            if let Some(x) = quantity.of(r) {
                quantity.set(r, x * (1.0 + scale));
                most = most.max(scale);
            }
        }
        add(changed, most);
    }
    let mut warmer = readings.clone();
    let off = 0.01 * readings.resistance_percent / 3f64.sqrt();
    warmer.no_load.iter_mut().chain(&mut warmer.load).for_each(|r| r.resistance_ohm *= 1.0 + off);
    add(warmer, off);
    if losses.constant_by != ConstantBy::Voltages {
        // Either may be all of it.
        let share = 1.0 / 12f64.sqrt();
        add(Readings { share: readings.share + share, ..readings.clone() }, share);
    }
    for (e, v) in each(losses).into_iter().zip(&variance) {
        e.half_95 = 1.96 * v.sqrt();
    }
}

/// Every number that has an interval, in one order.
fn each(l: &mut Losses) -> Vec<&mut Estimate> {
    let mut all = vec![&mut l.constant_w, &mut l.friction_windage_w, &mut l.iron_w, &mut l.stray_w_per_nm2, &mut l.intercept_w];
    for p in &mut l.points {
        all.extend([&mut p.stator_w, &mut p.rotor_w, &mut p.iron_w, &mut p.friction_windage_w, &mut p.stray_w, &mut p.total_w]);
        all.push(&mut p.efficiency);
        all.extend(&mut p.direct_efficiency);
    }
    all
}

#[derive(Clone, Copy)]
enum Set {
    NoLoad,
    Load,
}

impl Set {
    fn of(self, r: &Readings) -> &[Reading] {
        match self {
            Self::NoLoad => &r.no_load,
            Self::Load => &r.load,
        }
    }

    fn of_mut(self, r: &mut Readings) -> &mut [Reading] {
        match self {
            Self::NoLoad => &mut r.no_load,
            Self::Load => &mut r.load,
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Quantity {
    Voltage,
    Current,
    Power,
    Speed,
    Torque,
}

impl Quantity {
    const ALL: [Self; 5] = [Self::Voltage, Self::Current, Self::Power, Self::Speed, Self::Torque];

    fn of(self, r: &Reading) -> Option<f64> {
        match self {
            Self::Voltage => Some(r.voltage_v),
            Self::Current => Some(r.current_a),
            Self::Power => Some(r.power_w),
            Self::Speed => r.omega_m,
            Self::Torque => r.torque_nm,
        }
    }

    fn set(self, r: &mut Reading, x: f64) {
        match self {
            Self::Voltage => r.voltage_v = x,
            Self::Current => r.current_a = x,
            Self::Power => r.power_w = x,
            Self::Speed => r.omega_m = Some(x),
            Self::Torque => r.torque_nm = Some(x),
        }
    }

    /// Of a row for itself.
    fn deviation(self, r: &Reading, largest: f64) -> f64 {
        match self {
            Self::Speed => SPEED_STD,
            _ => 0.01 * r.class_percent * largest / 3f64.sqrt(),
        }
    }
}
