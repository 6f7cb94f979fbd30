//! What a machine can be made to do on a bench, on a drive or on the mains.

use im_model::MotorFile;
use im_model::simulation::{Load, Mains, Profile, Scenario, Sensors, Source, VoltsPerHertz};
use serde_json::Value;

/// What feeds the machine on the bench.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Supply {
    /// A drive: any voltage and frequency.
    #[default]
    Drive,
    /// The mains: the rated frequency, at the rated voltage or through a transformer.
    Mains,
}

impl Supply {
    /// What is asked for; else what fed the machine of a `diagnosis.json`, a drive where there is none.
    pub fn of(asked: Option<Self>, diagnosis: Option<&Value>) -> Self {
        let fed = diagnosis.filter(|d| d["on_mains"] == true).map(|_| Self::Mains);
        asked.or(fed).unwrap_or_default()
    }
}

/// What the machine and its supply may be asked to do.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// What feeds it.
    pub supply: Supply,
    /// Largest phase current, peak, over the rated one.
    pub current: f64,
    /// Largest speed over the synchronous one.
    pub speed: f64,
    /// Largest load torque over the rated one.
    pub torque: f64,
}

impl Limits {
    /// What is usual: on the mains a machine draws what it draws when it is switched on.
    pub fn on(supply: Supply) -> Self {
        let current = if supply == Supply::Mains { 12.0 } else { 2.5 };
        Self { supply, current, speed: 1.1, torque: 0.8 }
    }
}

impl Default for Limits {
    fn default() -> Self {
        Self::on(Supply::Drive)
    }
}

/// Part of the rated voltage at which a motor is switched on directly: the current stays near 2.5 times rated.
const REDUCED_VOLTAGE: f64 = 0.4;

/// Something that a machine can be made to do.
pub struct Manoeuvre {
    /// Short name.
    pub name: &'static str,
    /// What to do, in a sentence.
    pub what: String,
    /// The same as a scenario.
    pub scenario: Scenario,
}

/// The manoeuvres for the machine's rating and its supply.
pub fn manoeuvres(motor: &MotorFile, noise: (f64, f64), limits: &Limits) -> Vec<Manoeuvre> {
    let r = &motor.rating;
    let p = motor.machine.parameters();
    let (u, f) = (r.phase_voltage_peak_v, r.electrical_frequency_hz);
    let boost = 0.8 * p.stator_resistance_ohm * r.current_peak_a(p, motor.machine.pole_pairs());
    let torque = limits.torque * r.torque_nm;
    // A ramp that takes about rated torque to follow.
    let ramp = (0.6 * r.torque_nm / p.inertia_kg_m2 * f64::from(motor.machine.pole_pairs()) / std::f64::consts::TAU).min(6.0 * f);
    let sensors = Sensors { current_noise_a: noise.0, speed_noise_rad_s: noise.1, seed: 1, ..Sensors::default() };
    let on_line = |voltage: f64| Scenario { sensors, ..Scenario::direct_on_line(rounded(voltage), f, 3.0) };
    // Values over time, as parts of a whole.
    let over = |points: &[[f64; 2]], whole: f64| {
        let points: Vec<[f64; 2]> = points.iter().map(|[t, x]| [*t, rounded(x * whole)]).collect();
        Profile::points(points).unwrap_or_default()
    };
    // On volts per hertz: the voltage over the rated one, parts of rated frequency and of the torque over time.
    let drive = |level: f64, boost: f64, reference: &[[f64; 2]], load: &[[f64; 2]]| {
        let supply = VoltsPerHertz {
            voltage_peak_v: rounded(u * level),
            frequency_hz: f,
            boost_v: rounded(boost).min(rounded(u * level)),
            ramp_hz_per_s: rounded(ramp),
        };
        Scenario {
            source: Source::VoltsPerHertz(supply, over(reference, f)),
            load: Load { torque_nm: over(load, torque), ..Load::none() },
            ..on_line(u)
        }
    };
    let still = |x: f64| [[0.0, x]];
    let switched = |part: f64, load: &[[f64; 2]], duration_s: f64| Scenario {
        source: Source::Mains(Mains { voltage_peak_v: rounded(part * u), frequency_hz: f, closing_s: 0.02, phase_rad: 0.0 }),
        load: Load { torque_nm: over(load, torque), ..Load::none() },
        duration_s,
        ..on_line(u)
    };
    let percent = |part: f64| format!("{:.0} % of the rated voltage", 100.0 * part);
    let direct_start = (
        "direct_start",
        format!("Switch on directly at {} and full frequency: all slips from standstill to running.", percent(REDUCED_VOLTAGE)),
        switched(REDUCED_VOLTAGE, &still(0.0), 3.0),
    );
    let all: Vec<(&'static str, String, Scenario)> = match limits.supply {
        Supply::Drive => vec![
            (
                "load_steps",
                "Run up to 80 % speed on volts per hertz, step the load up and down, and come back to 30 %.".to_owned(),
                drive(
                    1.0,
                    boost,
                    &[[0.0, 0.8], [1.9, 0.8], [1.9, 0.3]],
                    &[[0.0, 0.0], [1.0, 0.0], [1.0, 0.7], [1.5, 0.7], [1.5, 0.0], [2.5, 0.0], [2.5, 0.7]],
                ),
            ),
            (
                "reversals",
                "Reverse slowly through standstill, twice, without load.".to_owned(),
                Scenario {
                    duration_s: 4.0,
                    ..drive(1.0, boost, &[[0.0, 0.25], [1.2, 0.25], [1.2, -0.25], [2.6, -0.25], [2.6, 0.25]], &still(0.0))
                },
            ),
            (
                "flux_low",
                "Run at 60 % speed with the voltage at 60 %, without load and with a small one.".to_owned(),
                drive(0.6, boost, &still(0.6), &[[0.0, 0.0], [1.8, 0.0], [1.8, 0.2]]),
            ),
            (
                "flux_high",
                "Run at 45 % speed with the voltage at 120 %, without load and with load.".to_owned(),
                drive(1.2, boost, &still(0.45), &[[0.0, 0.0], [1.8, 0.0], [1.8, 0.5]]),
            ),
            (
                "slow_loaded",
                "Creep at 12 % speed under load steps.".to_owned(),
                drive(1.0, 1.25 * boost, &still(0.12), &[[0.0, 0.0], [1.0, 0.0], [1.0, 0.4], [2.0, 0.4], [2.0, 0.2]]),
            ),
            (
                "heat_run",
                "Hold a high load at 20 % speed for 40 s, with a second of no load every ten.".to_owned(),
                Scenario { duration_s: 40.0, sample_time_s: 5e-4, ..drive(1.0, 1.25 * boost, &still(0.2), &heating()) },
            ),
            direct_start,
        ],
        Supply::Mains => {
            // The time to run up with the rated torque.
            let up = (p.inertia_kg_m2 * r.synchronous_speed_rad_s(motor.machine.pole_pairs()) / r.torque_nm).clamp(0.3, 20.0);
            let [t1, t2, t3] = [1.0, 1.7, 2.4].map(|t| rounded(2.0 * up + t));
            let steps = |a: f64, b: f64| [[0.0, 0.0], [t1, 0.0], [t1, a], [t2, a], [t2, 0.0], [t3, 0.0], [t3, b]];
            let cycles: Vec<[f64; 2]> = heating().iter().map(|[t, x]| [rounded(t + 2.0 * up), *x]).collect();
            let run = |part: f64, a: f64, b: f64| switched(part, &steps(a, b), rounded(t3 + 0.7));
            vec![
                (
                    "mains_load_steps",
                    format!("Switch on at {}; once it runs, step the load up, off, and half up.", percent(1.0)),
                    run(1.0, 1.0, 0.5),
                ),
                (
                    "low_voltage",
                    format!("Through a transformer: run at {} without load, with a small one, and with less.", percent(0.5)),
                    run(0.5, 0.2, 0.1),
                ),
                direct_start,
                (
                    "mains_heat_run",
                    format!("Hold a load at {} for 40 s, with a second of no load every ten.", percent(1.0)),
                    Scenario { sample_time_s: 5e-4, ..switched(1.0, &cycles, rounded(2.0 * up + 40.0)) },
                ),
            ]
        }
    };
    let named = |(name, what, scenario): (&'static str, String, Scenario)| {
        let scenario = Scenario { name: name.replace('_', " "), ..scenario };
        Manoeuvre { name, what, scenario }
    };
    all.into_iter().map(named).collect()
}

/// A load that is taken off for a second every ten.
fn heating() -> Vec<[f64; 2]> {
    let mut points = vec![[0.0, 0.0]];
    for k in 0..4 {
        let begin = f64::from(10 * k);
        points.extend([[begin + 1.0, 0.0], [begin + 1.0, 0.6], [begin + 10.0, 0.6], [begin + 10.0, 0.0]]);
    }
    points
}

/// Four digits are enough for what a person sets.
pub fn rounded(x: f64) -> f64 {
    format!("{x:.3e}").parse().unwrap_or(x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_model::{Machine, Rating, machines};

    /// What is run is what is written, and what a sentence says of a voltage is what is applied.
    #[test]
    fn every_manoeuvre_reads_back_as_it_is() {
        for named in machines::ALL {
            let machine = Machine::base(named.parameters(), named.pole_pairs).unwrap();
            let rating = Rating::guess(machine.parameters(), named.pole_pairs);
            let motor = MotorFile::new(named.name, machine, rating);
            let supplies = [Supply::Drive, Supply::Mains].map(Limits::on);
            for m in supplies.iter().flat_map(|limits| manoeuvres(&motor, (0.01, 0.1), limits)) {
                let text = m.scenario.to_toml().unwrap();
                let back = Scenario::parse(&text, m.name, std::path::Path::new("")).unwrap_or_else(|e| panic!("{e}\n{text}"));
                assert_eq!(back, m.scenario, "{text}");
                if let Source::Mains(mains) = m.scenario.source {
                    let percent = 100.0 * mains.voltage_peak_v / rating.phase_voltage_peak_v;
                    assert!(m.what.contains(&format!("{percent:.0} %")), "{}", m.what);
                }
            }
        }
    }
}
