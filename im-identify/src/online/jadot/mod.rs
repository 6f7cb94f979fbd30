//! The adaptations of Jadot et al. (2009), Sections IV and VI, and what they see: how a reference generator (17), (18) is followed.
//!
//! With estimates in place of the parameters, θᵢ = (truth − estimate)/truth in the order R_req, L, R_s, L_f:
//!
//! ```text
//! φ_ref' = −(T̂⁻¹ + jω_g)φ_ref + R̂ i_ref − v_r,   L̂_f i_ref' = −(R̂_s + R̂ + jω_sL̂_f)i_ref + (T̂⁻¹ − jω_r)φ_ref + u_s − v_s   (17), (18)
//! v_r = −(R̂ + λ(T̂⁻¹ + jω_r))Δi,   v_s = −K_P(Δi + η),   η' = K_I Δi,   Δi = i_s − i_ref                            (22), (25)
//! ```
//!
//! Whoever applies the voltage, the errors Δi, Δφ obey (27), (28). The passivity-based controller computes u_s from its reference by (19);
//! [`Follower`] takes the u_s of any other drive, so that the same adaptations plug in there.
//!
//! **The sign.** K_Pη = BᵀΔθ (tested against (30) in `parameters.rs`), and (34), dΔθ/dt = −K_B Re(B̄K_Pη), is the law for the *error*. With
//! V = ½ΔθᵀK_B⁻¹Δθ, V̇ = −|BᵀΔθ|² ≤ 0. The truth being constant, the estimate moves the other way:
//! dθ̂ᵢ/dt = +θ̂ᵢ (K_B)ᵢ Re(B̄ᵢK_Pη). The real part is not printed, but errors are real and B is complex.

mod fixed;
mod follower;
mod parameters;
mod scheme;
mod time_scale;
mod time_varying;

pub use fixed::Fixed;
pub use follower::{Follower, FollowerGains, FollowerState, Lambda};
pub use parameters::{RegulationParameters, relative_sensitivity, steady_regressor};
pub use scheme::{Adaptation, DeadZone, SchemeSettings, Tracking};
pub use time_scale::{TimeScale, TimeScaleState};
pub use time_varying::{TimeVarying, TimeVaryingGain, TimeVaryingState};
