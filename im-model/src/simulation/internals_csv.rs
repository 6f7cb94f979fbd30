//! What no sensor shows, as a table for plotting.

use std::io::{self, Write};
use std::path::Path;

use crate::atomic_file::write_atomically;
use crate::effects::{EffectId, StateKind};
use crate::file_error::FileError;
use crate::simulation::run::Run;

/// The columns of every machine; then come the states of the effects.
const COLUMNS: &str = "t_s,torque_Nm,omega_m_rad_s,theta_m_rad,psi_s_alpha_Vs,psi_s_beta_Vs,psi_r_alpha_Vs,psi_r_beta_Vs,\
    psi_m_alpha_Vs,psi_m_beta_Vs";

impl Run {
    /// Writes the internals at the rows of the recording, as a whole or not at all; only the column names if they were not kept.
    ///
    /// # Errors
    /// The system refuses; the old file is then unchanged.
    pub fn write_internals_csv(&self, path: impl AsRef<Path>) -> Result<(), FileError> {
        write_atomically(path.as_ref(), |out| self.internals_to_csv(out))
    }

    /// As [`write_internals_csv`](Self::write_internals_csv), to anywhere.
    ///
    /// # Errors
    /// Those of `out`.
    pub fn internals_to_csv(&self, out: &mut impl Write) -> io::Result<()> {
        write!(out, "{COLUMNS}")?;
        for info in EffectId::ALL.iter().flat_map(|id| id.states()) {
            match (info.kind, info.name.rsplit_once('_')) {
                (StateKind::Vector, Some((name, unit))) => write!(out, ",{name}_alpha_{unit},{name}_beta_{unit}")?,
                _ => write!(out, ",{}", info.name)?,
            }
        }
        writeln!(out)?;
        let Some(internals) = &self.internals else { return Ok(()) };
        for (k, ((x, torque), m)) in internals.states.iter().zip(&internals.torque_nm).zip(&internals.psi_m).enumerate() {
            let (t, s, r) = (self.recording.time_s(k), x.psi_s, x.psi_r);
            write!(
                out,
                "{t:.9},{torque:?},{:?},{:?},{:?},{:?},{:?},{:?},{:?},{:?}",
                x.omega_m, x.theta_m, s.re, s.im, r.re, r.im, m.re, m.im
            )?;
            EffectId::ALL.iter().flat_map(|&id| x.extra.of(id)).try_for_each(|x| write!(out, ",{x:?}"))?;
            writeln!(out)?;
        }
        Ok(())
    }
}
