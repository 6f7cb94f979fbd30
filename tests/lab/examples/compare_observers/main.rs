//! The observers on the same recordings: tables and plots of docs/background/observers.md.
//!
//!     cargo run --release -p im-lab --example compare_observers -- [--docs docs] [--measured DIRECTORY]
//!
//! Writes the parts of `observers.md` between their markers and the pictures beside it. With `--measured` also the table of a start of a real
//! 4-kW machine (the folder `direct_on_line_4kw`; no sample of it is written); without, that table stays as it is.

mod measured;
mod study;
mod tables;

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
    let measured = match recording.map(|d| d.join("Test_4_IM_Direct_Start.csv")) {
        Some(file) => Some(measured::table(&file)?),
        None => None,
    };
    let page = docs.join("background/observers.md");
    let mut text = std::fs::read_to_string(&page).map_err(|e| format!("{}: {e}", page.display()))?;
    // Before the long run: that both parts are there.
    for name in ["compare", "measured"] {
        part(&text, name).map_err(|e| format!("{}: {e}", page.display()))?;
    }
    let studies: Vec<study::Study> = study::machines().iter().map(study::Study::run).collect();
    let compared = tables::all(&studies) + &tables::maps();
    println!("{compared}");
    text.replace_range(part(&text, "compare")?, &compared);
    match measured {
        Some(table) => {
            println!("{table}");
            text.replace_range(part(&text, "measured")?, &table);
        }
        None => println!("the table of the measured start is left as it was: --measured DIRECTORY makes it anew"),
    }
    let images = docs.join("images/observers");
    std::fs::create_dir_all(&images)?;
    for (name, svg) in tables::pictures() {
        im_model::write_atomically(&images.join(name), |out| std::io::Write::write_all(out, svg.as_bytes()))?;
    }
    im_model::write_atomically(&page, |out| std::io::Write::write_all(out, text.as_bytes()))?;
    Ok(())
}

/// Where the part of the page between the markers of this name is.
fn part(page: &str, name: &str) -> Result<std::ops::Range<usize>, String> {
    let (begin, end) = (format!("<!-- {name}: begin -->\n"), format!("<!-- {name}: end -->"));
    match (page.find(&begin), page.find(&end)) {
        (Some(a), Some(b)) if a + begin.len() <= b => Ok(a + begin.len()..b),
        _ => Err(format!("the markers {} and {end} are not there, one after the other", begin.trim())),
    }
}
