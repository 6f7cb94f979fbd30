//! A step of each observer, on the samples of a loaded machine.

use super::Cost;
use im_model::machines::MOTULATOR_2_2_KW;
use im_model::simulation::{Scenario, Simulation, Start};
use im_model::{Complex, Effects, Held, Machine, Scalar, effects::InverterNonlinearity};
use im_observers::*;

const H: f64 = 1e-4;

/// A thousand samples of the loaded machine, and the state it is in before them.
struct Load<T> {
    inputs: Vec<Input<T>>,
    flux: Complex<T>,
    current: Complex<T>,
    speed: T,
}

fn load<T: Scalar>() -> Load<T> {
    let m = MOTULATOR_2_2_KW;
    let machine = Machine::base(m.parameters(), m.pole_pairs).expect("valid");
    let scenario = Scenario { start: Start::SteadyState(Held::Load(10.0)), ..Scenario::direct_on_line(320.0, 50.0, 0.1001) };
    let scenario = Scenario { load: im_model::simulation::Load { torque_nm: 10.0.into(), quadratic_nm_s2: 0.0 }, ..scenario };
    let run = Simulation::new(&machine, &scenario).with_internals().run().expect("runs");
    let (r, x) = (run.recording, run.internals.expect("asked for").states[0]);
    let z = |z: Complex<f64>| Complex::new(T::from_f64(z.re), T::from_f64(z.im));
    Load {
        inputs: (1..=1000).map(|k| Input::new(z(r.u_s[k - 1]), z(r.i_s[k])).with_speed(T::from_f64(r.omega_m[k]))).collect(),
        flux: z(x.psi_r),
        current: z(r.i_s[0]),
        speed: T::from_f64(r.omega_m[0]),
    }
}

fn basis<T: Scalar>() -> Basis<T> {
    let m = MOTULATOR_2_2_KW;
    Basis::try_new(&machine(), &m.rating, H).expect("valid")
}

fn machine() -> Machine<f64> {
    let m = MOTULATOR_2_2_KW;
    let mut e = Effects::scaled(&m.rating, &m.parameters(), m.pole_pairs);
    e.main_flux_saturation.excess = 0.5;
    Machine::try_new(m.parameters(), m.pole_pairs, e).expect("valid")
}

/// Once through the samples, from the state that the machine is in.
fn cost<T: Scalar + 'static, O: Observer<T> + 'static>(
    name: &str,
    observer: impl FnOnce() -> Result<O, ObserverError> + 'static,
) -> Cost {
    let precision = 8 * size_of::<T>();
    Cost::new(format!("{name}_f{precision}"), || {
        let (load, observer) = (load::<T>(), observer().expect("gains that fit"));
        let begin = observer.state_at(load.flux, load.current, load.speed);
        move || {
            let (mut state, mut sum) = (begin, T::zero());
            for input in std::hint::black_box(&load.inputs) {
                let e = observer.step(&mut state, input);
                sum += e.omega_m + e.torque_nm;
            }
            sum.value()
        }
    })
}

fn kubota_gains() -> KubotaGains {
    KubotaGains::for_machine(&machine(), &MOTULATOR_2_2_KW.rating).expect("valid")
}

/// With everything on: saturation-aware and dead time compensated.
fn kubota_full<T: Scalar>() -> Result<Kubota<T>, ObserverError> {
    let inverter = InverterNonlinearity { voltage_v: 3.0, zero_crossing_current_a: 0.1, ..Default::default() };
    Kubota::try_new(basis().with_saturation(&machine()).with_inverter(inverter)?, kubota_gains())
}

/// Cost does not depend on the numbers of the gain.
fn thau_box<T: Scalar>() -> Result<Thau<T>, ObserverError> {
    let gain = [[0.1, 20.0], [1.0, 0.1], [0.1, 1.0], [100.0, 1.0], [-1.0, 100.0]];
    let slope = gain.map(|r| r.map(|x| 1e-4 * x));
    let gains = ThauBoxGains { frame_rad_s: [60.0, 400.0], gain, gain_per_frame_speed: slope };
    Thau::in_box(basis(), gains, LoadTorqueModel::Balanced)
}

/// Every observer that is registered, with the gains one starts from.
struct Registered(Vec<Cost>);

impl<T: Scalar> Visit<T> for Registered {
    fn visit<O: Named<T> + 'static>(&mut self) {
        let made = || O::made(basis(), &machine(), &MOTULATOR_2_2_KW.rating, &StartingGains);
        self.0.push(cost::<T, O>(&O::NAME.replace('-', "_"), made));
    }
}

fn every<T: Scalar>() -> Vec<Cost> {
    let plain = || KubotaGains { gain: [[0.0; 2]; 4], gain_per_speed: [[0.0; 2]; 4], ..kubota_gains() };
    let mut all = Registered(Vec::new());
    each::<T>(&mut all);
    all.0.push(cost::<T, _>("kubota_euler", move || Kubota::discretized(basis(), plain(), Discretization::ForwardEuler)));
    all.0.push(cost::<T, _>("kubota_full", kubota_full));
    all.0.push(cost::<T, _>("thau_box", thau_box));
    all.0
}

pub fn costs() -> Vec<Cost> {
    every::<f32>().into_iter().chain(every::<f64>()).collect()
}
