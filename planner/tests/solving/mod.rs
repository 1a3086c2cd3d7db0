//! From two texts to an outcome: what the tests of planning without times share.

use descry_planner::{Attachments, Options, Outcome, Source, Task, Verdict, plan, validate};

/// The task, which must be in order.
pub fn read(domain: &str, problem: &str) -> Task {
    let task = Task::read(&Source::new("domain", domain), &Source::new("problem", problem));
    task.unwrap_or_else(|findings| panic!("{}", findings.render(false)))
}

/// How planning ends, and what the validator says of the plan if there is one: it must be valid.
pub fn solve(task: &Task, options: &Options) -> (Outcome, Option<Verdict>) {
    let attachments = Attachments::default();
    let outcome =
        plan(task, &attachments, options, &|| false, &mut |_| {}).expect("no attachment, no refusal");
    let verdict = outcome.plan().map(|plan| validate(task, &attachments, plan));
    assert!(verdict.as_ref().is_none_or(|verdict| verdict.valid), "{verdict:?}");
    (outcome, verdict)
}

/// The same of two runs on two texts, which must come to the same plan.
pub fn solve_twice(domain: &str, problem: &str, options: &Options) -> (Outcome, Option<Verdict>) {
    let task = read(domain, problem);
    let (outcome, verdict) = solve(&task, options);
    assert_eq!(outcome.plan(), solve(&task, options).0.plan(), "the same task twice");
    (outcome, verdict)
}
