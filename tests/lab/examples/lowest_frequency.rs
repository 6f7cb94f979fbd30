//! The lowest stator frequency at which each observer holds, against the error of R_s, the dead time and the load: the map of docs/background/observers.md.
//!
//!     cargo run --release -p im-lab --example lowest_frequency -- [--docs docs]
//!
//! Machines are held at rated flux, at a stator frequency and a load (the rotor turns as the slip asks for it; braking at −100 %); the observer starts right
//! and has 6 s. It holds where in the last second the speed is within the rated slip and the flux vector within 30 % of rated flux. The figure is the
//! lowest of the frequencies tried from which on upwards it holds.

use im_design::plot::{Series, chart};
use im_lab::observation::{Truth, held, machine};
use im_model::effects::{Hooks, InverterNonlinearity};
use im_model::machines::{JADOT_TABLE_I, MOTULATOR_2_2_KW, NamedMachine};
use im_model::{BaseParameter, Machine, ParameterId, Rating};
use im_observers::*;
use std::fmt::Write;

const H: f64 = 1e-4;
const DURATION_S: f64 = 6.0;
/// Stator frequencies, Hz.
const FREQUENCIES: [f64; 11] = [0.1, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0];
const STATOR: [f64; 5] = [0.8, 0.9, 1.0, 1.1, 1.2];
/// Share of rated torque.
const LOADS: [f64; 3] = [-1.0, 0.0, 1.0];
/// Voltage that dead time takes from a phase and nobody compensates, as a share of rated voltage.
const DEAD_TIMES: [f64; 2] = [0.0, 0.01];

struct Held {
    truth: Truth,
    omega: f64,
}

impl Held {
    fn new(m: &NamedMachine, hertz: f64, load: f64, duration_s: f64) -> Self {
        let slip = load * rated_slip(m);
        let omega = (core::f64::consts::TAU * hertz - slip) / f64::from(m.pole_pairs);
        Self { truth: Truth::of(&machine(m), &held(m, omega, slip, duration_s)), omega }
    }

    fn holds<O: Observer<f64>>(&self, m: &NamedMachine, observer: &O, dead: &InverterNonlinearity<f64>) -> bool {
        let t = &self.truth;
        let mut state = t.state(observer, 0);
        let last = t.len() - (1.0 / H) as usize;
        let (slip, flux) = (rated_slip(m) / f64::from(m.pole_pairs), 0.3 * m.rating.rotor_flux_vs);
        (1..t.len()).all(|k| {
            let mut input = t.input(k);
            let mean = (t.recording.i_s[k - 1] + t.recording.i_s[k]) * 0.5;
            // What was commanded is what the machine got and what the inverter took.
            input.u_s += input.u_s - dead.applied_voltage(input.u_s, mean);
            let e = observer.step(&mut state, &input);
            k < last || ((e.omega_m - self.omega).abs() <= slip && (e.rotor_flux_vs - t.flux[k]).norm() <= flux)
        })
    }
}

/// Electrical, rad/s.
fn rated_slip(m: &NamedMachine) -> f64 {
    let (r, p) = (&m.rating, m.parameters());
    r.torque_nm * p.rotor_resistance_ohm / (1.5 * f64::from(m.pole_pairs) * r.rotor_flux_vs * r.rotor_flux_vs)
}

/// An observer of a machine whose R_s is believed to be `stator` times what it is.
fn believed(m: &NamedMachine, stator: f64) -> Machine<f64> {
    let right = machine(m);
    let r_s = right.parameters().stator_resistance_ohm;
    right.with(&[(ParameterId::Base(BaseParameter::StatorResistance), stator * r_s)]).expect("positive")
}

/// Rows of the table, an observer each.
struct Map<'a> {
    m: &'a NamedMachine,
    /// By load and frequency.
    runs: Vec<Vec<Held>>,
    text: String,
    /// Under the braking load, without dead time: R_s error in per cent, Hz.
    lines: Vec<Series>,
}

impl Map<'_> {
    fn row<O: Observer<f64>>(&mut self, title: &str, make: impl Fn(Basis<f64>, &Machine<f64>, &Rating) -> O) {
        let m = self.m;
        let _ = write!(self.text, "| {title} |");
        for (runs, load) in self.runs.iter().zip(LOADS) {
            for dead in DEAD_TIMES {
                let cells = STATOR.map(|stator| {
                    let machine = believed(m, stator);
                    let observer = make(Basis::try_new(&machine, &m.rating, H).expect("valid"), &machine, &m.rating);
                    let inverter = InverterNonlinearity {
                        voltage_v: dead * m.rating.phase_voltage_peak_v,
                        zero_crossing_current_a: 0.02 * m.rating.current_peak_a(&m.parameters(), m.pole_pairs),
                        ..Default::default()
                    };
                    let lost = runs.iter().rposition(|run| !run.holds(m, &observer, &inverter));
                    lost.map_or(Some(FREQUENCIES[0]), |k| FREQUENCIES.get(k + 1).copied())
                });
                let shown = cells.map(|hz| hz.map_or("–".to_owned(), |hz| hz.to_string()));
                let _ = write!(self.text, " {} |", shown.join(" "));
                if load < 0.0 && dead == 0.0 {
                    let points =
                        STATOR.iter().zip(cells).filter_map(|(r, hz)| Some((100.0 * (r - 1.0), hz?))).collect::<Vec<_>>();
                    self.lines.push(Series::line(title, points));
                }
            }
        }
        self.text.push('\n');
        println!("{}", self.text.lines().last().unwrap_or_default());
    }
}

impl Visit<f64> for Map<'_> {
    fn visit<O: Named<f64> + 'static>(&mut self) {
        if !O::NEEDS_SPEED {
            self.row(O::TITLE, |basis, machine, rating| O::made(basis, machine, rating, &StartingGains).expect("gains that fit"));
        }
    }
}

fn map(m: &NamedMachine) -> (String, Vec<Series>) {
    let runs =
        LOADS.map(|load| FREQUENCIES.map(|hz| Held::new(m, hz, load, DURATION_S)).into_iter().collect()).into_iter().collect();
    let mut map = Map { m, runs, text: String::new(), lines: Vec::new() };
    let _ = writeln!(map.text, "### {}\n", m.name);
    let head: Vec<String> = LOADS
        .iter()
        .flat_map(|load| DEAD_TIMES.map(|dead| format!("{:.0} % load, dead time {:.0} %", 100.0 * load, 100.0 * dead)))
        .collect();
    let _ = writeln!(map.text, "| Observer | {} |\n|{}", head.join(" | "), " --- |".repeat(head.len() + 1));
    each(&mut map);
    map.row("full-order, R_s fixed", |basis, machine, rating| {
        let gains = FullOrderGains { stator_resistance_per_s: 0.0, ..FullOrderGains::for_machine(machine, rating) };
        FullOrder::try_new(basis, gains).expect("gains that fit")
    });
    map.row("Kubota, L = 0", |basis, machine, rating| {
        let (proportional, integral) = KubotaGains::speed_law(machine, rating, 400.0);
        Kubota::try_new(basis, KubotaGains::without_feedback(proportional, integral)).expect("gains that fit")
    });
    (map.text + "\n", map.lines)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let docs = match (arguments.next().as_deref(), arguments.next()) {
        (None, _) => "docs".to_owned(),
        (Some("--docs"), Some(docs)) => docs,
        _ => return Err("only --docs DIRECTORY is known".into()),
    };
    let page = std::path::Path::new(&docs).join("background/observers.md");
    let mut text = std::fs::read_to_string(&page).map_err(|e| format!("{}: {e}", page.display()))?;
    let [(first, lines), (second, _)] = [MOTULATOR_2_2_KW, JADOT_TABLE_I].map(|m| map(&m));
    let maps = first + &second;
    let (begin, end) = ("<!-- lowest: begin -->\n", "<!-- lowest: end -->");
    let (Some(a), Some(b)) = (text.find(begin), text.find(end)) else {
        println!("{maps}");
        return Err(format!("{}: the markers {} and {end} are not there", page.display(), begin.trim()).into());
    };
    text.replace_range(a + begin.len()..b, &maps);
    let title = "Lowest stator frequency, braking with rated torque (motulator_2_2_kw)";
    let picture = chart(title, "error of R_s, %", "Hz", &lines);
    let image = std::path::Path::new(&docs).join("images/observers/lowest_frequency.svg");
    im_model::write_atomically(&image, |out| std::io::Write::write_all(out, picture.as_bytes()))?;
    im_model::write_atomically(&page, |out| std::io::Write::write_all(out, text.as_bytes()))?;
    Ok(())
}
