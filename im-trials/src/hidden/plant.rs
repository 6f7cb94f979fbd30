//! The machine with its hidden effects, in branch currents.
//!
//! States are the currents of the branches of the T circuit: stator current in stator coordinates, one or two rotor cages in
//! coordinates that turn with the rotor, whose angle is a state too. The voltage `e` of the node where they meet, which is also the rate
//! of the main flux, follows from Kirchhoff's current law, differentiated:
//!
//! stator     L_s' di_s/dt = u − R_s i_s − e
//! cage k     L_c' D + L_k di_k/dt = −R_k i_k − (e − jωψ_m),   D = Σ di_k/dt   (as seen from the rotor)
//! node       di_s/dt + D + jω Σ i_k = di_m/dt + di_h/dt,      e = M(i_m) di_m/dt + ω_m ∂ψ_m/∂θ
//!
//! M and L' are incremental inductance matrices. With iron loss the node has a resistance and i_m is a state of its own:
//! e = R_fe (i_s + Σ i_k − i_h − i_m).

use super::curve::FluxCurve;
use super::outside::Outside;
use super::plane::{Symmetric, Vector};
use super::smooth_sign::SmoothSign;

/// Length of the state vector.
pub const STATES: usize = 20;
/// The state vector.
pub type State = [f64; STATES];

/// Places of the states.
pub mod at {
    /// Stator current, stator coordinates, A.
    pub const STATOR: usize = 0;
    /// Cage currents, rotor coordinates, A.
    pub const CAGES: [usize; 2] = [2, 4];
    /// Magnetizing current where iron loss makes it a state, A.
    pub const MAIN: usize = 6;
    /// Hysteresis current, A.
    pub const HYSTERESIS: usize = 8;
    /// Speed of the rotor, rad/s.
    pub const SPEED: usize = 10;
    /// Angle of the rotor, rad.
    pub const ANGLE: usize = 11;
    /// Speed of the load where the shaft is compliant, rad/s.
    pub const LOAD_SPEED: usize = 12;
    /// Twist of the shaft, rad.
    pub const TWIST: usize = 13;
    /// Temperature rise of the stator winding and of what lies behind it, K.
    pub const STATOR_HEAT: usize = 14;
    /// Temperature rise of the rotor cage, K.
    pub const ROTOR_HEAT: usize = 16;
    /// States of the speed sensor's filter, rad/s.
    pub const SPEED_FILTER: usize = 17;
    /// Time since the recording began, s.
    pub const TIME: usize = 19;
}

/// One rotor cage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cage {
    /// Resistance, Ω.
    pub resistance_ohm: f64,
    /// Leakage of this cage alone, H.
    pub leakage_h: f64,
}

/// Rotor slots that modulate the main inductance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slots {
    /// Slots around the rotor.
    pub count: f64,
    /// Relative modulation.
    pub depth: f64,
}

/// Hysteresis: a current that follows the path of the flux, whatever its rate.
///
/// di_h = (I_c dψ − i_h |dψ|) / ψ_c
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hysteresis {
    /// Coercive current I_c, A.
    pub current_a: f64,
    /// Flux path ψ_c over which the current turns, V s.
    pub flux_vs: f64,
}

/// Heating of a winding: one or two bodies in a row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Heating {
    /// Resistance rise per kelvin, 1/K.
    pub coefficient_per_k: f64,
    /// Heat capacity of the winding, J/K.
    pub capacity_j_per_k: f64,
    /// Thermal resistance from the winding outwards, K/W.
    pub resistance_k_per_w: f64,
    /// Heat capacity and outer resistance of the second body; `None` is ambient.
    pub second: Option<(f64, f64)>,
}

/// Dry friction T_c s(ω/ω_c) (1 + S f(ω/ω_s)).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DryFriction {
    /// Coulomb level, N m.
    pub torque_nm: f64,
    /// Width of the sign, rad/s.
    pub sign_width_rad_s: f64,
    /// Form of the sign.
    pub sign: SmoothSign,
    /// Stribeck excess at rest.
    pub excess: f64,
    /// Speed at which the excess fades, rad/s.
    pub fade_rad_s: f64,
    /// Whether it fades as 1/(1 + x²) rather than exp(−|x|).
    pub rational: bool,
}

/// Windage T = k |ω|^p sgn ω, scaled at a reference speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Windage {
    /// Torque at the reference speed, N m.
    pub torque_nm: f64,
    /// Reference speed, rad/s.
    pub speed_rad_s: f64,
    /// Exponent.
    pub exponent: f64,
}

/// Stray-load loss: a braking torque with the square of the current.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StrayLoad {
    /// Torque at the reference current and speed, N m.
    pub torque_nm: f64,
    /// Reference current, A peak.
    pub current_a: f64,
    /// Reference speed, rad/s.
    pub speed_rad_s: f64,
    /// Exponent of the speed in the torque.
    pub exponent: f64,
}

/// A compliant shaft between rotor and load: T = K δ (1 + c δ²) + D dδ/dt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shaft {
    /// Inertia of the load, kg m².
    pub load_inertia_kg_m2: f64,
    /// Stiffness, N m/rad.
    pub stiffness_nm: f64,
    /// Hardening, 1/rad².
    pub hardening_per_rad2: f64,
    /// Damping, N m s/rad.
    pub damping_nm_s: f64,
}

/// Load torque periodic in the shaft angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ripple {
    /// Periods per turn.
    pub order: f64,
    /// Amplitude and phase of the fundamental, N m and rad.
    pub first: (f64, f64),
    /// Amplitude and phase of the second harmonic, N m and rad.
    pub second: (f64, f64),
}

/// Voltage lost in the inverter, per phase.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inverter {
    /// Lost voltage at large current, V.
    pub lost_v: f64,
    /// Width of the sign, A.
    pub width_a: f64,
    /// Form of the sign.
    pub sign: SmoothSign,
    /// Resistance of the switches, Ω.
    pub resistance_ohm: f64,
}

/// Filter of the speed sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SpeedFilter {
    /// One pole with this time constant, s.
    OnePole(f64),
    /// Two equal poles with this time constant each, s.
    TwoPoles(f64),
}

/// Everything that is constant during a run.
#[derive(Clone, Debug, PartialEq)]
#[expect(missing_docs, reason = "each field is named like the type or parameter it holds")]
pub struct HiddenPlant {
    pub pole_pairs: f64,
    /// Stator resistance at the start, Ω.
    pub stator_resistance: Symmetric,
    pub stator_leakage: FluxCurve,
    /// Constant stator leakage beside the curve, H.
    pub stator_leakage_extra: Symmetric,
    /// Leakage that all cages share.
    pub rotor_leakage: FluxCurve,
    pub cages: [Cage; 2],
    pub cage_count: usize,
    /// Relative rotor resistance in rotor coordinates; the unit matrix is symmetric.
    pub rotor_unbalance: Symmetric,
    pub main: FluxCurve,
    /// ψ = P f(P i): the unit matrix is isotropic.
    pub main_stretch: Option<Symmetric>,
    pub slots: Option<Slots>,
    pub iron_ohm: Option<f64>,
    pub hysteresis: Option<Hysteresis>,
    pub stator_heating: Option<Heating>,
    pub rotor_heating: Option<Heating>,
    pub inertia_kg_m2: f64,
    pub friction_nm_s: f64,
    pub dry_friction: Option<DryFriction>,
    pub windage: Option<Windage>,
    pub stray_load: Option<StrayLoad>,
    pub shaft: Option<Shaft>,
    pub ripple: Option<Ripple>,
    pub inverter: Option<Inverter>,
    pub speed_filter: Option<SpeedFilter>,
    pub outside: Outside,
}

/// Where the power of the machine goes at one instant, W, and what is stored, J.
#[derive(Clone, Copy, Debug, Default)]
pub struct Power {
    /// From the terminals into the windings.
    pub electrical_w: f64,
    /// Lost in windings and iron.
    pub heat_w: f64,
    /// Torque of the air gap times speed.
    pub shaft_w: f64,
    /// Field energy.
    pub stored_j: f64,
}

fn vector(x: &State, place: usize) -> Vector {
    Vector::new(x[place], x[place + 1])
}

fn store(x: &mut State, place: usize, v: Vector) {
    x[place] = v.x;
    x[place + 1] = v.y;
}

/// Flux of the main path and what hangs on it.
struct MainFlux {
    flux: Vector,
    incremental: Symmetric,
    /// ∂ψ/∂θ, V s/rad.
    by_angle: Vector,
    /// Reluctance torque of the slots, N m.
    slot_torque_nm: f64,
    coenergy_j: f64,
}

impl HiddenPlant {
    fn main_flux(&self, current: Vector, angle: f64) -> MainFlux {
        let (mut flux, mut incremental, coenergy_j);
        if self.main.saturation.is_none() && self.main_stretch.is_none() {
            let l = self.main.unsaturated_h;
            flux = current * l;
            incremental = Symmetric::isotropic(l);
            coenergy_j = 0.5 * l * current.dot(current);
        } else {
            let stretch = self.main_stretch.unwrap_or(Symmetric::isotropic(1.0));
            let inner = stretch * current;
            let point = self.main.at(inner.length());
            flux = stretch * (inner * point.chord_h);
            incremental = Symmetric::along_across(inner, point.slope_h, point.chord_h).between(stretch);
            coenergy_j = point.coenergy_j;
        }
        let mut by_angle = Vector::ZERO;
        let mut slot_torque_nm = 0.0;
        let mut scale = 1.0;
        if let Some(slots) = self.slots {
            let (sin, cos) = (slots.count * angle).sin_cos();
            scale = 1.0 + slots.depth * cos;
            let slope = -slots.depth * slots.count * sin;
            by_angle = flux * slope;
            slot_torque_nm = 1.5 * slope * coenergy_j;
            flux = flux * scale;
            incremental = incremental * scale;
        }
        MainFlux { flux, incremental, by_angle, slot_torque_nm, coenergy_j: coenergy_j * scale }
    }

    fn cages(&self) -> &[Cage] {
        &self.cages[..self.cage_count]
    }

    /// Voltage at the terminals when the inverter is commanded `command`.
    fn terminal_voltage(&self, command: Vector, current: Vector) -> Vector {
        let Some(inverter) = self.inverter else { return command };
        let lost = current.phases().map(|i| inverter.lost_v * inverter.sign.of(i / inverter.width_a));
        command - Vector::from_phases(lost) - current * inverter.resistance_ohm
    }

    fn friction_torque(&self, speed: f64, current: Vector) -> f64 {
        let mut torque = self.friction_nm_s * speed;
        if let Some(dry) = self.dry_friction {
            let y = speed / dry.fade_rad_s;
            let fade = if dry.rational { 1.0 / (1.0 + y * y) } else { (-y.abs()).exp() };
            torque += dry.torque_nm * dry.sign.of(speed / dry.sign_width_rad_s) * (1.0 + dry.excess * fade);
        }
        if let Some(windage) = self.windage {
            let y = speed / windage.speed_rad_s;
            torque += windage.torque_nm * y * y.abs().powf(windage.exponent - 1.0);
        }
        if let Some(stray) = self.stray_load {
            let y = speed / stray.speed_rad_s;
            let load = current.dot(current) / (stray.current_a * stray.current_a);
            torque += stray.torque_nm * load * SmoothSign::Algebraic.of(20.0 * y) * y.abs().powf(stray.exponent);
        }
        torque
    }

    /// Rates of change of the states, with the balance of power if asked for.
    fn rates(&self, x: &State, command: Vector, load_nm: f64, power: Option<&mut Power>) -> State {
        let mut d = [0.0; STATES];
        let speed = x[at::SPEED];
        let omega = self.pole_pairs * speed;
        let (sin, cos) = (self.pole_pairs * x[at::ANGLE]).sin_cos();
        let frame = (cos, sin);

        let i_s = vector(x, at::STATOR);
        let i_h = vector(x, at::HYSTERESIS);
        let time = x[at::TIME];
        d[at::TIME] = 1.0;
        let hot_s = self.stator_heating.map_or(0.0, |h| h.coefficient_per_k * x[at::STATOR_HEAT]);
        let hot_s = hot_s + self.outside.stator_factor(time);
        let hot_r = self.rotor_heating.map_or(0.0, |h| h.coefficient_per_k * x[at::ROTOR_HEAT]);
        let hot_r = hot_r + self.outside.rotor_factor(time);

        // Rotor: currents and resistive drops, turned into stator coordinates.
        let mut i_r = Vector::ZERO;
        let mut drops = [Vector::ZERO; 2];
        let mut drop_over_leakage = Vector::ZERO;
        let mut inverse_leakage = 0.0;
        let mut rotor_heat_w = 0.0;
        for (k, cage) in self.cages().iter().enumerate() {
            let own = vector(x, at::CAGES[k]);
            let drop = (self.rotor_unbalance * own) * (hot_r * cage.resistance_ohm);
            rotor_heat_w += 1.5 * own.dot(drop);
            i_r = i_r + own.turn(frame);
            drops[k] = drop.turn(frame);
            drop_over_leakage = drop_over_leakage + drops[k] * (1.0 / cage.leakage_h);
            inverse_leakage += 1.0 / cage.leakage_h;
        }

        let i_m = if self.iron_ohm.is_some() { vector(x, at::MAIN) } else { i_s + i_r - i_h };
        let main = self.main_flux(i_m, x[at::ANGLE]);
        let motion = main.flux.quarter_turn() * omega;

        let leakage = self.stator_leakage.incremental(i_s) + self.stator_leakage_extra;
        let stator_inverse = (leakage * self.outside.leakage_factor(i_m.length())).inverse();
        let common = self.rotor_leakage.incremental(i_r);
        let rotor_inverse = (common + Symmetric::isotropic(1.0 / inverse_leakage)).inverse();
        let main_inverse = main.incremental.inverse();

        let voltage = self.terminal_voltage(command, i_s) * self.outside.voltage_factor(i_s.length(), speed, time);
        let stator_drop = (self.stator_resistance * i_s) * hot_s;
        let stator_source = voltage - stator_drop;
        // Σ over the cages of their sources, as one source behind the rotor's inductance.
        let rotor_source = motion - drop_over_leakage * (1.0 / inverse_leakage);

        // Node voltage.
        let e = if let Some(iron_ohm) = self.iron_ohm {
            (i_s + i_r - i_h - i_m) * iron_ohm
        } else {
            let mut matrix = stator_inverse + rotor_inverse + main_inverse;
            let known = stator_inverse * stator_source
                + rotor_inverse * rotor_source
                + i_r.quarter_turn() * omega
                + main_inverse * (main.by_angle * speed);
            match self.hysteresis {
                None => matrix.inverse() * known,
                Some(h) => {
                    // |e| is on both sides; its share is small, so that a few rounds settle it.
                    matrix = matrix + Symmetric::isotropic(h.current_a / h.flux_vs);
                    let inverse = matrix.inverse();
                    let mut e = inverse * known;
                    for _ in 0..4 {
                        e = inverse * (known + i_h * (e.length() / h.flux_vs));
                    }
                    e
                }
            }
        };
        if let Some(h) = self.hysteresis {
            store(&mut d, at::HYSTERESIS, (e * h.current_a - i_h * e.length()) * (1.0 / h.flux_vs));
        }
        if self.iron_ohm.is_some() {
            store(&mut d, at::MAIN, main_inverse * (e - main.by_angle * speed));
        }

        // Branch currents.
        store(&mut d, at::STATOR, stator_inverse * (stator_source - e));
        let total = rotor_inverse * (rotor_source - e);
        let shared = common * total;
        for (k, cage) in self.cages().iter().enumerate() {
            let rate = (motion - e - drops[k] - shared) * (1.0 / cage.leakage_h);
            store(&mut d, at::CAGES[k], rate.turn_back(frame));
        }

        // Torque on the rotor from the currents of the rotor.
        let torque = 1.5 * self.pole_pairs * i_r.cross(main.flux) + main.slot_torque_nm;
        self.mechanics(x, &mut d, torque, i_s, load_nm);

        let stator_heat_w = 1.5 * i_s.dot(stator_drop);
        heat(self.stator_heating, x, &mut d, at::STATOR_HEAT, stator_heat_w, true);
        heat(self.rotor_heating, x, &mut d, at::ROTOR_HEAT, rotor_heat_w, false);

        match self.speed_filter {
            Some(SpeedFilter::OnePole(tau)) => d[at::SPEED_FILTER] = (speed - x[at::SPEED_FILTER]) / tau,
            Some(SpeedFilter::TwoPoles(tau)) => {
                d[at::SPEED_FILTER] = (speed - x[at::SPEED_FILTER]) / tau;
                d[at::SPEED_FILTER + 1] = (x[at::SPEED_FILTER] - x[at::SPEED_FILTER + 1]) / tau;
            }
            None => {}
        }

        if let Some(power) = power {
            let i_fe = if self.iron_ohm.is_some() { i_s + i_r - i_h - i_m } else { Vector::ZERO };
            let leakage = |curve: &FluxCurve, i: Vector| {
                let p = curve.at(i.length());
                p.chord_h * i.dot(i) - p.coenergy_j
            };
            let own: f64 = self
                .cages()
                .iter()
                .enumerate()
                .map(|(k, cage)| 0.5 * cage.leakage_h * vector(x, at::CAGES[k]).dot(vector(x, at::CAGES[k])))
                .sum();
            *power = Power {
                electrical_w: 1.5 * voltage.dot(i_s),
                heat_w: stator_heat_w + rotor_heat_w + 1.5 * e.dot(i_fe + i_h),
                shaft_w: torque * speed,
                stored_j: 1.5
                    * (i_m.dot(main.flux) - main.coenergy_j
                        + leakage(&self.stator_leakage, i_s)
                        + 0.5 * i_s.dot(self.stator_leakage_extra * i_s)
                        + leakage(&self.rotor_leakage, i_r)
                        + own),
            };
        }
        d
    }

    fn mechanics(&self, x: &State, d: &mut State, torque: f64, current: Vector, load_nm: f64) {
        let speed = x[at::SPEED];
        d[at::ANGLE] = speed;
        let load_angle = x[at::ANGLE] - x[at::TWIST];
        let load = load_nm
            + self.ripple.map_or(0.0, |r| {
                r.first.0 * (r.order * load_angle + r.first.1).sin()
                    + r.second.0 * (2.0 * r.order * load_angle + r.second.1).sin()
            });
        let odd = self.outside.torque_nm(speed, x[at::ANGLE], x[at::TIME]);
        let drive = torque - self.friction_torque(speed, current) - odd;
        match self.shaft {
            None => {
                d[at::SPEED] = (drive - load) / self.inertia_kg_m2;
                d[at::LOAD_SPEED] = d[at::SPEED];
            }
            Some(shaft) => {
                let (twist, rate) = (x[at::TWIST], speed - x[at::LOAD_SPEED]);
                let passed =
                    shaft.stiffness_nm * twist * (1.0 + shaft.hardening_per_rad2 * twist * twist) + shaft.damping_nm_s * rate;
                d[at::TWIST] = rate;
                d[at::SPEED] = (drive - passed) / (self.inertia_kg_m2 - shaft.load_inertia_kg_m2);
                d[at::LOAD_SPEED] = (passed - load) / shaft.load_inertia_kg_m2;
            }
        }
    }

    /// Rates of change of the states under a commanded voltage and a load torque.
    pub fn derivative(&self, x: &State, command: Vector, load_nm: f64) -> State {
        self.rates(x, command, load_nm, None)
    }

    /// The balance of power at one instant.
    pub fn power(&self, x: &State, command: Vector) -> Power {
        let mut power = Power::default();
        self.rates(x, command, 0.0, Some(&mut power));
        power
    }

    /// Torque of the air gap, N m.
    pub fn torque_nm(&self, x: &State) -> f64 {
        let frame = (self.pole_pairs * x[at::ANGLE]).sin_cos();
        let frame = (frame.1, frame.0);
        let i_r = (0..self.cage_count).fold(Vector::ZERO, |sum, k| sum + vector(x, at::CAGES[k]).turn(frame));
        let i_m =
            if self.iron_ohm.is_some() { vector(x, at::MAIN) } else { vector(x, at::STATOR) + i_r - vector(x, at::HYSTERESIS) };
        let main = self.main_flux(i_m, x[at::ANGLE]);
        1.5 * self.pole_pairs * i_r.cross(main.flux) + main.slot_torque_nm
    }

    /// Stator current of a state, A.
    pub fn stator_current(x: &State) -> Vector {
        vector(x, at::STATOR)
    }

    /// Speed as the sensor's filter passes it on, rad/s.
    pub fn sensed_speed(&self, x: &State) -> f64 {
        match self.speed_filter {
            None => self.outside.shown_speed(x[at::SPEED], x[at::ANGLE]),
            Some(SpeedFilter::OnePole(_)) => x[at::SPEED_FILTER],
            Some(SpeedFilter::TwoPoles(_)) => x[at::SPEED_FILTER + 1],
        }
    }
}

fn heat(heating: Option<Heating>, x: &State, d: &mut State, place: usize, power_w: f64, has_second: bool) {
    let Some(h) = heating else { return };
    let behind = if h.second.is_some() && has_second { x[place + 1] } else { 0.0 };
    let outwards = (x[place] - behind) / h.resistance_k_per_w;
    d[place] = (power_w - outwards) / h.capacity_j_per_k;
    if let (Some((capacity, resistance)), true) = (h.second, has_second) {
        d[place + 1] = (outwards - behind / resistance) / capacity;
    }
}
