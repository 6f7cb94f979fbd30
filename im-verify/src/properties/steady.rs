//! A machine in steady state, in closed form: what an observer is shown, and the truth beside it.

use im_model::space_vector::unit;
use im_observers::Input;

use crate::claim::{C, ClaimCase};

/// Flux, current and voltage turn at ω_e = n_pω + slip:
/// 0 = −(η + j slip)λ + ηL_m i,  u = R_s i + jω_e(σL_s i + (L_m/L_r)λ).
#[derive(Clone, Copy, Debug)]
pub struct Steady {
    /// Mechanical speed, rad/s.
    pub omega_m: f64,
    /// ω_e, rad/s.
    pub omega_e: f64,
    /// Sampling time, s.
    pub sample_time_s: f64,
    flux: C,
    current: C,
    voltage: C,
}

impl Steady {
    /// At rotor flux `flux_vs`, a mechanical speed and a slip (electrical rad/s); flux at the angle `angle` at the beginning.
    pub fn new(case: &ClaimCase, omega_m: f64, slip: f64, flux_vs: f64, angle: f64, sample_time_s: f64) -> Self {
        let c = case.constants();
        let omega_e = c.n_p * omega_m + slip;
        let flux = unit(angle) * flux_vs;
        let current = flux * C::new(c.eta, slip) / c.eta_l_m;
        let linkage = current * c.sigma_l_s + flux * (c.beta * c.sigma_l_s);
        let voltage = current * case.parameters().stator_resistance_ohm + linkage * C::new(0.0, omega_e);
        Self { omega_m, omega_e, sample_time_s, flux, current, voltage }
    }

    fn turn(&self, k: f64) -> C {
        unit(self.omega_e * self.sample_time_s * k)
    }

    /// λ at sample `k`, Vs.
    pub fn flux(&self, k: usize) -> C {
        self.flux * self.turn(k as f64)
    }

    /// i_s at sample `k`, A.
    pub fn current(&self, k: usize) -> C {
        self.current * self.turn(k as f64)
    }

    /// u_s at sample `k` itself, V.
    pub fn voltage_now(&self, k: usize) -> C {
        self.voltage * self.turn(k as f64)
    }

    /// The mean voltage over the sample that ends with `k`, V.
    pub fn voltage(&self, k: usize) -> C {
        // The mean of a turning vector over ±half an angle is sin(x)/x of the vector at the middle.
        let half = 0.5 * self.omega_e * self.sample_time_s;
        let share = if half.abs() < 1e-6 { 1.0 } else { half.sin() / half };
        self.voltage * self.turn(k as f64 - 0.5) * share
    }

    /// What an observer sees at sample `k`, with the speed as a sensor would show it.
    pub fn input(&self, k: usize) -> Input<f64> {
        Input::new(self.voltage(k), self.current(k)).with_speed(self.omega_m)
    }
}
