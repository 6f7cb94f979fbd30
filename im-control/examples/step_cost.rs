//! Instructions per control step, for valgrind: `step_cost (closed|alone) CONTROLLER THOUSANDS`. docs/controllers.md says how.

#[path = "../benches/common/mod.rs"]
mod common;

use common::{Loop, Visit, each};
use im_model::Scalar;
use im_model::simulation::Controller;

struct Run {
    name: String,
    thousands: usize,
}

impl<T: Scalar> Visit<T> for Run {
    fn visit<C: Controller<T>>(&mut self, name: &str, mut l: Loop<T, C>) {
        if name == self.name {
            println!("{name}: {}", l.run(1000 * self.thousands).value());
        }
    }
}

fn main() {
    let a: Vec<String> = std::env::args().skip(1).collect();
    let [mode, name, thousands] = a.as_slice() else {
        eprintln!("usage: step_cost (closed|alone) CONTROLLER THOUSANDS");
        std::process::exit(2);
    };
    let mut run = Run { name: name.clone(), thousands: thousands.parse().unwrap_or(1) };
    each::<f64>(mode == "closed", &mut run);
}
