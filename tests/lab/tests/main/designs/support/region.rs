//! A region of each kind for a random machine.

use super::top_speed;
use im_design::request::Kind;
use im_design::{DesignModel, LinearMachine};

/// A region that fits a machine, as a user would write it.
pub fn region(kind: Kind, m: &LinearMachine) -> String {
    let plant = DesignModel::Machine(*m);
    let c = plant.constants::<f64>();
    let w = top_speed(m);
    let we = c.n_p * w;
    // Rated flux of a 400-V, 50-Hz machine, and its magnetizing current.
    let flux = 0.95;
    let current = flux / m.mutual_inductance_h;
    let unit = 1.0 / (c.n_p * c.beta * flux).powi(2);
    match kind {
        Kind::Thau => "slack = 0.01".into(),
        Kind::ThauBox => format!(
            "frame_rad_s = [{}, {we}]\nslip_rad_s = [{}, {}]\nflux_d_vs = [0.85, 1.05]\nflux_q_vs = [-0.03, 0.03]",
            0.6 * we,
            -0.5 * c.eta,
            0.5 * c.eta
        ),
        Kind::Kubota => format!("speed_rad_s = [{}, {w}]\nrate_per_s = {}", -w, 0.5 * c.eta),
        Kind::KubotaLoop => format!(
            "speed_rad_s = [{}, {}]\nslip_rad_s = [{}, {}]\nflux_vs = {flux}\nproportional = {}\nintegral = {}\nrho = 0.5",
            0.4 * w,
            0.6 * w,
            -c.eta,
            c.eta,
            0.5 * unit * c.gamma,
            0.1 * unit * c.gamma * c.gamma
        ),
        Kind::Derdiyok => format!("speed_max_rad_s = {w}\nflux_max_vs = {}\nreserve = 1.0", 1.2 * flux),
        Kind::Utkin => format!(
            "speed_max_rad_s = {w}\nflux_min_vs = {}\nflux_error_max_vs = {}\ncurrent_error_max_a = {}\ncurrent_max_a = {}\n\
             flux_max_vs = {}\nvoltage_max_v = 400.0",
            0.7 * flux,
            0.05 * flux,
            0.05 * c.beta * flux,
            4.0 * current,
            1.2 * flux
        ),
        Kind::Kenne => format!(
            "speed_max_rad_s = {w}\nflux_vs = [0.9, 1.0]\nflux_uncertainty = 0.02\ncurrent_max_a = {}\nvoltage_max_v = 380.0\n\
             stator_resistance_ratio = [0.8, 1.4]\nrotor_resistance_ratio = [0.8, 1.5]\nacceleration_max_rad_s2 = 1000.0\n\
             reference_max_rad_s3 = 0.0\nload_error_rad_s2 = 0.0\nload_rate_rad_s3 = 0.0\n\
             rotor_resistance_rate_per_s = 0.1\nc_omega = 15.0\nc_lambda = 10.0\nreach_omega = 100.0\nreach_lambda = 1.0",
            4.0 * current
        ),
        Kind::Jadot => format!(
            "electrical_speed_rad_s = [{}, {we}]\nslip_rad_s = [{}, {}]\nflux_vs = 0.9\n\
             current_bandwidth_rad_s = {}\nspeed_bandwidth_rad_s = {}\ndamping = 0.8",
            -we,
            -c.eta,
            c.eta,
            2.0 * c.gamma + 300.0,
            2.0 * c.eta
        ),
        Kind::Sampled => {
            // A flux error turns at n_pω and decays at η: forward Euler needs h well below 2η/(n_pω)².
            let period = (0.4 * c.eta / (we * we)).min(50e-6);
            format!("speed_rad_s = [{}, {w}]\nperiod_s = {period:e}\nrate_per_s = {}", -w, 0.2 * c.eta)
        }
        Kind::Mtpa => {
            let torque = 1.5 * c.n_p * flux * current;
            format!("torque_n_m = [{}, {}]\npoints = 3\ntolerance = 0.01", 0.1 * torque, torque)
        }
    }
}
