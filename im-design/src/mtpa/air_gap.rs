//! What a search for the least current asks of a circuit, whatever stands in it.

use crate::exact::Interval;

/// The magnetizing branch and the rotor, seen from the air gap.
pub trait AirGap {
    /// Rms stator current (A) and torque (N m) at a level and a slip frequency (electrical rad/s, positive). The level, in which both
    /// are explicit, is the peak air-gap flux linkage (Wb) of the q-d model and x (A, peak) of the T circuit ([`t_circuit`](super::t_circuit)).
    fn operate(&self, level: f64, slip_rad_s: f64) -> (f64, f64);

    /// The levels that are searched, positive, ascending.
    fn levels(&self) -> [f64; 2];

    /// Peak air-gap flux linkage, Wb.
    fn flux_vs(&self, level: f64, slip_rad_s: f64) -> f64;

    /// The same at all points of two coordinates of the circuit's own: ranges that contain them.
    fn enclose(&self, cell: [Interval; 2]) -> Enclosure;

    /// Coordinates that hold every operating point of currents up to one (rms, A), at any slip; `None` where the circuit sets no bound,
    /// as one whose magnetizing current does not rise with flux.
    fn coordinates(&self, current_rms_a: f64) -> Option<[Interval; 2]>;

    /// The coordinates of one operating point.
    fn coordinates_of(&self, level: f64, slip_rad_s: f64) -> [f64; 2];
}

/// What all operating points of a cell lie in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Enclosure {
    /// Rms stator current, A.
    pub current_rms_a: Interval,
    /// Torque, N m.
    pub torque_n_m: Interval,
    /// Slip, electrical rad/s.
    pub slip_rad_s: Interval,
}
