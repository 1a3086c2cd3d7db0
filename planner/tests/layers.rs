//! The crate's parts use only those of the layers below their own, so that no two of them go round in a circle.

use std::fs;
use std::path::{Path, PathBuf};

/// From below. What is written, its reader and how it is walked over know each other.
const LAYERS: [&str; 13] = [
    "attachment clauses diagnostic grouped memory technique",
    "plan",
    "model pddl task",
    "state",
    "ground semantics",
    "explain validate",
    "classical outcome",
    "calls heuristics",
    "search",
    "temporal",
    "solve",
    "problem",
    "lib small",
];

fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).expect("a folder of sources").flatten();
    entries
        .flat_map(|entry| if entry.path().is_dir() { sources(&entry.path()) } else { vec![entry.path()] })
        .collect()
}

fn layer(part: &str) -> usize {
    let holds = |layer: &&str| layer.split(' ').any(|own| own == part);
    LAYERS.iter().position(holds).unwrap_or_else(|| panic!("{part} is in no layer"))
}

#[test]
fn parts_use_only_what_lies_below() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for file in sources(&root) {
        let text = fs::read_to_string(&file).expect("a source file is text");
        let inside = file.strip_prefix(&root).expect("sources lie below the root");
        let first = inside.iter().next().and_then(|name| name.to_str()).unwrap_or_default();
        let part = first.trim_end_matches(".rs");
        // Tests stand at the end, and may look at everything.
        let own = text.split("#[cfg(test)]\nmod tests").next().unwrap_or_default();
        let code = own.lines().filter(|line| !line.trim_start().starts_with("//"));
        for line in code {
            for used in line.split("crate::").skip(1) {
                let used: String = used.chars().take_while(|c| c.is_ascii_lowercase() || *c == '_').collect();
                if used.is_empty() || used == part {
                    continue;
                }
                let language = layer(part) == layer("task") && layer(&used) == layer("task");
                let below = layer(&used) < layer(part) || language;
                assert!(below, "{} lies below {used}: {}", inside.display(), line.trim());
            }
        }
    }
}
