//! `im verify`: the claims of the papers, tried on many machines.

mod list;
mod replay;
mod table;
mod trials;

use std::io::Write;
use std::path::{Path, PathBuf};

use im_model::{MotorFile, Shard, write_atomically};
use im_verify::{
    Block, Campaign, Claim, Journal, Machines, Outcome, Paper, Point, Row, Subject, case_file, claims, page, shrunk,
};

use serde::de::DeserializeOwned;

use crate::failure::Failure;
use crate::output::Outputs;
use crate::spinner::spinning;
use crate::terminal::{Progress, say, stdout};

/// Arguments.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  im verify --list
  im verify --claim 3 --cases 1000000
  im verify --claim kubota_v_falls_for_any_error --motor motor.toml
  im verify --paper jadot --seed 2 --out out
  im verify --all --shard 1/4 --out part1
  im verify --all --cases 20 --trials strong --trials clean --out quick
  im verify --replay out/cases/03-kubota_v_falls_for_any_error-1642.toml

A case follows from seed, claim and index alone, so that shards are exactly the parts of the whole. With \
--out every finished block of cases is a line of DIR/results.jsonl and every finished trial of --all one \
of DIR/trials.jsonl: the same command run again goes on where it was, and the lines of several shards put \
into one file are summed up by running the whole. Another version of im needs another folder.

Exit status: 0 no claim came out otherwise than docs/background/claims.md states it and no trial was refused; too few \
cases to tell, or no counterexample on a given machine, is no failure and is printed; nor is a replayed counterexample \
of a claim that is stated to fail. 3 otherwise, 1 bad input, 2 wrong usage.")]
pub struct Args {
    /// All claims, and the hidden-effect campaign of im diagnose
    #[arg(long, conflicts_with_all = ["claim", "paper"])]
    all: bool,
    /// A claim, by number or name; give it several times for several. Without a choice: all claims
    #[arg(long, value_name = "NUMBER|NAME")]
    claim: Vec<String>,
    /// The claims of a paper
    #[arg(long, value_enum)]
    paper: Vec<PaperName>,
    /// The machine: random for another one in each case, or the name of one of the papers'
    #[arg(long, value_name = "random|NAME", default_value = "random")]
    machine: String,
    /// The machine: a motor.toml
    #[arg(long, value_name = "FILE", conflicts_with = "machine")]
    motor: Option<PathBuf>,
    /// Cases of each claim; by their cost if not given
    #[arg(long, value_parser = clap::value_parser!(u64).range(1..))]
    cases: Option<u64>,
    /// The seed
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Do part k of N only
    #[arg(long, value_name = "k/N", default_value_t = Shard::WHOLE)]
    shard: Shard,
    /// Folder for results.jsonl, trials.jsonl and the failing cases
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Failing cases to shrink and write down, of each claim
    #[arg(long, value_name = "N", default_value_t = 3)]
    keep: usize,
    /// Repetitions of the hidden-effect campaign, each with other noise and machines
    #[arg(long, value_name = "N", default_value_t = 1, requires = "all", value_parser = clap::value_parser!(u64).range(1..))]
    trial_seeds: u64,
    /// Of the hidden-effect campaign only these trials: a group, an effect, a machine, or several at once (strong; clean,m7); several times for
    /// several
    #[arg(long, value_name = "WORD,…", requires = "all")]
    trials: Vec<String>,
    /// Run one case again, from its file
    #[arg(long, value_name = "FILE", conflicts_with_all = ["all", "claim", "paper", "cases", "out"])]
    replay: Option<PathBuf>,
    /// List the claims
    #[arg(long)]
    list: bool,
    /// Print JSON
    #[arg(long)]
    json: bool,
    /// Print Markdown, as docs/background/claims.md has it
    #[arg(long, conflicts_with = "json")]
    markdown: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum PaperName {
    /// Observers
    Kwon,
    /// Sliding-mode control, rotor resistance
    Kenne,
    /// Passivity-based adaptive regulation
    Jadot,
}

impl From<PaperName> for Paper {
    fn from(name: PaperName) -> Self {
        match name {
            PaperName::Kwon => Self::Kwon,
            PaperName::Kenne => Self::Kenne,
            PaperName::Jadot => Self::Jadot,
        }
    }
}

/// How the output looks.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Format {
    Text,
    Json,
    Markdown,
}

impl Args {
    fn format(&self) -> Format {
        match (self.json, self.markdown) {
            (true, _) => Format::Json,
            (_, true) => Format::Markdown,
            _ => Format::Text,
        }
    }

    fn claims(&self) -> Result<Vec<Claim>, Failure> {
        let all = claims::all();
        let mut chosen: Vec<Claim> = Vec::new();
        for wish in &self.claim {
            let found = all.iter().find(|c| c.name == wish || c.number.to_string() == *wish);
            chosen.push(*found.ok_or_else(|| {
                let near = near_names(wish, &all);
                let near = if near.is_empty() { String::new() } else { format!(". Near it: {}", near.join(", ")) };
                Failure::Input(format!(
                    "--claim {wish}: there is no such claim; im verify --list shows their numbers and names{near}"
                ))
            })?);
        }
        let papers: Vec<Paper> = self.paper.iter().map(|p| (*p).into()).collect();
        chosen.extend(all.iter().filter(|c| papers.contains(&c.paper)));
        if self.claim.is_empty() && self.paper.is_empty() {
            chosen = all;
        }
        chosen.sort_by_key(|c| c.number);
        chosen.dedup_by_key(|c| c.number);
        Ok(chosen)
    }

    fn subject(&self) -> Result<Option<Subject>, Failure> {
        if let Some(path) = &self.motor {
            let motor = MotorFile::read(path)?;
            let effects: Vec<&str> = motor.machine.effects().active().map(|e| e.name()).collect();
            if !effects.is_empty() {
                let effects = effects.join(", ");
                say(&format!("note: the papers' claims are about the linear machine; left out: {effects}\n"));
            }
            let subject = Subject::of_motor(&motor).map_err(|e| Failure::Input(format!("{}: {e}", path.display())))?;
            return Ok(Some(subject));
        }
        if self.machine == "random" {
            return Ok(None);
        }
        let named = Subject::by_name(&self.machine).ok_or_else(|| {
            let names = im_model::machines::ALL.map(|m| m.name).join(", ");
            Failure::Input(format!("--machine {}: expected random or one of {names}; a motor.toml goes to --motor", self.machine))
        });
        named.map(Some)
    }
}

/// Names of claims that somebody may have meant: those with most of the wish's words in them, or the one of nearly the same letters.
fn near_names(wish: &str, all: &[Claim]) -> Vec<&'static str> {
    const MOST: usize = 5;
    let wish = wish.to_lowercase().replace(['-', ' '], "_");
    let words: Vec<&str> = wish.split('_').filter(|w| w.len() > 2).collect();
    // A word is shared that begins alike.
    let alike = |a: &str, b: &str| a.bytes().zip(b.bytes()).take_while(|(a, b)| a == b).count() >= a.len().min(5);
    let shared = |c: &&Claim| words.iter().filter(|w| c.name.split('_').any(|n| alike(w, n))).count();
    let most = all.iter().map(|c| shared(&c)).max().unwrap_or(0);
    let by_letters = im_model::toml_text::nearest(&wish, all.iter().map(|c| c.name));
    let by_words = all.iter().filter(|c| most > 0 && shared(c) == most).map(|c| c.name);
    let mut near: Vec<&str> = by_letters.into_iter().collect();
    near.extend(by_words.filter(|name| Some(*name) != by_letters));
    near.truncate(MOST);
    near
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let subject = args.subject()?;
    if let Some(path) = &args.replay {
        return replay::run(path, subject, args.json);
    }
    let chosen = args.claims()?;
    if args.list {
        return Ok(list::print(&chosen, args.format())?);
    }
    let machines = subject.map_or(Machines::Random, |s| Machines::One(Box::new(s)));
    let campaign = Campaign { claims: chosen, machines, cases: args.cases, seed: args.seed, shard: args.shard };
    if let Some(dir) = &args.out {
        let mut outputs = Outputs::beside(&args.motor);
        outputs.folder(dir, &["results.jsonl", "trials.jsonl"])?;
        outputs.folder(&dir.join("cases"), &[])?;
    }
    let planned = if args.all { trials::chosen(args.trial_seeds, &args.trials)? } else { Vec::new() };
    let blocks = tried(&campaign, args.out.as_deref())?;
    let rows: Vec<Row> = campaign.claims.iter().map(|c| Row::of(c, &campaign, &blocks)).collect();
    let found = spinning("shrinking", || shrink(&campaign, &rows, args.keep));
    if let Some(dir) = &args.out {
        for f in &found {
            write_atomically(&dir.join("cases").join(&f.file), |w| w.write_all(f.text.as_bytes()))?;
        }
    }
    let mut out = stdout();
    // What is for people is shown before the trials, which take long.
    match args.format() {
        Format::Text => table::text(&mut out, &campaign, &rows, &found, args)?,
        Format::Markdown => write!(out, "{}", page::results(&campaign, &rows))?,
        Format::Json => {}
    }
    out.flush()?;
    let finished = if args.all { trials::tried(&planned, args.shard, args.out.as_deref())? } else { Vec::new() };
    if args.format() == Format::Json {
        table::json_of(&mut out, &campaign, &rows, &found, args.all.then_some(&finished))?;
    } else if args.all {
        table::trials(&mut out, &finished)?;
    }
    let said = |(c, r): (&Claim, &Row)| match c.found.fails() {
        true => format!("{} (no counterexample in {} cases)", c.name, r.cases),
        false => format!("{} (violated in {} of {} cases)", c.name, r.violated, r.cases),
    };
    let otherwise = campaign.claims.iter().zip(&rows).filter(|(_, r)| r.outcome == Outcome::Otherwise);
    let mut wrong: Vec<String> = otherwise.map(said).collect();
    let refused = finished.iter().filter(|f| f.outcome.is_err()).count();
    if refused > 0 {
        wrong.push(format!("{refused} trials were refused"));
    }
    if wrong.is_empty() { Ok(()) } else { Err(Failure::NotAsStated(wrong.join(", "))) }
}

/// Results kept in a file of the folder, where one is given: what it holds, and the journal to go on with.
fn kept<T: DeserializeOwned>(out: Option<&Path>, file: &str) -> Result<(Option<Journal>, Vec<T>), Failure> {
    let Some(dir) = out else { return Ok((None, Vec::new())) };
    let (journal, done) = Journal::open(&dir.join(file)).map_err(|e| Failure::Input(e.to_string()))?;
    Ok((Some(journal), done))
}

/// Tries what is left to try, and keeps it on disk where a folder is given.
fn tried(campaign: &Campaign, out: Option<&Path>) -> Result<Vec<Block>, Failure> {
    let (mut journal, done) = kept::<Block>(out, "results.jsonl")?;
    let mut blocks: Vec<Block> = Vec::new();
    for b in done.into_iter().filter(|b| campaign.owns(b)) {
        // Files put together may hold a block twice.
        if !blocks.iter().any(|x| x.claim == b.claim && x.first == b.first) {
            blocks.push(b);
        }
    }
    let mut progress = Progress::new("trying cases");
    let mut effort: u64 = 0;
    let before = blocks.clone();
    let total = campaign.effort_left(&before);
    campaign.run(&before, |block| {
        effort += campaign.effort_of(block);
        progress.show(effort as usize, total as usize);
        if let Some(journal) = &mut journal {
            journal.append(block).map_err(|e| Failure::Input(e.to_string()))?;
        }
        blocks.push(block.clone());
        Ok::<(), Failure>(())
    })?;
    progress.finish();
    Ok(blocks)
}

/// A failing case, made simple.
struct Found {
    claim: u32,
    /// Name of its file.
    file: String,
    text: String,
    /// What was found, in numbers.
    why: String,
    /// Whether it comes from the case with the smallest margin of all.
    worst: bool,
}

fn shrink(campaign: &Campaign, rows: &[Row], keep: usize) -> Vec<Found> {
    let mut found = Vec::new();
    for (claim, row) in campaign.claims.iter().zip(rows) {
        // The worst of all cases and the first ones.
        let worst = row.worst.filter(|_| row.violated > 0).map(|(_, index)| index);
        let first = row.violating.iter().copied().filter(|index| Some(*index) != worst);
        let mut seen: Vec<Point> = Vec::new();
        for index in &worst.into_iter().chain(first).take(keep).collect::<Vec<_>>() {
            let point = shrunk(claim, &claim.draw(campaign.seed, *index, &campaign.machines), &campaign.machines);
            // Several cases often become the same one when made simple.
            if seen.contains(&point) {
                continue;
            }
            let why = match claim.verdict(&point, &campaign.machines) {
                im_verify::Verdict::Violated { why, .. } => why,
                _ => String::new(),
            };
            found.push(Found {
                claim: claim.number,
                file: format!("{:02}-{}-{index}.toml", claim.number, claim.name),
                text: case_file::to_text(claim, &point, &campaign.machines, campaign.seed, *index),
                why,
                worst: Some(*index) == worst,
            });
            seen.push(point);
        }
    }
    found
}
