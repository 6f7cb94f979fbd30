//! The observers whose steps are timed: shared by the benchmark and by the example that instruction counts are taken from.
#![allow(dead_code, missing_docs)]

use im_model::machines::MOTULATOR_2_2_KW;
use im_model::simulation::{Scenario, Simulation, Start};
use im_model::{Complex, Effects, Held, Machine, Scalar, effects::InverterNonlinearity};
use im_observers::*;

const H: f64 = 1e-4;

/// A thousand samples of the loaded machine, and the state it is in before them.
pub struct Load<T> {
    pub inputs: Vec<Input<T>>,
    flux: Complex<T>,
    current: Complex<T>,
    speed: T,
}

pub fn load<T: Scalar>() -> Load<T> {
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

/// A case: an observer with its state at the beginning of the samples.
pub struct BenchCase<T: Scalar, O: Observer<T>> {
    pub observer: O,
    pub state: O::State,
    pub checksum: core::marker::PhantomData<T>,
}

impl<T: Scalar, O: Observer<T>> BenchCase<T, O> {
    fn new(observer: O, load: &Load<T>) -> Self {
        let state = observer.state_at(load.flux, load.current, load.speed);
        Self { observer, state, checksum: core::marker::PhantomData }
    }

    /// Once through the samples.
    pub fn run(&self, inputs: &[Input<T>]) -> T {
        let mut state = self.state;
        let mut sum = T::zero();
        for input in inputs {
            let e = self.observer.step(&mut state, input);
            sum += e.omega_m + e.torque_nm;
        }
        sum
    }
}

pub fn basis<T: Scalar>() -> Basis<T> {
    let m = MOTULATOR_2_2_KW;
    Basis::try_new(&machine(), &m.rating, H).expect("valid")
}

fn machine() -> Machine<f64> {
    let m = MOTULATOR_2_2_KW;
    let mut e = Effects::scaled(&m.rating, &m.parameters(), m.pole_pairs);
    e.main_flux_saturation.excess = 0.5;
    Machine::try_new(m.parameters(), m.pole_pairs, e).expect("valid")
}

pub fn current_model<T: Scalar>(l: &Load<T>) -> BenchCase<T, CurrentModel<T>> {
    BenchCase::new(CurrentModel::new(basis()), l)
}

fn kubota_gains() -> KubotaGains {
    KubotaGains::for_machine(&machine(), &MOTULATOR_2_2_KW.rating).expect("valid")
}

pub fn kubota<T: Scalar>(l: &Load<T>) -> BenchCase<T, Kubota<T>> {
    BenchCase::new(Kubota::try_new(basis(), kubota_gains()).expect("fits"), l)
}

pub fn kubota_euler<T: Scalar>(l: &Load<T>) -> BenchCase<T, Kubota<T>> {
    let gains = KubotaGains { gain: [[0.0; 2]; 4], gain_per_speed: [[0.0; 2]; 4], ..kubota_gains() };
    BenchCase::new(Kubota::discretized(basis(), gains, Discretization::ForwardEuler).expect("fits"), l)
}

/// With everything on: saturation-aware and dead time compensated.
pub fn kubota_full<T: Scalar>(l: &Load<T>) -> BenchCase<T, Kubota<T>> {
    let inverter = InverterNonlinearity { voltage_v: 3.0, zero_crossing_current_a: 0.1 };
    let basis = basis().with_saturation(&machine()).with_inverter(inverter).expect("valid");
    BenchCase::new(Kubota::try_new(basis, kubota_gains()).expect("fits"), l)
}

pub fn derdiyok<T: Scalar>(l: &Load<T>) -> BenchCase<T, Derdiyok<T>> {
    let gains = DerdiyokGains::for_machine(&machine(), &MOTULATOR_2_2_KW.rating);
    BenchCase::new(Derdiyok::try_new(basis(), gains).expect("fits"), l)
}

pub fn utkin<T: Scalar>(l: &Load<T>) -> BenchCase<T, Utkin<T>> {
    BenchCase::new(Utkin::try_new(basis(), UtkinGains::for_machine(&machine(), &MOTULATOR_2_2_KW.rating)).expect("fits"), l)
}

pub fn thau<T: Scalar>(l: &Load<T>) -> BenchCase<T, Thau<T>> {
    BenchCase::new(Thau::try_new(basis(), ThauGains::published(), LoadTorqueModel::EqualToTorque).expect("fits"), l)
}

/// Cost does not depend on the numbers of the gain.
pub fn thau_box<T: Scalar>(l: &Load<T>) -> BenchCase<T, Thau<T>> {
    let gain = [[0.1, 20.0], [1.0, 0.1], [0.1, 1.0], [100.0, 1.0], [-1.0, 100.0]];
    let slope = gain.map(|r| r.map(|x| 1e-4 * x));
    let gains = ThauBoxGains { frame_rad_s: [60.0, 400.0], gain, gain_per_frame_speed: slope };
    BenchCase::new(Thau::in_box(basis(), gains, LoadTorqueModel::Balanced).expect("fits"), l)
}
