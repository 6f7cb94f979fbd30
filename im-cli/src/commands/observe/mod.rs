//! `im observe`: a recording through an observer.

mod chart;
mod gains;

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use im_model::{Complex, MotorFile, Recording, write_atomically};
use im_observers::{Basis, CurrentModel, Estimate, Input, Observer};
use serde_json::json;

use crate::failure::Failure;
use crate::terminal::rounded;

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  im observe --observer kubota --motor motor.toml --data run.csv
  im observe --observer derdiyok --motor motor.toml --data run.csv --out out
  im observe --observer thau --motor motor.toml --data run.csv --gains gains.toml

Without --gains an observer takes the gains one starts from for the motor. A gains file is what
`im design` writes: a table [kubota_loop], [kubota], [derdiyok], [utkin], [thau], [thau_box], or
one proven for forward Euler, [sampled], [sampled_thau], [sampled_derdiyok], which is stepped by it.
The observer sees voltage and current alone; the recorded speed is what it is compared with
(the current model reads it).")]
pub struct Args {
    /// Which observer
    #[arg(long, value_enum)]
    observer: Which,
    /// The machine as the observer knows it: a motor.toml
    #[arg(long, value_name = "FILE")]
    motor: PathBuf,
    /// The recording, in the canonical columns
    #[arg(long, value_name = "CSV")]
    data: PathBuf,
    /// Gains as `im design` writes them
    #[arg(long, value_name = "FILE")]
    gains: Option<PathBuf>,
    /// Leave out what the motor file knows of saturation and inverter: the base machine
    #[arg(long)]
    plain: bool,
    /// Take the load torque as proportional to the speed, N m s/rad (thau)
    #[arg(long, value_name = "K")]
    load_coefficient: Option<f64>,
    /// Folder for the estimates (estimate.csv) and a picture (speed.svg)
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

/// The observers.
#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Which {
    Kubota,
    Derdiyok,
    Utkin,
    Thau,
    CurrentModel,
}

impl Which {
    fn name(self) -> &'static str {
        match self {
            Self::Kubota => "kubota",
            Self::Derdiyok => "derdiyok",
            Self::Utkin => "utkin",
            Self::Thau => "thau",
            Self::CurrentModel => "current-model",
        }
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    if args.load_coefficient.is_some() && args.observer != Which::Thau {
        return Err(Failure::Input("--load-coefficient is for --observer thau: the others know no load torque".into()));
    }
    let motor = MotorFile::read(&args.motor)?;
    let r = Recording::read_csv(&args.data)?;
    let refused = |e: im_observers::ObserverError| {
        let file = args.gains.as_deref().unwrap_or(&args.motor).display();
        Failure::Input(format!("{file}: {e}"))
    };
    let mut basis = Basis::<f64>::try_new(&motor.machine, &motor.rating, r.sample_time_s)
        .map_err(|e| Failure::Input(format!("{}: {e}", args.data.display())))?;
    if !args.plain {
        basis = basis.with_saturation(&motor.machine);
        basis = basis.with_inverter(motor.machine.effects().inverter_nonlinearity).map_err(refused)?;
    }
    let gains = gains::Gains::of(args.gains.as_deref())?;
    let estimates = match args.observer {
        Which::CurrentModel => {
            gains.none_for("the current model")?;
            over(&r, &CurrentModel::new(basis))
        }
        Which::Kubota => over(&r, &gains.kubota(&motor, basis).map_err(|e| e.or(refused))?),
        Which::Derdiyok => over(&r, &gains.derdiyok(&motor, basis).map_err(|e| e.or(refused))?),
        Which::Utkin => over(&r, &gains.utkin(&motor, basis).map_err(|e| e.or(refused))?),
        Which::Thau => over(&r, &gains.thau(basis, args.load_coefficient).map_err(|e| e.or(refused))?),
    };
    if let Some(folder) = &args.out {
        write(folder, args, &r, &estimates)?;
    }
    Ok(tell(args, &motor, &r, &estimates)?)
}

fn over<O: Observer<f64>>(r: &Recording, observer: &O) -> Vec<Estimate<f64>> {
    let mut state = O::State::default();
    let voltage = |k: usize| if k > 0 { r.u_s[k - 1] } else { Complex::new(0.0, 0.0) };
    (0..r.len()).map(|k| observer.step(&mut state, &Input::new(voltage(k), r.i_s[k]).with_speed(r.omega_m[k]))).collect()
}

/// The error of the speed over some rows: mean and root mean square, rad/s.
fn error(r: &Recording, estimates: &[Estimate<f64>], rows: impl Iterator<Item = usize> + Clone) -> Option<[f64; 2]> {
    let n = rows.clone().count();
    let off = rows.map(|k| estimates[k].omega_m - r.omega_m[k]);
    let (sum, squares) = off.fold((0.0, 0.0), |(s, q), x| (s + x, q + x * x));
    (n > 0).then(|| [sum / n as f64, (squares / n as f64).sqrt()])
}

fn tell(args: &Args, motor: &MotorFile, r: &Recording, estimates: &[Estimate<f64>]) -> io::Result<()> {
    let valid = || (0..r.len()).filter(|&k| estimates[k].status.is_valid());
    let first = valid().next();
    let share = valid().count() as f64 / r.len() as f64;
    let last = r.len() - 1;
    let (whole, end) = (error(r, estimates, valid()), error(r, estimates, r.len() / 2..r.len()));
    let mut out = io::stdout().lock();
    if args.json {
        let pair = |e: Option<[f64; 2]>| e.map(|[mean, rms]| json!({"mean": mean, "rms": rms}));
        let summary = json!({
            "schema": 1,
            "observer": args.observer.name(),
            "machine": motor.name,
            "rows": r.len(),
            "sample_time_s": r.sample_time_s,
            "valid_share": share,
            "first_valid_s": first.map(|k| r.time_s(k)),
            "speed_error_valid_rad_s": pair(whole),
            "speed_error_second_half_rad_s": pair(end),
            "final_speed_rad_s": {"estimated": estimates[last].omega_m, "recorded": r.omega_m[last]},
        });
        return writeln!(out, "{summary}");
    }
    let begun = first.map_or("never".into(), |k| format!("from {} s on", rounded(r.time_s(k))));
    writeln!(
        out,
        "{}: {} rows through {}, valid {begun}, {} % of rows",
        args.data.display(),
        r.len(),
        args.observer.name(),
        rounded(100.0 * share)
    )?;
    for (name, e) in [("where valid", whole), ("second half", end)] {
        if let Some([mean, rms]) = e {
            writeln!(out, "speed error {name}: mean {} rad/s, rms {} rad/s", rounded(mean), rounded(rms))?;
        }
    }
    let (shown, true_speed) = (estimates[last].omega_m, r.omega_m[last]);
    writeln!(out, "at the end: estimated {shown:.2} rad/s, recorded {true_speed:.2} rad/s; status: {}", estimates[last].status)?;
    if let Some(folder) = &args.out {
        writeln!(out, "{}: estimate.csv, speed.svg", folder.display())?;
    }
    Ok(())
}

fn write(folder: &Path, args: &Args, r: &Recording, estimates: &[Estimate<f64>]) -> Result<(), Failure> {
    std::fs::create_dir_all(folder)
        .map_err(|e| Failure::Input(format!("{}: cannot make the folder: {e}; choose another --out", folder.display())))?;
    write_atomically(&folder.join("estimate.csv"), |out| {
        writeln!(
            out,
            "t_s,omega_m_rad_s,omega_m_recorded_rad_s,psi_r_alpha_Vs,psi_r_beta_Vs,torque_Nm,residual_alpha_A,residual_beta_A,status"
        )?;
        for (k, e) in estimates.iter().enumerate() {
            let (flux, residual, torque) = (e.rotor_flux_vs, e.residual_a, e.torque_nm);
            let t = r.time_s(k);
            // Reasons are joined by semicolons, so that a row keeps its columns.
            let status = e.status.to_string().replace(", ", ";");
            writeln!(
                out,
                "{t:.9},{:?},{:?},{:?},{:?},{torque:?},{:?},{:?},{status}",
                e.omega_m, r.omega_m[k], flux.re, flux.im, residual.re, residual.im
            )?;
        }
        Ok(())
    })?;
    let svg = chart::speeds(args.observer.name(), r, estimates);
    Ok(write_atomically(&folder.join("speed.svg"), |out| out.write_all(svg.as_bytes()))?)
}
