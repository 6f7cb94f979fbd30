//! A machine held at operating points, as another drive would: speed imposed, voltage such that flux and slip settle as wanted.

use im_identify::online::{RegulationParameters, Sample};
use im_model::space_vector::unit;
use im_model::{BaseParameter, Complex, Machine, ParameterId, Plant, PlantInput, State, TParameters};

/// Where the machine runs: electrical speed and slip, rad/s, flux φ = (L_m/L_r)ψ_r, Vs.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    pub omega_r: f64,
    pub omega_g: f64,
    pub flux_vs: f64,
}

impl Point {
    /// The voltage, V, in the frame of the flux, for a machine with these parameters.
    pub fn voltage(&self, p: &RegulationParameters<f64>) -> Complex<f64> {
        let a = p.inverse_rotor_time_constant();
        let i = Complex::new(a, self.omega_g) * (self.flux_vs / p.rotor_resistance_ohm);
        let z = Complex::new(
            p.stator_resistance_ohm + p.rotor_resistance_ohm,
            (self.omega_r + self.omega_g) * p.leakage_inductance_h,
        );
        z * i - Complex::new(a, -self.omega_r) * self.flux_vs
    }
}

/// A machine on the bench.
pub struct Bench {
    plant: Plant<f64>,
    machine: Machine<f64>,
    pub state: State<f64>,
    pub truth: RegulationParameters<f64>,
    n_p: f64,
    angle: f64,
    omega_m: f64,
    u_s: Complex<f64>,
    h: f64,
}

impl Bench {
    pub fn new(p: TParameters<f64>, pole_pairs: u32, h: f64) -> Self {
        let machine = Machine::base(p, pole_pairs).unwrap();
        Self {
            plant: Plant::new(&machine),
            machine,
            state: State::default(),
            truth: p.inverse_gamma().into(),
            n_p: f64::from(pole_pairs),
            angle: 0.0,
            omega_m: 0.0,
            u_s: Complex::new(0.0, 0.0),
            h,
        }
    }

    /// The direction of the wanted flux, in which the machine's settles.
    pub fn direction(&self) -> Complex<f64> {
        unit(self.angle)
    }

    /// Straight into the steady state at a point, with the flux at angle zero.
    pub fn settle(&mut self, point: &Point) {
        let p = self.machine.parameters();
        let (l_r, l_m) = (p.rotor_inductance_h(), p.magnetizing_inductance_h);
        let i = Complex::new(self.truth.inverse_rotor_time_constant(), point.omega_g)
            * (point.flux_vs / self.truth.rotor_resistance_ohm);
        let phi = Complex::new(point.flux_vs, 0.0);
        self.angle = 0.0;
        self.omega_m = point.omega_r / self.n_p;
        self.state = State {
            psi_s: phi + i * self.truth.leakage_inductance_h,
            psi_r: phi * (l_r / l_m),
            omega_m: self.omega_m,
            ..State::default()
        };
        self.u_s = point.voltage(&self.truth) * unit(-0.5 * (point.omega_r + point.omega_g) * self.h);
    }

    /// Another resistance from now on.
    pub fn set(&mut self, resistance: BaseParameter, ohm: f64) {
        self.machine = self.machine.with(&[(ParameterId::Base(resistance), ohm)]).unwrap();
        self.plant = Plant::new(&self.machine);
        self.truth = self.machine.parameters().inverse_gamma().into();
    }

    /// What is measured now.
    pub fn sample(&self) -> Sample<f64> {
        Sample { i_s: self.plant.currents(&self.state).i_s, u_s: self.u_s, omega_m: self.omega_m }
    }

    /// One sample at (or on the way to) a point; the speed changes by at most `slew` rad/s² (electrical).
    pub fn advance(&mut self, point: &Point, slew: f64) {
        let h = self.h;
        let before = self.omega_m * self.n_p;
        let now = before + (point.omega_r - before).clamp(-slew * h, slew * h);
        let here = Point { omega_r: 0.5 * (before + now), ..*point };
        let turn = (here.omega_r + point.omega_g) * h;
        self.u_s = here.voltage(&self.truth) * unit(self.angle + 0.5 * turn);
        self.angle += turn;
        let imposed_speed = Some([self.omega_m, now / self.n_p]);
        self.state = self.plant.step(&self.state, &PlantInput { imposed_speed, ..PlantInput::new(self.u_s, 0.0) }, h);
        self.omega_m = now / self.n_p;
    }

    /// As [`advance`](Self::advance) for so long, telling every sample to `see`.
    pub fn hold(&mut self, seconds: f64, point: &Point, mut see: impl FnMut(&Sample<f64>, &Self)) {
        for _ in 0..(seconds / self.h).round() as usize {
            self.advance(point, 400.0);
            see(&self.sample(), self);
        }
    }
}

/// A machine of usual proportions from per-unit values: `r_s`, `x_leak`, `slip` in shares of the base impedance, `x_m` in multiples.
pub fn machine(base_ohm: f64, r_s: f64, r_r: f64, x_leak: f64, x_m: f64) -> TParameters<f64> {
    let x = base_ohm / 314.0;
    TParameters::from_values([r_s * base_ohm, r_r * base_ohm, x_leak * x, x_leak * x, x_m * x, 0.05, 0.0])
}
