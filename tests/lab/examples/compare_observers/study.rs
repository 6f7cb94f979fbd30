//! What is measured of an observer, and on which runs.

use im_design::thau_box;
use im_design::{DesignModel, LinearMachine};
use im_model::machines::{JADOT_TABLE_I, KENNE_APPENDIX_II, KWON_TABLE_IV, MOTULATOR_2_2_KW, NamedMachine};
use im_model::simulation::{Scenario, Sensors};
use im_model::{BaseParameter, Machine, ParameterId, Rating};
use im_observers::*;

use im_lab::observation::{Running, Truth, held, rms};

pub const H: f64 = 1e-4;

/// Four machines, of 1.1, 2.2, 4 and 37 kW; the last per delta winding, as its inductances are.
pub fn machines() -> [NamedMachine; 4] {
    let rating = Rating { phase_voltage_peak_v: 650.5, rotor_flux_vs: 1.7, ..KWON_TABLE_IV.rating };
    [KENNE_APPENDIX_II, MOTULATOR_2_2_KW, JADOT_TABLE_I, NamedMachine { rating, ..KWON_TABLE_IV }]
}

/// Which observer, with which gains.
#[derive(Clone, Copy, PartialEq)]
pub enum Kind {
    CurrentModel,
    FullOrder,
    KubotaPublished,
    Kubota,
    DerdiyokPublished,
    Derdiyok,
    Utkin,
    ThauPublished,
    ThauBox,
    Kalman,
}

impl Kind {
    pub const ALL: [Self; 10] = [
        Self::CurrentModel,
        Self::FullOrder,
        Self::KubotaPublished,
        Self::Kubota,
        Self::DerdiyokPublished,
        Self::Derdiyok,
        Self::Utkin,
        Self::ThauPublished,
        Self::ThauBox,
        Self::Kalman,
    ];

    pub fn name(self) -> &'static str {
        match self {
            Self::CurrentModel => "current model (with speed sensor)",
            Self::FullOrder => "full-order",
            Self::KubotaPublished => "Kubota, L = 0",
            Self::Kubota => "Kubota, stabilized",
            Self::DerdiyokPublished => "Derdiyok, as published",
            Self::Derdiyok => "Derdiyok, anchored",
            Self::Utkin => "Utkin",
            Self::ThauPublished => "Thau, L = 0",
            Self::ThauBox => "Thau, certified box",
            Self::Kalman => "extended Kalman filter",
        }
    }
}

/// The observer's idea of a machine, and the box gain designed for the right one.
#[derive(Clone, Copy)]
pub struct Maker {
    pub named: NamedMachine,
    pub box_gains: ThauBoxGains,
}

impl Maker {
    pub fn new(m: &NamedMachine) -> Self {
        let w = m.parameters().windings();
        let plant = DesignModel::Machine(LinearMachine {
            stator_resistance_ohm: w.stator_resistance_ohm,
            rotor_resistance_ohm: w.rotor_resistance_ohm,
            stator_inductance_h: w.stator_inductance_h,
            rotor_inductance_h: w.rotor_inductance_h,
            mutual_inductance_h: w.mutual_inductance_h,
            pole_pairs: m.pole_pairs,
            inertia_kg_m2: w.inertia_kg_m2,
            viscous_friction_n_m_s: 0.0,
        });
        let flux = m.rating.rotor_flux_vs;
        let region = thau_box::BoxRegion {
            frame_rad_s: [60.0, 330.0],
            slip_rad_s: [-12.0, 12.0],
            flux_d_vs: [0.85 * flux, 1.15 * flux],
            flux_q_vs: [-0.05 * flux, 0.05 * flux],
            current_d_a: [0.0; 2],
            current_q_a: [0.0; 2],
        };
        let (design, _) = thau_box::fastest(plant, &region, 40.0, 1e3).expect("a box away from zero frame speed");
        let rows = |m: &im_design::matrix::Matrix<f64>| core::array::from_fn(|r| [m[(r, 0)], m[(r, 1)]]);
        let box_gains = ThauBoxGains {
            frame_rad_s: region.frame_rad_s,
            gain: rows(&design.gain),
            gain_per_frame_speed: rows(&design.gain_per_frame_speed),
        };
        Self { named: *m, box_gains }
    }

    pub fn machine(&self) -> Machine<f64> {
        im_lab::observation::machine(&self.named)
    }

    /// An observer from rest whose idea of the machine has resistances off by factors.
    pub fn make(&self, kind: Kind, stator: f64, rotor: f64) -> Running {
        self.build(kind, stator, rotor, H)
    }

    /// The observer of the right machine at another sampling time, s.
    pub fn make_at(&self, kind: Kind, sample_time_s: f64) -> Running {
        self.build(kind, 1.0, 1.0, sample_time_s)
    }

    fn build(&self, kind: Kind, stator: f64, rotor: f64, sample_time_s: f64) -> Running {
        let right = self.machine();
        let p = right.parameters();
        let believed = right
            .with(&[
                (ParameterId::Base(BaseParameter::StatorResistance), stator * p.stator_resistance_ohm),
                (ParameterId::Base(BaseParameter::RotorResistance), rotor * p.rotor_resistance_ohm),
            ])
            .expect("positive");
        let rating = &self.named.rating;
        let basis = Basis::try_new(&believed, rating, sample_time_s).expect("valid");
        let (proportional, integral) = KubotaGains::speed_law(&believed, rating, 400.0);
        let name = kind.name();
        match kind {
            Kind::CurrentModel => Running::from_rest(name, CurrentModel::new(basis)),
            Kind::FullOrder => {
                let gains = FullOrderGains::for_machine(&believed, rating);
                Running::from_rest(name, FullOrder::try_new(basis, gains).expect("fits"))
            }
            Kind::KubotaPublished => {
                let gains = KubotaGains::without_feedback(proportional, integral);
                Running::from_rest(name, Kubota::try_new(basis, gains).expect("fits"))
            }
            Kind::Kubota => {
                let gains = KubotaGains::for_machine(&believed, rating).expect("valid");
                Running::from_rest(name, Kubota::try_new(basis, gains).expect("fits"))
            }
            Kind::DerdiyokPublished => {
                let gains = DerdiyokGains { anchor_per_s: 0.0, ..DerdiyokGains::for_machine(&believed, rating) };
                Running::from_rest(name, Derdiyok::try_new(basis, gains).expect("fits"))
            }
            Kind::Derdiyok => {
                let gains = DerdiyokGains::for_machine(&believed, rating);
                Running::from_rest(name, Derdiyok::try_new(basis, gains).expect("fits"))
            }
            Kind::Kalman => {
                let gains = KalmanGains::for_machine(&believed, rating);
                Running::from_rest(name, Kalman::try_new(basis, &believed, rating, gains).expect("fits"))
            }
            Kind::Utkin => {
                Running::from_rest(name, Utkin::try_new(basis, UtkinGains::for_machine(&believed, rating)).expect("fits"))
            }
            Kind::ThauPublished => {
                let thau = Thau::try_new(basis, ThauGains::published(), LoadTorqueModel::EqualToTorque);
                Running::from_rest(name, thau.expect("fits"))
            }
            Kind::ThauBox => {
                Running::from_rest(name, Thau::in_box(basis, self.box_gains, LoadTorqueModel::Balanced).expect("fits"))
            }
        }
    }

    /// Rated mechanical speed, rad/s.
    pub fn speed(&self) -> f64 {
        2.0 * core::f64::consts::PI * self.named.rating.electrical_frequency_hz / f64::from(self.named.pole_pairs)
    }

    /// A speed and the slip that a share of the rated torque takes, both held from the beginning on.
    pub fn at(&self, speed: f64, slip: f64, duration_s: f64, noise_a: f64) -> Truth {
        let sensors = Sensors { current_noise_a: noise_a, seed: 5, ..Sensors::default() };
        Truth::of(&self.machine(), &Scenario { sensors, ..held(&self.named, speed, slip, duration_s) })
    }

    /// The slip at which rated flux gives a share of the rated torque, electrical rad/s.
    pub fn slip(&self, share: f64) -> f64 {
        let r = &self.named.rating;
        let n_p = f64::from(self.named.pole_pairs);
        share * r.torque_nm * self.machine().parameters().rotor_resistance_ohm / (1.5 * n_p * r.rotor_flux_vs * r.rotor_flux_vs)
    }

    /// The current at rated flux and 40 % torque, peak: what noise is a share of.
    pub fn current(&self) -> f64 {
        let truth = self.at(0.8 * self.speed(), self.slip(0.4), 0.8, 0.0);
        truth.recording.i_s[truth.len() - 1].norm()
    }
}

/// The error in the last half second of a run, as shares of rated speed: mean (signed), scatter, and of the flux (share of rated).
fn errors(maker: &Maker, truth: &Truth, estimates: &[Estimate<f64>]) -> [f64; 3] {
    let last = truth.at(truth.time_s(truth.len() - 1) - 0.5)..truth.len();
    let n = last.len() as f64;
    let mean = last.clone().map(|k| estimates[k].omega_m - truth.omega[k]).sum::<f64>() / n;
    let scatter = rms(last.clone().map(|k| estimates[k].omega_m - truth.omega[k] - mean));
    let flux = rms(last.map(|k| (estimates[k].rotor_flux_vs - truth.flux[k]).norm()));
    [mean / maker.speed(), scatter / maker.speed(), flux / maker.named.rating.rotor_flux_vs]
}

/// The figures of one observer on one machine; speeds in per cent of rated speed, fluxes of rated flux.
pub struct Figures {
    pub converges_s: Option<f64>,
    pub steady: f64,
    pub noise: f64,
    /// Speed and flux error with R_s × 0.5, R_s × 1.5, R_r × 0.5, R_r × 2, at 80 % speed; then the speed's at 10 % speed.
    pub parameters: [[f64; 3]; 4],
    pub lowest: Option<f64>,
    pub regenerating: f64,
}

/// One machine with every observer on it.
pub struct Study {
    pub maker: Maker,
    pub figures: Vec<(Kind, Figures)>,
}

/// 2 % of rated speed is what is called right.
const RIGHT: f64 = 0.02;
/// Speeds tried for the lowest usable, shares of rated.
const LADDER: [f64; 8] = [0.5, 0.3, 0.2, 0.1, 0.05, 0.03, 0.02, 0.01];

impl Study {
    pub fn run(m: &NamedMachine) -> Self {
        let maker = Maker::new(m);
        let (fast, slip) = (0.8 * maker.speed(), maker.slip(0.4));
        let noise_a = 0.01 * maker.current();
        let clean = maker.at(fast, slip, 3.0, 0.0);
        let noisy = maker.at(fast, slip, 2.0, noise_a);
        let slow = maker.at(0.1 * maker.speed(), slip, 3.0, 0.0);
        let ladder: Vec<(f64, Truth)> = LADDER.iter().map(|&s| (s, maker.at(s * maker.speed(), slip, 3.0, noise_a))).collect();
        // Regenerating at low frequency: a tenth of rated speed with the frequency at half of it.
        let n_p = f64::from(m.pole_pairs);
        let braking = maker.at(0.1 * maker.speed(), -0.5 * n_p * 0.1 * maker.speed(), 4.0, 0.0);
        let figures = Kind::ALL.map(|kind| {
            let over = |truth: &Truth, stator: f64, rotor: f64| maker.make(kind, stator, rotor).over(truth);
            let speed_error = |truth: &Truth, stator: f64, rotor: f64| {
                let [mean, scatter, _] = errors(&maker, truth, &over(truth, stator, rotor));
                mean.hypot(scatter)
            };
            let e = over(&clean, 1.0, 1.0);
            // A quarter of the speed at most: standing still would otherwise pass for 2 %.
            let usable = |(s, truth): &&(f64, Truth)| speed_error(truth, 0.95, 1.0) < RIGHT.min(0.25 * s);
            let lowest = ladder.iter().take_while(usable).last().map(|(s, _)| 100.0 * s);
            let figures = Figures {
                converges_s: converges(&maker, &clean, kind),
                steady: 100.0 * errors(&maker, &clean, &e)[0].abs(),
                noise: 100.0 * errors(&maker, &noisy, &over(&noisy, 1.0, 1.0))[1],
                parameters: [(0.5, 1.0), (1.5, 1.0), (1.0, 0.5), (1.0, 2.0)].map(|(stator, rotor)| {
                    let [speed, _, flux] = errors(&maker, &clean, &over(&clean, stator, rotor));
                    [100.0 * speed, 100.0 * flux, 100.0 * speed_error(&slow, stator, rotor)]
                }),
                lowest,
                regenerating: 100.0 * speed_error(&braking, 1.0, 1.0),
            };
            (kind, figures)
        });
        Self { maker, figures: figures.into() }
    }
}

/// Switched on, from zero, to a machine that runs at 80 % speed: the time until the speed stays within 2 % of rated speed, s.
fn converges(maker: &Maker, truth: &Truth, kind: Kind) -> Option<f64> {
    let mut observer = maker.make(kind, 1.0, 1.0);
    let off: Vec<bool> = (0..truth.len())
        .map(|k| (observer.step(&truth.input(k)).omega_m - truth.omega[k]).abs() > RIGHT * maker.speed())
        .collect();
    match off.iter().rposition(|&x| x) {
        None => Some(0.0),
        Some(k) if k + 1 < off.len() => Some(H * (k + 1) as f64),
        Some(_) => None,
    }
}
