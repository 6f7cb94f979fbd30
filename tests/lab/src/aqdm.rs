//! The drive of Kwon et al. (2005), Section VII, on the machine of their Table V: the q-d model whose rotor leakage and magnetizing inductance saturate,
//! in delta, on a bridge of 650 V with delta modulation at 100 µs, at an imposed speed.
//!
//! ```text
//! dψ_s/dt = u_s − R_s i_s,   dψ_k/dt = jω_e ψ_k − i_k/y_k   (one for each branch of Y_r, of inductance τ_k/y_k)
//! ψ_s = L_ls i_s + λ_m,   ψ_k = λ_m + L_lr(λ_m) i_r + (τ_k/y_k) i_k,   i_r = Σ i_k,   i_s + i_r = Γ_m(λ_m) λ_m
//! T_e = (3/2) n_p Im(λ̄_m i_s)                                                                                  (18)
//! ```
//!
//! In the steady state this is Fig. 6 with (24), which `im_design::mtpa::Aqdm` holds. The third branch of Y_r, 0.06 % of the conductance with a time
//! constant of 88 ns, is put to the second. Quantities are the windings', but for what passes to and from the drive.

use im_control::mtpa::Connection;
use im_control::{Mtpa, MtpaGains, MtpaLaw};
use im_design::mtpa::Aqdm;
use im_model::machines::KWON_TABLE_IV;
use im_model::simulation::{Bridge, Command, Controller, DeltaModulator, Fed, Legs, Measured, Reference};
use im_model::space_vector::{cross, to_phases};
use im_model::{Complex, Effects, Machine, Rating, TParameters};
use im_observers::{
    Basis, Derdiyok, DerdiyokGains, Input, Kubota, KubotaGains, LoadTorqueModel, Observer, ObserverError, Thau, ThauGains, Utkin,
    UtkinGains,
};

pub const H: f64 = 1e-4;
/// Of Table V; R_s is Table IV's.
const STATOR_LEAKAGE_H: f64 = 9.06e-4;
const STATOR_RESISTANCE_OHM: f64 = 0.22;
const POLE_PAIRS: f64 = 2.0;
/// 900 rpm, the speed of the paper's Figs. 9, 10, 12.
pub const SPEED_RAD_S: f64 = 94.248;
const BRIDGE: Bridge<f64> = Bridge { dc_voltage_v: 650.0, dead_time_s: 3e-6, drop_v: 0.0, on_resistance_ohm: 0.0 };

/// The windings' rating.
pub const RATING: Rating =
    Rating { torque_nm: 200.7, electrical_frequency_hz: 60.0, phase_voltage_peak_v: 650.5, rotor_flux_vs: 1.7 };

/// What an observer may know of this machine: a T circuit with main-flux saturation, as `motor.toml` holds it. Γ_m by the power law, within 4 % from 0 to 1.85 Wb;
/// L_lr at 1.75 Wb with the inductance of the first branch.
pub fn known() -> Machine<f64> {
    let Aqdm { rotor_leakage: [l1, l2, l3, l4], rotor: [[y1, tau1], [y2, _], [y3, _]], .. } = Aqdm::kwon_table_v();
    let p = TParameters {
        stator_resistance_ohm: STATOR_RESISTANCE_OHM,
        rotor_resistance_ohm: 1.0 / (y1 + y2 + y3),
        stator_leakage_inductance_h: STATOR_LEAKAGE_H,
        rotor_leakage_inductance_h: l1 + l2 / (1.0 + l3 * 1.75f64.powf(l4)) + tau1 / y1,
        magnetizing_inductance_h: 0.1255,
        ..KWON_TABLE_IV.parameters()
    };
    let mut effects = Effects::none();
    effects.main_flux_saturation.excess = 0.378;
    effects.main_flux_saturation.exponent = 4.2;
    effects.main_flux_saturation.reference_flux_vs = 1.85;
    Machine::try_new(p, 2, effects).expect("a machine")
}

/// ψ_s, ψ_1, ψ_2, Vs.
type State = [Complex<f64>; 3];

/// The machine.
pub struct AqdmPlant {
    circuit: Aqdm,
    /// y and L of the branches.
    branches: [[f64; 2]; 2],
    pub state: State,
    omega_e: f64,
    /// ∫u dt of the windings since it was last taken, Vs: a measurement of the voltage at the terminals.
    volt_seconds: Complex<f64>,
    /// ∫T_e dt and ∫i_s e^{−jθ} dt in the frame of λ_m, where the fundamental stands still, once they are wanted.
    means: Option<(f64, Complex<f64>)>,
}

/// Currents and the magnetizing flux.
pub struct Seen {
    pub i_s: Complex<f64>,
    pub lambda_m: Complex<f64>,
    i: [Complex<f64>; 2],
}

impl Seen {
    pub fn torque_nm(&self) -> f64 {
        1.5 * POLE_PAIRS * cross(self.lambda_m, self.i_s)
    }

    fn in_flux_frame(&self) -> Complex<f64> {
        self.i_s * self.lambda_m.conj() / self.lambda_m.norm()
    }
}

impl AqdmPlant {
    pub fn new(speed_rad_s: f64) -> Self {
        let circuit = Aqdm::kwon_table_v();
        let [[y1, tau1], [y2, tau2], [y3, _]] = circuit.rotor;
        let y2 = y2 + y3;
        let z = Complex::new(0.0, 0.0);
        Self {
            circuit,
            branches: [[y1, tau1 / y1], [y2, tau2 / y2]],
            state: [z; 3],
            omega_e: POLE_PAIRS * speed_rad_s,
            volt_seconds: z,
            means: None,
        }
    }

    /// Currents: λ_m from its magnitude, by iteration, as Γ_m and L_lr depend on that alone and weigh little beside the leakages.
    pub fn seen(&self, [psi_s, psi_1, psi_2]: &State) -> Seen {
        let c = &self.circuit;
        let [[_, l_1], [_, l_2]] = self.branches;
        let (n, s) = (1.0 / l_1 + 1.0 / l_2, psi_1 / l_1 + psi_2 / l_2);
        let mut lambda_m = *psi_s;
        let mut d = 1.0;
        for _ in 0..30 {
            let size = lambda_m.norm();
            // Γ_m and L_lr of Table V.
            let [m1, m2, m3, m4, m5, m6] = c.magnetizing;
            let gamma = m1 - m2 * size + (m3 * (size - m4)).exp() + (m5 * (size - m6)).exp();
            let [r1, r2, r3, r4] = c.rotor_leakage;
            d = 1.0 + (r1 + r2 / (1.0 + r3 * size.powf(r4))) * n;
            let next = (psi_s / STATOR_LEAKAGE_H + s / d) / (gamma + 1.0 / STATOR_LEAKAGE_H + n / d);
            let step = (next - lambda_m).norm();
            lambda_m = next;
            if step < 1e-9 {
                break;
            }
        }
        let i_r = (s - lambda_m * n) / d;
        let behind = lambda_m + i_r * ((d - 1.0) / n);
        Seen { i_s: (psi_s - lambda_m) / STATOR_LEAKAGE_H, lambda_m, i: [(psi_1 - behind) / l_1, (psi_2 - behind) / l_2] }
    }

    fn rates(&self, x: &State, u: Complex<f64>) -> State {
        let now = self.seen(x);
        let turn = Complex::new(0.0, self.omega_e);
        let rotor = |k: usize| turn * x[k + 1] - now.i[k] / self.branches[k][0];
        [u - now.i_s * STATOR_RESISTANCE_OHM, rotor(0), rotor(1)]
    }

    /// A step of the fourth-order Runge-Kutta method with the windings' voltage.
    pub fn step(&mut self, u: Complex<f64>, h: f64) {
        let x = self.state;
        let along = |k: &State, h: f64| -> State { core::array::from_fn(|n| x[n] + k[n] * h) };
        let k1 = self.rates(&x, u);
        let k2 = self.rates(&along(&k1, 0.5 * h), u);
        let k3 = self.rates(&along(&k2, 0.5 * h), u);
        let k4 = self.rates(&along(&k3, h), u);
        self.state = core::array::from_fn(|n| x[n] + (k1[n] + (k2[n] + k3[n]) * 2.0 + k4[n]) * (h / 6.0));
        self.volt_seconds += u * h;
        if let Some((torque, current)) = self.means {
            let [a, b] = [&x, &self.state].map(|x| self.seen(x));
            let (torque_mean, current_mean) =
                (0.5 * (a.torque_nm() + b.torque_nm()), (a.in_flux_frame() + b.in_flux_frame()) * 0.5);
            self.means = Some((torque + torque_mean * h, current + current_mean * h));
        }
    }
}

/// On a star's voltages and line currents.
impl Fed<f64> for AqdmPlant {
    fn i_s(&self) -> Complex<f64> {
        Connection::Delta.line_current(self.seen(&self.state).i_s)
    }
    fn hold(&mut self, u_s: Complex<f64>, duration: f64) {
        let [a, b, c] = to_phases(u_s);
        self.step(Connection::Delta.winding_voltage(a - b, b - c), duration);
    }
}

/// Where the speed comes from.
pub trait SpeedSource {
    /// From the windings' mean voltage over the sample that ended, their current, and the sensor's speed.
    fn omega_m(&mut self, u: Complex<f64>, i: Complex<f64>, sensor: f64) -> f64;
}

pub struct Sensor;
impl SpeedSource for Sensor {
    fn omega_m(&mut self, _: Complex<f64>, _: Complex<f64>, sensor: f64) -> f64 {
        sensor
    }
}

/// Until then the sensor's speed is used, s: an observer needs flux to see by.
const CHANGE_OVER_S: f64 = 1.5;

pub struct Observed<O: Observer<f64>> {
    observer: O,
    state: O::State,
    time_s: f64,
    pub estimate: f64,
}

impl<O: Observer<f64>> Observed<O> {
    pub fn new(observer: O) -> Self {
        let state = observer.state_at(Default::default(), Default::default(), SPEED_RAD_S);
        Self { observer, state, time_s: 0.0, estimate: SPEED_RAD_S }
    }
}

impl<O: Observer<f64>> SpeedSource for Observed<O> {
    fn omega_m(&mut self, u: Complex<f64>, i: Complex<f64>, sensor: f64) -> f64 {
        self.estimate = self.observer.step(&mut self.state, &Input::new(u, i)).omega_m;
        self.time_s += H;
        if self.time_s < CHANGE_OVER_S { sensor } else { self.estimate }
    }
}

/// What a run settles at, over its last half second.
#[derive(Clone, Copy, Debug)]
pub struct Settled {
    pub torque_nm: f64,
    /// Fundamental of the windings' current, rms, A.
    pub current_rms_a: f64,
    /// Slip, electrical rad/s.
    pub slip_rad_s: f64,
    /// Mean of the speed that the drive was told less the true one, rad/s.
    pub speed_error_rad_s: f64,
}

/// The drive at a torque reference.
pub fn run(law: &MtpaLaw<f64>, slip_factor: f64, torque_nm: f64, speed: &mut impl SpeedSource, duration_s: f64) -> Settled {
    let data = im_control::MachineData::of(&known(), 150.0);
    let gains = MtpaGains { slip_factor, connection: Connection::Delta, ..MtpaGains::typical(&data) };
    let mut drive = Mtpa::try_new(&data, law, &gains).expect("a law");
    let (mut plant, mut legs, modulator) = (AqdmPlant::new(SPEED_RAD_S), Legs::default(), DeltaModulator { period_s: H });
    let (samples, last) = ((duration_s / H).round() as usize, (0.5 / H) as usize);
    let mut error = 0.0;
    for k in 0..samples {
        let now = plant.seen(&plant.state);
        let u = core::mem::take(&mut plant.volt_seconds) / H;
        let omega_m = speed.omega_m(u, now.i_s, SPEED_RAD_S);
        let measured = Measured { i_s: Fed::i_s(&plant), omega_m, u_s: u, dc_voltage_v: BRIDGE.dc_voltage_v, sample_time_s: H };
        let reference = Reference { omega_m: 0.0, rotor_flux_vs: 0.0, torque_nm };
        let Command::Current(wanted) = drive.step(&measured, &reference) else { unreachable!("the drive gives currents") };
        if k >= samples - last {
            plant.means.get_or_insert_default();
            error += (omega_m - SPEED_RAD_S) / last as f64;
        }
        modulator.period(&BRIDGE, &mut legs, wanted, &mut plant, |i| i);
    }
    let (torque, current) = plant.means.unwrap_or_default();
    let span = H * last as f64;
    Settled {
        torque_nm: torque / span,
        current_rms_a: current.norm() / span / 2f64.sqrt(),
        // What is commanded, and what the speed that the drive was told is off by.
        slip_rad_s: law.at(torque_nm).1 * slip_factor + POLE_PAIRS * error,
        speed_error_rad_s: error,
    }
}

/// The law fitted to the circuit.
pub fn fitted() -> MtpaLaw<f64> {
    let fit = im_design::mtpa::laws::fit_log(&Aqdm::kwon_table_v(), [1.0, 510.0], 0.01).expect("the circuit carries it");
    MtpaLaw::series(fit.torque_n_m, &fit.current, &fit.slip).expect("a law")
}

/// Where speeds come from in the studies, by name. Kubota's and Thau's observer as the paper runs them, without feedback.
pub const SOURCES: [&str; 6] = ["sensor", "kubota", "derdiyok", "utkin", "thau", "thau, balanced"];

/// Kubota's observer with the gain that `im-observers` begins with.
pub const STABILIZED: &str = "kubota, stabilized";

/// The drive with the speed of one of [`SOURCES`], or of [`STABILIZED`].
pub fn run_with(source: &str, law: &MtpaLaw<f64>, slip_factor: f64, torque_nm: f64) -> Result<Settled, ObserverError> {
    fn of<O: Observer<f64>>(observer: O, law: &MtpaLaw<f64>, slip_factor: f64, torque_nm: f64) -> Settled {
        run(law, slip_factor, torque_nm, &mut Observed::new(observer), 5.0)
    }
    let machine = known();
    let basis = Basis::try_new(&machine, &RATING, H)?.with_saturation(&machine);
    let thau = |load| Thau::try_new(basis, ThauGains::published(), load);
    Ok(match source {
        "kubota" => {
            let (proportional, integral) = KubotaGains::speed_law(&machine, &RATING, 100.0);
            let gains = KubotaGains::without_feedback(proportional, integral);
            of(Kubota::try_new(basis, gains)?, law, slip_factor, torque_nm)
        }
        STABILIZED => of(Kubota::try_new(basis, KubotaGains::for_machine(&machine, &RATING)?)?, law, slip_factor, torque_nm),
        "derdiyok" => of(Derdiyok::try_new(basis, DerdiyokGains::for_machine(&machine, &RATING))?, law, slip_factor, torque_nm),
        "utkin" => of(Utkin::try_new(basis, UtkinGains::for_machine(&machine, &RATING))?, law, slip_factor, torque_nm),
        "thau" => of(thau(LoadTorqueModel::EqualToTorque)?, law, slip_factor, torque_nm),
        "thau, balanced" => of(thau(LoadTorqueModel::Balanced)?, law, slip_factor, torque_nm),
        "sensor" => run(law, slip_factor, torque_nm, &mut Sensor, 4.0),
        other => unreachable!("no source of speed is called {other}"),
    })
}
