//! A step of each identifier, on the samples of a loaded machine.

use super::Cost;
use im_identify::online::{
    Follower, FollowerGains, Identifier, KenneResistances, KenneRotorResistance, KenneSettings, Lambda, RegulationParameters,
    ResistancesSettings, Sample, SchemeSettings, TimeScale, TimeVarying, Tracking,
};
use im_model::space_vector::unit;
use im_model::{Complex, Scalar, WindingParameters, machines};

/// Sampling time, s.
const H: f64 = 1e-4;

fn complex<T: Scalar>(z: Complex<f64>) -> Complex<T> {
    Complex::new(T::from_f64(z.re), T::from_f64(z.im))
}

/// One thousand samples (five turns) of the machine of Jadot's Table I at 50 Hz, under load.
fn samples<T: Scalar>() -> Vec<Sample<T>> {
    let p = RegulationParameters::from(machines::JADOT_TABLE_I.parameters().inverse_gamma());
    let (omega_s, slip, flux) = (314.159_265_358_979_3, 8.0, 0.93);
    let a = p.inverse_rotor_time_constant();
    let i = Complex::new(a, slip) * (flux / p.rotor_resistance_ohm);
    let z = Complex::new(p.stator_resistance_ohm + p.rotor_resistance_ohm, omega_s * p.leakage_inductance_h);
    let u = z * i - Complex::new(a, slip - omega_s) * flux;
    let at = |k: f64| unit(omega_s * H * k);
    (0..1000)
        .map(|k| Sample {
            i_s: complex(i * at(f64::from(k))),
            u_s: complex(u * at(f64::from(k) - 0.5)),
            omega_m: T::from_f64((omega_s - slip) / 2.0),
        })
        .collect()
}

/// What the reference generator sees in the same state.
fn tracking<T: Scalar>() -> Vec<Tracking<T>> {
    (0..1000)
        .map(|k| {
            let ripple = unit(0.3 * f64::from(k)) * 0.02;
            Tracking {
                delta_i: complex(ripple),
                held_v: complex(Complex::new(3.0, -2.0) + ripple),
                i_ref: complex(Complex::new(6.1, 8.7)),
                i_ref_rate: complex(Complex::new(0.1, 0.0)),
                phi_ref: complex(Complex::new(0.93, 0.01)),
                omega_r: T::from_f64(306.0),
                omega_g: T::from_f64(8.0),
                lost: false,
            }
        })
        .collect()
}

fn windings<T: Scalar>() -> WindingParameters<T> {
    machines::JADOT_TABLE_I.parameters().cast::<T>().windings()
}

fn settings<T: Scalar>() -> SchemeSettings<T> {
    let p = RegulationParameters::from(machines::JADOT_TABLE_I.parameters().inverse_gamma());
    SchemeSettings::full(
        RegulationParameters::from_values(p.scaled([1.2, 0.8, 1.2, 0.8]).values().map(T::from_f64)),
        T::from_f64(H),
    )
}

/// R_r.
fn kenne<T: Scalar>() -> KenneRotorResistance<T> {
    let (w, h) = (windings::<T>(), T::from_f64(H));
    let settings = KenneSettings::for_rating(&w, 2, &machines::JADOT_TABLE_I.rating, h);
    KenneRotorResistance::try_new(&w, 2, &settings, h).expect("within bounds")
}

/// R_r and R_s.
fn kenne_both<T: Scalar>() -> KenneResistances<T> {
    let (w, h) = (windings::<T>(), T::from_f64(H));
    let settings = ResistancesSettings::for_rating(&w, 2, &machines::JADOT_TABLE_I.rating, h);
    KenneResistances::try_new(&w, 2, &settings, h).expect("within bounds")
}

/// (34).
fn time_scale<T: Scalar>() -> TimeScale<T> {
    TimeScale::try_new(&settings(), T::from_f64(TimeScale::<T>::PAPER_SHARE)).expect("within bounds")
}

/// (53).
fn reduced<T: Scalar>() -> TimeScale<T> {
    let s = settings::<T>();
    let s = SchemeSettings { ranges: s.ranges, ..SchemeSettings::reduced(s.start, s.sample_time_s) };
    TimeScale::try_new(&s, T::from_f64(TimeScale::<T>::PAPER_SHARE)).expect("within bounds")
}

/// (47).
fn time_varying<T: Scalar>() -> TimeVarying<T> {
    TimeVarying::try_new(&settings(), T::from_f64(TimeVarying::<T>::PAPER_FREQUENCY), T::from_f64(1000.0)).expect("within bounds")
}

/// A reference generator with (34) in it.
fn follower<T: Scalar>() -> Follower<T, TimeScale<T>> {
    let gains = FollowerGains {
        pole_pairs: 2,
        current_proportional_ohm: T::from_f64(7.0),
        current_integral_per_s: T::from_f64(790.0),
        lambda: Lambda::Scheduled,
        sample_time_s: T::from_f64(H),
    };
    Follower::try_new(gains, time_scale()).expect("within bounds")
}

fn cost<T: Scalar, const N: usize, I: Identifier<T, N> + 'static>(name: &str, identifier: I, inputs: Vec<I::Input>) -> Cost {
    Cost::new(name, move || {
        let mut state = identifier.start();
        move || {
            let mut last = T::zero();
            for input in &inputs {
                let e = identifier.step(&mut state, std::hint::black_box(input));
                last += e.values[0] + e.excitation.smallest;
            }
            last.value()
        }
    })
}

pub fn costs() -> Vec<Cost> {
    vec![
        cost("kenne", kenne::<f64>(), samples()),
        cost("kenne_both", kenne_both::<f64>(), samples()),
        cost("time_scale", time_scale::<f64>(), tracking()),
        cost("reduced", reduced::<f64>(), tracking()),
        cost("time_varying", time_varying::<f64>(), tracking()),
        cost("follower_time_scale", follower::<f64>(), samples()),
        cost("kenne_f32", kenne::<f32>(), samples()),
        cost("time_scale_f32", time_scale::<f32>(), tracking()),
    ]
}
