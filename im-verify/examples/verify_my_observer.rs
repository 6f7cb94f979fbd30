//! A flux observer of one's own, put through the properties that the published ones are put through:
//!
//!     cargo run --release -p im-verify --example verify_my_observer -- margins.svg

use im_design::plot::{Series, chart};
use im_model::{Complex, Shard};
use im_observers::{Basis, CurrentModel, Estimate, Input, Observer};
use im_verify::properties::{Steady, observer};
use im_verify::{C, Claim, ClaimCase, Cost, Found, Machines, Origin, Paper, Row, Variable, Verdict};

/// The current model, with a low-pass on the speed that it is shown: does it still converge at η?
struct Mine(CurrentModel<f64>);

impl Observer<f64> for Mine {
    type State = (<CurrentModel<f64> as Observer<f64>>::State, f64);

    fn state_at(&self, flux: Complex<f64>, current: Complex<f64>, omega_m: f64) -> Self::State {
        (self.0.state_at(flux, current, omega_m), omega_m)
    }

    fn step(&self, (state, speed): &mut Self::State, input: &Input<f64>) -> Estimate<f64> {
        *speed += 0.05 * (input.omega_m.unwrap_or(*speed) - *speed);
        self.0.step(state, &input.with_speed(*speed))
    }
}

const VARIABLES: [Variable; 3] =
    [Variable::even("speed_share", -1.0, 1.0), Variable::even("flux_error_share", 0.02, 0.3), Variable::angle("angle_rad")];

fn check(case: &ClaimCase) -> Verdict {
    let [speed, error, angle] = case.values();
    let flux = case.rating().rotor_flux_vs;
    let mine = Mine(CurrentModel::new(Basis::try_new(case.machine(), case.rating(), 1e-4).expect("100 µs is in range")));
    let truth = Steady::new(case, speed * case.speed(), case.slip(), flux, 0.0, 1e-4);
    observer::flux_error_decays(&mine, &truth, C::from_polar(error * flux, angle), 0.99 * case.constants().eta, 0.3, 2e-3 * flux)
        .and(observer::survives_bad_samples(&mine, &truth, &[Input::lost(C::new(0.0, 0.0))], 0.5, 0.01 * case.speed()))
}

fn main() -> std::io::Result<()> {
    let claim = Claim {
        number: 1,
        name: "my_flux_error_decays_at_eta",
        paper: Paper::Kenne,
        place: "my notes",
        origin: Origin::Says("the flux error decays at the rotor rate"),
        statement: "The flux error decays at R_r/L_r, and a lost sample does no harm.",
        assumptions: "Constant speed, rated slip.",
        found: Found::Holds,
        finding: "",
        cost: Cost::Run,
        variables: &VARIABLES,
        check,
    };
    let campaign =
        im_verify::Campaign { claims: vec![claim], machines: Machines::Random, cases: None, seed: 1, shard: Shard::WHOLE };
    let mut blocks = Vec::new();
    let done: Result<(), ()> = campaign.run(&[], |block| {
        blocks.push(block.clone());
        Ok(())
    });
    done.expect("keeping a block cannot fail");
    println!("{:#?}", Row::of(&claim, &campaign, &blocks));

    if let Some(path) = std::env::args().nth(1) {
        let margin = |index| {
            let point = claim.draw(1, index, &Machines::Random);
            Some((point.values[0], claim.verdict(&point, &Machines::Random).margin()?))
        };
        let tried = Series::crosses("a random machine", (0..200).filter_map(margin));
        let edge = Series::line("below: violated", [(-1.0, 0.0), (1.0, 0.0)]);
        let svg = chart("An observer of one's own, tried", "speed over rated speed", "margin", &[tried, edge]);
        std::fs::write(path, svg)?;
    }
    Ok(())
}
