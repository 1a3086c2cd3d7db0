//! Steps chosen without the planner: the domain's own actions that carry out a skill, where their
//! conditions hold.

use descry_planner::semantics::Binding;
use descry_planner::task::{Action, Comparison, Condition, Quantified, Scoped, Slot, When};
use descry_planner::{Plan, Semantics, Step, Task, after, monitor};

use super::{Choice, World};
use crate::abilities;
use crate::ability::Deed;
use crate::actions::{self, Performer};
use crate::round::Round;

/// Gap between consecutive steps, seconds.
const GAP_S: f64 = 0.001;
/// Maximum number of tried bindings of parameters that the skill's arguments leave open.
const BINDINGS: usize = 64;

impl World<'_> {
    /// Choice for a policy's view: at once, or by a plan that opens, unlocks or charges what is
    /// needed first. `None` if no action can take the view, which is then not chosen again.
    pub(super) fn head_for(
        &mut self,
        round: &Round,
        deed: Deed,
        from: usize,
        is_unadvised: bool,
    ) -> Option<Choice> {
        let s = &round.situation;
        let direct = s.can_drive_to(from).then(|| deed.clone().after_drive(s, from));
        let plan = direct.and_then(|deeds| self.directly(round, &deeds, is_unadvised));
        let choice = plan
            .map(Choice::Steps)
            .or_else(|| self.towards(round, std::slice::from_ref(&deed), is_unadvised));
        match choice {
            Some(_) => (self.heading_for, self.is_unasked) = (Some(deed), true),
            None => self.barred.extend([deed]),
        }
        choice
    }

    /// First of several alternatives that can be carried out at once, if possible one that leaves true
    /// what holds of the goal; `None` if none can be carried out.
    pub(super) fn first_of(&self, round: &Round, all: &[Vec<Deed>]) -> Option<Choice> {
        let kept = reached(round);
        let keeps = |plan: &Plan| monitor(&kept, &round.attachments, plan).is_ok();
        let mut plans = all.iter().filter_map(|deeds| self.directly(round, deeds, false));
        let first = plans.next()?;
        let plan = if keeps(&first) { first } else { plans.find(keeps).unwrap_or(first) };
        Some(Choice::Steps(plan))
    }

    /// Plan of consecutive steps that carry out the skills by the domain's actions, where their
    /// conditions hold; `None` if there are no such actions. `is_unadvised`: ignores calls that advise
    /// on usefulness.
    pub(super) fn directly(&self, round: &Round, deeds: &[Deed], is_unadvised: bool) -> Option<Plan> {
        let freed = is_unadvised.then(|| self.without_advice(&round.task));
        let task = freed.as_ref().unwrap_or(&round.task);
        let semantics = Semantics::new(task, &round.attachments);
        let state = semantics.initial().ok()?;
        let duration_s = |action: &str, arguments: &[String]| -> Option<f64> {
            let step =
                Step { start_s: None, action: action.into(), arguments: arguments.to_vec(), duration_s: 0.0 };
            let (id, binding) = semantics.bind(&step).ok()?;
            let Some(bounds) = &task.action(id).duration else { return Some(0.0) };
            let exact = bounds.iter().find(|b| b.comparison == Comparison::Equal && b.when == When::Start);
            let least =
                bounds.iter().find(|b| b.comparison == Comparison::GreaterOrEqual && b.when == When::Start);
            let seconds = semantics.number(&state, &exact.or(least)?.value, &binding).ok()??;
            Some(seconds).filter(|s| s.is_finite())
        };
        let ways = deeds.iter().map(|deed| self.calls(task, deed)).collect::<Vec<_>>();
        let mut plans = vec![Plan::default()];
        for calls in &ways {
            let mut longer = Vec::new();
            for plan in &plans {
                for (action, arguments) in calls {
                    let Some(takes_s) = duration_s(action, arguments) else { continue };
                    let start_s = plan.makespan_s().map_or(0.0, |ends_s| ends_s + GAP_S);
                    let mut plan = plan.clone();
                    plan.steps.push(Step {
                        start_s: Some(start_s),
                        action: action.clone(),
                        arguments: arguments.clone(),
                        duration_s: takes_s,
                    });
                    if longer.len() < BINDINGS && after(task, &round.attachments, &plan, &[]).is_ok() {
                        longer.push(plan);
                    }
                }
            }
            plans = longer;
        }
        plans.into_iter().next()
    }

    /// Choice of a plan towards the start of the first action that carries out the last skill, and then
    /// that action.
    pub(super) fn towards(&self, round: &Round, deeds: &[Deed], is_unadvised: bool) -> Option<Choice> {
        let freed = is_unadvised.then(|| self.without_advice(&round.task));
        let mut task = freed.unwrap_or_else(|| round.task.clone());
        let (name, arguments) = self.calls(&task, deeds.last()?).into_iter().next()?;
        let semantics = Semantics::new(&task, &round.attachments);
        let step = Step { start_s: Some(0.0), action: name, arguments, duration_s: 0.0 };
        let (id, binding) = semantics.bind(&step).ok()?;
        let state = semantics.initial().ok()?;
        let action = task.action(id);
        let bound = action.duration.iter().flatten().find(|b| b.when == When::Start);
        let duration_s = bound.and_then(|b| semantics.number(&state, &b.value, &binding).ok().flatten());
        let goal = startable(action, &binding);
        task.goal = goal;
        let step = Step { duration_s: duration_s.unwrap_or(0.0), ..step };
        Some(Choice::Towards { task: Box::new(task), then: Plan { steps: vec![step], ..Plan::default() } })
    }

    /// Actions, with all their arguments, that carry out a skill; those that do nothing else first.
    fn calls(&self, task: &Task, deed: &Deed) -> Vec<(String, Vec<String>)> {
        let known = |action: &Performer| task.actions.iter().find(|a| a.name == action.action);
        let performers = actions::performers(self.setting.domain, deed);
        let of = |performer: Performer| {
            let action = known(&performer);
            action.map(|action| bindings(task, action, &performer)).unwrap_or_default()
        };
        performers.into_iter().flat_map(of).collect()
    }

    /// Task without advisory calls in its actions.
    fn without_advice(&self, task: &Task) -> Task {
        let config = &self.setting.domain.config;
        let advises = |name: &str| {
            let mut calls = abilities::used(&config.uses).flat_map(|ability| ability.calls);
            calls.any(|call| call.name == name && call.is_advice && !config.attachments.contains_key(name))
        };
        let mut freed = task.clone();
        for action in &mut freed.actions {
            let condition = std::mem::take(&mut action.condition.start);
            action.condition.start = without(condition, &|module| advises(&task.module(module).name));
        }
        freed
    }
}

/// Task whose goal is what holds already of a round's goal.
fn reached(round: &Round) -> Task {
    let mut task = round.task.clone();
    let parts = match std::mem::replace(&mut task.goal.body, Condition::TRUE) {
        Condition::And(parts) => parts,
        whole => vec![whole],
    };
    let semantics = Semantics::new(&round.task, &round.attachments);
    let Ok(state) = semantics.initial() else { return task };
    let holds = |part: &Condition| {
        semantics.holds(&state, part, &mut Binding::new(round.task.goal.slots)).unwrap_or(false)
    };
    task.goal.body = Condition::And(parts.into_iter().filter(holds).collect());
    task
}

/// Condition without the calls of some modules.
fn without(own: Condition, is_gone: &dyn Fn(descry_planner::task::ModuleId) -> bool) -> Condition {
    match own {
        Condition::And(parts) => {
            Condition::And(parts.into_iter().map(|part| without(part, is_gone)).collect())
        }
        Condition::Call(call) if is_gone(call.module) => Condition::TRUE,
        other => other,
    }
}

/// Condition under which an action may start with some arguments.
fn startable(action: &Action, binding: &Binding) -> Scoped<Condition> {
    let bound = (0..).zip(&action.parameters).zip(&binding.objects).map(|((slot, parameter), object)| {
        let parameter = descry_planner::task::Parameter { objects: [*object].into(), ..parameter.clone() };
        Quantified { slot: Slot(slot), parameter }
    });
    let body = Condition::Exists(bound.collect(), Box::new(action.condition.start.clone()));
    Scoped { slots: action.slots, body }
}

/// Argument bindings of an action; parameters that the skill leaves open take any fitting object.
fn bindings(task: &Task, action: &Action, performer: &Performer) -> Vec<(String, Vec<String>)> {
    let mut all: Vec<Vec<String>> = vec![Vec::new()];
    for (parameter, given) in action.parameters.iter().zip(&performer.arguments) {
        let values: Vec<String> = match given {
            Some(value) => vec![value.clone()],
            None => parameter.objects.iter().map(|id| task.object(*id).name.clone()).collect(),
        };
        let extended = all.iter().flat_map(|before| {
            values.iter().map(move |value| before.iter().chain([value]).cloned().collect::<Vec<_>>())
        });
        all = extended.take(BINDINGS).collect();
    }
    all.into_iter().map(|arguments| (action.name.clone(), arguments)).collect()
}
