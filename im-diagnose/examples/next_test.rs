//! Which test would settle it? Two effects that brake alike, and the manoeuvres that would tell them apart within limits of current, speed and
//! torque. Prints what each is worth, writes the best as a scenario to standard output, and draws it:
//!
//!     cargo run --release -p im-diagnose --example next_test -- next_test.svg

use im_chart::{Panel, Series, panels};
use im_diagnose::intake::LoadPlan;
use im_diagnose::next_test::{Limits, Sensing, propose};
use im_diagnose::worst_case::machines_after;
use im_model::{EffectId, MotorFile};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let motor = MotorFile::read(concat!(env!("CARGO_MANIFEST_DIR"), "/../examples/motor.toml"))?;
    let open = [EffectId::CoulombFriction, EffectId::Windage];
    // The sensors of that bench: 30 mA and 0.1 rad/s of noise, and a torque meter.
    let sensing = Sensing { current_a: 0.03, speed_rad_s: 0.1, load: LoadPlan::Known };
    let limits = Limits { torque: 0.5, ..Limits::default() };
    let found = propose(&motor, &open, sensing, &limits, &machines_after(&motor, None, &open))?;
    for p in &found {
        let seen: Vec<String> = p.detectable.iter().map(|(e, size)| format!("{} from {size:.3}", e.name())).collect();
        println!("{:14} {:3.0}° apart; {} of its usual size", p.name, p.angle_deg, seen.join(", "));
    }
    let best = found.first().ok_or("no manoeuvre stays within the limits")?;
    println!("\n{}\n\n{}", best.what, best.scenario_toml);
    if let Some(path) = std::env::args().nth(1) {
        let traces = best.profile.iter().map(|p| {
            let points = p.points.iter().map(|&[t, y]| (t, y));
            Panel::new(p.unit.clone(), [Series::line(p.name.clone(), points)])
        });
        std::fs::write(path, panels(&best.what, "time, s", &traces.collect::<Vec<_>>()))?;
    }
    Ok(())
}
