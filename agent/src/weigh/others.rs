//! Alternatives to a plan's steps: which are tried, and which are kept.

use std::sync::Arc;

use descry_planner::Step;
use descry_planner::task::{Action, ObjectId};

use super::steps::Instead;
use super::{GAINED, MOST_KEPT, MOST_TRIED, Scale, Way};
use crate::written::call_of;

impl Scale<'_> {
    /// Alternatives to a plan: its last step that has a choice of objects is executed with other
    /// objects, after the steps that this needs.
    pub(super) fn others(&self, steps: &[Step], chosen: &Way) -> Vec<Other> {
        let task = self.semantics.task;
        let choices = |step: &Step| -> Option<Vec<Arc<[ObjectId]>>> {
            let (action, _) = self.semantics.bind(step).ok()?;
            Some(task.action(action).parameters.iter().map(|p| Arc::clone(&p.objects)).collect())
        };
        let count = |all: &[Arc<[ObjectId]>]| {
            all.iter()
                .map(|objects| objects.len())
                .try_fold(1_usize, usize::checked_mul)
                .unwrap_or(usize::MAX)
        };
        let varied = (0..steps.len()).rev().find_map(|n| {
            let all = choices(&steps[n])?;
            (2..=MOST_TRIED).contains(&count(&all)).then_some((n, all))
        });
        let Some((at, all)) = varied else { return Vec::new() };
        let other = |number: usize| {
            let mut rest = number;
            let pick = |objects: &Arc<[ObjectId]>| {
                let object = objects[rest % objects.len()];
                rest /= objects.len();
                task.object(object).name.clone()
            };
            Step { arguments: all.iter().map(pick).collect(), ..steps[at].clone() }
        };
        let ways = (0..count(&all)).map(other).filter(|other| call_of(other) != call_of(&steps[at]));
        let ways = ways.filter_map(|other| self.in_place(steps, at, &other));
        ways.filter(|other| other.way.gains > GAINED && other.way.steps != chosen.steps).collect()
    }

    /// Alternative with step `at` of a plan replaced by `other`: alone, after the same steps with
    /// other objects, or after one connecting step; `None` if none is applicable.
    fn in_place(&self, steps: &[Step], at: usize, other: &Step) -> Option<Other> {
        let instead = Instead::of(&steps[at], other);
        let mut all: Vec<Step> = steps.iter().map(|step| instead.in_step(step)).collect();
        all[at] = other.clone();
        let led = |bridge: Step| std::iter::once(bridge).chain(all[at..].iter().cloned()).collect::<Vec<_>>();
        let bridges = instead.0.iter().flat_map(|(old, new)| self.bridges(old, new, other)).map(led);
        let mut tried = [all[at..].to_vec(), all.clone()].into_iter().chain(bridges);
        let (steps, way) = tried.find_map(|steps| self.way(&steps).map(|way| (steps, way)))?;
        Some(Other { steps, instead, way })
    }

    /// Steps that may lead from one object to another; a third argument is taken from `step`.
    pub(super) fn bridges(&self, from: &str, to: &str, step: &Step) -> Vec<Step> {
        let bridge = |action: &Action, more: &[&String]| {
            let arguments = [from, to].into_iter().chain(more.iter().map(|m| m.as_str()));
            let arguments = arguments.map(str::to_string).collect();
            Step { start_s: None, action: action.name.clone(), arguments, duration_s: 0.0 }
        };
        let actions = self.semantics.task.actions.iter();
        actions
            .flat_map(|action| match action.parameters.len() {
                2 => vec![bridge(action, &[])],
                3 => step.arguments.iter().map(|a| bridge(action, &[a])).collect(),
                _ => Vec::new(),
            })
            .collect()
    }
}

/// Alternative to a plan's steps, with the objects that differ from the plan's.
pub(super) struct Other {
    pub(super) steps: Vec<Step>,
    pub(super) instead: Instead,
    pub(super) way: Way,
}

/// Selects the alternatives to keep: the [`MOST_KEPT`] with the highest gain per second; of the
/// others, the quickest, the one with the greatest gain, and the best about each further object.
pub(super) fn kept(mut all: Vec<Other>) -> Vec<Other> {
    let rate = |a: &Other, b: &Other| b.way.rate().total_cmp(&a.way.rate());
    all.sort_by(|a, b| rate(a, b).then_with(|| a.way.steps.cmp(&b.way.steps)));
    let mut rest = all.split_off(MOST_KEPT.min(all.len()));
    let by = |rest: &[Other], of: fn(&Way) -> f64| {
        (0..rest.len()).min_by(|a, b| of(&rest[*a].way).total_cmp(&of(&rest[*b].way)))
    };
    for of in [(|way| way.takes_s) as fn(&Way) -> f64, |way| -way.gains] {
        all.extend(by(&rest, of).map(|n| rest.remove(n)));
    }
    for other in rest {
        if all.iter().all(|known| known.way.about() != other.way.about()) {
            all.push(other);
        }
    }
    all
}
