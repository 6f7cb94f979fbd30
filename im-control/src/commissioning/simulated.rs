//! A commissioning on the simulated drive, and how near it came to the machine that it did not know.

use std::cell::Cell;

use im_model::effects::Hooks;
use im_model::simulation::{
    Bridge, CarrierPwm, Command, Controller, Inverter, Load, Measured, Profile, Reference, References, Run, Scenario, Sensors,
    Simulation, SimulationError, Source,
};
use im_model::{Machine, MotorFile, Recording, TParameters};

use super::{Commissioned, Commissioning, CommissioningFault, CommissioningPlan, CommissioningStage, Found, LONGEST_S};

/// A run, what was known before, and what was found.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulatedCommissioning {
    /// The nameplate.
    pub plan: CommissioningPlan,
    /// The recording, until the machine stood again.
    pub run: Run,
    /// What was found, or why not.
    pub outcome: Result<Commissioned, CommissioningFault>,
    /// Largest sample of the current, A.
    pub peak_current_a: f64,
}

/// A found value beside the machine's own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Comparison {
    /// Symbol and unit.
    pub symbol: &'static str,
    /// The unit.
    pub unit: &'static str,
    /// What was found.
    pub found: Found,
    /// What the machine has.
    pub truth: f64,
    /// What an error of this value is a share of: the value, or what stands in the same sum.
    pub scale: f64,
}

impl Comparison {
    /// The error over the scale.
    pub fn error(&self) -> f64 {
        (self.found.value - self.truth) / self.scale
    }
}

/// The bench that a motor is commissioned on where no scenario describes another: a bridge of 1.05 times what the rated voltage needs, 10 kHz, 2 µs of dead time,
/// 1 V of drop, noise of 0.4 % and a converter's step of 0.2 % of the rated current, and a speed sensor, which the commissioning does not look at, with noise of 0.05 % of
/// the synchronous speed.
pub fn bench(motor: &MotorFile) -> Scenario {
    let rated = motor.rating.current_peak_a(motor.machine.parameters(), motor.machine.pole_pairs());
    let bridge = Bridge {
        dc_voltage_v: 1.05 * 3f64.sqrt() * motor.rating.phase_voltage_peak_v,
        dead_time_s: 2e-6,
        drop_v: 1.0,
        on_resistance_ohm: 0.0,
    };
    Scenario {
        inverter: Inverter::CarrierPwm(CarrierPwm { half_period_s: 5e-5 }, bridge),
        sensors: Sensors {
            current_noise_a: 0.004 * rated,
            current_step_a: 0.002 * rated,
            speed_noise_rad_s: 5e-4 * motor.rating.synchronous_speed_rad_s(motor.machine.pole_pairs()),
            seed: 1,
            ..Sensors::default()
        },
        load: Load { torque_nm: 0.0.into(), quadratic_nm_s2: 0.0 },
        ..Scenario::direct_on_line(1.0, 50.0, LONGEST_S)
    }
}

/// Ends the simulation when it is done.
struct Ending<'a>(&'a mut Commissioning<f64>, &'a Cell<bool>);

impl Controller<f64> for Ending<'_> {
    fn step(&mut self, m: &Measured<f64>, r: &Reference<f64>) -> Command<f64> {
        let command = self.0.step(m, r);
        self.1.set(self.0.stage() == CommissioningStage::Done);
        command
    }
}

/// Commissions a motor, of which only rating, rated current, pole pairs, voltage delay, switching period and the timer's dead time are known, with the inverter, the sensors, the load and the sampling time of a
/// scenario. `progress` hears of samples done and in all.
///
/// # Errors
/// The plan, the scenario or the simulation is not one that can be run.
pub fn commission(
    motor: &MotorFile,
    scenario: &Scenario,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<SimulatedCommissioning, SimulationError> {
    let machine = &motor.machine;
    let rated = motor.rating.current_peak_a(machine.parameters(), machine.pole_pairs());
    let [dead_time_s, switching_period_s] = match &scenario.inverter {
        Inverter::CarrierPwm(pwm, bridge) => [bridge.dead_time_s, 2.0 * pwm.half_period_s],
        _ => [0.0; 2],
    };
    let plan = CommissioningPlan::of(motor.rating, rated, machine.pole_pairs(), scenario.sample_time_s)
        .delayed(machine.effects().voltage_delay.delay_s)
        .with_dead_time(dead_time_s)
        .switching_every(switching_period_s);
    let mut commissioning = Commissioning::<f64>::for_plan(&plan)?;
    let none = || Profile::constant(0.0);
    let references = References { speed_rad_s: none(), rotor_flux_vs: none(), torque_nm: none() };
    let scenario = Scenario {
        name: "commissioning".into(),
        source: Source::Controller { name: "commissioning".into(), observer: None, references },
        // A little more than it may take: the end belongs to it.
        duration_s: LONGEST_S + 20.0,
        ..scenario.clone()
    };
    let ended = Cell::new(false);
    let mut controller = Ending(&mut commissioning, &ended);
    let run = Simulation::new(machine, &scenario).controlled_by(&mut controller).with_progress(progress).until(&ended).run()?;
    let peak_current_a = run.recording.i_s.iter().map(|i| i.norm()).fold(0.0, f64::max);
    let outcome = commissioning.outcome().copied().unwrap_or(Err(CommissioningFault::TooLong));
    Ok(SimulatedCommissioning { plan, run, outcome, peak_current_a })
}

/// The part of the run that is kept: so long, s, and so much of it before the shaft moves.
const KEPT_S: f64 = 3.0;
const KEPT_BEFORE_S: f64 = 0.2;

impl SimulatedCommissioning {
    /// What `im diagnose` gets: three seconds at every sample, from just before the shaft begins to turn; where it did not, the last three. What standstill shows is in
    /// the values found; and over a row of several samples the voltage of a turning machine is no constant. A jerk of the shaft when the direct current goes from one phase to
    /// the next is no turning.
    ///
    /// The currents are those of the middle of the zero vector, as the commissioning computes with them: behind a dead time t_d a sample comes t_d/2 early and shows
    /// u t_d/(2L_σ) too much (`turning.rs`), which is taken off where L_σ was found.
    pub fn record(&self) -> Recording {
        let all = &self.run.recording;
        let rows = |seconds: f64| (seconds / all.sample_time_s) as usize;
        let synchronous = self.plan.rating.synchronous_speed_rad_s(self.plan.pole_pairs);
        let turns = all.omega_m.iter().position(|omega| omega.abs() > 0.3 * synchronous);
        let moves = turns.map(|k| all.omega_m.iter().take(k).rposition(|omega| omega.abs() < 0.02 * synchronous).unwrap_or(0));
        let first = moves.unwrap_or(all.len()).saturating_sub(rows(KEPT_BEFORE_S)).min(all.len().saturating_sub(rows(KEPT_S)));
        let kept = first..all.len().min(first + rows(KEPT_S));
        let early = self.outcome.map_or(0.0, |found| {
            let [_, leakage, _] = found.inverse_gamma();
            0.5 * self.plan.dead_time_s / leakage.value
        });
        let before = |k: usize| all.u_s[k.saturating_sub(1)];
        let in_the_middle = |k: usize| all.i_s[k] - (before(k) + all.u_s[k]) * (0.5 * early);
        Recording {
            name: all.name.clone(),
            start_s: 0.0,
            sample_time_s: all.sample_time_s,
            u_s: all.u_s[kept.clone()].to_vec(),
            i_s: kept.clone().map(in_the_middle).collect(),
            omega_m: all.omega_m[kept.clone()].to_vec(),
            tau_load: all.tau_load.as_ref().map(|tau| tau[kept].to_vec()),
        }
    }

    /// What was found beside what the motor has. Of the leakage only what shows at the terminals; friction over that which takes rated torque at rated speed.
    pub fn comparisons(&self, found: &Commissioned, machine: &Machine<f64>, inverter: &Inverter) -> Vec<Comparison> {
        let (p, e, rating) = (machine.parameters(), machine.effects(), &self.plan.rating);
        let flux = rating.rotor_flux_vs;
        let chord = p.magnetizing_inductance_h / e.main_flux_saturation.reluctance((1.0, 0.0), flux * flux).0;
        let g = TParameters { magnetizing_inductance_h: chord, ..*p }.inverse_gamma();
        let lost = e.inverter_nonlinearity.voltage_v
            + match inverter {
                Inverter::CarrierPwm(pwm, b) => b.drop_v + b.dc_voltage_v * b.dead_time_s / (2.0 * pwm.half_period_s),
                _ => 0.0,
            };
        let on = if let Inverter::CarrierPwm(_, b) = inverter { b.on_resistance_ohm } else { 0.0 };
        let [r_r, l_sigma, l_m] = found.inverse_gamma();
        let row = |symbol, unit, found, truth: f64| Comparison { symbol, unit, found, truth, scale: truth.abs() };
        let of = |symbol, unit, found, truth, scale| Comparison { symbol, unit, found, truth, scale };
        let mut rows = vec![
            row("R_s", "ohm", found.stator_resistance_ohm, p.stator_resistance_ohm + on),
            row("R_R", "ohm", r_r, g.rotor_resistance_ohm),
            row("L_sigma", "H", l_sigma, g.leakage_inductance_h),
            row("L_M", "H", l_m, g.magnetizing_inductance_h),
            row("J", "kg m2", found.inertia_kg_m2, p.inertia_kg_m2),
        ];
        let speed = rating.synchronous_speed_rad_s(self.plan.pole_pairs);
        let viscous = p.viscous_friction_nm_s_per_rad;
        rows.push(of("D", "Nm s/rad", found.viscous_friction_nm_s_per_rad, viscous, rating.torque_nm / speed));
        rows.push(of("tau_C", "Nm", found.coulomb_friction_nm, e.coulomb_friction.torque_nm, rating.torque_nm));
        let windage = e.windage.coefficient_nm_s2;
        rows.push(of("k_w", "Nm s2", found.windage_nm_s2, windage, rating.torque_nm / (speed * speed)));
        if lost > 0.0 || found.inverter_voltage_v.is_seen() {
            rows.push(of(
                "U_d",
                "V",
                found.inverter_voltage_v,
                lost,
                if lost > 0.0 { lost } else { rating.phase_voltage_peak_v },
            ));
        }
        let iron = e.iron_loss.conductance_s;
        let admittance = self.plan.rated_current_a / rating.phase_voltage_peak_v;
        if iron > 0.0 || found.iron_conductance_s.is_seen() && found.iron_conductance_s.value > 0.0 {
            rows.push(of("G_fe", "S", found.iron_conductance_s, iron, if iron > 0.0 { iron } else { admittance }));
        }
        let skin = &e.rotor_skin_effect;
        if let Some([k, tau]) = found.skin_effect {
            let here = skin.resistance_rise > 0.0;
            rows.push(of("k_skin", "", k, skin.resistance_rise, if here { skin.resistance_rise } else { 1.0 }));
            rows.push(row("tau_skin", "s", tau, if here { skin.time_constant_s } else { f64::NAN }));
        }
        rows
    }
}
