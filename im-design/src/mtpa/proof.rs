//! The certificate of laws of maximum torque per ampere: near the least current there is, at every torque of their range.
//!
//! For each torque T of the range, with I and ω_s by the laws and a tolerance ε:
//!
//! * *enough*: an operating point gives at least T with at most (1 + ε)I, its slip within ε of ω_s. Listed torques have witnesses; between
//!   two of them the torque takes every value along the line from witness to witness, in the circuit's own coordinates. The line is cut
//!   into boxes until in each no point takes more current, or another slip, than the laws allow for the torques in the box;
//! * *not more than needed*: no operating point gives T with (1 − ε)I or less. Were there one, of torque T' ≥ T, its current would be below
//!   (1 − ε) times the largest I up to T'. The plane of operating points is cut into cells until each provably has less torque than
//!   the range, or more current than that (branch and bound over intervals rounded outwards): one search for all torques.
//!
//! Curves with exponentials have no exact value; enclosures prove as much.

use super::air_gap::AirGap;
use super::circuit::Circuit;
use super::law::Law;
use crate::certificate::{Claim, Obligation};
use crate::exact::{Field, Interval};
use crate::machine::Constants;
use serde::{Deserialize, Serialize};

/// Laws with what proves them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MtpaDesign {
    /// Torques the laws are for, N m.
    pub torque_n_m: [f64; 2],
    /// ε, relative.
    pub tolerance: f64,
    /// The circuit.
    pub circuit: Circuit,
    /// The laws.
    pub law: Law,
    /// Torques with their witnesses, ascending, the ends of the range included.
    pub points: Vec<Witness>,
}

/// An operating point that gives a torque.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Witness {
    /// The torque that it gives at least, N m.
    pub torque_n_m: f64,
    /// Where: in the circuit's own coordinates.
    pub at: [f64; 2],
}

/// Cells after which the search gives up.
const CELLS: usize = 3_000_000;
/// How often a line between witnesses is halved.
const HALVES: u32 = 14;
/// Where the slips from zero to infinity are cut first, electrical rad/s.
const FIRST_SLIP: f64 = 1e3;
/// Widths of the pieces that the law's current is known on, relative.
const PIECE: f64 = 1e-3;

/// Witnesses at most.
const POINTS_MAX: usize = 10_000;

/// Torques that laws are proven for: what machines have, over a range that can be cut into pieces.
///
/// # Errors
/// What is out of reach, and what is not.
pub(super) fn in_reach([low, high]: [f64; 2]) -> Result<(), String> {
    if low >= 1e-6 && low < high && high <= 1e8 && high <= 1e9 * low {
        return Ok(());
    }
    Err(format!("torque_n_m = [{low:e}, {high:e}] must ascend, lie between 1e-6 and 1e8 N m, and span a factor of 1e9 at most"))
}

/// The largest current of a law from the lowest torque up to any other.
struct Most {
    /// Upper ends of the pieces of torque, ascending, and the largest current up to there.
    pieces: Vec<(f64, f64)>,
}

impl Most {
    fn of(law: &Law, [low, high]: [f64; 2]) -> Self {
        let span = libm::log(high / low);
        let count = (span / PIECE).ceil().max(1.0);
        let (mut from, mut most, mut pieces) = (low, 0.0f64, Vec::new());
        while from < high {
            let next = (low * libm::exp(span * (pieces.len() + 1) as f64 / count)).max(from.next_up());
            let to = if pieces.len() as f64 + 1.5 > count { high } else { next.min(high) };
            most = most.max(law.enclose([low, high], Interval::new(from, to))[0].high);
            pieces.push((to, most));
            from = to;
        }
        Most { pieces }
    }

    fn up_to(&self, torque: f64) -> f64 {
        let k = self.pieces.partition_point(|(to, _)| *to < torque).min(self.pieces.len() - 1);
        self.pieces[k].1
    }
}

/// Number of cells that prove that no point gives a torque from `least` on with (1 − ε) times the current of the law, or less.
fn no_better(circuit: &Circuit, least: f64, most: &Most, tolerance: f64) -> Option<usize> {
    let share = Interval::point(1.0) - Interval::point(tolerance);
    let allowed = |torque: f64| (share * Interval::point(most.up_to(torque))).high;
    let mut open = vec![circuit.coordinates(allowed(f64::INFINITY))?];
    let mut seen = 0;
    while let Some(cell) = open.pop() {
        seen += 1;
        let e = circuit.enclose(cell);
        if e.torque_n_m.high < least || e.current_rms_a.low > allowed(e.torque_n_m.high) {
            continue;
        }
        let width = |i: Interval| if i.high.is_finite() { (i.high - i.low) / (i.high + i.low) } else { 1.0 };
        let k = usize::from(width(cell[1]) > width(cell[0]));
        // A cell that cannot be cut further is an operating point, or the origin's neighbour by rounding.
        if seen > CELLS || width(cell[k]) < 1e-12 || cell[k].high < 1e-12 {
            return None;
        }
        let middle = match cell[k] {
            Interval { low, high } if high.is_finite() => 0.5 * (low + high),
            Interval { low, .. } => 4.0 * low.max(0.25 * FIRST_SLIP),
        };
        for half in [Interval::new(cell[k].low, middle), Interval::new(middle, cell[k].high)] {
            let mut part = cell;
            part[k] = half;
            open.push(part);
        }
    }
    Some(seen)
}

impl MtpaDesign {
    /// Number of boxes that prove the way from one witness to the next; none when it is not proven.
    pub(super) fn way(&self, from: &Witness, to: &Witness) -> Option<usize> {
        let (one, tolerance) = (Interval::point(1.0), Interval::point(self.tolerance));
        let holds = |a: [f64; 2], b: [f64; 2], first: bool| {
            let e = self.circuit.enclose([0, 1].map(|k| Interval::new(a[k].min(b[k]), a[k].max(b[k]))));
            // Torques below the first witness's own are given by it.
            let low = if first { from.torque_n_m } else { e.torque_n_m.low.max(from.torque_n_m) };
            let high = e.torque_n_m.high.min(to.torque_n_m);
            if low > high {
                return true;
            }
            let [current, slip] = self.law.enclose(self.torque_n_m, Interval::new(low, high));
            let off = (slip - e.slip_rad_s).magnitude();
            ((one + tolerance) * current - e.current_rms_a).low > 0.0 && (tolerance * e.slip_rad_s - off).low > 0.0
        };
        let mut open = vec![(from.at, to.at, true, HALVES)];
        let mut boxes = 0;
        while let Some((a, b, first, left)) = open.pop() {
            boxes += 1;
            if !holds(a, b, first) {
                let left = left.checked_sub(1)?;
                let middle = [0, 1].map(|k| 0.5 * (a[k] + b[k]));
                open.extend([(middle, b, false, left), (a, middle, first, left)]);
            }
        }
        Some(boxes)
    }
}

impl Claim for MtpaDesign {
    fn obligations<F: Field>(&self, c: &Constants<F>) -> Result<Vec<Obligation<F>>, String> {
        if let Some(complaint) = self.circuit.complaint() {
            return Err(complaint);
        }
        let [low, high] = self.torque_n_m;
        let ordered = self.points.windows(2).all(|p| p[0].torque_n_m < p[1].torque_n_m);
        let ends = [self.points.first(), self.points.last()].map(|p| p.map_or(f64::NAN, |p| p.torque_n_m));
        if !(ordered && ends == [low, high] && low > 0.0) {
            return Err("the points must ascend from one end of the range of torque to the other".into());
        }
        if !(self.tolerance > 0.0 && self.tolerance < 1.0) {
            return Err("the tolerance must lie between 0 and 1".into());
        }
        in_reach(self.torque_n_m)?;
        if self.points.len() > POINTS_MAX {
            return Err(format!("{} points are more than the {POINTS_MAX} that are decided", self.points.len()));
        }
        if let Some(parameter) = self.circuit.foreign(c) {
            return Err(format!("{parameter} of the circuit is not the machine's"));
        }
        if self.points.iter().any(|w| !w.at.iter().all(|x| *x > 0.0)) {
            return Err("the coordinates of a witness must be positive".into());
        }
        let mut obligations = Vec::new();
        let mut positive = |name: String, value: f64| obligations.push(Obligation::Positive(name, F::from_f64(value)));
        let count = |found: Option<usize>| found.map_or(-1.0, |n| n as f64);
        for Witness { torque_n_m: torque, at } in &self.points {
            let given = self.circuit.enclose(at.map(Interval::point)).torque_n_m;
            positive(format!("torque of the witness at {torque} N m"), (given - Interval::point(*torque)).low);
        }
        for pair in self.points.windows(2) {
            let name = format!("boxes that show enough from {} to {} N m", pair[0].torque_n_m, pair[1].torque_n_m);
            positive(name, count(self.way(&pair[0], &pair[1])));
        }
        let most = Most::of(&self.law, self.torque_n_m);
        let cells = no_better(&self.circuit, low, &most, self.tolerance);
        positive("cells that show that less is too little".into(), count(cells));
        Ok(obligations)
    }
}

#[cfg(test)]
mod tests {
    use super::super::circuit::Aqdm;
    use super::super::request::{LawKind, MtpaRequest, design};
    use super::super::t_circuit::TCircuit;
    use super::*;
    use crate::{Certificate, DesignError, DesignModel, LinearMachine};

    fn request(torque_n_m: [f64; 2]) -> MtpaRequest {
        MtpaRequest { torque_n_m, tolerance: 0.01, law: LawKind::Series, points: 9, aqdm: None }
    }

    fn plant() -> DesignModel {
        DesignModel::Machine(LinearMachine::kwon_table_iv())
    }

    #[test]
    fn laws_of_table_v_are_proven_within_one_percent_from_1_to_510_newton_metres() {
        let circuit = Circuit::Aqdm(Aqdm::kwon_table_v());
        let (design, certificate) = design(plant(), circuit, &request([1.0, 510.0])).unwrap();
        certificate.check().unwrap();
        // Current 2 % more or less than the least is not within 1 % of it; neither is a slip 2 % off.
        for (current, slip) in [(0.02, 0.0), (-0.02, 0.0), (0.0, 0.02), (0.0, -0.02)] {
            let mut off = design.clone();
            let Law::Series { current: i, slip: w } = &mut off.law else { panic!("a series was asked for") };
            (i[0], w[0]) = (i[0] + current, w[0] + slip);
            assert!(Certificate::seal(plant(), off).is_err(), "{current} {slip}");
        }
        // A law that is right at every witness and 2 % off between two of them: what the listed torques alone would not show.
        let mut bent = design.clone();
        let Law::Series { current, .. } = &mut bent.law else { panic!("a series was asked for") };
        current.resize(65, 0.0);
        current[64] = 0.02;
        let node =
            |k: i32| (0.5 * (510f64.ln() + 510f64.ln() * (std::f64::consts::PI * (f64::from(k) + 0.5) / 64.0).cos())).exp();
        let mut torques: Vec<f64> = (0..64).step_by(4).map(node).chain([1.0, 510.0]).collect();
        torques.sort_by(f64::total_cmp);
        let witness = |torque_n_m: f64| Witness {
            torque_n_m,
            at: super::super::for_torque(&circuit, torque_n_m * (1.0 + 1e-9)).unwrap().at,
        };
        bent.points = torques.into_iter().map(witness).collect();
        let off = |t: f64| bent.law.at([1.0, 510.0], t)[0] / design.law.at([1.0, 510.0], t)[0] - 1.0;
        assert!(bent.points[1..16].iter().all(|w| off(w.torque_n_m).abs() < 1e-9));
        assert!(Certificate::seal(plant(), bent).is_err());
    }

    #[test]
    fn a_linear_machine_needs_the_current_of_the_closed_form() {
        let circuit = TCircuit::linear(0.159, 0.0042, 0.0915, 2);
        let torque = |current: f64| 1.5 * 2.0 * 0.0915 * 0.0915 / (0.0915 + 0.0042) * current * current;
        let circuit = Circuit::T(circuit);
        let below = |current: f64| {
            let most = Most { pieces: vec![(torque(12.0), current)] };
            no_better(&circuit, torque(12.0), &most, 0.0)
        };
        assert!(below(11.999).is_some());
        assert!(below(12.001).is_none(), "a point of 12 A gives this torque");
    }

    #[test]
    fn printed_kind_of_laws_says_how_far_off_it_is() {
        let circuit = Circuit::Aqdm(Aqdm::kwon_table_v());
        let kwon = MtpaRequest { law: LawKind::Kwon, ..request([1.0, 510.0]) };
        let error = design(plant(), circuit, &kwon).unwrap_err();
        assert!(matches!(&error, DesignError::Infeasible { feasible, .. } if feasible.contains("a tolerance of")), "{error}");
        let moderate = MtpaRequest { tolerance: 0.04, ..kwon };
        let moderate = MtpaRequest { torque_n_m: [20.0, 400.0], ..moderate };
        super::super::request::design(plant(), circuit, &moderate).unwrap().1.check().unwrap();
    }
}
