//! Iron loss: a conductance across the magnetizing branch, fed through the diffusion of the laminations.
//!
//! i_fe = G dψ_fe/dt,  dψ_fe/dt = (ψ_m − ψ_fe)/τ,  P_fe = (3/2) G |dψ_fe/dt|²
//!
//! Below 1/(2πτ) ≈ 3 kHz this is the resistor R_fe = 1/G across the magnetizing voltage dψ_m/dt. The corner is physical (eddy
//! currents need time to diffuse into a lamination) and it makes the branch lossless to integrate: a bare resistor behind the
//! leakages has a time constant of G·L_l ≈ 3 µs, which goes to zero with the strength (docs/effects.md).

use super::effect;
use crate::error::Bound;

effect! {
    /// Eddy-current and hysteresis loss of the stator iron.
    IronLoss, "iron_loss",
    card: super::Card {
        title: "Iron loss",
        what: "A conductance G across the magnetizing branch takes i_fe = G dψ_m/dt: P_fe = (3/2) G |ωψ_m|².",
        shows: "No-load power that grows with frequency and flux; a current error in phase with the voltage, at no load too; torque missing in proportion when the shaft power is known.",
        rivals: &[
            ("windage", "also takes power at high speed, but through the shaft: it does not depend on flux"),
            ("coulomb_friction", "takes power through the shaft in proportion to speed, whatever the flux"),
            ("main_flux_saturation", "adds reactive current; iron loss adds active current"),
        ],
        test: "Flux steps at constant speed and load: windage stays, iron loss follows the square of flux.",
        place: "extra branch across the magnetizing inductance (adds one complex state)",
        source: "motulator's core-loss conductance i_s = (i_s' + G u_s)/(1 + G R_s), moved behind the stator leakage",
    },
    parameters: {
        /// Conductance across the magnetizing branch.
        conductance_s: Strength, default 0.0, "S", Conductance, typical 0.005 to 0.12, Bound::NotNegative;
        /// Diffusion time of the laminations.
        diffusion_time_s: Fixed, default 5e-5, "s", One, typical 2e-5 to 2e-4, Bound::Within(1e-5, 1e-2);
    },
    hooks: {}
}
