//! The air-gap side of the steady-state circuit.
//!
//! ```text
//! Z_ag/ω_e = 1/(−jΓ_m(λ_m) + Y_ag),   Y_ag = ω_s/(jω_s L_lr + 1/Y_r(jω_s)) = G − jB              (24)
//! λ̃ = (Z_ag/jω_e) I_s,   λ_m = √2|λ̃|,   T_e = 3n_p Im(λ̃* I_s)                          (22), (23), (25)
//! ```
//!
//! ω_e cancels. Taken over (λ_m, ω_s) instead of (I_s, ω_s) nothing needs to be solved:
//! T = (3/2)n_p λ_m² G and 2I_s² = λ_m²(G² + (Γ_m + B)²).

use super::air_gap::{AirGap, Enclosure};
use super::t_circuit::TCircuit;
use crate::exact::{Field, Interval};
use crate::machine::Constants;
use im_model::Machine;
use im_model::machines::KWON_TABLE_V;
use num_complex::Complex64;
use serde::{Deserialize, Serialize};

/// Air-gap flux beyond which no bound on the flux is looked for, Wb: no machine has it.
const FLUX_MAX: f64 = 1e6;

/// Slip from which on the q-d model is enclosed in 1/ω_s, electrical rad/s: up to infinity.
const FAST: f64 = 1e3;

/// The time constant of a branch that is a resistance, s.
const INSTANT_S: f64 = 1e-12;

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
        Self::from(&KWON_TABLE_V)
    }

    /// The circuit of a machine whose air gap saturates iron and rotor leakage; `None` for others. Bars that the current diffuses into
    /// (`rotor_skin_effect`) are a resistance and a branch: 1/(R + kRτs/(1 + τs)) = (1/R)(1 + k/(1 + (1 + k)τs))/(1 + k).
    pub fn of(machine: &Machine<f64>) -> Option<Self> {
        let (p, gap, skin) = (machine.parameters(), machine.air_gap()?, &machine.effects().rotor_skin_effect);
        let (k, conductance) = (skin.resistance_rise, 1.0 / p.rotor_resistance_ohm);
        // Of the T circuit what the flux does not change: m₁, l_r1 and the leakage in series.
        let m1 = gap.inverse_magnetizing(p, 0.0).0 - gap.inverse_magnetizing_at_zero();
        let ([l2, l3, l4], [m2, m3, m4, m5, m6]) = (gap.rotor_leakage, gap.magnetizing);
        let bars = (1.0 + k) * skin.time_constant_s;
        Some(Self {
            rotor_leakage: [gap.leakage(p, 0.0).0 - l2, l2, l3, l4],
            magnetizing: [m1, m2, m3, m4, m5, m6],
            rotor: [[conductance * k / (1.0 + k), bars], [conductance / (1.0 + k), INSTANT_S], [0.0, INSTANT_S]],
            pole_pairs: machine.pole_pairs(),
        })
    }

    fn inverse_magnetizing(&self, flux_vs: f64) -> f64 {
        let [m1, m2, m3, m4, m5, m6] = self.magnetizing;
        m1 - m2 * flux_vs + (m3 * (flux_vs - m4)).exp() + (m5 * (flux_vs - m6)).exp()
    }

    fn enclose_magnetizing(&self, flux: Interval) -> Interval {
        let [m1, m2, m3, m4, m5, m6] = self.magnetizing.map(Interval::point);
        m1 - m2 * flux + (m3 * (flux - m4)).exp() + (m5 * (flux - m6)).exp()
    }

    fn rotor_leakage_h(&self, flux_vs: f64) -> f64 {
        let [l1, l2, l3, l4] = self.rotor_leakage;
        l1 + l2 / (1.0 + l3 * flux_vs.powf(l4))
    }

    fn rotor_admittance(&self, slip_rad_s: f64) -> Complex64 {
        self.rotor.iter().map(|[y, tau]| y / Complex64::new(1.0, tau * slip_rad_s)).sum()
    }
}

impl From<&im_model::aqdm::Aqdm> for Aqdm {
    fn from(table: &im_model::aqdm::Aqdm) -> Self {
        let im_model::aqdm::Aqdm { rotor_leakage, magnetizing, rotor, pole_pairs, .. } = *table;
        Self { rotor_leakage, magnetizing, rotor, pole_pairs }
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

    /// Coordinates: flux and slip themselves, the slip up to infinity.
    fn enclose(&self, [flux, slip]: [Interval; 2]) -> Enclosure {
        let p = Interval::point;
        let gamma = self.enclose_magnetizing(flux);
        let [l1, l2, l3, l4] = self.rotor_leakage;
        let leakage = p(l1) + p(l2).over(p(1.0) + p(l3) * flux.power(l4));
        // Y_r = a − jb, times ω; for large ω in s = 1/ω, so that no end is infinite.
        let (mut wa, mut wb) = (p(0.0), p(0.0));
        let s = p(1.0).over(slip).not_negative();
        for [y, tau] in self.rotor.map(|branch| branch.map(p)) {
            let (real, imaginary) = if slip.low >= FAST {
                let d = s.squared() + tau.squared();
                ((y * s).over(d), (y * tau).over(d))
            } else {
                let w = tau * slip;
                let d = p(1.0) + w.squared();
                ((y * slip).over(d), (y * w * slip).over(d))
            };
            wa = wa + real.not_negative();
            wb = wb + imaginary.not_negative();
        }
        // Y_ag = ω(a − jb)/((1 + ωLb) + jωLa): G = ωa/D, B = (ωb + L(ω²a² + ω²b²))/D.
        let turn = p(1.0) + leakage * wb;
        let d = turn.squared() + (leakage * wa).squared();
        // Whatever a is, G ≤ 1/(2L(1 + ωLb)).
        let top = p(1.0).over(p(2.0) * leakage * turn).high;
        let mut conductance = wa.over(d).not_negative();
        conductance.high = conductance.high.min(top);
        let susceptance = (wb + leakage * (wa.squared() + wb.squared())).over(d).not_negative();
        let current = (conductance.squared() + (gamma + susceptance).squared()).root() * flux;
        let torque = p(1.5 * f64::from(self.pole_pairs)) * flux.squared() * conductance;
        Enclosure { current_rms_a: current.over(p(2.0).root()), torque_n_m: torque, slip_rad_s: slip }
    }

    /// √2 I_s ≥ λΓ_m(λ), and Γ_m is convex: from a flux on where it is positive and rises, and takes more than the current, all fluxes do.
    fn coordinates(&self, current_rms_a: f64) -> Option<[Interval; 2]> {
        let p = Interval::point;
        let [_, m2, m3, m4, m5, m6] = self.magnetizing.map(p);
        let beyond = |flux: f64| {
            let slope = m3 * (m3 * (p(flux) - m4)).exp() + m5 * (m5 * (p(flux) - m6)).exp() - m2;
            let current = (p(flux) * self.enclose_magnetizing(p(flux))).over(p(2.0).root());
            slope.low >= 0.0 && current.low > current_rms_a
        };
        let mut flux = 1.0;
        while !beyond(flux) {
            flux *= 1.25;
            if flux > FLUX_MAX {
                return None;
            }
        }
        Some([Interval::new(0.0, flux), Interval::new(0.0, f64::INFINITY)])
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

    fn coordinates(&self, current_rms_a: f64) -> Option<[Interval; 2]> {
        match self {
            Circuit::T(c) => c.coordinates(current_rms_a),
            Circuit::Aqdm(c) => c.coordinates(current_rms_a),
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
    /// The circuit of a machine: its own air gap's, or the T circuit with its saturations.
    pub fn of(machine: &Machine<f64>) -> Self {
        Aqdm::of(machine).map_or_else(|| Self::T(TCircuit::from(machine)), Self::Aqdm)
    }

    /// What is out of range, if anything is.
    pub(super) fn complaint(&self) -> Option<String> {
        match self {
            Circuit::T(c) => c.complaint(),
            Circuit::Aqdm(c) => {
                let finite = |x: &f64| x.is_finite();
                let leakage = c.rotor_leakage.iter().all(|x| finite(x) && *x >= 0.0);
                let leakage = leakage && c.rotor_leakage[3] > 0.0 && c.rotor_leakage[0] + c.rotor_leakage[1] > 0.0;
                let branch = |[y, tau]: &[f64; 2]| finite(y) && finite(tau) && *y >= 0.0 && (*y == 0.0 || *tau > 0.0);
                let rotor = c.rotor.iter().all(branch) && c.rotor.iter().any(|[y, _]| *y > 0.0);
                let good = leakage && rotor && c.pole_pairs > 0 && c.magnetizing.iter().all(finite);
                let what =
                    "the q-d circuit needs leakages, and rotor branches with time constants, that are finite and not negative";
                (!good).then(|| what.into())
            }
        }
    }

    /// Which of its parameters are not those of a machine, if any are; of the q-d model only the pole pairs are compared.
    pub(super) fn foreign<F: Field>(&self, c: &Constants<F>) -> Option<&'static str> {
        if F::from_f64(f64::from(self.pole_pairs())) != c.n_p {
            return Some("pole_pairs");
        }
        let Circuit::T(own) = self else { return None };
        // L_m = ηL_m/η, L_m/L_r = βσL_s, R_r = ηL_r.
        let l_m = c.eta_l_m.clone() / c.eta.clone();
        let l_r = l_m.clone() * c.inverse_sigma_l_s.clone() / c.beta.clone();
        let r_r = c.eta.clone() * l_r.clone();
        let rounding = F::from_f64(1e-12);
        let differs = |own: f64, machine: F, size: &F| {
            let off = F::from_f64(own) - machine;
            let off = if off < F::zero() { -off } else { off };
            off > rounding.clone() * size.clone()
        };
        if differs(own.magnetizing_inductance_h, l_m.clone(), &l_m) {
            return Some("magnetizing_inductance_h");
        }
        if differs(own.rotor_leakage_inductance_h, l_r.clone() - l_m, &l_r) {
            return Some("rotor_leakage_inductance_h");
        }
        differs(own.rotor_resistance_ohm, r_r.clone(), &r_r).then_some("rotor_resistance_ohm")
    }

    /// n_p.
    pub fn pole_pairs(&self) -> u32 {
        match self {
            Circuit::T(c) => c.pole_pairs,
            Circuit::Aqdm(c) => c.pole_pairs,
        }
    }
}
