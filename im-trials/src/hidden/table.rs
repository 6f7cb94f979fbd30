//! A recording: columns of equal length, and its CSV form.

use std::fmt::Write as _;
use std::path::Path;

/// Header of a recording in the canonical form.
pub const HEADER: &str = "t_s,u_alpha_V,u_beta_V,i_alpha_A,i_beta_A,omega_m_rad_s,tau_load_Nm";

/// A recording. Row k: current, speed and load torque sampled at `t_k`; voltage commanded over `[t_k, t_k+1)`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Table {
    /// Time, s.
    pub t_s: Vec<f64>,
    /// Commanded voltage, α, V.
    pub u_alpha_v: Vec<f64>,
    /// Commanded voltage, β, V.
    pub u_beta_v: Vec<f64>,
    /// Measured current, α, A.
    pub i_alpha_a: Vec<f64>,
    /// Measured current, β, A.
    pub i_beta_a: Vec<f64>,
    /// Measured mechanical speed, rad/s.
    pub omega_m_rad_s: Vec<f64>,
    /// Measured load torque, N m.
    pub tau_load_nm: Vec<f64>,
}

impl Table {
    /// Number of rows.
    pub fn rows(&self) -> usize {
        self.t_s.len()
    }

    /// Columns in the order of the header.
    pub fn columns(&self) -> [&Vec<f64>; 7] {
        [&self.t_s, &self.u_alpha_v, &self.u_beta_v, &self.i_alpha_a, &self.i_beta_a, &self.omega_m_rad_s, &self.tau_load_nm]
    }

    fn columns_mut(&mut self) -> [&mut Vec<f64>; 7] {
        [
            &mut self.t_s,
            &mut self.u_alpha_v,
            &mut self.u_beta_v,
            &mut self.i_alpha_a,
            &mut self.i_beta_a,
            &mut self.omega_m_rad_s,
            &mut self.tau_load_nm,
        ]
    }

    /// Appends a row, in the order of the header.
    pub fn push(&mut self, row: [f64; 7]) {
        for (column, value) in self.columns_mut().into_iter().zip(row) {
            column.push(value);
        }
    }

    /// Drops the rows before `first` and starts time anew.
    pub fn cut_before(&mut self, first: usize) {
        let start = self.t_s.get(first).copied().unwrap_or(0.0);
        for column in self.columns_mut() {
            column.drain(..first.min(column.len()));
        }
        for t in &mut self.t_s {
            *t -= start;
        }
    }

    /// The recording as CSV text with seven significant digits.
    pub fn to_csv(&self) -> String {
        let mut text = String::with_capacity(80 * self.rows() + 80);
        text += HEADER;
        text.push('\n');
        let columns = self.columns();
        for row in 0..self.rows() {
            for (place, column) in columns.iter().enumerate() {
                let end = if place == 6 { '\n' } else { ',' };
                let _ = write!(text, "{}{end}", significant(column[row], 7));
            }
        }
        text
    }

    /// Writes the recording to a CSV file.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self, path: &Path) -> std::io::Result<()> {
        std::fs::write(path, self.to_csv())
    }
}

/// A number rounded to so many significant digits, in its shortest decimal form.
pub fn significant(value: f64, digits: usize) -> String {
    let rounded: f64 = format!("{value:.*e}", digits - 1).parse().unwrap_or(value);
    // Adding zero turns −0 into 0.
    format!("{}", rounded + 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_seven_digits() {
        assert_eq!(significant(std::f64::consts::PI * 100.0, 7), "314.1593");
        assert_eq!(significant(-0.0, 7), "0");
        assert_eq!(significant(0.000_123_456_789, 6), "0.000123457");
        assert_eq!(significant(2.0, 7), "2");
    }

    #[test]
    fn cutting_starts_time_anew() {
        let mut table = Table::default();
        for k in 0..5 {
            table.push([f64::from(k), 0.0, 0.0, 0.0, 0.0, f64::from(k * k), 0.0]);
        }
        table.cut_before(2);
        assert_eq!(table.t_s, [0.0, 1.0, 2.0]);
        assert_eq!(table.omega_m_rad_s, [4.0, 9.0, 16.0]);
    }
}
