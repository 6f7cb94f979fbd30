//! `im design KIND`: makes gains and proves them.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use im_design::gains::{GainSet, Precision, Provenance};
use im_design::request::{Kind, Period, design_for, design_sampled};
use im_design::{Certificate, DesignError, DesignModel, plot};
use im_model::{FileError, MotorFile, read_text, write_atomically};
use serde_json::json;

use super::words::{left_out, proven, without};
use super::{as_json, shown};
use crate::failure::Failure;
use crate::interrupt::together;
use crate::output::Outputs;
use crate::spinner::spinning;
use crate::terminal::stdout;

/// Arguments of every design.
#[derive(clap::Args)]
pub struct Args {
    /// The machine: a motor.toml
    #[arg(long, value_name = "FILE")]
    motor: PathBuf,
    /// Where the gains must hold and how fast: a region.toml as shown below
    #[arg(long, value_name = "FILE")]
    region: PathBuf,
    /// Where to write the gains with their proof, as TOML
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Design for this sampling period (s), or for the largest that can be proven; not for mtpa and sampled
    #[arg(long, value_name = "SECONDS|largest")]
    period: Option<Period>,
    /// Write the gains as Rust source too: the struct that im-observers or im-control takes, for firmware
    #[arg(long, value_name = "FILE")]
    rust: Option<PathBuf>,
    /// The number type of the firmware; for f32 the gains are rounded so that the claim holds, proven as rounded, and their
    /// certificate written beside that of -o (gains.toml: gains.f32.toml)
    #[arg(long, value_enum, default_value_t = Scalar::F32, requires = "rust")]
    scalar: Scalar,
    /// Draw what was designed, as SVG
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    /// Print the gains as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum Scalar {
    F32,
    F64,
}

/// Runs the command.
pub fn run(kind: Kind, args: &Args) -> Result<(), Failure> {
    let mut outputs = Outputs::beside([&args.motor, &args.region]);
    written(args).iter().try_for_each(|path| outputs.file(path))?;
    let motor = MotorFile::read(&args.motor)?;
    let region = read_text(&args.region)?;
    let plant = DesignModel::Machine(im_design::LinearMachine::from(&motor.machine));
    let made = spinning("designing and proving", || match args.period {
        Some(period) => design_sampled(kind, plant, &region, period),
        None => design_for(kind, &motor.machine, &region),
    });
    let certificate = made.map_err(|e| refused(args, kind, e))?;
    let text = |c: &Certificate| c.to_text().map_err(|e| Failure::Input(e.to_string()));
    let own = text(&certificate)?;
    let set = GainSet::from(&certificate.design);
    // A name with a line end in it would end the comment.
    let one_line = |path: &Path| path.display().to_string().replace(char::is_control, "?");
    let heading = format!(
        "# Made by: im design {} --motor {} --region {}\n# Verify with: im design check FILE\n",
        kind.name(),
        one_line(&args.motor),
        one_line(&args.region)
    );
    // What can fail is done before anything is written.
    let picture = args.plot.as_ref().map(|path| (path, spinning("drawing", || plot::picture(&certificate))));
    let in_f32 =
        rounded_file(args).map(|path| Ok((path, certificate.in_f32()?))).transpose().map_err(|e| refused(args, kind, e))?;
    let rust = args
        .rust
        .as_ref()
        .map(|path| Ok((path, source(args, &motor, &certificate, in_f32.as_ref())?)))
        .transpose()
        .map_err(|e| refused(args, kind, e))?;
    let in_f32 = in_f32.map(|(path, c)| Ok::<_, Failure>((path, text(&c)?))).transpose()?;
    together(|| {
        write(&args.output, &(heading.clone() + &own))?;
        let rounded = "# The gains are rounded to f32, as the Rust source holds them.\n";
        in_f32.iter().try_for_each(|(path, text)| write(path, &(heading.clone() + rounded + text)))?;
        rust.iter().try_for_each(|(path, text)| write(path, text))?;
        picture.iter().try_for_each(|(path, svg)| write(path, svg))
    })?;
    Ok(summary(args, &motor, &certificate, &set)?)
}

/// Everything that is written.
fn written(args: &Args) -> Vec<PathBuf> {
    let given = [Some(&args.output), args.rust.as_ref(), args.plot.as_ref()];
    let mut all: Vec<PathBuf> = given.into_iter().flatten().cloned().collect();
    all.extend(rounded_file(args));
    all
}

/// Where the certificate of the gains in f32 goes, if there is one: `gains.f32.toml` beside `gains.toml`.
fn rounded_file(args: &Args) -> Option<PathBuf> {
    let asked = args.rust.is_some() && matches!(args.scalar, Scalar::F32);
    let mut name = args.output.file_stem()?.to_os_string();
    name.push(".f32");
    if let Some(extension) = args.output.extension() {
        name.push(".");
        name.push(extension);
    }
    asked.then(|| args.output.with_file_name(name))
}

/// The gains as Rust source.
fn source(
    args: &Args,
    motor: &MotorFile,
    certificate: &Certificate,
    in_f32: Option<&(PathBuf, Certificate)>,
) -> Result<String, DesignError> {
    let (precision, file, held) = match in_f32 {
        Some((path, rounded)) => (Precision::F32, path, rounded),
        None => (Precision::F64, &args.output, certificate),
    };
    let effects_left_out = left_out(motor, certificate).into_iter().map(str::to_owned).collect();
    let file = file.file_name().map(|name| name.to_string_lossy().into_owned());
    certificate.to_rust_as(held, precision, &Provenance { motor: motor.name.clone(), effects_left_out, file })
}

fn write(path: &Path, text: &str) -> Result<(), FileError> {
    write_atomically(path, |out| out.write_all(text.as_bytes()))
}

fn refused(args: &Args, kind: Kind, e: DesignError) -> Failure {
    let file = args.region.display().to_string();
    match e {
        DesignError::Region(e) => {
            let advice = format!("; im design example-region {} prints a file to start from", kind.name());
            e.renamed(&file, &advice).into()
        }
        DesignError::Machine { .. } => Failure::Input(format!("{}: {e}", args.motor.display())),
        e => Failure::Input(format!("{file}: {e}")),
    }
}

fn summary(args: &Args, motor: &MotorFile, certificate: &Certificate, set: &GainSet) -> io::Result<()> {
    let left_out = left_out(motor, certificate);
    let mut out = stdout();
    if args.json {
        let summary = json!({
            "schema": 1, "kind": set.kind, "machine": motor.name, "gains": as_json(set),
            "obligations": certificate.margins.len(), "digest": certificate.digest, "effects_left_out": left_out,
            "written": written(args).iter().map(|p| p.display().to_string()).collect::<Vec<_>>(),
        });
        return writeln!(out, "{summary}");
    }
    for g in &set.gains {
        writeln!(out, "{} = {}    # {}", g.name, shown(&g.value), g.meaning)?;
    }
    writeln!(out, "\n{}", proven(&set.kind, &certificate.margins))?;
    if !left_out.is_empty() {
        writeln!(out, "{}", without(&left_out))?;
    }
    let in_f32 = rounded_file(args);
    for path in written(args) {
        let what = if Some(&path) == in_f32.as_ref() { ", the certificate of the gains as rounded to f32" } else { "" };
        writeln!(out, "{}: written{what}", path.display())?;
    }
    Ok(())
}
