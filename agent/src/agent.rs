//! The agent's loop (paper 004, sections III to V): estimate the state, monitor the plan, replan
//! only if the plan is broken, execute, record, perceive, update the belief. It knows no predicate
//! of a domain; their meanings are held by the [`World`].

use std::sync::Arc;
use std::time::Instant;

use descry_domains::actions::Carried;
use descry_domains::conclusion::{Conclusion, Ended};
use descry_domains::error::WorldError;
use descry_domains::looking::looks::one_then;
use descry_domains::note::Note;
use descry_domains::round::Round;
use descry_domains::saying::Saying;
use descry_domains::world::{Choice, Job, Setting, World};
use descry_memory::{Blob, Draft, LogLevel, Meta, Record, RecordId, viewer};
use descry_planner::{Outcome as Planned, Plan, Statistics, Step, Task};
use descry_robots::{Robot, Watch};
use descry_skills::{Call, Context, SkillFailure};

use crate::exit::CommandError;
use crate::reason::{Break, Reason, Trigger};
use crate::report::Event;
use crate::stop::Stop;
use crate::{standing, weigh, written};

/// Agent that pursues one goal.
pub struct Agent<'a> {
    robot: Arc<dyn Robot>,
    record: &'a Record,
    stop: Stop,
    tell: &'a mut dyn FnMut(&Event),
    plan: Option<Plan>,
    /// Failed call because of which there is no plan at present.
    failed: Option<Call>,
    totals: Totals,
    /// Goal in PDDL, by which plans are compared with alternatives; `None` if the domain has
    /// attachments, since comparing would run their programs.
    weighed_by: Option<String>,
}

/// Totals of a run until now.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Totals {
    /// Number of views taken.
    pub views: usize,
    /// Number of plans made.
    pub plans: usize,
    /// Distance driven, metres.
    pub distance_m: f64,
    /// Longest planning call in real time, without the time spent in attachments, seconds.
    pub planning_s: f64,
    /// Longest time spent in attachments during one planning call, seconds.
    pub geometry_s: f64,
}

/// Outcome of asking the world model to choose the next steps.
enum Taken {
    /// The world model chose steps, which are the plan now.
    Up,
    /// The world model has no steps left to choose; the text says why.
    Nothing(String),
    /// The world model leaves the choice to the planner.
    LeftToPlanner,
}

/// Result of a call: the index of the part that failed with its failure, or the number of parts and
/// success.
type Performed = (usize, Result<(), SkillFailure>);

impl<'a> Agent<'a> {
    /// Creates an agent for a body and a record. `tell` receives every event; `stop` stops the body
    /// first and then the run.
    pub fn new(
        robot: Arc<dyn Robot>,
        record: &'a Record,
        stop: Stop,
        tell: &'a mut dyn FnMut(&Event),
    ) -> Self {
        let totals = Totals::default();
        Self { robot, record, stop, tell, plan: None, failed: None, totals, weighed_by: None }
    }

    /// Pursues a goal until it is achieved, until nothing can help, or until a limit is reached.
    ///
    /// # Errors
    /// [`CommandError`] if the body or the store fails for good, or the domain cannot be used.
    pub async fn pursue(
        &mut self,
        setting: Setting<'_>,
        chooser: descry_domains::world::Chooser,
    ) -> Result<(Conclusion, Totals), CommandError> {
        let here = self.robot.pose().await.map_err(CommandError::broken)?;
        let goal = setting.goal;
        self.weighed_by = setting.domain.config.attachments.is_empty().then(|| goal.pddl.clone());
        tracing::info!(goal = %goal.pddl, "pursues");
        let mut world = World::begin(setting, chooser, &here)?;
        self.say(&Event::Goal {
            said: goal.said.clone(),
            pddl: goal.pddl.clone(),
            start: here.place().to_string(),
            candidates: world.poses(),
        })?;
        loop {
            let round = world.round()?;
            if let Some(ended) = self.step(&mut world, &round).await? {
                (self.totals.views, self.totals.distance_m) = world.taken();
                let remembered = world.to_remember();
                self.rest_on(&round, &ended)?;
                let conclusion = Conclusion { remembered, ..world.answer(&round, &ended) };
                tracing::info!(verdict = ?conclusion.verdict, "{}", conclusion.why);
                return Ok((conclusion, self.totals));
            }
        }
    }

    /// Runs one iteration of the loop; returns how the run ended, or `None` if it continues.
    async fn step(&mut self, world: &mut World<'_>, round: &Round) -> Result<Option<Ended>, CommandError> {
        if reached(round) {
            if let Some(late_s) = round.situation.time_left_s.map(|left_s| -left_s).filter(|s| *s > 0.0) {
                return Ok(Some(Ended::Limit(format!(
                    "the goal was reached {late_s:.1} s after the deadline"
                ))));
            }
            let reason = Reason::of(Trigger::NotDenied);
            match self.take_up(world, round, &reason, Vec::new(), World::before_denying)? {
                Taken::Up => world.planned(),
                _ => return Ok(Some(Ended::Reached)),
            }
        } else {
            match self.monitor(world, round) {
                Ok(()) => self.keep(round)?,
                Err(trigger) => {
                    if let Some(ended) = self.replan(world, round, Reason::of(trigger))? {
                        return Ok(Some(ended));
                    }
                }
            }
        }
        if let Some(ended) = world.exhausted(round) {
            return Ok(Some(ended));
        }
        self.check_stopped()?;
        let steps = self.next_steps();
        self.act(world, round, steps).await?;
        Ok(None)
    }

    /// Checks that the remaining plan, from the current state, still reaches the goal; otherwise
    /// returns why a new plan is needed.
    fn monitor(&self, world: &World<'_>, round: &Round) -> Result<(), Trigger> {
        if world.takes_steps_unasked() && !self.rest().steps.is_empty() {
            return Ok(());
        }
        let rest = self.rest();
        let Err(broken) = descry_planner::monitor(&round.task, &round.attachments, &rest) else {
            return Ok(());
        };
        Err(match (&self.plan, &self.failed) {
            (Some(_), _) => Trigger::Broken(Break::of(&broken, &rest)),
            (None, Some(call)) => Trigger::Failed { call: call.clone() },
            (None, None) => Trigger::Begin,
        })
    }

    /// Makes a new plan; returns how the run ends if there is none, else `None`.
    fn replan(
        &mut self,
        world: &mut World<'_>,
        round: &Round,
        reason: Reason,
    ) -> Result<Option<Ended>, CommandError> {
        world.planned();
        match self.take_up(world, round, &reason, Vec::new(), World::choice)? {
            Taken::Up => return Ok(None),
            Taken::Nothing(why) => return Ok(Some(Ended::Undecided(why))),
            Taken::LeftToPlanner => {}
        }
        let left_s = round.situation.time_left_s;
        match self.plan(world, &round.task, round)? {
            Planned::Unsolvable { why, statistics } => {
                let reason = Reason { is_late: left_s.is_some(), ..reason };
                match self.take_up(world, round, &reason, asked_of(&statistics), World::in_time)? {
                    Taken::Up => {}
                    _ => return Ok(Some(Ended::NoPlan(world.reasons(round, why.reasons())))),
                }
            }
            // A domain need not have a word for the deadline.
            Planned::Solved { plan, statistics } if ends_late(&plan, left_s) => {
                let reason = Reason { is_late: true, ..reason };
                match self.take_up(world, round, &reason, asked_of(&statistics), World::in_time)? {
                    Taken::Up => {}
                    _ => return Ok(Some(Ended::Undecided(too_long(&plan, left_s)))),
                }
            }
            Planned::Solved { plan, statistics } => self.adopt(round, plan, &statistics, &reason)?,
            Planned::OutOfTime { best, statistics } | Planned::OutOfMemory { best, statistics } => {
                let most = world.most_states();
                let reason = Reason { search_ended_after: Some(most), ..reason };
                match best {
                    Some(plan) => self.adopt(round, plan, &statistics, &reason)?,
                    None => {
                        match self.take_up(world, round, &reason, asked_of(&statistics), World::fallback)? {
                            Taken::Up => {}
                            _ => {
                                let why = format!(
                                    "the search ended after {most} states; `states` under [limits] allows more"
                                );
                                return Ok(Some(Ended::Undecided(why)));
                            }
                        }
                    }
                }
            }
        }
        Ok(None)
    }

    /// Adopts steps that the world model chooses by the rule `choose`.
    fn take_up<'w>(
        &mut self,
        world: &mut World<'w>,
        round: &Round,
        reason: &Reason,
        calls: Vec<(String, u64)>,
        choose: fn(&mut World<'w>, &Round) -> Choice,
    ) -> Result<Taken, CommandError> {
        loop {
            match choose(world, round) {
                Choice::Nothing(why) => return Ok(Taken::Nothing(why)),
                Choice::Planner => return Ok(Taken::LeftToPlanner),
                Choice::Steps(plan) => {
                    self.intend(round, plan, reason, calls)?;
                    return Ok(Taken::Up);
                }
                Choice::Towards { task, then } => match self.plan(world, &task, round)? {
                    Planned::Solved { plan, statistics } => {
                        let plan = one_then(plan, then);
                        if ends_late(&plan, round.situation.time_left_s) {
                            world.bar();
                            continue;
                        }
                        self.adopt(round, plan, &statistics, reason)?;
                        return Ok(Taken::Up);
                    }
                    _ => world.bar(),
                },
            }
        }
    }

    /// Calls the planner, with more and more candidate viewpoints until a plan is found.
    fn plan(&mut self, world: &World<'_>, task: &Task, round: &Round) -> Result<Planned, CommandError> {
        let mut statistics = Statistics::default();
        for stage in 0.. {
            let Some(focus) = world.focus(round, task, stage) else { break };
            match self.plan_once(&focus.task, round, world.most_states())? {
                Planned::Unsolvable { statistics: asked, .. } if !focus.is_whole => statistics = asked,
                planned => return Ok(planned),
            }
        }
        // Some viewpoints were left out every time: there may be a plan.
        Ok(Planned::OutOfTime { best: None, statistics })
    }

    fn plan_once(&mut self, task: &Task, round: &Round, most: u64) -> Result<Planned, CommandError> {
        let _span = tracing::info_span!("plan").entered();
        let started = Instant::now();
        let options =
            descry_planner::Options { evaluation_limit: Some(most), ..descry_planner::Options::default() };
        let stop = self.stop.clone();
        let is_stopped = || stop.is_asked();
        let planned = descry_planner::plan(task, &round.attachments, &options, &is_stopped, &mut |_| {})
            .map_err(|e| WorldError::of_planner(&e))?;
        self.check_stopped()?;
        let took_s = started.elapsed().as_secs_f64();
        let geometry_s = planned.statistics().attachments.values().map(|asked| asked.time_s).sum();
        let totals = &mut self.totals;
        totals.planning_s = totals.planning_s.max(took_s - geometry_s);
        totals.geometry_s = totals.geometry_s.max(geometry_s);
        Ok(planned)
    }

    fn adopt(
        &mut self,
        round: &Round,
        plan: Plan,
        statistics: &Statistics,
        reason: &Reason,
    ) -> Result<(), CommandError> {
        self.intend(round, plan, reason, asked_of(statistics))
    }

    /// Adopts a plan, and reports and records it.
    fn intend(
        &mut self,
        round: &Round,
        plan: Plan,
        reason: &Reason,
        calls: Vec<(String, u64)>,
    ) -> Result<(), CommandError> {
        self.totals.plans += 1;
        let because = reason.told(&Saying::default());
        tracing::info!(plan = self.totals.plans, steps = plan.steps.len(), "plans because {because}");
        let event = Event::Planned {
            round: self.totals.plans,
            because,
            reason: Some(reason.clone()),
            steps: plan.steps.clone(),
            makespan_s: plan.makespan_s().unwrap_or(0.0),
            calls,
        };
        let left = self.rest();
        let weighed =
            self.weighed_by.as_ref().map(|goal| weigh::blob(&weigh::weigh(round, &plan, &left, goal)));
        let more = std::iter::once(standing::blob(round)).chain(weighed);
        let said = self.say_with(&event, more.collect::<Result<_, _>>()?)?;
        self.record.hold(&[round.record, said], "plan").map_err(CommandError::broken)?;
        (self.plan, self.failed) = (Some(plan), None);
        Ok(())
    }

    fn keep(&mut self, round: &Round) -> Result<(), CommandError> {
        let event = Event::Kept { left: self.rest().steps.len() };
        self.say_with(&event, vec![standing::blob(round)?]).map(|_| ())
    }

    /// Steps of the plan that are not executed yet.
    fn rest(&self) -> Plan {
        self.plan.clone().unwrap_or_default()
    }

    /// Removes from the plan the steps to execute next: the first, and all that start before any of
    /// these ends. Their times become relative to the first one's start; times of the remaining
    /// plan, to the start of its own first step. An empty plan stays empty (it means that the goal
    /// holds).
    fn next_steps(&mut self) -> Vec<Step> {
        let plan = self.plan.get_or_insert_with(Plan::default);
        let first_s = plan.steps.first().and_then(|s| s.start_s).unwrap_or(0.0);
        let mut ends_s = f64::INFINITY;
        let mut count = 0;
        for step in &plan.steps {
            let start_s = step.start_s.unwrap_or(if count == 0 { first_s } else { f64::INFINITY });
            if count > 0 && start_s >= ends_s {
                break;
            }
            ends_s = ends_s.min(start_s + step.duration_s);
            count += 1;
        }
        let mut steps: Vec<Step> = plan.steps.drain(..count).collect();
        let from = |steps: &mut [Step], first_s: f64| {
            steps.iter_mut().for_each(|s| s.start_s = s.start_s.map(|start_s| start_s - first_s));
        };
        from(&mut steps, first_s);
        // What is left begins when these have ended.
        let next_s = plan.steps.first().and_then(|s| s.start_s).unwrap_or(0.0);
        from(&mut plan.steps, next_s);
        steps
    }

    /// Executes steps (several at the same time), and updates the world model from each outcome.
    async fn act(
        &mut self,
        world: &mut World<'_>,
        round: &Round,
        steps: Vec<Step>,
    ) -> Result<(), CommandError> {
        let call = |s: &Step| Call { action: s.action.clone(), arguments: s.arguments.clone() };
        let carried: Vec<Carried> =
            steps.into_iter().map(|step| Carried { call: call(&step), step }).collect();
        for Carried { call, .. } in &carried {
            let because = world.explain(round, call);
            tracing::info!(%call, "begins");
            self.say(&Event::Acting { call: call.clone(), because })?;
        }
        let begun_ns = self.robot.now_ns();
        let performed = match carried.as_slice() {
            [only] => vec![self.perform(world, &only.call).await?],
            several => self.perform_together(world, several).await?,
        };
        let mut failed: Vec<(Call, usize, SkillFailure)> = Vec::new();
        let mut done: Vec<Carried> = Vec::new();
        for (carried, (part, result)) in carried.into_iter().zip(performed) {
            match result {
                Ok(()) => done.push(carried),
                Err(failure) => failed.push((carried.call, part, failure)),
            }
        }
        self.wait_for_programs(world, &done, begun_ns).await?;
        let unmet = world.done(round, &done)?;
        failed.extend(unmet.into_iter().map(|(call, failure)| (call, usize::MAX, failure)));
        for (call, part, failure) in &failed {
            self.learn_from_failure(world, round, call, *part, failure).await?;
        }
        Ok(())
    }

    /// Lets the planned time of completed steps that programs carried out pass on the body's clock, which
    /// may stand still meanwhile; the steps began at `begun_ns`.
    async fn wait_for_programs(
        &self,
        world: &World<'_>,
        done: &[Carried],
        begun_ns: i64,
    ) -> Result<(), CommandError> {
        let by_program = done.iter().filter(|carried| world.is_by_program(&carried.call));
        let ends_s = by_program.map(|c| c.step.start_s.unwrap_or(0.0) + c.step.duration_s);
        let passed_s = (self.robot.now_ns() - begun_ns) as f64 * 1e-9;
        let Some(left_s) = ends_s.reduce(f64::max).map(|s| s - passed_s).filter(|s| *s > 0.0) else {
            return Ok(());
        };
        let watch = Watch { cancel: self.stop.token().clone(), ..Watch::default() };
        let waited = self.robot.wait(left_s, &watch).await;
        self.check_stopped()?;
        waited.map_err(CommandError::broken)
    }

    /// Executes the parts of a call in order, and updates the world model from each outcome.
    async fn perform(&mut self, world: &mut World<'_>, call: &Call) -> Result<Performed, CommandError> {
        for part in 0.. {
            let Some(job) = world.ground(call, part)? else { return Ok((part, Ok(()))) };
            match self.execute(job).await {
                Ok(outcome) => self.learn(world, call, part, &outcome)?,
                Err(failure) => return Ok((part, Err(failure))),
            }
        }
        Ok((0, Ok(())))
    }

    /// Executes several calls at the same time, one part of each at a time. Outcomes are processed
    /// in plan order, so that a run is reproducible.
    async fn perform_together(
        &mut self,
        world: &mut World<'_>,
        carried: &[Carried],
    ) -> Result<Vec<Performed>, CommandError> {
        let mut ended: Vec<Option<Performed>> = vec![None; carried.len()];
        for part in 0.. {
            let open: Vec<usize> = (0..carried.len()).filter(|&n| ended[n].is_none()).collect();
            if open.is_empty() {
                break;
            }
            let mut jobs = Vec::new();
            for &n in &open {
                match world.ground(&carried[n].call, part)? {
                    Some(job) => jobs.push((n, job)),
                    None => ended[n] = Some((part, Ok(()))),
                }
            }
            let running = jobs.into_iter().map(|(n, job)| {
                let outcome = self.execute(job);
                async move { (n, outcome.await) }
            });
            for (n, outcome) in futures_util::future::join_all(running).await {
                match outcome {
                    Ok(outcome) => self.learn(world, &carried[n].call, part, &outcome)?,
                    Err(failure) => ended[n] = Some((part, Err(failure))),
                }
            }
        }
        Ok(ended.into_iter().flatten().collect())
    }

    async fn execute(&self, job: Job) -> Result<descry_skills::Outcome, SkillFailure> {
        let context = Context {
            robot: &*self.robot,
            cancel: self.stop.token().clone(),
            time_limit_s: job.limit_s,
            progress: &|_| {},
        };
        job.skill?.perform(&context).await
    }

    /// Updates the world model from the outcome of one part of a call; reports what was learned.
    fn learn(
        &mut self,
        world: &mut World<'_>,
        call: &Call,
        part: usize,
        outcome: &descry_skills::Outcome,
    ) -> Result<(), CommandError> {
        let mut notes: Vec<Note> = Vec::new();
        let said = world.learn(call, part, outcome, &mut notes)?;
        for note in notes {
            self.say(&Event::Noted(note))?;
        }
        if !said.is_empty() {
            self.say(&Event::Acted { call: call.clone(), outcome: said })?;
        }
        Ok(())
    }

    /// Updates the world model from the failure of a step, after reading the body's pose again.
    async fn learn_from_failure(
        &mut self,
        world: &mut World<'_>,
        round: &Round,
        call: &Call,
        part: usize,
        failure: &SkillFailure,
    ) -> Result<(), CommandError> {
        self.check_stopped()?;
        (self.plan, self.failed) = (None, Some(call.clone()));
        let is_final = |body: &descry_robots::Failure| {
            matches!(body, descry_robots::Failure::Broken { .. } | descry_robots::Failure::Cancelled { .. })
        };
        if let SkillFailure::Body(body) = failure
            && is_final(body)
        {
            world.learn_from_failure(round, call, part, failure)?;
            return Err(CommandError::broken(body));
        }
        let here = self.robot.pose().await.map_err(CommandError::broken)?;
        world.stands_at(&here);
        let lesson = world.learn_from_failure(round, call, part, failure)?;
        tracing::info!(%call, "failed: {failure}");
        let unkept = match failure {
            SkillFailure::Unkept { condition, .. } => condition.clone(),
            _ => None,
        };
        let (call, because, therefore) =
            (call.clone(), failure.to_string(), lesson.told(call, &Saying::default()));
        self.say(&Event::Failed { call, because, unkept, therefore, lesson: Some(lesson) }).map(|_| ())
    }

    /// Returns an error if a stop was requested; the body is idle by then and gets no more
    /// requests.
    fn check_stopped(&self) -> Result<(), CommandError> {
        match self.stop.is_asked() {
            true => Err(CommandError::Stopped { said: "stopped".into(), signal: self.stop.signal() }),
            false => Ok(()),
        }
    }

    /// Records why the run ended, and the doubts that remain.
    fn rest_on(&mut self, round: &Round, ended: &Ended) -> Result<(), CommandError> {
        let body = serde_json::to_value(standing::rests(round, ended))
            .map_err(|e| CommandError::Bug(e.to_string()))?;
        let meta = Meta { body, ..Meta::default() };
        let draft = Draft { meta, kept: true, ..Draft::new(standing::RESTS, self.robot.now_ns()) };
        self.record.put(draft).map(|_| ()).map_err(CommandError::broken)
    }

    /// Reports an event and records it.
    fn say(&mut self, event: &Event) -> Result<RecordId, CommandError> {
        self.say_with(event, Vec::new())
    }

    /// Reports an event and records it, with further data blobs.
    fn say_with(&mut self, event: &Event, more: Vec<Blob<'static>>) -> Result<RecordId, CommandError> {
        (self.tell)(event);
        let body = serde_json::to_value(event).map_err(|e| CommandError::Bug(e.to_string()))?;
        let meta = Meta { body, ..Meta::default() };
        let stamp_ns = self.robot.now_ns();
        let mut blobs = vec![viewer::log(stamp_ns, LogLevel::Info, "descry", &event.to_string())];
        if let Event::Planned { steps, .. } = event {
            blobs.push(viewer::plan(stamp_ns, &written::steps::lines(steps).join("\n")));
        }
        blobs.extend(more);
        let draft = Draft { meta, blobs, ..Draft::new("event", stamp_ns) };
        self.record.put(draft).map_err(CommandError::broken)
    }
}

/// True if a plan takes longer than the time left until the deadline (`left_s`, seconds; `None`: no
/// deadline).
fn ends_late(plan: &Plan, left_s: Option<f64>) -> bool {
    left_s.is_some_and(|left_s| plan.makespan_s().unwrap_or(0.0) > left_s)
}

fn too_long(plan: &Plan, left_s: Option<f64>) -> String {
    let (takes_s, left_s) = (plan.makespan_s().unwrap_or(0.0), left_s.unwrap_or(0.0).max(0.0));
    format!("the plan that was found takes {takes_s:.1} s, and {left_s:.1} s are left until the deadline")
}

/// True if the goal holds now.
fn reached(round: &Round) -> bool {
    descry_planner::monitor(&round.task, &round.attachments, &Plan::default()).is_ok()
}

/// Number of calls of each attachment, by name.
fn asked_of(statistics: &Statistics) -> Vec<(String, u64)> {
    statistics.attachments.iter().map(|(name, c)| (name.clone(), c.calls + c.relaxed)).collect()
}
