//! The reference generator by itself: what its frame, its integral action and its guards do over a sample.

use crate::bench::{Bench, Point};
use im_identify::online::{
    Adaptation, Fixed, Follower, FollowerGains, FollowerState, Identifier, IdentifierStatus, RegulationParameters, Sample,
    SchemeSettings, TimeVarying,
};
use im_model::Complex;
use im_model::machines::JADOT_TABLE_I;

const H: f64 = 1e-4;
const POINT: Point = Point { omega_r: 250.0, omega_g: 7.0, flux_vs: 0.9 };

fn truth() -> RegulationParameters<f64> {
    RegulationParameters::from(JADOT_TABLE_I.parameters().inverse_gamma())
}

fn follower<A: Adaptation<f64>>(adaptation: A) -> Follower<f64, A> {
    Follower::try_new(FollowerGains::for_bandwidth(&truth(), JADOT_TABLE_I.pole_pairs, 600.0, H), adaptation).unwrap()
}

/// The bench in the steady state, and a follower's state in step with it.
fn in_step<A: Adaptation<f64>>(follower: &Follower<f64, A>) -> (Bench, FollowerState<f64, A::State>) {
    let mut bench = Bench::new(JADOT_TABLE_I.parameters(), JADOT_TABLE_I.pole_pairs, H);
    bench.settle(&POINT);
    let mut x = follower.start();
    x.phi_ref = Complex::new(POINT.flux_vs, 0.0);
    x.i_ref = bench.sample().i_s;
    // Its frame learns of the speed from two samples.
    bench.hold(2.0 * H, &POINT, |s, _| _ = follower.step(&mut x, s));
    (bench, x)
}

/// With the right parameters the steady state is kept: references stand still, the frame turns with the flux, nothing is held.
#[test]
fn the_steady_state_of_the_machine_is_that_of_the_generator() {
    let follower = follower(Fixed::try_new(truth()).unwrap());
    let (mut bench, mut x) = in_step(&follower);
    bench.hold(4.0, &POINT, |s, _| _ = follower.step(&mut x, s));
    // The machine's voltage has steps, and its current their ripple: of the order of (ω_sh)² = 7·10⁻⁴ of flux and voltage.
    let gain = FollowerGains::for_bandwidth(&truth(), 2, 600.0, H).current_proportional_ohm;
    assert!((x.phi_ref.norm() - POINT.flux_vs).abs() < 1e-3 * POINT.flux_vs, "{x:?}");
    assert!(x.eta.norm() * gain < 1e-3 * POINT.voltage(&truth()).norm(), "{x:?}");
    let measured = bench.sample().i_s * x.direction.conj();
    assert!((x.i_ref - measured).norm() < 1e-3, "{x:?} {measured}");
    for _ in 0..50 {
        let (flux, direction) = (x.phi_ref * x.direction, x.direction);
        bench.hold(H, &POINT, |s, _| _ = follower.step(&mut x, s));
        let turn = (POINT.omega_r + POINT.omega_g) * H;
        assert!((x.direction * direction.conj() - Complex::from_polar(1.0, turn)).norm() < 1e-6);
        assert!((x.phi_ref * x.direction / flux - Complex::from_polar(1.0, turn)).norm() < 1e-6);
        assert!((x.direction.norm() - 1.0).abs() < 1e-12);
    }
}

/// A direction that is too long or short by a thousandth is right after one sample, to the square of that.
#[test]
fn the_frame_stays_a_rotation() {
    let follower = follower(Fixed::try_new(truth()).unwrap());
    for off in [0.999, 1.001] {
        let (mut bench, mut x) = in_step(&follower);
        x.direction *= off;
        bench.hold(H, &POINT, |s, _| _ = follower.step(&mut x, s));
        assert!((x.direction.norm() - 1.0).abs() < 2e-6, "{}", x.direction.norm());
    }
}

/// (25): η' = K_IΔi, less ρη while an adaptation that asks for it learns, by forward Euler and never beyond nothing.
#[test]
fn the_integral_action_forgets_as_fast_as_it_is_asked_to() {
    for (leak, share) in [(0.0, 0.0), (300.0, 0.03), (1e6, 1.0)] {
        let s = SchemeSettings::full(truth().scaled([1.2, 0.9, 1.0, 1.0]), H);
        let follower = follower(TimeVarying::try_new(&s, 100.0, leak).unwrap());
        let gain = FollowerGains::for_bandwidth(&truth(), 2, 600.0, H).current_integral_per_s;
        let (mut bench, mut x) = in_step(&follower);
        bench.hold(0.1, &POINT, |s, _| _ = follower.step(&mut x, s));
        x.eta = Complex::new(0.4, -0.3);
        let before = x.eta;
        bench.hold(H, &POINT, |s, _| assert_eq!(follower.step(&mut x, s).status, IdentifierStatus::Adapting));
        let delta_i = bench.sample().i_s * x.direction.conj() - x.i_ref;
        let wanted = before * (1.0 - share) + delta_i * (gain * H);
        assert!((x.eta - wanted).norm() < 1e-12 && delta_i.norm() > 1e-4, "{leak}: {} {wanted}", x.eta);
    }
}

/// Without flux there is no direction of it, and no slip: the frame turns with the rotor. Ten pull-out slips are the most.
#[test]
fn the_slip_of_little_flux_is_bounded() {
    let follower = follower(Fixed::try_new(truth()).unwrap());
    let zero = Complex::new(0.0, 0.0);
    let turned = |x: &mut FollowerState<f64, ()>, h: f64| {
        let quiet = Sample { i_s: zero, u_s: zero, omega_m: 100.0 };
        follower.step(x, &quiet);
        let before = x.direction;
        follower.step(x, &quiet);
        (x.direction * before.conj()).arg() / h
    };
    let rotor = 100.0 * f64::from(JADOT_TABLE_I.pole_pairs);
    assert!((turned(&mut follower.start(), H) - rotor).abs() < 1e-6);
    let most = 10.0 * truth().inverse_rotor_time_constant();
    for sign in [1.0, -1.0] {
        let mut x = follower.start();
        (x.phi_ref, x.i_ref) = (Complex::new(1e-4, 0.0), Complex::new(0.0, sign * 20.0));
        let slip = turned(&mut x, H) - rotor;
        assert!((slip - sign * most).abs() < 1e-6 * most, "{slip} {most}");
    }
}
