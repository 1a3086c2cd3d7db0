//! Planner and checker for a browser. `playground/build.py` makes one page of them: `docs/playground/index.html`.

#[cfg(target_arch = "wasm32")]
mod exports;

use descry_planner::{Attachments, Findings, Options, Outcome, Plan, Source, Task, check, plan};
use serde_json::{Value, json};

/// Maximum number of states that one planning run evaluates; the page also limits its time.
const MOST_EVALUATED: u64 = 2_000_000;
/// Names of the domain and the problem in findings.
const NAMES: [&str; 2] = ["domain.pddl", "problem.pddl"];

/// Checks a domain and a problem. Returns the findings as JSON, with byte offsets, and as text for a terminal.
pub fn checked(domain: &str, problem: &str) -> Value {
    let [domain, problem] = [Source::new(NAMES[0], domain), Source::new(NAMES[1], problem)];
    said(&check(&domain, Some(&problem)))
}

/// Plans until `stop` returns true. Returns as JSON the findings if the texts have errors, else the plan, or the reason
/// why there is none.
pub fn planned(domain: &str, problem: &str, stop: &(dyn Fn() -> bool + Sync)) -> Value {
    let task = match Task::read(&Source::new(NAMES[0], domain), &Source::new(NAMES[1], problem)) {
        Ok(task) => task,
        Err(findings) => return said(&findings),
    };
    let options = Options { evaluation_limit: Some(MOST_EVALUATED), ..Options::default() };
    match plan(&task, &Attachments::new(), &options, stop, &mut |_| {}) {
        Ok(Outcome::Unsolvable { why, .. }) => json!({ "status": "unsolvable", "why": why.to_string() }),
        Ok(outcome) => match outcome.plan() {
            Some(plan) => {
                json!({ "status": "solved", "steps": steps(plan), "text": plan.to_string(), "cost": plan.cost })
            }
            None => json!({ "status": "out_of_time" }),
        },
        Err(error) => json!({ "status": "failed", "why": error.to_string() }),
    }
}

fn steps(plan: &Plan) -> Vec<Value> {
    let named = |step: &descry_planner::Step| {
        let words: Vec<&str> =
            std::iter::once(&step.action).chain(&step.arguments).map(String::as_str).collect();
        json!({ "name": words.join(" "), "start_s": step.start_s, "duration_s": step.duration_s })
    };
    plan.steps.iter().map(named).collect()
}

fn said(findings: &Findings) -> Value {
    let list = findings.list.iter().map(|finding| {
        let span = finding.labels.first().map(|label| label.span);
        json!({
            "severity": finding.severity,
            "code": finding.code,
            "message": finding.message,
            "help": finding.help,
            "text": span.map(|span| span.source),
            "start": span.map(|span| span.start),
            "end": span.map(|span| span.end),
        })
    });
    json!({ "status": "checked", "findings": list.collect::<Vec<_>>(), "drawn": findings.render(false) })
}
