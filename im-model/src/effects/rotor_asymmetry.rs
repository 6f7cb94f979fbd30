//! Rotor asymmetry: broken or cracked bars make the rotor resistance depend on direction in the rotor.
//!
//! In the rotor frame: drop = R_r i_r + R_r (δ_d + j δ_q) ī_r; seen from the stator the mirror turns with e^{j2θ_e}. Where bars are missing
//! the leakage is unequal too: the current crowds into the bars beside, and their slots' and end rings' flux with it. In proportion:
//! κ L_lr (δ_d + j δ_q) ī_r of flux, in series with the cage.

use num_complex::Complex;

use super::{About, Card, Operating, Place, SteadyState, effect};
use crate::error::Bound;
use crate::space_vector::unit;

effect! {
    /// Unequal rotor phase impedances, fixed to the rotor.
    RotorAsymmetry, "rotor_asymmetry",
    about: About { steady_state: SteadyState::Ripples, fixed_to_shaft: true, ..About::at(Place::Windings) },
    card: Card {
        title: "Rotor asymmetry (broken bars)",
        what: "The rotor resistance depends on the direction in the rotor: R_r(δ_d + jδ_q) times the mirrored rotor current, turning with the rotor; and the rotor leakage by κ times as much.",
        shows: "Under load, sidebands at twice the slip frequency around the supply, (1 ± 2s)f, and a torque and speed ripple at 2sf.",
        rivals: &[
            ("load_torque_ripple", "fixed to the shaft angle, there at no load too; broken bars follow the slip and vanish without load"),
            ("stator_asymmetry", "stands still in the stator: backward sequence at −f, whatever the slip"),
        ],
        test: "Steady high load, long enough to resolve twice the slip frequency.",
        place: "rotor winding, turning with the rotor",
        source: "two-axis model of an asymmetric rotor; sidebands (1 ± 2s)f",
    },
    parameters: {
        /// Resistance unbalance along the rotor's direct axis (phase a at angle zero).
        unbalance_direct: Strength, default 0.0, "", One, typical 0.01 to 0.25, Bound::Within(-0.69, 0.69);
        /// Resistance unbalance along the quadrature axis.
        unbalance_quadrature: Strength, default 0.0, "", One, typical 0.01 to 0.25, Bound::Within(-0.69, 0.69);
        /// Unbalance of the leakage over that of the resistance: 0 of a bar cracked at the ring, 1 of a cage that lacks bars.
        leakage_share: Shape, default 0.0, "", One, typical 0.0 to 1.4, Bound::Within(-1.4, 1.4);
    },
    hooks: {
        #[inline(always)]
        fn rotor_drop(&self, drop: Complex<T>, at: &Operating<T>, _own: &[T]) -> Complex<T> {
            let twice = at.state.theta_m().scale(2.0 * at.n_p);
            drop + Complex::new(self.unbalance_direct, self.unbalance_quadrature) * unit(twice) * at.currents.i_r.conj() * at.r_r
        }

        #[inline(always)]
        fn rotor_mirrored_inductance(&self, l: Complex<T>, l_lr: T) -> Complex<T> {
            l + Complex::new(self.unbalance_direct, self.unbalance_quadrature) * (self.leakage_share * l_lr)
        }
    }
}

#[cfg(feature = "std")]
impl super::Drawn for RotorAsymmetry<f64> {
    fn frame(&self, _on: &super::Rated) -> super::Frame {
        super::Frame::new(
            "direction in the rotor, °",
            "rotor resistance, Ω",
            (0.0, 360.0),
            "Rotor resistance by direction in the rotor.",
        )
    }

    fn law(&self, on: &super::Rated, x: f64) -> f64 {
        let (sin, cos) = (2.0 * x.to_radians()).sin_cos();
        on.parameters.rotor_resistance_ohm * (1.0 + self.unbalance_direct * cos + self.unbalance_quadrature * sin)
    }
}

#[cfg(test)]
mod tests {
    use super::super::trying::*;
    use super::*;
    use crate::machines::MOTULATOR_2_2_KW;
    use crate::space_vector::j;

    /// In the rotor the currents I_f at sω and I_b at −sω are coupled by z = (R_r ± jsωκL_lr)(δ_d + jδ_q); the stator answers I_b at
    /// (1 − 2s)ω with its terminals on the grid, which has no voltage there.
    #[test]
    fn sidebands_are_those_of_coupled_circuits() {
        let p = MOTULATOR_2_2_KW.parameters();
        let (omega, slip) = (2.0 * SYNCHRONOUS, 0.04);
        let delta = Complex::new(0.08, -0.05);
        for share in [0.0, 0.6, 1.3, -0.7] {
            let m = machine(|e| {
                (e.rotor_asymmetry.unbalance_direct, e.rotor_asymmetry.unbalance_quadrature) = (delta.re, delta.im);
                e.rotor_asymmetry.leakage_share = share;
            });
            let (r_s, r_r, l_m) = (p.stator_resistance_ohm, p.rotor_resistance_ohm, p.magnetizing_inductance_h);
            let (l_s, l_r) = (l_m + p.stator_leakage_inductance_h, l_m + p.rotor_leakage_inductance_h);
            let (w_r, below) = (slip * omega, (1.0 - 2.0 * slip) * omega);
            let stator = |w: f64| Complex::new(r_s, w * l_s);
            // What the rotor sees at ±sω with the stator behind it: R_r ± jsω L_r − (±jsω L_m)(jw L_m)/Z_s(w).
            let rotor = |w_r: f64, w: f64| Complex::new(r_r, w_r * l_r) + w_r * w * l_m * l_m / stator(w);
            let (z_f, z_b) = (rotor(w_r, omega), rotor(-w_r, below));
            let reactance = delta * (w_r * share * p.rotor_leakage_inductance_h);
            let (ahead, back) = (delta * r_r + j(reactance), delta * r_r - j(reactance));
            // Z_f I_f + z Ī_b = −jsω L_m U/Z_s(ω) and Z_b I_b + z' Ī_f = 0.
            let driven = -j(Complex::from(RATED_V)) * (w_r * l_m) / stator(omega);
            let i_f = driven / (z_f - ahead * back.conj() / z_b.conj());
            let i_b = -back * i_f.conj() / z_b;
            let i_1 = (RATED_V - j(i_f) * (omega * l_m)) / stator(omega);
            let sideband = -j(i_b) * (below * l_m) / stator(below);
            // Half a second holds whole periods of 50 Hz and 46 Hz.
            let shown = running_for(&m, RATED_V, (1.0 - slip) * SYNCHRONOUS, 5000);
            let (f, b) = (current(&shown, 50.0), current(&shown, 46.0));
            assert!((f - i_1).norm() < 1e-3 * i_1.norm(), "share {share}: {f} A, {i_1}");
            // The angle of the shaft is that of the start.
            assert!((b.norm() - sideband.norm()).abs() < 5e-3 * sideband.norm(), "share {share}: {b} A, {sideband}");
        }
    }
}
