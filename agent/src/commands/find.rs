//! `descry find` and `descry do`: pursues a goal with a body.

use std::path::PathBuf;
use std::time::Instant;

use descry_domains::goal;
use descry_domains::load::{DEFAULT, Domain};

use crate::body;
use crate::commands::input;
use crate::exit::{CommandError, Exit};
use crate::policies;
use crate::report::Verdict;
use crate::run::{self, Settings};

/// Arguments of `descry find`.
#[derive(clap::Args)]
pub struct FindArguments {
    /// What to find, such as "cup A"
    #[arg(required = true)]
    thing: Vec<String>,
    #[command(flatten)]
    with: With,
}

/// Arguments of `descry do`.
#[derive(clap::Args)]
pub struct DoArguments {
    /// The goal, such as "identify all objects on the table"
    #[arg(required = true)]
    goal: Vec<String>,
    #[command(flatten)]
    with: With,
}

/// What `find` and `do` share.
#[derive(clap::Args)]
pub struct With {
    /// Built-in domain or a domain's folder
    #[arg(long, default_value = DEFAULT)]
    domain: String,
    /// Scene of the simulated robot: a name of the domain or a TOML file
    #[arg(long)]
    scene: Option<String>,
    /// The body: sim, or recorded:DIR for a folder of depth frames
    #[arg(long, default_value = "sim")]
    robot: String,
    /// Fixes the arrangement, the noise and every choice
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Who chooses where to look next: plan (weighs gain against cost over several looks), sweep, nearest, random,
    /// most-unknown, rear-side or gain-per-second
    #[arg(long, default_value = policies::PLAN)]
    policy: String,
    /// Folder of this run [default: a new one under runs/]
    #[arg(long, value_name = "DIR")]
    run: Option<PathBuf>,
    /// Print the result as one JSON object
    #[arg(long)]
    json: bool,
}

pub(super) fn find(arguments: &FindArguments) -> Result<Exit, CommandError> {
    run_goal(&format!("find {}", arguments.thing.join(" ")), &arguments.with)
}

pub(super) fn pursue(arguments: &DoArguments) -> Result<Exit, CommandError> {
    run_goal(&arguments.goal.join(" "), &arguments.with)
}

fn run_goal(said: &str, with: &With) -> Result<Exit, CommandError> {
    let started = Instant::now();
    let domain = Domain::load(&with.domain).map_err(CommandError::bad_input)?;
    let goal = goal::read(said, &domain).map_err(CommandError::bad_input)?;
    let body = body::open(&with.robot, with.scene.as_deref(), with.seed, &domain)?;
    let chooser = policies::named(&with.policy, with.seed, None).map_err(CommandError::bad_input)?;
    let folder = run::folder(with.run.as_deref(), &goal)?;
    let settings = Settings {
        robot: with.robot.clone(),
        scene: with.scene.clone(),
        seed: with.seed,
        domain: with.domain.clone(),
        policy: with.policy.clone(),
    };
    let mut tell = |event: &crate::report::Event| eprintln!("{event}");
    let mut report = run::pursue(&domain, &goal, &body, &folder, &settings, chooser, &mut tell)?;
    report.wall_s = started.elapsed().as_secs_f64();
    run::finish(&folder, &report)?;
    eprintln!("{report}");
    if with.json {
        input::print_json(&report)?;
    }
    Ok(match report.verdict {
        Verdict::Achieved => Exit::Done,
        Verdict::NotFound => Exit::No,
        Verdict::Failed => Exit::Broken,
    })
}
