//! What is said of loads that no column holds, on the page and in a terminal.

use im_model::MotorFile;

use super::words::short_effect_name;
use crate::format::{number, quantity};
use crate::loads::{Found, FoundLoad, Line, Loads};
use crate::localise::join;

impl Loads {
    /// What stands above it.
    pub(crate) fn title(&self) -> &'static str {
        let unseen = self.found.iter().any(|f| matches!(f.found, Found::Speed(_)));
        if unseen { "Speed, found" } else { "Load torque, found" }
    }

    /// What holds for all of it.
    pub(crate) fn note(&self, motor: &MotorFile) -> Option<String> {
        let curves = self.found.iter().any(|f| matches!(f.found, Found::Curve(_)));
        let unseen = self.found.iter().any(|f| matches!(f.found, Found::Speed(_)));
        let p = motor.machine.parameters();
        let how = curves.then(|| {
            format!(
                "No torque was measured: the measured speed drives the model, and the load is what the torque balance leaves, with J = {} \
                 and D = {} as given. The band is that of the speed sensor's noise; an error of J shows as a torque in proportion to the \
                 acceleration. What the noise of the speed sensor makes of the currents is taken out.",
                quantity(p.inertia_kg_m2, "kg m²", 3),
                quantity(p.viscous_friction_nm_s_per_rad, "Nm s/rad", 3)
            )
        });
        let speed = unseen.then(|| {
            "Neither torque nor speed was measured: the speed that voltages and currents ask for drives the model, and what only another speed \
             would show is taken out. The band is that of the current sensors' noise. Slip and rotor resistance show together: R_r may be off by more \
             than its interval."
                .to_owned()
        });
        let undetermined = (!self.not_determined.is_empty()).then(|| {
            let names: Vec<String> = self.not_determined.iter().map(|e| short_effect_name(*e)).collect();
            format!("Not determined without the load: {}, J and D.", join(&names))
        });
        let all: Vec<String> = how.into_iter().chain(speed).chain(undetermined).collect();
        (!all.is_empty()).then(|| all.join(" "))
    }
}

/// One recording in a sentence.
pub(crate) fn words(f: &FoundLoad) -> String {
    match &f.found {
        Found::Curve(_) | Found::Speed(_) => {
            let unit = if matches!(f.found, Found::Speed(_)) { "rad/s" } else { "Nm" };
            let (low, high) = f.found.range().unwrap_or_default();
            let mean = quantity(f.found.mean().unwrap_or_default(), unit, 3);
            let [low, high, each] = [low, high, f.found.usual_band().unwrap_or_default()].map(|x| quantity(x, unit, 3));
            let line = |l: &Line| {
                let [per_turn, hz] = [l.per_turn, l.hz].map(|x| number(x, 3));
                format!("{per_turn} times per turn ({hz} Hz) with {}", quantity(l.torque_nm, "Nm", 2))
            };
            let lines: Vec<String> = f.lines.iter().map(line).collect();
            let repeats =
                if lines.is_empty() { String::new() } else { format!(" Part of it repeats with the shaft: {}.", join(&lines)) };
            format!("{}: {mean} on average, between {low} and {high}, each instant to ± {each}.{repeats}", f.recording)
        }
        Found::Law { constant_nm, fan_nm_s2 } => {
            let constant = constant_nm.map(|x| format!("a constant torque of {}", quantity(x, "Nm", 3)));
            let fan = fan_nm_s2.map(|x| format!("a fan's torque of {} times ω²", quantity(x, "Nm s²/rad²", 3)));
            let parts: Vec<String> = constant.into_iter().chain(fan).collect();
            format!("{}: {}.", f.recording, if parts.is_empty() { "as given".into() } else { join(&parts) })
        }
    }
}
