//! Gains as Rust source: the struct that the observer, controller or law takes, with where it comes from.

use super::{GainSet, Value};
use crate::certificate::{Certificate, Design};
use crate::error::DesignError;
use crate::kubota_loop::LoopGains;
use crate::matrix::Matrix;
use crate::mtpa::Law;
use std::fmt::Write;

/// The number type of the firmware.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    /// `f32`: gains are rounded outwards, and proven as rounded.
    F32,
    /// `f64`: gains as proven.
    F64,
}

/// Where gains come from, for whoever reads the source.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Provenance {
    /// Name of the motor.
    pub motor: String,
    /// Effects of the motor that the proof leaves out.
    pub effects_left_out: Vec<String>,
    /// The file of the certificate that the source holds the gains of, if there is one.
    pub file: Option<String>,
}

/// Coefficients that a law of `im_control::mtpa` holds at most.
const SERIES: usize = 16;

struct Source {
    precision: Precision,
    text: String,
}

impl Source {
    fn scalar(&self) -> &'static str {
        match self.precision {
            Precision::F32 => "f32",
            Precision::F64 => "f64",
        }
    }

    /// A number of the firmware's type.
    fn own(&self, x: f64) -> String {
        match self.precision {
            Precision::F32 => format!("{:?}", x as f32),
            Precision::F64 => format!("{x:?}"),
        }
    }

    fn list(x: &[f64], literal: impl Fn(f64) -> String) -> String {
        format!("[{}]", x.iter().map(|x| literal(*x)).collect::<Vec<_>>().join(", "))
    }

    /// Rows of an observer's gain, which are f64 in any firmware: all digits, so that they are the rounded numbers.
    fn rows(m: &Matrix<f64>) -> String {
        let row = |i: usize| Self::list(&(0..m.cols()).map(|j| m[(i, j)]).collect::<Vec<_>>(), |x| format!("{x:?}"));
        format!("[{}]", (0..m.rows()).map(row).collect::<Vec<_>>().join(", "))
    }

    fn line(&mut self, text: &str) {
        // Writing to a String cannot fail.
        let _ = writeln!(self.text, "{}{text}", if text.is_empty() { "" } else { "    " });
    }

    fn item(&mut self, doc: &str, item: &str) {
        self.line("");
        self.line(&format!("/// {doc}"));
        item.lines().for_each(|line| self.line(line));
    }

    fn period(&mut self, period_s: f64) {
        self.item("Sampling period that the proof is for, s.", &format!("pub const PERIOD_S: f64 = {period_s:?};"));
    }

    fn euler(&mut self, period_s: f64) {
        self.period(period_s);
        self.item(
            "How the proof steps the observer.",
            "pub const DISCRETIZATION: im_observers::Discretization = im_observers::Discretization::ForwardEuler;",
        );
    }

    fn thau(&mut self, gain: &Matrix<f64>) {
        let gain = Self::rows(gain);
        self.item(
            "The gain.",
            &format!("pub const GAINS: im_observers::ThauGains = im_observers::ThauGains {{ gain: {gain} }};"),
        );
    }

    fn boxed(&mut self, frame: [f64; 2], gain: &Matrix<f64>, slope: &Matrix<f64>) {
        let (gain, slope) = (Self::rows(gain), Self::rows(slope));
        self.item(
            "The gain, affine in the speed of the frame.",
            &format!(
                "pub const GAINS: im_observers::ThauBoxGains = im_observers::ThauBoxGains {{\n    frame_rad_s: {frame:?},\n    \
                 gain: {gain},\n    gain_per_frame_speed: {slope},\n}};"
            ),
        );
    }

    fn scheduled(&mut self, gain: &Matrix<f64>, slope: &Matrix<f64>) {
        let (gain, slope) = (Self::rows(gain), Self::rows(slope));
        self.item(
            "The gain, affine in speed. The speed law is not part of the proof; usual, and what `im observe --gains` takes, are `proportional` and `integral` of `KubotaGains::for_machine`, and `fade_a` 0.",
            &format!(
                "pub const fn gains(proportional: f64, integral: f64, fade_a: f64) -> im_observers::KubotaGains {{\n    \
                 im_observers::KubotaGains {{\n        gain: {gain},\n        gain_per_speed: {slope},\n        \
                 proportional,\n        integral,\n        fade_a,\n    }}\n}}"
            ),
        );
    }

    fn adaptive(&mut self, g: &LoopGains) {
        let (gain, slope) = (Self::rows(&g.gain), Self::rows(&g.gain_per_speed));
        let (proportional, integral) = (g.proportional, g.integral);
        self.item(
            "The gain, affine in speed, with the speed law; never faded, as it is proven.",
            &format!(
                "pub const GAINS: im_observers::KubotaGains = im_observers::KubotaGains {{\n    gain: {gain},\n    \
                 gain_per_speed: {slope},\n    proportional: {proportional:?},\n    integral: {integral:?},\n    fade_a: 0.0,\n}};"
            ),
        );
    }

    fn derdiyok(&mut self, nu0: f64, layer: f64) {
        self.item(
            "nu0 (V) and its boundary layer (A; 0 is the sign itself) of the proof, which is that the current error slides. Filter (rad/s) and \
             anchor (1/s), 0 for none, act on the estimated flux alone, which is not in it: the proof holds with any.",
            &format!(
                "pub const fn gains(filter_rad_s: f64, anchor_per_s: f64) -> im_observers::DerdiyokGains {{\n    \
                 im_observers::DerdiyokGains {{ nu0: {nu0:?}, boundary_layer_a: {layer:?}, filter_rad_s, anchor_per_s }}\n}}"
            ),
        );
        self.item(
            "With the usual filter and anchor, as `im observe --gains` takes this certificate. That the flux converges is not proven; without \
             the anchor it is a bare integral, in which a wrong R_s and an error at the start stay.",
            "pub const GAINS: im_observers::DerdiyokGains =\n    \
             gains(im_observers::DerdiyokGains::USUAL_FILTER_RAD_S, im_observers::DerdiyokGains::USUAL_ANCHOR_PER_S);",
        );
    }

    fn utkin(&mut self, omega0: f64, layer: f64) {
        self.item(
            "omega0 (mechanical rad/s) and its boundary layer (A Wb; 0 is the sign itself) of the proof, which is that s_n = 0 is attractive. \
             The filter (rad/s, 0 for none) is on the speed shown, which is not in it: the proof holds with any.",
            &format!(
                "pub const fn gains(filter_rad_s: f64) -> im_observers::UtkinGains {{\n    \
                 im_observers::UtkinGains {{ omega0_rad_s: {omega0:?}, boundary_layer_avs: {layer:?}, filter_rad_s }}\n}}"
            ),
        );
        self.item(
            "With the usual filter, as `im observe --gains` takes this certificate. That flux and speed converge is not proven.",
            "pub const GAINS: im_observers::UtkinGains = gains(im_observers::UtkinGains::USUAL_FILTER_RAD_S);",
        );
    }

    fn kenne(&mut self, d: &crate::kenne::KenneDesign, layers: Option<[f64; 2]>) {
        let t = self.scalar();
        for (name, doc, x) in
            [("K_X", "K of (34), A/s^2.", d.k_x), ("K_RR_PER_S", "k_Rr over the nominal rotor resistance, 1/s.", d.k_rr_per_s)]
        {
            let item = format!("pub const {name}: {t} = {};", self.own(x));
            self.item(doc, &item);
        }
        let [k_sq, k_sd, c_omega, c_lambda] = [d.k_sq, d.k_sd, d.region.c_omega, d.region.c_lambda].map(|x| self.own(x));
        let layers = layers.map_or(String::new(), |[omega, lambda]| {
            format!("\n        boundary_omega: {},\n        boundary_lambda: {},", self.own(omega), self.own(lambda))
        });
        let item = format!(
            "pub fn gains(rest: im_control::KenneGains<{t}>) -> im_control::KenneGains<{t}> {{\n    im_control::KenneGains {{\n        \
             k_sq: {k_sq},\n        k_sd: {k_sd},\n        c_omega: {c_omega},\n        c_lambda: {c_lambda},{layers}\n        ..rest\n    }}\n}}"
        );
        self.item("The gains of the proof, with the rest of the law from `rest` (`KenneGains::typical`).", &item);
    }

    fn jadot(&mut self, d: &crate::jadot::JadotDesign) {
        let t = self.scalar();
        let doc = "K_B = this/|B|^2 in (34), 1/s.";
        let item = format!("pub const ADAPTATION_RATE_PER_S: {t} = {};", self.own(d.adaptation_rate_per_s));
        self.item(doc, &item);
        let item = format!("pub const ADAPTATION_FREQUENCY_RAD_S: {t} = {};", self.own(d.adaptation_frequency_rad_s));
        self.item("K_W = this^2/|W|^2 in (47), rad/s.", &item);
        let [k_p, k_i, s_p, s_i, lambda] =
            [d.current_proportional_ohm, d.current_integral_per_s, d.speed_proportional, d.speed_integral_per_s, d.lambda_h]
                .map(|x| self.own(x));
        let item = format!(
            "pub const GAINS: im_control::JadotGains<{t}> = im_control::JadotGains {{\n    current_proportional_ohm: {k_p},\n    \
             current_integral_per_s: {k_i},\n    speed_proportional: {s_p},\n    speed_integral_per_s: {s_i},\n    \
             lambda: im_identify::online::Lambda::Constant({lambda}),\n    field_weakening: None,\n}};"
        );
        self.item("The gains; the flux is not weakened, as proven.", &item);
    }

    fn law(&mut self, torque_n_m: [f64; 2], law: &Law) -> Result<(), DesignError> {
        let t = self.scalar();
        let own = |x: &[f64]| Self::list(x, |x| self.own(x));
        let form = match law {
            Law::Series { current, slip } => {
                if current.len().max(slip.len()) > SERIES {
                    let what = format!(
                        "{} coefficients are more than the {SERIES} of im_control::MtpaLaw",
                        current.len().max(slip.len())
                    );
                    return Err(DesignError::request(what + "; a larger tolerance or a narrower range of torque needs fewer"));
                }
                let filled = |x: &[f64]| own(&[x, &vec![0.0; SERIES - x.len()]].concat());
                format!("Series {{\n        current: {},\n        slip: {},\n    }}", filled(current), filled(slip))
            }
            Law::Kwon { a, b, c } => format!("Kwon {{ a: {}, b: {}, c: {} }}", own(a), own(b), own(c)),
        };
        let item = format!(
            "pub const LAW: im_control::MtpaLaw<{t}> =\n    im_control::MtpaLaw {{ torque_nm: {}, form: im_control::mtpa::LawForm::{form} }};",
            own(&torque_n_m)
        );
        self.item("Current (rms A) and slip (electrical rad/s) over torque (N m).", &item);
        Ok(())
    }
}

impl Certificate {
    /// Rust source of a module with the gains as the struct that im-observers or im-control takes, and where they come from.
    ///
    /// # Errors
    /// As [`Certificate::in_f32`]; a series longer than im-control holds.
    pub fn to_rust(&self, precision: Precision, from: &Provenance) -> Result<String, DesignError> {
        match precision {
            Precision::F64 => self.to_rust_as(self, precision, from),
            Precision::F32 => self.to_rust_as(&self.in_f32()?, precision, from),
        }
    }

    /// The same with the gains of `certificate`, which is [`Certificate::in_f32`] of this one, or this one itself.
    ///
    /// # Errors
    /// A series longer than im-control holds.
    pub fn to_rust_as(&self, certificate: &Certificate, precision: Precision, from: &Provenance) -> Result<String, DesignError> {
        let set = GainSet::from(&certificate.design);
        let mut out = Source { precision, text: String::new() };
        let plain = |text: &str| text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect::<String>();
        let mut doc = vec![
            "Gains made by `im design`; SI units.".to_owned(),
            String::new(),
            format!("Motor: {} (SHA-256 of its parameters {}).", plain(&from.motor), certificate.plant.digest()),
            format!("Certificate: {} (SHA-256 {}).", set.kind, self.digest),
        ];
        if precision == Precision::F32 {
            doc.push(format!("Rounded to f32 so that the claim holds, and proven as rounded (SHA-256 {}).", certificate.digest));
        }
        if let Some(file) = &from.file {
            doc.push(format!("`im design check {}` decides this proof again.", plain(file)));
        }
        if !from.effects_left_out.is_empty() {
            doc.push(format!("Effects of the motor that the proof leaves out: {}.", plain(&from.effects_left_out.join(", "))));
        }
        doc.push(String::new());
        doc.push(certificate.design.theorem().to_owned());
        doc.push(String::new());
        // What is no gain is said in words: the region, rates, periods.
        let matrix = |v: &Value| matches!(v, Value::Matrix(_) | Value::List(_));
        for gain in set.gains.iter().filter(|g| !matrix(&g.value)) {
            let value = match &gain.value {
                Value::Range([low, high]) => format!("{low:?} to {high:?}"),
                Value::Scalar(x) => format!("{x:?}"),
                _ => String::new(),
            };
            doc.push(format!("* `{}` = {value}: {}", gain.name, gain.meaning.replace('^', "\\^").replace(['<', '>', '['], "")));
        }
        for line in doc {
            let _ = writeln!(out.text, "{}", format!("/// {line}").trim_end());
        }
        let _ = writeln!(out.text, "pub mod {} {{", set.kind);
        match &certificate.design {
            Design::Thau(d) => out.thau(&d.gain),
            Design::SampledThau(d) => {
                out.euler(d.period_s);
                out.thau(&d.gain);
            }
            Design::ThauBox(d) => out.boxed(d.region.frame_rad_s, &d.gain, &d.gain_per_frame_speed),
            Design::SampledThauBox(d) => {
                out.euler(d.period_s);
                out.boxed(d.region.frame_rad_s, &d.gain, &d.gain_per_frame_speed);
            }
            Design::Kubota(d) => out.scheduled(&d.gain, &d.gain_per_speed),
            Design::Sampled(d) => {
                out.euler(d.period_s);
                out.scheduled(&d.gain, &d.gain_per_speed);
            }
            Design::KubotaLoop(d) => out.adaptive(&d.gains),
            Design::SampledKubotaLoop(d) => {
                out.euler(d.period_s);
                out.adaptive(&d.gains);
            }
            Design::Derdiyok(d) => out.derdiyok(d.nu0, 0.0),
            Design::SampledDerdiyok(d) => {
                out.euler(d.period_s);
                out.derdiyok(d.continuous.nu0, d.boundary_layer_a);
            }
            Design::Utkin(d) => out.utkin(d.omega0_rad_s, 0.0),
            Design::SampledUtkin(d) => {
                out.euler(d.period_s);
                out.utkin(d.continuous.omega0_rad_s, d.boundary_layer_avs);
            }
            Design::Kenne(d) => out.kenne(d, None),
            Design::SampledKenne(d) => {
                out.period(d.period_s);
                out.kenne(&d.continuous, Some([d.boundary_omega, d.boundary_lambda]));
            }
            Design::Jadot(d) => out.jadot(d),
            Design::SampledJadot(d) => {
                out.period(d.period_s);
                out.jadot(&d.continuous);
            }
            Design::Mtpa(d) => out.law(d.torque_n_m, &d.law)?,
        }
        out.text.push_str("}\n");
        Ok(out.text)
    }
}
