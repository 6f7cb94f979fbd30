//! Shaft compliance: the load turns on a spring.
//!
//! (1−f) J dω_m/dt = τ_e − τ_brake − τ_c,  f J dω_L/dt = τ_c − τ_L,  dφ/dt = ω_m − ω_L,
//! τ_c = K φ (1 + h K|φ|) + 2ζω_a f J (ω_m − ω_L),  K = f J ω_a².
//!
//! f is the load's share of the inertia, ω_a the antiresonance (the load swinging on a held rotor). The resonance lies at ω_a/√(1−f) as long as
//! the swing is small: couplings stiffen with the torque that they carry, by h, and then it moves with the size of the swing.

use super::{About, Card, Operating, Place, SteadyState, effect};
use crate::error::Bound;
use crate::instant::Powers;
use crate::scalar::Scalar;

effect! {
    /// Two masses on an elastic shaft or coupling; load torque acts on the far one.
    ShaftCompliance, "shaft_compliance",
    about: About { steady_state: SteadyState::Hides, resonant: true, smooth_onset: false, ..About::at(Place::Mechanics) },
    card: Card {
        title: "Shaft compliance (two masses)",
        what: "Motor and load are joined by a spring with damping: the load's share f of the inertia swings at ω_a against a held rotor; the spring may stiffen with its torque.",
        shows: "Speed rings at the torsional resonance after torque steps; acceleration above resonance is that of the motor alone.",
        rivals: &[
            ("load_torque_ripple", "its frequency follows speed; the resonance stays"),
            ("speed_sensor_lag", "smooths the speed; compliance makes it ring"),
        ],
        test: "Load or torque steps, fast against the resonance.",
        place: "shaft (adds two states)",
        source: "two-mass drive train",
    },
    parameters: {
        /// The load's share of the inertia.
        load_inertia_fraction: Strength, default 0.0, "", One, typical 0.05 to 0.9, Bound::Within(0.0, 0.99);
        /// Frequency at which the load swings on a held rotor.
        antiresonance_rad_s: Shape, default 120.0, "rad/s", One, typical 20.0 to 600.0, Bound::Within(1.0, 1e4);
        /// Damping ratio of that swing.
        damping_ratio: Shape, default 0.03, "", One, typical 0.002 to 0.2, Bound::Within(0.0, 2.0);
        /// By how much the spring stiffens per torque that it would carry unstiffened.
        hardening_per_nm: Shape, default 0.0, "1/Nm", PerTorque, typical 0.0 to 0.3, Bound::NotNegative;
    },
    states: ["omega_load_rad_s": Speed, "twist_rad": Settles],
    hooks: {
        #[inline(always)]
        fn rotor_inertia(&self, inertia: T) -> T {
            inertia * (T::one() - self.load_inertia_fraction)
        }

        #[inline(always)]
        fn shaft_torque(&self, _torque: T, at: &Operating<T>, own: &[T]) -> T {
            let &[omega_load, twist] = own else { return at.tau_load };
            self.spring_torque_nm(twist, at.parameters.inertia_kg_m2) + self.damping_nm_s_per_rad(at.parameters.inertia_kg_m2) * (at.state.omega_m() - omega_load)
        }

        #[inline(always)]
        fn load_speed(&self, _omega: T, own: &[T]) -> T {
            own[0]
        }

        #[inline(always)]
        fn load_angle(&self, theta: T, own: &[T]) -> T {
            theta - own[1]
        }

        #[inline(always)]
        fn rates(&self, rates: &mut [T], at: &Operating<T>, _powers: &Powers<T>, own: &[T]) {
            let (slide, w) = (at.state.omega_m() - own[0], self.antiresonance_rad_s);
            let spring = w * w * own[1] * self.hardened(own[1], at.parameters.inertia_kg_m2);
            let damper = (self.damping_ratio * w * slide).scale(2.0);
            rates[0] = spring + damper - at.tau_load / (self.load_inertia_fraction * at.parameters.inertia_kg_m2);
            rates[1] = slide;
            if let Some(nudging) = at.input.nudging(at.state.omega_m()) {
                rates[0] += nudging;
            }
        }

        #[inline(always)]
        fn powers(&self, powers: &mut Powers<T>, at: &Operating<T>, own: &[T]) {
            let slide = at.state.omega_m() - own[0];
            powers.shaft_damping += self.damping_nm_s_per_rad(at.parameters.inertia_kg_m2) * slide * slide;
        }

        fn stored_energy(&self, energy: T, at: &Operating<T>, own: &[T]) -> T {
            let (half, inertia) = (T::from_f64(0.5), at.parameters.inertia_kg_m2);
            let linear = self.stiffness_nm_per_rad(inertia) * own[1].abs();
            let of_hardening = T::one() + (self.hardening_per_nm * linear).scale(2.0 / 3.0);
            energy
                + half * self.load_inertia_fraction * inertia * own[0] * own[0]
                + half * linear * own[1].abs() * of_hardening
        }

        fn fastest_rate(&self, _rotor_inertia: f64) -> f64 {
            // Of small swings: how far it swings, and stiffens, is not known beforehand.
            let rigid = 1.0 - self.load_inertia_fraction.value();
            self.antiresonance_rad_s.value() / Scalar::sqrt(rigid)
        }
    }
}

impl<T: Scalar> ShaftCompliance<T> {
    /// Spring stiffness at small twist, Nm/rad, of a shaft whose total inertia is `inertia`.
    #[inline(always)]
    pub fn stiffness_nm_per_rad(&self, inertia: T) -> T {
        self.load_inertia_fraction * inertia * self.antiresonance_rad_s * self.antiresonance_rad_s
    }

    /// Torque of the spring, Nm.
    #[inline(always)]
    pub fn spring_torque_nm(&self, twist_rad: T, inertia: T) -> T {
        self.stiffness_nm_per_rad(inertia) * twist_rad * self.hardened(twist_rad, inertia)
    }

    /// By what factor it is more than that of a linear spring.
    #[inline(always)]
    fn hardened(&self, twist_rad: T, inertia: T) -> T {
        T::one() + self.hardening_per_nm * self.stiffness_nm_per_rad(inertia) * twist_rad.abs()
    }

    /// Damping, N m s/rad.
    #[inline(always)]
    pub fn damping_nm_s_per_rad(&self, inertia: T) -> T {
        (self.load_inertia_fraction * inertia * self.damping_ratio * self.antiresonance_rad_s).scale(2.0)
    }
}

#[cfg(feature = "std")]
impl super::Drawn for ShaftCompliance<f64> {
    fn frame(&self, _on: &super::Rated) -> super::Frame {
        let resonance = self.antiresonance_rad_s / core::f64::consts::TAU;
        let range = (resonance / 10.0, resonance * 10.0);
        let caption = "How much the motor's speed swings per small torque, over frequency. Dashed: a stiff shaft.";
        super::Frame { log: true, ..super::Frame::new("frequency, Hz", "speed per torque, rad/s per Nm", range, caption) }
    }

    fn law(&self, on: &super::Rated, x: f64) -> f64 {
        let (w, a) = (core::f64::consts::TAU * x, self.antiresonance_rad_s);
        let stiff = 1.0 / (on.parameters.inertia_kg_m2 * w);
        let damping = num_complex::Complex::new(0.0, 2.0 * self.damping_ratio * a * w);
        let (zeros, poles) = (a * a - w * w + damping, a * a - w * w * (1.0 - self.load_inertia_fraction) + damping);
        stiff * zeros.norm() / poles.norm()
    }
}
