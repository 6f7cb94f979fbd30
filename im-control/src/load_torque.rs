//! Load torque from speed and electromagnetic torque: a disturbance observer with a double pole.
//!
//! J dω̂/dt = τ_e − Dω̂ − τ̂_L + 2aJ(ω − ω̂),   dτ̂_L/dt = −a²J(ω − ω̂)
//!
//! Without friction the errors decay as (1 + at)e^{−at}.

use im_model::Scalar;

use crate::vector::clamp;

/// The observer's data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadTorqueObserver<T> {
    /// J, kg m².
    pub inertia_kg_m2: T,
    /// D, N m s/rad.
    pub viscous_friction_nm_s_per_rad: T,
    /// a, 1/s.
    pub bandwidth_per_s: T,
    /// |τ̂_L| is kept below this, Nm.
    pub limit_nm: T,
}

/// Its state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadTorqueEstimate<T> {
    /// τ̂_L, Nm.
    pub torque_nm: T,
    /// dτ̂_L/dt, Nm/s.
    pub rate_nm_per_s: T,
    omega_m: Option<T>,
}

impl<T: Scalar> Default for LoadTorqueEstimate<T> {
    fn default() -> Self {
        Self { torque_nm: T::zero(), rate_nm_per_s: T::zero(), omega_m: None }
    }
}

impl<T: Scalar> LoadTorqueObserver<T> {
    /// Brings the estimate to the instant of `omega_m`; `torque_nm` is the mean electromagnetic torque over the sample before.
    #[inline]
    pub fn step(&self, state: &mut LoadTorqueEstimate<T>, torque_nm: T, omega_m: T, sample_time_s: T) {
        // At the first sample the speed is what it is: a flying start is no disturbance.
        let omega = state.omega_m.unwrap_or(omega_m);
        let (a, j) = (self.bandwidth_per_s, self.inertia_kg_m2);
        // The poles at e^{−aT} in place of 1 − aT: any sampling time.
        let x = a * sample_time_s;
        let pole = T::one() / (T::one() + x);
        let predicted = omega + (torque_nm - self.viscous_friction_nm_s_per_rad * omega - state.torque_nm) / j * sample_time_s;
        let e = omega_m - predicted;
        state.omega_m = Some(predicted + e * (T::one() - pole * pole));
        let before = state.torque_nm;
        let step = e * j * ((T::one() - pole) * (T::one() - pole)) / sample_time_s;
        state.torque_nm = clamp(before - step, -self.limit_nm, self.limit_nm);
        state.rate_nm_per_s = (state.torque_nm - before) / sample_time_s;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_load_step_is_found_and_a_flying_start_is_none() {
        for (t, a) in [(1e-4, 100.0), (1e-3, 2000.0)] {
            let observer = LoadTorqueObserver {
                inertia_kg_m2: 0.02,
                viscous_friction_nm_s_per_rad: 0.01,
                bandwidth_per_s: a,
                limit_nm: 100.0,
            };
            let (mut state, mut omega): (_, f64) = (LoadTorqueEstimate::default(), 120.0);
            let n = (20.0 / (a * t)) as usize + 20;
            for k in 0..2 * n {
                observer.step(&mut state, 3.0, omega, t);
                if k < n {
                    // 1.2 Nm of friction, 1.8 of load: no change of speed.
                    assert!(state.torque_nm.abs() < 1.9, "{k}: {state:?}");
                }
                let load = if k < n { 1.8 } else { 8.0 };
                omega += (3.0 - 0.01 * omega - load) / 0.02 * t;
            }
            assert!((state.torque_nm - 8.0f64).abs() < 0.05, "{state:?}");
        }
    }
}
