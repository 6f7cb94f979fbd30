//! Equations of the papers that the model must reproduce (docs/background/errata.md names those that are misprinted).

use im_model::machines::{JADOT_TABLE_I, KENNE_APPENDIX_II};
use im_model::space_vector::j;
use im_model::{Complex, Held, Machine, Plant, PlantInput, State, steady_state};
use proptest::prelude::*;

fn state(f: [f64; 4], omega_m: f64) -> State<f64> {
    State { psi_s: Complex::new(f[0], f[1]), psi_r: Complex::new(f[2], f[3]), omega_m, ..State::default() }
}

/// The inductances that Table I prints in mH make the 4-kW machine of the text when read in H.
#[test]
fn jadot_table_i_in_henry_is_a_machine_of_4_kw() {
    let m = JADOT_TABLE_I;
    let machine = Machine::base(m.parameters(), m.pole_pairs).unwrap();
    let x = steady_state(&machine, m.rating.phase_voltage_peak_v, 50.0, Held::Load(26.0)).unwrap();
    assert!((26.0 * x.omega_m - 4000.0).abs() < 80.0, "{} W", 26.0 * x.omega_m);
}

proptest! {
    /// Kenné et al. (27): d²i_s/dt² = f₀ + R_r f₁ at constant speed. The equations are linear in the fluxes, so that the second
    /// derivative is the equation of motion of the first.
    #[test]
    fn kenne_27_is_the_second_derivative_of_the_current(
        f in prop::array::uniform4(-1.0..1.0f64), v in prop::array::uniform4(-300.0..300.0f64), omega_m in -160.0..160.0f64,
    ) {
        let m = KENNE_APPENDIX_II;
        let plant = Plant::new(&Machine::base(m.parameters(), m.pole_pairs).unwrap());
        let (v_s, dv_s) = (Complex::new(v[0], v[1]), Complex::new(v[2], v[3]) * 100.0);
        let x = state(f, omega_m);
        let first = State { omega_m, ..plant.evaluate(&x, &PlantInput::new(v_s, 0.0)).rates };
        let second = plant.evaluate(&first, &PlantInput::new(dv_s, 0.0)).rates;
        let (i_s, di, ddi) = (plant.currents(&x).i_s, plant.currents(&first).i_s, plant.currents(&second).i_s);
        let c = m.windings.kenne(m.pole_pairs);
        let ([beta_1, beta_2, beta_3], [gamma_1, gamma_2, gamma_3, gamma_4]) = (c.beta, c.gamma);
        let f_0 = (dv_s - di * m.windings.stator_resistance_ohm) * gamma_1
            + j(i_s * beta_2 + v_s * beta_3 + di * beta_1) * omega_m;
        let f_1 = v_s * gamma_2 - i_s * gamma_3 - di * gamma_4;
        let expected = f_0 + f_1 * m.windings.rotor_resistance_ohm;
        prop_assert!((ddi - expected).norm() < 1e-9 * (1.0 + dv_s.norm() * gamma_1 + ddi.norm()), "{ddi} {expected}");
    }

    /// Jadot et al. (5) with the four parameters (7), in a frame turning with ω_s.
    #[test]
    fn jadot_5_follows_in_any_frame(
        f in prop::array::uniform4(-1.0..1.0f64), u in -300.0..300.0f64, omega_m in -160.0..160.0f64, omega_s in -400.0..400.0f64,
    ) {
        let m = JADOT_TABLE_I;
        let p = m.parameters();
        let plant = Plant::new(&Machine::base(p, m.pole_pairs).unwrap());
        let (x, u_s) = (state(f, omega_m), Complex::new(u, 0.4 * u));
        let rates = plant.rates_in_frame(&x, &PlantInput::new(u_s, 0.0), 0.0, omega_s);
        let k = p.magnetizing_inductance_h / p.rotor_inductance_h();
        let four = p.inverse_gamma();
        let (r_req, l_f, inv_t_r) = (four.rotor_resistance_ohm, four.leakage_inductance_h, four.inverse_rotor_time_constant());
        let (i_s, phi_r, omega_r) = (plant.currents(&x).i_s, x.psi_r * k, 2.0 * omega_m);
        let d_phi = -phi_r * Complex::new(inv_t_r, omega_s - omega_r) + i_s * r_req;
        let d_i = -i_s * Complex::new(p.stator_resistance_ohm + r_req, l_f * omega_s) + phi_r * Complex::new(inv_t_r, -omega_r) + u_s;
        prop_assert!((rates.psi_r * k - d_phi).norm() < 1e-9 * (1.0 + d_phi.norm()));
        prop_assert!((plant.currents(&rates).i_s * l_f - d_i).norm() < 1e-9 * (1.0 + d_i.norm()));
    }
}
