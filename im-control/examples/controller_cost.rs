//! What a control step costs, for valgrind and `scripts/step-cost`: `controller_cost CONTROLLER THOUSANDS`, `closed_` before the controller with averaged inverter and
//! machine, `_f32` behind it in single precision. docs/controllers.md says how.

#[path = "../benches/common/mod.rs"]
mod common;

use common::{Loop, Visit, each};
use im_model::Scalar;
use im_model::simulation::Controller;

struct Run {
    name: String,
    thousands: usize,
    ran: bool,
}

impl<T: Scalar> Visit<T> for Run {
    fn visit<C: Controller<T>>(&mut self, name: &str, mut l: Loop<T, C>) {
        if name == self.name {
            self.ran = true;
            println!("{name}: {}", l.run(1000 * self.thousands).value());
        }
    }
}

fn main() {
    let a: Vec<String> = std::env::args().skip(1).collect();
    let [case, thousands] = a.as_slice() else {
        eprintln!("usage: controller_cost [closed_]CONTROLLER[_f32] THOUSANDS");
        std::process::exit(2);
    };
    let (closed, name) = case.strip_prefix("closed_").map_or((false, case.as_str()), |name| (true, name));
    let (single, name) = name.strip_suffix("_f32").map_or((false, name), |name| (true, name));
    let mut run = Run { name: name.to_owned(), thousands: thousands.parse().unwrap_or(1), ran: false };
    if single {
        each::<f32>(closed, &mut run)
    } else {
        each::<f64>(closed, &mut run)
    }
    if !run.ran {
        eprintln!("no case named {case}");
        std::process::exit(2);
    }
}
