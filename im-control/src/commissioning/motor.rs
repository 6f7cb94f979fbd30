//! The result as a `motor.toml`.

use std::collections::BTreeMap;

use im_model::effects::VoltageDelay;
use im_model::{BaseParameter, EffectId, Effects, Known, Machine, ModelError, MotorFile, ParameterId};

use super::fit::Found;
use super::result::{Commissioned, CommissioningPlan, magnetizing_laws};
use super::standstill::SHARPEST;

/// The steepest knee that a simulation gets, over the rated current: the least that is usual of the effect.
const STEEPEST: f64 = 0.003;

/// A tolerance of a file: from a thousandth to ten times.
fn tolerance(f: &Found) -> f64 {
    f.tolerance().clamp(1e-3, 10.0)
}

impl Commissioned {
    /// L_m without saturation, and the excess and the exponent of the law i_m = ψ/L_m (1 + k(ψ/ψ_N)^S) at the flux of the plan, where the magnetizing curve is bent.
    pub fn saturation(&self, flux_vs: f64) -> Option<[Found; 3]> {
        let (straight, bent) = magnetizing_laws(&self.magnetizing, flux_vs, self.magnetizing_inductance_h.value);
        let (straight, bent) = straight.zip(bent)?;
        let [l, k, s] = bent.parameters;
        let seen = straight.cost > bent.cost + 12.0 * bent.chi2.max(1.0) && k.value > 0.01;
        seen.then_some([l, Found { half_width: k.half_width, ..k }, Found { value: s.value.clamp(1.0, 20.0), ..s }])
    }

    /// A motor with these values, each with its interval as tolerance, and with the effects that were seen.
    ///
    /// # Errors
    /// A value is out of the bounds of a motor file.
    pub fn motor_file(&self, name: &str, plan: &CommissioningPlan) -> Result<MotorFile, ModelError> {
        let mut p = self.parameters();
        let mut known = BTreeMap::new();
        let mut note = |id: ParameterId, f: &Found| {
            known.insert(id, Known { value: f.value, tolerance: tolerance(f) });
        };
        let mut e = Effects::scaled(&plan.rating, &p, plan.pole_pairs);
        let flux = plan.rating.rotor_flux_vs;
        let mut l_m = self.magnetizing_inductance_h;
        if let Some([l, k, s]) = self.saturation(flux) {
            l_m = l;
            let m = &mut e.main_flux_saturation;
            (m.excess, m.exponent, m.reference_flux_vs) = (k.value, s.value, flux);
            note(ParameterId::Effect(EffectId::MainFluxSaturation, 0), &k);
            note(ParameterId::Effect(EffectId::MainFluxSaturation, 1), &s);
        }
        p.magnetizing_inductance_h = l_m.value;
        for (parameter, f) in [
            (BaseParameter::StatorResistance, &self.stator_resistance_ohm),
            (BaseParameter::RotorResistance, &self.rotor_resistance_ohm),
            (BaseParameter::StatorLeakageInductance, &self.leakage_inductance_h),
            (BaseParameter::RotorLeakageInductance, &self.leakage_inductance_h),
            (BaseParameter::MagnetizingInductance, &l_m),
            (BaseParameter::Inertia, &self.inertia_kg_m2),
        ] {
            note(ParameterId::Base(parameter), f);
        }
        if self.viscous_friction_nm_s_per_rad.value > 0.0 {
            note(ParameterId::Base(BaseParameter::ViscousFriction), &self.viscous_friction_nm_s_per_rad);
        }
        if self.inverter_voltage_v.is_seen() {
            e.inverter_nonlinearity.voltage_v = self.inverter_voltage_v.value;
            // Below the smallest phase current of the tests it is not seen: anything down to what was found, and a simulation cannot follow every knee.
            let found = &self.inverter_current_a;
            let knee = found.value.max(STEEPEST * plan.rated_current_a);
            let unseen_a = (SHARPEST * plan.rated_current_a - knee).max(0.0);
            e.inverter_nonlinearity.zero_crossing_current_a = knee;
            e.inverter_nonlinearity.ripple_a_per_v = plan.ripple_a_per_v(p.inverse_gamma().leakage_inductance_h);
            e.inverter_nonlinearity.dc_voltage_v = self.dc_voltage_v;
            note(ParameterId::Effect(EffectId::InverterNonlinearity, 0), &self.inverter_voltage_v);
            note(
                ParameterId::Effect(EffectId::InverterNonlinearity, 1),
                &Found { value: knee, half_width: found.half_width.max(unseen_a) },
            );
        }
        if let Some([k, tau]) = &self.skin_effect {
            (e.rotor_skin_effect.resistance_rise, e.rotor_skin_effect.time_constant_s) = (k.value, tau.value);
            note(ParameterId::Effect(EffectId::RotorSkinEffect, 0), k);
            note(ParameterId::Effect(EffectId::RotorSkinEffect, 1), tau);
        }
        if self.iron_conductance_s.value > 0.0 && self.iron_conductance_s.is_seen() {
            e.iron_loss.conductance_s = self.iron_conductance_s.value;
            note(ParameterId::Effect(EffectId::IronLoss, 0), &self.iron_conductance_s);
        }
        if self.coulomb_friction_nm.value > 0.0 && self.coulomb_friction_nm.is_seen() {
            e.coulomb_friction.torque_nm = self.coulomb_friction_nm.value;
            note(ParameterId::Effect(EffectId::CoulombFriction, 0), &self.coulomb_friction_nm);
        }
        if self.windage_nm_s2.value > 0.0 {
            e.windage.coefficient_nm_s2 = self.windage_nm_s2.value;
            note(ParameterId::Effect(EffectId::Windage, 0), &self.windage_nm_s2);
        }
        if self.current_offset_a.iter().any(Found::is_seen) {
            let offset = &mut e.current_sensor_offset;
            for (k, (to, f)) in [&mut offset.alpha_a, &mut offset.beta_a].into_iter().zip(&self.current_offset_a).enumerate() {
                *to = f.value;
                note(ParameterId::Effect(EffectId::CurrentSensorOffset, k), f);
            }
        }
        if self.voltage_offset_v.iter().any(Found::is_seen) {
            let offset = &mut e.voltage_offset;
            for (k, (to, f)) in [&mut offset.alpha_v, &mut offset.beta_v].into_iter().zip(&self.voltage_offset_v).enumerate() {
                *to = f.value;
                note(ParameterId::Effect(EffectId::VoltageOffset, k), f);
            }
        }
        e.voltage_delay = VoltageDelay { delay_s: plan.voltage_delay_s };
        let machine = Machine::try_new(p, plan.pole_pairs, e)?;
        Ok(MotorFile { known, ..MotorFile::new(name, machine, plan.rating) })
    }
}
