//! What a speed that varies does to R̂_r and R̂_s of Kenné et al., under load: `cargo run --release -p im-identify --example kenne_ramp`.
//!
//! The range of the estimates over a run up a ramp and down again, and beside it where they would come to rest on these ramps if (27) were
//! taken for constant speed, as in the paper (first order, unlimited): `tests/online/ramp.rs`.

#[allow(dead_code)]
#[path = "../tests/online/bench.rs"]
mod bench;
#[path = "../tests/online/ramp.rs"]
mod ramp;

use ramp::{MACHINE, Ramp, SPEEDS, error_without_the_term};

fn main() {
    let [r_s, r_r, ..] = MACHINE;
    println!("R_r {r_r} Ω, R_s {r_s} Ω; ranges, Ω; without the term: at {} rad/s, going up; going down\n", SPEEDS[0]);
    println!("| rad/s² | R̂_r | R̂_r, R̂_s together | R̂_r, without the term | R̂_s, without the term |");
    println!("| --- | --- | --- | --- | --- |");
    for rate_rad_s2 in [50.0, 100.0, 200.0] {
        let ramp = Ramp { load_nm: 12.0, rate_rad_s2 };
        let seen = ramp.run();
        let range = |[low, high]: [f64; 2]| format!("{low:.3}–{high:.3}");
        let [(up, [_, s_up]), (down, [_, s_down])] =
            [1.0, -1.0].map(|sign| error_without_the_term(&ramp, SPEEDS[0], sign * rate_rad_s2));
        let (alone, both) = (range(seen.rotor), seen.both.map(range));
        println!(
            "| {rate_rad_s2} | {alone} | {}, {} | {:.2}; {:.2} | {:.1}; {:.1} |",
            both[0],
            both[1],
            r_r + up,
            r_r + down,
            r_s + s_up,
            r_s + s_down
        );
    }
}
