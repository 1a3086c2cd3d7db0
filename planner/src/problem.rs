//! Problem that is planned for repeatedly while its state and goal change.

use crate::attachment::Attachments;
use crate::ground::{Keep, Regrounded, Restated, ground_with};
use crate::memory::MemoryLimit;
use crate::model::walk::{self, Part};
use crate::outcome::{Options, Outcome, PlanError};
use crate::pddl::nearest;
use crate::plan::Plan;
use crate::solve::{plan, search_on};
use crate::state::State;
use crate::task::{Atom, Condition, Fact, GroundFluent, ObjectId, Parameter, Scoped, Task, Term};

/// Error: the task has no such name, or the arguments do not fit it; the text says what was
/// expected.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Misnamed(String);

/// Task that is grounded once and planned for from changing states and goals.
///
/// Objects, actions and facts that no action changes are expected to stay. If something changes
/// that grounding relied on, the next call of [`Problem::plan`] grounds again, and
/// [`Problem::regrounded`] says why. An answer is the one that [`plan`](crate::plan()) would give
/// for the present task, except that it may be another among equally good plans.
pub struct Problem {
    task: Task,
    grounded: Option<Restated>,
    regrounded: Option<Regrounded>,
}

impl Problem {
    /// Problem with the initial state and goal of a task.
    pub fn new(mut task: Task) -> Problem {
        let mut seen = rustc_hash::FxHashSet::default();
        task.init.facts.retain(|fact| seen.insert(fact.clone()));
        Problem { task, grounded: None, regrounded: None }
    }

    /// Task with the present state and goal.
    pub fn task(&self) -> &Task {
        &self.task
    }

    /// Reason why the last call of [`Problem::plan`] grounded again; `None` if it did not.
    pub fn regrounded(&self) -> Option<&Regrounded> {
        self.regrounded.as_ref()
    }

    /// Makes a fact true or false in the present state.
    ///
    /// # Errors
    /// [`Misnamed`] if the task has no such predicate or objects.
    pub fn set_fact(&mut self, predicate: &str, arguments: &[&str], holds: bool) -> Result<(), Misnamed> {
        let fact = self.named_fact(predicate, arguments)?;
        let facts = &mut self.task.init.facts;
        match facts.iter().position(|own| *own == fact) {
            None if holds => facts.push(fact),
            Some(place) if !holds => {
                facts.remove(place);
            }
            _ => {}
        }
        Ok(())
    }

    /// Sets the value of a numeric function in the present state.
    ///
    /// # Errors
    /// [`Misnamed`] if the task has no such function or objects.
    pub fn set_number(&mut self, function: &str, arguments: &[&str], value: f64) -> Result<(), Misnamed> {
        let id = self.task.find_function(function).filter(|&id| self.task.function(id).result.is_none());
        let known = self.task.functions.iter().map(|own| own.name.as_str());
        let id = id.ok_or_else(|| unknown("numeric function", function, known))?;
        let arguments = self.objects(function, &self.task.function(id).parameters, arguments)?;
        let fluent = GroundFluent { function: id, arguments };
        let numbers = &mut self.task.init.numbers;
        match numbers.iter_mut().find(|(own, _)| *own == fluent) {
            Some((_, own)) => *own = value,
            None => numbers.push((fluent, value)),
        }
        Ok(())
    }

    /// Fact as a condition, to be used in [`Problem::set_goal`].
    ///
    /// # Errors
    /// [`Misnamed`] if the task has no such predicate or objects.
    pub fn fact(&self, predicate: &str, arguments: &[&str]) -> Result<Condition, Misnamed> {
        let Fact { predicate, arguments } = self.named_fact(predicate, arguments)?;
        let arguments = arguments.iter().map(|&object| Term::Object(object)).collect();
        Ok(Condition::Atom(Atom { predicate, arguments, span: self.task.goal_span }))
    }

    /// Sets the goal, which must have no free variables.
    pub fn set_goal(&mut self, goal: Condition) {
        let mut slots = 0;
        walk::condition(&goal, &mut |part| {
            if let Part::Condition(Condition::Forall(own, _) | Condition::Exists(own, _)) = part {
                slots = own.iter().fold(slots, |slots, quantified| slots.max(quantified.slot.index() + 1));
            }
        });
        self.task.goal = Scoped { slots, body: goal };
    }

    /// Sets the present state; timed literals are dropped.
    pub fn set_state(&mut self, state: &State) {
        self.task.init = state.to_init(&self.task);
    }

    /// Plans from the present state to the present goal, as [`plan`](crate::plan()) does.
    ///
    /// # Errors
    /// Those of [`plan`](crate::plan()).
    pub fn plan(
        &mut self,
        attachments: &Attachments,
        options: &Options,
        stop: &(dyn Fn() -> bool + Sync),
        on_plan: &mut dyn FnMut(&Plan),
    ) -> Result<Outcome, PlanError> {
        let task = &self.task;
        if !task.constraints.is_empty() || !task.preferences.is_empty() {
            self.regrounded = Some(Regrounded::Soft);
            return plan(task, attachments, options, stop, on_plan);
        }
        self.regrounded = match &mut self.grounded {
            None => Some(Regrounded::First),
            Some(grounded) => grounded.restate(task).err(),
        };
        if self.regrounded.is_some() {
            let memory = MemoryLimit::new(options.memory_limit_bytes, options.memory_used);
            let grounded = ground_with(task, memory.counted(), Keep::All, stop).ok();
            let reachable = grounded.filter(|grounded| grounded.goal_reachable);
            self.grounded = reachable.map(|grounded| Restated::new(task, grounded));
        }
        if let Some(Restated { ground, .. }) = &self.grounded {
            let outcome = search_on(task, task, Some(ground), attachments, options, stop, on_plan)?;
            if !matches!(outcome, Outcome::Unsolvable { .. }) {
                return Ok(outcome);
            }
        }
        // Reasons are told by what is grounded for this state and goal alone.
        self.regrounded.get_or_insert(Regrounded::NoPlan);
        plan(task, attachments, options, stop, on_plan)
    }

    fn named_fact(&self, predicate: &str, arguments: &[&str]) -> Result<Fact, Misnamed> {
        let id = self.task.find_predicate(predicate).filter(|&id| self.task.predicate(id).stratum.is_none());
        let known = self.task.predicates.iter().filter(|own| own.stratum.is_none());
        let id = id.ok_or_else(|| unknown("predicate", predicate, known.map(|own| own.name.as_str())))?;
        let arguments = self.objects(predicate, &self.task.predicate(id).parameters, arguments)?;
        Ok(Fact { predicate: id, arguments })
    }

    fn objects(
        &self,
        of: &str,
        parameters: &[Parameter],
        names: &[&str],
    ) -> Result<Box<[ObjectId]>, Misnamed> {
        if parameters.len() != names.len() {
            let (wanted, given) = (parameters.len(), names.len());
            return Err(Misnamed(format!("`{of}` takes {wanted} arguments, not {given}")));
        }
        let object = |(parameter, name): (&Parameter, &&str)| {
            let id = self.task.find_object(name);
            let known = || self.task.objects.iter().map(|own| own.name.as_str());
            let id = id.ok_or_else(|| unknown("object", name, known()))?;
            let fits = self.task.fits(id, &parameter.types);
            fits.then_some(id)
                .ok_or_else(|| Misnamed(format!("`{name}` is of another type than `{of}` takes")))
        };
        parameters.iter().zip(names).map(object).collect()
    }
}

fn unknown<'a>(kind: &str, name: &str, known: impl Iterator<Item = &'a str>) -> Misnamed {
    let near = nearest(name, known).map_or(String::new(), |near| format!("; did you mean `{near}`?"));
    Misnamed(format!("the task has no {kind} `{name}`{near}"))
}
