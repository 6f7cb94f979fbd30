//! Whether recordings are of one machine: fitted to each alone, it must come out about the same.
//!
//! A missing effect moves the fitted parameters from recording to recording, too, but by less: in the open cases by up to a factor
//! 1.44 in one or two of them, while a machine of another size differs in nearly all. Machines of nearly the same size are not distinguished.
//!
//! Where the speed was measured it drives the machine: what brakes the shaft, and what was said of it, is no part of the machine.

use im_identify::offline::{Experiment, Fit, FitOptions, base_parameters_in, fit, start_parameters};
use im_model::Machine;
use rayon::prelude::*;

use crate::case::Case;
use crate::format::number;
use crate::intake::{Finding, FindingKind, Severity};
use crate::residuals::nudged;

/// Values of a parameter this far apart are of two machines …
const FACTOR: f64 = 1.6;
/// … if they are that far apart in so many of the four parameters R_s, R_r, L_l, L_m …
const PARAMETERS: usize = 3;
/// … and one machine for all recordings misses them by so much more χ² than one for each.
const GAIN: f64 = 3.0;
/// A value with a larger relative standard deviation is not determined by its recording.
const DETERMINED: f64 = 0.1;

/// Factors of more than one and a half show in a rough fit.
const ROUGH: f64 = 1e-3;

/// A finding when the recordings, the held-out one included, seem to be of different machines.
pub fn check(case: &Case) -> Option<Finding> {
    let all: Vec<Experiment> = case.all().filter(|e| !e.is_table()).cloned().map(Experiment::driven_by_speed).collect();
    if all.len() < 2 {
        return None;
    }
    let all = nudged(&all);
    let one_for = |from: &Machine<f64>, experiments: &[Experiment], options: &FitOptions| -> Option<Fit> {
        let mut free = base_parameters_in(from, experiments);
        free.extend(start_parameters(experiments, &case.motor.rating, from.effects().any_fixed_to_shaft()));
        fit(from, experiments, &free, options).ok()
    };
    let together = one_for(&case.motor.machine, &all, &FitOptions { tolerance: ROUGH, ..FitOptions::default() })?;
    let alone: Vec<Fit> = all
        .par_iter()
        .map(|e| one_for(&together.machine, std::slice::from_ref(e), &FitOptions { tolerance: ROUGH, ..FitOptions::near() }))
        .collect::<Option<_>>()?;
    let gain = together.cost / alone.iter().map(|f| f.cost).sum::<f64>();
    let apart: Vec<String> = (0..PHYSICAL).filter_map(|k| disagreement(&all, &alone, k)).collect();
    if gain < GAIN || apart.len() < PARAMETERS {
        return None;
    }
    let text = format!(
        "The recordings seem to be of different machines: fitted to each alone, {}; one machine for all of them misses them by {} times as much",
        apart.join(", "),
        number(gain.sqrt(), 2)
    );
    let mut finding = Finding::new(
        FindingKind::DifferentMachine,
        Severity::Serious,
        text,
        "Give only recordings of the machine in the motor file; what is found from these together means nothing.",
    );
    finding.recording = all.iter().map(|e| e.name.as_str()).collect::<Vec<_>>().join(", ");
    Some(finding)
}

/// The parameters of [`base_parameters_in`] but those of the shaft, which effects and loads change most.
const PHYSICAL: usize = 4;

/// Parameter `k` in words where the recordings that determine it disagree.
fn disagreement(all: &[Experiment], alone: &[Fit], k: usize) -> Option<String> {
    let mut values: Vec<(f64, &str)> = alone
        .iter()
        .zip(all)
        .map(|(f, e)| (f.values()[k], f.standard_deviations()[k], e.name.as_str()))
        .filter(|(value, sd, _)| *sd < DETERMINED * value)
        .map(|(value, _, name)| (value, name))
        .collect();
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let [(least, in_least), .., (most, in_most)] = values[..] else { return None };
    let name = alone.first()?.free[k].name();
    (most > FACTOR * least)
        .then(|| format!("{name} is {} for {in_least} and {} for {in_most}", number(least, 3), number(most, 3)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_model::simulation::{Scenario, Simulation};
    use im_model::{MotorFile, Recording};

    const SCENARIO: &str = "[scenario]\nname = \"start\"\nduration_s = 0.6\nsample_time_s = 2e-4\n[mains]\nvoltage_peak_v = 326.6\n\
        frequency_hz = 50\nclosing_s = 0.02\n[load]\ntorque_nm = [[0, 0], [0.35, 0], [0.35, 10]]\n[sensors]\ncurrent_noise_a = 0.05\n\
        speed_noise_rad_s = 0.1\nseed = 1\n";

    /// A 4-kW machine and, by `size`, one whose impedances are divided and whose inertia is multiplied by it.
    fn motor(size: f64, excess: f64) -> MotorFile {
        let text = format!(
            "[machine]\nname = \"m\"\npole_pairs = 2\n[machine.parameters]\nstator_resistance_ohm = {}\nrotor_resistance_ohm = {}\n\
             stator_leakage_inductance_h = {}\nrotor_leakage_inductance_h = {}\nmagnetizing_inductance_h = {}\ninertia_kg_m2 = {}\n\
             viscous_friction_nm_s_per_rad = 0.002\n[machine.rating]\ntorque_nm = 26.0\nelectrical_frequency_hz = 50.0\n\
             phase_voltage_peak_v = 326.6\nrotor_flux_vs = 0.95\n[effects.main_flux_saturation]\nexcess = {excess}\n\
             exponent = 7.0\nreference_flux_vs = 0.95\n",
            1.5 / size,
            0.9 / size,
            0.004 / size,
            0.004 / size,
            0.156 / size,
            0.03 * size
        );
        MotorFile::parse(&text, "motor.toml").unwrap()
    }

    fn recording(name: &str, of: &MotorFile, voltage: f64) -> Recording {
        let text = SCENARIO.replace("voltage_peak_v = 326.6", &format!("voltage_peak_v = {voltage}"));
        let scenario = Scenario::parse(&text, "scenario.toml", std::path::Path::new("")).unwrap();
        Recording { name: name.into(), ..Simulation::new(&of.machine, &scenario).run().unwrap().recording }
    }

    #[test]
    fn recordings_of_machines_of_two_sizes_contradict_each_other() {
        let (small, large) = (motor(1.0, 0.0), motor(2.2, 0.0));
        let case = Case::new(small.clone(), &[recording("a", &small, 326.6), recording("b", &large, 326.6)], None);
        let finding = check(&case).expect("a finding");
        assert!(finding.sentence.contains("rotor_resistance_ohm") && finding.recording == "a, b", "{finding:?}");
    }

    #[test]
    fn one_machine_with_an_effect_that_the_model_lacks_is_one_machine() {
        let saturated = motor(1.0, 0.8);
        let runs = [recording("a", &saturated, 326.6), recording("b", &saturated, 230.0)];
        assert_eq!(check(&Case::new(motor(1.0, 0.0), &runs, None)), None);
    }
}
