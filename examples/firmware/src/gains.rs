/// Gains made by `im design`; SI units.
///
/// Motor: 4 kW (SHA-256 of its parameters bb9ae9a3a6f723dcca7e64d8630dec28a88aa0af737f98805a1f17380b111b81).
/// Certificate: kubota_loop (SHA-256 81eb2f31186381cc1ad860c8e2d28389f5971c779549ef9a7bac21c993b2023c).
/// Rounded to f32 so that the claim holds, and proven as rounded (SHA-256 bdc587ebe0b02f26384d4bf2650e60b37705ae250cab824abf3346c11ce7b9d2).
/// `im design check gains.f32.toml` decides this proof again.
/// Effects of the motor that the proof leaves out: iron_loss.
///
/// For small errors about every operating point of the region the linearized loop of flux, current and estimated speed is stable, at the rate or faster. Large errors and another flux are not part of it.
///
/// * `rate_per_s` = 1.6051342887046047: proven decay rate, 1/s
/// * `speed_rad_s` = 10.0 to 60.0: mechanical speeds covered, rad/s
/// * `slip_rad_s` = -10.0 to 10.0: slips covered, electrical rad/s
/// * `flux_vs` = 0.9: rotor flux linkage amplitude, Wb
/// * `proportional` = 0.05000000074505806: K_P of the speed law
/// * `integral` = 20.0: K_I of the speed law
pub mod kubota_loop {

    /// The gain, affine in speed, with the speed law; never faded, as it is proven.
    pub const GAINS: im_observers::KubotaGains = im_observers::KubotaGains {
        gain: [[-1.3105769157409668, 0.0], [0.0, -1.3105769157409668], [0.0, 0.0], [0.0, 0.0]],
        gain_per_speed: [[0.0, -0.0810256376862526], [0.0810256376862526, 0.0], [0.0, 0.0], [0.0, 0.0]],
        proportional: 0.05000000074505806,
        integral: 20.0,
        fade_a: 0.0,
    };
}
