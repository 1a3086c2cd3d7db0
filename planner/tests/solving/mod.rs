//! From two texts to an outcome: what the tests of planning without times share.

use std::num::NonZeroUsize;

use descry_planner::{Attachments, Options, Outcome, Source, Task, Verdict, plan, validate};

/// The task, which must be in order.
pub fn read(domain: &str, problem: &str) -> Task {
    let task = Task::read(&Source::new("domain", domain), &Source::new("problem", problem));
    task.unwrap_or_else(|findings| panic!("{}", findings.render(false)))
}

/// Result of planning, with the verdict of the validator on the plan if there is one: it must be valid.
pub fn solve(task: &Task, options: &Options) -> (Outcome, Option<Verdict>) {
    let attachments = Attachments::default();
    let outcome =
        plan(task, &attachments, options, &|| false, &mut |_| {}).expect("no attachment, no refusal");
    let verdict = outcome.plan().map(|plan| validate(task, &attachments, plan));
    assert!(verdict.as_ref().is_none_or(|verdict| verdict.valid), "{verdict:?}");
    (outcome, verdict)
}

/// Plans a task read from two texts, again with one to three threads: all must give the same plan.
pub fn solve_twice(domain: &str, problem: &str, options: &Options) -> (Outcome, Option<Verdict>) {
    let task = read(domain, problem);
    let (outcome, verdict) = solve(&task, options);
    for threads in [1, 2, 3] {
        let abreast = Options { threads: NonZeroUsize::new(threads), ..options.clone() };
        let (again, _) = solve(&task, &abreast);
        assert_eq!(outcome.plan(), again.plan(), "the same task with {threads} threads");
        assert_eq!(outcome.statistics(), again.statistics(), "the same task with {threads} threads");
    }
    (outcome, verdict)
}
