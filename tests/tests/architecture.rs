//! The invariants of ARCHITECTURE.md that can be read off the source.

mod modules;

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use modules::{Modules, public_types};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace holds this crate").to_path_buf()
}

fn sources(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let mut found: Vec<PathBuf> = entries
        .flatten()
        .flat_map(|e| if e.path().is_dir() { sources(&e.path()) } else { vec![e.path()] })
        .filter(|p| p.extension().is_some_and(|e| e == "rs"))
        .collect();
    found.sort();
    found
}

/// Code of a file without comment lines.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).expect("a source file is text");
    text.lines().filter(|l| !l.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

fn dependencies(package: &str) -> Vec<String> {
    let text =
        fs::read_to_string(root().join(package).join("Cargo.toml")).expect("every crate has a manifest");
    let manifest: toml::Table = text.parse().expect("a manifest is TOML");
    let table = manifest.get("dependencies").and_then(|d| d.as_table()).cloned().unwrap_or_default();
    table.keys().cloned().collect()
}

/// No line of `folder`'s code may hold any of `words`, but in the files of `allowed`.
fn check_absent(folder: &str, words: &[&str], allowed: &[&str]) {
    let files = sources(&root().join(folder));
    assert!(!files.is_empty(), "{folder} holds no source");
    for file in files {
        let name = file.strip_prefix(root()).expect("sources lie below the root").display().to_string();
        if allowed.iter().any(|a| name.starts_with(a)) {
            continue;
        }
        let code = code(&file);
        for word in words {
            let line = code.lines().find(|l| l.contains(word));
            assert!(line.is_none(), "{name} must not use {word}: {}", line.unwrap_or_default().trim());
        }
    }
}

/// Crates, each with the crates it may use.
const FLOORS: &[(&str, &str)] = &[
    ("planner", ""),
    ("perception", ""),
    ("memory", "perception"),
    ("robots", "perception"),
    ("skills", "robots"),
    ("domains", "memory perception planner robots skills"),
    ("agent", "domains memory perception planner robots skills"),
    ("explain", "agent domains memory planner robots skills"),
    ("pages", "agent domains explain memory perception planner"),
    ("experiments", "agent domains memory pages perception robots"),
    ("cli", "agent domains experiments explain memory pages perception planner robots"),
    ("python", "agent domains explain memory pages perception planner robots"),
    ("tests", "agent domains memory perception planner robots"),
];

#[test]
fn a_crate_uses_only_the_floors_below_its_own() {
    for (package, allowed) in FLOORS {
        for used in dependencies(package).iter().filter_map(|d| d.strip_prefix("descry-")) {
            assert!(allowed.split(' ').any(|a| a == used), "{package} must not depend on {used}");
        }
    }
}

#[test]
fn planner_and_perception_know_no_clock_no_files_no_threads_of_a_runtime() {
    let words = [
        "std::fs",
        "std::time",
        "Instant::now",
        "SystemTime",
        "tokio",
        "std::env",
        "static mut",
        "thread_rng",
    ];
    check_absent("planner/src", &words, &[]);
    check_absent("perception/src", &words, &[]);
    // Threads of their own are started at two places: searches beside each other, and merging ahead of the next look.
    check_absent("planner/src", &["std::thread"], &["planner/src/search/abreast.rs"]);
    check_absent("perception/src", &["std::thread"], &["perception/src/merge/incremental.rs"]);
}

#[test]
fn only_the_simulator_reads_the_truth_and_only_a_report_shows_it() {
    let words = ["truth"];
    for folder in ["skills/src", "domains/src", "memory/src"] {
        check_absent(folder, &words, &[]);
    }
    check_absent(
        "agent/src",
        &words,
        &["agent/src/report", "agent/src/body.rs", "agent/src/body/program.rs"],
    );
    check_absent("cli/src", &words, &["cli/src/commands/experiment"]);
    check_absent("explain/src", &words, &[]);
    check_absent("pages/src", &words, &[]);
}

/// Every name that the abilities give to facts, calls and skills, and every action and type of the built-in domains.
fn nouns() -> Vec<String> {
    let mut nouns: Vec<String> = Vec::new();
    for ability in descry_domains::abilities::ALL {
        nouns.extend(ability.facts.iter().map(|f| f.name.to_string()));
        nouns.extend(ability.calls.iter().map(|c| c.name.to_string()));
        nouns.extend(ability.skills.iter().map(|s| s.name.to_string()));
    }
    for name in ["tabletop", "home", "shapes"] {
        let domain = descry_domains::load::Domain::load(name).expect("a built-in domain loads");
        let task = &domain.vocabulary.task;
        nouns.extend(task.actions.iter().map(|a| a.name.clone()));
        nouns.extend(task.types.iter().map(|t| t.name.clone()));
        nouns.extend(domain.objects.iter().map(|o| o.name.clone()));
    }
    // An object of a task and the confidence of an answer are nobody's own.
    nouns.retain(|n| n != "object" && n != "confidence");
    nouns.sort_unstable();
    nouns.dedup();
    nouns
}

#[test]
fn the_loop_names_no_noun_of_any_domain() {
    let nouns = nouns();
    assert!(nouns.len() > 30, "{nouns:?}");
    // Experiments are about domains; words as short as "in" are fields of the report.
    for file in ["agent/src", "explain/src", "pages/src", "cli/src"]
        .iter()
        .flat_map(|folder| sources(&root().join(folder)))
    {
        let name = file.strip_prefix(root()).expect("sources lie below the root").display().to_string();
        let code = code(&file);
        for noun in nouns.iter().filter(|noun| noun.len() > 2) {
            let quoted = code.lines().find(|l| l.contains(&format!("\"{noun}\"")));
            assert!(quoted.is_none(), "{name} names {noun}: {}", quoted.unwrap_or_default().trim());
        }
    }
    // A wall that is never built cannot be seen to fall: the words would be found if they were there.
    let ability = code(&root().join("domains/src/abilities/searching/mod.rs"));
    assert!(nouns.iter().any(|noun| ability.contains(&format!("\"{noun}\""))));
}

#[test]
fn only_memory_writes_what_was_seen() {
    check_absent("skills/src", &["std::fs", "File::create"], &[]);
    check_absent("domains/src", &["fs::write", "File::create"], &[]);
}

#[test]
fn signals_are_heard_in_main_alone() {
    for folder in [
        "planner/src",
        "perception/src",
        "memory/src",
        "robots/src",
        "skills/src",
        "domains/src",
        "agent/src",
        "explain/src",
        "pages/src",
        "experiments/src",
        "cli/src",
    ] {
        check_absent(
            folder,
            &["tokio::signal", "ctrl_c", "SignalKind"],
            &["cli/src/main.rs", "cli/src/serve.rs"],
        );
    }
}

#[test]
fn whoever_starts_a_run_brings_the_runtime() {
    for folder in ["robots/src", "skills/src", "domains/src", "agent/src"] {
        check_absent(folder, &["runtime::Builder", "Runtime::new", "block_on"], &[]);
    }
}

#[test]
fn libraries_know_no_command_line_and_print_nothing() {
    for folder in [
        "planner/src",
        "perception/src",
        "memory/src",
        "skills/src",
        "domains/src",
        "agent/src",
        "explain/src",
        "pages/src",
    ] {
        check_absent(folder, &["clap::", "println!", "eprint!", "eprintln!", "print!("], &[]);
    }
}

/// The crates that others may build from.
const PACKAGED: [&str; 11] = [
    "planner",
    "perception",
    "memory",
    "robots",
    "skills",
    "domains",
    "agent",
    "explain",
    "pages",
    "experiments",
    "cli",
];

/// Every packaged crate contains all its sources; files elsewhere are linked into it.
#[test]
fn what_is_compiled_into_a_crate_lies_in_it() {
    for package in PACKAGED {
        let own = root().join(package);
        for file in sources(&own.join("src")) {
            let code = code(&file);
            let pasted = ["include_str!(\"", "include_bytes!(\""]
                .into_iter()
                .flat_map(|sign| code.split(sign).skip(1));
            for path in pasted.filter_map(|rest| rest.split('"').next()) {
                let ups = path.split('/').filter(|part| *part == "..").count();
                let depth = file.strip_prefix(&own).expect("it lies there").components().count() - 1;
                assert!(ups <= depth, "{}: {path} lies beside the crate {package}", file.display());
            }
        }
    }
}

#[test]
fn versions_are_written_once() {
    for package in PACKAGED.into_iter().chain(["tests"]) {
        let text =
            fs::read_to_string(root().join(package).join("Cargo.toml")).expect("every crate has a manifest");
        let manifest: toml::Table = text.parse().expect("a manifest is TOML");
        for table in ["dependencies", "dev-dependencies"] {
            let Some(d) = manifest.get(table).and_then(|d| d.as_table()) else { continue };
            for (name, value) in d {
                let inherited = value.get("workspace").and_then(toml::Value::as_bool) == Some(true);
                assert!(inherited, "{package}: {name} must take its version from the workspace");
            }
        }
    }
}

/// ARCHITECTURE.md names the test that holds each invariant.
#[test]
fn every_test_that_the_architecture_names_is_there() {
    let page = fs::read_to_string(root().join("ARCHITECTURE.md")).expect("it is there");
    let tests: String = fs::read_dir(root())
        .expect("the workspace is a folder")
        .flatten()
        .flat_map(|entry| sources(&entry.path().join("tests")))
        .map(|file| code(&file))
        .collect();
    let named: Vec<&str> = page
        .split('`')
        .skip(1)
        .step_by(2)
        .filter(|word| word.matches('_').count() > 2 && !word.contains('/'))
        .collect();
    assert!(named.len() > 25, "{named:?}");
    for test in named {
        assert!(tests.contains(&format!("fn {test}(")), "no test is called {test}");
    }
}

/// Methods that split or search a text.
const TAKING_APART: [&str; 13] = [
    "strip_prefix",
    "strip_suffix",
    "split_once",
    "rsplit_once",
    "starts_with",
    "ends_with",
    "contains",
    "replacen",
    "trim_start_matches",
    "trim_end_matches",
    "match_indices",
    "rfind",
    "split",
];

/// Whether a text is of sentences: words and spaces, and no sign of a path, of markup or of PDDL.
fn is_prose(text: &str) -> bool {
    let is_sign = |sign: char| "(){}[]<>/:.-_?|#=+\"".contains(sign);
    let has_word = text.split(' ').any(|word| word.len() > 2 && word.chars().all(|c| c.is_ascii_lowercase()));
    has_word && !text.contains(is_sign) || text.contains("--")
}

/// Literals by which a line splits or searches a text.
fn taken_apart(line: &str) -> Vec<&str> {
    let by = |method: &&str| {
        let (_, rest) = line.split_once(&format!(".{method}(\""))?;
        rest.split_once('"').map(|(text, _)| text)
    };
    TAKING_APART.iter().filter_map(by).collect()
}

/// Reasons, steps and verdicts are values from the planner to the page; no crate parses our own
/// sentences.
#[test]
fn no_crate_parses_sentences_of_our_own() {
    // What others write: the limits of a process, as Linux tells them.
    const OF_OTHERS: [&str; 1] = ["Max address space"];
    let folders = ["agent/src", "explain/src", "pages/src", "experiments/src", "cli/src/commands"];
    for file in folders.iter().flat_map(|folder| sources(&root().join(folder))) {
        let code = code(&file);
        let (code, _tests) = code.split_once("#[cfg(test)]").unwrap_or((&code, ""));
        for line in code.lines() {
            let prose =
                taken_apart(line).into_iter().find(|text| is_prose(text) && !OF_OTHERS.contains(text));
            assert_eq!(prose, None, "{}: {}", file.display(), line.trim());
        }
    }
    // The lines that stood there once would be seen.
    for line in [
        r#"let rest = because.strip_prefix("the goal ")?;"#,
        r#"let tried = therefore.split_once(" of ").is_some() || therefore.starts_with("try ");"#,
        r#"CommandError::Broken(why) if !why.contains("--max-bytes") => {"#,
        r#"let is_said = |text: &&String| text.starts_with("confidence in ");"#,
        r#"let is_look = because.split_once(" does not hold").is_some();"#,
    ] {
        assert!(taken_apart(line).into_iter().any(is_prose), "{line}");
    }
    // Scripts draw data; they do not read texts.
    for script in ["pages/src/page/page.js", "pages/src/live/follow.js", "experiments/src/live.js"] {
        let code = fs::read_to_string(root().join(script)).expect("a script is text");
        for reading in [".match(", ".matchAll(", ".split(", ".replace(", ".search(", "new RegExp"] {
            assert!(!code.contains(reading), "{script} takes a text apart: {reading}");
        }
    }
}

/// Crates with the maximum size of a module cycle: six, or the present size if larger.
const CRATES: [&str; 10] = [
    "domains",
    "agent",
    "explain",
    "pages",
    "experiments",
    "skills",
    "memory",
    "perception",
    "robots",
    "planner",
];

fn modules_of(package: &str) -> Modules {
    let folder = root().join(package).join("src");
    Modules::of(&folder, &sources(&folder))
}

#[test]
fn no_circle_of_modules_is_above_six() {
    for package in CRATES {
        let modules = modules_of(package);
        let circle = modules.largest_circle();
        let drawn = || modules.drawn(&circle);
        assert!(circle.len() <= 6, "{package} has a circle of {} modules:\n{}", circle.len(), drawn());
    }
}

#[test]
fn public_type_names_are_unique_in_a_crate() {
    for package in CRATES.iter().chain(&["experiments/measure"]) {
        let mut declared: BTreeMap<String, PathBuf> = BTreeMap::new();
        for file in sources(&root().join(package).join("src")) {
            for name in public_types(&file) {
                if let Some(other) = declared.insert(name.clone(), file.clone()) {
                    panic!("{name} is declared in {} and in {}", other.display(), file.display());
                }
            }
        }
    }
}

/// Layers of `domains`, from below, each with the modules that begin so.
const LAYERS: [(&str, &str); 4] = [
    (
        "language",
        "config contradiction declared english function lexicon load mentions no_plan note objective past program programs slots \
         symbol template toml_place vocabulary words",
    ),
    (
        "world model",
        "ability arm belief conclusion drive error eyes geometry known looking mind own_map range reasons round \
         situation states surface viewpoint walls",
    ),
    ("abilities", "abilities"),
    ("agent's view", "actions answer asked check culprit goal judge lesson origin saying world"),
];

/// Number of the layer that a module of `domains` lies in.
fn layer(module: &str) -> usize {
    let first = module.split("::").next().unwrap_or_default();
    let found = LAYERS.iter().position(|(_, modules)| modules.split_whitespace().any(|name| name == first));
    found.unwrap_or_else(|| panic!("{module} is in no layer of domains: see LAYERS"))
}

#[test]
fn a_layer_of_domains_uses_only_those_below() {
    for (module, others) in modules_of("domains").each().filter(|(module, _)| !module.is_empty()) {
        for other in others.iter().filter(|other| !other.is_empty()) {
            let (own, used) = (layer(module), layer(other));
            assert!(used <= own, "{module} ({}) uses {other} ({})", LAYERS[own].0, LAYERS[used].0);
        }
    }
}

#[test]
fn no_ability_knows_another() {
    let ability = |module: &str| module.strip_prefix("abilities::")?.split("::").next().map(str::to_string);
    for (module, others) in modules_of("domains").each() {
        let Some(own) = ability(module) else { continue };
        for other in others {
            assert!(other != "abilities", "{module} knows the list of abilities");
            let is_own = ability(other).is_none_or(|name| name == own);
            assert!(is_own, "{module} uses {other}");
        }
    }
}
