//! `descry goals`: the goal phrases of a domain.

use descry_domains::goal::spoken_types;
use descry_domains::lexicon::{Lexicon, Places};
use descry_domains::load::DEFAULT;
use serde_json::json;

use crate::commands::input;
use descry_agent::body::scene_spec;
use descry_agent::exit::{CommandError, Exit};

/// Arguments of `descry goals`.
#[derive(clap::Args)]
pub struct Arguments {
    /// Built-in domain or a domain's folder
    #[arg(long, default_value = DEFAULT)]
    domain: String,
    /// Scene whose places are listed: a name of the domain or a TOML file [default: that of the domain]
    #[arg(long)]
    scene: Option<String>,
    /// Print the phrases as one JSON object
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &Arguments) -> Result<Exit, CommandError> {
    let domain = input::domain(&arguments.domain)?;
    let places = match &arguments.scene {
        Some(scene) => Places::of_spec(&scene_spec(Some(scene), &domain)?),
        None => Places::of_scene(&domain),
    };
    let lexicon = Lexicon::new(&domain, &places);
    let names = |of: &str| -> Vec<Vec<String>> {
        lexicon.of_type(of).iter().map(|named| named.names.clone()).collect()
    };
    let types = spoken_types(&domain);
    if arguments.json {
        let phrases: Vec<_> =
            domain.config.goal.iter().map(|g| json!({"say": g.say, "means": g.means})).collect();
        let mut said = json!({ "domain": domain.config.name, "phrases": phrases });
        types.iter().for_each(|of| said[format!("{of}s")] = json!(names(of)));
        input::print_json(&said)?;
        return Ok(Exit::Done);
    }
    let mut lines = vec![format!("{}: {}", domain.config.name, domain.config.about), String::new()];
    for phrase in &domain.config.goal {
        lines.push(format!("  {:36} {}", phrase.say, phrase.about));
    }
    lines.push(String::new());
    lines.push(
        "  any of them may end in \"with confidence 0.9\", in \"within 60 seconds\", or in both".into(),
    );
    for of in types {
        lines.push(String::new());
        lines.push(format!("{of}s:"));
        lines.extend(names(of).iter().map(|n| format!("  {}", n.join(", "))));
    }
    input::print_fitted(&lines.join("\n"))?;
    Ok(Exit::Done)
}
