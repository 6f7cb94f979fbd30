//! The observers on the same recordings: tables and plots of docs/observers.md.
//!
//!     cargo run --release -p imkit-observers --example compare -- [--docs docs] [--measured DIRECTORY]
//!
//! Writes the part of `observers.md` between its markers and the pictures beside it. With `--measured` it adds a start of a real 4-kW
//! machine (the folder `direct_on_line_4kw`); no sample of it is written.

mod measured;
mod study;
mod tables;

#[path = "../../lab/mod.rs"]
mod lab;

use std::path::PathBuf;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (mut docs, mut recording) = (PathBuf::from("docs"), None);
    let mut arguments = std::env::args().skip(1);
    while let Some(name) = arguments.next() {
        let value = arguments.next().ok_or_else(|| format!("{name} needs a value"))?;
        match name.as_str() {
            "--docs" => docs = value.into(),
            "--measured" => recording = Some(PathBuf::from(value)),
            _ => return Err(format!("unknown option {name}; --docs and --measured are known").into()),
        }
    }
    let studies: Vec<study::Study> = study::machines().iter().map(study::Study::run).collect();
    let mut text = tables::all(&studies);
    text += &tables::maps();
    match recording.map(|d| d.join("Test_4_IM_Direct_Start.csv")) {
        Some(file) if file.exists() => text += &measured::table(&file)?,
        _ => println!("no measured recording: its table is left out (--measured DIRECTORY)"),
    }
    let images = docs.join("images/observers");
    std::fs::create_dir_all(&images)?;
    for (name, svg) in tables::pictures() {
        im_model::write_atomically(&images.join(name), |out| std::io::Write::write_all(out, svg.as_bytes()))?;
    }
    let page = docs.join("observers.md");
    let old = std::fs::read_to_string(&page).map_err(|e| format!("{}: {e}", page.display()))?;
    let (begin, end) = ("<!-- compare: begin -->\n", "<!-- compare: end -->");
    let (Some(a), Some(b)) = (old.find(begin), old.find(end)) else {
        return Err(format!("{}: the markers {} and {end} are not there", page.display(), begin.trim()).into());
    };
    let new = format!("{}{text}{}", &old[..a + begin.len()], &old[b..]);
    im_model::write_atomically(&page, |out| std::io::Write::write_all(out, new.as_bytes()))?;
    println!("{text}");
    Ok(())
}
