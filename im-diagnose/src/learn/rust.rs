//! A learned curve as the source of an effect of one's own: its nearest formula at the place where it acts.

use std::fmt::Write as _;

use im_model::effects::{Acts, COEFFICIENTS, Over};

use super::Curve;
use crate::sources::Refused;

/// Names of the numbers in a formula.
const FACTORS: [&str; 4] = ["a", "b", "c", "d"];
const SHAPES: [&str; 2] = ["s", "t"];

/// The variable where the machine is, as Rust.
fn variable(acts: Acts, over: Over) -> Option<&'static str> {
    Some(match over {
        Over::Speed if acts.is_over_magnitude(over) => "at.state.omega_m().abs()",
        Over::Speed => "at.state.omega_m()",
        Over::Time => "own[0]",
        Over::Current => "length(at.currents.i_s)",
        Over::Slip => {
            "(dot(at.currents.i_r, j(at.state.psi_r())) * at.r_r / (norm2(at.state.psi_r()) + T::from_f64(1e-9))).abs()"
        }
        Over::Flux => "length(at.currents.psi_m)",
        Over::ShaftAngle => "self.order * at.state.theta_m()",
        // No arc tangent in the numbers of the model; a filter is no formula of its time constant.
        Over::FluxDirection | Over::Lag => return None,
    })
}

/// The hook with `x` for the variable and `f` for the formula.
fn hook(acts: Acts, over: Over) -> Option<String> {
    let drop = |name: &str, more: &str| {
        format!(
            "    fn {name}(&self, drop: Complex<T>, at: &Operating<T>, own: &[T]) -> Complex<T> {{\n        let _ = own;\n        let x = {};\n        \
             drop {more}\n    }}\n",
            variable(acts, over).unwrap_or_default()
        )
    };
    variable(acts, over)?;
    let brake = |more: &str| {
        format!(
            "    fn braking_torque(&self, torque: T, at: &Operating<T>, own: &[T]) -> T {{\n        let _ = own;\n        let x = {};\n        \
             torque + {more}\n    }}\n",
            variable(acts, over).unwrap_or_default()
        )
    };
    Some(match acts {
        Acts::Torque => brake("self.formula(x)"),
        Acts::Friction => brake("self.formula(x) * sense(at.state.omega_m())"),
        Acts::StatorResistance => drop("stator_drop", "+ at.currents.i_s * (at.r_s * self.formula(x))"),
        Acts::RotorResistance => drop("rotor_drop", "+ at.currents.i_r * (at.r_r * self.formula(x))"),
        Acts::Voltage => drop("stator_drop", "- at.input.u_s * self.formula(x)"),
        Acts::VoltageAngle => drop("stator_drop", "- j(at.input.u_s) * (self.formula(x) * sense(at.state.omega_m()))"),
        // A formula of one axis does not say what the other does.
        Acts::ShaftFlux => return None,
        Acts::CurrentSensor => {
            "    fn measured_current(&self, i: Complex<T>) -> Complex<T> {\n        from_phases(to_phases(i).map(|i| i + i * self.formula(i.abs())))\n    }\n"
                .into()
        }
        Acts::SpeedSensor => {
            let x = if over == Over::ShaftAngle { "self.order * theta_m" } else { "omega_m.abs()" };
            format!(
                "    fn shown_speed(&self, omega_m: T, theta_m: T) -> T {{\n        let _ = theta_m;\n        omega_m + omega_m * self.formula({x})\n    }}\n"
            )
        }
        Acts::MagnetizingCurrent | Acts::LossCurrent | Acts::LeakageCurrent => {
            let x = match over {
                Over::ShaftAngle => "self.order * x.theta_m()",
                Over::Speed => "x.omega_m().abs()",
                Over::Current => "length(c.i_s)",
                _ => "length(c.psi_m)",
            };
            let body = match acts {
                Acts::MagnetizingCurrent => {
                    format!("c.drawn_at_gap(c.psi_m * (self.formula({x}) / p.magnetizing_inductance_h), p)")
                }
                Acts::LossCurrent => format!(
                    "c.drawn_at_gap(j(c.psi_m) * (self.formula({x}) * sense(x.omega_m().scale(n_p)) / length(c.psi_m)), p)"
                ),
                _ => format!(
                    "let through = (x.psi_s() - x.psi_r()) * (self.formula({x}) / (p.stator_leakage_inductance_h + p.rotor_leakage_inductance_h));\n        \
                     Currents {{ i_s: c.i_s + through, i_r: c.i_r - through, ..c }}"
                ),
            };
            let energy = Some(acts).filter(|_| over == Over::ShaftAngle).and_then(squared_flux_over_inductance);
            // Against rotation: the slope of the energy by the angle.
            let torque = energy.map_or(String::new(), |energy| {
                brake(&format!(
                    "{{\n            let (p, h) = (at.parameters, T::from_f64(1e-4));\n            \
                     let slope = self.order * (self.formula(x + h) - self.formula(x - h)) / (h + h);\n            \
                     ({energy} * slope).scale(0.75)\n        }}"
                ))
            });
            format!(
                "    fn added_currents(&self, c: Currents<T>, x: BaseState<T>, p: &TParameters<T>, n_p: f64) -> Currents<T> {{\n        \
                 let _ = (p, n_p);\n        {body}\n    }}\n{torque}"
            )
        }
    })
}

/// |ψ|²/L of an inductance that may change with the angle, as Rust.
fn squared_flux_over_inductance(acts: Acts) -> Option<&'static str> {
    match acts {
        Acts::MagnetizingCurrent => Some("norm2(at.currents.psi_m) / p.magnetizing_inductance_h"),
        Acts::LeakageCurrent => {
            Some("norm2(at.state.psi_s() - at.state.psi_r()) / (p.stator_leakage_inductance_h + p.rotor_leakage_inductance_h)")
        }
        _ => None,
    }
}

/// CamelCase of an identifier.
fn type_name(name: &str) -> String {
    name.split('_').map(|w| w[..1].to_uppercase() + &w[1..]).collect()
}

/// The source of the first curve that was learned as an effect of one's own.
///
/// # Errors
/// No curve was learned, or it has no formula that can be written.
pub fn own_source(learned: &[Curve]) -> Result<String, Refused> {
    let curve =
        learned.first().ok_or_else(|| Refused::Input("no curve was learned: there is no effect to write as Rust".into()))?;
    let name = curve.effect.name().replacen("learned", "own", 1);
    let none = || Refused::Input(format!("{} has no formula that can be written as Rust", curve.effect.card().title));
    own_effect(curve, &name).ok_or_else(none)
}

/// The source of an effect that has the curve's nearest formula; `name` is its identifier in files. `None` where the curve has no formula, or the model
/// no function for it.
pub fn own_effect(curve: &Curve, name: &str) -> Option<String> {
    let form = curve.effect.free_form()?;
    let formula = curve.formulas.first()?;
    let hook = hook(form.acts(), form.over())?;
    let (factors, shapes) = (&FACTORS[..formula.factors.len()], &SHAPES[..formula.shape.len()]);
    let angle = form.over() == Over::ShaftAngle;
    let order = angle.then_some("order");
    let fields: Vec<&str> = factors.iter().chain(shapes).copied().chain(order).collect();
    let ty = type_name(name);
    let card = curve.effect.card();
    let about = (curve.effect.about().place, curve.effect.about().steady_state);
    let mut out = String::new();
    let (title, text, unit) = (card.title, &formula.text, curve.unit());
    let rival =
        curve.rivals.first().map_or(String::new(), |r| format!("(\"{}\", \"explains the recordings as well\")", r.name()));
    let mut put = |line: &str| {
        let _ = writeln!(out, "{line}");
    };
    put(&format!("//! {title}: learned from recordings, then written as its nearest formula.\n//!\n//! f(x) = {text}"));
    put(
        "//!\n//! Written by `im learn --rust`. Rename it, say in the card what it is, and give it to the loop: docs/background/extending.md.\n",
    );
    put("#![allow(dead_code, unused_imports, unused_variables)]\n");
    put(
        "use im_model::effects::{About, BaseState, Card, Effect, Hooks, Operating, ParameterInfo, Place, Role, ScaleOf, StateInfo, StateKind, SteadyState};",
    );
    put("use im_model::space_vector::{dot, from_phases, j, norm2, to_phases};");
    put("use im_model::{Bound, Complex, Currents, Powers, Scalar, TParameters, register_effect};\n");
    put(&format!("/// {}\n#[derive(Clone, Copy)]\nstruct {ty}<T> {{", card.what));
    for f in &fields {
        put(&format!("    {f}: T,"));
    }
    put("}\n");
    let starts: Vec<f64> = factors
        .iter()
        .map(|_| 0.0)
        .chain(formula.shape.iter().copied())
        .chain(angle.then(|| curve.values[COEFFICIENTS + 1]))
        .collect();
    put(&format!("impl<T: Scalar> Default for {ty}<T> {{\n    fn default() -> Self {{\n        Self {{"));
    for (f, x) in fields.iter().zip(&starts) {
        put(&format!("            {f}: T::from_f64({x:?}),"));
    }
    put("        }\n    }\n}\n");
    put(&format!(
        "impl<T: Scalar> {ty}<T> {{\n    fn formula(&self, x: T) -> T {{\n        let Self {{ {}, .. }} = *self;",
        fields.join(", ")
    ));
    put(&format!("        let one = T::one();\n        {}\n    }}\n}}\n", formula.rust));
    put(&format!("impl<T: Scalar> Effect<T> for {ty}<T> {{\n    const NAME: &'static str = \"{name}\";"));
    put(&format!(
        "    const ABOUT: About = About {{ steady_state: SteadyState::{:?}, fixed_to_shaft: {angle}, ..About::at(Place::{:?}) }};",
        about.1, about.0
    ));
    put("    const PARAMETERS: &'static [ParameterInfo] = &[");
    let found = formula.factors.iter().chain(&formula.shape).copied().chain(angle.then(|| curve.values[COEFFICIENTS + 1]));
    for (k, (f, x)) in fields.iter().zip(found).enumerate() {
        let role = if k < factors.len() {
            "Strength"
        } else if Some(*f) == order {
            "Fixed"
        } else {
            "Shape"
        };
        let size = x.abs().max(1e-9);
        let unit = if k < factors.len() { unit } else { "" };
        put(&format!(
            "        ParameterInfo {{ key: \"{f}\", unit: \"{unit}\", meaning: \"Of f(x); learned: {x:?}.\", role: Role::{role}, scale: ScaleOf::One, default: {:?}, typical: ({:?}, {:?}), bound: Bound::Within(-1e9, 1e9) }},",
            starts[k],
            0.1 * size,
            3.0 * size,
        ));
    }
    put("    ];");
    put(&format!(
        "    const CARD: Card = Card {{\n        title: \"{title}\",\n        what: \"{} f(x) = {text}.\",\n        shows: \"{}\",\n        rivals: &[{rival}],\n        test: \"{}\",\n        place: \"{}\",\n        source: \"learned from recordings\",\n    }};",
        card.what,
        card.shows,
        card.test,
        form.labels().1
    ));
    if form.over() == Over::Time {
        put("    const STATES: &'static [StateInfo] = &[StateInfo { name: \"time_s\", kind: StateKind::Drifts }];");
    }
    let list = fields.iter().map(|f| format!("self.{f}")).collect::<Vec<_>>().join(", ");
    put(&format!(
        "\n    fn get(&self, index: usize) -> T {{\n        [{list}][index]\n    }}\n    fn set(&mut self, index: usize, value: T) {{\n        match index {{"
    ));
    for (k, f) in fields.iter().enumerate() {
        put(&format!("            {k} => self.{f} = value,"));
    }
    put("            _ => {}\n        }\n    }\n}\n");
    put(&format!("impl<T: Scalar> Hooks<T> for {ty}<T> {{\n{hook}"));
    if form.over() == Over::Time {
        put(
            "    fn rates(&self, rates: &mut [T], _at: &Operating<T>, _powers: &Powers<T>, _own: &[T]) {\n        rates[0] = T::one();\n    }",
        );
    }
    put(&format!("}}\n\nregister_effect!(pub {ty}Effect: {ty});"));
    put("\nfn length<T: Scalar>(v: Complex<T>) -> T {\n    (norm2(v) + T::from_f64(1e-12)).sqrt()\n}");
    put(
        "fn sense<T: Scalar>(omega: T) -> T {\n    let turning = omega.scale(1.0 / 3.0);\n    turning / (turning * turning + T::one()).sqrt()\n}",
    );
    put("fn cos<T: Scalar>(x: T) -> T {\n    x.sin_cos().1\n}\nfn sin<T: Scalar>(x: T) -> T {\n    x.sin_cos().0\n}");
    put(
        "fn tanh<T: Scalar>(x: T) -> T {\n    let e = (-(x.abs() + x.abs())).exp();\n    let t = (T::one() - e) / (T::one() + e);\n    if x.value() < 0.0 { -t } else { t }\n}",
    );
    put(
        "fn langevin<T: Scalar>(x: T) -> T {\n    if x.value().abs() < 1e-3 { x.scale(1.0 / 3.0) } else { T::one() / tanh(x) - T::one() / x }\n}",
    );
    put("fn positive<T: Scalar>(x: T) -> T {\n    if x.value() > 0.0 { x } else { T::zero() }\n}");
    Some(out)
}
