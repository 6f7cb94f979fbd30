//! The certificate of laws of maximum torque per ampere: near the least current there is, at every listed torque.
//!
//! For a torque T, with I and ω_s by the laws and a tolerance ε:
//!
//! * *enough*: an operating point, the witness, gives at least T with at most (1 + ε)I, its slip within ε of ω_s;
//! * *not more than needed*: no operating point gives T with (1 − ε)I or less. The plane of operating points is cut into cells
//!   until each provably has less torque or more current (branch and bound over intervals rounded outwards).
//!
//! Curves with exponentials have no exact value; enclosures prove as much. Between the listed torques nothing is claimed.

use super::circuit::{AirGap, Circuit};
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
    /// Slips up to which the q-d circuit is searched for better points, electrical rad/s; the T circuit is searched at all.
    pub slip_max_rad_per_s: f64,
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
const CELLS: usize = 200_000;

/// Number of cells that prove that no point gives `torque` with `current` (rms) or less; none when it cannot be proven.
fn no_better(circuit: &Circuit, torque: f64, current: f64, slip_max: f64) -> Option<usize> {
    let mut open = vec![circuit.coordinates(current, slip_max)];
    let mut seen = 0;
    while let Some(cell) = open.pop() {
        seen += 1;
        let e = circuit.enclose(cell);
        if e.torque_n_m.high < torque || e.current_rms_a.low > current {
            continue;
        }
        let width = |i: Interval| (i.high - i.low) / (i.high + i.low);
        let k = usize::from(width(cell[1]) > width(cell[0]));
        // A cell that cannot be cut further is an operating point, or the origin's neighbour by rounding.
        if seen > CELLS || width(cell[k]) < 1e-12 || cell[k].high < 1e-12 {
            return None;
        }
        let middle = 0.5 * (cell[k].low + cell[k].high);
        for half in [Interval::new(cell[k].low, middle), Interval::new(middle, cell[k].high)] {
            let mut part = cell;
            part[k] = half;
            open.push(part);
        }
    }
    Some(seen)
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
        if !(self.tolerance > 0.0 && self.tolerance < 1.0 && self.slip_max_rad_per_s > 0.0) {
            return Err("the tolerance must lie between 0 and 1, the largest slip must be positive".into());
        }
        if F::from_f64(f64::from(self.circuit.pole_pairs())) != c.n_p {
            return Err("the circuit has other pole pairs than the machine".into());
        }
        let one = Interval::point(1.0);
        let tolerance = Interval::point(self.tolerance);
        let mut obligations = Vec::new();
        let mut positive = |what: &str, torque: f64, value: f64| {
            obligations.push(Obligation::Positive(format!("{what} at {torque} N m"), F::from_f64(value)));
        };
        for point in &self.points {
            let torque = point.torque_n_m;
            let witness = self.circuit.enclose(point.at.map(Interval::point));
            let [current, slip] = self.law.enclose(self.torque_n_m, torque);
            let off = (slip - witness.slip_rad_per_s).magnitude();
            positive("torque of the witness", torque, (witness.torque_n_m - Interval::point(torque)).low);
            positive("current of the law that reaches it", torque, ((one + tolerance) * current - witness.current_rms_a).low);
            positive("slip of the law near it", torque, (tolerance * witness.slip_rad_per_s - off).low);
            let less = ((one - tolerance) * current).high;
            let cells = no_better(&self.circuit, torque, less, self.slip_max_rad_per_s);
            let name = format!("cells that show that {less:e} A rms is too little");
            positive(&name, torque, cells.map_or(-1.0, |n| n as f64));
        }
        Ok(obligations)
    }
}

#[cfg(test)]
mod tests {
    use super::super::circuit::Aqdm;
    use super::super::request::{LawKind, MtpaRequest, design};
    use super::super::t_circuit::TCircuit;
    use super::*;
    use crate::{Certificate, DesignError, Machine, Plant};

    fn request(torque_n_m: [f64; 2]) -> MtpaRequest {
        let (tolerance, slip_max_rad_per_s) = (0.01, 500.0);
        MtpaRequest { torque_n_m, tolerance, law: LawKind::Series, slip_max_rad_per_s, points: 9, aqdm: None }
    }

    fn plant() -> Plant {
        Plant::Machine(Machine::kwon_table_iv())
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
    }

    #[test]
    fn a_linear_machine_needs_the_current_of_the_closed_form() {
        let circuit = TCircuit::linear(0.159, 0.0042, 0.0915, 2);
        let torque = |current: f64| 1.5 * 2.0 * 0.0915 * 0.0915 / (0.0915 + 0.0042) * current * current;
        let circuit = Circuit::T(circuit);
        assert!(no_better(&circuit, torque(12.0), 11.999, 500.0).is_some());
        assert!(no_better(&circuit, torque(12.0), 12.001, 500.0).is_none(), "a point of 12 A gives this torque");
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
