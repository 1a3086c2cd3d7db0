//! The estimate of a round: from what the agent knows to a planning problem with its calls bound.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Instant;

use descry_domains::doubt::{Doubt, Taken};
use descry_domains::obstacle::{self, Obstacle};
use descry_domains::situation::{Known, Situation};
use descry_domains::{attachments, candidates};
use descry_memory::belief::Track;
use descry_perception::nalgebra::{self, Point3, Vector3};
use descry_planner::{Diagnostic, Findings, Plan, PlanError, Source, Step, Task};
use descry_robots::Push;
use descry_skills::Call;

use super::{Agent, Round};
use crate::exit::CommandError;
use crate::report::Event;

impl Agent<'_> {
    /// Finds out where the body is and where it could look from.
    pub(super) async fn begin(&mut self) -> Result<(), CommandError> {
        let here = self.robot.pose().await.map_err(CommandError::broken)?;
        self.state.surfaces = candidates::surfaces(self.domain, &*self.robot);
        let config = &self.domain.config.candidates;
        let (all, at) = candidates::candidates(&*self.robot, &self.state.surfaces, config, &here);
        self.say(&Event::Goal {
            said: self.goal.said.clone(),
            pddl: self.goal.pddl.clone(),
            start: here.place().to_string(),
            candidates: all.len(),
        })?;
        (self.state.candidates, self.state.at) = (all, at);
        Ok(())
    }

    /// The planning problem of this round: symbols, facts and the goal as PDDL, kept in the record.
    pub(super) fn estimate(&mut self) -> Result<Round, CommandError> {
        let s = &self.state;
        let known = Known {
            robot: Arc::clone(&self.robot),
            belief: Arc::new(s.belief.clone()),
            space: Arc::clone(&s.space),
            candidates: s.candidates.clone(),
            at: s.at,
            surfaces: s.surfaces.clone(),
            things: s.things.clone(),
            kinds: s.kinds.clone(),
            time_left_s: self.time_left_s(),
            observed: s.observed.clone(),
            out_of_reach: s.out_of_reach.clone(),
            stuck: s.stuck.clone(),
            pushes_left: self.domain.config.limits.pushes.saturating_sub(s.pushes),
        };
        let situation = Arc::new(Situation::new(known, self.domain.config.thresholds));
        let name = format!("round-{}", s.totals.views + 1);
        let problem =
            Source::new(format!("{name}.pddl"), situation.problem(self.domain, &name, &self.goal.pddl));
        let task = Task::read(&self.domain.pddl, &problem).map_err(|f| refused(&f))?;
        check_skills(&task)?;
        let started = Instant::now();
        let bound = attachments::bind(&situation, &s.programs, move || started.elapsed().as_secs_f64());
        self.record_problem(&problem)?;
        Ok(Round { situation, task, attachments: bound })
    }

    /// After a failure the body may stand anywhere: that is one more pose to look from.
    pub(super) async fn find_itself(&mut self) -> Result<(), CommandError> {
        let here = self.robot.pose().await.map_err(CommandError::broken)?;
        let place = here.place();
        let known = self.state.candidates.iter().position(|c| c.place == place);
        self.state.at = known.unwrap_or_else(|| {
            let symbol = format!("here-{}", self.state.candidates.len());
            self.state.candidates.push(descry_domains::situation::Candidate { symbol, place });
            self.state.candidates.len() - 1
        });
        Ok(())
    }

    pub(super) fn candidate(&self, symbol: &str) -> Result<usize, CommandError> {
        let found = self.state.candidates.iter().position(|c| c.symbol == symbol);
        found.ok_or_else(|| CommandError::Bug(format!("the plan names `{symbol}`, which is no pose")))
    }

    pub(super) fn surface(&self, symbol: &str) -> Result<usize, CommandError> {
        let found = self.state.surfaces.iter().position(|s| s.symbol == symbol);
        found.ok_or_else(|| CommandError::Bug(format!("the plan names `{symbol}`, which is no surface")))
    }
}

/// Every action of the domain has one skill of its name and arity; what has none is shown under its line.
fn check_skills(task: &Task) -> Result<(), CommandError> {
    let mut findings = Findings { sources: task.sources.to_vec(), list: Vec::new() };
    for action in &task.actions {
        let known: Vec<&str> = descry_skills::ALL.iter().map(|s| s.name()).collect();
        let help =
            format!("skills: {}; a new one is a file in skills/src named like its action", known.join(", "));
        let (name, arity) = (&action.name, action.parameters.len());
        let message = match descry_skills::named(name) {
            None => format!("no skill carries out the action `{name}`"),
            Some(skill) if skill.arity() != arity => {
                format!(
                    "the skill `{name}` takes {} objects, the action has {arity} parameters",
                    skill.arity()
                )
            }
            Some(_) => continue,
        };
        findings
            .list
            .push(Diagnostic::error("no-skill", message, action.span, "this action").with_help(help));
    }
    if findings.list.is_empty() { Ok(()) } else { Err(refused(&findings)) }
}

fn refused(findings: &Findings) -> CommandError {
    CommandError::BadInput(crate::commands::drawn(findings))
}

pub(super) fn planning_failed(error: PlanError) -> CommandError {
    match (error.findings(), &error) {
        (Some(findings), _) => refused(findings),
        (None, _) => CommandError::Bug(error.to_string()),
    }
}

/// Why a step is taken: what it costs and what is hoped from it.
pub(super) fn reason(round: &Round, call: &Call) -> String {
    let s = &round.situation;
    let argument = |n: usize| call.arguments.get(n).map_or("", String::as_str);
    match call.action.as_str() {
        "move" => match (s.candidate(argument(0)), s.candidate(argument(1))) {
            (Ok(from), Ok(to)) => {
                format!("to {}, {:.1} s of driving", s.candidates[to].place, s.travel_s(from, to))
            }
            _ => String::new(),
        },
        "observe" => match s.candidate(argument(0)) {
            Ok(from) => hope(s, from),
            Err(_) => String::new(),
        },
        "push-aside" => match s.obstacle(argument(1)) {
            Ok(what) => {
                let [x, y, z] = s.obstacles()[what].at.into();
                format!("no look can settle what is left; it hides it, at ({x:.2}, {y:.2}, {z:.2}) m")
            }
            Err(_) => String::new(),
        },
        _ => String::new(),
    }
}

/// The single look that settles most a second; none if no look settles anything.
pub(super) fn one_look(s: &Situation) -> Option<Plan> {
    let looks = (0..s.candidates.len()).flat_map(|from| (0..s.surfaces.len()).map(move |on| (from, on)));
    let open =
        looks.filter(|look| !s.observed.contains(look) && s.can_reach(look.0) && s.sees(look.0, look.1));
    let rate = |&(from, on): &(usize, usize)| {
        let share: f64 = s.doubts(on).iter().map(|d| d.share_settled(s, from, Taken::default())).sum();
        share / (s.travel_s(s.at, from) + LOOK_S)
    };
    let (from, on) = open.filter(|look| rate(look) > 0.0).max_by(|a, b| rate(a).total_cmp(&rate(b)))?;
    let symbol = |n: usize| s.candidates[n].symbol.clone();
    let step = |start_s: f64, action: &str, arguments: Vec<String>, duration_s: f64| Step {
        start_s: Some(start_s),
        action: action.into(),
        arguments,
        duration_s,
    };
    let drive_s = if from == s.at { 0.0 } else { s.travel_s(s.at, from) };
    let mut steps = Vec::new();
    if from != s.at {
        steps.push(step(0.0, "move", vec![symbol(s.at), symbol(from)], drive_s));
    }
    steps.push(step(drive_s, "observe", vec![symbol(from), s.surfaces[on].symbol.clone()], LOOK_S));
    Some(Plan { steps, ..Plan::default() })
}

/// What a look takes, as in the domain.
const LOOK_S: f64 = 2.0;

/// What a look is expected to settle.
fn hope(s: &Situation, from: usize) -> String {
    let things = s.things.iter().chain(&s.kinds).map(|t| &t.name);
    let names: Vec<&String> = if s.things.len() + s.kinds.len() > 0 {
        things.collect()
    } else {
        s.surfaces.iter().map(|on| &on.symbol).collect()
    };
    let doubts = names.into_iter().zip(s.doubts(0));
    let said = |(name, doubt): (&String, &Doubt)| {
        if doubt.anywhere {
            return format!("nothing is known yet of where {name} could be");
        }
        let share = doubt.share_settled(s, from, Taken::default()) * 100.0;
        format!("shows {share:.0} % of where {name} is in doubt ({:.2} left)", doubt.remaining())
    };
    doubts.map(said).collect::<Vec<_>>().join(", ")
}

/// How each object that may be pushed aside is pushed from a candidate.
pub(super) fn pushes(s: &Situation, from: usize) -> BTreeMap<String, Push> {
    let push = |o: &Obstacle| Some((o.symbol.clone(), obstacle::push(s, from, o)?));
    s.obstacles().iter().filter_map(push).collect()
}

/// What keeps the agent from saying that what is looked for is not there; none if nothing does.
pub(super) fn what_is_left(s: &Situation) -> Option<String> {
    if s.time_left_s.is_some() && s.doubts(0).iter().any(|doubt| doubt.can_be_settled(s)) {
        return Some("there is no time left for the looks that would settle it".into());
    }
    let Some(thing) = s.things.first() else {
        let unsure = |t: &&Track| t.certainty() < s.thresholds.confidence;
        let places = s.belief.tracks.iter().filter(unsure).map(|t| place(&t.position_m));
        let places: Vec<String> = places.collect();
        if !places.is_empty() {
            return Some(format!(
                "what stands at {} looks the same from every side",
                places.join(" and at ")
            ));
        }
        return s.doubts(0).into_iter().find_map(|doubt| out_of_sight(s, doubt, "more"));
    };
    let best = s
        .belief
        .tracks
        .iter()
        .max_by(|a, b| a.probability_of(&thing.name).total_cmp(&b.probability_of(&thing.name)));
    if let Some(track) = best.filter(|t| t.probability_of(&thing.name) > 1.0 - s.thresholds.confidence) {
        let p = track.probability_of(&thing.name);
        return Some(format!("what stands at {} may be it ({p:.2})", place(&track.position_m)));
    }
    out_of_sight(s, s.doubt_about(0), "it").or_else(|| {
        let (left, t) = (s.doubt_about(0).hidden, &s.thresholds);
        (left > t.remaining + t.out_of_sight).then(|| {
            format!("there is room for it where looks promised to settle that, and did not ({left:.2})")
        })
    })
}

/// Where there is room for something that no look can show; none if too little hangs on it.
fn out_of_sight(s: &Situation, doubt: &Doubt, what: &str) -> Option<String> {
    let (hidden, places) = doubt.out_of_sight(s);
    let middle =
        Point3::from(places.iter().map(|p| p.coords).sum::<Vector3<f64>>() / places.len().max(1) as f64);
    let first = places
        .iter()
        .min_by(|a, b| nalgebra::distance(a, &middle).total_cmp(&nalgebra::distance(b, &middle)))?;
    (hidden > s.thresholds.out_of_sight)
        .then(|| format!("there is room for {what} out of sight, near {} ({hidden:.2})", place(first)))
}

fn place(p: &Point3<f64>) -> String {
    format!("({:.2}, {:.2}) m", p.x, p.y)
}
