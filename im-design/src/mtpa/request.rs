//! Laws asked for: fitted, witnessed and proven.

use super::circuit::Circuit;
use super::law::Law;
use super::laws;
use super::optimum::for_torque;
use super::proof::{MtpaDesign, Witness, in_reach};
use crate::certificate::{Certificate, DesignModel};
use crate::error::DesignError;
use serde::Deserialize;

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MtpaRequest {
    /// Torques to cover, N m.
    pub torque_n_m: [f64; 2],
    /// Of the laws, relative; 0.01 when not given.
    #[serde(default = "hundredth")]
    pub tolerance: f64,
    /// The series, or (27) and (29); the series when not given.
    #[serde(default)]
    pub law: LawKind,
    /// Torques with a witness at first; 25 when not given. More are added where the way between two is not proven.
    #[serde(default = "twenty_five")]
    pub points: u32,
    /// The q-d circuit of Kwon et al., instead of the motor's own.
    pub aqdm: Option<AqdmTable>,
}

/// Which laws.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LawKind {
    /// [`Law::Series`].
    #[default]
    Series,
    /// [`Law::Kwon`].
    Kwon,
}

/// An [`super::Aqdm`] without its pole pairs, which are the motor's.
#[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AqdmTable {
    /// l_r1 … l_r4.
    pub rotor_leakage: [f64; 4],
    /// m₁ … m₆.
    pub magnetizing: [f64; 6],
    /// (y_a, y_τ) of each rotor branch.
    pub rotor: [[f64; 2]; 3],
}

fn hundredth() -> f64 {
    0.01
}

fn twenty_five() -> u32 {
    25
}

/// Smallest tolerance that laws are proven to, relative.
const LEAST_TOLERANCE: f64 = 1e-3;

/// Laws for a circuit, proven for every torque of the range from witnesses at `points` torques or more.
///
/// The series are fitted to half the tolerance, which leaves the proof room. (27) and (29) are fitted under (28) over the
/// range of torque.
///
/// # Errors
/// [`DesignError::Infeasible`] with the torque in reach, or with the tolerance that the laws keep.
pub fn design(plant: DesignModel, circuit: Circuit, request: &MtpaRequest) -> Result<(MtpaDesign, Certificate), DesignError> {
    if let Some(complaint) = circuit.complaint() {
        return Err(DesignError::request(complaint));
    }
    let MtpaRequest { torque_n_m, tolerance, .. } = *request;
    let [low, high] = torque_n_m;
    in_reach(torque_n_m).map_err(DesignError::request)?;
    if !(LEAST_TOLERANCE..0.5).contains(&tolerance) {
        let what = format!(
            "tolerance = {tolerance} must lie between {LEAST_TOLERANCE}, below which the proof has too many cells, and 0.5"
        );
        return Err(DesignError::request(what));
    }
    if !(2..=1000).contains(&request.points) {
        return Err(DesignError::request(format!("points = {} must lie between 2 and 1000", request.points)));
    }
    let last = request.points - 1;
    let torques: Vec<f64> = (0..=last)
        .map(|k| match k {
            0 => low,
            k if k == last => high,
            k => low * (high / low).powf(f64::from(k) / f64::from(last)),
        })
        .collect();
    let law = match request.law {
        LawKind::Series => {
            let fitted = laws::fit_log(&circuit, torque_n_m, 0.5 * tolerance)?;
            Law::Series { current: fitted.current, slip: fitted.slip }
        }
        LawKind::Kwon => {
            let most = for_torque(&circuit, high)?.current_rms_a;
            let points = laws::data(&circuit, most, 70)?;
            let (current, slip) = (laws::fit_current(&points)?, laws::fit_slip(&points)?);
            Law::Kwon { a: current.a, b: current.b, c: slip.c }
        }
    };
    let mut worst = (0.0f64, low);
    let mut witness = |torque: f64| -> Result<Witness, DesignError> {
        // A hair more than the torque, so that the proof has it for certain.
        let best = for_torque(&circuit, torque * (1.0 + 1e-9))?;
        let [current, slip] = law.at(torque_n_m, torque);
        let off = (current / best.current_rms_a - 1.0).abs().max((slip / best.slip_rad_s - 1.0).abs());
        if off > worst.0 {
            worst = (off, torque);
        }
        Ok(Witness { torque_n_m: torque, at: best.at })
    };
    let points: Vec<Witness> = torques.into_iter().map(&mut witness).collect::<Result<_, _>>()?;
    let mut design = MtpaDesign { torque_n_m, tolerance, circuit, law: law.clone(), points: Vec::new() };
    let mut ahead: Vec<Witness> = points.into_iter().rev().collect();
    design.points.extend(ahead.pop());
    // Between two torques closer than this the law itself is off.
    const CLOSE: f64 = 1.001;
    while let (Some(from), Some(to)) = (design.points.last(), ahead.last()) {
        if to.torque_n_m > CLOSE * from.torque_n_m && design.way(from, to).is_none() {
            ahead.push(witness((from.torque_n_m * to.torque_n_m).sqrt())?);
        } else {
            design.points.extend(ahead.pop());
        }
    }
    if worst.0 > 0.95 * tolerance {
        return Err(DesignError::Infeasible {
            constraint: format!("the law at {:.4} N m, {:.2} % off the optimum", worst.1, 100.0 * worst.0),
            feasible: format!("a tolerance of {:.4}, a narrower range of torque, or law = \"series\"", 1.06 * worst.0),
        });
    }
    match Certificate::seal(plant, design.clone()) {
        Ok(certificate) => Ok((design, certificate)),
        Err(_) => Err(DesignError::Infeasible {
            constraint: format!("a proof within {tolerance} from {low} to {high} N m, which takes too many cells"),
            feasible: match super::design(plant, circuit, &MtpaRequest { tolerance: 2.0 * tolerance, ..*request }) {
                Ok(_) => format!("a tolerance of {}", 2.0 * tolerance),
                Err(DesignError::Infeasible { feasible, .. }) => feasible,
                Err(_) => "a narrower range of torque".into(),
            },
        }),
    }
}
