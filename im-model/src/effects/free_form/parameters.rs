//! What a free-form effect is called, its parameters, and its card.

use crate::effects::Card;

/// How many coefficients a free-form curve has.
pub const COEFFICIENTS: usize = 8;

/// The quantity that a free-form effect adds to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Acts {
    /// Torque against positive rotation, Nm.
    Torque,
    /// Torque against whatever rotation there is, Nm.
    Friction,
    /// Stator resistance, as a part of it.
    StatorResistance,
    /// Rotor resistance, as a part of it.
    RotorResistance,
    /// Stator voltage, as a part of the command.
    Voltage,
    /// Stator voltage turned by a small angle in the sense of rotation, rad.
    VoltageAngle,
    /// Current along the main flux, as a part of ψ_m/L_m.
    MagnetizingCurrent,
    /// Flux in the stator that turns with the shaft, as a part of |ψ_s|; a vector, of which the curve is the part along the axis of phase a.
    ShaftFlux,
    /// Current across the main flux, ahead of it in the sense of rotation: what a loss in the iron takes, A.
    LossCurrent,
    /// Current between the windings, as a part of (ψ_s − ψ_r)/(L_ls + L_lr): a leakage that falls.
    LeakageCurrent,
    /// What the current sensors of the phases show, as a part of it.
    CurrentSensor,
    /// What the speed sensor shows, as a part of it.
    SpeedSensor,
}

/// What a free-form effect depends on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Over {
    /// Mechanical speed, rad/s; its magnitude but for torques.
    Speed,
    /// Time since the recording began, s.
    Time,
    /// Magnitude of the stator current, A; of that of a phase for its sensor.
    Current,
    /// Magnitude of the slip frequency, electrical, rad/s.
    Slip,
    /// Magnitude of the main flux, Vs.
    Flux,
    /// Angle of the shaft.
    ShaftAngle,
    /// Direction of the main flux.
    FluxDirection,
    /// Time constant of a first-order lag through which a part of the quantity passes; its decadic logarithm in s.
    Lag,
}

impl Over {
    /// Whether it is an angle: the curve is a Fourier series.
    pub const fn is_angle(self) -> bool {
        matches!(self, Self::ShaftAngle | Self::FluxDirection)
    }
}

impl Acts {
    /// Whether a curve of it is over the magnitude of the variable: seen in a mirror a machine turns the other way and is the same, while its
    /// load need not be.
    pub const fn is_over_magnitude(self, over: Over) -> bool {
        matches!(over, Over::Speed | Over::Slip) && !matches!(self, Self::Torque)
    }
}

/// What is said of a quantity over a variable.
#[derive(Clone, Copy)]
pub(super) struct Row {
    pub(super) acts: Acts,
    pub(super) over: Over,
    /// The identifier in files.
    pub(super) name: &'static str,
    title: &'static str,
    what: &'static str,
}

const fn row(acts: Acts, over: Over, name: &'static str, title: &'static str, what: &'static str) -> Row {
    Row { acts, over, name, title, what }
}

/// Every quantity with the variables that it may depend on. **The list is the registry**: a new place is a line here and its hook.
#[rustfmt::skip]
pub(super) const ROWS: &[Row] = &[
    row(Acts::Torque, Over::Speed, "learned_torque_over_speed", "Torque over speed", "A torque that depends on speed: friction, a fan, a load of another form."),
    row(Acts::Torque, Over::ShaftAngle, "learned_torque_over_shaft_angle", "Torque over the shaft angle", "A torque that repeats with the turn of the shaft: slots, poles, a crank, a gear, an unbalance."),
    row(Acts::Torque, Over::Time, "learned_torque_over_time", "Torque over time", "A torque that changes with time: a load that is not as recorded."),
    row(Acts::Friction, Over::Time, "learned_friction_over_time", "Friction over time", "A torque against motion that changes with time: a bearing or a grease that warms, a brake that drags."),
    row(Acts::Torque, Over::Current, "learned_torque_over_current", "Torque over current", "A torque that depends on current: stray-load loss, a torque constant that bends."),
    row(Acts::StatorResistance, Over::Current, "learned_stator_resistance_over_current", "Stator resistance over current", "A voltage along the current: contacts, cables, devices of the inverter."),
    row(Acts::StatorResistance, Over::Time, "learned_stator_resistance_over_time", "Stator resistance over time", "A stator resistance that changes with time: heat, a contact."),
    row(Acts::RotorResistance, Over::Slip, "learned_rotor_resistance_over_slip", "Rotor resistance over slip frequency", "A rotor resistance that depends on slip frequency: skin effect of another form than one second cage."),
    row(Acts::RotorResistance, Over::Time, "learned_rotor_resistance_over_time", "Rotor resistance over time", "A rotor resistance that changes with time: heat, a bar or ring that gives way."),
    row(Acts::Voltage, Over::Speed, "learned_voltage_over_speed", "Voltage over speed", "A voltage error that depends on speed, and with it on frequency and modulation depth."),
    row(Acts::Voltage, Over::Time, "learned_voltage_over_time", "Voltage over time", "A voltage error that changes with time: the DC link, a transformer tap."),
    row(Acts::Voltage, Over::Current, "learned_voltage_over_current", "Voltage over current", "A voltage error that depends on current: the DC link or the supply sags."),
    row(Acts::Voltage, Over::Lag, "learned_voltage_over_lag", "Voltage through lags", "A voltage of which a part passes through first-order lags, of more than one time constant: filters, cables, the switching of the inverter."),
    row(Acts::VoltageAngle, Over::Speed, "learned_voltage_angle_over_speed", "Angle of the voltage over speed", "The voltage lags or leads by an angle that depends on speed: sampling, delays, filters."),
    row(Acts::MagnetizingCurrent, Over::Flux, "learned_magnetizing_current_over_flux", "Magnetizing current over flux", "A magnetizing current that grows otherwise than the flux: saturation."),
    row(Acts::MagnetizingCurrent, Over::ShaftAngle, "learned_magnetizing_current_over_shaft_angle", "Magnetizing current over the shaft angle", "An air gap that changes with the turn of the shaft: slots, an eccentric rotor."),
    row(Acts::MagnetizingCurrent, Over::FluxDirection, "learned_magnetizing_current_over_flux_direction", "Magnetizing current over the direction of the flux", "Axes of the stator that magnetize unequally: laminations with a grain, a joint, an oval bore."),
    row(Acts::ShaftFlux, Over::ShaftAngle, "learned_shaft_flux_over_shaft_angle", "Flux carried by the shaft", "A wave of flux that the rotor carries past the stator: its slots, an uneven cage, remanence."),
    row(Acts::LossCurrent, Over::Flux, "learned_loss_current_over_flux", "Loss current over flux", "A current in phase with the induced voltage that depends on flux: hysteresis, eddy currents."),
    row(Acts::LossCurrent, Over::Speed, "learned_loss_current_over_speed", "Loss current over speed", "A current in phase with the induced voltage that depends on speed: hysteresis, eddy currents, shorted turns."),
    row(Acts::LeakageCurrent, Over::Current, "learned_leakage_current_over_current", "Leakage over current", "A leakage that changes with current: tooth tips, slot bridges."),
    row(Acts::LeakageCurrent, Over::Flux, "learned_leakage_current_over_flux", "Leakage over flux", "A leakage that changes with the main flux: cross-saturation."),
    row(Acts::LeakageCurrent, Over::ShaftAngle, "learned_leakage_current_over_shaft_angle", "Leakage over the shaft angle", "A leakage that changes with the turn of the shaft: slots, a rotor fault."),
    row(Acts::CurrentSensor, Over::Current, "learned_current_sensor_over_current", "Current sensor over current", "A current sensor whose gain depends on current: a core that saturates."),
    row(Acts::CurrentSensor, Over::Lag, "learned_current_sensor_over_lag", "Current sensors through lags", "Current sensors that show a part through first-order lags, of more than one time constant: filters in front of the converter, eddy currents in the core."),
    row(Acts::SpeedSensor, Over::Lag, "learned_speed_sensor_over_lag", "Speed sensor through lags", "A speed sensor that shows a part through first-order lags, of more than one time constant: filters, an observer in the drive."),
    row(Acts::SpeedSensor, Over::Speed, "learned_speed_sensor_over_speed", "Speed sensor over speed", "A speed sensor whose gain depends on speed."),
    row(Acts::SpeedSensor, Over::ShaftAngle, "learned_speed_sensor_over_shaft_angle", "Speed sensor over the shaft angle", "A speed sensor whose gain changes over the turn: an encoder disc off centre, a bent coupling."),
];

/// The row of a quantity over a variable; the first for a pair that is not on the list.
pub(super) fn row_of(acts: Acts, over: Over) -> &'static Row {
    ROWS.iter().find(|r| (r.acts, r.over) == (acts, over)).unwrap_or(&ROWS[0])
}

#[cfg(feature = "std")]
mod table {
    use super::{Acts, COEFFICIENTS, Over};

    use crate::effects::{ParameterInfo, Role, ScaleOf};
    use crate::error::Bound;

    const PLAIN: [&str; COEFFICIENTS] = ["c1", "c2", "c3", "c4", "c5", "c6", "c7", "c8"];
    const TORQUES: [&str; COEFFICIENTS] = ["c1_nm", "c2_nm", "c3_nm", "c4_nm", "c5_nm", "c6_nm", "c7_nm", "c8_nm"];
    const CURRENTS: [&str; COEFFICIENTS] = ["c1_a", "c2_a", "c3_a", "c4_a", "c5_a", "c6_a", "c7_a", "c8_a"];
    const ANGLES: [&str; COEFFICIENTS] = ["c1_rad", "c2_rad", "c3_rad", "c4_rad", "c5_rad", "c6_rad", "c7_rad", "c8_rad"];

    /// Coefficients, their usual size, and where they must lie.
    fn coefficient(acts: Acts, over: Over) -> ([&'static str; COEFFICIENTS], &'static str, ScaleOf, (f64, f64), Bound) {
        // A part by which a quantity changes must leave something of it.
        let part = |lo, hi, most| (PLAIN, "", ScaleOf::One, (lo, hi), Bound::Within(-0.95, most));
        if over == Over::Lag {
            // Two lags in series are the difference of the two, each larger than the signal.
            return (PLAIN, "", ScaleOf::One, (0.02, 1.0), Bound::Within(-50.0, 50.0));
        }
        match acts {
            Acts::Torque | Acts::Friction => (TORQUES, "Nm", ScaleOf::Torque, (0.01, 0.5), Bound::Within(-1e6, 1e6)),
            Acts::StatorResistance | Acts::RotorResistance => part(0.02, 1.0, 50.0),
            Acts::Voltage => part(0.003, 0.2, 2.0),
            Acts::VoltageAngle => (ANGLES, "rad", ScaleOf::One, (0.003, 0.2), Bound::Within(-1.0, 1.0)),
            Acts::MagnetizingCurrent => part(0.02, 1.0, 50.0),
            Acts::ShaftFlux => part(0.001, 0.05, 0.95),
            Acts::LossCurrent => (CURRENTS, "A", ScaleOf::Current, (0.005, 0.2), Bound::Within(-1e6, 1e6)),
            Acts::LeakageCurrent => part(0.02, 1.0, 10.0),
            Acts::CurrentSensor => part(0.01, 0.5, 10.0),
            Acts::SpeedSensor => part(0.002, 0.1, 10.0),
        }
    }

    fn ends(over: Over) -> ([&'static str; 2], &'static str) {
        match over {
            Over::Speed | Over::Slip => (["from_rad_s", "to_rad_s"], "rad/s"),
            Over::Time => (["from_s", "to_s"], "s"),
            Over::Current => (["from_a", "to_a"], "A"),
            Over::Flux => (["from_vs", "to_vs"], "Vs"),
            Over::Lag => (["from_log10_s", "to_log10_s"], ""),
            Over::ShaftAngle | Over::FluxDirection => (["order", "order"], ""),
        }
    }

    pub(in super::super) fn table(acts: Acts, over: Over, range: (f64, f64), order: f64) -> Vec<ParameterInfo> {
        let (keys, unit, scale, typical, bound) = coefficient(acts, over);
        let meaning = if over.is_angle() { "Cosine and sine of each harmonic." } else { "Coefficient of a B-spline." };
        let strength = |key| ParameterInfo { key, unit, meaning, role: Role::Strength, scale, default: 0.0, typical, bound };
        let mut all: Vec<ParameterInfo> = keys.into_iter().map(strength).collect();
        let fixed = |key, unit, meaning, scale, default, bound| ParameterInfo {
            key,
            unit,
            meaning,
            role: Role::Fixed,
            scale,
            default,
            typical: (0.0, 1e9),
            bound,
        };
        let spread = "Size that the coefficients have before any data.";
        all.push(fixed("spread", unit, spread, scale, 0.5 * typical.1, Bound::Positive));
        let ([first, last], unit) = ends(over);
        if over.is_angle() {
            let order_bound = if over == Over::FluxDirection { Bound::Whole(1, 60) } else { Bound::Within(0.05, 200.0) };
            all.push(fixed(first, unit, "How often the fundamental repeats per turn.", ScaleOf::One, order, order_bound));
        } else {
            let place = match over {
                // From a nanosecond to a quarter of an hour.
                Over::Lag => Bound::Within(-9.0, 3.0),
                _ if acts.is_over_magnitude(over) => Bound::NotNegative,
                _ => Bound::Within(-1e9, 1e9),
            };
            all.push(fixed(first, unit, "Where the curve begins.", ScaleOf::One, range.0, place));
            all.push(fixed(last, unit, "Where the curve ends.", ScaleOf::One, range.1, place));
        }
        all
    }
}
#[cfg(feature = "std")]
pub(super) use table::table;

/// The names of the variable and of the quantity, with units.
#[cfg(feature = "std")]
pub(super) fn labels(acts: Acts, over: Over) -> (&'static str, &'static str) {
    let x = match over {
        Over::Speed if acts.is_over_magnitude(over) => "speed in either sense, rad/s",
        Over::Speed => "speed, rad/s",
        Over::Time => "time since the recording began, s",
        Over::Current => "stator current (peak), A",
        Over::Slip => "slip frequency, motoring or braking, rad/s",
        Over::Flux => "main flux, Vs",
        Over::ShaftAngle => "shaft angle, °",
        Over::FluxDirection => "direction of the flux, °",
        Over::Lag => "time constant, as log10 of s",
    };
    if over == Over::Lag {
        return (x, "part that passes through the lag");
    }
    let y = match acts {
        Acts::Torque => "torque against rotation, Nm",
        Acts::Friction => "torque against motion, Nm",
        Acts::StatorResistance => "stator resistance added, part of it",
        Acts::RotorResistance => "rotor resistance added, part of it",
        Acts::Voltage => "voltage added, part of it",
        Acts::VoltageAngle => "angle of the voltage in the sense of rotation, rad",
        Acts::MagnetizingCurrent => "magnetizing current added, part of it",
        Acts::ShaftFlux => "flux along phase a, part of the stator flux",
        Acts::LossCurrent => "loss current, A",
        Acts::LeakageCurrent => "leakage current added, part of it",
        Acts::CurrentSensor => "current shown too much, part of it",
        Acts::SpeedSensor => "speed shown too much, part of it",
    };
    (x, y)
}

/// What is known of a curve that nobody wrote.
pub(super) fn card(acts: Acts, over: Over) -> Card {
    let row = row_of(acts, over);
    Card {
        title: row.title,
        what: row.what,
        shows: "What the recordings left that no effect of the library explains; the curve is all that is known of it.",
        rivals: &[],
        test: "Whatever moves the variable over its range while others rest.",
        place: "free form",
        source: "learned from recordings: penalized splines, Eilers and Marx (1996)",
    }
}
