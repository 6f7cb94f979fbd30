//! Runs that tests, examples and benches share: a simulated machine with the truth inside it, and observers over its recording.

use im_model::machines::NamedMachine;
use im_model::simulation::{Inverter, Load, Profile, Run, Scenario, Sensors, Simulation, Source, Start, VoltsPerHertz};
use im_model::{Complex, Held, Machine, Rating, Recording};
use im_observers::{Basis, Estimate, Input, Named, Observer, StartingGains, Visit, each};

pub type C = Complex<f64>;

/// A recording with what no sensor shows.
pub struct Truth {
    pub recording: Recording,
    pub flux: Vec<C>,
    pub omega: Vec<f64>,
    pub torque: Vec<f64>,
}

impl Truth {
    pub fn of(machine: &Machine<f64>, scenario: &Scenario) -> Self {
        Self::from_run(Simulation::new(machine, scenario).with_internals().run().expect("the scenario runs"))
    }

    pub fn from_run(run: Run) -> Self {
        let internals = run.internals.expect("internals were asked for");
        Self {
            recording: run.recording,
            flux: internals.states.iter().map(|x| x.psi_r).collect(),
            omega: internals.states.iter().map(|x| x.omega_m).collect(),
            torque: internals.torque_nm,
        }
    }

    pub fn len(&self) -> usize {
        self.omega.len()
    }

    /// Whether there are no rows.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    pub fn time_s(&self, k: usize) -> f64 {
        self.recording.time_s(k)
    }

    /// The row at a time, s.
    pub fn at(&self, t: f64) -> usize {
        (((t - self.recording.start_s) / self.recording.sample_time_s).round() as usize).min(self.len() - 1)
    }

    /// What the observer gets at row `k`.
    pub fn input(&self, k: usize) -> Input<f64> {
        let r = &self.recording;
        let u = if k > 0 { r.u_s[k - 1] } else { C::new(0.0, 0.0) };
        Input::new(u, r.i_s[k]).with_speed(r.omega_m[k])
    }

    /// An observer over the recording, from rest.
    pub fn observe<O: Observer<f64>>(&self, observer: &O) -> Vec<Estimate<f64>> {
        self.observe_from(observer, 0, O::State::default())
    }

    /// An observer from row `first` on, from a state.
    pub fn observe_from<O: Observer<f64>>(&self, observer: &O, first: usize, mut state: O::State) -> Vec<Estimate<f64>> {
        (first..self.len()).map(|k| observer.step(&mut state, &self.input(k))).collect()
    }

    /// The true state at row `k`, for an observer that starts right.
    pub fn state<O: Observer<f64>>(&self, observer: &O, k: usize) -> O::State {
        observer.state_at(self.flux[k], self.recording.i_s[k], self.omega[k])
    }

    /// Root mean square of the speed's error from row `first` of the truth, the estimates being its last rows, rad/s.
    pub fn speed_rms(&self, estimates: &[Estimate<f64>], from_s: f64) -> f64 {
        let offset = self.len() - estimates.len();
        rms((self.at(from_s)..self.len()).map(|k| estimates[k - offset].omega_m - self.omega[k]))
    }

    /// The same of the flux vector's error, Vs.
    pub fn flux_rms(&self, estimates: &[Estimate<f64>], from_s: f64) -> f64 {
        let offset = self.len() - estimates.len();
        rms((self.at(from_s)..self.len()).map(|k| (estimates[k - offset].rotor_flux_vs - self.flux[k]).norm()))
    }
}

pub fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (n, sum) = values.fold((0usize, 0.0), |(n, s), x| (n + 1, s + x * x));
    (sum / n.max(1) as f64).sqrt()
}

pub fn machine(m: &NamedMachine) -> Machine<f64> {
    Machine::base(m.parameters(), m.pole_pairs).expect("named machines are valid")
}

pub fn basis(m: &NamedMachine, sample_time_s: f64) -> Basis<f64> {
    Basis::try_new(&machine(m), &m.rating, sample_time_s).expect("named machines are valid")
}

/// Volts per hertz with a little boost: up to `hz` in half a second, a load step at 1 s.
pub fn volts_per_hertz(m: &NamedMachine, hz: f64, load_nm: f64, duration_s: f64) -> Scenario {
    let reference = Profile::points([[0.0, 0.0], [0.1, 0.0], [0.6, hz]]).expect("ordered");
    scenario(m, reference, Profile::points([[0.0, 0.0], [1.0, 0.0], [1.0, load_nm]]).expect("ordered"), duration_s)
}

/// A frequency and a load torque over time.
pub fn scenario(m: &NamedMachine, reference_hz: Profile, load_nm: Profile, duration_s: f64) -> Scenario {
    let p = m.parameters();
    // Magnetizes at standstill: R_s times the magnetizing current.
    let boost_v = p.stator_resistance_ohm * m.rating.rotor_flux_vs / p.magnetizing_inductance_h;
    let source = VoltsPerHertz {
        voltage_peak_v: m.rating.phase_voltage_peak_v,
        frequency_hz: m.rating.electrical_frequency_hz,
        boost_v,
        ramp_hz_per_s: 1e6,
    };
    Scenario {
        name: "volts per hertz".to_owned(),
        duration_s,
        sample_time_s: 1e-4,
        record_every: 1,
        source: Source::VoltsPerHertz(source, reference_hz),
        inverter: Inverter::Averaged { dc_voltage_v: None },
        load: Load { torque_nm: load_nm, quadratic_nm_s2: 0.0 },
        imposed_speed: None,
        start: Start::Rest,
        sensors: Sensors::default(),
    }
}

/// At rated flux from the beginning on, in steady state, at an imposed speed (rad/s) and slip (electrical rad/s).
pub fn held(m: &NamedMachine, speed: f64, slip: f64, duration_s: f64) -> Scenario {
    let (p, c) = (m.parameters(), m.parameters().windings().derived(m.pole_pairs));
    let (lambda, omega_e) = (m.rating.rotor_flux_vs, c.n_p * speed + slip);
    // 0 = −(η + jω_s)λ + ηL_m i,  u = R_s i + jω_e(σL_s i + (L_m/L_r)λ).
    let i = C::new(c.eta, slip) * (lambda / c.eta_l_m);
    let back = (i * c.sigma_l_s + lambda * c.beta * c.sigma_l_s) * C::new(0.0, omega_e);
    let size = (i * p.stator_resistance_ohm + back).norm();
    let hz = omega_e / (2.0 * core::f64::consts::PI);
    let source = VoltsPerHertz { voltage_peak_v: size, frequency_hz: 50.0, boost_v: size, ramp_hz_per_s: 1e6 };
    Scenario {
        source: Source::VoltsPerHertz(source, Profile::constant(hz)),
        imposed_speed: Some(Profile::constant(speed)),
        start: Start::SteadyState(Held::Speed(speed)),
        ..scenario(m, Profile::constant(hz), Profile::constant(0.0), duration_s)
    }
}

type Step = Box<dyn FnMut(&Input<f64>) -> Estimate<f64>>;

/// An observer with its state, whichever it is.
pub struct Running {
    pub name: &'static str,
    step: Step,
}

impl Running {
    pub fn new<O: Observer<f64> + 'static>(name: &'static str, observer: O, mut state: O::State) -> Self {
        Self { name, step: Box::new(move |input| observer.step(&mut state, input)) }
    }

    pub fn from_rest<O: Observer<f64> + 'static>(name: &'static str, observer: O) -> Self {
        Self::new(name, observer, O::State::default())
    }

    pub fn step(&mut self, input: &Input<f64>) -> Estimate<f64> {
        (self.step)(input)
    }

    pub fn over(mut self, truth: &Truth) -> Vec<Estimate<f64>> {
        (0..truth.len()).map(|k| self.step(&truth.input(k))).collect()
    }
}

/// Every observer that is registered, from rest, with the gains one starts from.
pub fn every_observer(machine: &Machine<f64>, rating: &Rating, basis: Basis<f64>) -> Vec<Running> {
    struct All<'a>(&'a Machine<f64>, &'a Rating, Basis<f64>, Vec<Running>);
    impl Visit<f64> for All<'_> {
        fn visit<O: Named<f64> + 'static>(&mut self) {
            let observer = O::made(self.2, self.0, self.1, &StartingGains).expect("gains that fit");
            self.3.push(Running::from_rest(O::TITLE, observer));
        }
    }
    let mut all = All(machine, rating, basis, Vec::new());
    each(&mut all);
    all.3
}
