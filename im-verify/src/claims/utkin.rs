//! The sliding-mode observer of Utkin, Guldner and Shi (Kwon et al., Section V), through the code of `im-observers`.

use im_design::DesignModel;
use im_design::sliding::{UtkinRegion, utkin};
use im_model::space_vector::{cross, unit};
use im_observers::{Basis, Discretization, Input, Observer, Utkin, UtkinGains};

use crate::claim::Origin::Extends;
use crate::claim::{C, Claim, ClaimCase, Cost, Found, Paper};
use crate::properties::{Steady, observer};
use crate::variable::Variable;
use crate::verdict::Verdict;

/// The claims.
pub const CLAIMS: &[Claim] = &[
    Claim {
        number: 14,
        name: "utkin_surface_attracts_for_omega0_large_enough",
        paper: Paper::Kwon,
        place: "Section V",
        origin: Extends("Then, Utkin, Guldner and Shi [4] propose to use as the rotor speed estimate ω̂_e = ω₀ sign(s_n)"),
        statement: "With ω̂ = ω₀ sign(s_n) a sliding mode on s_n = λ̂ × (î − i) = 0 is enforced by ω₀ large enough.",
        assumptions: "ω₀ of im-design for errors of flux and current up to given sizes, |î − i| below β|λ̂|.",
        found: Found::HoldsIf,
        finding: "Holds for the ω₀ that the errors ask for. With |î − i| ≥ β|λ̂| no ω₀ is large enough: the lever of ω̂ on s_n changes its sign.",
        cost: Cost::Run,
        variables: &[
            Variable::even("speed_share", -1.2, 1.2).simplest_at(1.0),
            Variable::even("slip_share", -1.5, 1.5).simplest_at(0.0),
            Variable::even("flux_error_share", 0.0, 0.3).simplest_at(0.0),
            Variable::angle("flux_error_angle_rad"),
            Variable::even("current_error_share", 0.02, 0.5).simplest_at(0.1),
            Variable::angle("current_error_angle_rad"),
        ],
        check: attracts,
    },
    Claim {
        number: 15,
        name: "utkin_converges_when_motoring",
        paper: Paper::Kwon,
        place: "Section V",
        origin: Extends(
            "Utkin et al. [4, page 225] were not able to provide a proof of the observation error convergence. However, they successfully tested their proposed observer in a laboratory setting.",
        ),
        statement: "Flux and speed converge when motoring.",
        assumptions: "Motoring, from 15 % of rated speed on, a slip from a tenth of rated on; from 3° of flux.",
        found: Found::HoldsIf,
        finding: "Holds in every case tried when motoring. Not when regenerating at low frequency: claim 16.",
        cost: Cost::Run,
        variables: &[
            Variable::even("speed_share", 0.15, 1.2).simplest_at(1.0),
            Variable::even("slip_share", 0.1, 1.5).simplest_at(1.0),
        ],
        check: converges,
    },
    Claim {
        number: 16,
        name: "utkin_converges_in_all_quadrants",
        paper: Paper::Kwon,
        place: "Section V",
        origin: Extends("However, they successfully tested their proposed observer in a laboratory setting."),
        statement: "The same in all quadrants, which the paper does not say.",
        assumptions: "Speeds up to 40 % of rated, any slip, with ω_e beyond 2 % of rated; from 3° of flux.",
        found: Found::Fails { rate: 0.007 },
        finding: "Fails when regenerating at low frequency, as Kubota's without feedback: in sliding both are the same zero-error dynamics.",
        cost: Cost::Run,
        variables: &[
            Variable::even("speed_share", -0.4, 0.4).simplest_at(0.4),
            Variable::even("slip_share", -1.5, 1.5).simplest_at(0.0),
        ],
        check: converges,
    },
];

/// s_n ṡ_n from a step of forward Euler, which is the rate at its beginning.
fn attracts(case: &ClaimCase) -> Verdict {
    let [speed, slip, flux_error, flux_angle, current_error, current_angle] = case.values();
    const H: f64 = 1e-6;
    let (c, r) = (case.constants(), case.rating());
    let omega = speed * case.speed();
    let truth = Steady::new(case, omega, slip * case.slip(), r.rotor_flux_vs, 0.3, H);
    let lambda_hat = truth.flux(0) + unit(flux_angle) * (flux_error * r.rotor_flux_vs);
    // A share of the lever β|λ̂|.
    let e = current_error * c.beta * lambda_hat.norm();
    let grown = 1.01;
    let region = UtkinRegion {
        speed_max_rad_s: omega.abs().max(1e-3),
        flux_min_vs: lambda_hat.norm() / grown,
        flux_error_max_vs: grown * flux_error * r.rotor_flux_vs,
        current_error_max_a: grown * e,
        current_max_a: grown * truth.current(0).norm(),
    };
    let observer =
        utkin(DesignModel::Machine(case.machine().into()), &region).map_err(|e| e.to_string()).and_then(|(design, _)| {
            let gains = UtkinGains {
                // What the current error adds to i in î is not in the design's |i|.
                omega0_rad_s: grown * design.omega0_rad_s + 1e-3,
                boundary_layer_avs: 0.0,
                filter_rad_s: 0.0,
            };
            let basis = Basis::try_new(case.machine(), r, H);
            basis.and_then(|b| Utkin::discretized(b, gains, Discretization::ForwardEuler)).map_err(|e| e.to_string())
        });
    let observer = match observer {
        Ok(observer) => observer,
        Err(e) => return Verdict::refused(e),
    };
    let start = truth.current(0) + unit(current_angle) * e;
    let mut state = observer.state_at(lambda_hat, start, omega);
    let x = observer.step(&mut state, &truth.input(1));
    let y = observer.step(&mut state, &Input::new(truth.voltage_now(1), truth.current(1)));
    let e = -x.residual_a;
    let e_rate = (x.residual_a - y.residual_a) / H - C::new(0.0, truth.omega_e) * truth.current(1);
    let flux_rate = (y.rotor_flux_vs - x.rotor_flux_vs) / H;
    let s = cross(x.rotor_flux_vs, e);
    let rate = cross(flux_rate, e) + cross(x.rotor_flux_vs, e_rate);
    // Nearer than a step's way the sign may have changed already.
    if s.abs() < 2.0 * H * rate.abs() {
        return Verdict::Outside;
    }
    let size = e_rate.norm() * x.rotor_flux_vs.norm() + flux_rate.norm() * e.norm();
    Verdict::at_most("ṡ_n sign s_n over its terms", rate * s.signum() / size, 1e-9)
}

fn converges(case: &ClaimCase) -> Verdict {
    let [speed, slip] = case.values();
    let truth = Steady::new(case, speed * case.speed(), slip * case.slip(), case.rating().rotor_flux_vs, 0.0, 1e-4);
    if truth.omega_e.abs() < 0.02 * 2.0 * core::f64::consts::PI * case.rating().electrical_frequency_hz {
        return Verdict::Outside;
    }
    let gains = UtkinGains::for_machine(case.machine(), case.rating());
    match Basis::try_new(case.machine(), case.rating(), 1e-4).and_then(|b| Utkin::try_new(b, gains)) {
        Ok(o) => observer::speed_converges(&o, &truth, 0.05, 0.0, 3.5, 0.05 * case.speed()),
        Err(e) => Verdict::refused(e),
    }
}
