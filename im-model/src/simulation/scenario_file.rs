//! Reading `scenario.toml`.

use std::path::Path;

use serde::Deserialize;
use toml::Spanned;

use crate::file_error::FileError;
use crate::file_kind::FileKind;
use crate::recording::Recording;
use crate::simulation::bridge::Bridge;
use crate::simulation::carrier_pwm::CarrierPwm;
use crate::simulation::delta_modulator::DeltaModulator;
use crate::simulation::profile::Profile;
use crate::simulation::scenario::{Inverter, Load, References, Scenario, Source, Start};
use crate::simulation::sensors::Sensors;
use crate::simulation::supply::{Mains, VoltsPerHertz};
use crate::steady_state::Held;
use crate::text_file::read_text;
use crate::toml_text::{NotNegative, Positive, TomlText, Whole, Within, exact, quoted};

type Number = Within<-1_000_000_000, 1_000_000_000>;

const HINTS: [(&str, &str); 10] = [
    ("scenario", "write [scenario] with name and duration_s"),
    ("voltage_peak_v", "phase voltage, peak, V"),
    ("frequency_hz", "a number, Hz"),
    ("reference_hz", "frequency over time, Hz: [[0, 0], [1, 50]]"),
    ("amplitude_a", "peak current, A"),
    ("file", "the name of a CSV file in quotes"),
    ("name", "the controller's name in quotes"),
    ("inverter.kind", "\"averaged\", \"carrier_pwm\" or \"delta_modulation\""),
    ("start.kind", "\"rest\" or \"steady_state\""),
    ("dc_voltage_v", "voltage of the dc link, V"),
];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ScenarioToml {
    scenario: Spanned<Head>,
    mains: Option<MainsToml>,
    volts_per_hertz: Option<VoltsPerHertzToml>,
    current: Option<CurrentToml>,
    recording: Option<RecordingToml>,
    controller: Option<ControllerToml>,
    load: Option<Spanned<LoadToml>>,
    inverter: Option<Spanned<InverterToml>>,
    start: Option<Spanned<StartToml>>,
    sensors: Option<SensorsToml>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Head {
    name: Option<String>,
    duration_s: Option<Positive>,
    sample_time_s: Option<Positive>,
    record_every: Option<Whole<1, 1_000_000>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MainsToml {
    voltage_peak_v: NotNegative,
    frequency_hz: Number,
    #[serde(default)]
    closing_s: Number,
    #[serde(default)]
    phase_deg: Within<-360, 360>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct VoltsPerHertzToml {
    voltage_peak_v: Positive,
    frequency_hz: Positive,
    #[serde(default)]
    boost_v: NotNegative,
    ramp_hz_per_s: Option<Positive>,
    reference_hz: Profile,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CurrentToml {
    amplitude_a: Profile,
    frequency_hz: Profile,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RecordingToml {
    file: String,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ControllerToml {
    name: String,
    observer: Option<String>,
    #[serde(default)]
    speed_rad_s: Profile,
    #[serde(default)]
    rotor_flux_vs: Profile,
    #[serde(default)]
    torque_nm: Profile,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct LoadToml {
    torque_nm: Option<Profile>,
    quadratic_nm_s2: Option<Number>,
    imposed_speed_rad_s: Option<Profile>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct InverterToml {
    kind: Kind,
    dc_voltage_v: Option<Positive>,
    dead_time_s: Option<NotNegative>,
    drop_v: Option<NotNegative>,
    on_resistance_ohm: Option<NotNegative>,
    carrier_frequency_hz: Option<Positive>,
    period_s: Option<Positive>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Kind {
    Averaged,
    CarrierPwm,
    DeltaModulation,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct StartToml {
    kind: StartKind,
    load_nm: Option<Number>,
    speed_rad_s: Option<Number>,
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum StartKind {
    Rest,
    SteadyState,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct SensorsToml {
    current_noise_a: NotNegative,
    speed_noise_rad_s: NotNegative,
    torque_noise_nm: NotNegative,
    current_offset_alpha_a: Within<-1_000_000, 1_000_000>,
    current_offset_beta_a: Within<-1_000_000, 1_000_000>,
    current_step_a: NotNegative,
    speed_step_rad_s: NotNegative,
    seed: Whole<0, { i64::MAX as u64 }>,
}

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
    /// observer = "…"                # its speed in place of the sensor's; the sensor's if left out
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
        let text = read_text(path)?;
        Self::parse(&text, &path.display().to_string(), path.parent().unwrap_or(Path::new("")))
    }

    /// Reads text; `label` names the file in messages, `folder` is where a recording's name starts from.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(text: &str, label: &str, folder: &Path) -> Result<Self, FileError> {
        let toml = TomlText::new(text, label, &HINTS).of_kind(FileKind::Scenario);
        let mut file: ScenarioToml = toml.read()?;
        let source = source(&toml, &mut file, folder)?;
        let at = file.scenario.span();
        let head = file.scenario.into_inner();
        if let (Source::Recording(_), Some(_)) = (&source, head.sample_time_s) {
            return Err(toml.refused(at, "sample_time_s", "given", "none: the recording's sampling time is used"));
        }
        let duration_s = match (head.duration_s, &source) {
            (Some(x), _) => x.0,
            (None, Source::Recording(r)) => r.sample_time_s * r.len() as f64,
            (None, _) => return Err(toml.missing(at, "duration_s", "how long the run is, s")),
        };
        let (load, imposed_speed) = load(&toml, file.load)?;
        let scenario = Self {
            name: head.name.unwrap_or_else(|| "simulated".to_owned()),
            duration_s,
            sample_time_s: head.sample_time_s.map_or(1e-4, |x| x.0),
            record_every: head.record_every.map_or(1, |x| x.0 as u32),
            source,
            inverter: inverter(&toml, file.inverter)?,
            load,
            imposed_speed,
            start: start(&toml, file.start)?,
            sensors: file.sensors.unwrap_or_default().into(),
        };
        scenario.validate().map_err(|e| toml.value(e))?;
        Ok(scenario)
    }

    /// The text of a file that reads back as this; `None` with a recording or a state in it, which a file can only name.
    pub fn to_toml(&self) -> Option<String> {
        let mut out = String::new();
        let mut table = |name: &str, keys: &[(&str, String)]| {
            out += &format!("{}[{name}]\n", if out.is_empty() { "" } else { "\n" });
            keys.iter().for_each(|(key, value)| out += &format!("{key} = {value}\n"));
        };
        let (duration, sample) = (exact(self.duration_s), exact(self.sample_time_s));
        let every = self.record_every.to_string();
        let head = [("name", quoted(&self.name)), ("duration_s", duration), ("sample_time_s", sample), ("record_every", every)];
        table("scenario", &head);
        match &self.source {
            Source::Mains(m) => table(
                "mains",
                &[
                    ("voltage_peak_v", exact(m.voltage_peak_v)),
                    ("frequency_hz", exact(m.frequency_hz)),
                    ("closing_s", exact(m.closing_s)),
                    ("phase_deg", exact(m.phase_rad.to_degrees())),
                ],
            ),
            Source::VoltsPerHertz(v, reference) => table(
                "volts_per_hertz",
                &[
                    ("voltage_peak_v", exact(v.voltage_peak_v)),
                    ("frequency_hz", exact(v.frequency_hz)),
                    ("boost_v", exact(v.boost_v)),
                    ("ramp_hz_per_s", exact(v.ramp_hz_per_s)),
                    ("reference_hz", reference.to_toml()),
                ],
            ),
            Source::RotatingCurrent { amplitude_a, frequency_hz } => {
                table("current", &[("amplitude_a", amplitude_a.to_toml()), ("frequency_hz", frequency_hz.to_toml())]);
            }
            Source::Controller { name, observer, references: r } => {
                let mut keys = vec![("name", quoted(name))];
                keys.extend(observer.as_ref().map(|o| ("observer", quoted(o))));
                keys.push(("speed_rad_s", r.speed_rad_s.to_toml()));
                keys.push(("rotor_flux_vs", r.rotor_flux_vs.to_toml()));
                keys.push(("torque_nm", r.torque_nm.to_toml()));
                table("controller", &keys);
            }
            Source::Recording(_) => return None,
        }
        match &self.imposed_speed {
            Some(speed) => table("load", &[("imposed_speed_rad_s", speed.to_toml())]),
            None => {
                let quadratic = exact(self.load.quadratic_nm_s2);
                table("load", &[("torque_nm", self.load.torque_nm.to_toml()), ("quadratic_nm_s2", quadratic)]);
            }
        }
        let switched = |kind: &str, (key, value): (&'static str, f64), b: &Bridge<f64>| {
            [
                ("kind", quoted(kind)),
                (key, exact(value)),
                ("dc_voltage_v", exact(b.dc_voltage_v)),
                ("dead_time_s", exact(b.dead_time_s)),
                ("drop_v", exact(b.drop_v)),
                ("on_resistance_ohm", exact(b.on_resistance_ohm)),
            ]
        };
        match &self.inverter {
            Inverter::Averaged { dc_voltage_v: None } => {}
            Inverter::Averaged { dc_voltage_v: Some(u) } => {
                table("inverter", &[("kind", quoted("averaged")), ("dc_voltage_v", exact(*u))]);
            }
            Inverter::CarrierPwm(pwm, bridge) => {
                table("inverter", &switched("carrier_pwm", ("carrier_frequency_hz", 0.5 / pwm.half_period_s), bridge));
            }
            Inverter::DeltaModulation(delta, bridge) => {
                table("inverter", &switched("delta_modulation", ("period_s", delta.period_s), bridge));
            }
        }
        match &self.start {
            Start::Rest => {}
            Start::SteadyState(held) => {
                let (key, x) = match held {
                    Held::Load(torque) => ("load_nm", torque),
                    Held::Speed(speed) => ("speed_rad_s", speed),
                };
                table("start", &[("kind", quoted("steady_state")), (key, exact(*x))]);
            }
            Start::State(_) => return None,
        }
        let s = &self.sensors;
        if *s != Sensors::default() {
            let keys = [
                ("current_noise_a", exact(s.current_noise_a)),
                ("speed_noise_rad_s", exact(s.speed_noise_rad_s)),
                ("torque_noise_nm", exact(s.torque_noise_nm)),
                ("current_offset_alpha_a", exact(s.current_offset_a[0])),
                ("current_offset_beta_a", exact(s.current_offset_a[1])),
                ("current_step_a", exact(s.current_step_a)),
                ("speed_step_rad_s", exact(s.speed_step_rad_s)),
                ("seed", s.seed.to_string()),
            ];
            table("sensors", &keys);
        }
        Some(out)
    }
}

fn source(toml: &TomlText<'_>, file: &mut ScenarioToml, folder: &Path) -> Result<Source, FileError> {
    let sources = [
        ("mains", file.mains.is_some()),
        ("volts_per_hertz", file.volts_per_hertz.is_some()),
        ("current", file.current.is_some()),
        ("recording", file.recording.is_some()),
        ("controller", file.controller.is_some()),
    ];
    let mut given = sources.iter().filter(|(_, is)| *is).map(|(name, _)| name);
    if let (Some(first), Some(second)) = (given.next(), given.next()) {
        let found = format!("given beside [{first}]");
        return Err(toml.refused(0..0, second, &found, "one source only"));
    }
    if let Some(m) = file.mains.take() {
        return Ok(Source::Mains(Mains {
            voltage_peak_v: m.voltage_peak_v.0,
            frequency_hz: m.frequency_hz.0,
            closing_s: m.closing_s.0,
            phase_rad: m.phase_deg.0.to_radians(),
        }));
    }
    if let Some(v) = file.volts_per_hertz.take() {
        let supply = VoltsPerHertz {
            voltage_peak_v: v.voltage_peak_v.0,
            frequency_hz: v.frequency_hz.0,
            boost_v: v.boost_v.0,
            ramp_hz_per_s: v.ramp_hz_per_s.map_or(1e6, |x| x.0),
        };
        return Ok(Source::VoltsPerHertz(supply, v.reference_hz));
    }
    if let Some(c) = file.current.take() {
        return Ok(Source::RotatingCurrent { amplitude_a: c.amplitude_a, frequency_hz: c.frequency_hz });
    }
    if let Some(r) = file.recording.take() {
        return Ok(Source::Recording(Recording::read_csv(folder.join(r.file))?));
    }
    if let Some(c) = file.controller.take() {
        let ControllerToml { name, observer, speed_rad_s, rotor_flux_vs, torque_nm } = c;
        return Ok(Source::Controller { name, observer, references: References { speed_rad_s, rotor_flux_vs, torque_nm } });
    }
    Err(toml.missing(0..0, "source", "write one of [mains], [volts_per_hertz], [current], [recording], [controller]"))
}

fn load(toml: &TomlText<'_>, table: Option<Spanned<LoadToml>>) -> Result<(Load, Option<Profile>), FileError> {
    let Some(table) = table else { return Ok((Load::none(), None)) };
    let (at, t) = (table.span(), table.into_inner());
    let torque = t.torque_nm.as_ref().map(|_| "torque_nm").or(t.quadratic_nm_s2.map(|_| "quadratic_nm_s2"));
    if let (Some(key), Some(_)) = (torque, &t.imposed_speed_rad_s) {
        let expected = "one or the other: a held speed leaves no say to the torque";
        return Err(toml.refused(at, key, "given beside imposed_speed_rad_s", expected));
    }
    let torque_nm = t.torque_nm.unwrap_or_default();
    Ok((Load { torque_nm, quadratic_nm_s2: t.quadratic_nm_s2.map_or(0.0, |x| x.0) }, t.imposed_speed_rad_s))
}

fn inverter(toml: &TomlText<'_>, table: Option<Spanned<InverterToml>>) -> Result<Inverter, FileError> {
    let Some(table) = table else { return Ok(Inverter::Averaged { dc_voltage_v: None }) };
    let (at, t) = (table.span(), table.into_inner());
    let refuse = |key: &str, given: bool, kind: &str| match given {
        true => Err(toml.refused(at.clone(), key, &format!("given for kind = \"{kind}\""), "none: it has no such quantity")),
        false => Ok(()),
    };
    let need =
        |key: &str, value: Option<Positive>, what: &str| value.map(|x| x.0).ok_or_else(|| toml.missing(at.clone(), key, what));
    let bridge = || {
        Ok::<_, FileError>(Bridge {
            dc_voltage_v: need("dc_voltage_v", t.dc_voltage_v, "voltage of the dc link, V")?,
            dead_time_s: t.dead_time_s.unwrap_or_default().0,
            drop_v: t.drop_v.unwrap_or_default().0,
            on_resistance_ohm: t.on_resistance_ohm.unwrap_or_default().0,
        })
    };
    match t.kind {
        Kind::Averaged => {
            refuse("dead_time_s", t.dead_time_s.is_some(), "averaged")?;
            refuse("drop_v", t.drop_v.is_some(), "averaged")?;
            refuse("on_resistance_ohm", t.on_resistance_ohm.is_some(), "averaged")?;
            refuse("carrier_frequency_hz", t.carrier_frequency_hz.is_some(), "averaged")?;
            refuse("period_s", t.period_s.is_some(), "averaged")?;
            Ok(Inverter::Averaged { dc_voltage_v: t.dc_voltage_v.map(|x| x.0) })
        }
        Kind::CarrierPwm => {
            refuse("period_s", t.period_s.is_some(), "carrier_pwm")?;
            let what = "a number, Hz, such that a sample is a whole number of half periods";
            let f = need("carrier_frequency_hz", t.carrier_frequency_hz, what)?;
            Ok(Inverter::CarrierPwm(CarrierPwm { half_period_s: 0.5 / f }, bridge()?))
        }
        Kind::DeltaModulation => {
            refuse("carrier_frequency_hz", t.carrier_frequency_hz.is_some(), "delta_modulation")?;
            let what = "time between two decisions of a phase, s, such that a sample is a whole number of them";
            Ok(Inverter::DeltaModulation(DeltaModulator { period_s: need("period_s", t.period_s, what)? }, bridge()?))
        }
    }
}

fn start(toml: &TomlText<'_>, table: Option<Spanned<StartToml>>) -> Result<Start, FileError> {
    let Some(table) = table else { return Ok(Start::Rest) };
    let (at, t) = (table.span(), table.into_inner());
    match (t.kind, t.load_nm, t.speed_rad_s) {
        (StartKind::SteadyState, Some(torque), None) => Ok(Start::SteadyState(Held::Load(torque.0))),
        (StartKind::SteadyState, None, Some(speed)) => Ok(Start::SteadyState(Held::Speed(speed.0))),
        (StartKind::SteadyState, None, None) => {
            Err(toml.missing(at, "load_nm", "the torque that the steady state carries, Nm, or speed_rad_s"))
        }
        (StartKind::SteadyState, ..) => {
            Err(toml.refused(at, "speed_rad_s", "given beside load_nm", "one of the two: the other follows"))
        }
        (StartKind::Rest, None, None) => Ok(Start::Rest),
        (StartKind::Rest, load, _) => {
            let key = if load.is_some() { "load_nm" } else { "speed_rad_s" };
            Err(toml.refused(at, key, "given for kind = \"rest\"", "none, or kind = \"steady_state\""))
        }
    }
}

impl From<SensorsToml> for Sensors {
    fn from(t: SensorsToml) -> Self {
        Self {
            current_noise_a: t.current_noise_a.0,
            speed_noise_rad_s: t.speed_noise_rad_s.0,
            torque_noise_nm: t.torque_noise_nm.0,
            current_offset_a: [t.current_offset_alpha_a.0, t.current_offset_beta_a.0],
            current_step_a: t.current_step_a.0,
            speed_step_rad_s: t.speed_step_rad_s.0,
            seed: t.seed.0,
        }
    }
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
        assert!(
            error("[sensors]", "[current]\namplitude_a = 1\nfrequency_hz = 5\n[sensors]")
                .contains("current is given beside [mains], expected one source only")
        );
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

    #[test]
    fn what_is_written_reads_back() {
        let steps = || Profile::points([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0 / 3.0]]).unwrap();
        let base = Scenario { name: "a \"b\" </script>".into(), ..Scenario::direct_on_line(325.3, 50.0, 1.5) };
        let bridge = Bridge { dc_voltage_v: 560.0, dead_time_s: 2e-6, drop_v: 1.0, on_resistance_ohm: 0.01 };
        let references =
            References { speed_rad_s: steps(), rotor_flux_vs: Profile::constant(0.95), torque_nm: Profile::default() };
        let supply = VoltsPerHertz { voltage_peak_v: 320.0, frequency_hz: 50.0, boost_v: 10.0, ramp_hz_per_s: 100.0 };
        let sensors = Sensors { current_offset_a: [0.1, -0.2], seed: 7, ..Sensors::default() };
        for scenario in [
            Scenario { start: Start::SteadyState(Held::Load(3.0)), sensors, ..base.clone() },
            Scenario { source: Source::VoltsPerHertz(supply, steps()), imposed_speed: Some(steps()), ..base.clone() },
            Scenario {
                source: Source::RotatingCurrent { amplitude_a: steps(), frequency_hz: Profile::constant(5.0) },
                inverter: Inverter::DeltaModulation(DeltaModulator { period_s: 5e-5 }, bridge),
                ..base.clone()
            },
            Scenario {
                source: Source::Controller { name: "x".into(), observer: Some("kubota".into()), references },
                inverter: Inverter::CarrierPwm(CarrierPwm { half_period_s: 5e-5 }, bridge),
                load: Load { torque_nm: steps(), quadratic_nm_s2: 7e-4 },
                ..base.clone()
            },
            Scenario { inverter: Inverter::Averaged { dc_voltage_v: Some(560.0) }, ..base },
        ] {
            let text = scenario.to_toml().unwrap();
            assert_eq!(parse(&text).unwrap_or_else(|e| panic!("{e}\n{text}")), scenario, "{text}");
        }
    }
}
