//! Gains of the passivity-based controller of Jadot et al. (2009) for wanted bandwidths, with two certificates.
//!
//! Electrical errors (21), (22), (25), ω_r electrical, ω_g the slip, complex states (Δφ, Δi, η):
//!
//! ```text
//! Δφ' = −(T_r⁻¹ + jω_g)Δφ − λ(T_r⁻¹ + jω_r)Δi
//! Δi' = [(T_r⁻¹ − jω_r)Δφ − (R_s + R_req + K_P)Δi − K_P η]/L_f − jω_s Δi,   η' = K_I Δi,   ω_s = ω_r + ω_g
//! ```
//!
//! and the loop of speed, flux and current reference (12), (16), (20), linearized at flux φ and slip ω_g:
//!
//! ```text
//! ξ' = k_i Δω,  δω_g = −k_p(Δω + ξ),  κ = 3n_p²/(2J R_req)
//! Δω' = κR_req φ δi_q + κφ(ω_g δφ_d − T_r⁻¹ δφ_q) − (D/J)Δω
//! δφ' = −(T_r⁻¹ + jω_g)δφ − jφ δω_g + R_req δi
//! δi' = (R_s + R_req)/L_f (jφ δω_g/R_req − δi)
//! ```
//!
//! The first drives the second and not the other way round, so a P for each proves the cascade. λ has the unit H:
//! the paper's value (R_req/L_f)√(T_r⁻² + ω_r²) has not; R_req/√(T_r⁻² + ω_r²), used here at the highest speed, has.

use crate::certificate::{Certificate, Claim, DesignModel, Obligation};
use crate::error::{DesignError, ordered, positive};
use crate::exact::Field;
use crate::feasible::{largest_share, range, shrunk};
use crate::kubota::common_decay;
use crate::machine::Constants;
use crate::matrix::Matrix;
use crate::model::complex;
use serde::{Deserialize, Serialize};

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JadotRequest {
    /// Electrical rotor speeds ω_r = n_p ω to cover, rad/s.
    pub electrical_speed_rad_s: [f64; 2],
    /// Slip frequencies ω_g to cover, electrical rad/s.
    pub slip_rad_s: [f64; 2],
    /// Flux set point φ = (L_m/L_r)ψ_r, Wb.
    pub flux_vs: f64,
    /// Natural frequency of the current loop, rad/s.
    pub current_bandwidth_rad_s: f64,
    /// Natural frequency of the speed loop, rad/s.
    pub speed_bandwidth_rad_s: f64,
    /// Damping ratio of both, e.g. 1/√2.
    pub damping: f64,
}

/// The gains with their proof.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct JadotDesign {
    /// Electrical rotor speeds the proof covers, rad/s.
    pub electrical_speed_rad_s: [f64; 2],
    /// Slip frequencies the proof covers, electrical rad/s.
    pub slip_rad_s: [f64; 2],
    /// Flux set point, Wb.
    pub flux_vs: f64,
    /// K_P of (25), Ω.
    pub current_proportional_ohm: f64,
    /// K_I of (25), 1/s.
    pub current_integral_per_s: f64,
    /// k_p of (12), 1.
    pub speed_proportional: f64,
    /// k_i of (12), 1/s.
    pub speed_integral_per_s: f64,
    /// λ of (22), H.
    pub lambda_h: f64,
    /// Adaptation (34): K_B = this/‖B‖², 1/s; a tenth of the slowest proven rate keeps the time scales apart.
    pub adaptation_rate_per_s: f64,
    /// Adaptation (47): K_W = this²/‖W‖², rad/s.
    pub adaptation_frequency_rad_s: f64,
    /// Proven rate of the electrical errors, 1/s.
    pub electrical_rate_per_s: f64,
    /// Its P, 6 × 6, states (Δφ, Δi, η) as pairs.
    pub electrical_p: Matrix<f64>,
    /// Proven rate of the outer loop, 1/s.
    pub outer_rate_per_s: f64,
    /// Its P, 6 × 6, states (ξ, Δω, δφ_d, δφ_q, δi_d, δi_q).
    pub outer_p: Matrix<f64>,
}

/// The parameters of (7) and the factors of the speed equation.
struct Parameters<F> {
    l_f: F,
    r_req: F,
    r_total: F,
    /// κ R_req = 3n_p²/(2J).
    torque: F,
}

fn parameters<F: Field>(c: &Constants<F>) -> Parameters<F> {
    let l_f = F::one() / c.inverse_sigma_l_s.clone();
    let ratio = c.beta.clone() * l_f.clone(); // L_m/L_r
    let r_req = c.eta_l_m.clone() * ratio.clone();
    let r_total = c.stator_rate.clone() * l_f.clone() + r_req.clone();
    Parameters { torque: c.n_p.clone() * c.mu.clone() / ratio, l_f, r_req, r_total }
}

impl JadotDesign {
    /// The electrical error dynamics at electrical speed ω_r and slip ω_g.
    pub fn electrical<F: Field>(&self, c: &Constants<F>, speed: f64, slip: f64) -> Matrix<F> {
        let f = F::from_f64;
        let p = parameters(c);
        let (w, g) = (f(speed), f(slip));
        let (k_p, lambda, zero) = (f(self.current_proportional_ohm), f(self.lambda_h), F::zero());
        let mut a = Matrix::zeros(6, 6);
        a.put(0, 0, &complex(&-c.eta.clone(), &-g.clone()));
        a.put(0, 2, &complex(&-(lambda.clone() * c.eta.clone()), &-(lambda * w.clone())));
        a.put(2, 0, &complex(&(c.eta.clone() / p.l_f.clone()), &-(w.clone() / p.l_f.clone())));
        a.put(2, 2, &complex(&-((p.r_total + k_p.clone()) / p.l_f.clone()), &-(w + g)));
        a.put(2, 4, &complex(&-(k_p / p.l_f), &zero));
        a.put(4, 2, &complex(&f(self.current_integral_per_s), &zero));
        a
    }

    /// The outer loop linearized at slip ω_g.
    pub fn outer<F: Field>(&self, c: &Constants<F>, slip: f64) -> Matrix<F> {
        let f = F::from_f64;
        let p = parameters(c);
        let (g, flux, k_p) = (f(slip), f(self.flux_vs), f(self.speed_proportional));
        let kappa_flux = p.torque.clone() * flux.clone() / p.r_req.clone();
        let lag = p.r_total / p.l_f;
        let mut a = Matrix::zeros(6, 6);
        a[(0, 1)] = f(self.speed_integral_per_s);
        a[(1, 1)] = -c.friction_rate.clone();
        a[(1, 2)] = kappa_flux.clone() * g.clone();
        a[(1, 3)] = -(kappa_flux * c.eta.clone());
        a[(1, 5)] = p.torque * flux.clone();
        a.put(2, 2, &complex(&-c.eta.clone(), &-g));
        a.put(2, 4, &complex(&p.r_req, &F::zero()));
        a.put(4, 4, &complex(&-lag.clone(), &F::zero()));
        for state in [0, 1] {
            a[(3, state)] = flux.clone() * k_p.clone();
            a[(5, state)] = -(lag.clone() * flux.clone() * k_p.clone() / p.r_req.clone());
        }
        a
    }
}

impl JadotDesign {
    /// Sizes of the states of both loops, for conditioning.
    pub(crate) fn scales(&self, c: &Constants<f64>, speed_bandwidth_rad_s: f64) -> [[f64; 6]; 2] {
        let p = parameters(c);
        // In balance with the storage function (23): Δφ against √(λL_f)Δi against √(λK_P/K_I)η.
        let i = 1.0 / (self.lambda_h * p.l_f).sqrt();
        let eta = (self.current_integral_per_s / (self.lambda_h * self.current_proportional_ohm)).sqrt();
        let speed = speed_bandwidth_rad_s;
        let current = self.flux_vs * self.speed_proportional / p.r_req * speed;
        let flux = self.flux_vs * speed * self.speed_proportional / c.eta;
        [[1.0, 1.0, i, i, eta, eta], [speed, speed, flux, flux, current, current]]
    }
}

impl Claim for JadotDesign {
    fn obligations<F: Field>(&self, c: &Constants<F>) -> Result<Vec<Obligation<F>>, String> {
        if [&self.electrical_p, &self.outer_p].iter().any(|p| (p.rows(), p.cols()) != (6, 6)) {
            return Err("both P must be 6 × 6".into());
        }
        let f = F::from_f64;
        let decay = |a: &Matrix<F>, p: &Matrix<F>, rate: f64| -&(&(p * a).plus_transpose() + &p.scaled(&(f(2.0) * f(rate))));
        // The adaptation is no part of the proof; that its time scale is apart from the loops' is.
        let slower = |name: &str, rate: f64| {
            Obligation::Exceeds(
                format!("{name} rate over five adaptation rates"),
                f(rate),
                f(5.0) * f(self.adaptation_rate_per_s),
            )
        };
        let five = f(5.0) * f(self.adaptation_frequency_rad_s);
        let bandwidth2 = f(self.current_proportional_ohm) * f(self.current_integral_per_s) * c.inverse_sigma_l_s.clone();
        let frequency2 = five.clone() * five;
        let (inner, outer) = (Matrix::exact(&self.electrical_p), Matrix::exact(&self.outer_p));
        let mut obligations = vec![
            Obligation::Positive("electrical rate".into(), f(self.electrical_rate_per_s)),
            Obligation::Positive("outer rate".into(), f(self.outer_rate_per_s)),
            Obligation::Positive("adaptation rate".into(), f(self.adaptation_rate_per_s)),
            slower("electrical", self.electrical_rate_per_s),
            slower("outer", self.outer_rate_per_s),
            Obligation::Positive("adaptation frequency".into(), f(self.adaptation_frequency_rad_s)),
            Obligation::Exceeds("current bandwidth over five adaptation frequencies, squared".into(), bandwidth2, frequency2),
            Obligation::Definite("P of the electrical errors".into(), inner.clone()),
            Obligation::Definite("P of the outer loop".into(), outer.clone()),
        ];
        for slip in self.slip_rad_s {
            for speed in self.electrical_speed_rad_s {
                let matrix = decay(&self.electrical(c, speed, slip), &inner, self.electrical_rate_per_s);
                obligations.push(Obligation::Definite(format!("electrical decay at {speed}, slip {slip} rad/s"), matrix));
            }
            let matrix = decay(&self.outer(c, slip), &outer, self.outer_rate_per_s);
            obligations.push(Obligation::Definite(format!("outer decay at slip {slip} rad/s"), matrix));
        }
        Ok(obligations)
    }
}

/// Gains for the wanted bandwidths: L_f s² + (R_s + R_req + K_P)s + K_P K_I and s² + κφ²k_p s + κφ²k_p k_i get the
/// natural frequencies and the damping asked for; rates and P by SDP over the region.
///
/// # Errors
/// [`DesignError::Infeasible`] when the current bandwidth is below what the resistances alone give, or no common P.
pub fn design(plant: DesignModel, request: &JadotRequest) -> Result<(JadotDesign, Certificate), DesignError> {
    let r = request;
    positive("flux_vs", r.flux_vs)?;
    positive("damping", r.damping)?;
    positive("current_bandwidth_rad_s", r.current_bandwidth_rad_s)?;
    positive("speed_bandwidth_rad_s", r.speed_bandwidth_rad_s)?;
    ordered("electrical_speed_rad_s", r.electrical_speed_rad_s)?;
    ordered("slip_rad_s", r.slip_rad_s)?;
    let c = plant.constants::<f64>();
    let mut design = shaped(&c, r)?;
    let [electrical_scale, outer_scale] = design.scales(&c, r.speed_bandwidth_rad_s).map(|s| Matrix::diagonal(&s));
    let electrical = |speeds: [f64; 2], slips: [f64; 2]| {
        let vertices = speeds.into_iter().flat_map(|w| slips.map(|g| design.electrical(&c, w, g)));
        common_decay(&vertices.collect::<Vec<_>>(), &electrical_scale)
    };
    let (speeds, slips) = (r.electrical_speed_rad_s, r.slip_rad_s);
    let inner_found = electrical(speeds, slips).map_err(|e| {
        let works = |share| electrical(shrunk(speeds, share), shrunk(slips, share)).is_ok();
        let part = |share| {
            format!("speeds of {} rad/s with slips of {} rad/s", range(shrunk(speeds, share)), range(shrunk(slips, share)))
        };
        let other = || "another current bandwidth: not even the centre of the region is stable".into();
        instead(e, "the electrical errors", largest_share(works).map_or_else(other, part))
    })?;
    let outer = |slips: [f64; 2]| common_decay(&slips.map(|slip| design.outer(&c, slip)), &outer_scale);
    let outer_found = outer(slips).map_err(|e| {
        let part = |share| format!("slips of {} rad/s", range(shrunk(slips, share)));
        let slower = |share: f64| JadotRequest { speed_bandwidth_rad_s: share * r.speed_bandwidth_rad_s, ..*r };
        let stable = |share: f64| {
            let scale = |d: &JadotDesign| Matrix::diagonal(&d.scales(&c, share * r.speed_bandwidth_rad_s)[1]);
            shaped(&c, &slower(share)).is_ok_and(|d| common_decay(&slips.map(|slip| d.outer(&c, slip)), &scale(&d)).is_ok())
        };
        let feasible = largest_share(|share| outer(shrunk(slips, share)).is_ok()).map(part).or_else(|| {
            largest_share(stable).map(|share| format!("a speed bandwidth up to {:.4} rad/s", share * r.speed_bandwidth_rad_s))
        });
        instead(e, "the speed loop", feasible.unwrap_or("a much lower speed bandwidth".into()))
    })?;
    (design.electrical_rate_per_s, design.electrical_p) = (0.95 * inner_found.0, inner_found.1);
    (design.outer_rate_per_s, design.outer_p) = (0.95 * outer_found.0, outer_found.1);
    design.adaptation_rate_per_s = 0.1 * design.outer_rate_per_s.min(design.electrical_rate_per_s);
    let certificate = Certificate::seal(plant, design.clone())?;
    Ok((design, certificate))
}

/// The gains for the wanted bandwidths, not yet proven.
fn shaped(c: &Constants<f64>, r: &JadotRequest) -> Result<JadotDesign, DesignError> {
    let p = parameters(c);
    let k_p = 2.0 * r.damping * r.current_bandwidth_rad_s * p.l_f - p.r_total;
    if k_p <= 0.0 {
        return Err(DesignError::Infeasible {
            constraint: format!("K_P = 2ζω L_f − (R_s + R_req) = {k_p:.4} Ω must be positive"),
            feasible: format!("a current bandwidth above {:.1} rad/s", p.r_total / (2.0 * r.damping * p.l_f)),
        });
    }
    let kappa_flux2 = p.torque * r.flux_vs * r.flux_vs / p.r_req;
    let top = r.electrical_speed_rad_s.iter().fold(0.0f64, |m, w| m.max(w.abs()));
    Ok(JadotDesign {
        electrical_speed_rad_s: r.electrical_speed_rad_s,
        slip_rad_s: r.slip_rad_s,
        flux_vs: r.flux_vs,
        current_proportional_ohm: k_p,
        current_integral_per_s: p.l_f * r.current_bandwidth_rad_s.powi(2) / k_p,
        speed_proportional: 2.0 * r.damping * r.speed_bandwidth_rad_s / kappa_flux2,
        speed_integral_per_s: r.speed_bandwidth_rad_s / (2.0 * r.damping),
        lambda_h: p.r_req / c.eta.hypot(top),
        adaptation_rate_per_s: 0.0,
        adaptation_frequency_rad_s: 0.1 * r.current_bandwidth_rad_s,
        electrical_rate_per_s: 0.0,
        electrical_p: Matrix::identity(6),
        outer_rate_per_s: 0.0,
        outer_p: Matrix::identity(6),
    })
}

/// The error of a loop without a common P, with what has one.
fn instead(e: DesignError, of: &str, feasible: String) -> DesignError {
    let DesignError::Infeasible { constraint, .. } = e else { return e };
    DesignError::Infeasible { constraint: format!("{of}: {constraint}"), feasible }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::LinearMachine;

    fn plant() -> DesignModel {
        DesignModel::Machine(LinearMachine::jadot_table_i())
    }

    pub(crate) fn request() -> JadotRequest {
        JadotRequest {
            electrical_speed_rad_s: [-320.0, 320.0],
            slip_rad_s: [-12.0, 12.0],
            flux_vs: 0.9,
            current_bandwidth_rad_s: 837.0,
            speed_bandwidth_rad_s: 20.0,
            damping: std::f64::consts::FRAC_1_SQRT_2,
        }
    }

    #[test]
    fn table_ii_current_gains_are_those_of_837_rad_s() {
        let (design, certificate) = design(plant(), &request()).unwrap();
        certificate.check().unwrap();
        assert!((design.current_proportional_ohm - 7.0).abs() < 0.05, "{}", design.current_proportional_ohm);
        assert!((design.current_integral_per_s - 790.0).abs() < 10.0, "{}", design.current_integral_per_s);
        assert!(design.electrical_rate_per_s > 1.0 && design.outer_rate_per_s > 1.0);
    }

    #[test]
    fn too_slow_a_current_loop_says_how_fast_it_must_be() {
        let slow = JadotRequest { current_bandwidth_rad_s: 50.0, ..request() };
        let error = design(plant(), &slow).unwrap_err();
        assert!(error.to_string().contains("above 210.8"), "{error}");
    }

    /// V of (48) needs K_P in its last term: with λK_P/(2K_I)|η|² the cross terms cancel.
    #[test]
    fn storage_function_needs_k_p_in_its_last_term() {
        let (design, _) = design(plant(), &request()).unwrap();
        let c = plant().constants::<f64>();
        let p = parameters(&c);
        let a = design.electrical(&c, 200.0, 5.0);
        let v = |last: f64| {
            let l = design.lambda_h;
            Matrix::diagonal(&[1.0, 1.0, l * p.l_f, l * p.l_f, l * last, l * last].map(|x| 0.5 * x))
        };
        let slope = |last: f64| (&v(last) * &a).plus_transpose();
        let right = slope(design.current_proportional_ohm / design.current_integral_per_s);
        assert!(right[(2, 4)].abs() < 1e-12 && right[(0, 2)].abs() < 1e-12);
        assert!(slope(1.0 / design.current_integral_per_s)[(2, 4)].abs() > 1e-3, "as printed they do not cancel");
    }
}
