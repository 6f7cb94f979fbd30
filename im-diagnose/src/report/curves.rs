//! The law of an effect as a curve, with the uncertainty of the fit.

use std::f64::consts::{PI, TAU};

use im_identify::offline::{Fit, Target};
use im_model::{Complex, EffectId, Machine, ParameterId, Rating};

/// A law drawn.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Curve {
    pub x_label: &'static str,
    pub y_label: &'static str,
    /// Both axes logarithmic.
    pub log: bool,
    /// With the effect.
    pub points: Vec<[f64; 2]>,
    /// 95 % band: x, lower, upper.
    pub band: Vec<[f64; 3]>,
    /// The same machine without it.
    pub without: Vec<[f64; 2]>,
    /// What it shows.
    pub caption: &'static str,
}

const POINTS: usize = 81;

/// What to draw of an effect: labels, range, caption.
struct Frame {
    x_label: &'static str,
    y_label: &'static str,
    range: (f64, f64),
    log: bool,
    caption: &'static str,
}

fn frame(e: EffectId, m: &Machine<f64>, rating: &Rating) -> Option<Frame> {
    let n_p = m.pole_pairs();
    let current = rating.current_peak_a(m.parameters(), n_p);
    let (w, f) = (rating.synchronous_speed_rad_s(n_p), rating.electrical_frequency_hz);
    let x = m.effects();
    let frame = |x_label, y_label, range, caption| Some(Frame { x_label, y_label, range, log: false, caption });
    match e {
        EffectId::MainFluxSaturation => frame(
            "magnetizing flux, Vs",
            "magnetizing current, A",
            (0.0, 1.25 * x.main_flux_saturation.reference_flux_vs),
            "Saturation curve: magnetizing current over flux. Dashed: the same machine unsaturated.",
        ),
        EffectId::LeakageFluxSaturation => frame(
            "winding current (peak), A",
            "stator leakage inductance, mH",
            (0.0, 8.0 * current),
            "Stator leakage inductance (flux over current) over winding current; the rotor's falls by the same law.",
        ),
        EffectId::RotorSkinEffect => frame(
            "slip frequency, Hz",
            "rotor resistance, Ω",
            (0.0, 1.2 * f),
            "Rotor resistance over slip frequency. Dashed: without current displacement.",
        ),
        EffectId::IronLoss => {
            frame("supply frequency, Hz", "iron loss, W", (0.0, 1.2 * f), "Iron loss over frequency at rated flux.")
        }
        EffectId::StatorHeating => frame(
            "time at rated loss, s",
            "stator resistance, Ω",
            (0.0, 2.0 * x.stator_heating.time_constant_s.min(30.0)),
            "Stator resistance from cold at rated current.",
        ),
        EffectId::RotorHeating => frame(
            "time at rated loss, s",
            "rotor resistance, Ω",
            (0.0, 2.0 * x.rotor_heating.time_constant_s.min(30.0)),
            "Rotor resistance from cold at rated current.",
        ),
        EffectId::CoulombFriction => frame(
            "speed, rad/s",
            "friction torque, Nm",
            (-0.4 * w, 0.4 * w),
            "Friction over speed. Dashed: the viscous part alone.",
        ),
        EffectId::Windage => {
            frame("speed, rad/s", "friction torque, Nm", (0.0, 1.1 * w), "Friction over speed. Dashed: the viscous part alone.")
        }
        EffectId::VoltageGain => frame(
            "recorded voltage, V",
            "missing at the terminals, V",
            (0.0, rating.phase_voltage_peak_v),
            "Recorded minus real voltage over recorded voltage.",
        ),
        EffectId::VoltageDelay => {
            frame("supply frequency, Hz", "lag of the voltage, °", (0.0, 1.2 * f), "By how much the delay turns the voltage.")
        }
        EffectId::InverterNonlinearity => frame(
            "phase current, A",
            "voltage lost, V",
            (-current, current),
            "Dead-time curve: voltage lost per phase over its current.",
        ),
        EffectId::CurrentSensorGain => frame(
            "direction of the current, °",
            "shown minus true, %",
            (0.0, 360.0),
            "Error of the magnitude shown over the direction of the current.",
        ),
        EffectId::CurrentSensorOffset => frame(
            "direction, °",
            "offset in that direction, A",
            (0.0, 360.0),
            "Current shown where none flows, by direction (0° is phase a).",
        ),
        EffectId::SpeedSensorLag => frame(
            "time after a step, s",
            "shown over true",
            (0.0, 6.0 * x.speed_sensor_lag.time_constant_s.max(1e-6)),
            "What the sensor shows after a step of the speed.",
        ),
        EffectId::StatorAsymmetry => frame(
            "direction of the current, °",
            "stator resistance, Ω",
            (0.0, 360.0),
            "Stator resistance by direction (0° is phase a).",
        ),
        EffectId::RotorAsymmetry => {
            frame("direction in the rotor, °", "rotor resistance, Ω", (0.0, 360.0), "Rotor resistance by direction in the rotor.")
        }
        EffectId::ShaftCompliance => {
            let resonance = x.shaft_compliance.antiresonance_rad_s / TAU;
            Some(Frame {
                x_label: "frequency, Hz",
                y_label: "speed per torque, rad/s per Nm",
                range: (resonance / 10.0, resonance * 10.0),
                log: true,
                caption: "How much the motor's speed swings per torque, over frequency. Dashed: a stiff shaft.",
            })
        }
        EffectId::LoadTorqueRipple => {
            frame("shaft angle, °", "load torque added, Nm", (0.0, 360.0), "Torque that the load adds over one turn.")
        }
        EffectId::Custom(_) => None,
    }
}

/// The law itself.
fn law(e: EffectId, m: &Machine<f64>, rating: &Rating, x: f64) -> f64 {
    let (p, fx) = (m.parameters(), m.effects());
    let current = rating.current_peak_a(p, m.pole_pairs());
    let w = TAU * x;
    match e {
        EffectId::MainFluxSaturation => {
            let s = fx.main_flux_saturation;
            x / p.magnetizing_inductance_h * (1.0 + s.excess * (x / s.reference_flux_vs).abs().powf(s.exponent))
        }
        EffectId::LeakageFluxSaturation => {
            let s = fx.leakage_flux_saturation;
            let l = p.stator_leakage_inductance_h;
            // ψ(i) by bisection: the law is monotone.
            let i_of = |psi: f64| {
                let q = (psi / (l * s.knee_current_a)).powi(2);
                psi / l * (1.0 + s.drop * q / (1.0 + q))
            };
            let i = x.max(1e-6 * current);
            let (mut lo, mut hi) = (0.0, l * i);
            for _ in 0..60 {
                let middle = 0.5 * (lo + hi);
                if i_of(middle) < i { lo = middle } else { hi = middle }
            }
            1e3 * lo / i
        }
        EffectId::RotorSkinEffect => {
            let s = fx.rotor_skin_effect;
            let q = (w * s.time_constant_s).powi(2);
            p.rotor_resistance_ohm * (1.0 + s.resistance_rise * q / (1.0 + q))
        }
        EffectId::IronLoss => 1.5 * fx.iron_loss.conductance_s * (w * rating.rotor_flux_vs).powi(2),
        EffectId::StatorHeating => {
            let s = fx.stator_heating;
            let loss = 1.5 * p.stator_resistance_ohm * current * current;
            let rise = s.inverse_heat_capacity_k_per_j * loss * s.time_constant_s * (1.0 - (-x / s.time_constant_s).exp());
            p.stator_resistance_ohm * (1.0 + s.temperature_coefficient_per_k * rise)
        }
        EffectId::RotorHeating => {
            let s = fx.rotor_heating;
            let loss = 1.5 * p.rotor_resistance_ohm * current * current;
            let rise = s.inverse_heat_capacity_k_per_j * loss * s.time_constant_s * (1.0 - (-x / s.time_constant_s).exp());
            p.rotor_resistance_ohm * (1.0 + s.temperature_coefficient_per_k * rise)
        }
        EffectId::CoulombFriction => {
            let s = fx.coulomb_friction;
            let sign = x / x.hypot(s.smoothing_speed_rad_s);
            let rise = s.stribeck_rise * (-(x / s.stribeck_speed_rad_s).powi(2)).exp();
            p.viscous_friction_nm_s_per_rad * x + s.torque_nm * (1.0 + rise) * sign
        }
        EffectId::Windage => p.viscous_friction_nm_s_per_rad * x + fx.windage.coefficient_nm_s2 * x * x.abs(),
        EffectId::VoltageGain => -fx.voltage_gain.gain * x,
        EffectId::VoltageDelay => (w * fx.voltage_delay.delay_s).to_degrees(),
        EffectId::InverterNonlinearity => {
            let s = fx.inverter_nonlinearity;
            s.voltage_v * x / x.hypot(s.zero_crossing_current_a)
        }
        EffectId::CurrentSensorGain => {
            let s = fx.current_sensor_gain;
            let image = Complex::from_polar(1.0, -2.0 * x.to_radians()) * Complex::new(s.unbalance_alpha, s.unbalance_beta);
            100.0 * ((image + 1.0 + s.common).norm() - 1.0)
        }
        EffectId::CurrentSensorOffset => {
            let s = fx.current_sensor_offset;
            let (sin, cos) = x.to_radians().sin_cos();
            s.alpha_a * cos + s.beta_a * sin
        }
        EffectId::SpeedSensorLag => {
            let s = fx.speed_sensor_lag;
            let (a, b) = (s.time_constant_s, s.time_constant_s * m.get(ParameterId::Effect(e, 1)));
            if a <= 0.0 {
                1.0
            } else if (a - b).abs() < 1e-6 * a {
                1.0 - (1.0 + x / a) * (-x / a).exp()
            } else if b <= 0.0 {
                1.0 - (-x / a).exp()
            } else {
                1.0 - (a * (-x / a).exp() - b * (-x / b).exp()) / (a - b)
            }
        }
        EffectId::StatorAsymmetry => {
            let s = fx.stator_asymmetry;
            let (sin, cos) = (2.0 * x.to_radians()).sin_cos();
            p.stator_resistance_ohm * (1.0 + s.unbalance_alpha * cos + s.unbalance_beta * sin)
        }
        EffectId::RotorAsymmetry => {
            let s = fx.rotor_asymmetry;
            let (sin, cos) = (2.0 * x.to_radians()).sin_cos();
            p.rotor_resistance_ohm * (1.0 + s.unbalance_direct * cos + s.unbalance_quadrature * sin)
        }
        EffectId::ShaftCompliance => {
            let s = fx.shaft_compliance;
            let stiff = 1.0 / (p.inertia_kg_m2 * w);
            let a = s.antiresonance_rad_s;
            let damping = Complex::new(0.0, 2.0 * s.damping_ratio * a * w);
            let zeros = Complex::new(a * a - w * w, 0.0) + damping;
            let poles = Complex::new(a * a - w * w * (1.0 - s.load_inertia_fraction), 0.0) + damping;
            stiff * zeros.norm() / poles.norm()
        }
        EffectId::LoadTorqueRipple => {
            let s = fx.load_torque_ripple;
            let (sin, cos) = (s.order * x * PI / 180.0).sin_cos();
            s.cosine_nm * cos + s.sine_nm * sin
        }
        EffectId::Custom(_) => f64::NAN,
    }
}

/// The curve of an effect at a machine, with the uncertainty of the fit that made it.
pub(crate) fn curve(e: EffectId, machine: &Machine<f64>, fit: &Fit, rating: &Rating) -> Option<Curve> {
    let f = frame(e, machine, rating)?;
    let (lo, hi) = f.range;
    let at: Vec<f64> = (0..POINTS)
        .map(|k| {
            let t = k as f64 / (POINTS - 1) as f64;
            if f.log { lo * (hi / lo).powf(t) } else { lo + (hi - lo) * t }
        })
        .collect();
    let drawn = |m: &Machine<f64>| at.iter().map(|&x| law(e, m, rating, x)).collect::<Vec<_>>();
    let values = drawn(machine);
    let mut effects = *machine.effects();
    effects.switch_off(e);
    effects.rescale(rating, machine.parameters(), machine.pole_pairs());
    let without = machine.with_effects(effects).map(|m| drawn(&m)).unwrap_or_default();
    // First order: Var y = gᵀ C g over the fit's search variables, inflated where the residual is above the noise.
    let inflation = fit.chi2_per_sample().max(1.0);
    let slopes: Vec<Option<Vec<f64>>> = fit
        .free
        .iter()
        .enumerate()
        .map(|(k, free)| {
            let Target::Machine(ids) = &free.target else { return None };
            let h = (0.1 * fit.covariance[(k, k)].max(0.0).sqrt()).clamp(1e-7, 1e-3);
            let set: Vec<_> = ids.iter().map(|&id| (id, free.value(machine.get(id), h))).collect();
            let moved = drawn(&machine.with(&set).ok()?);
            Some(moved.iter().zip(&values).map(|(a, b)| (a - b) / h).collect())
        })
        .collect();
    let half = |x: usize| {
        let mut variance = 0.0;
        for (a, ga) in slopes.iter().enumerate() {
            for (b, gb) in slopes.iter().enumerate() {
                if let (Some(ga), Some(gb)) = (ga, gb) {
                    variance += ga[x] * fit.covariance[(a, b)] * gb[x];
                }
            }
        }
        1.96 * (variance.max(0.0) * inflation).sqrt()
    };
    let band = (0..POINTS).map(|k| [at[k], values[k] - half(k), values[k] + half(k)]).collect();
    let paired = |y: Vec<f64>| at.iter().zip(y).map(|(x, y)| [*x, y]).collect::<Vec<_>>();
    Some(Curve {
        x_label: f.x_label,
        y_label: f.y_label,
        log: f.log,
        points: paired(values),
        band,
        without: paired(without),
        caption: f.caption,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_model::machines;

    #[test]
    fn every_effect_of_the_library_has_a_finite_curve_that_is_the_base_law_when_off() {
        let motor = im_model::Machine::base(machines::MOTULATOR_2_2_KW.parameters(), 2).unwrap();
        for &e in EffectId::ALL {
            let rating = Rating::guess(motor.parameters(), motor.pole_pairs());
            let mut effects = *motor.effects();
            effects.rescale(&rating, motor.parameters(), motor.pole_pairs());
            let off = motor.with_effects(effects).unwrap();
            let f = frame(e, &off, &rating).unwrap();
            let mut on = effects;
            for (k, info) in e.parameters().iter().enumerate() {
                if info.role == im_model::effects::Role::Strength {
                    on.set(e, k, info.typical.0 * rating.unit_of(info.scale, off.parameters(), off.pole_pairs()));
                }
            }
            let on = off.with_effects(on).unwrap();
            let differs = (0..=20).any(|k| {
                let x = f.range.0 + (f.range.1 - f.range.0) * f64::from(k) / 20.0;
                let (a, b) = (law(e, &off, &rating, x), law(e, &on, &rating, x));
                assert!(a.is_finite() && b.is_finite(), "{e} at {x}: {a}, {b}");
                (a - b).abs() > 1e-12
            });
            assert!(differs, "{e}: the curve does not show the effect");
        }
    }
}
