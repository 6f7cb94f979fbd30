//! A recording in canonical form: what was commanded, what was measured, at a constant sampling time.
//!
//! Row k: `i`, `omega_m` and `tau_load` are sampled at t_k; `u` is the average voltage commanded over [t_k, t_{k+1}) (zero-order hold).

use num_complex::Complex;

/// Sampled signals of one run, all of the same length.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// A name for messages: usually the file.
    pub name: String,
    /// Time of the first row, s.
    pub start_s: f64,
    /// Sampling time, s.
    pub sample_time_s: f64,
    /// Commanded stator voltage over the sample that begins here, V.
    pub u_s: Vec<Complex<f64>>,
    /// Measured stator current, A.
    pub i_s: Vec<Complex<f64>>,
    /// Measured mechanical speed, rad/s.
    pub omega_m: Vec<f64>,
    /// Load torque, Nm, where known.
    pub tau_load: Option<Vec<f64>>,
}

impl Recording {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.u_s.len()
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.u_s.is_empty()
    }

    /// Time of row `k`, s.
    pub fn time_s(&self, k: usize) -> f64 {
        self.start_s + self.sample_time_s * k as f64
    }
}
