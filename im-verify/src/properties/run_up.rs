//! A machine run up on a ramp of voltage and frequency: transients with the truth beside them.

use im_model::space_vector::unit;
use im_model::{Plant, PlantInput, State};
use im_observers::Input;

use crate::claim::{C, ClaimCase};

/// From rest, without flux: voltage over frequency constant, with a boost that magnetizes; a load in proportion to speed.
#[derive(Clone, Debug)]
pub struct RunUp {
    plant: Plant<f64>,
    /// Peak phase voltage over electrical rad/s, Vs; at standstill, V.
    flux_vs: f64,
    boost_v: f64,
    /// Reached after [`RAMP_S`], electrical rad/s.
    omega_e: f64,
    load_nm_s: f64,
    sample_time_s: f64,
}

/// Duration of the ramp, s.
pub const RAMP_S: f64 = 1.0;

impl RunUp {
    /// Up to a share of the rated frequency against a load torque of `load_nm_s` times the speed (N m s/rad).
    pub fn new(case: &ClaimCase, frequency_share: f64, load_nm_s: f64, sample_time_s: f64) -> Self {
        let (p, r) = (case.parameters(), case.rating());
        let rated = 2.0 * core::f64::consts::PI * r.electrical_frequency_hz;
        Self {
            plant: Plant::new(case.machine()),
            flux_vs: r.phase_voltage_peak_v / rated,
            boost_v: p.stator_resistance_ohm * r.rotor_flux_vs / p.magnetizing_inductance_h,
            omega_e: frequency_share * rated,
            load_nm_s,
            sample_time_s,
        }
    }

    /// Runs it; `see` gets what an observer is shown at each sample, and the state.
    pub fn run(&self, duration_s: f64, mut see: impl FnMut(&Input<f64>, &State<f64>)) {
        let h = self.sample_time_s;
        let mut x = State::default();
        let (mut angle, mut u) = (0.0f64, C::new(0.0, 0.0));
        for k in 0..(duration_s / h) as usize {
            let i_s = self.plant.currents(&x).i_s;
            see(&Input::new(u, i_s).with_speed(x.omega_m), &x);
            let omega = self.omega_e * ((k as f64 * h) / RAMP_S).min(1.0);
            u = unit(angle + 0.5 * omega * h) * (self.boost_v + self.flux_vs * omega);
            angle += omega * h;
            x = self.plant.step(&x, &PlantInput::new(u, self.load_nm_s * x.omega_m), h);
        }
    }
}
