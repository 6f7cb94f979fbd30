//! Off-line fitting: what is known of a made-up run is found again, with deviations that are true; slopes are derivatives; bad data cost no more work.

use im_identify::offline::*;
use im_model::machines::{MOTULATOR_2_2_KW, NamedMachine};
use im_model::simulation::{Load, Profile, Scenario, Sensors, Simulation, Source, VoltsPerHertz};
use im_model::{BaseParameter, Complex, Machine, ParameterId, Recording, State};

mod experiments;
mod fitting;
mod loads;
mod predictions;
mod search;
mod starts;
mod tables;
mod unmeasured_speed;
mod voltage_noise;
mod work;

pub(crate) const M: NamedMachine = MOTULATOR_2_2_KW;
pub(crate) const NOISE: [f64; 2] = [0.05, 0.1];

pub(crate) fn truth() -> Machine<f64> {
    Machine::base(M.parameters(), M.pole_pairs).unwrap()
}

/// Up to 40 Hz, loaded, reversed: 1.6 s at 200 µs, with noise of 50 mA and 0.1 rad/s.
pub(crate) fn scenario(noisy: bool) -> Scenario {
    let supply = VoltsPerHertz { voltage_peak_v: 326.6, frequency_hz: 50.0, boost_v: 20.0, ramp_hz_per_s: 200.0 };
    let noise = if noisy { NOISE } else { [0.0; 2] };
    Scenario {
        source: Source::VoltsPerHertz(supply, Profile::points([[0.0, 40.0], [1.0, 40.0], [1.0, -20.0]]).unwrap()),
        load: Load { torque_nm: Profile::points([[0.6, 0.0], [0.6, 8.0]]).unwrap(), ..Load::none() },
        sensors: Sensors { current_noise_a: noise[0], speed_noise_rad_s: noise[1], ..Sensors::default() },
        sample_time_s: 2e-4,
        ..Scenario::direct_on_line(0.0, 50.0, 1.6)
    }
}

pub(crate) fn recording(noisy: bool) -> Recording {
    Simulation::new(&truth(), &scenario(noisy)).run().unwrap().recording
}

pub(crate) fn experiment(r: &Recording) -> Experiment {
    Experiment::from_recording(r, [NOISE[0]; 2], NOISE[1])
}

/// 30 to 40 % off.
pub(crate) fn guess() -> Machine<f64> {
    let p = M.parameters();
    truth()
        .with_parameters(im_model::TParameters {
            stator_resistance_ohm: 0.7 * p.stator_resistance_ohm,
            rotor_resistance_ohm: 1.4 * p.rotor_resistance_ohm,
            stator_leakage_inductance_h: 0.6 * p.stator_leakage_inductance_h,
            rotor_leakage_inductance_h: 0.6 * p.rotor_leakage_inductance_h,
            magnetizing_inductance_h: 1.3 * p.magnetizing_inductance_h,
            inertia_kg_m2: 0.7 * p.inertia_kg_m2,
            ..p
        })
        .unwrap()
}

pub(crate) fn id(p: BaseParameter) -> ParameterId {
    ParameterId::Base(p)
}

/// A channel of each kind of use: phase b in place of β, rows that do not count, a speed that is nudged or imposed, motion at the start.
pub(crate) fn odd() -> (Experiment, State<f64>) {
    let r = recording(false);
    let mut e = experiment(&r);
    let n = 400;
    e.u_s.truncate(n);
    e.tau_load = (0..n).map(|k| 0.01 * k as f64).collect();
    for c in &mut e.channels {
        c.values.truncate(n);
    }
    e.channels[1].kind = ChannelKind::Current { direction_rad: 2.0 * core::f64::consts::FRAC_PI_3 };
    e.channels[0].valid = Some((0..n).map(|k| k % 7 != 3).collect());
    let start = State { psi_s: Complex::new(0.5, -0.2), psi_r: Complex::new(0.45, -0.25), ..State::turning(30.0) };
    e.start = Start::Estimated(start);
    (e, start)
}
