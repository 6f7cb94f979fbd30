//! Forgeries of every kind of certificate, each false or broken by construction, by a forger who makes margins and digest anew: all refused.
//!
//! `IM_FORGERIES=2000` sets how many of each kind are to be refused (50 when not given); `--nocapture` prints the counts.

use super::support::{every, four_kilowatts, modelled};
use im_design::certificate::{Certificate, Design, Difference};
use im_design::machine::Constants;
use im_design::mtpa::{Circuit, Law, MtpaDesign};
use im_design::request::{Kind, design};
use im_design::{DesignModel, LinearMachine};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use toml::Value;

/// Random choices: SplitMix64.
struct Dice(u64);

impl Dice {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let x = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        x ^ (x >> 31)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() % n.max(1) as u64) as usize
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn one<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.below(of.len())]
    }
}

/// Every number below a place, with its key.
fn numbers<'a>(key: &str, value: &'a mut Value, found: &mut Vec<(String, &'a mut Value)>) {
    match value {
        Value::Float(_) | Value::Integer(_) => found.push((key.to_owned(), value)),
        Value::Array(items) => items.iter_mut().for_each(|item| numbers(key, item, found)),
        Value::Table(table) => table.iter_mut().for_each(|(key, item)| numbers(key, item, found)),
        _ => {}
    }
}

fn part<'a>(value: &'a mut Value, name: &str) -> &'a mut Value {
    value.get_mut(name).expect("a certificate has it")
}

/// What is in the tables below a place, as paths of keys.
fn keys(value: &Value, path: &[String], found: &mut Vec<Vec<String>>) {
    if let Value::Table(table) = value {
        for (key, item) in table {
            let path = [path, std::slice::from_ref(key)].concat();
            found.push(path.clone());
            keys(item, &path, found);
        }
    }
}

fn at<'a>(value: &'a mut Value, path: &[String]) -> &'a mut Value {
    path.iter().fold(value, |v, key| v.get_mut(key).expect("the path is there"))
}

/// The forger's seal: margins that the checker would find, where it finds any, and the digest over the whole.
fn sealed(mut value: Value) -> String {
    let honest = toml::to_string(&value).ok().and_then(|text| toml::from_str::<Certificate>(&text).ok());
    if let Some(margins) = honest.and_then(|c| c.prove().ok()) {
        *part(&mut value, "margins") = Value::try_from(margins).unwrap();
    }
    resealed(value)
}

/// The digest alone made anew.
fn resealed(mut value: Value) -> String {
    *part(&mut value, "digest") = Value::String(String::new());
    // The canonical text is that of the certificate where it is one.
    let text = toml::to_string(&value).unwrap();
    let canonical = toml::from_str::<Certificate>(&text).ok().and_then(|c| c.to_text().ok()).unwrap_or(text);
    let digest = Sha256::digest(canonical.as_bytes()).iter().map(|b| format!("{b:02x}")).collect();
    *part(&mut value, "digest") = Value::String(digest);
    toml::to_string(&value).unwrap()
}

/// The claim itself made false.
fn false_claim(certificate: &Certificate, dice: &mut Dice) -> Value {
    let c = certificate.plant.constants::<f64>();
    let beyond = dice.between(0.01, 1.0).mul_add(10.0, 1.0);
    let fast = beyond * (2.0 * c.gamma + 1e4);
    let mut forged = certificate.clone();
    match &mut forged.design {
        Design::Thau(d) => d.lipschitz *= beyond,
        Design::ThauBox(d) => d.rate_per_s += fast,
        Design::Kubota(d) => d.rate_per_s = beyond * c.eta,
        Design::KubotaLoop(d) => d.cells[0].rate_per_s = fast,
        Design::Derdiyok(d) if dice.below(2) == 0 => d.speed_max_rad_s *= beyond,
        Design::Derdiyok(d) => d.nu0 /= beyond,
        Design::Utkin(d) if dice.below(2) == 0 => d.region.speed_max_rad_s *= beyond,
        Design::Utkin(d) => d.omega0_rad_s /= beyond,
        Design::Kenne(d) if dice.below(2) == 0 => d.k_sq /= 0.1 + beyond,
        Design::Kenne(d) => d.k_sd /= 0.1 + beyond,
        Design::Jadot(d) => d.electrical_rate_per_s = fast,
        Design::Sampled(d) => d.contraction = 0.5 / beyond,
        Design::SampledThauBox(d) => d.contraction = 0.1 / beyond,
        Design::SampledThau(d) => d.lipschitz *= 2.0 * beyond,
        Design::SampledDerdiyok(d) if dice.below(2) == 0 => d.period_s *= beyond,
        Design::SampledDerdiyok(d) => d.boundary_layer_a /= beyond,
        Design::SampledUtkin(d) if dice.below(2) == 0 => d.period_s *= beyond,
        Design::SampledUtkin(d) => d.boundary_layer_avs /= beyond,
        Design::SampledKenne(d) if dice.below(2) == 0 => d.period_s *= beyond,
        Design::SampledKenne(d) => d.boundary_lambda /= beyond,
        Design::SampledJadot(d) => d.outer.rate_per_s = fast,
        Design::SampledKubotaLoop(d) => d.cells[0].contraction = 0.5 / beyond,
        Design::Mtpa(d) => {
            let Law::Series { current, .. } = &mut d.law else { unreachable!("the series were asked for") };
            current[0] += dice.one(&[-0.02, 0.02]) * beyond;
        }
    }
    Value::try_from(forged).unwrap()
}

/// A parameter off by a thousandth: what is claimed may hold of that machine too, and is then true, of it.
const A_HAIR: &str = "a machine a hair off";
/// Another machine under laws of a q-d circuit, of which the machine's pole pairs alone are part.
const A_CIRCUIT_OF_ITS_OWN: &str = "another machine under a circuit of its own";

/// Laws for the q-d circuit of Kwon et al., Table V, with the pole pairs of a machine.
fn of_a_qd_circuit(machine: &LinearMachine) -> (String, Certificate) {
    let region = "torque_n_m = [50.0, 150.0]\ntolerance = 0.01\npoints = 3\n[aqdm]\nrotor_leakage = [1.40e-4, 4.15e-3, 7.35e-1, 2.59]\n\
                  magnetizing = [6.79, 6.62e-1, 5.03, 1.85, 8.68e-1, 1.29e-1]\n\
                  rotor = [[5.65, 3.21e-2], [4.40e-2, 4.78e-4], [3.17e-3, 8.76e-8]]\n";
    ("mtpa of a q-d circuit".into(), design(Kind::Mtpa, DesignModel::Machine(*machine), region).unwrap())
}

/// Every kind, and where a kind has two subjects, both.
fn all(machine: &LinearMachine) -> impl Iterator<Item = (String, Certificate)> {
    every(machine).into_iter().chain([of_a_qd_circuit(machine)])
}

/// A forgery, and what was done.
fn forgery(certificate: &Certificate, others: &[LinearMachine], dice: &mut Dice) -> (&'static str, String) {
    let mut value = Value::try_from(certificate.clone()).unwrap();
    match dice.below(9) {
        0 => {
            // Any number, by a hair, under the old seal.
            let mut all = Vec::new();
            numbers("", &mut value, &mut all);
            let n = all.len();
            let (_, x) = &mut all[dice.below(n)];
            match x {
                Value::Integer(i) => *i += 1,
                Value::Float(f) => *f = if *f == 0.0 { 1e-9 } else { *f * (1.0 + dice.between(1e-15, 1e-2)) + f64::MIN_POSITIVE },
                _ => {}
            }
            let changed = toml::to_string(&value).unwrap();
            let same = toml::from_str::<Certificate>(&changed).is_ok_and(|c| c == *certificate);
            if same {
                return forgery(certificate, others, dice);
            }
            ("a number under the old seal", changed)
        }
        1 => {
            let Value::Array(margins) = part(&mut value, "margins") else { unreachable!() };
            let k = dice.below(margins.len());
            match dice.below(3) {
                0 => drop(margins.remove(k)),
                1 => margins[k]["margin"] = Value::Float(dice.between(0.0, 1.0)),
                _ => margins[k]["name"] = Value::String("nothing of importance".into()),
            }
            ("margins", resealed(value))
        }
        2 => ("the claim made false", sealed(false_claim(certificate, dice))),
        3 => {
            let huge = [f64::INFINITY, f64::NEG_INFINITY, f64::NAN, 1e40, -1e40, 1e300, -1e300, f64::MAX];
            let name = dice.one(&["plant", "design"]);
            let mut all = Vec::new();
            numbers("", part(&mut value, name), &mut all);
            let n = all.len();
            let (_, x) = &mut all[dice.below(n)];
            **x = match x {
                Value::Integer(_) => Value::Integer(dice.one(&[0, -1, 101, 1_000_000, i64::MAX])),
                _ => Value::Float(dice.one(&huge)),
            };
            ("infinities and exponents", sealed(value))
        }
        4 => {
            // A condition, a vertex of a region, a field left out. Of a law and its witnesses fewer may do: there the ends go.
            let mut all = Vec::new();
            keys(&value, &[], &mut all);
            let path = all[dice.below(all.len())].clone();
            let last = path.last().unwrap().clone();
            let list = at(&mut value, &path).as_array().map(Vec::len);
            match list {
                Some(n) if n > 0 && !["current", "slip", "points", "margins"].contains(&last.as_str()) => {
                    let k = dice.below(n);
                    let Value::Array(items) = at(&mut value, &path) else { unreachable!() };
                    items.remove(k);
                }
                Some(n) if last == "points" && n > 0 => {
                    let k = dice.one(&[0, n - 1]);
                    let Value::Array(items) = at(&mut value, &path) else { unreachable!() };
                    items.remove(k);
                }
                _ => drop(at(&mut value, &path[..path.len() - 1]).as_table_mut().unwrap().remove(&last)),
            }
            (
                "conditions and fields left out",
                if value.get("margins").is_some() && value.get("digest").is_some() {
                    sealed(value)
                } else {
                    toml::to_string(&value).unwrap()
                },
            )
        }
        5 => {
            // Another machine under the statement as it stands.
            let k = dice.below(others.len());
            *part(&mut value, "plant") = Value::try_from(DesignModel::Machine(others[k])).unwrap();
            let how = match &certificate.design {
                Design::Mtpa(d) if matches!(d.circuit, Circuit::Aqdm(_)) => A_CIRCUIT_OF_ITS_OWN,
                _ if k < 2 => "the machine exchanged",
                _ => A_HAIR,
            };
            (how, resealed(value))
        }
        6 => {
            let key = dice.one(&[
                "stator_resistance_ohm",
                "rotor_resistance_ohm",
                "stator_inductance_h",
                "rotor_inductance_h",
                "mutual_inductance_h",
                "inertia_kg_m2",
            ]);
            let x = dice.one(&[0.0, -1.0, 1e-12, 1e12]) * dice.between(0.5, 2.0);
            part(part(&mut value, "plant"), "machine")[key] = Value::Float(x);
            ("a machine that nobody has", sealed(value))
        }
        7 => {
            // Constants instead of the machine, one of them with an impossible sign or size, or not that of the others.
            let mut constants = certificate.plant.constants::<f64>();
            let x = dice.one(&[-1.0, 0.0, 1e-12, 1e12]);
            match dice.below(7) {
                0 => constants.beta *= x,
                1 => constants.eta *= x,
                2 => constants.n_p = dice.one(&[0.0, -1.0, 1.5, 1e4]),
                3 => constants.gamma *= dice.between(1.001, 3.0),
                4 => constants.inverse_sigma_l_s *= x,
                5 => constants.eta_l_m *= x,
                _ => constants.stator_rate *= dice.one(&[-1.0, 0.5, 2.0]),
            }
            *part(&mut value, "plant") = Value::try_from(DesignModel::Constants(constants)).unwrap();
            ("constants of no machine", sealed(value))
        }
        _ => {
            // A range upside down, a period or a torque range beyond what is decided.
            let mut all = Vec::new();
            keys(part(&mut value, "design"), &[], &mut all);
            all.retain(|path| {
                let last = path.last().unwrap();
                ["_rad_s", "torque_n_m", "flux_d_vs", "flux_q_vs", "period_s"].iter().any(|end| last.ends_with(end))
            });
            let path = all[dice.below(all.len().max(1))..].first().cloned();
            let Some(path) = path else { return forgery(certificate, others, dice) };
            match at(part(&mut value, "design"), &path) {
                Value::Array(items) if items.len() == 2 && items[0] != items[1] => items.reverse(),
                Value::Float(x) if path.last().unwrap() == "period_s" => *x = dice.one(&[5e-324, 1e-320, 0.0, -1e-5, 1e3]),
                Value::Float(x) => *x = -x.abs() - 1.0,
                _ => return forgery(certificate, others, dice),
            }
            ("a region that is none", sealed(value))
        }
    }
}

#[test]
fn no_forgery_of_any_kind_is_accepted() {
    let wanted: usize = std::env::var("IM_FORGERIES").ok().and_then(|n| n.parse().ok()).unwrap_or(50);
    let only = std::env::var("IM_KIND").ok();
    let machine = four_kilowatts();
    let motor = modelled(&machine);
    let off = |d: &Difference| (d.certified / d.motor - 1.0).abs() > 5e-4;
    let is_another = |c: &Certificate| c.differences(&motor).is_ok_and(|d| d.iter().any(off));
    let others = [
        LinearMachine::kwon_table_iv(),
        LinearMachine::kenne_appendix_ii(),
        LinearMachine { rotor_resistance_ohm: 1.001 * machine.rotor_resistance_ohm, ..machine },
        LinearMachine { stator_inductance_h: 1.001 * machine.stator_inductance_h, ..machine },
    ];
    for (name, certificate) in all(&machine) {
        if only.as_ref().is_some_and(|kind| *kind != name) {
            continue;
        }
        let text = certificate.to_text().unwrap();
        Certificate::check_text(&text).unwrap_or_else(|e| panic!("{name}: the true one is refused: {e}"));
        let mut dice = Dice(7);
        let mut refused: BTreeMap<&str, usize> = BTreeMap::new();
        let (mut count, mut true_of_it) = (0, 0);
        while count < wanted {
            let (how, forged) = forgery(&certificate, &others, &mut dice);
            match Certificate::check_text(&forged) {
                Err(_) => {
                    *refused.entry(how).or_default() += 1;
                    count += 1;
                }
                // Decided anew for the machine in the file, and distinguished from the motor.
                Ok((c, _)) if [A_HAIR, A_CIRCUIT_OF_ITS_OWN].contains(&how) && is_another(&c) => true_of_it += 1,
                Ok(_) => panic!("{name}: {how} is accepted:\n{forged}"),
            }
        }
        println!("{name}: {count} refused: {refused:?}; {true_of_it} of another machine and true of it");
    }
}

/// Statements that were once taken for true, each sealed anew with the margins that the checker finds.
#[test]
fn what_was_once_accepted_is_refused() {
    let machine = four_kilowatts();
    let certificates: BTreeMap<String, Certificate> = all(&machine).collect();
    let value = |kind: &str| Value::try_from(certificates[kind].clone()).unwrap();
    let set = |mut value: Value, path: &[&str], to: Value| {
        let path: Vec<String> = path.iter().map(|k| (*k).to_owned()).collect();
        let (last, table) = path.split_last().unwrap();
        at(&mut value, table).as_table_mut().unwrap().insert(last.clone(), to);
        value
    };
    let constants = |change: fn(&mut Constants<f64>)| {
        let mut c = machine.constants::<f64>();
        change(&mut c);
        set(value("derdiyok"), &["plant"], Value::try_from(DesignModel::Constants(c)).unwrap())
    };
    let law = |circuit: &str, by: f64| {
        let mut forged = certificates[circuit].clone();
        let Design::Mtpa(MtpaDesign { law: Law::Series { current, .. }, .. }) = &mut forged.design else { unreachable!() };
        current.iter_mut().for_each(|c| *c += by / 2.0);
        Value::try_from(forged).unwrap()
    };
    let qd = "mtpa of a q-d circuit";
    let torques = Value::Array([1e-300, 1e10].map(Value::Float).to_vec());
    for (what, forged) in [
        ("beta of the wrong sign", constants(|c| c.beta = -c.beta)),
        ("no pole pairs", constants(|c| c.n_p = 0.0)),
        ("nu0 of eight volts", set(value("derdiyok"), &["design", "derdiyok", "nu0"], Value::Float(8.0))),
        ("a resistance of no winding", set(value("kubota"), &["plant", "machine", "rotor_resistance_ohm"], Value::Float(1e-9))),
        (
            "a period at which forward Euler leaves the machine",
            set(value("sampled"), &["design", "sampled", "period_s"], Value::Float(0.3)),
        ),
        (
            "an optimum looked for in a sliver of slips",
            set(law(qd, 2.0), &["design", "mtpa", "slip_max_rad_s"], Value::Float(1e-3)),
        ),
        ("more current than is needed", law(qd, 0.3)),
        ("the same of a motor's own circuit", law("mtpa", 0.3)),
        ("torques of no machine", set(value(qd), &["design", "mtpa", "torque_n_m"], torques)),
    ] {
        assert!(Certificate::check_text(&sealed(forged)).is_err(), "{what}");
    }
}

/// A true certificate shown for another motor is distinguished from it, whatever its kind.
#[test]
fn a_certificate_is_about_one_machine() {
    let motor = modelled(&four_kilowatts());
    for (name, certificate) in every(&LinearMachine::from(&motor)) {
        assert_eq!(certificate.differences(&motor).unwrap(), [], "{name}");
        for parameter in im_model::BaseParameter::ALL {
            let id = im_model::ParameterId::Base(parameter);
            let other = motor.with(&[(id, motor.get(id) * 1.001 + 1e-6)]).unwrap();
            assert!(!certificate.differences(&other).unwrap().is_empty(), "{name}: {id}");
        }
    }
}
