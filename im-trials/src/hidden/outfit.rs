//! Fits a machine out with hidden effects: from names and strengths to physical parameters.

use super::chance::Chance;
use super::curve::{FluxCurve, Shape, random_leakage_shape, random_main_shape};
use super::effect::{EffectKind, Strength};
use super::machine::CatalogueMachine;
use super::outside::Outside;
use super::plane::{Symmetric, Vector};
use super::plant::{
    Cage, DryFriction, Heating, HiddenPlant, Hysteresis, Inverter, Ripple, Shaft, Slots, SpeedFilter, StrayLoad, Windage,
};
use super::sensors::Sensors;
use super::slow_core::SlowCore;
use super::smooth_sign::SmoothSign;
use std::f64::consts::TAU;

/// A machine with its effects, its actuator and its sensors.
#[derive(Clone, Debug, PartialEq)]
pub struct Outfit {
    /// The machine.
    pub plant: HiddenPlant,
    /// Factor from commanded to applied voltage.
    pub voltage_gain: f64,
    /// Factor of each phase's voltage beside that.
    pub phase_voltage: [f64; 3],
    /// What one leg of the inverter makes too much, V, once it modulates, and from which command on it does.
    pub leg_too_long: Option<(usize, f64, f64)>,
    /// Samples by which the voltage is late.
    pub delay_samples: f64,
    /// The sensors.
    pub sensors: Sensors,
    /// What stands in front of those of the current.
    pub slow_current_sensor: Option<SlowCore>,
    /// Angle of the shaft when a recording begins, rad.
    pub start_angle_rad: f64,
    /// The effects and their parameters, for the record.
    pub truth: Vec<HiddenEffect>,
}

/// An effect as it was put in.
#[derive(Clone, Debug, PartialEq)]
pub struct HiddenEffect {
    /// Which one.
    pub kind: EffectKind,
    /// Its size, in the meaning of [`EffectKind`].
    pub size: f64,
    /// Its parameters: names and values.
    pub parameters: Vec<(&'static str, f64)>,
    /// Form drawn by chance, where there are several.
    pub form: &'static str,
}

impl Outfit {
    /// The machine without effects.
    pub fn base(machine: &CatalogueMachine) -> Self {
        let own = 0.2;
        let cage = Cage { resistance_ohm: machine.rotor_resistance_ohm, leakage_h: own * machine.rotor_leakage_h };
        let plant = HiddenPlant {
            pole_pairs: f64::from(machine.pole_pairs),
            stator_resistance: Symmetric::isotropic(machine.stator_resistance_ohm),
            stator_leakage: FluxCurve::linear(machine.stator_leakage_h),
            stator_leakage_extra: Symmetric::default(),
            rotor_leakage: FluxCurve::linear((1.0 - own) * machine.rotor_leakage_h),
            cages: [cage; 2],
            cage_count: 1,
            rotor_unbalance: Symmetric::isotropic(1.0),
            main: FluxCurve::linear(machine.magnetizing_h),
            main_stretch: None,
            slots: None,
            iron_ohm: None,
            hysteresis: None,
            stator_heating: None,
            rotor_heating: None,
            inertia_kg_m2: machine.inertia_kg_m2,
            friction_nm_s: machine.friction_nm_s,
            dry_friction: None,
            windage: None,
            stray_load: None,
            shaft: None,
            ripple: None,
            inverter: None,
            speed_filter: None,
            outside: Outside::default(),
        };
        Self {
            plant,
            voltage_gain: 1.0,
            phase_voltage: [1.0; 3],
            leg_too_long: None,
            delay_samples: 0.0,
            sensors: Sensors::default(),
            slow_current_sensor: None,
            start_angle_rad: 0.0,
            truth: Vec::new(),
        }
    }

    /// The machine with effects. Forms and sizes vary with the seed, sizes by ±15 %.
    pub fn new(machine: &CatalogueMachine, effects: &[(EffectKind, Strength)], seed: u64) -> Self {
        let mut outfit = Self::base(machine);
        // Skin effect divides the rotor leakage anew and comes before what builds on that.
        let mut ordered = effects.to_vec();
        ordered.sort_by_key(|(kind, _)| *kind != EffectKind::RotorSkinEffect);
        for (kind, strength) in ordered {
            let mut chance = Chance::new(seed, kind.name());
            let size = strength.size(kind) * chance.between(0.85, 1.15);
            if size != 0.0 {
                outfit.add(machine, kind, size, &mut chance);
            }
        }
        outfit.truth.sort_by_key(|effect| effects.iter().position(|(kind, _)| *kind == effect.kind));
        outfit
    }

    fn add(&mut self, m: &CatalogueMachine, kind: EffectKind, size: f64, chance: &mut Chance) {
        let (form, parameters) = match kind {
            EffectKind::MainFluxSaturation => self.main_saturation(m, size, chance),
            EffectKind::LeakageFluxSaturation => self.leakage_saturation(m, size, chance),
            EffectKind::RotorSkinEffect => self.skin(m, size, chance),
            EffectKind::IronLoss => {
                let back_emf_v = m.rated_electrical_rad_s() * m.rated_rotor_flux_vs;
                let ohm = 1.5 * back_emf_v * back_emf_v / (size * m.rated_power_w());
                self.plant.iron_ohm = Some(ohm);
                ("resistance across the magnetizing branch", vec![("resistance_ohm", ohm)])
            }
            EffectKind::StatorHeating => {
                let loss_w = 1.5 * m.rated_current_a().powi(2) * m.stator_resistance_ohm;
                let two_bodies = chance.one_of(2) == 1;
                let (heating, list) = heating(0.0039, size, loss_w, two_bodies, chance);
                self.plant.stator_heating = Some(heating);
                (if two_bodies { "two bodies" } else { "one body" }, list)
            }
            EffectKind::RotorHeating => {
                let rotor_a = (m.rated_current_a().powi(2) - m.rated_magnetizing_a().powi(2)).sqrt();
                let loss_w = 1.5 * rotor_a.powi(2) * m.rotor_resistance_ohm;
                let (heating, list) = heating(0.0040, size, loss_w, false, chance);
                self.plant.rotor_heating = Some(heating);
                ("one body", list)
            }
            EffectKind::CoulombFriction => self.dry_friction(m, size, chance),
            EffectKind::Windage => {
                let windage = Windage {
                    torque_nm: size * m.rated_torque_nm,
                    speed_rad_s: m.synchronous_speed_rad_s(),
                    exponent: chance.between(1.8, 2.3),
                };
                self.plant.windage = Some(windage);
                ("power law", vec![("torque_nm", windage.torque_nm), ("exponent", windage.exponent)])
            }
            EffectKind::InverterNonlinearity => {
                let lost_v = size * m.rated_voltage_v;
                let inverter = Inverter {
                    lost_v,
                    width_a: m.rated_current_a() * chance.between(0.01, 0.04),
                    sign: SmoothSign::random(chance),
                    resistance_ohm: 0.1 * lost_v / m.rated_current_a() * chance.between(0.5, 1.5),
                };
                self.plant.inverter = Some(inverter);
                (
                    inverter.sign.name(),
                    vec![("lost_v", lost_v), ("width_a", inverter.width_a), ("resistance_ohm", inverter.resistance_ohm)],
                )
            }
            EffectKind::VoltageDelay => {
                self.delay_samples = size;
                ("late", vec![("samples", size)])
            }
            EffectKind::VoltageGain => {
                self.voltage_gain = 1.0 + chance.sign() * size;
                ("all phases alike", vec![("gain", self.voltage_gain)])
            }
            EffectKind::SupplyUnbalance => {
                // A phase loaded by single-phase consumers: its source is low, and the load's cable stands in series with the machine.
                let phase = chance.one_of(3);
                self.phase_voltage = [1.0 + 0.5 * size; 3];
                self.phase_voltage[phase] = 1.0 - size;
                let cable_ohm = size * chance.between(0.0, 0.1) * m.stator_resistance_ohm;
                let axis = Vector::polar(1.0, TAU / 3.0 * phase as f64);
                self.plant.stator_resistance =
                    self.plant.stator_resistance + Symmetric::along_across(axis, 2.0 / 3.0 * cable_ohm, 0.0);
                (["phase a", "phase b", "phase c"][phase], vec![("low", size), ("cable_ohm", cable_ohm)])
            }
            EffectKind::VoltageOffset => {
                // The upper pulses of one leg are too long, as soon as there are any.
                let (phase, sign) = (chance.one_of(3), chance.sign());
                let too_much_v = sign * size * m.rated_voltage_v;
                let from_v = m.rated_voltage_v * chance.between(0.005, 0.02);
                self.leg_too_long = Some((phase, too_much_v, from_v));
                (["leg a", "leg b", "leg c"][phase], vec![("too_much_v", too_much_v), ("from_v", from_v)])
            }
            EffectKind::CurrentSensorGain => {
                self.sensors.two_phases = chance.one_of(2) == 1;
                let (phase, sign) = (chance.one_of(2), chance.sign());
                self.sensors.gain[phase] += sign * size;
                self.sensors.gain[1 - phase] += sign * size * chance.between(-0.4, 0.0);
                let g = self.sensors.gain;
                (self.phases_form(), vec![("gain_a", g[0]), ("gain_b", g[1])])
            }
            EffectKind::CurrentSensorOffset => {
                self.sensors.two_phases |= chance.one_of(2) == 1;
                let (phase, sign) = (chance.one_of(2), chance.sign());
                self.sensors.offset_a[phase] = sign * size * m.rated_current_a();
                self.sensors.offset_a[1 - phase] = self.sensors.offset_a[phase] * chance.between(-0.5, 0.5);
                let o = self.sensors.offset_a;
                (self.phases_form(), vec![("offset_a_a", o[0]), ("offset_b_a", o[1])])
            }
            EffectKind::SpeedSensorLag => {
                let form = match chance.one_of(3) {
                    0 => {
                        self.plant.speed_filter = Some(SpeedFilter::OnePole(size));
                        "one pole"
                    }
                    1 => {
                        self.plant.speed_filter = Some(SpeedFilter::TwoPoles(0.5 * size));
                        "two poles"
                    }
                    _ => {
                        self.sensors.encoder_window_s = Some(2.0 * size);
                        "encoder window"
                    }
                };
                (form, vec![("delay_s", size)])
            }
            EffectKind::StatorAsymmetry => {
                let phase = chance.one_of(3);
                let axis = Vector::polar(1.0, TAU / 3.0 * phase as f64);
                let extra_ohm = size * m.stator_resistance_ohm;
                let extra_h = size * chance.between(0.0, 0.5) * m.stator_leakage_h;
                let along = |k: f64| Symmetric::along_across(axis, 2.0 / 3.0 * k, 0.0);
                self.plant.stator_resistance = self.plant.stator_resistance + along(extra_ohm);
                self.plant.stator_leakage_extra = along(extra_h);
                (["phase a", "phase b", "phase c"][phase], vec![("extra_ohm", extra_ohm), ("extra_leakage_h", extra_h)])
            }
            EffectKind::RotorAsymmetry => {
                let axis_rad = chance.between(0.0, TAU);
                let raised = Symmetric::along_across(Vector::polar(1.0, axis_rad), 2.0 / 3.0 * size, 0.0);
                self.plant.rotor_unbalance = self.plant.rotor_unbalance + raised;
                ("one rotor phase", vec![("extra", size), ("axis_rad", axis_rad)])
            }
            EffectKind::ShaftCompliance => self.shaft(m, size, chance),
            EffectKind::LoadTorqueRipple => {
                let order = 1.0 + chance.one_of(2) as f64;
                let first = (size * m.rated_torque_nm, chance.between(0.0, TAU));
                let harmonic = if chance.one_of(2) == 1 { chance.between(0.2, 0.4) } else { 0.0 };
                let second = (harmonic * first.0, chance.between(0.0, TAU));
                self.plant.ripple = Some(Ripple { order, first, second });
                ("periodic in the angle", vec![("order", order), ("torque_nm", first.0), ("second_nm", second.0)])
            }
            EffectKind::RotorSlotting => {
                let count = [22.0, 26.0, 28.0, 33.0, 40.0][chance.one_of(5)];
                self.plant.slots = Some(Slots { count, depth: size });
                ("permeance", vec![("slots", count), ("depth", size)])
            }
            EffectKind::HysteresisLoss => {
                let h = Hysteresis {
                    current_a: size * m.rated_magnetizing_a(),
                    flux_vs: m.rated_rotor_flux_vs * chance.between(0.15, 0.35),
                };
                self.plant.hysteresis = Some(h);
                ("follows the path of the flux", vec![("current_a", h.current_a), ("flux_vs", h.flux_vs)])
            }
            EffectKind::StrayLoadTorque => {
                let stray = StrayLoad {
                    torque_nm: size * m.rated_torque_nm,
                    current_a: m.rated_current_a(),
                    speed_rad_s: m.synchronous_speed_rad_s(),
                    exponent: chance.between(0.4, 1.0),
                };
                self.plant.stray_load = Some(stray);
                ("braking torque", vec![("torque_nm", stray.torque_nm), ("exponent", stray.exponent)])
            }
            EffectKind::CurrentSensorSaturation => {
                let level = m.rated_current_a() / size;
                self.sensors.clip_a = Some(level);
                ("clipped phases", vec![("level_a", level)])
            }
            EffectKind::SlowCurrentSensor => {
                let slow = SlowCore { part: size, time_s: chance.between(1e-3, 5e-3) };
                self.slow_current_sensor = Some(slow);
                ("eddy currents in the core", vec![("part", slow.part), ("time_s", slow.time_s)])
            }
            EffectKind::SpeedSensorScale => {
                self.sensors.speed_scale = 1.0 + chance.sign() * size;
                let tachogenerator = chance.one_of(2) == 1;
                if tachogenerator {
                    self.sensors.speed_droop_s = 0.1 * size / m.synchronous_speed_rad_s();
                }
                let form = if tachogenerator { "tachogenerator" } else { "factor" };
                (form, vec![("scale", self.sensors.speed_scale), ("droop_s", self.sensors.speed_droop_s)])
            }
            EffectKind::MagneticAnisotropy => {
                let axis_rad = chance.between(0.0, TAU);
                let axis = Vector::polar(1.0, axis_rad);
                self.plant.main_stretch = Some(Symmetric::along_across(axis, (1.0 + size).sqrt(), (1.0 - size).sqrt()));
                ("easy axis of the stator", vec![("difference", size), ("axis_rad", axis_rad)])
            }
            odd => self.plant.outside.add(m, odd, size, chance),
        };
        self.truth.push(HiddenEffect { kind, size, parameters, form });
    }

    /// What the source makes of a commanded voltage.
    pub fn supplied(&self, command: Vector) -> Vector {
        let amplified = command * self.voltage_gain;
        if self.phase_voltage == [1.0; 3] && self.leg_too_long.is_none() {
            return amplified;
        }
        let phases = amplified.phases();
        let mut sent = [0, 1, 2].map(|k| self.phase_voltage[k] * phases[k]);
        if let Some((phase, too_much_v, from_v)) = self.leg_too_long {
            sent[phase] += too_much_v * (command.length() / from_v).tanh();
        }
        // The star point takes what the three have in common.
        Vector::from_phases(sent)
    }

    fn phases_form(&self) -> &'static str {
        if self.sensors.two_phases { "two sensors" } else { "three sensors" }
    }

    fn main_saturation(&mut self, m: &CatalogueMachine, size: f64, chance: &mut Chance) -> Drawn {
        let (shape, final_slope) = random_main_shape(chance);
        // At rated flux the magnetizing current is larger by as much as the inductance is smaller.
        let at_a = m.rated_magnetizing_a() / (1.0 - size);
        let curve = FluxCurve::with_drop(m.magnetizing_h, size, at_a, shape, final_slope);
        self.plant.main = curve;
        (shape.name(), curve_parameters(&curve))
    }

    fn leakage_saturation(&mut self, m: &CatalogueMachine, size: f64, chance: &mut Chance) -> Drawn {
        let (shape, final_slope) = random_leakage_shape(chance);
        let at_a = 2.0 * m.rated_current_a();
        let bent = |inductance_h: f64, drop: f64, shape: Shape| {
            FluxCurve::with_drop(inductance_h, drop.min(0.9 * (1.0 - final_slope)), at_a, shape, final_slope)
        };
        let stator = bent(m.stator_leakage_h, size, shape);
        let shared_h = self.plant.rotor_leakage.unsaturated_h;
        let rotor = bent(shared_h, size * m.rotor_leakage_h / shared_h, shape);
        self.plant.stator_leakage = stator;
        self.plant.rotor_leakage = rotor;
        (shape.name(), curve_parameters(&stator))
    }

    fn skin(&mut self, m: &CatalogueMachine, size: f64, chance: &mut Chance) -> Drawn {
        // Two cages whose conductances add up to 1/R_r and whose leakage at low slip is L_lr.
        let own_h = chance.between(0.5, 0.65) * m.rotor_leakage_h;
        let outer_h = 0.05 * own_h;
        let inner_h = (own_h - size * size * outer_h) / ((1.0 - size) * (1.0 - size));
        let inner = Cage { resistance_ohm: m.rotor_resistance_ohm / (1.0 - size), leakage_h: inner_h };
        let outer = Cage { resistance_ohm: m.rotor_resistance_ohm / size, leakage_h: outer_h };
        self.plant.rotor_leakage = FluxCurve::linear(m.rotor_leakage_h - own_h);
        self.plant.cages = [inner, outer];
        self.plant.cage_count = 2;
        (
            "double cage",
            vec![
                ("inner_ohm", inner.resistance_ohm),
                ("inner_h", inner.leakage_h),
                ("outer_ohm", outer.resistance_ohm),
                ("outer_h", outer.leakage_h),
            ],
        )
    }

    fn dry_friction(&mut self, m: &CatalogueMachine, size: f64, chance: &mut Chance) -> Drawn {
        let dry = DryFriction {
            torque_nm: size * m.rated_torque_nm,
            sign_width_rad_s: m.synchronous_speed_rad_s() * chance.between(0.002, 0.006),
            sign: SmoothSign::random(chance),
            excess: chance.between(0.1, 0.5),
            fade_rad_s: m.synchronous_speed_rad_s() * chance.between(0.02, 0.05),
            rational: chance.one_of(2) == 1,
        };
        self.plant.dry_friction = Some(dry);
        (
            dry.sign.name(),
            vec![
                ("torque_nm", dry.torque_nm),
                ("sign_width_rad_s", dry.sign_width_rad_s),
                ("stribeck_excess", dry.excess),
                ("stribeck_rad_s", dry.fade_rad_s),
            ],
        )
    }

    fn shaft(&mut self, m: &CatalogueMachine, size: f64, chance: &mut Chance) -> Drawn {
        let load = chance.between(0.35, 0.65) * m.inertia_kg_m2;
        let reduced = load * (m.inertia_kg_m2 - load) / m.inertia_kg_m2;
        let resonance_rad_s = TAU * 20.0 / size.sqrt();
        let stiffness = resonance_rad_s * resonance_rad_s * reduced;
        let rated_twist = m.rated_torque_nm / stiffness;
        let shaft = Shaft {
            load_inertia_kg_m2: load,
            stiffness_nm: stiffness,
            hardening_per_rad2: chance.between(0.0, 0.1) / (rated_twist * rated_twist),
            damping_nm_s: 2.0 * chance.between(0.01, 0.03) * resonance_rad_s * reduced,
        };
        self.plant.shaft = Some(shaft);
        (
            "hardening spring",
            vec![
                ("load_inertia_kg_m2", load),
                ("stiffness_nm_per_rad", stiffness),
                ("hardening_per_rad2", shaft.hardening_per_rad2),
                ("damping_nm_s", shaft.damping_nm_s),
            ],
        )
    }
}

type Drawn = (&'static str, Vec<(&'static str, f64)>);

fn curve_parameters(curve: &FluxCurve) -> Vec<(&'static str, f64)> {
    let mut list = vec![("unsaturated_h", curve.unsaturated_h)];
    if let Some(s) = curve.saturation {
        list.push(("final_slope", s.final_slope));
        list.push(("current_a", s.current_a));
        if let Shape::Knee { width } = s.shape {
            list.push(("width", width));
        }
    }
    list
}

fn heating(
    coefficient: f64,
    size: f64,
    loss_w: f64,
    two_bodies: bool,
    chance: &mut Chance,
) -> (Heating, Vec<(&'static str, f64)>) {
    let resistance = size / (coefficient * loss_w);
    let time_constant_s = chance.between(4.0, 12.0);
    let capacity = time_constant_s / resistance;
    let heating = Heating {
        coefficient_per_k: coefficient,
        capacity_j_per_k: capacity,
        resistance_k_per_w: resistance,
        second: two_bodies.then(|| (chance.between(3.0, 6.0) * capacity, chance.between(0.2, 0.5) * resistance)),
    };
    let list = vec![("capacity_j_per_k", capacity), ("resistance_k_per_w", resistance), ("coefficient_per_k", coefficient)];
    (heating, list)
}
