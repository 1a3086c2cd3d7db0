//! `descry show RUN --html FILE`: one self-contained page that a browser can draw.

use crate::binary;
use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

/// The page of a run in a folder.
fn page(folder: &Path) -> String {
    let shown = binary::outcome(folder, &["show", "run", "--html", "page.html"]);
    assert!(shown.status.success(), "{}", String::from_utf8_lossy(&shown.stderr));
    std::fs::read_to_string(folder.join("page.html")).expect("the page is there")
}

/// The story embedded in the page, as its script reads it.
fn story(page: &str) -> Value {
    let begin = "<script type=\"application/json\" id=\"story\">";
    let (_, rest) = page.split_once(begin).expect("the story is in it");
    let (told, _) = rest.split_once("</script>").expect("it ends");
    serde_json::from_str(told).expect("it is JSON")
}

fn count(story: &Value, name: &str) -> usize {
    story[name].as_array().map_or(0, Vec::len)
}

#[test]
fn a_page_stands_alone_and_tells_the_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = binary::outcome(folder.path(), &["find", "cup A", "--seed", "3", "--run", "run"]);
    assert!(run.status.success());
    let nowhere = ["show", "run", "--html", "nowhere/page.html"];
    binary::check_refused(folder.path(), &nowhere, 2, &["nowhere/page.html: ", "expected a file"]);
    let page = page(folder.path());
    for outside in ["http://", "https://", "src=", "@import", "{{"] {
        let used = page.replace("http://www.w3.org/2000/svg", "");
        assert!(!used.contains(outside), "{outside} is in the page");
    }
    let story = story(&page);
    assert_eq!(story["report"]["verdict"], "achieved");
    let looks = count(&story, "looks");
    assert_eq!(story["report"]["views"], looks);
    assert_eq!(count(&story, "stands"), looks);
    assert_eq!(count(&story, "beliefs"), looks, "one belief a look at one table");
    assert_eq!(count(&story, "plans"), story["report"]["replans"].as_u64().unwrap_or(0) as usize + 1);
    let deeds = story["deeds"].as_array().expect("deeds");
    assert!(deeds.iter().all(|deed| deed["from_s"].as_f64() <= deed["to_s"].as_f64()), "{deeds:?}");
    assert_eq!(
        deeds.iter().filter(|deed| deed["call"].as_str().is_some_and(|c| c.contains("observe"))).count(),
        looks
    );
    // What people read is said as the domain says it; what a step is called in the plan is beside it.
    assert_eq!(story["wanted"], "the certainty of where cup A stands is at least 0.8");
    let steps = story["plans"][0]["steps"].as_array().expect("steps");
    let said = |step: &Value| step["said"].as_str().unwrap_or_default().to_string();
    assert!(steps.iter().any(|step| said(step).starts_with("looking at the table from ")), "{steps:?}");
    assert_eq!(story["body_radius_m"], 0.25);
    let sought = &story["sought"][0];
    assert_eq!(
        (&sought["name"], &sought["wanted"]),
        (&"the certainty of where cup A stands".into(), &0.8.into())
    );
    assert!(sought["values"].as_array().is_some_and(|values| values.len() > looks), "{sought}");
    let texts: Vec<&str> =
        story["moments"].as_array().into_iter().flatten().filter_map(|m| m["text"].as_str()).collect();
    let raw = texts
        .iter()
        .find(|text| ["(move ", "(observe ", "(confidence ", "_"].iter().any(|r| text.contains(r)));
    assert_eq!(raw, None, "this is no sentence");
    // After each look it is said how sure it is, why it is no surer, and how much is unseen.
    let known: Vec<&str> =
        story["known"].as_array().into_iter().flatten().filter_map(|k| k["text"].as_str()).collect();
    assert_eq!(known.len(), looks, "{known:?}");
    for word in ["The certainty of where cup A stands is now 0.", "It is no more because ", "% are left)"] {
        assert!(known[0].contains(word), "{word}: {}", known[0]);
    }
    check_fields(&page, &story);
    assert!(page.len() < 1_000_000 * (looks + 1), "{} bytes for {looks} looks", page.len());
    in_a_browser(folder.path());
}

/// Checks that the script reads existing data: `story.map.rooms` must be a path through the story, and a name
/// with a unit must be a field of something in it.
fn check_fields(page: &str, story: &Value) {
    let (_, script) = page.rsplit_once("<script>").expect("a script");
    let is_of_name = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '.' || c == '?';
    let paths: Vec<Vec<&str>> = script
        .match_indices("story.")
        .map(|(at, word)| {
            let path = script[at + word.len()..].split(|c| !is_of_name(c)).next().unwrap_or_default();
            path.split('.').map(|name| name.trim_end_matches('?')).collect()
        })
        .collect();
    assert!(paths.len() > 20, "{paths:?}");
    for path in paths {
        let mut at = story;
        for name in path {
            // What follows a list, a text or a number is the script's own.
            let Some(fields) = at.as_object() else { break };
            at =
                fields.get(name).unwrap_or_else(|| panic!("the story has no {name}, which the script reads"));
        }
    }
    let fields = |text: &str| -> BTreeSet<String> {
        let names = text.split(|c: char| !(c.is_ascii_alphanumeric() || c == '_'));
        names
            .filter(|name| ["_m", "_s", "_rad"].iter().any(|unit| name.ends_with(unit)))
            .map(str::to_owned)
            .collect()
    };
    let told = fields(&story.to_string());
    // One room has no doors.
    let of_doors = ["centre_m", "along_rad", "width_m"];
    let read = script.match_indices('.').filter_map(|(at, _)| {
        let name = script[at + 1..].split(|c: char| !(c.is_ascii_alphanumeric() || c == '_')).next()?;
        fields(name).pop_first()
    });
    for name in read.filter(|name| !of_doors.contains(&name.as_str())) {
        assert!(told.contains(&name), "no part of the story has {name}, which the script reads");
    }
}

/// Renders the page in Chromium, if it is installed.
fn in_a_browser(folder: &Path) {
    let mut chromium = Command::new("chromium");
    chromium.args([
        "--headless=new",
        "--no-sandbox",
        "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader",
    ]);
    chromium
        .args(["--virtual-time-budget=4000", "--dump-dom"])
        .arg(format!("file://{}", folder.join("page.html").display()));
    let Ok(drawn) = chromium.output() else {
        println!("SKIPPED: the page was not drawn: there is no chromium");
        return;
    };
    let drawn = String::from_utf8_lossy(&drawn.stdout);
    assert!(drawn.contains("r=\"0.25\""), "the body is drawn as large as it is");
    for part in ["<b>achieved</b>", "<title>cup A ", "<polyline", "class=\"verdict now\"", "Seen by now: "] {
        assert!(drawn.contains(part), "{part} is not drawn");
    }
}

#[test]
fn a_run_that_was_killed_is_told_as_far_as_it_went() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut child = binary::start(folder.path(), &["find", "cup A", "--seed", "2", "--run", "run"]);
    binary::first_line(&mut child);
    child.kill().expect("it is killed");
    child.wait().expect("it has ended");
    let story = story(&page(folder.path()));
    assert_eq!((&story["goal"], &story["report"]), (&Value::from("find cup A"), &Value::Null));
}
