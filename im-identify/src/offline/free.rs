//! What a fit may change.

use super::experiment::Experiment;
use im_model::effects::{Place, Role};
use im_model::{BaseParameter, Bound, EffectId, Machine, ParameterId, Rating, State};

/// The quantity that a free parameter moves.
#[derive(Clone, Debug, PartialEq)]
pub enum Target {
    /// Parameters of the machine that move together (by the same factor, or the same amount).
    Machine(Vec<ParameterId>),
    /// Component `component` of the initial state of experiment `experiment`: ψ_s (0, 1), ψ_r (2, 3), ω_m (4), θ_m (5); or size of its load, constant (6) and of a fan (7).
    Initial {
        /// Which experiment.
        experiment: usize,
        /// Which component.
        component: usize,
    },
}

/// How the search variable v moves the quantity p.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Transform {
    /// p = p₀ eᵛ: positive quantities.
    Log,
    /// p = p₀ + s v, with a scale s: quantities that may be zero or negative.
    Linear(f64),
}

/// A parameter that is known about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// Which.
    pub id: ParameterId,
    /// The known value, in its unit.
    pub value: f64,
    /// Standard deviation of the logarithm.
    pub std: f64,
}

/// A free parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct Free {
    /// What it moves.
    pub target: Target,
    /// How.
    pub transform: Transform,
    /// Smallest and largest value allowed (of the first quantity of the target).
    pub limits: (f64, f64),
    /// What is known of it beforehand ([`knowing`](super::knowing)).
    pub priors: Vec<Prior>,
}

impl Free {
    /// The parameter that names it; `None` for initial states.
    pub fn id(&self) -> Option<ParameterId> {
        match &self.target {
            Target::Machine(ids) => ids.first().copied(),
            Target::Initial { .. } => None,
        }
    }

    /// A name for messages.
    pub fn name(&self) -> String {
        match &self.target {
            Target::Machine(ids) => ids.iter().map(ToString::to_string).collect::<Vec<_>>().join(" and "),
            Target::Initial { experiment, component } => {
                let part = [
                    "psi_s_alpha_Vs",
                    "psi_s_beta_Vs",
                    "psi_r_alpha_Vs",
                    "psi_r_beta_Vs",
                    "omega_m_rad_s",
                    "theta_m_rad",
                    "load_nm",
                    "load_nm_s2",
                ][*component];
                format!("initial {part} of run {}", experiment + 1)
            }
        }
    }

    /// The value at search variable `v`, from `origin`, kept within the limits.
    pub fn value(&self, origin: f64, v: f64) -> f64 {
        let p = match self.transform {
            Transform::Log => origin * v.exp(),
            Transform::Linear(s) => origin + s * v,
        };
        p.clamp(self.limits.0, self.limits.1)
    }

    /// Whether the value `p` stands at a limit that a step in the direction of `v` would cross.
    pub(super) fn stops(&self, p: f64, v: f64) -> bool {
        (p <= self.limits.0 && v < 0.0) || (p >= self.limits.1 && v > 0.0)
    }

    /// dp/dv at value `p`.
    pub fn slope(&self, p: f64) -> f64 {
        match self.transform {
            Transform::Log => p,
            Transform::Linear(s) => s,
        }
    }
}

/// A fit moves a base parameter by this factor at most: beyond, the start is not of the machine, or the recording not what it seems.
const REGION: f64 = 20.0;

/// The base parameters that recordings can determine: R_s, R_r, the two leakages by one factor (their ratio cannot be seen in a
/// linear machine), L_m, J by factors, and D, which may vanish, by its own size or amounts that brake `machine` in ten seconds, whichever
/// is more.
pub fn base_parameters(machine: &Machine<f64>) -> Vec<Free> {
    use BaseParameter as P;
    let p = machine.parameters();
    let values = p.values();
    let free = |ids: &[P]| {
        let given = values[ids[0] as usize];
        Free {
            target: Target::Machine(ids.iter().map(|p| ParameterId::Base(*p)).collect()),
            transform: Transform::Log,
            limits: (given / REGION, given * REGION),
            priors: Vec::new(),
        }
    };
    let unit = p.viscous_friction_nm_s_per_rad.max(0.1 * p.inertia_kg_m2);
    vec![
        free(&[P::StatorResistance]),
        free(&[P::RotorResistance]),
        free(&[P::StatorLeakageInductance, P::RotorLeakageInductance]),
        free(&[P::MagnetizingInductance]),
        free(&[P::Inertia]),
        Free { transform: Transform::Linear(unit), limits: (0.0, REGION * unit), ..free(&[P::ViscousFriction]) },
    ]
}

/// Those of [`base_parameters`] that such experiments depend on: in tables of steady states nothing accelerates, and where the speed is
/// imposed no torque is balanced.
pub fn base_parameters_in(machine: &Machine<f64>, experiments: &[Experiment]) -> Vec<Free> {
    let mut free = base_parameters(machine);
    let balanced = torques_balance(experiments);
    let accelerates = experiments.iter().any(|e| !e.is_table() && !e.speed_is_imposed());
    free.retain(|f| match f.id() {
        Some(ParameterId::Base(BaseParameter::Inertia)) => accelerates,
        Some(ParameterId::Base(BaseParameter::ViscousFriction)) => balanced,
        _ => true,
    });
    free
}

/// Whether any experiment depends on a torque: where the speed of all is imposed, none does.
pub fn torques_balance(experiments: &[Experiment]) -> bool {
    experiments.iter().any(|e| !e.speed_is_imposed())
}

/// Those of [`effect_parameters`] that such experiments depend on, and tell from the base parameters.
pub fn effect_parameters_in(effect: EffectId, machine: &Machine<f64>, rating: &Rating, experiments: &[Experiment]) -> Vec<Free> {
    if torques_balance(experiments) {
        return effect_parameters(effect, machine, rating);
    }
    if effect.about().place == Place::Mechanics {
        return Vec::new();
    }
    let mut free = effect_parameters(effect, machine, rating);
    // A common factor of the currents is one of all impedances, where no torque says how large they are.
    free.retain(|f| f.id() != Some(COMMON_CURRENT_GAIN));
    free
}

const COMMON_CURRENT_GAIN: ParameterId = ParameterId::Effect(EffectId::CurrentSensorGain, 0);

/// The strength and shape parameters of an effect, scaled to the machine; and an order that is no whole number, near where it is.
pub fn effect_parameters(effect: EffectId, machine: &Machine<f64>, rating: &Rating) -> Vec<Free> {
    let odd = |k: usize| machine.get(ParameterId::Effect(effect, k)).fract() != 0.0;
    let infos = effect.parameters().iter().enumerate().filter(|(k, info)| match info.role {
        Role::Strength | Role::Shape => true,
        Role::Order => odd(*k),
        Role::Fixed => false,
    });
    infos
        .map(|(k, info)| {
            let unit = rating.unit_of(info.scale, machine.parameters(), machine.pole_pairs());
            // Shapes that are always positive move by factors and stay near usual sizes, where they mean something.
            let positive = info.role == Role::Shape && info.typical.0 > 0.0;
            let present = machine.get(ParameterId::Effect(effect, k));
            let (transform, usual) = if info.role == Role::Order {
                // A phase that has run over many turns: far away there is no way back.
                (Transform::Linear(1e-3), (present - 0.05, present + 0.05))
            } else if positive {
                (Transform::Log, (info.typical.0 * unit / 4.0, info.typical.1 * unit * 4.0))
            } else {
                (Transform::Linear(info.typical.1.max(1e-12) * unit), (f64::NEG_INFINITY, f64::INFINITY))
            };
            let hard = match info.bound {
                Bound::Positive => (Bound::SMALLEST, Bound::LARGEST),
                Bound::NotNegative => (0.0, Bound::LARGEST),
                Bound::Within(a, b) | Bound::OfMachines(a, b) => (a, b),
                Bound::Whole(a, b) => (f64::from(a), f64::from(b)),
            };
            Free {
                target: Target::Machine(vec![ParameterId::Effect(effect, k)]),
                transform,
                limits: (hard.0.max(usual.0), hard.1.min(usual.1)),
                priors: Vec::new(),
            }
        })
        .collect()
}

/// The component of an initial state that is the speed.
pub(super) const SPEED: usize = 4;
/// That which is the angle.
pub(super) const ANGLE: usize = 5;
/// Those that are sizes of the load.
pub(super) const LOAD_CONSTANT: usize = 6;
pub(super) const LOAD_FAN: usize = 7;

fn component_mut<T>(x: &mut State<T>, k: usize) -> &mut T {
    match k {
        0 => &mut x.psi_s.re,
        1 => &mut x.psi_s.im,
        2 => &mut x.psi_r.re,
        3 => &mut x.psi_r.im,
        SPEED => &mut x.omega_m,
        ANGLE => &mut x.theta_m,
        LOAD_CONSTANT => &mut x.load.constant_nm,
        _ => &mut x.load.fan_nm_s2,
    }
}

/// Reads component `k` of an initial state.
pub(super) fn component(x: &State<f64>, k: usize) -> f64 {
    *component_mut(&mut x.clone(), k)
}

/// Changes component `k` of an initial state; a compliant shaft begins at one speed.
pub(super) fn change_component<T>(x: &mut State<T>, k: usize, change: impl Fn(&mut T)) {
    if k == SPEED { x.change_speed(change) } else { change(component_mut(x, k)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_model::Effects;
    use im_model::machines::MOTULATOR_2_2_KW as M;

    #[test]
    fn a_step_undoes_friction_of_any_size() {
        let with = |friction| {
            let machine = Machine::try_new(M.parameters(), M.pole_pairs, Effects::none()).unwrap();
            machine.with(&[(ParameterId::Base(BaseParameter::ViscousFriction), friction)]).unwrap()
        };
        let friction = |machine: &Machine<f64>| base_parameters(machine).pop().unwrap();
        assert_eq!(friction(&with(0.0)).value(0.0, 1.0), 0.1 * M.parameters().inertia_kg_m2);
        // A search variable moves by at most one: all of a friction that has imitated something else goes in one step.
        assert_eq!(friction(&with(3.0)).value(3.0, -1.0), 0.0);
    }
}
