//! A certificate of every kind.

use super::region;
use im_design::request::{Kind, Period, design, design_sampled};
use im_design::{Certificate, DesignModel, LinearMachine};

/// A certificate of each kind, and of each that is made for a sampling period.
pub fn every(machine: &LinearMachine) -> Vec<(String, Certificate)> {
    let plant = DesignModel::Machine(*machine);
    let named = |name: String, made: Result<Certificate, _>| {
        let made: Certificate = made.unwrap_or_else(|e: im_design::DesignError| panic!("{name}: {e}"));
        (name, made)
    };
    let made = Kind::ALL.map(|(kind, name)| named(name.into(), design(kind, plant, &region(kind, machine))));
    let period = Period::At(2e-5);
    let sampled = [Kind::Thau, Kind::Derdiyok, Kind::Utkin, Kind::Kenne, Kind::Jadot]
        .map(|kind| named(format!("sampled {}", kind.name()), design_sampled(kind, plant, &region(kind, machine), period)));
    let boxed = region(Kind::ThauBox, machine) + &format!("\nrate_per_s = {}", 0.2 * plant.constants::<f64>().eta);
    let adaptive =
        "speed_rad_s = [8.0, 20.0]\nslip_rad_s = [-8.0, 8.0]\nflux_vs = 0.9\nproportional = 0.05\nintegral = 20.0\nrho = 0.2";
    let regions = [(Kind::ThauBox, boxed), (Kind::KubotaLoop, adaptive.to_owned())];
    let more = regions.map(|(kind, text)| named(format!("sampled {}", kind.name()), design_sampled(kind, plant, &text, period)));
    made.into_iter().chain(sampled).chain(more).collect()
}
