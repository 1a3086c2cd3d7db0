//! Contrastive explanation why an action is not in a plan: its unmet conditions, and whether plans
//! with it exist and at what cost.

use descry_planner::task::{Atom, Change, Condition, Effect, Predicate, PredicateId, Task, Term, Timed};
use descry_planner::{Attachments, Options, Outcome, Plan, PlanError, Semantics, Source, Span, Step};
use serde::Serialize;

use crate::exit::CommandError;

/// Explanation about one action.
#[derive(Debug, Serialize)]
pub struct Answer {
    /// Action with its arguments, as written in plans.
    pub action: String,
    /// True if the plan that was found contains the action.
    pub in_plan: bool,
    /// Parts of the action's condition that do not hold in the initial state.
    pub unmet: Vec<String>,
    /// Result of planning for the action alone, without the goal.
    pub leads_to_it: Tried,
    /// Result of planning for the goal with the action as part of the plan.
    pub with_it: Tried,
}

/// Result of planning with the action as a goal.
#[derive(Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Tried {
    /// A plan was found.
    Found(Plan),
    /// No plan exists; the text says why.
    None(String),
    /// The search ended without a plan and without a proof, or was not made.
    Open,
}

/// Explains why an action is not in the plan `found`; `asked` is the action as written in plans.
///
/// # Errors
/// [`CommandError::BadInput`] if there is no such action.
pub fn answer(
    task: &Task,
    attachments: &Attachments,
    found: Option<&Plan>,
    asked: &str,
    options: &Options,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Answer, CommandError> {
    let step = step(asked)?;
    let semantics = Semantics::new(task, attachments);
    let (action, mut binding) = semantics.bind(&step).map_err(|misfit| refused(asked, &misfit.reason))?;
    let arguments: Vec<_> = binding.objects[..task.action(action).parameters.len()].to_vec();
    let state = semantics.initial().map_err(CommandError::bad_input)?;
    let condition = &task.action(action).condition;
    let mut parts = Vec::new();
    conjuncts(&condition.start, &mut parts);
    if !task.action(action).is_durative() {
        conjuncts(&condition.over_all, &mut parts);
    }
    let mut unmet = Vec::new();
    for part in parts {
        if let Some(why) = semantics.why_not(&state, part, &mut binding).map_err(CommandError::bad_input)? {
            let values: Vec<String> =
                why.values.iter().map(|(name, value)| format!("{name} is {value}")).collect();
            let values = if values.is_empty() { String::new() } else { format!(" ({})", values.join(", ")) };
            unmet.push(format!("{}{values}", why.condition));
        }
    }
    let is_it = |s: &Step| {
        s.action.eq_ignore_ascii_case(&step.action)
            && s.arguments.len() == step.arguments.len()
            && s.arguments.iter().zip(&step.arguments).all(|(a, b)| a.eq_ignore_ascii_case(b))
    };
    let in_plan = found.is_some_and(|plan| plan.steps.iter().any(is_it));
    let mut marked = task.clone();
    let taken = mark(&mut marked, action.0 as usize, &arguments);
    let goal = std::mem::replace(&mut marked.goal.body, taken.clone());
    let plan = |task: &Task| tried(task, attachments, options, stop);
    let leads_to_it = plan(&marked)?;
    let with_it = match &leads_to_it {
        Tried::None(_) => Tried::Open,
        _ if in_plan => found.cloned().map_or(Tried::Open, Tried::Found),
        _ => {
            marked.goal.body = Condition::And(vec![goal, taken]);
            plan(&marked)?
        }
    };
    Ok(Answer { action: call(&step), in_plan, unmet, leads_to_it, with_it })
}

/// Step that a text names.
fn step(asked: &str) -> Result<Step, CommandError> {
    let plan = Plan::read(&Source::new("--why-not", asked))
        .map_err(|f| refused(asked, f.list[0].message.as_str()))?;
    match <[Step; 1]>::try_from(plan.steps) {
        Ok([step]) => Ok(step),
        Err(_) => Err(refused(asked, "one action was expected")),
    }
}

fn refused(asked: &str, because: &str) -> CommandError {
    CommandError::BadInput(format!("--why-not \"{asked}\": {because}\n  an action looks like \"(move a b)\""))
}

fn conjuncts<'t>(condition: &'t Condition, parts: &mut Vec<&'t Condition>) {
    match condition {
        Condition::And(inner) => inner.iter().for_each(|part| conjuncts(part, parts)),
        other => parts.push(other),
    }
}

/// Makes an action with these arguments set a new marker fact; returns the condition that the
/// marker is set.
fn mark(task: &mut Task, action: usize, arguments: &[descry_planner::task::ObjectId]) -> Condition {
    let predicate = PredicateId(task.predicates.len() as u32);
    let name = "taken".to_string();
    task.predicates.push(Predicate { name, parameters: Vec::new(), stratum: None, span: Span::default() });
    let atom = Atom { predicate, arguments: Vec::new(), span: Span::default() };
    let same = (0..).zip(arguments).map(|(slot, &object)| {
        let sides = [Term::Variable(descry_planner::task::Slot(slot)), Term::Object(object)];
        Condition::Same(Box::new(sides), Span::default())
    });
    let when = Timed { start: Condition::And(same.collect()), ..Timed::default() };
    let change = Change::Add(atom.clone());
    task.actions[action].effects.start.push(Effect {
        forall: Vec::new(),
        when,
        change,
        span: Span::default(),
    });
    Condition::Atom(atom)
}

fn tried(
    task: &Task,
    attachments: &Attachments,
    options: &Options,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Tried, CommandError> {
    let outcome = match descry_planner::plan(task, attachments, options, stop, &mut |_| {}) {
        Ok(outcome) => outcome,
        Err(PlanError::Internal { reason, .. }) => return Err(CommandError::Bug(reason)),
        Err(other) => return Err(CommandError::bad_input(other)),
    };
    Ok(match outcome {
        Outcome::Unsolvable { why, .. } => Tried::None(why.to_string()),
        other => other.plan().cloned().map_or(Tried::Open, Tried::Found),
    })
}

fn call(step: &Step) -> String {
    let arguments: String = step.arguments.iter().map(|a| format!(" {a}")).collect();
    format!("({}{arguments})", step.action)
}

/// Size of a plan in words: steps, cost and makespan.
fn size(plan: &Plan) -> String {
    let cost = plan.cost.map_or(String::new(), |c| format!(", cost {c}"));
    let makespan = plan.makespan_s().map_or(String::new(), |s| format!(", makespan {s:.3}"));
    let steps = plan.steps.len();
    format!("{steps} {}{cost}{makespan}", if steps == 1 { "step" } else { "steps" })
}

impl Answer {
    /// Explanation in sentences, in comparison with the plan that was found.
    pub fn said(&self, found: Option<&Plan>) -> String {
        let action = &self.action;
        let mut lines = Vec::new();
        lines.push(match self.unmet.as_slice() {
            [] => format!("{action} could be taken at once."),
            unmet => format!("{action} cannot be taken at once: it needs {}.", unmet.join(" and ")),
        });
        match &self.leads_to_it {
            Tried::None(why) => {
                let why = indented(&why.replace("(taken)", action));
                lines.push(format!("It can never be taken, whatever the goal:\n{why}"));
                return lines.join("\n");
            }
            Tried::Open => lines.push("Whether it can be taken at all was not settled.".into()),
            Tried::Found(plan) if plan.steps.len() > 1 => {
                let steps: Vec<String> = plan.steps.iter().map(call).collect();
                lines.push(format!("It can be taken: {}.", steps.join(", then ")));
            }
            Tried::Found(_) => {}
        }
        lines.push(match (&self.with_it, found) {
            (_, Some(found)) if self.in_plan => format!("The plan that was found has it ({}).", size(found)),
            (Tried::None(why), _) => {
                format!(
                    "No plan that has it reaches the goal:\n{}",
                    indented(&why.replace("(taken)", action))
                )
            }
            (Tried::Open, _) => "Whether a plan that has it reaches the goal was not settled.".into(),
            (Tried::Found(with), Some(found)) => format!(
                "It is not needed: a plan with it was found that is {}, and one without it that is {}.",
                size(with),
                size(found)
            ),
            (Tried::Found(with), None) => format!("A plan with it was found: {}.", size(with)),
        });
        lines.join("\n")
    }
}

fn indented(text: &str) -> String {
    text.lines().map(|line| format!("  {line}")).collect::<Vec<_>>().join("\n")
}
