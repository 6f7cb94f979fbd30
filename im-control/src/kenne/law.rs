//! The law itself: (47), (48) and the two sliding terms.

use im_model::{Complex, Scalar, WindingParameters};

use crate::kenne::KenneGains;
use crate::reference::Shaped;
use crate::vector::clamp;

/// Constants of the law.
#[derive(Clone, Copy, Debug)]
pub(super) struct Law<T> {
    /// k₀ … k₇ (after (19)).
    k: [T; 8],
    /// mμ = (3/2) n_p M/L_r.
    pub torque_factor: T,
    pub n_p: T,
    /// m, kg m².
    pub m: T,
    /// α, N m s/rad.
    alpha: T,
    /// M, H.
    pub m_big: T,
    inverse_l_r: T,
    pub sigma_l_s: T,
}

/// What is known at the instant of the measurement.
pub(super) struct Seen<T> {
    pub omega_m: T,
    /// |λ|, Vs.
    pub flux_vs: T,
    /// X = i_sᵀλ, A Vs.
    pub x: T,
    pub torque_nm: T,
    /// |i_s|², A².
    pub i2: T,
    /// T_L and its rate.
    pub load: (T, T),
    pub r_r: T,
}

/// What is asked for, and how far it may go.
pub(super) struct Aims<T> {
    pub speed: Shaped<T>,
    /// F_ref, Vs².
    pub flux2: T,
    pub flux2_rate: T,
    pub torque_max: T,
    pub i_d_max: T,
}

pub(super) struct Voltage<T> {
    /// v_sd + jv_sq, V.
    pub v: Complex<T>,
    /// The speed's aim was beyond the torque.
    pub limited: bool,
}

impl<T: Scalar> Law<T> {
    pub fn new(w: &WindingParameters<T>, pole_pairs: u32) -> Self {
        let (constants, derived) = (w.kenne(pole_pairs), w.derived(pole_pairs));
        Self {
            k: constants.k,
            torque_factor: w.inertia_kg_m2 * constants.mu,
            n_p: derived.n_p,
            m: w.inertia_kg_m2,
            alpha: w.viscous_friction_nm_s_per_rad,
            m_big: w.mutual_inductance_h,
            inverse_l_r: T::one() / w.rotor_inductance_h,
            sigma_l_s: derived.sigma_l_s,
        }
    }

    /// The voltage; `lacking` gathers the mean of the switching terms over `sample_time_s` (zero while the voltage is limited).
    #[inline]
    pub fn voltage(
        &self,
        g: &KenneGains<T>,
        y: &Seen<T>,
        aims: &Aims<T>,
        lacking: &mut Complex<T>,
        sample_time_s: T,
    ) -> Voltage<T> {
        let [k_0, k_1, k_2, k_3, k_4, k_5, k_6, k_7] = self.k;
        let two = T::from_f64(2.0);
        let flux2 = y.flux_vs * y.flux_vs;
        let inverse_flux = T::one() / y.flux_vs;
        let (t_l, t_l_rate) = y.load;

        // Speed: ω̇, the aim a* for it, and the rate of a* on the surface.
        let acceleration = (y.torque_nm - self.alpha * y.omega_m - t_l) / self.m;
        let (e, rate_e) = (y.omega_m - aims.speed.speed, acceleration - aims.speed.rate);
        let braked = (self.alpha * y.omega_m + t_l) / self.m;
        let most = aims.torque_max / self.m;
        let wish = aims.speed.rate - g.c_omega * e;
        let aim = clamp(wish, -most - braked, most - braked);
        let limited = aim != wish;
        let aim_rate = if limited { -t_l_rate / self.m } else { aims.speed.second - g.c_omega * rate_e };
        // (48) with ω̈ = da*/dt in place of ω̈_ref − c_ω(ω̇ − ω̇_ref).
        let v_q_hat = k_0
            * inverse_flux
            * (self.alpha * acceleration
                + self.m * aim_rate
                + (k_2 + y.r_r * k_3) / self.m_big * y.torque_nm
                + t_l_rate
                + self.n_p * y.omega_m * self.torque_factor * (k_1 * flux2 + y.x));
        let s_omega = acceleration - aim;
        let switch_q = g.k_sq * saturation(s_omega, g.boundary_omega);

        // Flux: d|λ|²/dt by (9), its aim, and the rate of the aim on the surface.
        let eta2 = two * y.r_r * self.inverse_l_r;
        let rate = eta2 * (self.m_big * y.x - flux2);
        let e = flux2 - aims.flux2;
        let wish = aims.flux2_rate - g.c_lambda * e;
        let aim = clamp(wish, -eta2 * flux2, eta2 * (self.m_big * aims.i_d_max * y.flux_vs - flux2));
        let aim_rate = if aim == wish { -g.c_lambda * (rate - aims.flux2_rate) } else { T::zero() };
        // (47), with c_λ(|λ|² − MX) = −(c_λ/2η) d|λ|²/dt written as the rate of the aim.
        let v_d_hat = k_7
            * inverse_flux
            * (aim_rate / eta2 - eta2 * (flux2 - self.m_big * y.x) + k_2 * y.x + y.r_r * (k_3 * y.x - k_4 * y.i2 - k_5 * flux2)
                - y.omega_m * k_6 * y.torque_nm);
        let s_lambda = rate - aim;
        let switch_d = g.k_sd * saturation(s_lambda, g.boundary_lambda);

        let gathered = *lacking - Complex::new(switch_d, switch_q) * (g.equivalent_bandwidth_per_s * sample_time_s);
        *lacking = Complex::new(clamp(gathered.re, -g.k_sd, g.k_sd), clamp(gathered.im, -g.k_sq, g.k_sq));
        Voltage { v: Complex::new(v_d_hat - switch_d, v_q_hat - switch_q) + *lacking, limited }
    }
}

/// sign(s) outside the layer, s/Φ inside.
#[inline]
fn saturation<T: Scalar>(s: T, layer: T) -> T {
    if s > layer {
        T::one()
    } else if s < -layer {
        -T::one()
    } else if layer > T::zero() {
        s / layer
    } else {
        T::zero()
    }
}

#[cfg(test)]
mod tests;
