//! Reading `scenario.toml`.

use std::path::Path;

use crate::error::Bound;
use crate::file_error::{FileError, Problem};
use crate::recording::Recording;
use crate::simulation::bridge::Bridge;
use crate::simulation::carrier_pwm::CarrierPwm;
use crate::simulation::delta_modulator::DeltaModulator;
use crate::simulation::profile::Profile;
use crate::simulation::scenario::{Inverter, Load, References, Scenario, Source, Start};
use crate::simulation::sensors::Sensors;
use crate::simulation::supply::{Mains, VoltsPerHertz};
use crate::steady_state::Held;
use crate::toml_reader::{Document, Table};

const SOURCES: [&str; 5] = ["mains", "volts_per_hertz", "current", "recording", "controller"];
const ANY: Bound = Bound::Within(-1e9, 1e9);

impl Scenario {
    /// Reads a `scenario.toml`; a recording that it names is looked for beside it. The file is written like this:
    ///
    /// ```toml
    /// [scenario]
    /// name = "fan start"            # what the recording is called
    /// duration_s = 1.5
    /// sample_time_s = 1e-4          # 1e-4 if left out
    /// record_every = 1              # row every so many samples; 1 if left out
    ///
    /// # One source:
    /// [mains]                       # direct on line
    /// voltage_peak_v = 325.3        # phase voltage, peak
    /// frequency_hz = 50
    /// closing_s = 0.1               # 0 if left out
    /// phase_deg = 0                 # angle at t = 0
    ///
    /// [volts_per_hertz]
    /// voltage_peak_v = 325.3        # at the rated frequency
    /// frequency_hz = 50             # rated
    /// boost_v = 10                  # at standstill; 0 if left out
    /// ramp_hz_per_s = 100           # fastest change; 1e6 if left out
    /// reference_hz = [[0, 0], [0.5, 50]]
    ///
    /// [current]                     # a rotating current, for delta modulation
    /// amplitude_a = 10
    /// frequency_hz = 5
    ///
    /// [recording]                   # the voltages and the load torque of a recording, again
    /// file = "run.csv"              # beside this file
    ///
    /// [controller]                  # by name, from the crates that have them
    /// name = "…"
    /// speed_rad_s = [[0, 0], [0.5, 150]]
    /// rotor_flux_vs = 0.95
    /// torque_nm = 0
    ///
    /// # What else there is, all of it optional:
    /// [load]
    /// torque_nm = [[0, 0], [1, 0], [1, 10]]   # a number, or points [t_s, value]; two at one time make a step
    /// quadratic_nm_s2 = 0.0007                # adds c ω|ω|
    /// imposed_speed_rad_s = 150               # instead: the rotor turns at this speed whatever the torque
    ///
    /// [inverter]
    /// kind = "averaged"             # or "carrier_pwm" or "delta_modulation"
    /// dc_voltage_v = 560
    /// carrier_frequency_hz = 10e3   # carrier_pwm; a sample is a whole number of half periods
    /// period_s = 1e-4               # delta_modulation; a sample is a whole number of periods
    /// dead_time_s = 2e-6            # the switched kinds; 0 if left out, like the drop of their devices
    /// drop_v = 1.0
    /// on_resistance_ohm = 0.01
    ///
    /// [start]
    /// kind = "rest"                 # or "steady_state", with load_nm or speed_rad_s
    ///
    /// [sensors]
    /// current_noise_a = 0.05        # standard deviations of white noise
    /// speed_noise_rad_s = 0.1
    /// torque_noise_nm = 0.05
    /// current_offset_alpha_a = 0.0
    /// current_offset_beta_a = 0.0
    /// current_step_a = 0.01         # quantization
    /// speed_step_rad_s = 0.0
    /// seed = 1
    /// ```
    ///
    /// # Errors
    /// The file or its recording cannot be read, has an unknown key, lacks one, or a value is of the wrong type or outside its
    /// bound; the error carries line and key.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, FileError> {
        let path = path.as_ref();
        let label = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(|e| FileError::io(&label, "read", &e))?;
        Self::parse(&text, &label, path.parent().unwrap_or(Path::new("")))
    }

    /// Reads text; `label` names the file in messages, `folder` is where a recording's name starts from.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(text: &str, label: &str, folder: &Path) -> Result<Self, FileError> {
        let document = Document::parse(text, label)?;
        let mut known = vec!["scenario", "load", "inverter", "start", "sensors"];
        known.extend(SOURCES);
        let top = document.top(&known)?;
        let source = source(&top, folder)?;
        let head = top.table("scenario", &["name", "duration_s", "sample_time_s", "record_every"])?;
        let head = head.ok_or_else(|| top.missing("scenario", "write [scenario] with name and duration_s"))?;
        let sample_time_s = head.number("sample_time_s", Bound::Within(1e-7, 1.0))?;
        if let (Source::Recording(_), Some(_)) = (&source, sample_time_s) {
            return Err(head.unexpected("sample_time_s", "given", "none: the recording's sampling time is used"));
        }
        let duration_s = match (head.number("duration_s", Bound::Positive)?, &source) {
            (Some(x), _) => x,
            (None, Source::Recording(r)) => r.sample_time_s * r.len() as f64,
            (None, _) => return Err(head.missing("duration_s", "how long the run is, s")),
        };
        let (load, imposed_speed) = load(&top)?;
        let scenario = Self {
            name: head.text("name")?.unwrap_or("simulated").to_owned(),
            duration_s,
            sample_time_s: sample_time_s.unwrap_or(1e-4),
            record_every: head.whole("record_every", (1, 1_000_000))?.unwrap_or(1) as u32,
            source,
            inverter: inverter(&top)?,
            load,
            imposed_speed,
            start: start(&top)?,
            sensors: sensors(&top)?,
        };
        scenario.validate().map_err(|e| FileError::new(label, None, None, Problem::Value(e)))?;
        Ok(scenario)
    }
}

fn need<V>(table: &Table<'_>, key: &'static str, value: Option<V>, what: &str) -> Result<V, FileError> {
    value.ok_or_else(|| table.missing(key, what))
}

fn source(top: &Table<'_>, folder: &Path) -> Result<Source, FileError> {
    let mut given = SOURCES.into_iter().filter(|k| top.has(k));
    let first = given.next().ok_or_else(|| top.missing("source", format!("write one of [{}]", SOURCES.join("], ["))))?;
    if let Some(second) = given.next() {
        return Err(top.unexpected(second, format!("given beside [{first}]"), "one source only"));
    }
    Ok(match first {
        "mains" => {
            let Some(t) = top.table("mains", &["voltage_peak_v", "frequency_hz", "closing_s", "phase_deg"])? else {
                unreachable!()
            };
            Source::Mains(Mains {
                voltage_peak_v: need(
                    &t,
                    "voltage_peak_v",
                    t.number("voltage_peak_v", Bound::NotNegative)?,
                    "phase voltage, peak, V",
                )?,
                frequency_hz: need(&t, "frequency_hz", t.number("frequency_hz", ANY)?, "a number, Hz")?,
                closing_s: t.number("closing_s", ANY)?.unwrap_or(0.0),
                phase_rad: t.number("phase_deg", Bound::Within(-360.0, 360.0))?.unwrap_or(0.0).to_radians(),
            })
        }
        "volts_per_hertz" => {
            let keys = ["voltage_peak_v", "frequency_hz", "boost_v", "ramp_hz_per_s", "reference_hz"];
            let Some(t) = top.table("volts_per_hertz", &keys)? else { unreachable!() };
            let voltage_peak_v = need(
                &t,
                "voltage_peak_v",
                t.number("voltage_peak_v", Bound::Positive)?,
                "phase voltage at rated frequency, peak, V",
            )?;
            Source::VoltsPerHertz(
                VoltsPerHertz {
                    voltage_peak_v,
                    frequency_hz: need(
                        &t,
                        "frequency_hz",
                        t.number("frequency_hz", Bound::Positive)?,
                        "the rated frequency, Hz",
                    )?,
                    boost_v: t.number("boost_v", Bound::Within(0.0, voltage_peak_v))?.unwrap_or(0.0),
                    ramp_hz_per_s: t.number("ramp_hz_per_s", Bound::Positive)?.unwrap_or(1e6),
                },
                need(&t, "reference_hz", t.profile("reference_hz")?, "frequency over time, Hz: [[0, 0], [1, 50]]")?,
            )
        }
        "current" => {
            let Some(t) = top.table("current", &["amplitude_a", "frequency_hz"])? else { unreachable!() };
            Source::RotatingCurrent {
                amplitude_a: need(&t, "amplitude_a", t.profile("amplitude_a")?, "peak current, A")?,
                frequency_hz: need(&t, "frequency_hz", t.profile("frequency_hz")?, "a number, Hz")?,
            }
        }
        "recording" => {
            let Some(t) = top.table("recording", &["file"])? else { unreachable!() };
            let file = need(&t, "file", t.text("file")?, "the name of a CSV file in quotes")?;
            Source::Recording(Recording::read_csv(folder.join(file))?)
        }
        _ => {
            let Some(t) = top.table("controller", &["name", "speed_rad_s", "rotor_flux_vs", "torque_nm"])? else {
                unreachable!()
            };
            let profile = |key| Ok::<_, FileError>(t.profile(key)?.unwrap_or(Profile::constant(0.0)));
            Source::Controller {
                name: need(&t, "name", t.text("name")?, "the controller's name in quotes")?.to_owned(),
                references: References {
                    speed_rad_s: profile("speed_rad_s")?,
                    rotor_flux_vs: profile("rotor_flux_vs")?,
                    torque_nm: profile("torque_nm")?,
                },
            }
        }
    })
}

fn load(top: &Table<'_>) -> Result<(Load, Option<Profile>), FileError> {
    let Some(t) = top.table("load", &["torque_nm", "quadratic_nm_s2", "imposed_speed_rad_s"])? else {
        return Ok((Load::none(), None));
    };
    let speed = t.profile("imposed_speed_rad_s")?;
    if let Some(key) = ["torque_nm", "quadratic_nm_s2"].into_iter().find(|k| speed.is_some() && t.has(k)) {
        return Err(t.unexpected(
            key,
            "given beside imposed_speed_rad_s",
            "one or the other: a held speed leaves no say to the torque",
        ));
    }
    let load = Load {
        torque_nm: t.profile("torque_nm")?.unwrap_or(Profile::constant(0.0)),
        quadratic_nm_s2: t.number("quadratic_nm_s2", ANY)?.unwrap_or(0.0),
    };
    Ok((load, speed))
}

#[derive(Clone, Copy)]
enum Kind {
    Averaged,
    CarrierPwm,
    DeltaModulation,
}

fn inverter(top: &Table<'_>) -> Result<Inverter, FileError> {
    const BRIDGE: [&str; 5] = ["kind", "dc_voltage_v", "dead_time_s", "drop_v", "on_resistance_ohm"];
    let all = [&BRIDGE[..], &["carrier_frequency_hz", "period_s"]].concat();
    let Some(t) = top.table("inverter", &all)? else { return Ok(Inverter::Averaged { dc_voltage_v: None }) };
    let kinds = [("averaged", Kind::Averaged), ("carrier_pwm", Kind::CarrierPwm), ("delta_modulation", Kind::DeltaModulation)];
    let kind = need(&t, "kind", t.choice("kind", &kinds)?, "\"averaged\", \"carrier_pwm\" or \"delta_modulation\"")?;
    let dc_voltage_v = t.number("dc_voltage_v", Bound::Positive)?;
    let refuse = |keys: &[&'static str], kind: &str| match keys.iter().find(|k| t.has(k)) {
        Some(key) => Err(t.unexpected(key, format!("given for kind = \"{kind}\""), "none: it has no such quantity")),
        None => Ok(()),
    };
    let bridge = || {
        Ok::<_, FileError>(Bridge {
            dc_voltage_v: need(&t, "dc_voltage_v", dc_voltage_v, "voltage of the dc link, V")?,
            dead_time_s: t.number("dead_time_s", Bound::Within(0.0, 1e-3))?.unwrap_or(0.0),
            drop_v: t.number("drop_v", Bound::NotNegative)?.unwrap_or(0.0),
            on_resistance_ohm: t.number("on_resistance_ohm", Bound::NotNegative)?.unwrap_or(0.0),
        })
    };
    match kind {
        Kind::Averaged => {
            refuse(&["dead_time_s", "drop_v", "on_resistance_ohm", "carrier_frequency_hz", "period_s"], "averaged")?;
            Ok(Inverter::Averaged { dc_voltage_v })
        }
        Kind::CarrierPwm => {
            refuse(&["period_s"], "carrier_pwm")?;
            let what = "a number, Hz, such that a sample is a whole number of half periods";
            let f = need(&t, "carrier_frequency_hz", t.number("carrier_frequency_hz", Bound::Positive)?, what)?;
            Ok(Inverter::CarrierPwm(CarrierPwm { half_period_s: 0.5 / f }, bridge()?))
        }
        Kind::DeltaModulation => {
            refuse(&["carrier_frequency_hz"], "delta_modulation")?;
            let what = "time between two decisions of a phase, s, such that a sample is a whole number of them";
            let period_s = need(&t, "period_s", t.number("period_s", Bound::Positive)?, what)?;
            Ok(Inverter::DeltaModulation(DeltaModulator { period_s }, bridge()?))
        }
    }
}

fn start(top: &Table<'_>) -> Result<Start, FileError> {
    let Some(t) = top.table("start", &["kind", "load_nm", "speed_rad_s"])? else { return Ok(Start::Rest) };
    let steady = t.choice("kind", &[("rest", false), ("steady_state", true)])?;
    let steady = need(&t, "kind", steady, "\"rest\" or \"steady_state\"")?;
    match (steady, t.number("load_nm", ANY)?, t.number("speed_rad_s", ANY)?) {
        (true, Some(torque), None) => Ok(Start::SteadyState(Held::Load(torque))),
        (true, None, Some(speed)) => Ok(Start::SteadyState(Held::Speed(speed))),
        (true, None, None) => Err(t.missing("load_nm", "the torque that the steady state carries, Nm, or speed_rad_s")),
        (false, None, None) => Ok(Start::Rest),
        (true, ..) => Err(t.unexpected("speed_rad_s", "given beside load_nm", "one of the two: the other follows")),
        (false, load, _) => {
            let key = if load.is_some() { "load_nm" } else { "speed_rad_s" };
            Err(t.unexpected(key, "given for kind = \"rest\"", "none, or kind = \"steady_state\""))
        }
    }
}

fn sensors(top: &Table<'_>) -> Result<Sensors, FileError> {
    let keys = [
        "current_noise_a",
        "speed_noise_rad_s",
        "torque_noise_nm",
        "current_offset_alpha_a",
        "current_offset_beta_a",
        "current_step_a",
        "speed_step_rad_s",
        "seed",
    ];
    let Some(t) = top.table("sensors", &keys)? else { return Ok(Sensors::default()) };
    let size = |key| Ok::<_, FileError>(t.number(key, Bound::NotNegative)?.unwrap_or(0.0));
    let offset = |key| Ok::<_, FileError>(t.number(key, Bound::Within(-1e6, 1e6))?.unwrap_or(0.0));
    Ok(Sensors {
        current_noise_a: size("current_noise_a")?,
        speed_noise_rad_s: size("speed_noise_rad_s")?,
        torque_noise_nm: size("torque_noise_nm")?,
        current_offset_a: [offset("current_offset_alpha_a")?, offset("current_offset_beta_a")?],
        current_step_a: size("current_step_a")?,
        speed_step_rad_s: size("speed_step_rad_s")?,
        seed: t.whole("seed", (0, i64::MAX as u64))?.unwrap_or(0),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "[scenario]\nname = \"fan\"\nduration_s = 1.5\n\n[mains]\nvoltage_peak_v = 325\nfrequency_hz = 50\n\n[load]\n\
        torque_nm = [[0, 0], [1, 0], [1, 10]]\nquadratic_nm_s2 = 7e-4\n\n[sensors]\ncurrent_noise_a = 0.05\nseed = 3\n";

    fn parse(text: &str) -> Result<Scenario, FileError> {
        Scenario::parse(text, "s.toml", Path::new("/nowhere"))
    }
    fn error(from: &str, to: &str) -> String {
        let text = GOOD.replace(from, to);
        assert_ne!(text, GOOD);
        parse(&text).unwrap_err().to_string()
    }

    #[test]
    fn a_scenario_is_read() {
        let s = parse(GOOD).unwrap();
        assert_eq!((s.name.as_str(), s.samples(), s.sensors.seed), ("fan", 15_000, 3));
        assert_eq!(s.load.at(1.0, 100.0), 10.0 + 7.0);
        assert!(matches!(s.source, Source::Mains(m) if m.voltage_peak_v == 325.0 && m.closing_s == 0.0));
        assert_eq!(s.start, Start::Rest);
        let drive = "[scenario]\nduration_s = 1\n[volts_per_hertz]\nvoltage_peak_v = 320\nfrequency_hz = 50\nreference_hz = 20\n\
            [inverter]\nkind = \"carrier_pwm\"\ndc_voltage_v = 560\ncarrier_frequency_hz = 10e3\ndead_time_s = 2e-6\n\
            [start]\nkind = \"steady_state\"\nload_nm = 5\n";
        let s = parse(drive).unwrap();
        assert!(matches!(s.inverter, Inverter::CarrierPwm(p, b) if p.half_period_s == 5e-5 && b.dead_time_s == 2e-6));
        assert_eq!(s.start, Start::SteadyState(Held::Load(5.0)));
    }

    #[test]
    fn errors_point_at_line_and_key() {
        assert_eq!(error("[mains]", "[main]"), "s.toml:5: unknown key main at the top of the file; did you mean mains?");
        assert_eq!(
            error("[mains]\nvoltage_peak_v = 325\nfrequency_hz = 50\n", ""),
            "s.toml: source is missing at the top of the file: write one of [mains], [volts_per_hertz], [current], [recording], [controller]"
        );
        assert!(error("[sensors]", "[current]\n[sensors]").contains("current is given beside [mains], expected one source only"));
        assert_eq!(
            error("[1, 10]]", "[1, \"x\"]]"),
            "s.toml:10: torque_nm is a list with something other than a point [t_s, value] in it, expected a number, or points [[t_s, value], …] in the order of time; two \
             at one time make a step"
        );
        assert!(error("[1, 0]", "[3, 0]").starts_with("s.toml:10: torque_nm is not a profile (time_s of a point = 1 must be"));
        assert_eq!(error("= 1.5", "= -1.5"), "s.toml:3: duration_s = -1.5 must be positive and finite");
        assert!(error("duration_s = 1.5\n", "").starts_with("s.toml:1: duration_s is missing in [scenario]"));
        assert!(error("frequency_hz = 50", "frequency_hz = 50e3").contains("frequency_hz = 50000 must be from 0 to 5000"));
        assert!(error("quadratic_nm_s2", "imposed_speed_rad_s").contains("given beside imposed_speed_rad_s"));
        let kind = error("[sensors]", "[inverter]\nkind = \"pwm\"\n[sensors]");
        assert!(kind.contains("kind is the text \"pwm\", expected one of \"averaged\", \"carrier_pwm\""), "{kind}");
        let none = error("[sensors]", "[inverter]\nkind = \"averaged\"\ndead_time_s = 1e-6\n[sensors]");
        assert!(none.contains("dead_time_s is given for kind = \"averaged\", expected none"), "{none}");
        let file = "[scenario]\nname = \"x\"\n[recording]\nfile = \"a.csv\"\n";
        assert_eq!(parse(file).unwrap_err().to_string(), "/nowhere/a.csv: cannot read it: no such file or folder");
    }
}
