//! Kwon et al., Figure 11: the speed is driven between 500 and 900 rpm, 150 Nm asked for, load torque equal to the estimated torque.
//!
//!     cargo run --release -p im-observers --example kwon_figure_11
//!
//! The paper, on its test bench: "the estimated speed follows the measured speed very closely during the steady state, and even during the
//! transient"; in steady state (Fig. 10) within 2.5 %.

#[path = "../lab/kwon.rs"]
mod kwon;
#[path = "../lab/mod.rs"]
mod lab;

use im_model::simulation::Profile;
use im_observers::{LoadTorqueModel, Thau, ThauGains};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let points =
        [[0.0, 500.0], [3.0, 500.0], [4.0, 900.0], [6.0, 900.0], [7.0, 600.0], [8.0, 800.0], [9.0, 500.0], [10.0, 500.0]];
    let speed = Profile::points(points.map(|[t, rpm]| [t, rpm * kwon::RPM]))?;
    for (name, machine) in [("Table IV", kwon::table_iv()), ("Table V", kwon::table_v())] {
        let truth = kwon::run(&machine, 0.0, Some(speed.clone()), 10.0);
        let observer = Thau::try_new(kwon::basis(&kwon::table_iv()), ThauGains::published(), LoadTorqueModel::EqualToTorque)?;
        let e = truth.observe(&observer);
        println!("plant: {name}; observer: Table IV, L = 0, load torque equal to the torque");
        kwon::table(&truth, &e, &[1.0, 2.9, 3.25, 3.5, 3.75, 4.5, 5.9, 6.5, 7.5, 8.5, 9.9]);
        let worst =
            (truth.at(2.0)..truth.len()).map(|k| (e[k].omega_m - truth.omega[k]).abs() / truth.omega[k]).fold(0.0, f64::max);
        println!("largest error after 2 s: {:.1} % of the speed\n", 100.0 * worst);
    }
    Ok(())
}
