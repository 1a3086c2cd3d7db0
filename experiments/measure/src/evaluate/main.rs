//! Segmentation, merging and recognition compared with ground truth, times of single views, and the origin of
//! all constants, as tables:
//! `cargo run --release -p descry-measure --bin evaluate -- constants | mosd DIR [PICTURES] | kitchen DIR | surfaces DIR... | table COUNT [PICTURES] | clutter COUNT SEED [PICTURES] | composed COUNT SEED [KIND] | colours COUNT SEED | lies COUNT SEED | mismatched COUNT SEED [WORLD [PICTURES]] | times REPETITIONS merged | [made | DIR]... | variants DIR... | further VIEWS [anew | kept]`.

mod clutter;
mod colours;
mod composed;
#[path = "../../../../perception/tests/constants/mod.rs"]
mod constants;
mod frames;
mod further;
mod kitchen;
mod lies;
mod mismatched;
mod mosd;
mod room;
#[path = "../searching.rs"]
mod searching;
mod surfaces;
mod table;
#[path = "../../../../perception/tests/tabletop/mod.rs"]
mod tabletop;
mod times;
mod variants;

use std::path::Path;
/// The same allocator as in the program.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let result = match arguments.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        ["constants"] => constants(),
        ["mosd", dir, out @ ..] => mosd::run(Path::new(dir), out.first().map(Path::new)),
        ["kitchen", dir, ..] => kitchen::run(Path::new(dir)),
        ["surfaces", dirs @ ..] => surfaces::run(dirs),
        ["table", count, out @ ..] => match count.parse() {
            Ok(count) => table::run(count, out.first().map(Path::new)),
            Err(_) => Err(format!("`{count}` is no number of arrangements")),
        },
        ["clutter", count, first, out @ ..] => match (count.parse(), first.parse()) {
            (Ok(count), Ok(first)) => clutter::run(count, first, out.first().map(Path::new)),
            _ => Err(format!("`{count}` and `{first}` are no number of piles and first seed")),
        },
        ["composed", count, first, only @ ..] => match (count.parse(), first.parse()) {
            (Ok(count), Ok(first)) => composed::run(count, first, only.first().copied().unwrap_or_default()),
            _ => Err(format!("`{count}` and `{first}` are no number of scenes and first seed")),
        },
        ["colours", count, first] => match (count.parse(), first.parse()) {
            (Ok(count), Ok(first)) => colours::run(count, first),
            _ => Err(format!("`{count}` and `{first}` are no number of scenes and first seed")),
        },
        ["lies", count, first] => match (count.parse(), first.parse()) {
            (Ok(count), Ok(first)) => lies::run(count, first),
            _ => Err(format!("`{count}` and `{first}` are no number of recordings and first seed")),
        },
        ["mismatched", count, seed, further @ ..] => match (count.parse(), seed.parse()) {
            (Ok(count), Ok(seed)) => {
                let only = further.first().copied().unwrap_or_default();
                mismatched::run(count, seed, only, further.get(1).map(Path::new))
            }
            _ => Err(format!("`{count}` and `{seed}` are no number of arrangements and first seed")),
        },
        ["times", repetitions, views @ ..] => match repetitions.parse() {
            Ok(repetitions) => times::run(repetitions, views),
            Err(_) => Err(format!("`{repetitions}` is no number of repetitions")),
        },
        ["further", count, mode @ ..] => match count.parse() {
            Ok(count) => further::run(count, mode.first().copied().unwrap_or_default()),
            Err(_) => Err(format!("`{count}` is no number of views")),
        },
        ["variants", dirs @ ..] => variants::run(dirs),
        _ => Err(
            "usage: evaluate constants | mosd DIR [PICTURES] | kitchen DIR | surfaces DIR... | table COUNT [PICTURES] | clutter COUNT SEED [PICTURES] | composed COUNT SEED [KIND] | colours COUNT SEED | lies COUNT SEED | mismatched COUNT SEED [WORLD [PICTURES]] | times REPETITIONS merged | [made | DIR]... | variants DIR... | further VIEWS [anew | kept]"
                .to_owned(),
        ),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("{why}");
            ExitCode::from(2)
        }
    }
}

/// Prints the constants of these sources with the origin of their values, in Markdown.
fn constants() -> Result<(), String> {
    let found = constants::all(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../perception/src"));
    print!("{}", constants::table(&found));
    match constants::faults(&found).as_slice() {
        [] => Ok(()),
        faults => Err(faults.join("\n")),
    }
}
