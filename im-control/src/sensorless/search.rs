//! Speed and flux of a machine that turns, from the emf at zero current; no sensor of speed.
//!
//! Without stator current ψ_R = ψ_0 e^{at}, a = jω_e − 1/T_r. Its change is what the voltage integrates to, Ψ = ∫(u − R_σ i − L_σ i')dt = ψ_0(e^{at} − 1), free of the noise that
//! the emf itself has. Then Ψ = a∫Ψ dt + (aψ_0)t: a and aψ_0 follow by least squares from five sums (algebraic identification), at any speed and direction;
//! ψ_0 with the T_r that is known.

use im_model::simulation::{Command, Measured};
use im_model::space_vector::norm2;
use im_model::{Complex, Scalar};

use crate::DriveLimits;
use crate::current_regulator::CurrentRegulator;
use crate::error::ControlError;
use crate::guard;
use crate::machine_data::MachineData;
use crate::vector::{is_finite, norm, shortened, within_hexagon};

/// How long the current is held at zero, s, and the fewest samples.
const SEARCH_S: f64 = 0.02;
const SAMPLES_MIN: u32 = 24;
/// Flux below this share of the largest is none.
const FLUX_SHARE: f64 = 0.05;
/// How much of the emf seen in a sample is taken over for the next command.
const TAKEN: f64 = 0.3;

/// What was found: no flux where there is too little to tell the speed by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Found<T> {
    /// Rotor flux linkage now, stator frame, Vs.
    pub rotor_flux_vs: Complex<T>,
    /// Mechanical speed, rad/s.
    pub omega_m: T,
}

/// Holds the current at zero and watches.
#[derive(Clone, Copy, Debug)]
pub(super) struct EmfSearch<T> {
    regulator: CurrentRegulator<T>,
    k_r: T,
    inverse_rotor_time_constant: T,
    pole_pairs: T,
    sample_time_s: T,
    flux_min_vs: T,
    speed_max_rad_s: T,
    voltage_max_v: T,
    current_max_a: T,
    samples: u32,
    currents: bool,
    state: Search<T>,
}

#[derive(Clone, Copy, Debug)]
struct Search<T> {
    seen: u32,
    /// Whether the first sample is known.
    begun: bool,
    i_before: Complex<T>,
    emf: Complex<T>,
    /// Ψ, Vs, and ΣΨ as the integral, in samples.
    change: Complex<T>,
    area: Complex<T>,
    /// Σ|I|², ΣtI, Σt², ΣΨI*, ΣΨt.
    area2: T,
    area_time: Complex<T>,
    time2: T,
    change_area: Complex<T>,
    change_time: Complex<T>,
    command: Complex<T>,
}

impl<T: Scalar> Search<T> {
    fn new() -> Self {
        let (o, z) = (T::zero(), Complex::new(T::zero(), T::zero()));
        Self {
            seen: 0,
            begun: false,
            i_before: z,
            emf: z,
            change: z,
            area: z,
            area2: o,
            area_time: z,
            time2: o,
            change_area: z,
            change_time: z,
            command: z,
        }
    }

    /// A sample of the emf (as Vs over the sample).
    fn take(&mut self, step: Complex<T>) {
        let half = T::from_f64(0.5);
        let before = self.change;
        self.change += step;
        self.area += (before + self.change) * half;
        self.seen += 1;
        let t = T::from_f64(f64::from(self.seen));
        self.area2 += norm2(self.area);
        self.area_time += self.area * t;
        self.time2 += t * t;
        self.change_area += self.change * self.area.conj();
        self.change_time += self.change * t;
    }

    /// a and c = aψ_0 (per sample), from the normal equations ΣΨI* = aΣ|I|² + cΣtI*, ΣΨt = aΣtI + cΣt².
    fn solve(&self) -> Option<[Complex<T>; 2]> {
        let determinant = self.area2 * self.time2 - norm2(self.area_time);
        // Not so where it is no number.
        let is_regular = determinant > self.area2 * self.time2 * T::from_f64(1e-4);
        is_regular.then(|| {
            let inverse = T::one() / determinant;
            let a = (self.change_area * self.time2 - self.change_time * self.area_time.conj()) * inverse;
            let c = (self.change_time * self.area2 - self.change_area * self.area_time) * inverse;
            [a, c]
        })
    }
}

impl<T: Scalar> EmfSearch<T> {
    pub fn try_new(machine: &MachineData<T>, limits: &DriveLimits<T>, sample_time_s: T) -> Result<Self, ControlError> {
        machine.validate()?;
        limits.validate()?;
        guard::check_sample_time("sample_time_s", sample_time_s)?;
        let w = &machine.windings;
        let k_r = w.mutual_inductance_h / w.rotor_inductance_h;
        Ok(Self {
            regulator: CurrentRegulator::of(machine, sample_time_s),
            k_r,
            inverse_rotor_time_constant: w.rotor_resistance_ohm / w.rotor_inductance_h,
            pole_pairs: machine.n_p(),
            sample_time_s,
            flux_min_vs: limits.rotor_flux_max_vs * k_r * T::from_f64(FLUX_SHARE),
            speed_max_rad_s: limits.speed_max_rad_s,
            voltage_max_v: limits.voltage_max_v,
            current_max_a: machine.current_max_a,
            samples: ((SEARCH_S / sample_time_s.value()) as u32).max(SAMPLES_MIN),
            currents: false,
            state: Search::new(),
        })
    }

    pub fn tracking_currents(self) -> Self {
        Self { currents: true, ..self }
    }

    pub fn sample_time_s(&self) -> T {
        self.sample_time_s
    }

    pub fn restart(&mut self) {
        self.state = Search::new();
    }

    /// A sample: the command for the next, and at the end what was found. `u_s` is the mean voltage at the machine over the sample that ended. A sample that
    /// cannot be computed with begins the search anew, at zero voltage.
    pub fn step(&mut self, m: &Measured<T>, u_s: Complex<T>) -> (Command<T>, Option<Found<T>>) {
        let z = Complex::new(T::zero(), T::zero());
        let usable = guard::is_usable(&Measured { omega_m: T::zero(), u_s, ..*m }, self.current_max_a);
        if !usable {
            self.restart();
            return (self.command(z), None);
        }
        if !self.state.begun {
            (self.state.begun, self.state.i_before) = (true, m.i_s);
            return (self.command(z), None);
        }
        let (t, g, s) = (m.sample_time_s, &self.regulator, &mut self.state);
        let mean = (s.i_before + m.i_s) * T::from_f64(0.5);
        let step = (u_s - mean * g.resistance_ohm) * t - (m.i_s - s.i_before) * g.leakage_inductance_h;
        s.i_before = m.i_s;
        s.take(step);
        // The first sample tells it whole: what is not countered by then drives the current up.
        let taken = if s.seen == 1 { T::one() } else { T::from_f64(TAKEN) };
        s.emf += (step * (T::one() / t) - s.emf) * taken;
        let wanted = s.emf - m.i_s * (g.bandwidth_rad_s * g.leakage_inductance_h);
        let made = within_hexagon(shortened(wanted, self.voltage_max_v), m.dc_voltage_v);
        if !is_finite(made) {
            self.restart();
            return (self.command(z), None);
        }
        s.command = made;
        if made != wanted {
            // More emf than the link can hold: the current is what it is until the flux has decayed.
            let (emf, i_before) = (s.emf, s.i_before);
            *s = Search { begun: true, emf, i_before, command: made, ..Search::new() };
        }
        let found = (self.state.seen >= self.samples).then(|| self.found());
        (self.command(made), found)
    }

    fn command(&self, u: Complex<T>) -> Command<T> {
        if self.currents { Command::Current(Complex::new(T::zero(), T::zero())) } else { Command::Voltage(u) }
    }

    fn found(&self) -> Found<T> {
        let none = Found { rotor_flux_vs: Complex::new(T::zero(), T::zero()), omega_m: T::zero() };
        let Some([a, c]) = self.state.solve() else { return none };
        // Of a only the frequency is taken: the decay is known better than it is seen.
        let rate = Complex::new(-self.inverse_rotor_time_constant * self.sample_time_s, a.im);
        let psi = c * rate.conj() * (T::one() / norm2(rate)) + self.state.change;
        let omega_m = a.im / (self.sample_time_s * self.pole_pairs);
        if norm(psi) >= self.flux_min_vs && omega_m.abs() <= self.speed_max_rad_s && is_finite(psi) {
            Found { rotor_flux_vs: psi * (T::one() / self.k_r), omega_m }
        } else {
            none
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use im_model::space_vector::unit;
    use im_model::{Bench, Machine, PlantInput, State, machines};

    /// A machine that turns with flux, left alone until now: what is found of it, and the largest current.
    fn found(speed: f64, flux: f64, delay_s: f64, noise_a: f64) -> (Found<f64>, Complex<f64>, f64) {
        let m = machines::JADOT_TABLE_I;
        let machine = Machine::base(m.parameters(), m.pole_pairs).unwrap();
        let data = MachineData::of(&machine, 25.0).delayed(delay_s);
        let limits = DriveLimits::generous(&data, 157.0, 0.9);
        let mut search = EmfSearch::try_new(&data, &limits, 1e-4).unwrap();
        let psi = unit(0.7) * flux;
        let c = machine.parameters().windings();
        let start = State { psi_r: psi, psi_s: psi * (c.mutual_inductance_h / c.rotor_inductance_h), ..State::turning(speed) };
        let mut bench = Bench::new(&machine, start, 1e-4);
        let (mut past, mut largest, mut seed) = ([Complex::new(0.0, 0.0); 2], 0.0f64, 1u32);
        let mut noise = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            noise_a * (f64::from(seed >> 8) / f64::from(1 << 23) - 1.0)
        };
        for _ in 0..1000 {
            let shown = bench.output().i_s;
            largest = largest.max(shown.norm());
            let i_s = shown + Complex::new(noise(), noise());
            let acted = past[usize::from(delay_s > 0.0)];
            let m = Measured { i_s, omega_m: f64::NAN, u_s: past[0], dc_voltage_v: 560.0, sample_time_s: 1e-4 };
            let (Command::Voltage(u), end) = search.step(&m, acted) else { panic!() };
            if let Some(found) = end {
                return (found, bench.state().psi_r, largest);
            }
            let now = if delay_s > 0.0 { past[0] } else { u };
            past = [u, past[0]];
            bench.advance(&PlantInput { imposed_speed: Some([speed; 2]), ..PlantInput::new(now, 0.0) });
        }
        panic!("it never ends");
    }

    #[test]
    fn speed_and_flux_are_found_in_either_direction() {
        for speed in [150.0, 60.0, 15.0, 0.0, -30.0, -150.0] {
            for (delay_s, noise_a) in [(0.0, 0.0), (1e-4, 0.05)] {
                let (f, psi, largest) = found(speed, 0.8, delay_s, noise_a);
                assert!((f.omega_m - speed).abs() < 0.02 * speed.abs() + 1.5, "{speed} {noise_a}: {f:?}");
                // At standstill half a rad/s of the frequency beside 1/T_r = 5.5 1/s is a tenth of the flux.
                assert!((f.rotor_flux_vs - psi).norm() < 0.08, "{speed}: {f:?} {psi}");
                // e(T + delay)/L_σ until the emf is known, and as much until the field has been followed.
                let rise = 2.0 * speed.abs() * 0.8 * (1e-4 + delay_s) / 0.0079;
                assert!(largest < 3.0 * rise + 1.0, "{speed} {delay_s}: {largest} A of {rise}");
            }
        }
    }

    #[test]
    fn without_flux_nothing_is_found() {
        for speed in [0.0, 120.0] {
            let (f, ..) = found(speed, 0.0, 0.0, 0.05);
            assert_eq!((f.omega_m, f.rotor_flux_vs.norm()), (0.0, 0.0));
        }
    }
}
