//! The drive of Kwon et al. (2005), Section VII, on the machine of their Table V: the q-d model whose rotor leakage and magnetizing inductance saturate,
//! in delta, on a bridge of 650 V with delta modulation at 100 µs, at an imposed speed.
//!
//! The machine is the library's, [`im_model::machines::KWON_TABLE_V`]; quantities are the windings', but for what passes to and from the drive.

use im_control::mtpa::Connection;
use im_control::{Mtpa, MtpaGains, MtpaLaw};
use im_design::mtpa::Aqdm;
use im_model::machines::{KWON_TABLE_IV, KWON_TABLE_V};
use im_model::simulation::{Bridge, Command, Controller, DeltaModulator, Fed, Legs, Measured, Reference};
use im_model::space_vector::to_phases;
use im_model::{Complex, Currents, Effects, Machine, Plant, PlantInput, Rating, State, TParameters};
use im_observers::{
    Basis, Derdiyok, DerdiyokGains, Input, Kubota, KubotaGains, LoadTorqueModel, Observer, ObserverError, Thau, ThauGains, Utkin,
    UtkinGains,
};

pub const H: f64 = 1e-4;
/// Flux of the windings at 460 V, 60 Hz, about: where the T circuit of the machine holds.
pub const REFERENCE_FLUX_VS: f64 = 1.75;
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
        stator_resistance_ohm: KWON_TABLE_V.stator_resistance_ohm,
        rotor_resistance_ohm: 1.0 / (y1 + y2 + y3),
        stator_leakage_inductance_h: KWON_TABLE_V.stator_leakage_h,
        rotor_leakage_inductance_h: l1 + l2 / (1.0 + l3 * REFERENCE_FLUX_VS.powf(l4)) + tau1 / y1,
        magnetizing_inductance_h: 0.1255,
        ..KWON_TABLE_IV.parameters()
    };
    let mut effects = Effects::none();
    effects.main_flux_saturation.excess = 0.378;
    effects.main_flux_saturation.exponent = 4.2;
    effects.main_flux_saturation.reference_flux_vs = 1.85;
    Machine::try_new(p, 2, effects).expect("a machine")
}

/// The machine of Table V on the bridge.
pub struct AqdmPlant {
    plant: Plant<f64>,
    pub state: State<f64>,
    input: PlantInput<f64>,
    /// ∫u dt of the windings since it was last taken, Vs: a measurement of the voltage at the terminals.
    volt_seconds: Complex<f64>,
    /// ∫T_e dt and ∫i_s e^{−jθ} dt in the frame of ψ_m, where the fundamental stands still, once they are wanted.
    means: Option<(f64, Complex<f64>)>,
}

impl AqdmPlant {
    pub fn new(speed_rad_s: f64) -> Self {
        let machine = KWON_TABLE_V.machine(REFERENCE_FLUX_VS).expect("a machine");
        let z = Complex::new(0.0, 0.0);
        Self {
            plant: Plant::new(&machine),
            state: State::turning(speed_rad_s),
            input: PlantInput { imposed_speed: Some([speed_rad_s; 2]), ..PlantInput::new(z, 0.0) },
            volt_seconds: z,
            means: None,
        }
    }

    /// Currents of the windings and air-gap flux.
    pub fn currents(&self) -> Currents<f64> {
        self.plant.currents(&self.state)
    }

    /// Current of the windings, A.
    pub fn i_s(&self) -> Complex<f64> {
        self.currents().i_s
    }

    pub fn torque_nm(&self) -> f64 {
        self.plant.torque(&self.state)
    }

    /// Torque and the current as the air-gap flux sees it.
    fn seen(&self) -> (f64, Complex<f64>) {
        let now = self.currents();
        (self.torque_nm(), now.i_s * now.psi_m.conj() / now.psi_m.norm())
    }

    /// A step with the windings' voltage.
    pub fn step(&mut self, u_s: Complex<f64>, h: f64) {
        let before = self.means.map(|_| self.seen());
        self.state = self.plant.step(&self.state, &PlantInput { u_s, ..self.input }, h);
        self.volt_seconds += u_s * h;
        if let (Some((torque, current)), Some(a)) = (self.means, before) {
            let b = self.seen();
            self.means = Some((torque + 0.5 * (a.0 + b.0) * h, current + (a.1 + b.1) * (0.5 * h)));
        }
    }
}

/// On a star's voltages and line currents.
impl Fed<f64> for AqdmPlant {
    fn i_s(&self) -> Complex<f64> {
        Connection::Delta.line_current(self.i_s())
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
    /// Mean of the speed that the drive was given less the true one, rad/s.
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
        let u = core::mem::take(&mut plant.volt_seconds) / H;
        let omega_m = speed.omega_m(u, plant.i_s(), SPEED_RAD_S);
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
        // What is commanded, and what the speed that the drive was given is off by.
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
