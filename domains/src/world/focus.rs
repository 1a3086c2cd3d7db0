//! Restriction of planning to relevant viewpoints: drives connect every pair of viewpoints, so with
//! many the planner first gets the most relevant ones, and more only if no plan is found.
//!
//! A surface near by stands with all of its viewpoints, one far away with as many as settle what can be
//! settled there, until plans lead to it.

use std::borrow::Cow;
use std::collections::BTreeSet;

use descry_planner::Task;
use descry_planner::task::{Action, ObjectId};

use super::World;
use crate::belief::doubt::Doubt;
use crate::round::Round;
use crate::situation::Situation;

/// Maximum number of viewpoints, by stage; smaller maps are planned on as a whole.
const MOST_VIEWPOINTS: [usize; 2] = [64, 160];
/// Share of the doubt settleable by a surface's views that its viewpoints of the second stage
/// cover.
const COVERED: f64 = 0.98;
/// Predicates whose facts do not by themselves make a viewpoint relevant.
const OF_ANY: [&str; 4] = ["at", "observed", "out-of-reach", "beside"];

/// Task restricted to some of the viewpoints.
pub struct Focus<'t> {
    /// The task.
    pub task: Cow<'t, Task>,
    /// True if all omitted viewpoints are useless now, so that the lack of a plan is conclusive.
    pub is_whole: bool,
}

impl World<'_> {
    /// Task restricted to the viewpoints of a stage (from 0); `None` past the last stage.
    pub fn focus<'t>(&self, round: &Round, task: &'t Task, stage: usize) -> Option<Focus<'t>> {
        let s = &*round.situation;
        if s.candidates.len() <= MOST_VIEWPOINTS[0] {
            return (stage == 0).then_some(Focus { task: Cow::Borrowed(task), is_whole: true });
        }
        let most = *MOST_VIEWPOINTS.get(stage)?;
        let heading = self.heading_for.iter().flat_map(|deed| &deed.arguments);
        let named = words(&self.setting.goal.pddl).chain(heading.map(String::as_str)).collect();
        let mut chosen = always(s, task, &named);
        let ranked = ranked(s, &named);
        let useful =
            |&(_, on): &(f64, usize)| s.viewers(on).iter().copied().filter(move |&from| may_do(s, from, on));
        for place in &ranked {
            if chosen.len() < MOST_VIEWPOINTS[0] {
                chosen.extend(useful(place));
            } else if stage > 0 && chosen.len() < most {
                chosen.extend(covering(s, place.1));
            }
        }
        s.focus_on(chosen.iter().copied().collect());
        let asks_programs = !self.setting.domain.config.attachments.is_empty();
        let is_whole = !asks_programs && ranked.iter().flat_map(useful).all(|from| chosen.contains(&from));
        Some(Focus { task: Cow::Owned(with_viewpoints(task, s, &chosen)), is_whole })
    }
}

/// Words of a condition, including variables and numbers.
fn words(condition: &str) -> impl Iterator<Item = &str> {
    condition.split(|c: char| c.is_whitespace() || c == '(' || c == ')')
}

/// Viewpoints of every stage: at the body, beside shut doors, and those that the goal or the domain
/// names.
fn always(s: &Situation, task: &Task, named: &BTreeSet<&str>) -> BTreeSet<usize> {
    let mut always = BTreeSet::from([s.at]);
    for &door in &s.shut {
        let side = format!("{}-side-", s.doors[door].symbol);
        always.extend((0..s.candidates.len()).filter(|&n| s.candidates[n].symbol.starts_with(&side)));
    }
    let names = |id: &ObjectId| s.candidate(&task.object(*id).name).ok();
    let facts =
        task.init.facts.iter().filter(|fact| !OF_ANY.contains(&task.predicate(fact.predicate).name.as_str()));
    always.extend(facts.flat_map(|fact| fact.arguments.iter().filter_map(names)));
    always.extend(task.init.numbers.iter().flat_map(|(number, _)| number.arguments.iter().filter_map(names)));
    always.extend(named.iter().filter_map(|word| s.candidate(word).ok()));
    always
}

/// Surfaces with possible work, each with the time for going there, seconds: first the named ones
/// and those of the requested things, then the others.
fn ranked(s: &Situation, named: &BTreeSet<&str>) -> Vec<(f64, usize)> {
    let is_named = |on: usize| named.contains(s.surfaces[on].symbol.as_str());
    let is_believed = |on: usize| (0..s.things.len()).any(|what| s.presence(what, on) > 0.5);
    let seconds = |on: usize| {
        if is_named(on) || is_believed(on) {
            return Some(0.0);
        }
        let viewers = s.viewers(on).iter().filter(|&&from| may_do(s, from, on));
        let way_s = viewers.map(|&from| s.travel_s(s.at, from)).reduce(f64::min)?;
        let settles = s.doubts().iter().any(|doubt| doubt.most_settled_on(s, on) > 0.0);
        settles.then(|| way_s + s.in_vain_s(on))
    };
    let mut ranked: Vec<(f64, usize)> =
        (0..s.surfaces.len()).filter_map(|on| Some((seconds(on)?, on))).collect();
    ranked.sort_by(|a, b| a.0.total_cmp(&b.0));
    ranked
}

/// True if a viewpoint of a surface is useful: reachable, and with a view or a manipulation left.
fn may_do(s: &Situation, from: usize, on: usize) -> bool {
    let is_work = s.held.is_some() || s.on_surface(on).next().is_some();
    s.can_reach(from) && (is_work || !s.observed.contains(&(from, on)))
}

/// Viewpoints of a surface that together settle nearly all doubt that views can settle there.
fn covering(s: &Situation, on: usize) -> Vec<usize> {
    let open: Vec<usize> = s
        .viewers(on)
        .iter()
        .copied()
        .filter(|&from| s.can_reach(from) && !s.observed.contains(&(from, on)))
        .collect();
    let mut chosen = Vec::new();
    let covered = |doubt: &Doubt, by: &[usize]| doubt.settled_by(s, by, on);
    for doubt in s.doubts() {
        let enough = COVERED * covered(doubt, &open);
        while covered(doubt, &chosen) < enough {
            let with = |&from: &usize| covered(doubt, &[chosen.as_slice(), &[from]].concat());
            let left = open.iter().filter(|from| !chosen.contains(*from));
            // Of equals the first.
            let best = left.rev().max_by(|a, b| with(a).total_cmp(&with(b))).copied();
            let Some(best) = best else { break };
            chosen.push(best);
        }
    }
    chosen
}

/// Task whose travel actions lead to the chosen viewpoints only.
fn with_viewpoints(task: &Task, s: &Situation, chosen: &BTreeSet<usize>) -> Task {
    let is_chosen =
        |id: &ObjectId| s.candidate(&task.object(*id).name).map_or(true, |from| chosen.contains(&from));
    let is_viewpoint = |id: &ObjectId| s.candidate(&task.object(*id).name).is_ok();
    let mut narrowed = task.clone();
    for action in &mut narrowed.actions {
        let of_viewpoints =
            |action: &Action| action.parameters.iter().filter(|p| p.objects.iter().any(is_viewpoint)).count();
        if of_viewpoints(action) < 2 {
            continue;
        }
        for parameter in &mut action.parameters {
            parameter.objects = parameter.objects.iter().copied().filter(is_chosen).collect();
        }
    }
    narrowed
}
