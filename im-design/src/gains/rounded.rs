//! A design in the numbers of a drive: gains rounded to f32 so that the claim still holds, and proven so.
//!
//! A gain that must be large enough is rounded up, what must cover it (a boundary layer) from the rounded one on; the gains of matrices are
//! rounded to nearest. Then everything is decided again, exactly, with the rounded numbers; where a proof without room fails, what may grow
//! grows by a few more units of the last place.

use crate::certificate::{Certificate, Design};
use crate::error::DesignError;
use crate::kubota_loop::LoopGains;
use crate::matrix::Matrix;
use crate::mtpa::{AirGap, Law, MtpaDesign, Witness, for_torque};

/// How a number may move.
enum Way {
    /// Either way.
    Nearest,
    /// Up only; a layer over a gain moves further.
    Up(u32),
    /// Down only.
    Down,
}

/// The nearest f32.
fn nearest(x: f64) -> f64 {
    f64::from(x as f32)
}

/// The smallest f32 that is not smaller.
fn up(x: f64) -> f64 {
    let y = x as f32;
    f64::from(if f64::from(y) < x { y.next_up() } else { y })
}

/// The largest f32 that is not larger.
fn down(x: f64) -> f64 {
    -up(-x)
}

fn moved(x: f64, way: &Way, steps: u32) -> f64 {
    match way {
        Way::Nearest => nearest(x),
        Way::Down => down(x),
        Way::Up(times) => (0..steps * times).fold(up(x) as f32, |y, _| y.next_up()).into(),
    }
}

/// The numbers of a design that a drive computes with, and how each may move.
fn gains(design: &mut Design) -> Vec<(&mut f64, Way)> {
    use Way::{Nearest, Up};
    fn all<'a>(matrices: impl IntoIterator<Item = &'a mut Matrix<f64>>) -> Vec<(&'a mut f64, Way)> {
        matrices.into_iter().flat_map(Matrix::entries_mut).map(|x| (x, Nearest)).collect()
    }
    fn adaptive(g: &mut LoopGains) -> Vec<(&mut f64, Way)> {
        let mut found = all([&mut g.gain, &mut g.gain_per_speed]);
        found.extend([(&mut g.proportional, Nearest), (&mut g.integral, Nearest)]);
        found
    }
    fn switching(d: &mut crate::kenne::KenneDesign) -> Vec<(&mut f64, Way)> {
        let r = &mut d.region;
        vec![
            (&mut r.c_omega, Nearest),
            (&mut r.c_lambda, Nearest),
            (&mut d.k_sq, Up(1)),
            (&mut d.k_sd, Up(1)),
            (&mut d.k_x, Up(1)),
            (&mut d.k_rr_per_s, Up(0)),
        ]
    }
    fn regulation(d: &mut crate::jadot::JadotDesign) -> Vec<(&mut f64, Way)> {
        vec![
            (&mut d.current_proportional_ohm, Nearest),
            (&mut d.current_integral_per_s, Nearest),
            (&mut d.speed_proportional, Nearest),
            (&mut d.speed_integral_per_s, Nearest),
            (&mut d.lambda_h, Nearest),
            (&mut d.adaptation_rate_per_s, Way::Down),
            (&mut d.adaptation_frequency_rad_s, Way::Down),
        ]
    }
    match design {
        Design::Thau(d) => all([&mut d.gain]),
        Design::SampledThau(d) => all([&mut d.gain]),
        Design::ThauBox(d) => all([&mut d.gain, &mut d.gain_per_frame_speed]),
        Design::SampledThauBox(d) => all([&mut d.gain, &mut d.gain_per_frame_speed]),
        Design::Kubota(d) => all([&mut d.gain, &mut d.gain_per_speed]),
        Design::Sampled(d) => all([&mut d.gain, &mut d.gain_per_speed]),
        Design::KubotaLoop(d) => adaptive(&mut d.gains),
        Design::SampledKubotaLoop(d) => adaptive(&mut d.gains),
        Design::Derdiyok(d) => vec![(&mut d.nu0, Up(1))],
        Design::SampledDerdiyok(d) => vec![(&mut d.continuous.nu0, Up(1)), (&mut d.boundary_layer_a, Up(4))],
        Design::Utkin(d) => vec![(&mut d.omega0_rad_s, Up(1))],
        Design::SampledUtkin(d) => vec![(&mut d.continuous.omega0_rad_s, Up(1)), (&mut d.boundary_layer_avs, Up(4))],
        Design::Kenne(d) => switching(d),
        Design::SampledKenne(d) => {
            let mut found = switching(&mut d.continuous);
            found.extend([(&mut d.boundary_omega, Up(4)), (&mut d.boundary_lambda, Up(4))]);
            found
        }
        Design::Jadot(d) => regulation(d),
        Design::SampledJadot(d) => regulation(&mut d.continuous),
        Design::Mtpa(d) => match &mut d.law {
            Law::Series { current, slip } => current.iter_mut().chain(slip).map(|x| (x, Nearest)).collect(),
            Law::Kwon { a, b, c } => a.iter_mut().chain(b).chain(c).map(|x| (x, Nearest)).collect(),
        },
    }
}

/// The frame speeds that a box observer holds to, and the torques of a law, inside the proven ones.
fn narrow(design: &mut Design) -> Result<(), DesignError> {
    match design {
        Design::ThauBox(d) => d.region.frame_rad_s = inside(d.region.frame_rad_s),
        Design::SampledThauBox(d) => d.region.frame_rad_s = inside(d.region.frame_rad_s),
        Design::Mtpa(d) => {
            d.torque_n_m = inside(d.torque_n_m);
            let [low, high] = d.torque_n_m;
            d.points.retain(|w| low < w.torque_n_m && w.torque_n_m < high);
            let end = |torque_n_m: f64| -> Result<Witness, DesignError> { witness(d, torque_n_m) };
            let [first, last] = [end(low)?, end(high)?];
            d.points.insert(0, first);
            d.points.push(last);
        }
        _ => {}
    }
    Ok(())
}

fn inside([low, high]: [f64; 2]) -> [f64; 2] {
    let (a, b) = (up(low), down(high));
    if a <= b { [a, b] } else { [nearest(low); 2] }
}

/// The optimum at a torque, a hair above it, so that it has the torque for certain.
fn witness(d: &MtpaDesign, torque_n_m: f64) -> Result<Witness, DesignError> {
    let best = for_torque(&d.circuit, torque_n_m * (1.0 + 1e-9))?;
    debug_assert!(d.circuit.levels()[0] > 0.0);
    Ok(Witness { torque_n_m, at: best.at })
}

impl Certificate {
    /// The same design with every gain an f32, proven anew.
    ///
    /// # Errors
    /// A gain beyond what f32 holds; [`DesignError::Infeasible`] when the claim does not survive the rounding.
    pub fn in_f32(&self) -> Result<Certificate, DesignError> {
        let mut narrowed = self.design.clone();
        if let Some((x, _)) = gains(&mut narrowed).into_iter().find(|(x, _)| **x != 0.0 && !(**x as f32).is_normal()) {
            return Err(DesignError::request(format!("a gain of {x:e} is beyond f32; --scalar f64 holds it")));
        }
        narrow(&mut narrowed)?;
        for steps in [0, 1, 2, 4, 8, 16, 64, 256] {
            let mut design = narrowed.clone();
            for (x, way) in gains(&mut design) {
                *x = moved(*x, &way, steps);
            }
            if let Ok(proven) = Certificate::seal(self.plant, design) {
                return Ok(proven);
            }
        }
        Err(DesignError::Infeasible {
            constraint: "the proof has no room for gains rounded to f32".into(),
            feasible: "--scalar f64, or a slightly lower rate, larger reserve or wider layer".into(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_goes_the_way_it_says() {
        for x in [0.1, 364.1, -0.3, 1e-20, 3.0e7 + 1.0] {
            assert!(down(x) <= x && x <= up(x) && up(x) - down(x) <= 1.3e-7 * x.abs(), "{x}");
            assert_eq!(up(nearest(x)), nearest(x));
            assert!(moved(x, &Way::Up(1), 2) > up(x));
        }
    }
}
