//! The equations in a rotating frame and in the stator's describe one motion.

use im_model::space_vector::unit;
use im_model::{EffectId, Plant, PlantInput, State};
use proptest::prelude::*;

use crate::lab;

fn sum(x: &State<f64>, r: &State<f64>, h: f64) -> State<f64> {
    let mut out = State {
        psi_s: x.psi_s + r.psi_s * h,
        psi_r: x.psi_r + r.psi_r * h,
        omega_m: x.omega_m + r.omega_m * h,
        theta_m: x.theta_m + r.theta_m * h,
        ..*x
    };
    let mut rates = r.extra.values();
    out.extra.each_mut(|_, _, state| state.iter_mut().zip(&mut rates).for_each(|(x, r)| *x += r * h));
    out
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    #[test]
    fn stationary_and_rotating_frames_agree(omega_k in -700.0..700.0f64, on in prop::collection::vec(any::<bool>(), EffectId::ALL.len()), tau in -10.0..10.0f64) {
        let m = lab::machine(|e| {
            for (&id, on) in EffectId::ALL.iter().zip(on) {
                if on {
                    lab::set_typical(e, id, 0.5);
                }
            }
        });
        let plant = Plant::new(&m);
        let u = unit(0.4) * 200.0;
        let input = PlantInput::new(u, tau);
        let h = 0.02 / plant.fastest_rate().max(2000.0);
        let steps = (5e-3 / h).ceil() as u32;
        let (mut still, mut turning) = (State::default(), State::default());
        for k in 0..steps {
            still = plant.step(&still, &input, h);
            let rates = |x: &State<f64>, at: f64| {
                let theta = omega_k * at;
                plant.rates_in_frame(x, &PlantInput { u_s: u * unit(-theta), ..input }, theta, omega_k)
            };
            let (t, x) = (f64::from(k) * h, turning);
            let k1 = rates(&x, t);
            let k2 = rates(&sum(&x, &k1, 0.5 * h), t + 0.5 * h);
            let k3 = rates(&sum(&x, &k2, 0.5 * h), t + 0.5 * h);
            let k4 = rates(&sum(&x, &k3, h), t + h);
            turning = sum(&sum(&sum(&sum(&x, &k1, h / 6.0), &k2, h / 3.0), &k3, h / 3.0), &k4, h / 6.0);
        }
        let back = turning.in_frame(-omega_k * f64::from(steps) * h);
        // Both are right to (λh)⁴/120 with λh = 0.02: 1e-9; kinks of dead time and friction allow for ten times that.
        prop_assert!((back.psi_s - still.psi_s).norm() < 1e-8 && (back.psi_r - still.psi_r).norm() < 1e-8);
        prop_assert!((back.omega_m - still.omega_m).abs() < 1e-6);
        for (a, b) in back.extra.values().zip(still.extra.values()) {
            prop_assert!((a - b).abs() < 1e-6, "{a} {b}");
        }
    }
}
