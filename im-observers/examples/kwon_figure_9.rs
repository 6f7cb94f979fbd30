//! Kwon et al., Figure 9: driven at 900 rpm, 150 Nm asked for, the observer from zero with the load torque equal to the estimated torque.
//!
//!     cargo run --release -p im-observers --example kwon_figure_9
//!
//! The paper: "starts to track the actual speed closely in under 2 seconds".

#[path = "../lab/kwon.rs"]
mod kwon;
#[path = "../lab/mod.rs"]
mod lab;

use im_observers::{LoadTorqueModel, Thau, ThauGains};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    for (name, machine) in [("Table IV", kwon::table_iv()), ("Table V", kwon::table_v())] {
        let truth = kwon::run(&machine, 0.0, Some((900.0 * kwon::RPM).into()), 3.0);
        for (law, load) in
            [("equal to the torque", LoadTorqueModel::EqualToTorque), ("and friction with it", LoadTorqueModel::Balanced)]
        {
            let observer = Thau::try_new(kwon::basis(&kwon::table_iv()), ThauGains::published(), load)?;
            let e = truth.observe(&observer);
            println!("plant: {name}; observer: Table IV, L = 0, load torque {law}");
            kwon::table(&truth, &e, &[0.1, 0.2, 0.3, 0.5, 1.0, 2.0, 3.0 - 1e-4]);
            match kwon::tracks_from(&truth, &e, 0.05) {
                Some(t) => println!("within 5 % from {t:.2} s on\n"),
                None => println!("not within 5 % at the end\n"),
            }
        }
    }
    Ok(())
}
