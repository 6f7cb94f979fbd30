//! The machine of Appendix II with resistances that vary, Kenné's controller, and the identifier (43).

use im_control::kenne::LoadTorqueSource;
use im_control::{FieldWeakening, Kenne, KenneGains, MachineData, ReferenceShaper};
use im_design::kenne::KenneRegion;
use im_identify::online::{Identifier, KenneRotorResistance, KenneSettings, Range, Sample};
use im_model::machines::KENNE_APPENDIX_II;
use im_model::simulation::{Command, Controller, Measured, Reference};
use im_model::{Bench, Complex, Machine, PlantInput, State};

/// Largest current, peak, A: what 1.5 times the rated torque needs at the paper's flux.
pub const CURRENT_A: f64 = 5.0;
/// Sampling time of the paper, s.
const T: f64 = 106e-6;

/// A study: everything as functions of time.
#[derive(Clone, Copy)]
pub struct Study<'a> {
    pub duration_s: f64,
    pub speed: &'a dyn Fn(f64) -> f64,
    /// Nm, against whichever way the machine turns.
    pub load: &'a dyn Fn(f64) -> f64,
    pub r_r: &'a dyn Fn(f64) -> f64,
    pub r_s: &'a dyn Fn(f64) -> f64,
    /// Largest noise on each current, A. With noise the identifier starts at the nominal value, not at zero.
    pub noise_a: f64,
    /// Largest voltage, V peak; zero is no limit.
    pub voltage_v: f64,
}

/// The constant case of the paper's Fig. 1, of a length.
pub fn constant(duration_s: f64) -> Study<'static> {
    Study { duration_s, speed: &|_| 145.0, load: &|_| 6.89, r_r: &|_| 0.7, r_s: &|_| 8.65, noise_a: 0.0, voltage_v: 0.0 }
}

/// What is plotted. Fluxes in the reference of the paper's windings.
pub struct Row {
    pub t: f64,
    pub omega: f64,
    pub omega_ref: f64,
    pub flux2: f64,
    pub flux2_hat: f64,
    pub torque_hat: f64,
    pub load: f64,
    pub r_r: f64,
    pub r_r_hat: f64,
    pub current: f64,
}

/// The paper's law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Law {
    /// Table I, its signs as they are.
    Signs,
    /// Table I, with boundary layers and the mean of the switching fed back.
    Layers,
    /// The same with switching gains that satisfy (25), (26) for what the second study changes.
    Designed,
}

/// k_vsq and k_vsd by `im_design`, V: R_s as the second study has it, R_r within 20 % of what the identifier says, the flux estimate within 10 %, speed and
/// flux around their references, a given load.
pub fn designed_gains() -> [f64; 2] {
    let flux = 0.0645f64.sqrt();
    let region = KenneRegion {
        flux_uncertainty: 0.1,
        stator_resistance_ratio: [1.0, 1.5],
        rotor_resistance_ratio: [0.8, 1.2],
        acceleration_max_rad_s2: 500.0,
        ..KenneRegion::certain(155.0, [0.9 * flux, 1.1 * flux], CURRENT_A, 400.0)
    };
    let plant = im_design::DesignModel::Machine(im_design::LinearMachine::from(&KENNE_APPENDIX_II));
    let (design, certificate) = im_design::kenne::design(plant, &region, 0.05).expect("a region");
    certificate.check().expect("what was just proven");
    [design.k_sq, design.k_sd]
}

fn gains(law: Law, known: &MachineData<f64>) -> KenneGains<f64> {
    let mut gains = KenneGains {
        // Table I.
        k_sq: 50.0,
        c_omega: 15.0,
        k_sd: 5.0,
        c_lambda: 10.0,
        boundary_omega: 0.0,
        boundary_lambda: 0.0,
        equivalent_bandwidth_per_s: 0.0,
        load_torque: LoadTorqueSource::Given,
        load_bandwidth_per_s: 100.0,
        load_limit_nm: 20.0,
        magnetizing_bandwidth_rad_s: 1000.0,
        reference: ReferenceShaper { bandwidth_rad_s: 100.0, acceleration_max_rad_s2: 1000.0 },
        field_weakening: FieldWeakening { bandwidth_per_s: 15.0, voltage_share: 0.92 },
    };
    if law == Law::Designed {
        [gains.k_sq, gains.k_sd] = designed_gains();
    }
    if law != Law::Signs {
        gains.set_boundary_layers(known, 0.0645f64.sqrt(), 1000.0);
        gains.equivalent_bandwidth_per_s = 100.0;
    }
    gains
}

impl Study<'_> {
    /// Runs.
    pub fn run(&self, law: Law) -> Vec<Row> {
        let m = KENNE_APPENDIX_II;
        let known =
            MachineData { windings: m.windings, pole_pairs: m.pole_pairs, current_max_a: CURRENT_A, voltage_delay_s: 0.0 };
        let mut drive = Kenne::try_new(&known, &gains(law, &known)).expect("the paper's gains are valid");
        let noisy = self.noise_a > 0.0;
        let settings = KenneSettings {
            // Γ of the paper passes all noise: with noise a slower filter.
            high_gain_per_s: if noisy { 100.0 } else { 31_000.0 },
            sliding_gain_a_per_s2: 150_000.0,
            averaging_time_s: 1e-3,
            rate_ohm_per_s: 9.5,
            boundary_layer_ohm: if noisy { 0.3 } else { 0.05 },
            range_ohm: Range::try_new("range_ohm", 0.05, 3.0).expect("a range"),
            start_ohm: if self.noise_a > 0.0 { 0.7 } else { 0.05 },
            least_rotor_current_rate_a_per_s: 30.0,
            excitation_window_s: 0.05,
        };
        let identifier = KenneRotorResistance::try_new(&m.windings, m.pole_pairs, &settings, T).expect("settings are valid");
        let mut identified = identifier.start();

        // The T circuit refers the rotor anew: fluxes by the ratio of the turns.
        let turns = (m.windings.stator_inductance_h / m.windings.rotor_inductance_h).sqrt();
        let machine = |r_s: f64, r_r: f64| {
            let mut w = m.windings;
            (w.stator_resistance_ohm, w.rotor_resistance_ohm) = (r_s, r_r);
            Machine::base(w.to_t().expect("a machine"), m.pole_pairs).expect("a machine")
        };
        let mut noise = Noise(1);
        let (mut state, mut u_s) = (State::default(), Complex::new(0.0, 0.0));
        let mut rows = Vec::new();
        for k in 0..(self.duration_s / T) as usize {
            let t = T * k as f64;
            let (r_s, r_r) = ((self.r_s)(t), (self.r_r)(t));
            let mut bench = Bench::new(&machine(r_s, r_r), state, T);
            let shown = bench.output();
            let i_s = shown.i_s + Complex::new(noise.next(), noise.next()) * self.noise_a;
            let measured =
                Measured { i_s, omega_m: shown.omega_m, u_s, dc_voltage_v: 3f64.sqrt() * self.voltage_v, sample_time_s: T };
            let estimate = identifier.step(&mut identified, &Sample::from(&measured));
            drive.set_rotor_resistance_ohm(estimate.values[0]);
            // A brake: it holds the rotor, but does not drive it.
            let brake = |t: f64| (self.load)(t) * (state.omega_m / 0.5).clamp(-1.0, 1.0);
            drive.set_load_torque(brake(t), (brake(t + T) - brake(t)) / T);
            let omega_ref = (self.speed)(t);
            let reference = Reference { omega_m: omega_ref, rotor_flux_vs: 0.0645f64.sqrt(), torque_nm: 0.0 };
            let Command::Voltage(u) = drive.step(&measured, &reference) else { unreachable!("a voltage controller") };
            rows.push(Row {
                t,
                omega: state.omega_m,
                omega_ref,
                flux2: (state.psi_r / turns).norm_sqr(),
                flux2_hat: drive.rotor_flux_vs().norm_sqr(),
                torque_hat: drive.torque_nm(),
                load: brake(t),
                r_r,
                r_r_hat: estimate.values[0],
                current: shown.i_s.norm(),
            });
            bench.advance(&PlantInput::new(u, brake(t)));
            (state, u_s) = (*bench.state(), u);
        }
        rows
    }
}

/// White noise, even in [−1, 1].
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}
