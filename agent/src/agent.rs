//! The continual loop (paper 004, sections III to V): estimate, monitor, replan only if the plan is broken, execute,
//! record, perceive, believe.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Instant;

use descry_domains::attachments::{self, ProgramAttachment};
use descry_domains::goal::Goal;
use descry_domains::load::Domain;
use descry_domains::situation::{self, Candidate, KnownSurface, Situation, Thing};
use descry_memory::belief::Belief;
use descry_memory::space::Space;
use descry_memory::{Record, RecordId};
use descry_perception::nalgebra::Vector3;
use descry_perception::recognise::Recogniser;
use descry_planner::{Attachments, Outcome as Planned, Plan, Statistics, Task};
use descry_robots::{CancellationToken, Robot};
use descry_skills::{Call, Context, Outcome, SkillFailure, Symbols};

use crate::exit::CommandError;
use crate::policies::{self, By, Chooser};
use crate::report::{Event, Verdict};

mod ground;
pub mod look;

/// A planning call ends after so many evaluated states; then the best plan so far, or one good look, has to do.
const MOST_EVALUATED: u64 = 2_500;

/// An agent at work on one goal.
pub struct Agent<'a> {
    /// What may be said and what it means.
    pub domain: &'a Domain,
    /// The body.
    pub robot: Arc<dyn Robot>,
    /// Everything that is sensed, done and believed.
    pub record: &'a Record,
    /// Tells which object a segment is.
    pub recogniser: &'a dyn Recogniser,
    /// What is pursued.
    pub goal: &'a Goal,
    /// Stops the run.
    pub cancel: CancellationToken,
    /// Who chooses where to look next.
    pub chooser: Chooser,
    tell: &'a mut dyn FnMut(&Event),
    state: State,
}

/// What the agent has come to know and to want.
struct State {
    programs: Vec<(String, Arc<ProgramAttachment>)>,
    things: Vec<Thing>,
    kinds: Vec<Thing>,
    began_ns: i64,
    candidates: Vec<Candidate>,
    at: usize,
    surfaces: Vec<KnownSurface>,
    observed: BTreeSet<(usize, usize)>,
    out_of_reach: BTreeSet<usize>,
    failures: BTreeMap<String, usize>,
    stuck: BTreeSet<(u64, usize)>,
    pushes: usize,
    changes: Vec<look::Change>,
    belief: Belief,
    space: Arc<Space>,
    looks: Vec<Look>,
    /// The problem of this round in the record.
    problem: Option<RecordId>,
    plan: Option<Plan>,
    totals: Totals,
}

/// A view that was taken and recorded.
struct Look {
    stamp_ns: i64,
    record: RecordId,
}

/// What a run has taken so far.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Totals {
    /// Views taken.
    pub views: usize,
    /// Plans made.
    pub plans: usize,
    /// Driven, metres.
    pub distance_m: f64,
    /// Longest time that one planning call took, what it asked of geometry apart, seconds.
    pub planning_s: f64,
    /// Longest time that the attachments of one planning call took, seconds.
    pub geometry_s: f64,
}

/// How a run ended, and why.
#[derive(Debug, Clone)]
pub struct Conclusion {
    /// How.
    pub verdict: Verdict,
    /// Why, in a sentence.
    pub why: String,
    /// How sure it is: of the thing that was looked for, or of everything on the surface.
    pub confidence: f64,
    /// Probability that the thing is there after all.
    pub remaining: Option<f64>,
    /// What is believed.
    pub belief: Belief,
    /// Up, away from the surface.
    pub up: Vector3<f64>,
    /// What it took.
    pub totals: Totals,
}

/// The planning problem of one round, and what its calls are bound to.
struct Round {
    situation: Arc<Situation>,
    task: Task,
    attachments: Attachments,
}

/// What an agent needs to begin.
pub struct Setup<'a> {
    /// See [`Agent::domain`].
    pub domain: &'a Domain,
    /// See [`Agent::robot`].
    pub robot: Arc<dyn Robot>,
    /// See [`Agent::record`].
    pub record: &'a Record,
    /// See [`Agent::recogniser`].
    pub recogniser: &'a dyn Recogniser,
    /// See [`Agent::goal`].
    pub goal: &'a Goal,
    /// See [`Agent::cancel`].
    pub cancel: CancellationToken,
    /// See [`Agent::chooser`].
    pub chooser: Chooser,
}

impl<'a> Agent<'a> {
    /// An agent that knows nothing yet. `tell` hears of everything that happens.
    pub fn new(setup: Setup<'a>, tell: &'a mut dyn FnMut(&Event)) -> Self {
        let Setup { domain, robot, record, recogniser, goal, cancel, chooser } = setup;
        let state = State {
            programs: attachments::programs(domain),
            things: situation::things(domain, &goal.things),
            kinds: situation::things(domain, &goal.kinds),
            began_ns: robot.now_ns(),
            candidates: Vec::new(),
            at: 0,
            surfaces: Vec::new(),
            observed: BTreeSet::new(),
            out_of_reach: BTreeSet::new(),
            failures: BTreeMap::new(),
            stuck: BTreeSet::new(),
            pushes: 0,
            changes: Vec::new(),
            belief: Belief::default(),
            space: Arc::default(),
            looks: Vec::new(),
            problem: None,
            plan: None,
            totals: Totals::default(),
        };
        Self { domain, robot, record, recogniser, goal, cancel, chooser, tell, state }
    }

    /// Pursues the goal until it is achieved, until no look can help any more, or until a limit is reached.
    ///
    /// # Errors
    /// [`CommandError`] if the body or the store fails for good, or the domain cannot be used.
    pub async fn pursue(&mut self) -> Result<Conclusion, CommandError> {
        self.begin().await?;
        loop {
            let round = self.estimate()?;
            if self.reached(&round) {
                return Ok(self.achieved(&round));
            }
            match self.monitor(&round) {
                Ok(()) => self.keep()?,
                Err(because) => {
                    if let Some(why) = self.replan(&round, because)? {
                        return Ok(self.gave_up(&round, &why));
                    }
                }
            }
            if let Some(limit) = self.exhausted() {
                return Ok(self.conclude(&round, Verdict::Failed, limit));
            }
            let call = self.next_call();
            self.say(&Event::Acting { call: call.to_string(), because: ground::reason(&round, &call) })?;
            match self.execute(&round, &call).await {
                Ok(outcome) => self.learn(&round, &call, outcome)?,
                Err(failure) => self.learn_from_failure(&round, &call, &failure).await?,
            }
        }
    }

    /// Does the goal hold now, with nothing more to do?
    fn reached(&self, round: &Round) -> bool {
        descry_planner::monitor(&round.task, &round.attachments, &Plan::default()).is_ok()
    }

    /// Does the rest of the plan, applied to the current state, still reach the goal? If not, the condition that broke.
    /// A policy chooses one look at a time and does not say that it will be enough: its look is taken whatever it promises.
    fn monitor(&self, round: &Round) -> Result<(), String> {
        if matches!(self.chooser.by, By::Policy(_)) && !self.rest().steps.is_empty() {
            return Ok(());
        }
        match (&self.state.plan, descry_planner::monitor(&round.task, &round.attachments, &self.rest())) {
            (_, Ok(())) => Ok(()),
            (None, Err(_)) => Err("there is no plan yet".into()),
            (Some(_), Err(broken)) => Err(broken.to_string()),
        }
    }

    /// Makes a new plan. Returns the reason if there can be none.
    fn replan(&mut self, round: &Round, because: String) -> Result<Option<String>, CommandError> {
        if self.chooser.first_look_here
            && self.state.totals.views == 0
            && let Some(look) = policies::here(&round.situation)
        {
            return self.intend(policies::plan(&round.situation, look), because, Vec::new()).map(|()| None);
        }
        if let By::Policy(policy) = &mut self.chooser.by {
            let Some(look) = policies::next(&mut **policy, &round.situation) else {
                return Ok(Some("no look that is left promises to settle anything".into()));
            };
            return self.intend(policies::plan(&round.situation, look), because, Vec::new()).map(|()| None);
        }
        let started = Instant::now();
        let options = descry_planner::Options {
            evaluation_limit: Some(MOST_EVALUATED),
            ..descry_planner::Options::default()
        };
        let planned = descry_planner::plan(&round.task, &round.attachments, &options, &|| false, &mut |_| {})
            .map_err(ground::planning_failed)?;
        let took_s = started.elapsed().as_secs_f64();
        let geometry_s = planned.statistics().attachments.values().map(|asked| asked.time_s).sum();
        let totals = &mut self.state.totals;
        totals.planning_s = totals.planning_s.max(took_s - geometry_s);
        totals.geometry_s = totals.geometry_s.max(geometry_s);
        match planned {
            Planned::Unsolvable { why, .. } => return Ok(Some(why.to_string())),
            Planned::Solved { plan, statistics } => self.adopt(plan, &statistics, because)?,
            Planned::OutOfTime { best, statistics } | Planned::OutOfMemory { best, statistics } => {
                let because = format!("{because}; the search ended after {MOST_EVALUATED} states");
                let plan = best.or_else(|| ground::one_look(&round.situation));
                let Some(plan) = plan else { return Ok(Some(String::new())) };
                self.adopt(plan, &statistics, because)?;
            }
        }
        Ok(None)
    }

    fn adopt(&mut self, plan: Plan, statistics: &Statistics, because: String) -> Result<(), CommandError> {
        let calls = statistics.attachments.iter();
        let calls = calls.map(|(name, c)| (name.clone(), c.calls + c.relaxed)).collect();
        self.intend(plan, because, calls)
    }

    /// Takes a plan up and says so.
    fn intend(&mut self, plan: Plan, because: String, calls: Vec<(String, u64)>) -> Result<(), CommandError> {
        self.state.totals.plans += 1;
        let said = self.say(&Event::Planned {
            round: self.state.totals.plans,
            because,
            steps: plan.to_string().lines().filter(|l| !l.starts_with(';')).map(str::to_string).collect(),
            makespan_s: plan.makespan_s().unwrap_or(0.0),
            calls,
        })?;
        let held: Vec<RecordId> = self.state.problem.into_iter().chain([said]).collect();
        self.record.hold(&held, "plan").map_err(CommandError::broken)?;
        self.state.plan = Some(plan);
        Ok(())
    }

    fn keep(&mut self) -> Result<(), CommandError> {
        self.say(&Event::Kept { left: self.rest().steps.len() }).map(|_| ())
    }

    /// The steps of the plan that are still to be done.
    fn rest(&self) -> Plan {
        self.state.plan.clone().unwrap_or_default()
    }

    /// Takes the next step off the plan. There is one: where nothing is left to do, the goal holds.
    fn next_call(&mut self) -> Call {
        let plan = self.state.plan.get_or_insert_with(Plan::default);
        let step = plan.steps.remove(0);
        Call { action: step.action, arguments: step.arguments }
    }

    async fn execute(&self, round: &Round, call: &Call) -> Result<Outcome, SkillFailure> {
        let skill = descry_skills::named(&call.action).ok_or_else(|| SkillFailure::Unknown {
            name: call.action.clone(),
            expected: "an action with a skill",
        })?;
        let symbols = Symbols {
            places: self.state.candidates.iter().map(|c| (c.symbol.clone(), c.place.clone())).collect(),
            surfaces: self.state.surfaces.iter().map(|s| (s.symbol.clone(), s.centre())).collect(),
            pushes: ground::pushes(&round.situation, self.state.at),
        };
        let limits = &self.domain.config.limits;
        let time_limit_s = match call.action.as_str() {
            "move" => limits.drive_s,
            "push-aside" => limits.push_s,
            _ => limits.look_s,
        };
        let context = Context {
            robot: &*self.robot,
            symbols: &symbols,
            cancel: self.cancel.clone(),
            time_limit_s,
            progress: &|_| {},
        };
        skill.perform(call, &context).await
    }

    /// What a step brought about: record it, and believe what it showed.
    fn learn(&mut self, round: &Round, call: &Call, outcome: Outcome) -> Result<(), CommandError> {
        self.record_outcome(call, &outcome)?;
        match outcome {
            Outcome::Driven(driven) => {
                self.state.totals.distance_m += driven.distance_m;
                let to = self.candidate(&call.arguments[1])?;
                self.state.at = to;
                let outcome = format!("drove {:.2} m in {:.1} s", driven.distance_m, driven.duration_s);
                self.say(&Event::Acted { call: call.to_string(), outcome })?;
            }
            Outcome::Seen(sensed) => {
                self.remember(&sensed)?;
                self.state.totals.views += 1;
                let (from, on) = (self.candidate(&call.arguments[0])?, self.surface(&call.arguments[1])?);
                self.state.observed.insert((from, on));
                self.perceive(on)?;
            }
            Outcome::Pushed(pushed) => {
                self.something_moved(&round.situation, &call.arguments[1], pushed.moved_m)?;
                let outcome = format!("the hand moved {:.2} m with it", pushed.moved_m);
                self.say(&Event::Acted { call: call.to_string(), outcome })?;
            }
        }
        Ok(())
    }

    /// What a failure teaches: where the body now is, and which pose is worth no further try.
    async fn learn_from_failure(
        &mut self,
        round: &Round,
        call: &Call,
        failure: &SkillFailure,
    ) -> Result<(), CommandError> {
        self.record_failure(call, failure)?;
        self.state.plan = None;
        let SkillFailure::Body(body) = failure else {
            return Err(CommandError::Bug(failure.to_string()));
        };
        if matches!(body, descry_robots::Failure::Broken { .. } | descry_robots::Failure::Cancelled { .. }) {
            return Err(CommandError::broken(body));
        }
        if call.action == "push-aside" {
            return self.push_failed(round, call, body);
        }
        let about = call.arguments.get(usize::from(call.action == "move")).cloned().unwrap_or_default();
        let tries = self.state.failures.entry(format!("{} {about}", call.action)).or_insert(0);
        *tries += 1;
        let limits = &self.domain.config.limits;
        let limit = if call.action == "move" { limits.drive_retries } else { limits.look_retries };
        let give_up = !body.is_passing() || *tries > limit;
        let therefore =
            if give_up { format!("{about} is given up") } else { format!("try {tries} of {}", limit + 1) };
        if give_up {
            let pose = self.candidate(&about)?;
            self.state.out_of_reach.insert(pose);
            if call.action != "move" {
                let on = self.surface(&call.arguments[1])?;
                self.state.observed.insert((pose, on));
            }
        }
        self.say(&Event::Failed { call: call.to_string(), because: body.to_string(), therefore })?;
        self.find_itself().await
    }

    /// Seconds until the deadline, if there is one.
    fn time_left_s(&self) -> Option<f64> {
        let gone_s = (self.robot.now_ns() - self.state.began_ns) as f64 * 1e-9;
        self.goal.deadline_s.map(|deadline_s| deadline_s - gone_s)
    }

    /// The limit that the run has reached, if it has.
    fn exhausted(&self) -> Option<String> {
        let most = self.domain.config.limits.views;
        (self.state.totals.views >= most).then(|| format!("{most} looks were taken and it is still in doubt"))
    }

    fn achieved(&self, round: &Round) -> Conclusion {
        let on = self.goal.surfaces.first().map_or("the table", String::as_str);
        let situation = &round.situation;
        let (verdict, why) = match (situation.things.first(), situation.kinds.first()) {
            (Some(thing), _) => (Verdict::Achieved, format!("{} stands on {on}", thing.name)),
            (None, Some(kind)) => {
                let is = |t: &&descry_memory::belief::Track| t.probability_of(&kind.name) > 0.5;
                match self.state.belief.tracks.iter().filter(is).count() {
                    0 => (Verdict::NotFound, format!("there is no {}", kind.name)),
                    n => (Verdict::Achieved, format!("all of {} are found: {n}", kind.name)),
                }
            }
            (None, None) => (Verdict::Achieved, format!("everything on {on} is identified")),
        };
        self.conclude(round, verdict, why)
    }

    /// What a push that failed teaches: something may have moved nevertheless, and pushing that again leads to nothing.
    fn push_failed(
        &mut self,
        round: &Round,
        call: &Call,
        body: &descry_robots::Failure,
    ) -> Result<(), CommandError> {
        let what = &call.arguments[1];
        let therefore = format!("{what} is not pushed from there again");
        self.say(&Event::Failed { call: call.to_string(), because: body.to_string(), therefore })?;
        let obstacle = round.situation.obstacle(what).map(|n| round.situation.obstacles()[n].track);
        self.state.stuck.extend(obstacle.map(|track| (track, self.state.at)));
        match body {
            descry_robots::Failure::Slipped { moved_m, .. } => {
                self.something_moved(&round.situation, what, *moved_m)
            }
            _ => Ok(()),
        }
    }

    /// No look and no push can bring the goal nearer: it is not there, or it cannot be told.
    fn gave_up(&self, round: &Round, planner_says: &str) -> Conclusion {
        let looked = self.state.totals.views;
        let poses = self.state.candidates.len() - self.state.out_of_reach.len();
        let doubt = ground::what_is_left(&round.situation);
        let (verdict, what) = match (round.situation.things.first(), doubt) {
            (Some(thing), Some(doubt)) => {
                (Verdict::CannotTell, format!("it cannot be told whether {} is there, {doubt}", thing.name))
            }
            (Some(thing), None) => (Verdict::NotFound, format!("{} is not there", thing.name)),
            (None, doubt) => {
                let doubt = doubt.map(|d| format!(", {d}")).unwrap_or_default();
                (Verdict::CannotTell, format!("not everything could be identified{doubt}"))
            }
        };
        let says = if planner_says.is_empty() { String::new() } else { format!(": {planner_says}") };
        let why = format!("{what}; after {looked} looks, with {poses} poses that can be reached{says}");
        self.conclude(round, verdict, why)
    }

    fn conclude(&self, round: &Round, verdict: Verdict, why: String) -> Conclusion {
        let situation = &round.situation;
        let confidence = match (situation.things.is_empty(), situation.kinds.is_empty()) {
            (false, _) => situation.confidence(0),
            (true, false) => situation.completeness(0),
            (true, true) => situation.clarity(0),
        };
        let remaining = (!situation.things.is_empty()).then(|| situation.chance_there(0));
        let (belief, totals) = (self.state.belief.clone(), self.state.totals);
        let up = situation.surfaces.first().map_or_else(Vector3::z, |s| s.up);
        Conclusion { verdict, why, confidence, remaining, belief, up, totals }
    }
}
