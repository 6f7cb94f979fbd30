//! (25) and (26) bounded over the region, term by term.

use super::KenneRegion;
use crate::exact::Field;
use crate::machine::Constants;

/// What a surface's law asks for: (25) or (26), and what a sampling period adds.
#[derive(Clone)]
pub(crate) struct Rates<F> {
    /// Smallest and largest input gain b.
    pub input: [F; 2],
    /// k of the continuous law, V.
    pub k: F,
    /// E₁ of `sampled/switching.rs`: grows with the time since the sample.
    pub per_second: F,
    /// What may jump between samples.
    pub at_once: F,
}

/// Sizes that the laws' terms are made of: |λ|, |i|, w, and their rates.
struct Sizes<F> {
    flux: F,
    current: F,
    w: F,
    flux_rate: F,
    current_rate: F,
}

fn larger<F: Field>(a: F, b: F) -> F {
    if a > b { a } else { b }
}

fn magnitude<F: Field>(a: F) -> F {
    if a < F::zero() { -a } else { a }
}

pub(super) fn square<F: Field>(x: F) -> F {
    x.clone() * x
}

/// R_r/σL_r at nominal resistance.
pub(super) fn rotor_rate<F: Field>(c: &Constants<F>) -> F {
    c.gamma.clone() + c.eta.clone() - c.stator_rate.clone()
}

/// The two laws, [speed, flux]: (25) and (26) with F, b and |f̂| bounded over the region, and the rates of |f̂|.
///
/// The estimated flux, |λ̂| within 1 ± δ of the flux, enters b̂ and every term of f̂. A term of degree n in |λ| is off by at most
/// (1 + δ)ⁿ − 1 of itself, so that |f̂ − f| gains the law at (1 + δ)|λ| less the law at |λ|.
pub(crate) fn rates<F: Field>(c: &Constants<F>, region: &KenneRegion) -> [Rates<F>; 2] {
    let (f, r) = (F::from_f64, region);
    let [low, high] = r.flux_vs.map(f);
    let (less, more) = (F::one() - f(r.flux_uncertainty), F::one() + f(r.flux_uncertainty));
    let m = c.eta_l_m.clone() / c.eta.clone();
    let [s_low, s_high] = r.stator_resistance_ratio.map(f);
    let [r_low, r_high] = r.rotor_resistance_ratio.map(f);
    let spread = |low: F, high: F| larger(magnitude(low - F::one()), magnitude(high - F::one()));
    let rotor_rate = rotor_rate(c);
    let k = c.stator_rate.clone() + rotor_rate.clone();
    let (d_s, d_r) = (spread(s_low, s_high.clone()), spread(r_low.clone(), r_high.clone()));
    let (two, four) = (f(2.0), f(4.0));
    let (current, w) = (f(r.current_max_a), c.n_p.clone() * f(r.speed_max_rad_s));
    let eta_high = c.eta.clone() * r_high.clone();
    let sizes = |flux: F| Sizes {
        flux_rate: (eta_high.clone() + w.clone()) * flux.clone() + eta_high.clone() * m.clone() * current.clone(),
        current_rate: c.beta.clone() * (eta_high.clone() + w.clone()) * flux.clone()
            + (c.stator_rate.clone() * s_high.clone() + c.beta.clone() * c.eta_l_m.clone() * r_high.clone()) * current.clone()
            + c.inverse_sigma_l_s.clone() * f(r.voltage_max_v),
        current: current.clone(),
        w: w.clone(),
        flux,
    };
    let (true_sizes, law_sizes) = (sizes(high.clone()), sizes(high.clone() * more.clone()));
    let xy = |z: &Sizes<F>| z.flux.clone() * z.current.clone();
    let xy_rate = |z: &Sizes<F>| z.flux_rate.clone() * z.current.clone() + z.flux.clone() * z.current_rate.clone();
    // (2Λ)Λ', of |λ|².
    let flux2_rate = |z: &Sizes<F>| two.clone() * z.flux.clone() * z.flux_rate.clone();
    let turn = law_sizes.flux_rate.clone() / (low.clone() * less.clone());
    // b/b̂, b at one time of the sample and b̂ at another.
    let mismatch = high.clone() / (low.clone() * less.clone());

    // Speed.
    let input = |flux: F| c.mu.clone() * flux * c.inverse_sigma_l_s.clone();
    let b = [input(low.clone() * less.clone()), input(high.clone())];
    let damping = magnitude(f(r.c_omega) - c.friction_rate.clone());
    let law = |z: &Sizes<F>| {
        k.clone() * c.mu.clone() * xy(z)
            + z.w.clone() * c.mu.clone() * (c.beta.clone() * square(z.flux.clone()) + xy(z))
            + damping.clone() * f(r.acceleration_max_rad_s2)
            + f(r.reference_max_rad_s3)
    };
    let d_k = c.stator_rate.clone() * d_s + rotor_rate.clone() * d_r.clone();
    let largest = law(&law_sizes);
    let error = d_k * c.mu.clone() * xy(&true_sizes)
        + f(r.load_rate_rad_s3)
        + damping.clone() * f(r.load_error_rad_s2)
        + (largest.clone() - law(&true_sizes));
    let ratio = more.clone() / less.clone() - F::one();
    let jerk =
        c.mu.clone() * xy_rate(&true_sizes) + c.friction_rate.clone() * f(r.acceleration_max_rad_s2) + f(r.load_rate_rad_s3);
    let z = &law_sizes;
    let rate = k.clone() * c.mu.clone() * xy_rate(z)
        + c.n_p.clone() * f(r.acceleration_max_rad_s2) * c.mu.clone() * (c.beta.clone() * square(z.flux.clone()) + xy(z))
        + z.w.clone() * c.mu.clone() * (c.beta.clone() * flux2_rate(z) + xy_rate(z))
        + damping * jerk;
    let direction = |b: &F| b.clone() * f(r.voltage_max_v) * turn.clone();
    let speed = Rates {
        k: (error + f(r.reach_omega) + ratio * largest.clone()) / b[0].clone(),
        per_second: mismatch.clone() * (rate + largest * turn.clone()) + direction(&b[1]),
        at_once: two.clone() * f(r.reference_max_rad_s3) * mismatch.clone(),
        input: b,
    };

    // Flux.
    let input = |rotor: F, flux: F| two.clone() * c.eta_l_m.clone() * rotor * flux * c.inverse_sigma_l_s.clone();
    let b = [input(r_low.clone(), low.clone() * less.clone()), input(r_high.clone(), high)];
    let quadratic = |z: &Sizes<F>| {
        (four.clone() + two.clone() * m.clone() * c.beta.clone()) * square(z.flux.clone())
            + four.clone() * m.clone() * xy(z)
            + two.clone() * square(m.clone() * z.current.clone())
    };
    let quadratic_rate = |z: &Sizes<F>| {
        (four.clone() + two.clone() * m.clone() * c.beta.clone()) * flux2_rate(z)
            + four.clone() * m.clone() * xy_rate(z)
            + four.clone() * square(m.clone()) * z.current.clone() * z.current_rate.clone()
    };
    let slope = |z: &Sizes<F>| two.clone() * square(z.flux.clone()) + two.clone() * m.clone() * xy(z);
    let slope_rate = |z: &Sizes<F>| two.clone() * flux2_rate(z) + two.clone() * m.clone() * xy_rate(z);
    let cross = |z: &Sizes<F>| two.clone() * m.clone() * xy(z);
    let eta2 = square(c.eta.clone());
    let law = |z: &Sizes<F>| {
        eta2.clone() * quadratic(z)
            + c.eta.clone() * cross(z) * (z.w.clone() + k.clone())
            + f(r.c_lambda) * c.eta.clone() * slope(z)
    };
    let d_eta2 = eta2.clone() * larger(magnitude(square(r_high.clone()) - F::one()), magnitude(square(r_low.clone()) - F::one()));
    let d_eta = c.eta.clone() * d_r;
    // ηk over both resistances: largest departure from nominal at a corner of the ratios.
    let mut d_eta_k = F::zero();
    for s in r.stator_resistance_ratio.map(f) {
        for x in [r_low.clone(), r_high.clone()] {
            let k_there = c.stator_rate.clone() * s.clone() + rotor_rate.clone() * x.clone();
            d_eta_k = larger(d_eta_k, c.eta.clone() * magnitude(x * k_there - k.clone()));
        }
    }
    let (z, largest) = (&true_sizes, law(&law_sizes));
    let error = d_eta2 * quadratic(z)
        + d_eta.clone() * cross(z) * z.w.clone()
        + d_eta_k * cross(z)
        + f(r.c_lambda) * d_eta * slope(z)
        + (largest.clone() - law(z));
    let ratio = (more * r_high.clone()) / (less * r_low.clone()) - F::one();
    let z = &law_sizes;
    let rate = eta2 * quadratic_rate(z)
        + c.eta.clone()
            * two.clone()
            * m.clone()
            * (c.n_p.clone() * f(r.acceleration_max_rad_s2) * xy(z) + (z.w.clone() + k) * xy_rate(z))
        + f(r.c_lambda) * c.eta.clone() * slope_rate(z);
    let mismatch = mismatch * r_high / r_low;
    let flux = Rates {
        k: (error + f(r.reach_lambda) + ratio * largest.clone()) / b[0].clone(),
        per_second: mismatch * (rate + largest * turn.clone()) + direction(&b[1]),
        at_once: F::zero(),
        input: b,
    };
    [speed, flux]
}
