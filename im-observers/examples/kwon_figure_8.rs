//! Kwon et al., Figure 8: 150 Nm from rest against a load proportional to the speed, machine and observer from zero; L = 0.
//!
//!     cargo run --release -p im-observers --example kwon_figure_8
//!
//! The paper sees "approximately 10 % speed error one second into the simulation, which then decreases". With the same machine in plant and
//! observer there is none; with the circuit that the paper fitted to the real motor (Table V) as the plant there is.

#[path = "../lab/kwon.rs"]
mod kwon;
#[path = "../lab/mod.rs"]
mod lab;

use im_model::machines::KWON_PRINTED_MATRICES;
use im_model::{Machine, TParameters};
use im_observers::{LoadTorqueModel, Thau, ThauGains};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // 150 Nm at 900 rpm: the paper gives neither the coefficient nor the final speed.
    let k = 150.0 / (900.0 * kwon::RPM);
    let load = LoadTorqueModel::Proportional { coefficient_nm_s_per_rad: k };
    let printed = Machine::base(KWON_PRINTED_MATRICES.parameters(), 2)?;
    let light = table_iv_with_inertia(0.9)?;
    let pairs = [
        ("Table IV", kwon::table_iv(), "Table IV", kwon::table_iv()),
        ("Table V", kwon::table_v(), "Table IV", kwon::table_iv()),
        ("Table IV", kwon::table_iv(), "the printed A, B1, B2", printed),
        ("Table IV", kwon::table_iv(), "Table IV with 10 % less inertia", light),
    ];
    for (plant, machine, model, believed) in pairs {
        println!("plant: {plant}; observer: {model}, L = 0, load torque {k:.3} Nms x estimated speed");
        let truth = kwon::run(&machine, k, None, 3.0);
        let observer = Thau::try_new(kwon::basis(&believed), ThauGains::published(), load)?;
        kwon::table(&truth, &truth.observe(&observer), &[0.1, 0.2, 0.3, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0 - 1e-4]);
        println!();
    }
    Ok(())
}

fn table_iv_with_inertia(share: f64) -> Result<Machine<f64>, im_model::ModelError> {
    let machine = kwon::table_iv();
    let p = *machine.parameters();
    machine.with_parameters(TParameters { inertia_kg_m2: share * p.inertia_kg_m2, ..p })
}
