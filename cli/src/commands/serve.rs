//! `descry serve`: the agent as a service.

use std::net::ToSocketAddrs;
use std::path::{Path, PathBuf};

use descry_agent::exit::{CommandError, Exit};
use descry_domains::load::DEFAULT;

use crate::commands::{input, narrate};
use crate::serve::{self, Goals, Served};

/// Arguments of `descry serve`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Folder of the goals and their runs; unfinished goals of an earlier server are resumed
    #[arg(long, value_name = "DIR", default_value = ".")]
    folder: PathBuf,
    /// Address to listen at
    #[arg(long, value_name = "HOST:PORT", default_value = "127.0.0.1:7447")]
    listen: String,
    /// File with the access token for callers; required for addresses that other machines can reach
    #[arg(long, value_name = "FILE")]
    token: Option<PathBuf>,
    /// Built-in domain or a domain's folder
    #[arg(long, default_value = DEFAULT)]
    domain: String,
    /// Scene of the simulated robot: a name of the domain or a TOML file
    #[arg(long)]
    scene: Option<String>,
    /// The body, as for `descry do`
    #[arg(long, default_value = "sim")]
    robot: String,
    /// Seed of the arrangement, the noise and every choice
    #[arg(long, default_value_t = 1, value_parser = input::seed, allow_negative_numbers = true)]
    seed: u64,
    /// Store of sightings across goals: a folder, or mongodb://HOST/DATABASE [default: `seen` in the folder]
    #[arg(long, value_name = "STORE")]
    remember: Option<String>,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, CommandError> {
    input::domain(&arguments.domain)?;
    let refused =
        |path: &Path, e: std::io::Error| CommandError::bad_input(format!("{}: {e}", path.display()));
    let folder = &arguments.folder;
    let folder = std::fs::create_dir_all(folder)
        .and_then(|()| folder.canonicalize())
        .map_err(|e| refused(folder, e))?;
    let address =
        arguments.listen.to_socket_addrs().ok().and_then(|mut all| all.next()).ok_or_else(|| {
            CommandError::bad_input(format!(
                "{} is no address\n  expected as in 127.0.0.1:7447",
                arguments.listen
            ))
        })?;
    let token =
        arguments.token.as_ref().map(|path| std::fs::read_to_string(path).map_err(|e| refused(path, e)));
    let token = token.transpose()?.map(|text| text.trim().to_string()).filter(|text| !text.is_empty());
    if token.is_none() && !address.ip().is_loopback() {
        return Err(CommandError::bad_input(format!(
            "{address} can be reached by other machines\n  expected --token FILE, with a token that callers must show"
        )));
    }
    let seen = arguments.remember.clone().unwrap_or_else(|| folder.join("seen").display().to_string());
    let mut options =
        vec!["--domain".into(), arguments.domain.clone(), "--robot".into(), arguments.robot.clone()];
    options.extend(["--seed".into(), arguments.seed.to_string(), "--remember".into(), seen]);
    options.extend(arguments.scene.iter().flat_map(|scene| ["--scene".to_string(), scene.clone()]));
    let goals = Goals::of(&folder)?;
    let served = Served { folder, options, token };
    serve::serve(served, goals, address, |at| narrate(&format!("goals are taken at http://{at}/")))
        .map_err(|e| CommandError::Broken(format!("{address}: {e}")))?;
    Ok(Exit::Done)
}
