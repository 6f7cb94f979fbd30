//! Do 95 % intervals hold the truth? `coverage FIRST_SEED TRIALS [given]` diagnoses hidden-effect trials and counts, per parameter, how
//! often the true value lies within.
//!
//! Half of the trials hide nothing, half one effect of the library; half have white noise, half AR(0.9). With `given` the effect is named to
//! the tool, which then fits without a choice; otherwise it must find it, and trials where it does not are counted apart.

use im_diagnose::diagnosis::diagnose;
use im_diagnose::search::Options;
use im_diagnose::uncertainty::{HALF_95, MachineQuantity};
use im_model::{BaseParameter, EffectId, ParameterId, TParameters};
use im_tests::campaign::case_of;
use im_tests::hidden::{CatalogueMachine, EffectKind, Noise, Strength, TrialCase, simulate};
use rayon::prelude::*;

/// A trial: what it is, and per quantity the error in standard deviations; `None` where other effects were named than were hidden.
struct Done {
    name: String,
    coloured: bool,
    clean: bool,
    errors: Option<Vec<(MachineQuantity, f64, f64)>>,
}

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let number = |k: usize, default: u64| args.get(k).and_then(|a| a.parse().ok()).unwrap_or(default);
    let (first, trials) = (number(0, 100), number(1, 44));
    let given = args.iter().any(|a| a == "given");
    let all: Vec<Done> = (0..trials as usize).into_par_iter().with_max_len(1).map(|k| trial(first, k as u64, given)).collect();
    for d in &all {
        let Some(errors) = &d.errors else {
            println!("other effects named: {}", d.name);
            continue;
        };
        let far = errors.iter().filter(|e| e.1.abs() > HALF_95);
        let far: Vec<String> = far.map(|(q, z, off)| format!("{} {z:+.1} ({:+.2} %)", q.key(), 100.0 * off)).collect();
        println!("{:<50} {}", d.name, if far.is_empty() { "all within".into() } else { far.join(", ") });
    }
    println!("\n| trials | number | {} |", QUANTITIES.map(|q| q.key()).join(" | "));
    println!("|---|---|{}", "---|".repeat(QUANTITIES.len()));
    for (name, of) in GROUPS {
        let group: Vec<&Vec<(MachineQuantity, f64, f64)>> =
            all.iter().filter(|d| of(d)).filter_map(|d| d.errors.as_ref()).collect();
        let share = |q: MachineQuantity| {
            let z: Vec<f64> = group.iter().flat_map(|e| e.iter()).filter(|e| e.0 == q).map(|e| e.1).collect();
            let within = z.iter().filter(|z| z.abs() <= HALF_95).count();
            format!("{within} of {}", z.len())
        };
        println!("| {name} | {} | {} |", group.len(), QUANTITIES.map(share).join(" | "));
    }
}

type Group = (&'static str, fn(&Done) -> bool);

const GROUPS: [Group; 5] = [
    ("nothing hidden, white noise", |d| d.clean && !d.coloured),
    ("nothing hidden, AR(0.9)", |d| d.clean && d.coloured),
    ("one effect, white noise", |d| !d.clean && !d.coloured),
    ("one effect, AR(0.9)", |d| !d.clean && d.coloured),
    ("all", |_| true),
];

const QUANTITIES: [MachineQuantity; 6] = [
    MachineQuantity::Parameter(ParameterId::Base(BaseParameter::StatorResistance)),
    MachineQuantity::RotorResistance,
    MachineQuantity::LeakageInductance,
    MachineQuantity::MagnetizingInductance,
    MachineQuantity::Parameter(ParameterId::Base(BaseParameter::Inertia)),
    MachineQuantity::Parameter(ParameterId::Base(BaseParameter::ViscousFriction)),
];

fn trial(first: u64, k: u64, given: bool) -> Done {
    let library: Vec<EffectKind> = EffectKind::ALL.iter().copied().filter(|e| e.in_library()).collect();
    let (clean, coloured) = (k % 4 < 2, k % 2 == 1);
    let effect = library[(k / 4) as usize % library.len()];
    let effects = if clean { vec![] } else { vec![(effect, Strength::Medium)] };
    let mut case = TrialCase::new((k as usize * 7 + k as usize / 4) % CatalogueMachine::COUNT, &effects, first + k);
    if coloured {
        case.noise = Noise::coloured(0.9);
    }
    let hidden = if clean { "nothing" } else { effect.name() };
    let name = format!("{hidden} m{} seed {} {}", case.machine, first + k, if coloured { "AR(0.9)" } else { "white" });
    let wanted: Vec<EffectId> = effects.iter().filter_map(|(e, _)| EffectId::from_name(e.name())).collect();
    let mut options = Options::default();
    if given {
        options.candidates = if clean { vec![EffectId::Windage] } else { wanted.clone() };
    }
    let trial = simulate(&case);
    let m = &trial.truth.machine;
    let mut truth = TParameters {
        stator_resistance_ohm: m.stator_resistance_ohm,
        rotor_resistance_ohm: m.rotor_resistance_ohm,
        stator_leakage_inductance_h: m.stator_leakage_h,
        rotor_leakage_inductance_h: m.rotor_leakage_h,
        magnetizing_inductance_h: m.magnetizing_h,
        inertia_kg_m2: m.inertia_kg_m2,
        viscous_friction_nm_s_per_rad: m.friction_nm_s,
    };
    for e in &trial.truth.effects {
        let of = |name: &str| e.parameters.iter().find(|p| p.0 == name).map_or(0.0, |p| p.1);
        // What one phase of three has more belongs by a third to the symmetrical machine.
        match e.kind {
            EffectKind::StatorAsymmetry => {
                truth.stator_resistance_ohm += of("extra_ohm") / 3.0;
                truth.stator_leakage_inductance_h += of("extra_leakage_h") / 3.0;
            }
            EffectKind::RotorAsymmetry => truth.rotor_resistance_ohm *= 1.0 + of("extra") / 3.0,
            _ => (),
        }
    }
    let errors = diagnose(case_of(&trial), options).ok().filter(|d| d.effects == wanted).map(|d| {
        // The catalogue's L_lr is the leakage at low slip, that of the bars included.
        let bars_h = d.refined.machine.effects().rotor_skin_effect.low_slip_leakage_h(truth.rotor_resistance_ohm);
        let truth = TParameters { rotor_leakage_inductance_h: truth.rotor_leakage_inductance_h - bars_h, ..truth };
        let Ok(true_machine) = d.refined.machine.with_parameters(truth) else { return Vec::new() };
        let error = |q: MachineQuantity| {
            let e = d.estimates.list.iter().find(|e| e.quantity == q)?;
            let t = q.of(&true_machine);
            Some((q, (e.after - t) / e.std, e.after / t - 1.0))
        };
        QUANTITIES.into_iter().filter_map(error).collect()
    });
    Done { name, coloured, clean, errors }
}
