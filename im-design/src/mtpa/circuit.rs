//! The air-gap side of the steady-state circuit.
//!
//! ```text
//! Z_ag/ω_e = 1/(−jΓ_m(λ_m) + ω_s/(jω_s L_lr(λ_m) + 1/Y_r(jω_s)))                           (24)
//! λ̃ = (Z_ag/jω_e) I_s,   λ_m = √2|λ̃|,   T_e = 3n_p Im(λ̃* I_s)                       (22), (23), (25)
//! ```
//!
//! ω_e cancels. Taken over (λ_m, ω_s) instead of (I_s, ω_s) nothing needs to be solved: I_s = λ_m/(√2|Z_ag/ω_e|).

use num_complex::Complex64;

/// The magnetizing branch and the rotor, seen from the air gap.
pub trait AirGap {
    /// Γ_m, inverse magnetizing inductance at peak air-gap flux linkage λ_m, 1/H.
    fn inverse_magnetizing(&self, flux_wb: f64) -> f64;
    /// L_lr at λ_m, H.
    fn rotor_leakage_h(&self, flux_wb: f64) -> f64;
    /// Y_r(jω), rotor admittance at slip frequency, S.
    fn rotor_admittance(&self, slip_rad_per_s: f64) -> Complex64;
    /// n_p.
    fn pole_pairs(&self) -> f64;

    /// Rms stator current and torque at peak air-gap flux linkage and slip frequency (electrical rad/s, positive).
    fn operate(&self, flux_wb: f64, slip_rad_per_s: f64) -> (f64, f64) {
        let j = Complex64::i();
        let rotor = j * slip_rad_per_s * self.rotor_leakage_h(flux_wb) + self.rotor_admittance(slip_rad_per_s).inv();
        let z = (-j * self.inverse_magnetizing(flux_wb) + slip_rad_per_s / rotor).inv();
        let current = flux_wb / (std::f64::consts::SQRT_2 * z.norm());
        (current, 3.0 * self.pole_pairs() * current * current * (z / j).conj().im)
    }
}

/// The alternative q-d model of Kwon and Sudhoff.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aqdm {
    /// l_r1 … l_r4.
    pub rotor_leakage: [f64; 4],
    /// m₁ … m₆.
    pub magnetizing: [f64; 6],
    /// (y_a, y_τ) of each rotor branch: S and s.
    pub rotor: [[f64; 2]; 3],
    /// n_p.
    pub pole_pairs: u32,
}

impl Aqdm {
    /// Table V: the 50-hp machine of Kwon et al.
    pub fn kwon_table_v() -> Self {
        Aqdm {
            rotor_leakage: [1.40e-4, 4.15e-3, 7.35e-1, 2.59],
            magnetizing: [6.79, 6.62e-1, 5.03, 1.85, 8.68e-1, 1.29e-1],
            rotor: [[5.65, 3.21e-2], [4.40e-2, 4.78e-4], [3.17e-3, 8.76e-8]],
            pole_pairs: 2,
        }
    }
}

impl AirGap for Aqdm {
    fn inverse_magnetizing(&self, flux_wb: f64) -> f64 {
        let [m1, m2, m3, m4, m5, m6] = self.magnetizing;
        m1 - m2 * flux_wb + (m3 * (flux_wb - m4)).exp() + (m5 * (flux_wb - m6)).exp()
    }

    fn rotor_leakage_h(&self, flux_wb: f64) -> f64 {
        let [l1, l2, l3, l4] = self.rotor_leakage;
        l1 + l2 / (1.0 + l3 * flux_wb.powf(l4))
    }

    fn rotor_admittance(&self, slip_rad_per_s: f64) -> Complex64 {
        self.rotor.iter().map(|[y, tau]| y / Complex64::new(1.0, tau * slip_rad_per_s)).sum()
    }

    fn pole_pairs(&self) -> f64 {
        f64::from(self.pole_pairs)
    }
}

/// A T circuit with any magnetizing curve and one rotor branch.
pub struct TCircuit<G> {
    /// Γ_m as a function of peak air-gap flux linkage, 1/H; constant 1/L_m when linear.
    pub inverse_magnetizing: G,
    /// L_lr, H.
    pub rotor_leakage_h: f64,
    /// R_r, Ω.
    pub rotor_resistance_ohm: f64,
    /// n_p.
    pub pole_pairs: u32,
}

/// The T circuit of a machine model with its main-flux saturation, as a refined `motor.toml` holds it.
pub fn of_machine(machine: &im_model::Machine<f64>) -> TCircuit<impl Fn(f64) -> f64 + use<>> {
    let t = *machine.parameters();
    let s = machine.effects().main_flux_saturation;
    TCircuit {
        inverse_magnetizing: move |flux: f64| {
            let extra = s.excess * (flux / s.reference_flux_vs).powf(s.exponent);
            (1.0 + extra) / t.magnetizing_inductance_h
        },
        rotor_leakage_h: t.rotor_leakage_inductance_h,
        rotor_resistance_ohm: t.rotor_resistance_ohm,
        pole_pairs: machine.pole_pairs(),
    }
}

impl<G: Fn(f64) -> f64> AirGap for TCircuit<G> {
    fn inverse_magnetizing(&self, flux_wb: f64) -> f64 {
        (self.inverse_magnetizing)(flux_wb)
    }

    fn rotor_leakage_h(&self, _flux_wb: f64) -> f64 {
        self.rotor_leakage_h
    }

    fn rotor_admittance(&self, _slip_rad_per_s: f64) -> Complex64 {
        Complex64::new(1.0 / self.rotor_resistance_ohm, 0.0)
    }

    fn pole_pairs(&self) -> f64 {
        f64::from(self.pole_pairs)
    }
}
