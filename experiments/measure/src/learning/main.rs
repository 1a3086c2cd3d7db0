//! Evaluation of Fäulhammer et al. in a simulated room and on recordings: `cargo run --release -p
//! descry-measure --bin learning -- SEED DIR [PART] [COUNT]`. DIR/page.html receives tables, plots and
//! pictures. PART selects one part by the name of its file; COUNT is the number of objects for `modelling`,
//! and of scenes for the others.

mod curves;
#[path = "../evaluate/frames.rs"]
mod frames;
#[path = "../../../../perception/tests/household/mod.rs"]
mod household;
mod judge;
mod knowing;
mod many;
mod measure;
mod modelling;
mod page;
mod plot;
mod recorded;
mod runs;
#[path = "../../../../perception/tests/tabletop/mod.rs"]
mod tabletop;

use page::Page;
use std::path::Path;
use std::process::ExitCode;

const PARTS: [&str; 5] = ["modelling", "curves", "many", "recorded", "judge"];
/// Number of learned objects, as in the paper.
const OBJECTS: usize = 10;
/// Maximum number of objects known at once.
const MANY: usize = 50;
/// Number of scenes for the curves and for many models.
const SCENES: usize = 36;

fn run(seed: u64, out: &Path, part: Option<&str>, count: Option<usize>) -> Result<(), String> {
    std::fs::create_dir_all(out).map_err(|e| format!("{}: {e}", out.display()))?;
    let mut page = Page::new(out);
    // What evidence is worth is fitted for itself: what is evaluated must not know of it.
    let is_asked = |name: &str| part.map_or(name != "judge", |part| part == name);
    let (objects, scenes) = (count.unwrap_or(OBJECTS), count.unwrap_or(SCENES));
    let mut claims = Vec::new();
    if is_asked("modelling") {
        modelling::print(seed, objects, &mut page)?;
        page.write()?;
    }
    if is_asked("curves") {
        claims.push(("the curves", curves::print(seed, OBJECTS, scenes, &mut page)?));
        page.write()?;
    }
    if is_asked("many") {
        claims.push(("many models", many::print(seed, MANY, scenes, &mut page)?));
        page.write()?;
    }
    if !claims.is_empty() {
        judge::print(&claims, &mut page)?;
    }
    if is_asked("recorded") {
        recorded::print(&mut page)?;
    }
    if is_asked("judge") {
        judge::fit(seed, scenes, &mut page)?;
    }
    page.write()
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let seed = arguments.first().and_then(|text| text.parse().ok());
    let count = arguments.get(3).map(|text| text.parse::<usize>()).transpose();
    let part = arguments.get(2).map(String::as_str);
    let result = match (seed, arguments.get(1), count) {
        (Some(seed), Some(out), Ok(count)) if part.is_none_or(|part| PARTS.contains(&part)) => {
            run(seed, Path::new(out), part, count)
        }
        _ => Err(format!("usage: learning SEED DIR [PART] [COUNT]\n  PART is one of {}", PARTS.join(", "))),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("{why}");
            ExitCode::from(2)
        }
    }
}
