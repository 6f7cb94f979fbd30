//! The T circuit of `im-model` in steady state, with saturation of the magnetizing branch and the leakages and with deep bars.
//!
//! Over the rotor leakage current x = |ψ_σ|/L_lr that would flow unsaturated, and the slip ω_s, everything is explicit. With
//! −i_r along the first axis and r = |i_r|, from 0 = R_r i_r + kR_r(i_r − z) + jω_s ψ_r, z = i_r/(1 + jω_s τ):
//!
//! ```text
//! r   = x(1 + κq/(1 + q)),  q = (x/I_k)²                                       leakage saturation
//! R/ω = R_r/ω_s + kR_r τ·ω_s τ/(1 + ω_s²τ²),  L_x = kR_r τ/(1 + ω_s²τ²)        deep bars
//! ψ_m = (L_lr x + L_x r,  r R/ω),   i_s = Γ_m(|ψ_m|) ψ_m + (r, 0),   Γ_m = (1 + k_m(|ψ_m|/ψ_N)^S)/L_m
//! T   = (3/2)n_p r² R/ω
//! ```
//!
//! The stator's own leakage and resistance take voltage but change neither current nor torque. Iron loss is left out: it makes
//! the least current depend on speed.

use super::air_gap::{AirGap, Enclosure};
use crate::exact::Interval;
use im_model::EffectId;
use serde::{Deserialize, Serialize};

/// Parameters as in `motor.toml`; an effect that is off has strength zero.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TCircuit {
    /// n_p.
    pub pole_pairs: u32,
    /// R_r, Ω.
    pub rotor_resistance_ohm: f64,
    /// L_lr, H.
    pub rotor_leakage_inductance_h: f64,
    /// L_m unsaturated, H.
    pub magnetizing_inductance_h: f64,
    /// k_m and S at ψ_N (Vs): main-flux saturation.
    pub main_saturation: [f64; 3],
    /// κ and I_k (A): leakage-flux saturation.
    pub leakage_saturation: [f64; 2],
    /// k and τ (s): rotor skin effect.
    pub skin_effect: [f64; 2],
}

impl TCircuit {
    /// The effects of a machine model that the circuit has.
    pub const EFFECTS: [EffectId; 3] = [EffectId::MainFluxSaturation, EffectId::LeakageFluxSaturation, EffectId::RotorSkinEffect];

    /// Without saturation.
    pub fn linear(rotor_resistance_ohm: f64, rotor_leakage_h: f64, magnetizing_h: f64, pole_pairs: u32) -> Self {
        TCircuit {
            pole_pairs,
            rotor_resistance_ohm,
            rotor_leakage_inductance_h: rotor_leakage_h,
            magnetizing_inductance_h: magnetizing_h,
            main_saturation: [0.0, 1.0, 1.0],
            leakage_saturation: [0.0, 1.0],
            skin_effect: [0.0, 1e-3],
        }
    }

    /// The parameters that an unsaturated machine does not have, by name.
    pub(crate) fn effects(&self) -> Vec<(String, f64)> {
        let named = [
            ("main_flux_saturation", self.main_saturation.as_slice()),
            ("leakage_flux_saturation", &self.leakage_saturation),
            ("rotor_skin_effect", &self.skin_effect),
        ];
        let strength = |(name, x): (&str, &[f64])| (format!("strength of {name}"), x[0]);
        let size = |(name, x): (&str, &[f64])| {
            // What switches an effect of strength zero off has no size.
            let on = x[0] != 0.0;
            x[1..].iter().map(|x| (format!("parameter of {name}"), if on { *x } else { 0.0 })).collect::<Vec<_>>()
        };
        named.into_iter().flat_map(|part| [vec![strength(part)], size(part)].concat()).collect()
    }

    /// Every number must be finite and in its physical range.
    pub(super) fn complaint(&self) -> Option<String> {
        let [k_m, s, psi] = self.main_saturation;
        let [kappa, knee] = self.leakage_saturation;
        let [k, tau] = self.skin_effect;
        let positive = [
            ("rotor_resistance_ohm", self.rotor_resistance_ohm),
            ("rotor_leakage_inductance_h", self.rotor_leakage_inductance_h),
            ("magnetizing_inductance_h", self.magnetizing_inductance_h),
            ("exponent of main_saturation", s),
            ("flux of main_saturation", psi),
            ("knee of leakage_saturation", knee),
            ("time constant of skin_effect", tau),
            ("pole_pairs", f64::from(self.pole_pairs)),
        ];
        let strengths = [("main_saturation", k_m), ("leakage_saturation", kappa), ("skin_effect", k)];
        let bad = positive.iter().find(|(_, x)| !(*x > 0.0 && x.is_finite()));
        let bad = bad.or_else(|| strengths.iter().find(|(_, x)| !(*x >= 0.0 && x.is_finite())));
        bad.map(|(name, x)| format!("{name} = {x} is out of range"))
    }

    /// (ψ_md, ψ_mq, r, R/ω) at leakage current x and slip.
    fn rotor(&self, x: f64, slip: f64) -> [f64; 4] {
        let [kappa, knee] = self.leakage_saturation;
        let [k, tau] = self.skin_effect;
        let q = (x / knee).powi(2);
        let r = x * (1.0 + kappa * q / (1.0 + q));
        let wt = slip * tau;
        let bars = k * self.rotor_resistance_ohm * tau / (1.0 + wt * wt);
        let per_slip = self.rotor_resistance_ohm / slip + bars * wt;
        [self.rotor_leakage_inductance_h * x + bars * r, r * per_slip, r, per_slip]
    }
}

impl From<&im_model::Machine<f64>> for TCircuit {
    /// The circuit of a machine model, as a refined `motor.toml` holds it.
    fn from(machine: &im_model::Machine<f64>) -> Self {
        let (p, e) = (machine.parameters(), machine.effects());
        let (main, leakage, skin) = (&e.main_flux_saturation, &e.leakage_flux_saturation, &e.rotor_skin_effect);
        TCircuit {
            pole_pairs: machine.pole_pairs(),
            rotor_resistance_ohm: p.rotor_resistance_ohm,
            rotor_leakage_inductance_h: p.rotor_leakage_inductance_h,
            magnetizing_inductance_h: p.magnetizing_inductance_h,
            main_saturation: [main.excess, main.exponent, main.reference_flux_vs],
            leakage_saturation: [leakage.drop, leakage.knee_current_a],
            skin_effect: [skin.resistance_rise, skin.time_constant_s],
        }
    }
}

impl AirGap for TCircuit {
    fn operate(&self, x: f64, slip_rad_s: f64) -> (f64, f64) {
        let [d, q, r, per_slip] = self.rotor(x, slip_rad_s);
        let [k, s, psi] = self.main_saturation;
        let gamma = (1.0 + k * (d.hypot(q) / psi).powf(s)) / self.magnetizing_inductance_h;
        let current = (gamma * d + r).hypot(gamma * q) / std::f64::consts::SQRT_2;
        (current, 1.5 * f64::from(self.pole_pairs) * r * r * per_slip)
    }

    /// Peak air-gap fluxes from below 10⁻⁷ Wb to above 50 Wb: |ψ_m| is L_lr x at the least, and many times that at small slip.
    fn levels(&self) -> [f64; 2] {
        [1e-12, 50.0].map(|flux| flux / self.rotor_leakage_inductance_h)
    }

    fn flux_vs(&self, x: f64, slip_rad_s: f64) -> f64 {
        let [d, q, ..] = self.rotor(x, slip_rad_s);
        d.hypot(q)
    }

    /// Coordinates: x and ψ_q = r R/ω, so that T = (3/2)n_p r ψ_q and nothing is large at any slip.
    fn enclose(&self, [x, psi_q]: [Interval; 2]) -> Enclosure {
        let p = Interval::point;
        let one = p(1.0);
        // q/(1 + q) is monotone: written with the variable once, the enclosure is the range.
        let mut r = x;
        if self.leakage_saturation[0] != 0.0 {
            let [kappa, knee] = self.leakage_saturation.map(p);
            r = x * (one + kappa * (one - one.over(one + x.over(knee).squared())));
        }
        // ω = R_r(1 + k s) r/ψ_q, s = ω²τ²/(1 + ω²τ²) between 0 and 1, and better known each time round.
        let [k, tau] = self.skin_effect.map(p);
        let ratio = (p(self.rotor_resistance_ohm) * r).over(psi_q).not_negative();
        let mut slip = ratio;
        let mut psi_d = p(self.rotor_leakage_inductance_h) * x;
        if self.skin_effect[0] != 0.0 {
            let mut falling = Interval::new(0.0, 1.0);
            for _ in 0..40 {
                let before = falling;
                slip = ratio * (one + k * (one - falling));
                falling = one.over(one + (slip * tau).squared()).not_negative();
                if falling.low - before.low < 1e-6 && before.high - falling.high < 1e-6 {
                    break;
                }
            }
            psi_d = psi_d + k * p(self.rotor_resistance_ohm) * tau * falling * r;
        }
        let mut gamma = one;
        if self.main_saturation[0] != 0.0 {
            let [k, s, psi] = self.main_saturation;
            let flux = (psi_d.squared() + psi_q.squared()).root().over(p(psi)).not_negative();
            gamma = one + p(k) * flux.power(s);
        }
        let gamma = gamma.over(p(self.magnetizing_inductance_h));
        let current = ((gamma * psi_d + r).squared() + (gamma * psi_q).squared()).root().over(p(2.0).root());
        let torque = p(1.5 * f64::from(self.pole_pairs)) * r * psi_q;
        Enclosure { current_rms_a: current, torque_n_m: torque, slip_rad_s: slip }
    }

    /// x ≤ r ≤ |i_s| and ψ_q ≤ L_m |i_s|: magnetizing and rotor currents add along the first axis.
    fn coordinates(&self, current_rms_a: f64) -> Option<[Interval; 2]> {
        let peak = 1.5 * current_rms_a;
        Some([Interval::new(0.0, peak), Interval::new(0.0, self.magnetizing_inductance_h * peak)])
    }

    fn coordinates_of(&self, x: f64, slip_rad_s: f64) -> [f64; 2] {
        [x, self.rotor(x, slip_rad_s)[1]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_model::{Effects, Held, steady_state};

    fn machine() -> im_model::Machine<f64> {
        let named = im_model::machines::MOTULATOR_2_2_KW;
        let mut effects = Effects::scaled(&named.rating, &named.parameters(), named.pole_pairs);
        effects.main_flux_saturation.excess = 0.6;
        effects.leakage_flux_saturation.drop = 0.8;
        effects.rotor_skin_effect.resistance_rise = 1.2;
        im_model::Machine::try_new(named.parameters(), named.pole_pairs, effects).unwrap()
    }

    /// The steady state of `im-model`, all three effects on, lies on the circuit.
    #[test]
    fn the_models_own_steady_state_is_an_operating_point() {
        let machine = machine();
        let circuit = TCircuit::from(&machine);
        let plant = im_model::Plant::new(&machine);
        let n_p = f64::from(machine.pole_pairs());
        for (voltage, frequency, speed) in [(330.0, 50.0, 150.0), (250.0, 50.0, 140.0), (330.0, 50.0, 90.0), (60.0, 10.0, 20.0)] {
            let s = steady_state(&machine, voltage, frequency, Held::Speed(speed)).unwrap();
            let slip = 2.0 * std::f64::consts::PI * frequency - n_p * speed;
            let c = plant.currents(&s);
            let torque = 1.5 * n_p * (c.psi_m.conj() * c.i_s).im;
            // L_lr x is the flux of the rotor leakage.
            let x = (s.psi_r - c.psi_m).norm() / circuit.rotor_leakage_inductance_h;
            let (current, found) = circuit.operate(x, slip);
            // The model interpolates saturation on a grid.
            assert!((current * std::f64::consts::SQRT_2 / c.i_s.norm() - 1.0).abs() < 1e-4, "{current} {}", c.i_s.norm());
            assert!((found / torque - 1.0).abs() < 1e-4, "{found} {torque}");
            assert!((circuit.flux_vs(x, slip) / c.psi_m.norm() - 1.0).abs() < 1e-4);
        }
    }

    #[test]
    fn enclosures_contain_the_points_and_shrink_to_them() {
        for circuit in [TCircuit::from(&machine()), TCircuit::linear(0.9, 0.004, 0.156, 2)] {
            for (x, slip) in [(0.4, 2.0), (4.0, 5.0), (30.0, 40.0), (40.0, 300.0)] {
                let (current, torque) = circuit.operate(x, slip);
                let at = circuit.coordinates_of(x, slip);
                for width in [0.1, 1e-3, 1e-7] {
                    let e = circuit.enclose(at.map(|x| Interval::new(x * (1.0 - width), x * (1.0 + width))));
                    for (i, x) in [(e.current_rms_a, current), (e.torque_n_m, torque), (e.slip_rad_s, slip)] {
                        assert!(i.low <= x && x <= i.high, "{x} {i:?}");
                        assert!(i.high - i.low < 60.0 * width * x + 1e-5 * x, "{i:?} at {width}");
                    }
                }
            }
        }
    }
}
