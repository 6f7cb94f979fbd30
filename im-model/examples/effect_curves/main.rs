//! The curves of `docs/effects.md`, one for each effect, drawn from the model itself: the machine without the effect, and with a large usual size of it.
//!
//!     cargo run --release -p im-model --example effect_curves -- docs/images/effects

mod runs;
mod steady;

use im_chart::{Panel, Series, panels};
use im_model::{EffectId, Effects, Machine, ModelError, Rating, machines};

/// What a picture is made from.
struct Studio {
    /// The machine without effects.
    base: Machine<f64>,
    /// Its rating.
    rating: Rating,
    /// Its synchronous speed, rad/s.
    synchronous: f64,
}

impl Studio {
    /// The machine with effects switched on by `set`.
    fn with(&self, set: impl FnOnce(&mut Effects<f64>)) -> Result<Machine<f64>, ModelError> {
        let mut effects = Effects::scaled(&self.rating, self.base.parameters(), self.base.pole_pairs());
        set(&mut effects);
        self.base.with_effects(effects)
    }
}

/// Two lines on one panel: without the effect, and with it.
fn pair(label: &str, without: Vec<(f64, f64)>, with: Vec<(f64, f64)>) -> Panel {
    Panel::new(label, [Series::line("without", without), Series::line("with", with)])
}

/// A picture under construction: title, horizontal axis, panels.
type Picture = (&'static str, &'static str, Vec<Panel>);

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).ok_or("give the folder to draw into")?;
    std::fs::create_dir_all(&folder)?;
    let m = machines::MOTULATOR_2_2_KW;
    let base = Machine::base(m.parameters(), m.pole_pairs)?;
    let studio = Studio { base, rating: m.rating, synchronous: m.rating.synchronous_speed_rad_s(m.pole_pairs) };
    for effect in EffectId::ALL {
        let (title, x, parts) = match effect {
            EffectId::MainFluxSaturation => steady::main_flux_saturation(&studio)?,
            EffectId::LeakageFluxSaturation => steady::leakage_flux_saturation(&studio)?,
            EffectId::RotorSkinEffect => steady::rotor_skin_effect(&studio)?,
            EffectId::IronLoss => steady::iron_loss(&studio)?,
            EffectId::CoulombFriction => steady::coulomb_friction(&studio)?,
            EffectId::Windage => steady::windage(&studio)?,
            EffectId::VoltageGain => steady::voltage_gain(&studio)?,
            EffectId::StatorHeating => runs::stator_heating(&studio)?,
            EffectId::RotorHeating => runs::rotor_heating(&studio)?,
            EffectId::InverterNonlinearity => runs::inverter_nonlinearity(&studio)?,
            EffectId::VoltageDelay => runs::voltage_delay(&studio)?,
            EffectId::CurrentSensorGain => runs::current_sensor_gain(&studio)?,
            EffectId::CurrentSensorOffset => runs::current_sensor_offset(&studio)?,
            EffectId::SpeedSensorLag => runs::speed_sensor_lag(&studio)?,
            EffectId::StatorAsymmetry => runs::stator_asymmetry(&studio)?,
            EffectId::RotorAsymmetry => runs::rotor_asymmetry(&studio)?,
            EffectId::ShaftCompliance => runs::shaft_compliance(&studio)?,
            EffectId::LoadTorqueRipple => runs::load_torque_ripple(&studio)?,
            // An effect of one's own has no picture here.
            EffectId::Custom(_) => continue,
        };
        std::fs::write(format!("{folder}/{}.svg", effect.name()), panels(title, x, &parts))?;
    }
    Ok(())
}
