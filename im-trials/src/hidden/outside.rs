//! Effects that no library of diagnosis holds: torques, resistances, voltages and sensors of odd forms.
//!
//! They are here to find out whether an effect can be learned that nobody wrote. Each form is its own, and none is a spline.

use super::chance::Chance;
use super::effect::EffectKind;
use super::machine::CatalogueMachine;
use std::f64::consts::{PI, TAU};

/// A step in time with soft corners, from 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SoftStep {
    /// Its middle, s.
    pub at_s: f64,
    /// How long it takes, s.
    pub width_s: f64,
    /// What it goes to.
    pub height: f64,
}

impl SoftStep {
    fn random(height: f64, chance: &mut Chance) -> Self {
        Self { at_s: chance.between(0.5, 1.4), width_s: chance.between(0.05, 0.25), height }
    }

    fn at(&self, t: f64) -> f64 {
        self.height / (1.0 + (-4.0 * (t - self.at_s) / self.width_s).exp())
    }
}

/// The odd effects of one machine; none by default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outside {
    /// Cogging: slots, torque (N m) and phase (rad) of a trapezoid over the angle.
    pub cogging: Option<(f64, f64, f64)>,
    /// A cam on the shaft: torque of its bump (N m), where it is and how wide (rad).
    pub cam: Option<(f64, f64, f64)>,
    /// An eddy-current brake: largest torque (N m) and the speed at which it is reached (rad/s).
    pub eddy_brake: Option<(f64, f64)>,
    /// Cold grease: torque at the start (N m), and the time in which it goes (s).
    pub grease: Option<(f64, f64)>,
    /// A connector that gives way: stator resistance, as a part of it.
    pub contact: Option<SoftStep>,
    /// A joint of the end ring that opens: rotor resistance, as a part of it.
    pub ring_joint: Option<SoftStep>,
    /// The DC link sags with the current: part lost at the current (A).
    pub sag: Option<(f64, f64)>,
    /// Modulation near its end: part of the voltage lost at this speed (rad/s), with the fourth power.
    pub overmodulation: Option<(f64, f64)>,
    /// The supply dips and recovers: depth, middle and width (s).
    pub dip: Option<(f64, f64, f64)>,
    /// Cross-saturation: part of the stator leakage lost at this magnetizing current (A).
    pub cross: Option<(f64, f64)>,
    /// An encoder disc off centre: part of the speed, and the phase (rad).
    pub eccentric: Option<(f64, f64)>,
    /// A tachogenerator that bends: part lost at this speed (rad/s), with the square.
    pub bent_tacho: Option<(f64, f64)>,
}

impl Outside {
    /// Torque against positive rotation, N m.
    pub fn torque_nm(&self, speed: f64, angle: f64, t: f64) -> f64 {
        let mut torque = 0.0;
        if let Some((slots, nm, phase)) = self.cogging {
            torque += nm * (2.5 * (slots * angle + phase).sin()).clamp(-1.0, 1.0);
        }
        if let Some((nm, place, width)) = self.cam {
            let off = (angle - place + PI).rem_euclid(TAU) - PI;
            torque += nm / (1.0 + (off / width).powi(4));
        }
        if let Some((nm, critical)) = self.eddy_brake {
            let y = speed / critical;
            torque += 2.0 * nm * y / (1.0 + y * y);
        }
        if let Some((nm, time_s)) = self.grease {
            // Against motion, without a jump at standstill.
            torque += nm * (-t / time_s).exp() * (speed / 2.0).tanh();
        }
        torque
    }

    /// Factor of the stator resistance.
    pub fn stator_factor(&self, t: f64) -> f64 {
        1.0 + self.contact.map_or(0.0, |s| s.at(t))
    }

    /// Factor of the rotor resistance.
    pub fn rotor_factor(&self, t: f64) -> f64 {
        1.0 + self.ring_joint.map_or(0.0, |s| s.at(t))
    }

    /// Factor of the stator leakage.
    pub fn leakage_factor(&self, magnetizing_a: f64) -> f64 {
        self.cross.map_or(1.0, |(part, at_a)| {
            let y = (magnetizing_a / at_a).powi(2);
            1.0 - part * 2.0 * y / (1.0 + y)
        })
    }

    /// Factor of the voltage.
    pub fn voltage_factor(&self, current_a: f64, speed: f64, t: f64) -> f64 {
        let mut factor = 1.0;
        if let Some((part, at_a)) = self.sag {
            factor -= part * (1.0 + (current_a / at_a).powi(2)).sqrt();
        }
        if let Some((part, at)) = self.overmodulation {
            factor -= part * (speed / at).powi(4).min(3.0);
        }
        if let Some((depth, middle, width)) = self.dip {
            factor -= depth / ((t - middle) / width).cosh();
        }
        factor
    }

    /// The speed that the sensor shows.
    pub fn shown_speed(&self, speed: f64, angle: f64) -> f64 {
        let mut shown = speed;
        if let Some((part, phase)) = self.eccentric {
            shown *= 1.0 / (1.0 + part * (angle + phase).cos());
        }
        if let Some((part, at)) = self.bent_tacho {
            shown *= 1.0 - part * (speed / at).powi(2);
        }
        shown
    }

    /// Puts an effect in: its form and its parameters. `size` is in the meaning of [`EffectKind`].
    pub(super) fn add(
        &mut self,
        m: &CatalogueMachine,
        kind: EffectKind,
        size: f64,
        chance: &mut Chance,
    ) -> (&'static str, Vec<(&'static str, f64)>) {
        let (torque, speed) = (size * m.rated_torque_nm, m.synchronous_speed_rad_s());
        match kind {
            EffectKind::CoggingTorque => {
                let slots = [18.0, 24.0, 30.0, 36.0, 42.0][chance.one_of(5)];
                self.cogging = Some((slots, torque, chance.between(0.0, TAU)));
                ("trapezoid over the angle", vec![("slots", slots), ("torque_nm", torque)])
            }
            EffectKind::CamLoad => {
                let width = chance.between(0.5, 0.9);
                self.cam = Some((torque, chance.between(0.0, TAU), width));
                ("one bump per turn", vec![("torque_nm", torque), ("width_rad", width)])
            }
            EffectKind::EddyCurrentBrake => {
                let critical = speed * chance.between(0.15, 0.35);
                self.eddy_brake = Some((torque, critical));
                ("largest at a critical speed", vec![("torque_nm", torque), ("critical_rad_s", critical)])
            }
            EffectKind::ColdGrease => {
                let time_s = chance.between(0.3, 0.8);
                self.grease = Some((torque, time_s));
                ("goes with time", vec![("torque_nm", torque), ("time_s", time_s)])
            }
            EffectKind::LooseConnector => {
                let step = SoftStep::random(size, chance);
                self.contact = Some(step);
                ("soft step in time", vec![("part", size), ("at_s", step.at_s), ("width_s", step.width_s)])
            }
            EffectKind::OpenRingJoint => {
                let step = SoftStep::random(size, chance);
                self.ring_joint = Some(step);
                ("soft step in time", vec![("part", size), ("at_s", step.at_s), ("width_s", step.width_s)])
            }
            EffectKind::DcLinkSag => {
                self.sag = Some((size, m.rated_current_a()));
                ("hyperbola over the current", vec![("part", size)])
            }
            EffectKind::Overmodulation => {
                self.overmodulation = Some((size, speed));
                ("fourth power of the speed", vec![("part", size)])
            }
            EffectKind::SupplyDip => {
                let (middle, width) = (chance.between(0.6, 1.3), chance.between(0.15, 0.4));
                self.dip = Some((size, middle, width));
                ("dips and recovers", vec![("part", size), ("at_s", middle), ("width_s", width)])
            }
            EffectKind::CrossSaturation => {
                self.cross = Some((size, m.rated_magnetizing_a()));
                ("stator leakage over the magnetizing current", vec![("part", size)])
            }
            EffectKind::EccentricEncoder => {
                self.eccentric = Some((size, chance.between(0.0, TAU)));
                ("once per turn", vec![("part", size)])
            }
            _ => {
                self.bent_tacho = Some((size, speed));
                ("square of the speed", vec![("part", size)])
            }
        }
    }
}
