//! Every claim, briefly: it comes out as `docs/claims.md` states it. The long campaign is `im verify`.

use im_verify::{Campaign, Found, Machines, Row, Shard, claims};

#[test]
fn every_claim_comes_out_as_stated() {
    let mut wrong = Vec::new();
    for claim in claims::all() {
        let campaign = Campaign {
            claims: vec![claim],
            machines: Machines::Random,
            cases: Some(claim.cost.test_cases()),
            seed: 1,
            shard: Shard::WHOLE,
        };
        let mut blocks = Vec::new();
        let begun = std::time::Instant::now();
        let done: Result<(), ()> = campaign.run(&[], |b| {
            blocks.push(b.clone());
            Ok(())
        });
        done.unwrap();
        let row = Row::of(&claim, &campaign, &blocks);
        println!(
            "{:>2} {:<45} {:?}: {} of {}, {} outside, worst {:?}, {:.2} s",
            claim.number,
            claim.name,
            claim.found,
            row.violated,
            row.cases,
            row.outside,
            row.worst,
            begun.elapsed().as_secs_f64()
        );
        if !row.as_stated {
            let first = row.violating.first().map(|k| claim.verdict(&claim.draw(1, *k, &Machines::Random), &Machines::Random));
            wrong.push(format!("{} {}: {} of {} violated; {first:?}", claim.number, claim.name, row.violated, row.cases));
        }
        // Most cases say something.
        assert!(row.outside <= 9 * row.cases, "{}: {} cases outside, {} inside", claim.name, row.outside, row.cases);
        let _ = Found::Holds;
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
