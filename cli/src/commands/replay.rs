//! `descry replay RUN`: replays a run from its record, and reports any difference.

use std::path::PathBuf;

use descry_agent::exit::{CommandError, Exit};
use descry_agent::replay::{Replay, Replayed, replay};
use descry_agent::report::Event;
use descry_agent::run::Watcher;
use descry_agent::stop::Stop;

use crate::commands::input;

/// Arguments of `descry replay`.
#[derive(clap::Args)]
pub struct Arguments {
    /// The run's folder
    run: PathBuf,
    /// Seconds of the body's clock for each second of replay [default: as fast as possible]
    #[arg(long, value_name = "X", value_parser = speed)]
    speed: Option<f64>,
    /// Record the replay as a run in this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, CommandError> {
    let saying = input::saying(&arguments.run);
    let mut tell = |event: &Event| input::narrate_fitted(&event.told(&saying));
    let asked = Replay { run: &arguments.run, speed: arguments.speed, out: arguments.out.as_deref() };
    let stop = Stop::default();
    let watcher = Watcher { stop: &stop, tell: &mut tell };
    let replayed = input::runtime()?.block_on(replay(asked, watcher))?;
    say(&replayed, arguments.json)?;
    Ok(if replayed.same { Exit::Done } else { Exit::No })
}

fn say(replayed: &Replayed, json: bool) -> Result<(), CommandError> {
    if json {
        return input::print_json(replayed);
    }
    if !replayed.damage.is_empty() {
        input::print_text("the record is damaged, and nothing of it is played")?;
        return replayed.damage.iter().try_for_each(|fault| input::print_text(&format!("damaged: {fault}")));
    }
    let counts: Vec<String> = replayed.compared.iter().map(|(kind, n)| format!("{kind} {n}")).collect();
    if let Some(why) = &replayed.cut_off {
        input::print_text(&format!("the run was cut off: {why}"))?;
    }
    input::print_text(&format!("the same, byte for byte: {}", counts.join(", ")))?;
    replayed.differences.iter().try_for_each(|line| input::print_text(&format!("not the same: {line}")))
}

fn speed(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|x| x.is_finite() && *x > 0.0);
    number.ok_or_else(|| format!("`{text}` is no speed: give a number above zero, such as 1 or 10"))
}
