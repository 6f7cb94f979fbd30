//! What the measurements at standstill say.
//!
//! **Direct currents** along phase a, i_b = i_c = −i/2, in steps of falling size, each until the rotor flux has settled:
//!
//! u = R_s i + (2/3) U_d (f(i) + f(i/2)),   f(i) = i/√(i² + I_0²)
//!
//! where the switching period is known with the currents that the ripple makes of i at the edges of each leg (`InverterNonlinearity`),
//!
//! and then along the phases b and c. Where the phases are not alike (winding, leads, the voltage or the sensor of one), the resistance depends on
//! direction: u = R_s i + N ī, along θ u/i = R_s + N e^{−2jθ}, and N is the mean of (u/i) e^{2jθ} over the three phases at one current, whatever the
//! inverter takes. A voltage u_0 that is there whatever the command is one third of what the three commands lack of nothing together, for R_s i, N ī and what the
//! inverter takes add up to nothing: Σu* = −3u_0. (With an offset i_0 of the sensors that is wrong, −3(u_0 − R_s i_0): what the
//! flux is made of is right.) It is added to every command before R_s and U_d are taken from them.
//!
//! R_s is the slope at large currents, U_d and I_0 are offset and curvature. What the voltage integrates to while the flux settles is the step of the stator flux,
//! Δψ_s = ∫(u − u_∞) dt: the flux decay gives the magnetizing curve.
//!
//! **Alternating current** on a direct current so large that no phase current crosses zero, so that the inverter takes a constant voltage:
//!
//! Z(jω) = R_0 + jωL_l + jωL_i ∥ (jωL_l + R_r(1 + k jωτ/(1 + jωτ))),   R_0 = R_s + (2/3)U_d(f'(i) + f'(i/2)/2)
//!
//! L_i is the slope of the magnetizing curve there; k and τ (deep bars) are taken where they explain what the rest does not.

use im_model::effects::InverterNonlinearity;
use im_model::space_vector::{from_phases, norm2, unit};
use im_model::{Complex, Scalar};

use super::fit::{Fitted, Found, Linear, fit};
use super::result::{CommissioningFault, CommissioningPlan};

/// The direct current that goes around the phases and that the alternating current rides on, over the rated current.
pub(super) const BIAS: f64 = 0.4;
/// Direct currents: the phase (a, b, c: 0, 1, 2), and the current over the rated one. Falling along phase a, then along the others; the alternating current rides on the last.
pub(super) const LEVELS: [(f64, f64); 12] = [
    (0.0, 1.0),
    (0.0, 0.8),
    (0.0, 0.6),
    (0.0, BIAS),
    (0.0, 0.3),
    (0.0, 0.2),
    (0.0, 0.12),
    (0.0, 0.07),
    (0.0, 0.04),
    (0.0, 0.02),
    (1.0, BIAS),
    (2.0, BIAS),
];
/// The smallest phase current of the direct ones, over the rated current: a knee below it is not seen.
pub(super) const SHARPEST: f64 = 0.01;
/// So many of them fall.
pub(super) const FALLING: usize = 10;

/// Along a phase.
pub(super) fn axis<T: Scalar>(phase: f64) -> Complex<T> {
    unit(T::from_f64(phase * core::f64::consts::FRAC_PI_3 * 2.0))
}
/// Alternating currents, Hz, and their amplitude over the rated current.
pub(super) const TONES_HZ: [f64; 9] = [0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0];
pub(super) const TONE_SHARE: f64 = 0.12;
/// Fewest samples in a period.
pub(super) const TONE_SAMPLES: f64 = 20.0;

/// A direct current when it has settled.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Level {
    pub current_a: f64,
    /// Along the current, and at right angles to it.
    pub voltage_v: Complex<f64>,
    /// Standard deviation that the noise of the current gives it, V.
    pub deviation_v: f64,
    /// ∫(u − u_∞)dt, Vs, and ∫(i − i_∞)dt, As, since the level before.
    pub voltage_area_vs: f64,
    pub current_area_as: f64,
}

/// The impedance at a frequency.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Tone {
    pub omega_rad_s: f64,
    pub impedance_ohm: Complex<f64>,
    /// Standard deviation of its mean over the periods, Ω.
    pub deviation_ohm: f64,
}

/// What a pulse of `area_vs` along each of six directions was answered with, as seen from that direction: the leakage inductance.
pub(super) fn leakage(answers: &[Complex<f64>; 6], area_vs: f64, noise_a: f64) -> Result<f64, CommissioningFault> {
    let mean = answers.iter().map(|i| i.re).sum::<f64>() / 6.0;
    let most = answers.iter().map(|i| i.re.abs().max(i.im.abs())).fold(0.0, f64::max);
    // No current that stands out of the noise.
    let is_seen = most > 8.0 * noise_a;
    if !is_seen {
        return Err(CommissioningFault::NoCurrent);
    }
    let alike = |i: &Complex<f64>| (i.re - mean).abs() < 0.35 * mean + 4.0 * noise_a && i.im.abs() < 0.35 * mean + 4.0 * noise_a;
    if mean > 0.0 && answers.iter().all(alike) { Ok(area_vs / mean) } else { Err(CommissioningFault::PhasesDiffer) }
}

/// What was found at standstill.
#[derive(Clone, Copy, Debug)]
pub(super) struct AtStandstill {
    pub stator_resistance_ohm: Found,
    pub inverter_voltage_v: Found,
    pub inverter_current_a: Found,
    /// Where the switching period is known: of the current's ripple ([`InverterNonlinearity::ripple_a_per_v`]), and the link's voltage.
    pub ripple_a_per_v: f64,
    pub dc_voltage_v: f64,
    pub leakage_inductance_h: Found,
    pub rotor_resistance_ohm: Found,
    /// L_m = ψ_m/i_m at the flux of the plan, from the flux decay.
    pub magnetizing_inductance_h: f64,
    pub skin_effect: Option<[Found; 2]>,
    /// N, α and β, Ω.
    pub resistance_asymmetry_ohm: [Found; 2],
    /// u_0, α and β, V.
    pub voltage_offset_v: [Found; 2],
}

impl AtStandstill {
    /// N, Ω.
    pub fn asymmetry(&self) -> Complex<f64> {
        let [alpha, beta] = self.resistance_asymmetry_ohm.map(|f| f.value);
        Complex::new(alpha, beta)
    }

    /// u_0, V.
    pub fn voltage_offset(&self) -> Complex<f64> {
        let [alpha, beta] = self.voltage_offset_v.map(|f| f.value);
        Complex::new(alpha, beta)
    }

    /// Volts that dead time and devices take, and the current at which 71 % of them is taken, A.
    pub fn inverter(&self) -> [f64; 2] {
        [self.inverter_voltage_v.value, self.inverter_current_a.value]
    }
}

/// f'(i).
fn slope(i: f64, i_0: f64) -> f64 {
    let root = Scalar::sqrt(i * i + i_0 * i_0);
    i_0 * i_0 / (root * root * root)
}

/// What the bridge takes along phase a of a direct current there, over U_d: (2/3)(f(i) + f(i/2)), at the currents of the edges.
fn along(bridge: &InverterNonlinearity<f64>, i_0: f64, l: &Level) -> f64 {
    let (i, u) = (l.current_a, Complex::new(l.voltage_v.re, 0.0));
    let bridge = InverterNonlinearity { zero_crossing_current_a: i_0, ..*bridge };
    from_phases(bridge.shares(u, [i, -0.5 * i, -0.5 * i])).re
}

/// N from the direct currents of one size along three phases.
fn asymmetry(levels: &[Level]) -> [Found; 2] {
    let (mut sum, mut largest, mut variance) = (Complex::new(0.0, 0.0), 0.0f64, 0.0);
    for (l, (phase, _)) in levels.iter().zip(LEVELS).filter(|(_, (_, share))| *share == BIAS) {
        let along = l.voltage_v * (1.0 / l.current_a);
        sum += along * axis(2.0 * phase);
        largest = largest.max(Scalar::sqrt(norm2(along)));
        variance += l.deviation_v * l.deviation_v / (l.current_a * l.current_a);
    }
    // A voltage counts as settled some windows before the flux has decayed to the last part in a thousand.
    let half_width = 2.5 * Scalar::sqrt(variance) / 3.0 + 1e-3 * largest;
    let found = [sum.re, sum.im].map(|x| Found { value: x / 3.0, half_width });
    // Phases that are not seen to differ are alike.
    if found.iter().any(Found::is_seen) { found } else { found.map(|f| Found { value: 0.0, ..f }) }
}

/// u_0 from the same.
fn voltage_offset(levels: &[Level]) -> [Found; 2] {
    let (mut sum, mut largest, mut variance) = (Complex::new(0.0, 0.0), 0.0f64, 0.0);
    for (l, (phase, _)) in levels.iter().zip(LEVELS).filter(|(_, (_, share))| *share == BIAS) {
        sum += l.voltage_v * axis(phase);
        largest = largest.max(Scalar::sqrt(norm2(l.voltage_v)));
        variance += l.deviation_v * l.deviation_v;
    }
    // As above.
    let half_width = 2.5 * Scalar::sqrt(variance) / 3.0 + 1e-3 * largest;
    let found = [sum.re, sum.im].map(|x| Found { value: -x / 3.0, half_width });
    if found.iter().any(Found::is_seen) { found } else { found.map(|f| Found { value: 0.0, ..f }) }
}

/// What is left open of a direct current's voltage, V, where the largest of all needs `largest`: the regulator leaves some parts in ten thousand.
pub(super) fn left_v(voltage_v: f64, largest_v: f64) -> f64 {
    3e-4 * (voltage_v.abs() + 0.1 * largest_v)
}

/// R_s along phase a, U_d, I_0.
fn direct(plan: &CommissioningPlan, levels: &[Level], bridge: &InverterNonlinearity<f64>) -> Option<[Found; 3]> {
    let largest = levels.iter().map(|l| l.voltage_v.re).fold(0.0, f64::max);
    // Noise adds what it does; more shows in the residuals.
    let weight = |l: &Level| {
        let left = left_v(l.voltage_v.re, largest);
        1.0 / Scalar::sqrt(left * left + l.deviation_v * l.deviation_v)
    };
    let current = |x: f64| x * plan.rated_current_a;
    let alone = fit([0.04 * plan.impedance_ohm()], levels.len(), |[r], k| {
        levels.get(k).map_or(0.0, |l| (r * l.current_a - l.voltage_v.re) * weight(l))
    })?;
    let residual = |x: &[f64; 3], k: usize| {
        let [r, u_d, i_0] = *x;
        // The currents need not show a knee: it is somewhere around 2 % of the rated current, within a factor e² or so.
        levels.get(k).map_or(0.5 * Scalar::ln(i_0 / current(0.02)), |l| {
            (r * l.current_a + u_d * along(bridge, i_0, l) - l.voltage_v.re) * weight(l)
        })
    };
    // The best knee of a coarse scale, with the resistance and the voltage that suit it.
    let mut best: Option<Fitted<3>> = None;
    for share in [0.002, 0.006, 0.02, 0.06, 0.2] {
        let mut rows = Linear::<2>::new();
        for l in levels {
            let (w, i_0) = (weight(l), current(share));
            rows.add([w * l.current_a, w * along(bridge, i_0, l)], w * l.voltage_v.re);
        }
        let Some([r, u_d]) = rows.solve() else { continue };
        if r.value > 0.0 && u_d.value > 0.0 {
            let start = [r.value, u_d.value, current(share)];
            let found = fit(start, levels.len() + 1, residual);
            best = match (best, found) {
                (Some(a), Some(b)) => Some(if b.cost < a.cost { b } else { a }),
                (a, b) => a.or(b),
            };
        }
    }
    let none = [alone.parameters[0], Found::default(), Found { value: current(0.03), half_width: current(0.03) }];
    // The curve must explain more than noise would.
    Some(match best {
        Some(b) if alone.cost > b.cost + 12.0 * b.chi2.max(1.0) => b.parameters,
        _ => none,
    })
}

/// The impedance of the model: x = [R_0, L_l, L_i, R_r, k, τ].
fn impedance(x: [f64; 6], omega: f64) -> Complex<f64> {
    let [r_0, l_l, l_i, r_r, k, tau] = x;
    let (jw, one) = (Complex::new(0.0, omega), Complex::new(1.0, 0.0));
    let bars = one + jw * (k * tau) / (one + jw * tau);
    let (across, rotor) = (jw * l_i, jw * l_l + bars * r_r);
    jw * l_l + r_0 + across * rotor / (across + rotor)
}

/// [L_l, R_r] and where seen [k, τ].
fn alternating(r_0: Found, l_i: f64, l_pulse: f64, tones: &[Tone]) -> Option<([Found; 2], Option<[Found; 2]>)> {
    let rows = 2 * tones.len() + 1;
    let residual = |x: [f64; 6], k: usize| {
        let Some(tone) = tones.get(k / 2) else {
            // R_0 is known from the direct currents.
            return 2.5 * (x[0] - r_0.value) / r_0.half_width.max(1e-4 * r_0.value);
        };
        let z = tone.impedance_ohm;
        // Where the flux swings along the magnetizing curve, it is no impedance to a per cent.
        let swing = 1.0 + 3.0 / (1.0 + Scalar::sqrt(tone.omega_rad_s));
        let size = Scalar::sqrt(z.re * z.re + z.im * z.im);
        let deviation = Scalar::sqrt(tone.deviation_ohm * tone.deviation_ohm + 1e-5 * size * size * swing * swing);
        let e = impedance(x, tone.omega_rad_s) - z;
        (if k.is_multiple_of(2) { e.re } else { e.im }) / deviation
    };
    let middle = tones.get(tones.len() / 2)?;
    let r_r = (middle.impedance_ohm.re - r_0.value).max(0.1 * r_0.value);
    let start = [r_0.value, 0.5 * l_pulse, l_i, r_r];
    let plain = fit(start, rows, |&[a, b, c, d], k| residual([a, b, c, d, 0.0, 1e-3], k))?;
    let mut best: Option<Fitted<6>> = None;
    for (k, tau) in [(0.3, 1e-3), (1.0, 3e-3), (0.3, 1e-2), (2.0, 1e-2)] {
        let [a, b, c, d] = plain.parameters.map(|p| p.value);
        let found = fit([a, b, c, d / (1.0 + 0.5 * k), k, tau], rows, |x, k| residual(*x, k));
        best = match (best, found) {
            (Some(a), Some(b)) => Some(if b.cost < a.cost { b } else { a }),
            (a, b) => a.or(b),
        };
    }
    let bars = best.filter(|b| {
        let [.., k, tau] = b.parameters;
        plain.cost > b.cost + 20.0 * b.chi2.max(1.0)
            && k.is_seen()
            && k.value > 0.03
            && k.value < 20.0
            && tau.value > 1e-4
            && tau.value < 0.1
    });
    Some(match bars {
        Some(Fitted { parameters: [_, l_l, _, r_r, k, tau], .. }) => ([l_l, r_r], Some([k, tau])),
        None => {
            let [_, l_l, _, r_r] = plain.parameters;
            ([l_l, r_r], None)
        }
    })
}

/// The stator flux over the settled currents, from what the voltage integrated to: [(ψ_s, i)] by falling current.
fn flux_curve(levels: &[Level]) -> [[f64; 2]; FALLING] {
    let mut curve = [[0.0; 2]; FALLING];
    let step = |a: &Level, b: &Level| {
        let slope = (b.voltage_v.re - a.voltage_v.re) / (b.current_a - a.current_a);
        b.voltage_area_vs - slope * b.current_area_as
    };
    let count = curve.len();
    // Below the smallest current the iron is linear.
    let last = levels.get(count - 2).zip(levels.get(count - 1));
    let mut flux = last.map_or(0.0, |(a, b)| step(a, b) / (b.current_a - a.current_a) * b.current_a);
    if let (Some(last), Some(level)) = (curve.last_mut(), levels.get(count - 1)) {
        *last = [flux, level.current_a];
    }
    for k in (0..count - 1).rev() {
        if let (Some(a), Some(b), Some(c)) = (levels.get(k), levels.get(k + 1), curve.get_mut(k)) {
            flux -= step(a, b);
            *c = [flux, a.current_a];
        }
    }
    curve
}

/// Everything that standstill tells.
pub(super) fn evaluate(
    plan: &CommissioningPlan,
    levels: &[Level],
    tones: &[Tone],
    pulse_leakage_h: f64,
    dc_voltage_v: f64,
) -> Result<AtStandstill, CommissioningFault> {
    let none = CommissioningFault::NoImpedance;
    let voltage_offset_v = voltage_offset(levels);
    let [alpha, beta] = voltage_offset_v.map(|f| f.value);
    let mut acting = [Level::default(); LEVELS.len()];
    for ((to, l), (phase, _)) in acting.iter_mut().zip(levels).zip(LEVELS) {
        *to = Level { voltage_v: l.voltage_v + Complex::new(alpha, beta) * axis(-phase), ..*l };
    }
    let levels = &acting;
    let ripple_a_per_v = plan.ripple_a_per_v(pulse_leakage_h);
    let bridge = InverterNonlinearity { voltage_v: 1.0, zero_crossing_current_a: 1.0, ripple_a_per_v, dc_voltage_v };
    let falling = levels.get(..FALLING).ok_or(none)?;
    let [r_a, u_d, i_0] = direct(plan, falling, &bridge).ok_or(none)?;
    let resistance_asymmetry_ohm = asymmetry(levels);
    let [alpha, beta] = resistance_asymmetry_ohm;
    let r_s = Found { value: r_a.value - alpha.value, half_width: r_a.half_width + alpha.half_width };
    let (last, _) = LEVELS[LEVELS.len() - 1];
    let along_last = (Complex::new(alpha.value, beta.value) * axis(-2.0 * last)).re;
    let bias = BIAS * plan.rated_current_a;
    let slope = slope(bias, i_0.value) + 0.5 * slope(0.5 * bias, i_0.value);
    let r_0 = Found {
        value: r_s.value + along_last + 2.0 / 3.0 * u_d.value * slope,
        // What the shape of the curve leaves open of its slope.
        half_width: r_s.half_width + 2.0 / 3.0 * 0.3 * u_d.value * slope,
    };
    let curve = flux_curve(falling);
    let secant =
        curve.iter().find(|[psi, i]| *i > 0.0 && *psi > 0.0 && *i <= bias).map_or(10.0 * pulse_leakage_h, |[psi, i]| psi / i);
    let ([l_l, r_r], skin_effect) = alternating(r_0, secant, pulse_leakage_h, tones).ok_or(none)?;

    // ψ_m(i) reaches the flux of the plan between two currents, or is beyond the largest of them.
    let wanted = plan.rating.rotor_flux_vs;
    let main = curve.map(|[psi, i]| [psi - l_l.value * i, i]);
    let between = main.iter().zip(main.iter().skip(1)).find(|(a, b)| a[0] >= wanted && b[0] < wanted);
    let current = match (between, main.first(), main.last()) {
        (Some(([psi_a, i_a], [psi_b, i_b])), ..) => i_b + (i_a - i_b) * (wanted - psi_b) / (psi_a - psi_b),
        (None, Some([psi, i]), _) if *psi < wanted => i * wanted / psi,
        (None, _, Some([psi, i])) => i * wanted / psi,
        _ => return Err(none),
    };
    let l_m = wanted / current;
    let z = plan.impedance_ohm();
    let plausible = |x: f64, low: f64, high: f64| x > low && x < high;
    let per_unit = plan.omega_rad_s() / z;
    if plausible(r_s.value / z, 1e-4, 1.0)
        && plausible(r_r.value / z, 1e-4, 1.0)
        && plausible(l_l.value * per_unit, 1e-3, 1.0)
        && plausible(l_m * per_unit, 0.2, 50.0)
    {
        Ok(AtStandstill {
            stator_resistance_ohm: r_s,
            inverter_voltage_v: u_d,
            inverter_current_a: i_0,
            ripple_a_per_v,
            dc_voltage_v,
            leakage_inductance_h: l_l,
            rotor_resistance_ohm: r_r,
            magnetizing_inductance_h: l_m,
            skin_effect,
            resistance_asymmetry_ohm,
            voltage_offset_v,
        })
    } else {
        Err(none)
    }
}
