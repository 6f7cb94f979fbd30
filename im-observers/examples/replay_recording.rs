//! A recording through two observers, without the speed sensor: what they would have said on that drive. The data are those of `im demo`, whose
//! machine has effects that the observers do not know. Prints the error against the speed sensor, and draws both estimates:
//!
//!     cargo run --release -p im-observers --example replay_recording -- replay.svg

use im_chart::{Panel, Series, panels};
use im_model::{MotorFile, Recording};
use im_observers::{Basis, Estimate, Input, Kubota, KubotaGains, Observer, Utkin, UtkinGains};

/// Row k shows the current at t_k and the voltage from there on: the step from row k uses both.
fn replay(observer: &impl Observer<f64>, r: &Recording) -> Vec<Estimate<f64>> {
    let mut state = Default::default();
    (0..r.len()).map(|k| observer.step(&mut state, &Input::new(r.u_s[k], r.i_s[k]))).collect()
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let data = concat!(env!("CARGO_MANIFEST_DIR"), "/../im-cli/data/demo");
    let motor = MotorFile::read(format!("{data}/motor.toml"))?;
    let r = Recording::read_csv(format!("{data}/holdout.csv"))?;

    let basis = Basis::try_new(&motor.machine, &motor.rating, r.sample_time_s)?;
    let kubota = Kubota::try_new(basis, KubotaGains::for_machine(&motor.machine, &motor.rating)?)?;
    let utkin = Utkin::try_new(basis, UtkinGains::for_machine(&motor.machine, &motor.rating))?;
    let runs = [("Kubota", replay(&kubota, &r)), ("Utkin", replay(&utkin, &r))];

    let mut speeds = vec![Series::line("speed sensor", (0..r.len()).map(|k| (r.time_s(k), r.omega_m[k])))];
    let mut errors = Vec::new();
    for (name, run) in &runs {
        // An estimate that calls itself invalid (settling, no flux) is not counted.
        let valid: Vec<usize> = (0..r.len()).filter(|&k| run[k].status.is_valid()).collect();
        let error = |k: usize| run[k].omega_m - r.omega_m[k];
        let rms = (valid.iter().map(|&k| error(k).powi(2)).sum::<f64>() / valid.len() as f64).sqrt();
        println!("{name}: {rms:.2} rad/s rms, valid {:.1} % of the time", 100.0 * valid.len() as f64 / r.len() as f64);
        speeds.push(Series::line(*name, (0..r.len()).map(|k| (r.time_s(k), run[k].omega_m))));
        errors.push(Series::line(*name, valid.iter().map(|&k| (r.time_s(k), error(k)))));
    }
    if let Some(path) = std::env::args().nth(1) {
        let parts = [Panel::new("speed, rad/s", speeds), Panel::new("error where valid, rad/s", errors)];
        std::fs::write(path, panels("Two observers on a recording; nameplate-grade parameters", "time, s", &parts))?;
    }
    Ok(())
}
