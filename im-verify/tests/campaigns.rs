//! Campaigns: shards make up the whole, an interrupted one is resumed, cases survive their files.

use std::num::NonZeroU64;
use std::path::PathBuf;

use im_model::Shard;
use im_verify::{Block, Campaign, Claim, Cost, Journal, JournalError, Machines, Row, Subject, case_file, claims, shrunk};

fn campaign(shard: Shard, machines: Machines) -> Campaign {
    let chosen = claims::all().into_iter().filter(|c| [3, 18, 32].contains(&c.number)).collect();
    Campaign { claims: chosen, machines, cases: Some(12_345), seed: 7, shard }
}

fn blocks(campaign: &Campaign, done: &[Block]) -> Vec<Block> {
    let mut all = Vec::new();
    let run: Result<(), ()> = campaign.run(done, |b| {
        all.push(b.clone());
        Ok(())
    });
    run.unwrap();
    all.sort_by_key(|b| (b.claim, b.first));
    all
}

#[test]
fn shards_are_exactly_the_parts_of_the_whole() {
    let whole = blocks(&campaign(Shard::WHOLE, Machines::Random), &[]);
    for of in [2, 5, 7] {
        let mut parts: Vec<Block> = Vec::new();
        for part in 1..=of {
            let shard = Shard { part, of: NonZeroU64::new(of).unwrap() };
            parts.extend(blocks(&campaign(shard, Machines::Random), &[]));
        }
        parts.sort_by_key(|b| (b.claim, b.first));
        assert_eq!(parts, whole, "{of} shards");
    }
    assert_eq!(whole.iter().filter(|b| b.claim == 3).map(|b| b.cases).sum::<u64>(), 12_345);
}

#[test]
fn what_is_done_is_not_done_again() {
    let campaign = campaign(Shard::WHOLE, Machines::Random);
    let whole = blocks(&campaign, &[]);
    let (done, left) = whole.split_at(whole.len() / 2);
    let mut sum = done.to_vec();
    let effort = |b: &[Block]| b.iter().map(|b| campaign.effort_of(b)).sum::<u64>();
    assert_eq!(campaign.effort_left(done) + effort(done), effort(&whole));
    let rest = blocks(&campaign, done);
    assert_eq!(rest, left);
    sum.extend(rest);
    for claim in &campaign.claims {
        assert_eq!(Row::of(claim, &campaign, &sum), Row::of(claim, &campaign, &whole));
    }
    // Of another seed, nothing is done; of other cases only the blocks that both have.
    let longer = Campaign { cases: Some(15_000), ..campaign.clone() };
    let sum: u64 = whole.iter().filter(|b| longer.owns(b)).chain(&blocks(&longer, &whole)).map(|b| b.cases).sum();
    assert_eq!(sum, 3 * 15_000);
    let other = Campaign { seed: 8, ..campaign };
    assert_eq!(blocks(&other, done).len(), whole.len());
}

#[test]
fn an_error_while_reporting_ends_the_campaign() {
    let mut reported = 0;
    let result = campaign(Shard::WHOLE, Machines::Random).run(&[], |_| {
        reported += 1;
        if reported == 2 { Err("disk full") } else { Ok(()) }
    });
    assert_eq!(result, Err("disk full"));
}

struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("im-verify-{}-{name}", std::process::id()));
        let _ = std::fs::remove_file(&path);
        Self(path)
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_file(&self.0);
    }
}

#[test]
fn a_torn_last_line_is_cut_away_and_a_wrong_one_is_named() {
    let scratch = Scratch::new("journal.jsonl");
    let some = blocks(&campaign(Shard::WHOLE, Machines::Random), &[]);
    let (mut journal, none) = Journal::open::<Block>(&scratch.0).unwrap();
    assert!(none.is_empty());
    for b in &some[..3] {
        journal.append(b).unwrap();
    }
    drop(journal);
    let whole = std::fs::read_to_string(&scratch.0).unwrap();
    std::fs::write(&scratch.0, format!("{whole}{}", &whole[..whole.find('\n').unwrap() - 20])).unwrap();
    let (mut journal, read) = Journal::open::<Block>(&scratch.0).unwrap();
    assert_eq!(read, some[..3]);
    journal.append(&some[3]).unwrap();
    drop(journal);
    assert_eq!(Journal::open::<Block>(&scratch.0).unwrap().1, some[..4], "the next line stands where the torn one was");
    std::fs::write(&scratch.0, "{\"claim\": 3}\n".to_owned() + &whole).unwrap();
    let error = Journal::open::<Block>(&scratch.0).unwrap_err();
    assert!(matches!(error, JournalError::Line { line: 1, .. }), "{error}");
    // A file of somebody else's is not touched.
    std::fs::write(&scratch.0, "shopping: milk, eggs").unwrap();
    assert!(Journal::open::<Block>(&scratch.0).is_err());
    assert_eq!(std::fs::read_to_string(&scratch.0).unwrap(), "shopping: milk, eggs");
}

fn claim(number: u32) -> Claim {
    claims::all().into_iter().find(|c| c.number == number).unwrap()
}

#[test]
fn a_failing_case_says_the_same_after_its_file() {
    let claim = claim(3);
    assert_eq!(claim.cost, Cost::Equation);
    let named = Machines::One(Box::new(Subject::by_name("jadot_table_i").unwrap()));
    for machines in [Machines::Random, named] {
        let index = (0..).find(|k| claim.verdict(&claim.draw(1, *k, &machines), &machines).is_violated()).unwrap();
        let point = shrunk(&claim, &claim.draw(1, index, &machines), &machines);
        let text = case_file::to_text(&claim, &point, &machines, 1, index);
        let (read, again, subject) = case_file::from_text(&text, &claims::all(), None).unwrap();
        assert_eq!((read.number, &again, &subject), (3, &point, &machines));
        assert_eq!(claim.verdict(&again, &subject), claim.verdict(&point, &machines));
    }
}

#[test]
fn wrong_case_files_are_refused_by_key() {
    let claim = claim(3);
    let good = case_file::to_text(&claim, &claim.draw(1, 0, &Machines::Random), &Machines::Random, 1, 0);
    let bad = |from: &str, to: &str| {
        let at = good.find(from).unwrap();
        let line = good[at..].find('\n').unwrap();
        let text = format!("{}{to}{}", &good[..at], &good[at + line..]);
        case_file::from_text(&text, &claims::all(), None).unwrap_err().to_string()
    };
    for (from, to, says) in [
        ("claim =", "claim = \"nonsense\"", "im verify --list"),
        ("power_w", "power_w = 1e9", "[machine] power_w: 1000000000 must lie from 400 to 75000"),
        ("power_w", "", "[machine] power_w: is missing"),
        ("pole_pairs", "pole_pairs = 2.5", "[machine] pole_pairs"),
        ("slip_share", "slip_share = \"a lot\"", "must be a number"),
        ("slip_share", "slip_share = nan", "must lie"),
        ("slip_share", "slip_share = 0.0\nspeed = 1", "[values] speed: unknown; expected are"),
        ("index", "", "index"),
    ] {
        let text = bad(from, to);
        assert!(text.contains(says), "{text}");
    }
}
