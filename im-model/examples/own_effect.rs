//! An effect of one's own: a fan whose hub slips. Defined here, switched on, simulated; the library is not changed.
//!
//! cargo run --release -p im-model --example own_effect -- own_effect.svg

use im_chart::{Series, chart};
use im_model::effects::{Card, CustomId, Effect, Hooks, Operating, ParameterInfo, Role, ScaleOf};
use im_model::{Bench, Bound, Complex, EffectId, Effects, Machine, PlantInput, Scalar, State, machines, register_effect};

/// A brake in proportion to speed up to a limit: τ = T ω/√(ω² + ω_0²).
#[derive(Clone, Copy)]
struct SlippingHub<T> {
    torque_nm: T,
    slip_speed_rad_s: T,
}

impl<T: Scalar> Default for SlippingHub<T> {
    fn default() -> Self {
        Self { torque_nm: T::zero(), slip_speed_rad_s: T::from_f64(20.0) }
    }
}

impl<T: Scalar> Effect<T> for SlippingHub<T> {
    const NAME: &'static str = "slipping_hub";
    const PARAMETERS: &'static [ParameterInfo] = &[
        ParameterInfo {
            key: "torque_nm",
            unit: "Nm",
            meaning: "Torque at which the hub slips.",
            role: Role::Strength,
            scale: ScaleOf::Torque,
            default: 0.0,
            typical: (0.01, 0.2),
            bound: Bound::NotNegative,
        },
        ParameterInfo {
            key: "slip_speed_rad_s",
            unit: "rad/s",
            meaning: "Speed at which it has reached 71 % of it.",
            role: Role::Shape,
            scale: ScaleOf::Speed,
            default: 0.13,
            typical: (0.05, 0.5),
            bound: Bound::Positive,
        },
    ];
    const CARD: Card = Card {
        title: "Slipping fan hub",
        what: "A brake that saturates: T ω/√(ω² + ω_0²).",
        shows: "Speed error that grows with speed and then stays.",
        rivals: &[("windage", "goes on growing with speed")],
        test: "Coasting down from full speed.",
        place: "torque balance",
        source: "an example",
    };

    fn get(&self, index: usize) -> T {
        [self.torque_nm, self.slip_speed_rad_s][index]
    }
    fn set(&mut self, index: usize, value: T) {
        match index {
            0 => self.torque_nm = value,
            1 => self.slip_speed_rad_s = value,
            _ => {}
        }
    }
}

impl<T: Scalar> Hooks<T> for SlippingHub<T> {
    fn braking_torque(&self, torque: T, at: &Operating<T>, _own: &[T]) -> T {
        let (w, w_0) = (at.state.omega_m(), self.slip_speed_rad_s);
        torque + self.torque_nm * w / (w * w + w_0 * w_0).sqrt()
    }
}

register_effect!(SlippingHubEffect: SlippingHub);

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let m = machines::MOTULATOR_2_2_KW;
    let hub = CustomId(&SlippingHubEffect);
    let mut starts = Vec::new();
    for torque in [0.0, 1.0, 2.0] {
        let mut effects = Effects::none().with_custom(hub);
        effects.set(EffectId::Custom(hub), 0, torque);
        effects.set(EffectId::Custom(hub), 1, 20.0);
        let machine = Machine::try_new(m.parameters(), m.pole_pairs, effects)?;
        let mut bench = Bench::new(&machine, State::default(), 1e-4);
        let mut speed = Vec::new();
        for k in 0..10_000 {
            let (s, c) = (0.0314 * f64::from(k)).sin_cos();
            bench.advance(&PlantInput::new(Complex::new(326.6 * c, 326.6 * s), 5.0));
            speed.push((1e-4 * f64::from(k), bench.output().omega_m));
        }
        println!("hub {torque} Nm: {:.2} rad/s at 5 Nm of load", bench.output().omega_m);
        starts.push(Series::line(format!("hub of {torque} Nm"), speed.split_off(4000)));
    }
    if let Some(path) = std::env::args().nth(1) {
        std::fs::write(
            path,
            chart("A brake that the library does not know, at 5 Nm of load", "time, s", "speed, rad/s", &starts),
        )?;
    }
    Ok(())
}
