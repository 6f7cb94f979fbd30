//! Every claim, briefly: it comes out as `docs/background/claims.md` states it. The long campaign is `im verify`.

use std::path::{Path, PathBuf};

use im_model::Shard;
use im_verify::{Campaign, Claim, Machines, Outcome, Row, case_file, claims};

fn tried(claim: &Claim, cases: u64) -> Row {
    let campaign =
        Campaign { claims: vec![*claim], machines: Machines::Random, cases: Some(cases), seed: 1, shard: Shard::WHOLE };
    let mut blocks = Vec::new();
    let done: Result<(), ()> = campaign.run(&[], |b| {
        blocks.push(b.clone());
        Ok(())
    });
    done.unwrap();
    Row::of(claim, &campaign, &blocks)
}

#[test]
fn claims_that_hold_hold_on_random_machines() {
    let mut wrong = Vec::new();
    for claim in claims::all().iter().filter(|c| !c.found.fails()) {
        let row = tried(claim, claim.cost.test_cases());
        if row.outcome == Outcome::Otherwise {
            let first = row.violating.first().map(|k| claim.verdict(&claim.draw(1, *k, &Machines::Random), &Machines::Random));
            wrong.push(format!("{} {}: {} of {} violated; {first:?}", claim.number, claim.name, row.violated, row.cases));
        }
        assert!(row.outside <= row.cases, "{}: {} cases outside, {} inside", claim.name, row.outside, row.cases);
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Steady states that Newton's method once did not find, its steps being rounding already.
#[test]
fn steady_states_at_the_edge_of_rounding_are_found() {
    let claim = claims::all().into_iter().find(|c| c.number == 23).unwrap();
    for index in [7883, 91158] {
        let verdict = claim.verdict(&claim.draw(1, index, &Machines::Random), &Machines::Random);
        assert!(!verdict.is_violated(), "{verdict:?}");
    }
}

fn counterexamples() -> Vec<(PathBuf, String)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/counterexamples");
    let files = std::fs::read_dir(folder).unwrap().map(|f| f.unwrap().path());
    files.map(|f| (f.clone(), std::fs::read_to_string(f).unwrap())).collect()
}

/// Each claim that fails has its simplest counterexample beside this test; it is one still.
#[test]
fn claims_that_fail_fail_by_their_counterexamples() {
    let all = claims::all();
    let files = counterexamples();
    for claim in all.iter().filter(|c| c.found.fails()) {
        let (path, text) = files.iter().find(|(p, _)| p.ends_with(format!("{:02}-{}.toml", claim.number, claim.name))).unwrap();
        let (read, point, machines) = case_file::from_text(text, &all, None).unwrap();
        assert_eq!(read.name, claim.name, "{}", path.display());
        let verdict = claim.verdict(&point, &machines);
        assert!(verdict.is_violated(), "{}: {verdict:?}", claim.name);
        // Clear, and no matter of rounding.
        assert!(verdict.margin().is_some_and(|margin| margin < -0.01), "{}: {verdict:?}", claim.name);
    }
    assert_eq!(files.len(), all.iter().filter(|c| c.found.fails()).count(), "counterexamples to claims that there are");
}

#[test]
fn numbers_and_names_are_each_claims_own() {
    let all = claims::all();
    assert!(all.len() >= 40);
    for pair in all.windows(2) {
        assert!(pair[0].number < pair[1].number, "{} {}", pair[0].name, pair[1].name);
        assert!(pair[0].name != pair[1].name);
    }
    let page = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/background/claims.md")).unwrap();
    let list = im_verify::page::list(&all);
    assert!(page.contains(list.trim()), "docs/background/claims.md has other lists: scripts/claims-page list");
    for claim in &all {
        assert!(
            page.contains(&format!("| {} | `{}` |", claim.number, claim.name)),
            "docs/background/claims.md lacks a result of {}",
            claim.name
        );
    }
}
