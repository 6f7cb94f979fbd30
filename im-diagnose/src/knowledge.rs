//! What was known of parameters, and what recordings make of them.

use im_identify::offline::HALF_95;
use im_model::{BaseParameter, Machine, MotorFile, ParameterId};

use crate::format::{number, quantity};

/// So many times what is given a parameter does not move but for a reason.
const TIMES: f64 = 20.0;

/// A value that was known is contradicted from so many of its tolerances on, which stand for two standard deviations.
const CONTRADICTED: f64 = 2.0;

/// Parameters that left what was known of them, beyond what their own standard deviations let; and those of the base machine that are many times what
/// was given. A sentence each; `name` is what a parameter is called in it.
pub fn contradicted(
    before: &MotorFile,
    after: &Machine<f64>,
    std: impl Fn(ParameterId) -> Option<f64>,
    name: impl Fn(ParameterId) -> String,
) -> Vec<(ParameterId, String)> {
    let known = before.known.iter().filter_map(|(&id, k)| {
        let (now, std) = (after.get(id), std(id).filter(|s| s.is_finite())?);
        let off = (now / k.value).ln().abs() - HALF_95 * std / now.abs();
        (k.tolerance > 0.0 && off > CONTRADICTED * k.tolerance.ln_1p()).then(|| {
            let said = format!(
                "{} is known to be {} within {}, and is {} here: the value given, its temperature, a gain or the model is wrong",
                name(id),
                quantity(k.value, id.unit(), 3),
                if k.tolerance < 0.5 {
                    format!("{} %", number(100.0 * k.tolerance, 2))
                } else {
                    format!("a factor of {}", number(1.0 + k.tolerance, 2))
                },
                quantity(now, id.unit(), 3)
            );
            (id, said)
        })
    });
    let far = BaseParameter::ALL.map(ParameterId::Base).into_iter().filter_map(|id| {
        let ratio = after.get(id) / before.machine.get(id);
        let moved = ratio.is_finite() && ratio > 0.0 && ratio.ln().abs() > TIMES.ln();
        moved.then(|| {
            let (times, than) = if ratio > 1.0 { (ratio, "larger") } else { (1.0 / ratio, "smaller") };
            (id, format!("{} is {} times {than} than given: no machine is so far from its papers", name(id), number(times, 2)))
        })
    });
    known.chain(far).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_model::{Known, machines::MOTULATOR_2_2_KW};

    #[test]
    fn what_was_known_is_contradicted_beyond_tolerance_and_interval() {
        let m = MOTULATOR_2_2_KW;
        let machine = Machine::base(m.parameters(), m.pole_pairs).unwrap();
        let mut motor = MotorFile::new("m", machine, m.rating);
        let id = ParameterId::Base(BaseParameter::StatorResistance);
        let value = machine.get(id);
        let said = |motor: &MotorFile, times: f64, std: f64| {
            let after = machine.with(&[(id, times * value)]).unwrap();
            contradicted(motor, &after, |_| Some(std * value), |_| "R_s".into())
        };
        assert!(said(&motor, 0.5, 0.01).is_empty(), "nothing was known");
        assert!(said(&motor, 0.04, 0.01)[0].1.contains("25 times smaller"));
        motor.known.insert(id, Known { value, tolerance: 0.02 });
        assert!(said(&motor, 1.03, 0.001).is_empty() && said(&motor, 1.2, 0.15).is_empty());
        let text = said(&motor, 1.1, 0.01);
        assert!(text.len() == 1 && text[0].1.contains("within 2 %"), "{text:?}");
        motor.known.insert(id, Known { value, tolerance: 0.0 });
        assert!(said(&motor, 1.1, 0.01).is_empty(), "held");
    }
}
