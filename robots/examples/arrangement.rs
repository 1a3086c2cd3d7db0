//! Prints the arrangement of a scene for a seed, as JSON: `cargo run --release -p descry-robots --example
//! arrangement -- SCENE.toml SEED [VISIT]`. For scoring runs on the simulated body; no decision may use it.

use descry_robots::sim::{SceneSpec, arrange};
use std::process::ExitCode;

fn run(file: &str, seed: &str, visit: Option<&str>) -> Result<String, String> {
    let text = std::fs::read_to_string(file).map_err(|e| format!("{file}: {e}"))?;
    let text = visit.map_or(text.clone(), |visit| format!("visit = {visit}\n{text}"));
    let spec = SceneSpec::parse(file, &text).map_err(|e| e.to_string())?;
    let seed = seed.parse().map_err(|e| format!("{seed}: {e}"))?;
    let scene = arrange(&spec, seed).map_err(|e| e.to_string())?;
    let line = |o: &descry_robots::sim::Object| {
        let [x, y, z] = o.centre_m().coords.into();
        format!(
            r#"{{"name": "{}", "on": "{}", "centre_m": [{x:.4}, {y:.4}, {z:.4}]}}"#,
            o.name,
            o.surface().unwrap_or("")
        )
    };
    Ok(scene.objects.iter().map(line).collect::<Vec<_>>().join("\n"))
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let result = match arguments.as_slice() {
        [file, seed] => run(file, seed, None),
        [file, seed, visit] => run(file, seed, Some(visit)),
        _ => Err("usage: arrangement SCENE.toml SEED [VISIT]".into()),
    };
    match result {
        Ok(text) => {
            println!("{text}");
            ExitCode::SUCCESS
        }
        Err(why) => {
            eprintln!("{why}");
            ExitCode::from(2)
        }
    }
}
