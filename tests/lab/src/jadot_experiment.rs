//! Section VI's experiments, Figs. 13 to 16, in simulation: what the paper says of its bench, and a machine that the controller does not know.
//!
//! *Said*: 4 kW, 415 V, 7.9 A, 1445 rpm; carrier modulation at 4 kHz, control every 250 µs; an encoder of 1024 pulses. *Chosen*: the machine of Table I with
//! saturated iron, 2 µs of dead time and 1 V of device drop (compensated), a sample of delay, 20 mA of current noise, an edge timer behind the encoder
//! (0.1 rad/s, 2 ms). First estimates are those of a commissioning: R_s measured, the others from the nameplate with a power factor of 0.84.

use im_control::modulation::DeadTimeCompensation;
use im_control::{Drive, DriveLimits, Jadot, JadotGains, MachineData};
use im_identify::online::{Adaptation, Fixed, RegulationParameters, SchemeSettings, TimeScale};
use im_model::machines::JADOT_TABLE_I as M;
use im_model::simulation::{
    Bridge, CarrierPwm, Command, Controller, Inverter, Load, Measured, Profile, Reference, References, Scenario, Sensors,
    Simulation, Source,
};
use im_model::{Effects, Machine, Nameplate};

/// Sampling time and carrier period, s.
const T: f64 = 250e-6;
const DC_V: f64 = 565.0;
const ROTOR_FLUX_VS: f64 = 0.93;
const CURRENT_A: f64 = 25.0;
/// Seconds between two rows.
const EVERY_S: f64 = 0.05;

/// What is plotted.
#[derive(Clone, Copy)]
pub struct Seen {
    pub t: f64,
    /// Estimates over Table I, in the order R_req, L, R_s, L_f.
    pub estimates: [f64; 4],
    pub torque_hat_nm: f64,
    pub current_hat_a: f64,
    pub load_nm: f64,
    pub current_a: f64,
    pub speed_rad_s: f64,
    /// R_s and R_r of the machine over their cold values, and the inductance L of its flux over Table I's.
    pub truth: [f64; 3],
}

/// An experiment.
pub struct Experiment {
    pub duration_s: f64,
    pub speed_rad_s: Profile,
    pub load_nm: Profile,
    /// Whether the windings heat up, with time constants of 10 and 15 minutes. Over such times the inverter is averaged.
    pub heats: bool,
    pub start: RegulationParameters<f64>,
}

/// Table I: the machine when cold and unsaturated.
pub fn cold() -> RegulationParameters<f64> {
    M.parameters().inverse_gamma().into()
}

pub fn nameplate() -> RegulationParameters<f64> {
    let nameplate = Nameplate {
        power_w: 4000.0,
        line_voltage_rms_v: 415.0,
        line_current_rms_a: 7.9,
        speed_rpm: 1445.0,
        frequency_hz: 50.0,
        power_factor: 0.84,
        ..Nameplate::default()
    };
    nameplate.guess().expect("a nameplate").parameters.inverse_gamma().into()
}

fn machine(heats: bool) -> Machine<f64> {
    let mut e = Effects::scaled(&M.rating, &M.parameters(), M.pole_pairs);
    e.main_flux_saturation.excess = 0.3;
    e.voltage_delay.delay_s = T;
    e.speed_sensor_lag.time_constant_s = 2e-3;
    if heats {
        // Thermal resistances of 0.18 and 0.6 K/W: at rated torque R_s rises by 28 % and R_r by 31 %, growth of the losses included.
        (e.stator_heating.inverse_heat_capacity_k_per_j, e.stator_heating.time_constant_s) = (0.18 / 600.0, 600.0);
        (e.rotor_heating.inverse_heat_capacity_k_per_j, e.rotor_heating.time_constant_s) = (0.6 / 900.0, 900.0);
    }
    Machine::try_new(M.parameters(), M.pole_pairs, e).expect("a machine")
}

/// The controller, and what it thinks at every row.
struct Logged<A: Adaptation<f64> + Clone> {
    drive: Drive<f64, Jadot<f64, A>>,
    sample: usize,
    thoughts: Vec<([f64; 4], f64, f64)>,
}

impl<A: Adaptation<f64> + Clone> Controller<f64> for Logged<A> {
    fn step(&mut self, m: &Measured<f64>, r: &Reference<f64>) -> Command<f64> {
        let command = self.drive.step(m, r);
        if self.sample.is_multiple_of((EVERY_S / T).round() as usize) {
            let c = self.drive.controller();
            self.thoughts.push((c.parameters().values(), c.load_torque_nm(), c.current_a()));
        }
        self.sample += 1;
        command
    }
}

impl Experiment {
    /// With the reduced adaptation, or none.
    pub fn run(&self, adapts: bool) -> Vec<Seen> {
        let start = self.start;
        let right = "settings within their bounds";
        if adapts {
            let settings = SchemeSettings::reduced(start, T);
            self.with(TimeScale::try_new(&settings, TimeScale::<f64>::PAPER_SHARE).expect(right))
        } else {
            self.with(Fixed::try_new(start).expect(right))
        }
    }

    fn with<A: Adaptation<f64> + Clone>(&self, adaptation: A) -> Vec<Seen> {
        let (machine, base) = (machine(self.heats), Machine::base(M.parameters(), M.pole_pairs).expect("a machine"));
        let known = MachineData::of(&base, CURRENT_A).delayed(T);
        let bridge = Bridge { dead_time_s: 2e-6, drop_v: 1.0, ..Bridge::ideal(DC_V) };
        let right = "gains within their bounds";
        let jadot = Jadot::try_new(&known, &JadotGains::of_the_paper(), adaptation).expect(right);
        let limits = DriveLimits::generous(&known, M.rating.synchronous_speed_rad_s(M.pole_pairs), M.rating.rotor_flux_vs);
        let drive = Drive::try_new(jadot, &limits).expect(right);
        let (inverter, drive) = if self.heats {
            (Inverter::Averaged { dc_voltage_v: Some(DC_V) }, drive)
        } else {
            let carrier = Inverter::CarrierPwm(CarrierPwm { half_period_s: 0.5 * T }, bridge);
            (carrier, drive.compensating(&DeadTimeCompensation::of(&bridge, T, 0.3)).expect(right))
        };
        let scenario = Scenario {
            name: "Jadot et al., Section VI".to_owned(),
            duration_s: self.duration_s,
            sample_time_s: T,
            record_every: (EVERY_S / T).round() as u32,
            source: Source::Controller {
                name: "jadot".to_owned(),
                observer: None,
                references: References {
                    speed_rad_s: self.speed_rad_s.clone(),
                    rotor_flux_vs: ROTOR_FLUX_VS.into(),
                    torque_nm: 0.0.into(),
                },
            },
            inverter,
            load: Load { torque_nm: self.load_nm.clone(), quadratic_nm_s2: 0.0 },
            sensors: Sensors { current_noise_a: 0.02, speed_step_rad_s: 0.1, seed: 1, ..Sensors::default() },
            ..Scenario::direct_on_line(0.0, 50.0, self.duration_s)
        };
        let mut logged = Logged { drive, sample: 0, thoughts: Vec::new() };
        let run = Simulation::new(&machine, &scenario).controlled_by(&mut logged).with_internals().run().expect("it runs");
        let table = cold().values();
        let inside = run.internals.expect("asked for");
        let e = machine.effects();
        let rows = logged.thoughts.iter().enumerate().map(|(k, (estimates, torque_hat_nm, current_hat_a))| {
            let x = &inside.states[k];
            let flux = inside.psi_m[k].norm() / e.main_flux_saturation.reference_flux_vs;
            // L = L_m²/L_r with the chord inductance at the flux.
            let l_m = M.parameters().magnetizing_inductance_h
                / (1.0 + e.main_flux_saturation.excess * flux.powf(e.main_flux_saturation.exponent));
            let l = l_m * l_m / (l_m + M.parameters().rotor_leakage_inductance_h);
            Seen {
                t: EVERY_S * k as f64,
                estimates: core::array::from_fn(|n| estimates[n] / table[n]),
                torque_hat_nm: *torque_hat_nm,
                current_hat_a: *current_hat_a,
                load_nm: self.load_nm.at(EVERY_S * k as f64),
                current_a: run.recording.i_s[k].norm(),
                speed_rad_s: x.omega_m,
                truth: [
                    1.0 + e.stator_heating.temperature_coefficient_per_k * x.extra.of(im_model::EffectId::StatorHeating)[0],
                    1.0 + e.rotor_heating.temperature_coefficient_per_k * x.extra.of(im_model::EffectId::RotorHeating)[0],
                    l / table[1],
                ],
            }
        });
        rows.collect()
    }
}
