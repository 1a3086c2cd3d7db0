//! `descry experiment FILE`: a batch of runs, and its statistics.

use std::path::PathBuf;
use std::sync::Arc;

use crate::commands::{input, live};
use descry_agent::exit::{CommandError, Exit};
use descry_agent::stop::Stop;
use descry_experiments::cluster::{self, Cluster};
use descry_experiments::{Batch, Ended, ExperimentError, Options, Shard, Source};

/// Free disk space below which a failed job is attributed to a full disk.
const LEAST_FREE_BYTES: u64 = 64 << 20;

/// Arguments of `descry experiment`.
#[derive(clap::Args)]
#[command(group = clap::ArgGroup::new("cluster").args(["slurm", "kubernetes"]).multiple(true))]
pub struct Arguments {
    /// Experiment file (TOML): its kind, and what it varies; each kind has its measures
    file: PathBuf,
    /// Give a key of the file a value, such as first_seed=7 or set.1.arrangements=10; may be given several times
    #[arg(long, value_name = "KEY=VALUE", conflicts_with = "slurm")]
    set: Vec<String>,
    /// Folder of the results; results that it already holds are not computed again [default: results/ and the
    /// file's name]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Run only every N-th job, such as 3/8; to combine shards in one folder, run again without --shard
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Run nothing: merge the shards in these folders into --out
    #[arg(long, value_name = "DIR", num_args = 1.., conflicts_with = "shard")]
    merge: Vec<PathBuf>,
    /// Run nothing: write the script of a Slurm job array for the shards, for sbatch
    #[arg(long, value_name = "FILE", requires = "shards", conflicts_with_all = ["shard", "merge", "live"])]
    slurm: Option<PathBuf>,
    /// Run nothing: write an indexed Kubernetes job for the shards, for kubectl apply
    #[arg(long, value_name = "FILE", requires = "shards", conflicts_with_all = ["shard", "merge", "live"])]
    kubernetes: Option<PathBuf>,
    /// With --slurm or --kubernetes: number of shards; --jobs is then the processors of each
    #[arg(long, value_name = "N", requires = "cluster")]
    shards: Option<usize>,
    /// Number of parallel jobs [default: one a core]
    #[arg(long, value_name = "N")]
    jobs: Option<usize>,
    #[command(flatten)]
    live: live::LiveArguments,
    /// Print the summary as one JSON object
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments, stop: &Stop) -> Result<Exit, CommandError> {
    let mut source = Source::read(&arguments.file).map_err(CommandError::bad_input)?;
    for assignment in &arguments.set {
        source.set(assignment).map_err(CommandError::bad_input)?;
    }
    let stem = arguments.file.file_stem().map_or_else(|| "experiment".into(), |stem| stem.to_os_string());
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let options = Options {
        out: arguments.out.clone().unwrap_or_else(|| PathBuf::from("results").join(stem)),
        shard: arguments.shard,
        merge: arguments.merge.clone(),
        threads: arguments.jobs.unwrap_or(cores).max(1),
        least_free_bytes: LEAST_FREE_BYTES,
        stop: stop.clone(),
        tell: input::narrate,
    };
    if let Some(shards) = arguments.shards {
        let cluster = Cluster { shards, threads: options.threads, out: options.out };
        return write_for_cluster(arguments, &source, &cluster);
    }
    let mut window = arguments.live.window()?;
    if window.is_wanted() {
        window.open(Arc::new(Batch::of(&source, options.out.clone()).map_err(failed)?))?;
    }
    let ended = descry_experiments::run(&source, &options);
    window.close();
    match ended.map_err(failed)? {
        Ended::Part { done, all, .. } if stop.is_asked() => {
            let said = format!("stopped; {done} of {all} jobs are done\n  go on with the same command");
            Err(CommandError::Stopped { said, signal: stop.signal() })
        }
        Ended::Part { done, all, folder } => {
            input::narrate(&format!(
                "{done} of {all} jobs are done; this shard's are in {}",
                folder.display()
            ));
            if arguments.json {
                input::print_json(&serde_json::json!({ "done": done, "jobs": all, "shard": folder }))?;
            }
            Ok(Exit::Done)
        }
        Ended::Whole(results) => {
            match arguments.json {
                true => input::print_json(&results.summary)?,
                false => input::print_text(results.tables.trim_end())?,
            }
            input::narrate(&format!("\n{}", results.clock));
            input::narrate(&format!("results: {}", options.out.join("index.html").display()));
            Ok(if results.failed == 0 { Exit::Done } else { Exit::No })
        }
    }
}

/// Writes the job description for a cluster's scheduler.
fn write_for_cluster(
    arguments: &Arguments,
    source: &Source,
    cluster: &Cluster,
) -> Result<Exit, CommandError> {
    type Made = fn(&Source, &Cluster) -> Result<String, ExperimentError>;
    let asked: [(&Option<PathBuf>, Made); 2] =
        [(&arguments.slurm, cluster::slurm), (&arguments.kubernetes, cluster::kubernetes)];
    for (file, made) in asked.iter().filter_map(|(file, made)| Some((file.as_ref()?, made))) {
        let text = made(source, cluster).map_err(failed)?;
        std::fs::write(file, text).map_err(|e| CommandError::broken(format!("{}: {e}", file.display())))?;
        input::print_text(&file.display().to_string())?;
    }
    Ok(Exit::Done)
}

/// Maps an error to bad input or to a failure of the disk.
fn failed(error: ExperimentError) -> CommandError {
    match error {
        ExperimentError::File { .. } | ExperimentError::Threads { .. } | ExperimentError::NoRoom { .. } => {
            CommandError::broken(error)
        }
        _ => CommandError::bad_input(error),
    }
}
