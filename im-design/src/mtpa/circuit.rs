//! The air-gap side of the steady-state circuit.
//!
//! ```text
//! Z_ag/ω_e = 1/(−jΓ_m(λ_m) + Y_ag),   Y_ag = ω_s/(jω_s L_lr + 1/Y_r(jω_s)) = G − jB              (24)
//! λ̃ = (Z_ag/jω_e) I_s,   λ_m = √2|λ̃|,   T_e = 3n_p Im(λ̃* I_s)                          (22), (23), (25)
//! ```
//!
//! ω_e cancels. Taken over (λ_m, ω_s) instead of (I_s, ω_s) nothing needs to be solved:
//! T = (3/2)n_p λ_m² G and 2I_s² = λ_m²(G² + (Γ_m + B)²).

use super::t_circuit::TCircuit;
use crate::exact::Interval;
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// The magnetizing branch and the rotor, seen from the air gap.
pub trait AirGap {
    /// Rms stator current (A) and torque (N m) at a level and a slip frequency (electrical rad/s, positive). The level, in which both
    /// are explicit, is the peak air-gap flux linkage (Wb) of the q-d model and x (A, peak) of the T circuit ([`t_circuit`](super::t_circuit)).
    fn operate(&self, level: f64, slip_rad_s: f64) -> (f64, f64);

    /// The levels that are searched, positive, ascending.
    fn levels(&self) -> [f64; 2];

    /// Peak air-gap flux linkage, Wb.
    fn flux_vs(&self, level: f64, slip_rad_s: f64) -> f64;

    /// The same at all points of two coordinates of the circuit's own: ranges that contain them.
    fn enclose(&self, cell: [Interval; 2]) -> Enclosure;

    /// The coordinates that hold every point of currents up to one (rms, A). The q-d model, made for small slips, is looked at
    /// up to a slip (rad/s) only.
    fn coordinates(&self, current_rms_a: f64, slip_rad_s: f64) -> [Interval; 2];

    /// The coordinates of one operating point.
    fn coordinates_of(&self, level: f64, slip_rad_s: f64) -> [f64; 2];
}

/// What all operating points of a cell lie in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Enclosure {
    /// Rms stator current, A.
    pub current_rms_a: Interval,
    /// Torque, N m.
    pub torque_n_m: Interval,
    /// Slip, electrical rad/s.
    pub slip_rad_s: Interval,
}

/// Air-gap fluxes that the q-d model is looked at up to, Wb; its exponential saturation takes thousands of amperes long before.
const FLUX_MAX: f64 = 8.0;

/// The alternative q-d model of Kwon and Sudhoff.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Aqdm {
    /// l_r1 … l_r4: L_lr = l_r1 + l_r2/(1 + l_r3 λ^l_r4).
    pub rotor_leakage: [f64; 4],
    /// m₁ … m₆: Γ_m = m₁ − m₂λ + exp(m₃(λ − m₄)) + exp(m₅(λ − m₆)).
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

    fn inverse_magnetizing(&self, flux_vs: f64) -> f64 {
        let [m1, m2, m3, m4, m5, m6] = self.magnetizing;
        m1 - m2 * flux_vs + (m3 * (flux_vs - m4)).exp() + (m5 * (flux_vs - m6)).exp()
    }

    fn rotor_leakage_h(&self, flux_vs: f64) -> f64 {
        let [l1, l2, l3, l4] = self.rotor_leakage;
        l1 + l2 / (1.0 + l3 * flux_vs.powf(l4))
    }

    fn rotor_admittance(&self, slip_rad_s: f64) -> Complex64 {
        self.rotor.iter().map(|[y, tau]| y / Complex64::new(1.0, tau * slip_rad_s)).sum()
    }
}

impl AirGap for Aqdm {
    fn operate(&self, flux_vs: f64, slip_rad_s: f64) -> (f64, f64) {
        let j = Complex64::i();
        let rotor = j * slip_rad_s * self.rotor_leakage_h(flux_vs) + self.rotor_admittance(slip_rad_s).inv();
        let y = -j * self.inverse_magnetizing(flux_vs) + slip_rad_s / rotor;
        (flux_vs / std::f64::consts::SQRT_2 * y.norm(), 1.5 * f64::from(self.pole_pairs) * flux_vs * flux_vs * y.re)
    }

    fn levels(&self) -> [f64; 2] {
        [1e-7, 50.0]
    }

    fn flux_vs(&self, level: f64, _slip_rad_s: f64) -> f64 {
        level
    }

    /// Coordinates: flux and slip themselves.
    fn enclose(&self, [flux, slip]: [Interval; 2]) -> Enclosure {
        let p = Interval::point;
        let [m1, m2, m3, m4, m5, m6] = self.magnetizing.map(p);
        let gamma = m1 - m2 * flux + (m3 * (flux - m4)).exp() + (m5 * (flux - m6)).exp();
        let [l1, l2, l3, l4] = self.rotor_leakage;
        let leakage = p(l1) + p(l2).over(p(1.0) + p(l3) * flux.power(l4));
        // Y_r = a − jb.
        let (mut a, mut b) = (p(0.0), p(0.0));
        for [y, tau] in self.rotor.map(|branch| branch.map(p)) {
            let w = tau * slip;
            a = a + y.over(p(1.0) + w.squared());
            b = b + (y * w).over(p(1.0) + w.squared());
        }
        // Y_ag = ω(a − jb)/((1 + ωLb) + jωLa): G = ωa/D, B = ω(b + ωL(a² + b²))/D.
        let x = slip * leakage;
        let d = (p(1.0) + x * b).squared() + (x * a).squared();
        let conductance = (slip * a).over(d);
        let susceptance = (slip * (b + x * (a.squared() + b.squared()))).over(d);
        let current = (conductance.squared() + (gamma + susceptance).squared()).root() * flux;
        let torque = p(1.5 * f64::from(self.pole_pairs)) * flux.squared() * conductance;
        Enclosure { current_rms_a: current.over(p(2.0).root()), torque_n_m: torque, slip_rad_s: slip }
    }

    fn coordinates(&self, _current_rms_a: f64, slip_rad_s: f64) -> [Interval; 2] {
        [Interval::new(0.0, FLUX_MAX), Interval::new(0.0, slip_rad_s)]
    }

    fn coordinates_of(&self, flux_vs: f64, slip_rad_s: f64) -> [f64; 2] {
        [flux_vs, slip_rad_s]
    }
}

/// A steady-state circuit that a certificate can hold.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Circuit {
    /// The T circuit with its saturations.
    T(TCircuit),
    /// The alternative q-d model.
    Aqdm(Aqdm),
}

impl AirGap for Circuit {
    fn operate(&self, level: f64, slip_rad_s: f64) -> (f64, f64) {
        match self {
            Circuit::T(c) => c.operate(level, slip_rad_s),
            Circuit::Aqdm(c) => c.operate(level, slip_rad_s),
        }
    }

    fn levels(&self) -> [f64; 2] {
        match self {
            Circuit::T(c) => c.levels(),
            Circuit::Aqdm(c) => c.levels(),
        }
    }

    fn flux_vs(&self, level: f64, slip_rad_s: f64) -> f64 {
        match self {
            Circuit::T(c) => c.flux_vs(level, slip_rad_s),
            Circuit::Aqdm(c) => c.flux_vs(level, slip_rad_s),
        }
    }

    fn enclose(&self, cell: [Interval; 2]) -> Enclosure {
        match self {
            Circuit::T(c) => c.enclose(cell),
            Circuit::Aqdm(c) => c.enclose(cell),
        }
    }

    fn coordinates(&self, current_rms_a: f64, slip_rad_s: f64) -> [Interval; 2] {
        match self {
            Circuit::T(c) => c.coordinates(current_rms_a, slip_rad_s),
            Circuit::Aqdm(c) => c.coordinates(current_rms_a, slip_rad_s),
        }
    }

    fn coordinates_of(&self, level: f64, slip_rad_s: f64) -> [f64; 2] {
        match self {
            Circuit::T(c) => c.coordinates_of(level, slip_rad_s),
            Circuit::Aqdm(c) => c.coordinates_of(level, slip_rad_s),
        }
    }
}

impl Circuit {
    /// What is out of range, if anything is.
    pub(super) fn complaint(&self) -> Option<String> {
        match self {
            Circuit::T(c) => c.complaint(),
            Circuit::Aqdm(c) => {
                let leakage = c.rotor_leakage.iter().all(|x| *x >= 0.0) && c.rotor_leakage[3] > 0.0;
                let rotor = c.rotor.iter().flatten().all(|x| *x >= 0.0) && c.rotor.iter().any(|[y, _]| *y > 0.0);
                let good = leakage && rotor && c.pole_pairs > 0 && c.magnetizing.iter().all(|x| x.is_finite());
                (!good).then(|| "the q-d circuit needs leakages and rotor branches that are not negative".into())
            }
        }
    }

    /// n_p.
    pub fn pole_pairs(&self) -> u32 {
        match self {
            Circuit::T(c) => c.pole_pairs,
            Circuit::Aqdm(c) => c.pole_pairs,
        }
    }
}
