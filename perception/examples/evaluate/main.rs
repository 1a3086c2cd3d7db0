//! Segmentation and recognition on recordings with labels:
//! `cargo run --release -p descry-perception --example evaluate -- mosd DIR`.

mod kitchen;
mod mosd;

use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let result = match arguments.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        ["mosd", dir] => mosd::run(Path::new(dir)),
        ["kitchen", dir, ..] => kitchen::run(Path::new(dir)),
        _ => Err("usage: evaluate mosd|kitchen DIR".to_owned()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("{why}");
            ExitCode::from(2)
        }
    }
}
