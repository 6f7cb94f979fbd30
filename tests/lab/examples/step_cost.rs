//! What a step costs, for valgrind and `scripts/step-cost`: `step_cost KIND NAME THOUSANDS`; with less, the kinds or the names there are. Without
//! wall time in it.

use im_lab::cost::{KINDS, of};

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let wanted: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match wanted[..] {
        [kind] => of(kind).iter().for_each(|c| println!("{}", c.name)),
        [kind, name, thousands] => {
            let Some(cost) = of(kind).into_iter().find(|c| c.name == name) else {
                eprintln!("no step {name} of a {kind}; `step_cost {kind}` lists them");
                std::process::exit(2);
            };
            let mut thousand = cost.prepared();
            let sum: f64 = (0..thousands.parse().unwrap_or(1)).map(|_: u32| thousand()).sum();
            println!("{name}: checksum {sum}");
        }
        _ => KINDS.iter().for_each(|(kind, _)| println!("{kind}")),
    }
}
