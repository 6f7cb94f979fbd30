//! Three gains for the observer of Kwon et al., Section VI, side by side: speed error after a wrong start.
//!
//! `cargo run --release -p im-lab --example compare_thau -- docs/images/design/thau-comparison.svg`

use im_design::plot::{Series, chart};
use im_design::thau_box::{BoxRegion, fastest};
use im_design::{DesignModel, LinearMachine, thau};
use im_lab::observer_error::{fifth_order, times, turning};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let plant = DesignModel::Machine(LinearMachine::kwon_table_iv());
    let c = plant.constants::<f64>();
    let region = BoxRegion {
        frame_rad_s: [100.0, 300.0],
        slip_rad_s: [-8.0, 8.0],
        flux_d_vs: [0.8, 1.1],
        flux_q_vs: [-0.05, 0.05],
        current_d_a: [0.0; 2],
        current_q_a: [0.0; 2],
    };
    let (lipschitz, _) = thau::maximize(plant, 1e-3)?;
    let (boxed, _) = fastest(plant, &region, 100.0, 1e4)?;
    let time = 2.0;
    let by_box = turning(&boxed, 2.0 * 100.0 + 4.0);
    let runs = [
        ("L = 0, as (15) proves", fifth_order(&c, time, |_, _| [0.0; 5])),
        ("largest kappa by LMI", fifth_order(&c, time, |_, e| times(&lipschitz.gain, e))),
        ("certified over the box", fifth_order(&c, time, by_box)),
    ];
    println!("| time s | {} | e^(-rate t) % |", runs.each_ref().map(|(name, _)| format!("{name}, %")).join(" | "));
    println!("|---|---|---|---|---|");
    for t in [0.0, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0] {
        let k = (t / 5e-5f64).round() as usize;
        let row = runs.each_ref().map(|(_, run)| format!("{:.3}", run[k].1)).join(" | ");
        println!("| {t} | {row} | {:.3} |", 100.0 * (-boxed.rate_per_s * t).exp());
    }
    println!("proven: kappa = {:.5}; rate over the box {:.2} 1/s", lipschitz.lipschitz, boxed.rate_per_s);
    if let Some(path) = std::env::args().nth(1) {
        let series = runs.each_ref().map(|(name, run)| Series::line(*name, run.iter().step_by(200).copied()));
        let svg = chart(
            "Speed error after a wrong start, Kwon's machine at 100 rad/s",
            "time, s",
            "speed error, % of the first",
            &series,
        );
        std::fs::write(path, svg)?;
    }
    Ok(())
}
