//! A machine held at operating points, as another drive would: speed imposed, voltage such that flux and slip settle as wanted; its
//! resistances may change.

use im_identify::online::{RegulationParameters, Sample};
use im_model::space_vector::unit;
use im_model::{BaseParameter, Machine, ParameterId, Plant, PlantInput, State};

use crate::claim::C;

/// Where the machine runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Operating {
    /// Electrical speed, rad/s.
    pub omega_r: f64,
    /// Slip, electrical rad/s.
    pub omega_g: f64,
    /// φ = (L_m/L_r)ψ_r, Vs.
    pub flux_vs: f64,
}

impl Operating {
    fn current(&self, p: &RegulationParameters<f64>) -> C {
        C::new(p.inverse_rotor_time_constant(), self.omega_g) * (self.flux_vs / p.rotor_resistance_ohm)
    }

    /// The voltage, V, in the frame of the flux, for a machine with these parameters.
    fn voltage(&self, p: &RegulationParameters<f64>) -> C {
        let omega_s = self.omega_r + self.omega_g;
        let z = C::new(p.stator_resistance_ohm + p.rotor_resistance_ohm, omega_s * p.leakage_inductance_h);
        z * self.current(p) - C::new(p.inverse_rotor_time_constant(), -self.omega_r) * self.flux_vs
    }
}

/// The machine.
#[derive(Clone, Debug)]
pub struct HeldMachine {
    plant: Plant<f64>,
    machine: Machine<f64>,
    /// Its state.
    pub state: State<f64>,
    /// Its parameters (7).
    pub truth: RegulationParameters<f64>,
    n_p: f64,
    angle: f64,
    u_s: C,
    sample_time_s: f64,
}

impl HeldMachine {
    /// In the steady state at a point, with the flux at angle zero.
    pub fn new(machine: &Machine<f64>, at: &Operating, sample_time_s: f64) -> Self {
        let p = machine.parameters();
        let truth = RegulationParameters::from(p.inverse_gamma());
        let n_p = f64::from(machine.pole_pairs());
        let phi = C::new(at.flux_vs, 0.0);
        let state = State {
            psi_s: phi + at.current(&truth) * truth.leakage_inductance_h,
            psi_r: phi * (p.rotor_inductance_h() / p.magnetizing_inductance_h),
            omega_m: at.omega_r / n_p,
            ..State::default()
        };
        let u_s = at.voltage(&truth) * unit(-0.5 * (at.omega_r + at.omega_g) * sample_time_s);
        Self { plant: Plant::new(machine), machine: *machine, state, truth, n_p, angle: 0.0, u_s, sample_time_s }
    }

    /// The direction in which the wanted flux stands.
    pub fn direction(&self) -> C {
        unit(self.angle)
    }

    /// Another resistance from now on, Ω.
    ///
    /// # Errors
    /// A value out of bounds.
    pub fn set(&mut self, resistance: BaseParameter, ohm: f64) -> Result<(), im_model::ModelError> {
        self.machine = self.machine.with(&[(ParameterId::Base(resistance), ohm)])?;
        self.plant = Plant::new(&self.machine);
        self.truth = self.machine.parameters().inverse_gamma().into();
        Ok(())
    }

    /// What is measured now.
    pub fn sample(&self) -> Sample<f64> {
        Sample { i_s: self.plant.currents(&self.state).i_s, u_s: self.u_s, omega_m: self.state.omega_m }
    }

    /// One sample at (or on the way to) a point; the speed changes by at most `slew` rad/s² (electrical).
    pub fn advance(&mut self, at: &Operating, slew: f64) {
        let h = self.sample_time_s;
        let before = self.state.omega_m * self.n_p;
        let now = before + (at.omega_r - before).clamp(-slew * h, slew * h);
        let here = Operating { omega_r: 0.5 * (before + now), ..*at };
        let turn = (here.omega_r + at.omega_g) * h;
        self.u_s = here.voltage(&self.truth) * unit(self.angle + 0.5 * turn);
        self.angle = (self.angle + turn) % (2.0 * core::f64::consts::PI);
        let imposed_speed = Some([before / self.n_p, now / self.n_p]);
        self.state = self.plant.step(&self.state, &PlantInput { imposed_speed, ..PlantInput::new(self.u_s, 0.0) }, h);
        self.state.omega_m = now / self.n_p;
    }
}
