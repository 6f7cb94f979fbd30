//! One run: drive, inverter, machine, sensors, sample by sample.

use super::drive::{Measured, VoltageSource};
use super::integrator::DormandPrince;
use super::machine::CatalogueMachine;
use super::outfit::Outfit;
use super::plane::Vector;
use super::plant::{HiddenPlant, STATES, State, at};
use super::sensors::NoiseSource;
use super::table::Table;

/// Tolerated error of each state per step: far below what sensors resolve.
fn tolerances(machine: &CatalogueMachine) -> [f64; STATES] {
    let current = 2e-6 * machine.rated_current_a();
    let speed = 1e-6 * machine.synchronous_speed_rad_s();
    let mut tolerance = [current; STATES];
    for place in [at::SPEED, at::LOAD_SPEED, at::SPEED_FILTER, at::SPEED_FILTER + 1] {
        tolerance[place] = speed;
    }
    tolerance[at::ANGLE] = 1e-6;
    tolerance[at::TWIST] = 1e-8;
    for place in [at::STATOR_HEAT, at::STATOR_HEAT + 1, at::ROTOR_HEAT] {
        tolerance[place] = 1e-5;
    }
    tolerance
}

/// The machine in time: integrator and state.
pub struct Motion<'a> {
    plant: &'a HiddenPlant,
    integrator: DormandPrince<STATES>,
    /// The state.
    pub x: State,
}

impl<'a> Motion<'a> {
    /// At rest and unmagnetized.
    pub fn at_rest(machine: &CatalogueMachine, plant: &'a HiddenPlant) -> Self {
        Self { plant, integrator: DormandPrince::new(tolerances(machine), 2e-5), x: [0.0; STATES] }
    }

    /// The same with every tolerance multiplied.
    pub fn with_tolerance(mut self, factor: f64) -> Self {
        self.integrator.tolerance = self.integrator.tolerance.map(|t| factor * t);
        self
    }

    /// Carries the machine over a time with constant voltage and load.
    pub fn advance(&mut self, voltage: Vector, load_nm: f64, span_s: f64) {
        let plant = self.plant;
        self.integrator.advance(&mut self.x, span_s, |x| plant.derivative(x, voltage, load_nm));
    }
}

/// Runs a drive against a machine and records it.
pub fn record(
    machine: &CatalogueMachine,
    outfit: &Outfit,
    drive: &mut dyn VoltageSource,
    load_nm: &[f64],
    sample_s: f64,
    mut noise: Option<NoiseSource>,
) -> Table {
    let mut motion = Motion::at_rest(machine, &outfit.plant);
    motion.x[at::ANGLE] = outfit.start_angle_rad;
    let mut table = Table::default();
    let whole = outfit.delay_samples.floor();
    let late_s = (outfit.delay_samples - whole) * sample_s;
    let whole = whole as usize;
    let mut sent: Vec<Vector> = Vec::with_capacity(load_nm.len());
    let mut slow = outfit.slow_current_sensor.map(|slow| slow.at_rest(sample_s));
    let mut angles: Vec<f64> = Vec::with_capacity(load_nm.len());
    for (k, &load) in load_nm.iter().enumerate() {
        angles.push(motion.x[at::ANGLE]);
        let current = HiddenPlant::stator_current(&motion.x);
        let current = outfit.sensors.current(slow.as_mut().map_or(current, |slow| slow.reads(current)));
        let speed = match outfit.sensors.encoder_window_s {
            None => outfit.plant.sensed_speed(&motion.x),
            Some(window) => (angles[k] - earlier(&angles, k as f64 - window / sample_s)) / window,
        };
        let speed = outfit.sensors.speed(speed);
        let clean = [current.x, current.y, speed, load];
        let [i_alpha, i_beta, omega, tau] = noise.as_mut().map_or(clean, |noise| noise.corrupt(clean));
        let u = drive.voltage(k, Measured { current: Vector::new(i_alpha, i_beta), speed_rad_s: omega });
        table.push([k as f64 * sample_s, u.x, u.y, i_alpha, i_beta, omega, tau]);
        sent.push(u);

        let applied = |back: usize| k.checked_sub(back).map_or(Vector::ZERO, |j| outfit.supplied(sent[j]));
        if late_s > 0.0 {
            motion.advance(applied(whole + 1), load, late_s);
        }
        motion.advance(applied(whole), load, sample_s - late_s);
    }
    table
}

/// Angle at a place between samples; before the start the shaft stood still.
fn earlier(angles: &[f64], place: f64) -> f64 {
    if place <= 0.0 {
        return angles[0];
    }
    let low = place.floor() as usize;
    let part = place - place.floor();
    angles[low] + part * (angles.get(low + 1).copied().unwrap_or(angles[low]) - angles[low])
}
