//! The machine of Table I, with parameters that may change, under the passivity-based controller with one of the adaptations.

use im_control::{Jadot, JadotGains, MachineData};
use im_identify::online::{Adaptation, Fixed, RegulationParameters, SchemeSettings, TimeScale, TimeVarying, TimeVaryingGain};
use im_model::machines::JADOT_TABLE_I;
use im_model::simulation::{Command, Controller, Measured, Reference};
use im_model::{Complex, Machine, Plant, PlantInput, State, TParameters};

/// Sampling time, s. The paper simulates in continuous time.
const H: f64 = 1e-4;
/// Rated torque, Nm (Table I), and synchronous speed, rad/s: 100 %.
pub const TORQUE_NM: f64 = 26.0;
/// 50 Hz, two pole pairs.
pub const SPEED_RAD_S: f64 = 157.08;
/// φ = 0.93 Vs: what 400 V, 50 Hz gives.
const ROTOR_FLUX_VS: f64 = 0.95;
/// Largest current, peak, A.
const CURRENT_A: f64 = 25.0;
/// Rows per second that are plotted.
const ROWS_PER_S: f64 = 20.0;

/// A study: speed and load in percent, factors on the parameters at a time, and the errors of the first estimates.
pub struct Study<'a> {
    pub duration_s: f64,
    pub speed_percent: &'a dyn Fn(f64) -> f64,
    pub load_percent: &'a dyn Fn(f64) -> f64,
    /// R_s and R_r over their values of Table I.
    pub resistances: &'a dyn Fn(f64) -> [f64; 2],
    /// First estimates over the parameters, in the order R_req, L, R_s, L_f.
    pub start: [f64; 4],
}

/// What is adapted, how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scheme {
    /// Nothing; the parameters are right.
    Ideal,
    /// Nothing.
    None,
    /// (34).
    TimeScale,
    /// (47), the integral action forgetting.
    TimeVarying,
    /// (47) with its L_f and the integral action of the paper.
    TimeVaryingAsPrinted,
    /// (47) without L_f, as (48), (49) need it, with the integral action of the paper.
    TimeVaryingWithoutLeakage,
    /// (53).
    Reduced,
}

/// What is plotted.
#[derive(Clone, Copy)]
pub struct Row {
    pub t: f64,
    /// Estimates over the truth of the moment.
    pub estimates: [f64; 4],
    pub torque_hat_nm: f64,
    pub load_nm: f64,
    pub current_a: f64,
    pub speed_rad_s: f64,
    pub speed_ref_rad_s: f64,
    /// In the controller's frame: φ, i, and their references.
    pub phi: [Complex<f64>; 2],
    pub i: [Complex<f64>; 2],
}

impl Study<'_> {
    pub fn run(&self, scheme: Scheme) -> Vec<Row> {
        let truth = RegulationParameters::from(JADOT_TABLE_I.parameters().inverse_gamma());
        let start = truth.scaled(self.start);
        let full = SchemeSettings::full(start, H);
        let frequency = TimeVarying::<f64>::PAPER_FREQUENCY;
        let right = "settings within their bounds";
        match scheme {
            Scheme::Ideal => self.with(Fixed::try_new(truth).expect(right)),
            Scheme::None => self.with(Fixed::try_new(start).expect(right)),
            Scheme::TimeScale => self.with(TimeScale::try_new(&full, TimeScale::<f64>::PAPER_SHARE).expect(right)),
            Scheme::TimeVarying => self.with(TimeVarying::try_new(&full, frequency, 1000.0).expect(right)),
            Scheme::TimeVaryingAsPrinted => self.with(TimeVarying::try_new(&full, frequency, 0.0).expect(right)),
            Scheme::TimeVaryingWithoutLeakage => {
                let gain = TimeVaryingGain::NormalizedWithoutLeakage { rate_ohm_per_s: frequency * frequency };
                self.with(TimeVarying::with_gain(&full, gain, 0.0).expect(right))
            }
            Scheme::Reduced => {
                let reduced = SchemeSettings::reduced(start, H);
                self.with(TimeScale::try_new(&reduced, TimeScale::<f64>::PAPER_SHARE).expect(right))
            }
        }
    }

    fn with<A: Adaptation<f64>>(&self, adaptation: A) -> Vec<Row> {
        let nominal = JADOT_TABLE_I.parameters();
        let at = |t: f64| {
            let [r_s, r_r] = (self.resistances)(t);
            TParameters {
                stator_resistance_ohm: nominal.stator_resistance_ohm * r_s,
                rotor_resistance_ohm: nominal.rotor_resistance_ohm * r_r,
                ..nominal
            }
        };
        let machine = |p: TParameters<f64>| Machine::base(p, JADOT_TABLE_I.pole_pairs).expect("a machine");
        let k_r = nominal.magnetizing_inductance_h / nominal.rotor_inductance_h();
        let data = MachineData::of(&machine(nominal), CURRENT_A);
        let mut controller = Jadot::try_new(&data, &JadotGains::of_the_paper(), adaptation).expect("gains within their bounds");
        let mut parameters = at(0.0);
        let mut plant = Plant::new(&machine(parameters));
        let mut x = State::default();
        let mut u_s = Complex::new(0.0, 0.0);
        let mut rows = Vec::new();
        let every = (1.0 / (ROWS_PER_S * H)).round() as usize;
        for k in 0..(self.duration_s / H).round() as usize {
            let t = H * k as f64;
            let now = at(t);
            if now != parameters {
                (parameters, plant) = (now, Plant::new(&machine(now)));
            }
            let (speed, load) = ((self.speed_percent)(t) * SPEED_RAD_S / 100.0, (self.load_percent)(t) * TORQUE_NM / 100.0);
            let i_s = plant.currents(&x).i_s;
            // No limit of the dc link: the paper knows none.
            let m = Measured { i_s, omega_m: x.omega_m, u_s, dc_voltage_v: 0.0, sample_time_s: H };
            let in_frame = controller.direction().conj();
            let (phi_ref, i_ref) = controller.references();
            if k % every == 0 {
                let truth = RegulationParameters::from(parameters.inverse_gamma()).values();
                let values = controller.parameters().values();
                rows.push(Row {
                    t,
                    estimates: core::array::from_fn(|n| values[n] / truth[n]),
                    torque_hat_nm: controller.load_torque_nm(),
                    load_nm: load,
                    current_a: i_s.norm(),
                    speed_rad_s: x.omega_m,
                    speed_ref_rad_s: speed,
                    phi: [x.psi_r * k_r * in_frame, phi_ref],
                    i: [i_s * in_frame, i_ref],
                });
            }
            let reference = Reference { omega_m: speed, rotor_flux_vs: ROTOR_FLUX_VS, torque_nm: 0.0 };
            let Command::Voltage(u) = controller.step(&m, &reference) else { unreachable!("the controller gives voltages") };
            u_s = u;
            x = plant.step(&x, &PlantInput::new(u, load), H);
        }
        rows
    }
}
