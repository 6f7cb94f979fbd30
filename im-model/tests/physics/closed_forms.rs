//! Measures, guesses and angles against what they stand for.

use im_model::effects::ScaleOf;
use im_model::machines::ALL;
use im_model::simulation::{Scenario, Sensors, Simulation, VoltsPerHertz};
use im_model::space_vector::unit;
use im_model::{
    Bench, Complex, EffectId, Effects, Held, Machine, Nameplate, Plant, PlantInput, Rating, State, machines, steady_state,
};
use std::f64::consts::{PI, SQRT_2, TAU};

fn near(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance * a.abs().max(b.abs())
}

/// Held at rated speed on rated voltage, the circuit that is guessed from a nameplate draws what the plate says: shaft power and active
/// current follow from the equations the guess solves, the reactive current but for the real part of what is left for magnetizing.
#[test]
fn a_guessed_circuit_does_what_its_nameplate_says() {
    let plate = |power_w, volts, amperes, speed_rpm, cos| Nameplate {
        power_w,
        line_voltage_rms_v: volts,
        line_current_rms_a: amperes,
        speed_rpm,
        frequency_hz: 50.0,
        power_factor: cos,
        ..Nameplate::default()
    };
    for plate in [
        plate(1100.0, 400.0, 2.6, 1415.0, 0.77),
        plate(4000.0, 400.0, 8.2, 1440.0, 0.83),
        plate(15e3, 400.0, 26.5, 2930.0, 0.9),
        plate(37e3, 690.0, 40.0, 980.0, 0.85),
    ] {
        let guess = plate.guess().unwrap();
        let machine = Machine::base(guess.parameters, guess.pole_pairs).unwrap();
        let omega_m = plate.speed_rpm * PI / 30.0;
        let u = plate.line_voltage_rms_v * SQRT_2 / 3f64.sqrt();
        let x = steady_state(&machine, u, 50.0, Held::Speed(omega_m)).unwrap();
        let plant = Plant::new(&machine);
        let i = plant.currents(&x).i_s;
        let (active, reactive) = (i.re / SQRT_2, -i.im / SQRT_2);
        let cos: f64 = plate.power_factor;
        let sin = (1.0 - cos * cos).sqrt();
        assert!(near(active, plate.line_current_rms_a * cos, 0.05), "{plate:?}: {active} A active");
        assert!(near(reactive, plate.line_current_rms_a * sin, 0.05), "{plate:?}: {reactive} A reactive");
        // Shaft power: what the air gap gives, 3 |i_r|² R_r (1 − s)/s, is P.
        let torque = 1.5 * f64::from(guess.pole_pairs) * (x.psi_s.conj() * i).im;
        assert!(near(torque * omega_m, plate.power_w, 0.02), "{plate:?}: {} W", torque * omega_m);
        assert!(near(guess.rating.rotor_flux_vs, x.psi_r.norm(), 0.02), "{} {}", guess.rating.rotor_flux_vs, x.psi_r.norm());
        assert!(near(guess.rating.torque_nm, plate.power_w / omega_m, 1e-12));
        assert!(near(guess.rating.phase_voltage_peak_v, u, 1e-12) && guess.rating.electrical_frequency_hz == 50.0);
        // ½JΩ² is P for 0.14 s, friction takes half a percent, leakages are equal.
        let p = guess.parameters;
        let synchronous = TAU * 50.0 / f64::from(guess.pole_pairs);
        assert!(near(0.5 * p.inertia_kg_m2 * synchronous * synchronous, 0.14 * plate.power_w, 1e-12));
        assert!(near(p.viscous_friction_nm_s_per_rad * omega_m, 0.005 * guess.rating.torque_nm, 1e-12));
        assert_eq!(p.stator_leakage_inductance_h, p.rotor_leakage_inductance_h);
        // Locked, with a rotor resistance like the stator's it would draw four times rated current when small, six times otherwise.
        let ratio = if plate.power_w < 1500.0 { 4.0 } else { 6.0 };
        let locked = (2.0 * TAU * 50.0 * p.stator_leakage_inductance_h).hypot(2.0 * p.stator_resistance_ohm);
        assert!(near(locked, u / SQRT_2 / (ratio * plate.line_current_rms_a), 1e-9), "{plate:?}: {locked} Ω");
    }
}

/// At rated flux and torque the current is √(i_d² + i_q²): λ = L_m i_d, τ = 1.5 n_p (L_m/L_r) λ i_q.
#[test]
fn a_rating_measures_its_machine() {
    for m in ALL {
        let (p, r) = (m.parameters(), m.rating);
        let n_p = f64::from(m.pole_pairs);
        let w = p.windings();
        let i_d = r.rotor_flux_vs / w.mutual_inductance_h;
        let i_q = r.torque_nm * w.rotor_inductance_h / (1.5 * n_p * w.mutual_inductance_h * r.rotor_flux_vs);
        let i = i_d.hypot(i_q);
        let synchronous = TAU * r.electrical_frequency_hz / n_p;
        assert!(near(r.current_peak_a(&p, m.pole_pairs), i, 1e-12), "{}", m.name);
        for (scale, unit) in [
            (ScaleOf::One, 1.0),
            (ScaleOf::Voltage, r.phase_voltage_peak_v),
            (ScaleOf::Current, i),
            (ScaleOf::Flux, r.rotor_flux_vs),
            (ScaleOf::Torque, r.torque_nm),
            (ScaleOf::PerTorque, 1.0 / r.torque_nm),
            (ScaleOf::TorquePerSpeedSquared, r.torque_nm / synchronous.powi(2)),
            (ScaleOf::Conductance, i / r.phase_voltage_peak_v),
            (ScaleOf::Speed, synchronous),
            // One kelvin per watt of copper loss at rated current.
            (ScaleOf::StatorHeating, 1.0 / (1.5 * w.stator_resistance_ohm * i * i)),
            (ScaleOf::RotorHeating, 1.0 / (1.5 * p.rotor_resistance_ohm * i * i)),
        ] {
            assert!(near(r.unit_of(scale, &p, m.pole_pairs), unit, 1e-12), "{}: {scale:?}", m.name);
        }
    }
    // Nothing given: of the size that the inertia tells, whatever the voltage.
    for m in [machines::KENNE_APPENDIX_II, machines::JADOT_TABLE_I, machines::MOTULATOR_2_2_KW] {
        let r = Rating::guess(&m.parameters(), m.pole_pairs);
        let [torque, flux] = [r.torque_nm / m.rating.torque_nm, r.rotor_flux_vs / m.rating.rotor_flux_vs];
        assert!((0.4..2.5).contains(&torque) && (0.5..2.0).contains(&flux), "{}: {torque} {flux}", m.name);
        // The flux makes the torque at a slip of 4 %: τ = 1.5 n_p λ²ω_s/R_r.
        let slip = 0.04 * TAU * 50.0;
        let made = 1.5 * f64::from(m.pole_pairs) * r.rotor_flux_vs * r.rotor_flux_vs * slip / m.parameters().rotor_resistance_ohm;
        assert!(near(r.torque_nm, made, 1e-12), "{}", m.name);
    }
}

/// The voltage of a sample points where the field is in its middle: the angle is the integral of 2πf, for any ramp and either direction.
#[test]
fn volts_per_hertz_turns_by_the_integral_of_its_frequency() {
    let v = VoltsPerHertz { voltage_peak_v: 320.0, frequency_hz: 50.0, boost_v: 20.0, ramp_hz_per_s: 80.0 };
    let (mut state, mut angle, mut frequency, t) = ([0.0, 0.0], 0.0, 0.0f64, 1e-3);
    for k in 0..3000 {
        let wanted: f64 = if k < 1500 { 60.0 } else { -40.0 };
        let u = v.step(&mut state, wanted, t);
        frequency = wanted.clamp(frequency - 0.08, frequency + 0.08);
        let size = 20.0 + 300.0 * (frequency.abs() / 50.0).min(1.0);
        let expected = unit(angle + PI * frequency * t) * size;
        assert!((u - expected).norm() < 1e-6 * size, "{k}: {u} {expected}");
        angle += TAU * frequency * t;
    }
}

/// Noise on the recorded load torque has its own stream, mean zero and its deviation.
#[test]
fn the_recorded_load_torque_is_noisy_by_what_is_asked() {
    let machine = Machine::base(machines::MOTULATOR_2_2_KW.parameters(), 2).unwrap();
    let recorded = |torque_noise_nm: f64| {
        let s = Scenario {
            sensors: Sensors { torque_noise_nm, seed: 3, ..Sensors::default() },
            ..Scenario::direct_on_line(320.0, 50.0, 1.0)
        };
        Simulation::new(&machine, &s).run().unwrap().recording
    };
    let (clean, noisy) = (recorded(0.0), recorded(0.5));
    assert_eq!((&clean.i_s, &clean.omega_m), (&noisy.i_s, &noisy.omega_m), "other channels stay as they were");
    let off: Vec<f64> = noisy.tau_load.unwrap().iter().zip(clean.tau_load.unwrap()).map(|(a, b)| a - b).collect();
    let n = off.len() as f64;
    let (mean, square) = (off.iter().sum::<f64>() / n, off.iter().map(|x| x * x).sum::<f64>() / n);
    // Five standard errors.
    assert!(mean.abs() < 5.0 * 0.5 / n.sqrt() && near(square, 0.25, 5.0 * (2.0 / n).sqrt()), "{mean} {square}");
}

/// At standstill the linear machine has the poles of s² + (γ + η)s + R_sη/σL_s = 0: a sample is cut so that the faster one is resolved, and not finer
/// than by a third.
#[test]
fn the_fastest_rate_is_that_of_the_leakages_at_standstill() {
    for m in ALL {
        let p = m.parameters();
        let c = p.windings().derived(m.pole_pairs);
        let (sum, product) = (c.gamma + c.eta, p.stator_resistance_ohm * c.eta / c.sigma_l_s);
        let pole = 0.5 * (sum + (sum * sum - 4.0 * product).sqrt());
        let rate = Plant::new(&Machine::base(p, m.pole_pairs).unwrap()).fastest_rate();
        assert!((0.8..1.33).contains(&(rate / pole)), "{}: {rate} {pole}", m.name);
    }
}

/// A friction that changes sign within a small speed, bars, iron and a shaft have rates of their own; the fastest is the machine's.
#[test]
fn the_fastest_rate_knows_the_effects() {
    let m = machines::MOTULATOR_2_2_KW;
    let p = m.parameters();
    let rate = |set: &dyn Fn(&mut Effects<f64>)| {
        let mut e = Effects::none();
        set(&mut e);
        Plant::new(&Machine::try_new(p, m.pole_pairs, e).unwrap()).fastest_rate()
    };
    let leakage = p.stator_leakage_inductance_h + p.rotor_leakage_inductance_h;
    let (r_s, r_r) = (p.stator_resistance_ohm, p.rotor_resistance_ohm);
    assert!(near(rate(&|_| ()), (r_s + r_r) / leakage, 1e-12));
    let friction = rate(&|e| {
        (e.coulomb_friction.torque_nm, e.coulomb_friction.stribeck_rise, e.coulomb_friction.smoothing_speed_rad_s) =
            (2.0, 0.5, 0.1);
    });
    assert!(near(friction, 2.0 * 1.5 / 0.1 / p.inertia_kg_m2, 1e-12), "{friction}");
    // The voltage of dead time over the current in which it changes sign is a resistance.
    let bridge = rate(&|e| {
        (e.inverter_nonlinearity.voltage_v, e.inverter_nonlinearity.zero_crossing_current_a) = (6.0, 0.2);
    });
    assert!(near(bridge, (r_s + r_r + 30.0) / leakage, 1e-12), "{bridge}");
    let iron = rate(&|e| (e.iron_loss.conductance_s, e.iron_loss.diffusion_time_s) = (1e-3, 2e-5));
    // A lag is followed, not resolved.
    assert!(near(iron, 0.4 * 5e4, 1e-12), "{iron}");
    let bars = rate(&|e| (e.rotor_skin_effect.resistance_rise, e.rotor_skin_effect.time_constant_s) = (0.4, 1e-4));
    assert!(near(bars, 1e4, 1e-12), "{bars}");
    let bars = rate(&|e| (e.rotor_skin_effect.resistance_rise, e.rotor_skin_effect.time_constant_s) = (0.4, 1.0));
    assert!(near(bars, (r_s + 1.4 * r_r) / leakage, 1e-12), "{bars}");
    let shaft = rate(&|e| (e.shaft_compliance.load_inertia_fraction, e.shaft_compliance.antiresonance_rad_s) = (0.36, 4000.0));
    assert!(near(shaft, 4000.0 / 0.8, 1e-12), "{shaft}");
}

/// At an imposed speed that goes from a to b the shaft turns by (a + b)T/2, in however many steps a sample is taken, and ends at b.
#[test]
fn an_imposed_ramp_turns_the_shaft_by_its_mean() {
    let machine = Machine::base(machines::MOTULATOR_2_2_KW.parameters(), 2).unwrap();
    for steps in [1, 4, 7] {
        let mut bench = Bench::new(&machine, State::default(), 2e-4).with_substeps(steps);
        for k in 0..5 {
            let [a, b] = [100.0 + 8.0 * f64::from(k), 108.0 + 8.0 * f64::from(k)];
            let before = bench.state().theta_m;
            bench.advance(&PlantInput { imposed_speed: Some([a, b]), ..PlantInput::new(Complex::new(0.0, 0.0), 0.0) });
            assert!(
                near(bench.state().theta_m - before, 0.5 * (a + b) * 2e-4, 1e-9),
                "{steps}: {}",
                bench.state().theta_m - before
            );
            assert_eq!(bench.state().omega_m, b);
        }
    }
}

/// Steps divide a sample: more of them give the same machine, to the fourth power of their length.
#[test]
fn a_sample_is_as_long_in_any_number_of_steps() {
    let machine = Machine::base(machines::MOTULATOR_2_2_KW.parameters(), 2).unwrap();
    let after = |steps: u32| {
        let mut bench = Bench::new(&machine, State::default(), 2e-4).with_substeps(steps);
        for k in 0..200 {
            bench.advance(&PlantInput::new(unit(0.06 * f64::from(k)) * 300.0, 1.0));
        }
        *bench.state()
    };
    let (coarse, fine) = (after(3), after(12));
    assert!((coarse.psi_s - fine.psi_s).norm() < 1e-6 && near(coarse.omega_m, fine.omega_m, 1e-6), "{coarse:?} {fine:?}");
}

/// A command that comes (n + f)T late acts with 1 − f of it n samples later, and with f one later still: dψ_s/dt = u but for R_s i.
#[test]
fn a_late_command_acts_in_its_shares() {
    let m = machines::MOTULATOR_2_2_KW;
    for delay in [0.3, 1.0, 1.75, 2.5] {
        let mut e = Effects::none();
        e.voltage_delay.delay_s = delay * 1e-4;
        let machine = Machine::try_new(m.parameters(), m.pole_pairs, e).unwrap();
        let mut bench = Bench::new(&machine, State::default(), 1e-4);
        let commands: Vec<Complex<f64>> = (1..8).map(|k| unit(1.3 * f64::from(k)) * 100.0 * f64::from(k)).collect();
        let command = |k: i32| usize::try_from(k).ok().and_then(|k| commands.get(k).copied()).unwrap_or_default();
        let (n, f) = (delay.floor() as i32, delay.fract());
        for k in 0..7 {
            let before = bench.state().psi_s;
            let i = bench.output().i_s;
            bench.advance(&PlantInput::new(command(k), 0.0));
            let mean = (i + bench.output().i_s) / 2.0;
            let seen = (bench.state().psi_s - before) / 1e-4 + mean * m.parameters().stator_resistance_ohm;
            let expected = command(k - n) * (1.0 - f) + command(k - n - 1) * f;
            // The trapezoidal mean of the current leaves little.
            assert!((seen - expected).norm() < 0.2, "{delay} {k}: {seen} {expected}");
        }
    }
}

/// k₀ … k₇ of Kenné et al. (after (19)) in the constants of Kwon et al.: two papers, one machine.
#[test]
fn the_constants_of_both_papers_belong_to_one_machine() {
    for m in ALL {
        let w = m.parameters().windings();
        let (c, k) = (w.derived(m.pole_pairs), w.kenne(m.pole_pairs));
        let (m_big, l_r, r_s) = (w.mutual_inductance_h, w.rotor_inductance_h, w.stator_resistance_ohm);
        let per_torque = w.inertia_kg_m2 * c.mu;
        let expected = [
            c.sigma_l_s / per_torque,
            c.beta,
            r_s * m_big / c.sigma_l_s,
            m_big * w.stator_inductance_h / (l_r * c.sigma_l_s),
            m_big * m_big / l_r,
            c.beta * m_big / l_r,
            c.n_p * m_big / per_torque,
            c.sigma_l_s / m_big,
        ];
        assert!(near(k.mu, c.mu, 1e-12) && near(c.mu, 1.5 * c.n_p * m_big / (w.inertia_kg_m2 * l_r), 1e-12));
        assert!(k.k.iter().zip(expected).all(|(a, b)| near(*a, b, 1e-12)), "{}: {:?} {expected:?}", m.name, k.k);
        // γ of Kwon = (R_s + R_r M²/L_r²)/σL_s, η M = R_r M/L_r.
        let r_r = w.rotor_resistance_ohm;
        assert!(
            near(c.gamma, (r_s + r_r * (m_big / l_r).powi(2)) / c.sigma_l_s, 1e-12) && near(c.eta_l_m, r_r * m_big / l_r, 1e-12)
        );
        assert!(near(c.sigma_l_s, w.stator_inductance_h - m_big * m_big / l_r, 1e-9) && near(c.eta, r_r / l_r, 1e-12));
    }
}

/// Every named machine says where its numbers come from, and no two say the same.
#[test]
fn named_machines_are_distinguished() {
    for (k, a) in ALL.iter().enumerate() {
        assert!(!a.source.is_empty() && ALL[..k].iter().all(|b| a.name != b.name && a.source != b.source), "{}", a.name);
    }
}

/// A coupling stiffens with the torque that it carries, and stores ∫τ dφ; what the load adds at its angle is there where the load is, behind the twist.
#[test]
fn a_soft_shaft_hardens_and_the_load_ripples_behind_it() {
    let named = &machines::MOTULATOR_2_2_KW;
    let (p, [f, w, h, ripple, order]) = (named.parameters(), [0.4, 120.0, 0.02, 1.5, 2.0]);
    let mut e = Effects::default();
    let s = &mut e.shaft_compliance;
    (s.load_inertia_fraction, s.antiresonance_rad_s, s.damping_ratio, s.hardening_per_nm) = (f, w, 0.0, h);
    (e.load_torque_ripple.sine_nm, e.load_torque_ripple.order) = (ripple, order);
    let plant = Plant::new(&Machine::try_new(p, named.pole_pairs, e).unwrap());
    let (stiffness, far) = (f * p.inertia_kg_m2 * w * w, f * p.inertia_kg_m2);
    let at = |twist: f64| {
        let mut x = State { theta_m: 0.7, ..State::default() };
        x.extra.of_mut(EffectId::ShaftCompliance)[1] = twist;
        (plant.evaluate(&x, &PlantInput::new(Complex::new(0.0, 0.0), 5.0)), plant.stored_energy(&x))
    };
    let spring = |twist: f64| stiffness * twist * (1.0 + h * stiffness * twist.abs());
    for twist in [-0.3, -0.01, 0.02, 0.4] {
        let (now, stored) = at(twist);
        let load = 5.0 + ripple * (order * (0.7 - twist)).sin();
        assert!(near(now.rates.omega_m, -spring(twist) / (p.inertia_kg_m2 - far), 1e-9), "{twist}");
        assert!(near(now.rates.extra.of(EffectId::ShaftCompliance)[0], (spring(twist) - load) / far, 1e-9), "{twist}");
        let work: f64 = (0..1000).map(|k| spring(twist * (f64::from(k) + 0.5) / 1000.0) * twist / 1000.0).sum();
        assert!(near(stored - at(0.0).1, work, 1e-5), "{stored} {work}");
    }
}
