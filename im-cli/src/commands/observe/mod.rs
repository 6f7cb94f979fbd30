//! `im observe`: a recording through an observer.

mod gains;

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::builder::PossibleValuesParser;
use im_chart::{COLOURS, INK, Panel, Series, panels_with_marks, spans};
use im_model::{Complex, MotorFile, Recording, write_atomically};
use im_observers::{Basis, Estimate, Input, NAMES, Named, Observer, Visit, each};
use serde_json::json;

use super::inputs::Replayed;
use crate::failure::Failure;
use crate::interrupt::together;
use crate::output::Outputs;
use crate::spinner::spinning;
use crate::terminal::{rounded, say, stdout, wrapped};
use gains::{Added, GainsFile, Refused};

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  im observe --observer kubota --motor motor.toml --data run.csv
  im observe --observer derdiyok --motor motor.toml --data run.csv --out out
  im observe --observer thau --motor motor.toml --data run.csv --gains gains.toml

Without --gains an observer takes the gains one starts from for the motor. A gains file is what \
`im design` writes, its proof checked before it is used, or a table of your own: [kubota_loop], \
[kubota], [derdiyok], [utkin], [thau], [thau_box]. What was designed for a sampling period \
(--period) is stepped by forward Euler, as its proof says. \
The observer sees voltage and current alone; the recorded speed is what it is compared with \
(the current model reads it). Files in other columns are described by a recording.toml, as for \
im compare; rows that its checks leave out are lost samples to the observer.")]
pub struct Args {
    /// Which observer
    #[arg(long, value_parser = PossibleValuesParser::new(NAMES))]
    observer: String,
    /// The machine as the observer knows it: a motor.toml
    #[arg(long, value_name = "FILE")]
    motor: PathBuf,
    /// The recording, or its recording.toml
    #[arg(long, value_name = "FILE")]
    data: PathBuf,
    /// What the columns of the recording mean, instead of the recording.toml beside it
    #[arg(long, value_name = "FILE")]
    mapping: Option<PathBuf>,
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

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    if args.load_coefficient.is_some() && args.observer != "thau" {
        return Err(Failure::Input("--load-coefficient is for --observer thau: the others know no load torque".into()));
    }
    if let Some(dir) = &args.out {
        let read = Outputs::beside([&args.motor].into_iter().chain(&args.mapping).chain(&args.gains));
        read.and_recordings([&args.data], args.mapping.as_deref()).folder(dir, &["estimate.csv", "speed.svg"])?;
    }
    let motor = MotorFile::read(&args.motor)?;
    let data = Replayed::read(&args.data, args.mapping.as_deref(), &motor, args.out.as_deref())?;
    let r = &data.recording;
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
    let gains = GainsFile::of(args.gains.as_deref(), &motor)?;
    let other_machine = gains.other_machine.clone();
    if let Some(what) = &other_machine {
        say(&wrapped("! ", what));
    }
    let mut replay = Replay { args, motor: &motor, data: &data, basis, gains, estimates: None };
    spinning("estimating", || each(&mut replay));
    let named = replay.estimates.expect("the argument is one of the names");
    let (estimates, added) = named.map_err(|e| e.or(refused))?;
    if let Some(folder) = &args.out {
        together(|| write(folder, args, r, &estimates))?;
    }
    Ok(print(args, &motor, &data, &estimates, &added, other_machine.as_deref())?)
}

/// The estimates, and what the observer took beside the gains of the file.
type Estimated = (Vec<Estimate<f64>>, Added);

/// The recording through the observer that the arguments name.
struct Replay<'a> {
    args: &'a Args,
    motor: &'a MotorFile,
    data: &'a Replayed,
    basis: Basis<f64>,
    gains: GainsFile,
    estimates: Option<Result<Estimated, Refused>>,
}

impl Visit<f64> for Replay<'_> {
    fn visit<O: Named<f64> + 'static>(&mut self) {
        if O::NAME == self.args.observer {
            self.estimates = Some(self.through::<O>());
        }
    }
}

impl Replay<'_> {
    fn through<O: Named<f64>>(&self) -> Result<Estimated, Refused> {
        if O::NEEDS_SPEED && !self.data.has_speed() {
            let file = self.args.data.display();
            return Err(
                Failure::Input(format!("{file}: the {} needs a measured speed; choose another observer", O::TITLE)).into()
            );
        }
        let gains = self.gains.of_observer::<O>(self.basis.sample_time_s(), self.args.load_coefficient)?;
        let made = O::made(self.basis, &self.motor.machine, &self.motor.rating, &gains).map_err(|e| match e {
            Refused::Observer(e) => gains.refused(e),
            file => file,
        });
        Ok((over(&self.data.recording, &made?), gains.added::<O>()))
    }
}

fn over<O: Observer<f64>>(r: &Recording, observer: &O) -> Vec<Estimate<f64>> {
    let mut state = O::State::default();
    let voltage = |k: usize| if k > 0 { r.u_s[k - 1] } else { Complex::new(0.0, 0.0) };
    (0..r.len()).map(|k| observer.step(&mut state, &Input::new(voltage(k), r.i_s[k]).with_speed(r.omega_m[k]))).collect()
}

/// The error of the speed over some rows: mean and root mean square, rad/s.
fn error(r: &Recording, estimates: &[Estimate<f64>], rows: impl Iterator<Item = usize> + Clone) -> Option<[f64; 2]> {
    let rows = rows.filter(|&k| r.omega_m[k].is_finite());
    let n = rows.clone().count();
    let off = rows.map(|k| estimates[k].omega_m - r.omega_m[k]);
    let (sum, squares) = off.fold((0.0, 0.0), |(s, q), x| (s + x, q + x * x));
    (n > 0).then(|| [sum / n as f64, (squares / n as f64).sqrt()])
}

fn print(
    args: &Args,
    motor: &MotorFile,
    data: &Replayed,
    estimates: &[Estimate<f64>],
    added: &Added,
    other_machine: Option<&str>,
) -> io::Result<()> {
    let r = &data.recording;
    let valid = || (0..r.len()).filter(|&k| estimates[k].status.is_valid());
    let first = valid().next();
    let share = valid().count() as f64 / r.len() as f64;
    let last = r.len() - 1;
    let (whole, end) = (error(r, estimates, valid()), error(r, estimates, r.len() / 2..r.len()));
    let mut out = stdout();
    if args.json {
        let pair = |e: Option<[f64; 2]>| e.map(|[mean, rms]| json!({"mean": mean, "rms": rms}));
        let summary = json!({
            "schema": 1,
            "observer": args.observer,
            "machine": motor.name,
            "rows": r.len(),
            "sample_time_s": r.sample_time_s,
            "valid_share": share,
            "first_valid_s": first.map(|k| r.time_s(k)),
            "speed_error_valid_rad_s": pair(whole),
            "speed_error_second_half_rad_s": pair(end),
            "final_speed_rad_s": {"estimated": estimates[last].omega_m, "recorded": r.omega_m[last]},
            "lost_rows": data.lost_rows(),
            "guessed": data.guessed,
            "gains_not_in_file": added.gains.iter().map(|(key, x)| (key.to_string(), json!(x))).collect::<serde_json::Map<_, _>>(),
            "gains_of_another_machine": other_machine,
            "data_quality": data.findings,
        });
        return writeln!(out, "{summary}");
    }
    data.print(&mut out)?;
    if let Some(file) = args.gains.as_ref().filter(|_| !added.gains.is_empty()) {
        write!(out, "{}", wrapped("", &format!("not in {}, taken as the usual ones: {added}", file.display())))?;
    }
    let begun = first.map_or("never".into(), |k| format!("from {} s on", rounded(r.time_s(k))));
    writeln!(
        out,
        "{}: {} rows through {}, valid {begun}, {} % of rows",
        args.data.display(),
        r.len(),
        args.observer,
        rounded(100.0 * share)
    )?;
    for (name, e) in [("where valid", whole), ("second half", end)] {
        if let Some([mean, rms]) = e {
            writeln!(out, "speed error {name}: mean {} rad/s, rms {} rad/s", rounded(mean), rounded(rms))?;
        }
    }
    if data.lost_rows() > 0 {
        writeln!(out, "{} rows had no usable current: predicted", data.lost_rows())?;
    }
    let recorded = if r.omega_m[last].is_finite() { format!(", recorded {:.2} rad/s", r.omega_m[last]) } else { String::new() };
    let (shown, status) = (estimates[last].omega_m, estimates[last].status);
    writeln!(out, "at the end: estimated {shown:.2} rad/s{recorded}; status: {status}")?;
    if let Some(folder) = &args.out {
        writeln!(out, "{}: estimate.csv, speed.svg", folder.display())?;
    }
    Ok(())
}

fn write(folder: &Path, args: &Args, r: &Recording, estimates: &[Estimate<f64>]) -> Result<(), Failure> {
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
            let recorded = if r.omega_m[k].is_finite() { format!("{:?}", r.omega_m[k]) } else { String::new() };
            writeln!(
                out,
                "{t:.9},{:?},{recorded},{:?},{:?},{torque:?},{:?},{:?},{status}",
                e.omega_m, flux.re, flux.im, residual.re, residual.im
            )?;
        }
        Ok(())
    })?;
    let points = |speed: &dyn Fn(usize) -> f64| -> Vec<(f64, f64)> { (0..r.len()).map(|k| (r.time_s(k), speed(k))).collect() };
    let recorded = Series::line("recorded", points(&|k| r.omega_m[k])).coloured(INK);
    let estimated = Series::line("estimated", points(&|k| estimates[k].omega_m)).coloured(COLOURS[1]);
    let invalid = spans((0..r.len()).map(|k| r.time_s(k)), |k| !estimates[k].status.is_valid());
    let title = format!("{}: the speed as {} has it", r.name, args.observer);
    let panel = Panel::new("speed, rad/s:", [recorded, estimated]).tall(240.0);
    let svg = panels_with_marks(&title, "time, s", &[panel], "not valid", &invalid);
    Ok(write_atomically(&folder.join("speed.svg"), |out| out.write_all(svg.as_bytes()))?)
}
