//! What is known of an effect beside its physics: parameters, card, states, and how it shows.

use crate::error::Bound;

/// What a parameter of an effect does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Zero switches the effect off.
    Strength,
    /// Estimated together with the strength; without meaning when the effect is off.
    Shape,
    /// A small whole number: tried over its usual range, not refitted.
    Order,
    /// Part of the definition; not estimated.
    Fixed,
}

/// The machine quantity that a parameter is measured in, so that typical sizes fit a machine of any rating.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScaleOf {
    /// A pure number, or a time in s.
    One,
    /// Rated phase voltage, peak, V.
    Voltage,
    /// Rated phase current, peak, A.
    Current,
    /// Rated rotor flux, Vs.
    Flux,
    /// Rated torque, Nm.
    Torque,
    /// One over the rated torque, 1/Nm.
    PerTorque,
    /// Rated torque over squared synchronous speed, Nm s².
    TorquePerSpeedSquared,
    /// Rated current over rated voltage, S.
    Conductance,
    /// Synchronous mechanical speed, rad/s.
    Speed,
    /// 1 K/s at rated stator copper loss, K/J.
    StatorHeating,
    /// 1 K/s at rated rotor copper loss, K/J.
    RotorHeating,
}

/// One parameter of an effect.
#[derive(Clone, Copy, Debug)]
pub struct ParameterInfo {
    /// Key in files, with the unit.
    pub key: &'static str,
    /// Unit; empty for pure numbers.
    pub unit: &'static str,
    /// What it means.
    pub meaning: &'static str,
    /// What it does.
    pub role: Role,
    /// What it is measured in.
    pub scale: ScaleOf,
    /// Value that the effect starts from, in units of `scale`; zero for strengths.
    pub default: f64,
    /// Smallest and largest usual magnitude, in units of `scale`. Beyond ten times the largest a fit is not believed.
    pub typical: (f64, f64),
    /// The hard limit, in the parameter's own unit.
    pub bound: Bound,
}

/// What people should know about an effect.
#[derive(Clone, Copy, Debug)]
pub struct Card {
    /// A short name.
    pub title: &'static str,
    /// What it is, with its equation.
    pub what: &'static str,
    /// How it shows in measurements.
    pub shows: &'static str,
    /// What it is mistaken for, and how to tell the two apart.
    pub rivals: &'static [(&'static str, &'static str)],
    /// A test that excites it.
    pub test: &'static str,
    /// Where it acts.
    pub place: &'static str,
    /// Where the model comes from.
    pub source: &'static str,
}

/// The part of the model that an effect acts in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// The currents at given flux linkages.
    FluxMap,
    /// Voltage drops of the windings, and further rotor branches.
    Windings,
    /// Temperatures.
    Temperature,
    /// Torque balance and shaft.
    Mechanics,
    /// The voltage between command and terminals.
    Voltage,
    /// The command as a whole, once per sample.
    Command,
    /// Sensors.
    Sensors,
}

/// How an effect shows in a sinusoidal steady state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SteadyState {
    /// Meter readings of steady states determine it.
    Shows,
    /// The readings are as without it, or as with other parameters.
    Hides,
    /// There is no sinusoidal steady state with it: currents or speed ripple.
    Ripples,
}

/// What simulation, scoring and reports must know of an effect.
#[derive(Clone, Copy, Debug)]
pub struct About {
    /// Where it acts.
    pub place: Place,
    /// How it shows in a sinusoidal steady state.
    pub steady_state: SteadyState,
    /// Whether it is fixed to the shaft or the rotor: what it does then depends on the angle at which a recording happens to begin.
    pub fixed_to_shaft: bool,
    /// Whether it answers to its leading shape parameter in a narrow band, as a resonance does: a score then tries more values.
    pub resonant: bool,
    /// Whether derivatives by the strengths exist where the effect sets in.
    pub smooth_onset: bool,
}

impl About {
    /// The usual effect at a place.
    pub const fn at(place: Place) -> Self {
        Self { place, steady_state: SteadyState::Shows, fixed_to_shaft: false, resonant: false, smooth_onset: true }
    }
}

/// What a state of an effect is: how it turns with the frame, and where it begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StateKind {
    /// A space vector in the stator frame: two numbers.
    Vector,
    /// The speed of a mass: begins with the rotor's.
    Speed,
    /// A number that settles in a steady state.
    Settles,
    /// A number that drifts over many periods and is held in a steady state: a temperature.
    Drifts,
}

/// One state that an effect adds to the machine.
#[derive(Clone, Copy, Debug)]
pub struct StateInfo {
    /// Name with unit, as in tables.
    pub name: &'static str,
    /// What it is.
    pub kind: StateKind,
}

impl StateInfo {
    /// How many numbers it is.
    pub const fn width(&self) -> usize {
        if matches!(self.kind, StateKind::Vector) { 2 } else { 1 }
    }

    /// How many numbers these states are.
    pub(crate) const fn width_of(states: &[Self]) -> usize {
        let (mut sum, mut k) = (0, 0);
        while k < states.len() {
            sum += states[k].width();
            k += 1;
        }
        sum
    }
}
