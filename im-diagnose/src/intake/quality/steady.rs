//! Stretches of steady operation, and what the motor file says about them.
//!
//! The impedance at slip s, of the T circuit Z = R_s + jωL_ls + jωL_m ∥ (R_r/s + jωL_lr) or of the machine with its effects, is set beside U/I.
//! The slip that fits best needs no speed sensor, so that the sensor can be checked by it. A flux may grow or die away, at the voltage's growth g (1/s): a
//! rotor that is left alone keeps a voltage without a current. Of the circuit jω is p = g + jω then, and R_r/s is R_r p/(g + jsω).

use std::f64::consts::PI;
use std::ops::Range;

use im_model::{Complex, Held, Machine, Plant, TParameters, steady_state};

/// Steady operation on a sinusoidal supply.
#[derive(Clone, Debug, PartialEq)]
pub struct Steady {
    /// Rows: a whole number of periods.
    pub rows: Range<usize>,
    /// Electrical frequency, rad/s; negative for the negative sequence.
    pub omega: f64,
    /// By what part of itself the voltage grows in a second, 1/s.
    pub growth: f64,
    /// Voltage phasor at the first row, V peak.
    pub u: Complex<f64>,
    /// Current phasor at the first row, A peak.
    pub i: Complex<f64>,
    /// Negative-sequence voltage and current, of the sequence against `omega`.
    pub against: [Complex<f64>; 2],
    /// Mean speed, rad/s mechanical.
    pub omega_m: Option<f64>,
}

/// Windows to look at, s, and at least this many periods and rows in one.
const WINDOW_S: f64 = 0.1;
const PERIODS: f64 = 2.0;
const ROWS: usize = 40;

/// Finds stretches in which frequency, current and speed stay as they are.
pub fn stretches(u: &[Complex<f64>], i: &[Complex<f64>], speed: Option<&[f64]>, dt: f64) -> Vec<Steady> {
    let n = u.len().min(i.len());
    let mut found = Vec::new();
    for seconds in [WINDOW_S, 5.0 * WINDOW_S] {
        let length = ((seconds / dt) as usize).max(ROWS).min(n);
        if length < ROWS {
            continue;
        }
        found.extend((0..n / length).filter_map(|w| one(w * length..(w + 1) * length, u, i, speed, dt)));
        if !found.is_empty() {
            break;
        }
    }
    found
}

fn one(rows: Range<usize>, u: &[Complex<f64>], i: &[Complex<f64>], speed: Option<&[f64]>, dt: f64) -> Option<Steady> {
    let turn = |r: Range<usize>| {
        let sum: Complex<f64> = (r.start + 1..r.end).map(|k| u[k] * u[k - 1].conj()).sum();
        sum.arg() / dt
    };
    let half = rows.len() / 2;
    let (first, second) = (rows.start..rows.start + half, rows.start + half..rows.end);
    let omega = turn(rows.clone());
    if (turn(first.clone()) - turn(second.clone())).abs() > 0.03 * omega.abs() {
        return None;
    }
    let per_period = 2.0 * PI / (omega.abs() * dt);
    let periods = (rows.len() as f64 / per_period).floor();
    if periods.is_nan() || periods < PERIODS || per_period < 4.0 {
        return None;
    }
    let whole = rows.start..rows.start + (periods * per_period).round() as usize;
    let phasor = |x: &[Complex<f64>], r: Range<usize>, w: f64| {
        let sum: Complex<f64> = r.clone().map(|k| x[k] * Complex::from_polar(1.0, -w * dt * (k - rows.start) as f64)).sum();
        sum / r.len() as f64
    };
    let periods_in_half = (periods / 2.0).floor();
    let part = (periods_in_half * per_period).round() as usize;
    // Both sequences: the phases may be exchanged.
    let size = |x: &[Complex<f64>], r: Range<usize>| phasor(x, r.clone(), omega).norm().hypot(phasor(x, r, -omega).norm());
    let halves = [whole.start..whole.start + part, whole.end - part..whole.end];
    let [a, b] = halves.clone().map(|r| size(i, r));
    if (a - b).abs() > 0.05 * (a + b) {
        return None;
    }
    let [a, b] = halves.map(|r| size(u, r));
    let growth = if a > 0.0 && b > 0.0 { (b / a).ln() / ((whole.len() - part) as f64 * dt) } else { 0.0 };
    let mean = |r: Range<usize>| speed.map(|w| w[r.clone()].iter().sum::<f64>() / r.len() as f64);
    if let (Some(x), Some(y)) = (mean(first), mean(second))
        && (x - y).abs() > 0.03 * (x.abs() + y.abs())
        && x.abs().max(y.abs()) > 0.02 * omega.abs()
    {
        return None;
    }
    Some(Steady {
        omega,
        growth,
        u: phasor(u, whole.clone(), omega),
        i: phasor(i, whole.clone(), omega),
        against: [phasor(u, whole.clone(), -omega), phasor(i, whole.clone(), -omega)],
        omega_m: mean(whole.clone()),
        rows: whole,
    })
}

/// How an impedance fits a motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImpedanceFit {
    /// The slip that fits best.
    pub slip: f64,
    /// |ln(Z/Z_model)| at it: 0.1 is ten percent or six degrees.
    pub off: f64,
    /// |Z|/|Z_model| at it.
    pub ratio: f64,
}

/// The motor's impedance over the slip, with the effects that are on as they are at a voltage.
pub struct Impedances(Vec<(f64, Complex<f64>)>);

/// Slips per sign; effects cost a steady state each.
const SLIPS: usize = 240;
const SLIPS_WITH_EFFECTS: usize = 60;

impl Impedances {
    /// At the frequency of steady operation, a phase voltage, V peak, and the growth there, which machines with effects are taken without.
    pub fn of(machine: &Machine<f64>, voltage_peak_v: f64, steady: &Steady) -> Self {
        let (omega, growth) = (steady.omega.abs(), steady.growth);
        let linear = machine.effects().active().next().is_none();
        let count = if linear { SLIPS } else { SLIPS_WITH_EFFECTS };
        // From a hundred-thousandth of slip to plugging, generating and motoring.
        let slips = (0..count).map(|k| 10f64.powf(-5.0 + k as f64 * 5.3 / (count - 1) as f64)).flat_map(|s| [s, -s]);
        let of_circuit = |s: f64| t_circuit(machine.parameters(), s, omega, growth);
        let plant = Plant::new(machine);
        let solved = |s: f64| {
            let held = Held::Speed(omega * (1.0 - s) / f64::from(machine.pole_pairs()));
            let x = steady_state(machine, voltage_peak_v, omega / (2.0 * PI), held).ok()?;
            Some(voltage_peak_v / plant.currents(&x).i_s)
        };
        Self(slips.map(|s| (s, if linear { of_circuit(s) } else { solved(s).unwrap_or_else(|| of_circuit(s)) })).collect())
    }

    /// The slip at which it is most like `z`.
    pub fn fit(&self, z: Complex<f64>) -> ImpedanceFit {
        let at = |&(slip, model): &(f64, Complex<f64>)| {
            let q = z / model;
            ImpedanceFit { slip, off: Complex::new(q.norm().ln(), q.arg()).norm(), ratio: q.norm() }
        };
        let best = self.0.iter().map(at).min_by(|a, b| a.off.total_cmp(&b.off));
        best.unwrap_or(ImpedanceFit { slip: 1.0, off: f64::INFINITY, ratio: f64::INFINITY })
    }
}

/// R_s + pL_ls + pL_m ∥ (R_r p/(g + jsω) + pL_lr), p = g + jω.
fn t_circuit(m: &TParameters<f64>, slip: f64, omega: f64, growth: f64) -> Complex<f64> {
    let p = Complex::new(growth, omega);
    let rotor = m.rotor_resistance_ohm * p / Complex::new(growth, slip * omega) + p * m.rotor_leakage_inductance_h;
    let main = p * m.magnetizing_inductance_h;
    m.stator_resistance_ohm + p * m.stator_leakage_inductance_h + main * rotor / (main + rotor)
}

#[cfg(test)]
mod tests {
    use im_model::MotorFile;

    use super::*;

    /// A drive that takes the current of the flux away leaves a voltage without a current for as long as the rotor keeps its flux: nothing is wrong
    /// with the motor file.
    #[test]
    fn a_flux_that_dies_away_fits_the_motor() {
        let motor = MotorFile::parse(include_str!("../../../../examples/motor.toml"), "motor.toml").unwrap();
        let mut p = *motor.machine.parameters();
        let rate = 1.6;
        p.rotor_resistance_ohm = rate * (p.rotor_leakage_inductance_h + p.magnetizing_inductance_h);
        let machine = Machine::base(p, motor.machine.pole_pairs()).unwrap();
        let (omega, slip, growth) = (2.0 * PI * 50.0, 1e-4, -0.9 * rate);
        let turned = |k: usize, x: Complex<f64>| x * (Complex::new(growth, omega) * (k as f64 * 1e-4)).exp();
        // At the rotor's own rate it takes no current at all.
        assert!(t_circuit(&p, 0.0, omega, -rate).norm() > 1e9);
        let z = t_circuit(&p, slip, omega, growth);
        let u: Vec<_> = (0..5000).map(|k| turned(k, z)).collect();
        let i: Vec<_> = (0..5000).map(|k| turned(k, Complex::new(1.0, 0.0))).collect();
        let all = stretches(&u, &i, None, 1e-4);
        assert_eq!(all.len(), 5);
        for s in all {
            assert!((s.growth / growth - 1.0).abs() < 1e-3, "{}", s.growth);
            let fit = |growth| Impedances::of(&machine, s.u.norm(), &Steady { growth, ..s.clone() }).fit(s.u / s.i);
            assert!(fit(s.growth).off < 0.1 && fit(0.0).off > 1.6, "{:?} {:?}", fit(s.growth), fit(0.0));
        }
    }
}
