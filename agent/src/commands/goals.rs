//! `descry goals`: what may be said to a domain.

use descry_domains::load::{DEFAULT, Domain};
use serde_json::json;

use crate::commands::input;
use crate::exit::{CommandError, Exit};

/// Arguments of `descry goals`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Built-in domain or a domain's folder
    #[arg(long, default_value = DEFAULT)]
    domain: String,
    /// Print the phrases as one JSON object
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, CommandError> {
    let domain = Domain::load(&arguments.domain).map_err(CommandError::bad_input)?;
    let names =
        |slot: &str| -> Vec<Vec<String>> { domain.names(slot).into_iter().map(|(_, names)| names).collect() };
    if arguments.json {
        let phrases: Vec<_> =
            domain.config.goal.iter().map(|g| json!({"say": g.say, "means": g.means})).collect();
        input::print_json(&json!({
            "domain": domain.config.name, "phrases": phrases, "things": names("thing"), "surfaces": names("surface"),
        }))?;
        return Ok(Exit::Done);
    }
    let mut lines = vec![format!("{}: {}", domain.config.name, domain.config.about), String::new()];
    for phrase in &domain.config.goal {
        lines.push(format!("  {:36} {}", phrase.say, phrase.about));
    }
    lines.push(String::new());
    lines.push("  any of them may end in \"with confidence 0.9\"".into());
    lines.push(String::new());
    lines.push("things:".into());
    lines.extend(names("thing").iter().map(|n| format!("  {}", n.join(", "))));
    lines.push("surfaces:".into());
    lines.extend(names("surface").iter().map(|n| format!("  {}", n.join(", "))));
    input::print_text(&lines.join("\n"))?;
    Ok(Exit::Done)
}
