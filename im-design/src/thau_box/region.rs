//! The box that a gain is certified over.

use crate::error::{DesignError, ordered};
use serde::{Deserialize, Serialize};

/// A box of operation; a range whose ends coincide is a constant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BoxRegion {
    /// Speed ω_f of the frame, electrical rad/s.
    pub frame_rad_s: [f64; 2],
    /// Slip ω_f − n_p ω̄, electrical rad/s.
    pub slip_rad_s: [f64; 2],
    /// Mean of true and estimated flux along the d axis, Wb.
    pub flux_d_vs: [f64; 2],
    /// The same along the q axis, Wb.
    pub flux_q_vs: [f64; 2],
    /// Measured current along d, A; zero when the torque is not modelled.
    pub current_d_a: [f64; 2],
    /// Measured current along q, A; zero when the torque is not modelled.
    pub current_q_a: [f64; 2],
}

impl BoxRegion {
    fn ranges(&self) -> [[f64; 2]; 6] {
        let r = self;
        [r.frame_rad_s, r.slip_rad_s, r.flux_d_vs, r.flux_q_vs, r.current_d_a, r.current_q_a]
    }

    /// The vertices (ω_f, ω_s, λ_d, λ_q, i_d, i_q); a constant is not doubled.
    pub fn vertices(&self) -> Vec<[f64; 6]> {
        let mut vertices = vec![[0.0; 6]];
        for (k, [low, high]) in self.ranges().into_iter().enumerate() {
            let ends: &[f64] = if low == high { &[low] } else { &[low, high] };
            let with = |v: &[f64; 6], x: f64| {
                let mut v = *v;
                v[k] = x;
                v
            };
            vertices = ends.iter().flat_map(|&x| vertices.iter().map(move |v| with(v, x)).collect::<Vec<_>>()).collect();
        }
        vertices
    }

    /// Widths multiplied by `factor` about the centre.
    pub fn scaled(&self, factor: f64) -> Self {
        let about = |[low, high]: [f64; 2]| {
            let (centre, half) = (0.5 * (low + high), 0.5 * (high - low) * factor);
            [centre - half, centre + half]
        };
        let [frame, slip, flux_d, flux_q, current_d, current_q] = self.ranges().map(about);
        BoxRegion {
            frame_rad_s: frame,
            slip_rad_s: slip,
            flux_d_vs: flux_d,
            flux_q_vs: flux_q,
            current_d_a: current_d,
            current_q_a: current_q,
        }
    }

    pub(crate) fn validate(&self) -> Result<(), DesignError> {
        let names = ["frame_rad_s", "slip_rad_s", "flux_d_vs", "flux_q_vs", "current_d_a", "current_q_a"];
        names.into_iter().zip(self.ranges()).try_for_each(|(name, range)| ordered(name, range))
    }
}
