//! Running domain: current problem, meanings of calls, grounding of actions, learning from
//! outcomes, and answers. The loop sees nothing else of a domain.

mod end;
mod fallback;
mod focus;
mod grounds;
mod lessons;
mod steps;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, LazyLock};
use std::time::Instant;

use descry_memory::Record;
use descry_memory::belief::Track;
use descry_perception::recognise::Recogniser;
use descry_planner::{Attachments, Plan, Source, Task};
use descry_robots::{PoseEstimate, Robot};
use descry_skills::{Call, Skill, SkillFailure};
use grounds::{doors, expected, kinds, known_by_map, members, no_surface, objects, recalled, things};
use serde_json::json;

pub use crate::abilities::searching::policies::Chooser;
use crate::abilities::searching::policies::{self, By, Look};
use crate::ability::Deed;
use crate::actions::{self, Grounded};
use crate::error::WorldError;
use crate::eyes::{self, Eyes, KnowsAgain};
use crate::geometry::Geometry;
use crate::known::{Known, Thing};
use crate::lexicon::{Lexicon, Places};
use crate::load::Domain;
use crate::looking::{candidates, looks};
use crate::mind::Mind;
use crate::objective::{Goal, VARIABLE};
use crate::origin::{self, Origin};
use crate::own_map::NoMap;
use crate::past::Past;
use crate::programs::Programs;
use crate::round::Round;
use crate::situation::Situation;
use crate::states::States;
use crate::viewpoint::Candidate;
use crate::words::Words;
use crate::{abilities, declared};

/// Reason given when no choice is left.
const NOTHING_LEFT: &str = "no look that is left promises to settle anything";

/// Inputs of a world.
#[derive(Clone)]
pub struct Setting<'a> {
    /// Domain: vocabulary and actions.
    pub domain: &'a Domain,
    /// Goal that is pursued.
    pub goal: &'a Goal,
    /// Body, which is asked for its state and for routes, but not moved here.
    pub robot: Arc<dyn Robot>,
    /// Record of everything that is sensed, done and believed.
    pub record: &'a Record,
    /// Recogniser of segments.
    pub recogniser: &'a dyn Recogniser,
    /// Persistent belief from earlier runs.
    pub past: Option<Past>,
}

/// World model of a run, with goal, policy and programs.
pub struct World<'a> {
    setting: Setting<'a>,
    chooser: Chooser,
    lexicon: Lexicon,
    mind: Mind,
    programs: Programs,
    asked: Vec<Thing>,
    began_ns: i64,
    plans: usize,
    tries: BTreeMap<Call, usize>,
    seen_before: BTreeMap<String, usize>,
    given_up: Option<String>,
    /// Skill, with its arguments, that the current plan leads to.
    heading_for: Option<Deed>,
    /// True if the steps come from a policy, which does not claim that they suffice.
    is_unasked: bool,
    /// Skills, with arguments, that cannot be reached or carried out.
    barred: BTreeSet<Deed>,
}

/// Choice of the next steps, and its maker.
pub enum Choice {
    /// The planner chooses.
    Planner,
    /// Steps chosen without the planner.
    Steps(Plan),
    /// Chosen steps; the planner finds the way to their start.
    Towards {
        /// Planning problem of reaching the start, as goal.
        task: Box<Task>,
        /// Steps to carry out there.
        then: Plan,
    },
    /// No step is chosen, with the reason.
    Nothing(String),
}

impl<'a> World<'a> {
    /// Initial world without observations, with the body at its own pose estimate.
    ///
    /// # Errors
    /// [`WorldError::Domain`] if the domain cannot be used with this body.
    pub fn begin(setting: Setting<'a>, chooser: Chooser, here: &PoseEstimate) -> Result<Self, WorldError> {
        let Setting { domain, goal, robot, .. } = &setting;
        crate::check::runnable(domain).map_err(|f| WorldError::Domain(f.render(false)))?;
        let mut surfaces = candidates::surfaces(domain, &**robot);
        if let Some(unclear) = Places::of_body(&**robot).unclear() {
            return Err(WorldError::Domain(format!("{unclear}\n  {}", crate::lexicon::TOLD_APART)));
        }
        known_by_map(domain, &surfaces)?;
        let mut states = States::default();
        let recalls = abilities::ALL.iter().filter_map(|ability| ability.recalls);
        let maps = recalls.filter_map(|recall| recall(domain, setting.past.as_ref(), &**robot, &mut states));
        let own_map = maps.last().unwrap_or_else(|| Arc::new(NoMap));
        surfaces.extend(own_map.surfaces());
        let index = |name: &String| {
            surfaces.iter().position(|s| s.symbol == *name).ok_or_else(|| no_surface(name, &surfaces))
        };
        let lexicon = Lexicon::new(domain, &Places::of_body(&**robot)).remembering(setting.past.as_ref());
        let asked = things(domain, goal, &states, lexicon.of_type("room"), &surfaces)?;
        let ring = &domain.config.candidates;
        let (mut poses, at) = candidates::candidates(&**robot, &*own_map, &surfaces, ring, here);
        let doors = doors(&**robot, here, &mut poses);
        let known = Known {
            robot: Arc::clone(robot),
            belief: Arc::new(recalled(setting.past.as_ref(), goal, &surfaces)),
            spaces: surfaces.iter().map(|_| Arc::default()).collect(),
            candidates: poses,
            at,
            looked_from: at,
            stands_since_ns: setting.robot.now_ns(),
            errs_by: None,
            things: asked.clone(),
            kinds: kinds(domain, goal, &surfaces),
            asked: goal.asked.surfaces.iter().map(index).collect::<Result<_, _>>()?,
            threshold: goal.threshold,
            time_left_s: goal.deadline_s,
            observed: Default::default(),
            out_of_reach: Default::default(),
            stuck: Default::default(),
            pushes_left: domain.config.limits.pushes,
            doors,
            shut: Default::default(),
            held: None,
            past: setting.past.clone(),
            own_map,
            states,
            expected: Vec::new(),
            geometry: Arc::new(Geometry::of_map(robot.rooms(), robot.doors())),
            surfaces,
        };
        let words = Words::begin(domain, &|word| origin::is_sensed(domain, word))
            .map_err(|e| WorldError::Domain(format!("domain.toml: {e}")))?;
        let mut mind = Mind::new(known, words);
        abilities::used(&domain.config.uses)
            .filter_map(|a| a.begins)
            .for_each(|begins| begins(&mut mind, domain, goal));
        Ok(Self {
            chooser,
            lexicon,
            mind,
            programs: Programs::of(domain),
            asked,
            began_ns: robot.now_ns(),
            plans: 0,
            tries: BTreeMap::new(),
            seen_before: BTreeMap::new(),
            given_up: None,
            heading_for: None,
            is_unasked: false,
            barred: BTreeSet::new(),
            setting,
        })
    }

    /// Number of candidate viewpoints.
    pub fn poses(&self) -> usize {
        self.mind.known.candidates.len()
    }

    /// Number of views taken, and distance driven in metres.
    pub fn taken(&self) -> (usize, f64) {
        (self.mind.views, self.mind.distance_m)
    }

    /// Planning problem of this round, with symbols, facts and goal in PDDL; recorded.
    ///
    /// # Errors
    /// [`WorldError`] if the domain's texts make no task, a fact's program fails, or the record does.
    pub fn round(&mut self) -> Result<Round, WorldError> {
        self.attend();
        let domain = self.setting.domain;
        let situation = Arc::new(Situation::new(self.mind.known.clone(), domain.config.thresholds));
        self.mind.known.geometry = Arc::clone(&situation.geometry);
        let problem = self.problem(&situation)?;
        let mut task = Task::read(&domain.pddl, &problem).map_err(|f| WorldError::Domain(f.render(false)))?;
        if self.setting.goal.question {
            actions::only_looking(&domain.config, &mut task);
        }
        let attachments = self.bind(&situation);
        let said = json!({ "name": problem.name, "pddl": problem.text });
        let record = eyes::put(self.setting.record, "problem", self.setting.robot.now_ns(), &said)?;
        Ok(Round { situation, task, attachments, problem, record })
    }

    /// Updates the inputs of the next round from memory, clock and belief.
    fn attend(&mut self) {
        let Setting { domain, goal, robot, .. } = &self.setting;
        let gone_s = (robot.now_ns() - self.began_ns) as f64 * 1e-9;
        self.mind.known.time_left_s = goal.deadline_s.map(|deadline_s| deadline_s - gone_s);
        self.mind.known.pushes_left = domain.config.limits.pushes.saturating_sub(self.mind.pushes);
        let members =
            if domain.vocabulary.word("is").is_some() { members(&self.mind.known) } else { Vec::new() };
        self.mind.known.things = self.asked.iter().cloned().chain(members).collect();
        if !goal.question {
            let known = &self.mind.known;
            let is_cleared =
                |on: &str| goal.asked.clears.iter().any(|place| place == on || place == VARIABLE);
            let is_held = |track: &Track| known.held.as_ref().is_some_and(|held| held.track == track.id);
            let is_in_the_way = |track: &&Track| is_cleared(&track.on) || is_held(track);
            let seen = known.strangers().filter(is_in_the_way).map(Thing::seen);
            let seen: Vec<Thing> = seen.filter(|_| !goal.asked.clears.is_empty()).collect();
            self.mind.known.things.extend(seen);
        }
        self.mind.known.expected = expected(domain, &self.mind.known);
        self.mind.known.surfaces.iter().for_each(|surface| self.lexicon.learn("surface", &surface.name));
        let names = abilities::ALL.iter().filter_map(|ability| ability.names);
        let names = names.flat_map(|names| names(&self.mind.known));
        names.for_each(|(of, name)| self.lexicon.learn(of, &name));
        self.mind.attend();
    }

    /// Planning problem of this round as PDDL text.
    fn problem(&self, s: &Situation) -> Result<Source, WorldError> {
        let domain = self.setting.domain;
        let vocabulary = &domain.vocabulary;
        let name = format!("round-{}", self.mind.views + 1);
        let mut text =
            format!("(define (problem {name})\n  (:domain {})\n  (:objects\n", domain_name(domain));
        let objects = objects(s, &self.lexicon, domain);
        let named =
            objects.iter().flat_map(|(of, names)| names.iter().map(move |n| (n.as_str(), of.as_str())));
        let (lines, declared) = declared::lines(named, vocabulary);
        text.extend(lines.iter().map(|line| format!("    {line}\n")));
        let constants = vocabulary.task.objects.iter().map(|o| o.name.clone());
        let symbols: Vec<String> = constants.chain(declared).collect();
        text += "  )\n  (:init\n";
        let mut lines: Vec<String> = Vec::new();
        for word in vocabulary.words() {
            match origin::of(domain, &word) {
                Origin::Sensed(fact) => lines.extend((fact.states)(s)),
                Origin::SensedByProgram => {
                    let said = self
                        .programs
                        .state(&word, &symbols, &self.mind.readings)
                        .map_err(WorldError::Domain)?;
                    lines.extend(said);
                }
                _ => {}
            }
        }
        lines.extend(self.mind.words.lines(vocabulary, |name| symbols.iter().any(|s| s == name)));
        for line in lines {
            text += &format!("    {line}\n");
        }
        let metric = if vocabulary.task.actions.iter().any(|a| a.is_durative()) {
            format!("\n  (:metric minimize {})", domain.config.minimise)
        } else {
            String::new()
        };
        text += &format!("  )\n  (:goal {}){metric})\n", self.goal_now(s));
        Ok(Source::new(format!("{name}.pddl"), text))
    }

    /// Goal of this round: the requested condition, with the confidence of *not there* required for
    /// kinds without a seen member.
    fn goal_now(&self, s: &Situation) -> String {
        let goal = &self.setting.goal;
        let surer = |(of, (kind, rooms)): (usize, &(String, Option<Vec<String>>))| {
            let wanted = s.wanted_of(of);
            let (word, room) = match rooms.as_ref().and_then(|rooms| rooms.first()) {
                Some(room) => ("completeness-in", format!(" {room}")),
                None => ("completeness", String::new()),
            };
            let is_said = self.setting.domain.vocabulary.word(word).is_some();
            (wanted > s.threshold && is_said).then(|| format!(" (>= ({word} {kind}{room}) {wanted})"))
        };
        let surer: String = goal.asked.kinds.iter().enumerate().filter_map(surer).collect();
        if surer.is_empty() { goal.pddl.clone() } else { format!("(and {}{surer})", goal.pddl) }
    }

    /// Binds every call to a situation; a program of the domain overrides the built-in answer.
    fn bind(&self, situation: &Arc<Situation>) -> Attachments {
        let started = Instant::now();
        let vocabulary = &self.setting.domain.vocabulary;
        let mut attachments = Attachments::new().with_clock(move || started.elapsed().as_secs_f64());
        for ability in abilities::used(&self.setting.domain.config.uses) {
            for meaning in ability.calls {
                let parameters = vocabulary.parameters(meaning.name).unwrap_or_default();
                let types: Vec<String> = parameters.into_iter().map(|(_, of)| of).collect();
                let reads = meaning.reads.iter().map(|reads| reads.of_call(vocabulary, &types)).collect();
                let situation = Arc::clone(situation);
                attachments.insert(meaning.name, actions::Bound { situation, meaning, reads });
            }
        }
        self.programs.bind(&mut attachments);
        attachments
    }

    /// Choice of the next steps: by the planner, or by a policy while an object is sought.
    pub fn choice(&mut self, round: &Round) -> Choice {
        let s = &round.situation;
        (self.heading_for, self.is_unasked) = (None, false);
        if self.is_beyond_looks(round) {
            return Choice::Nothing(NOTHING_LEFT.into());
        }
        if self.chooser.first_look_here
            && self.mind.views == 0
            && let Some(look) = policies::here(s)
            && let Some(plan) = self.directly(round, &[looks::look(s, look.from, look.on)], true)
        {
            return Choice::Steps(plan);
        }
        let is_asked = policies::is_asked(s);
        loop {
            let barred = &self.barred;
            let is_barred = |look: &Look| barred.contains(&looks::look(s, look.from, look.on));
            let policy = match &mut self.chooser.by {
                By::Policy(policy) if is_asked => policy,
                _ => return Choice::Planner,
            };
            let Some(look) = policies::next(&mut **policy, s, &is_barred) else {
                return Choice::Nothing(NOTHING_LEFT.into());
            };
            let (deed, looks_at_all) = (looks::look(s, look.from, look.on), policy.looks_at_all());
            if let Some(choice) = self.head_for(round, deed, look.from, looks_at_all) {
                return choice;
            }
        }
    }

    /// Bars the last choice, because no plan leads to it.
    pub fn bar(&mut self) {
        self.barred.extend(self.heading_for.take());
        self.is_unasked = false;
    }

    /// True if the steps are taken regardless of expected gain: a policy chooses single views and
    /// does not claim that they suffice.
    pub fn takes_steps_unasked(&self) -> bool {
        self.is_unasked
    }

    /// Maximum number of states that the search for a plan may evaluate.
    pub fn most_states(&self) -> u64 {
        self.setting.domain.config.limits.states
    }

    /// Counts a plan that was made.
    pub fn planned(&mut self) {
        self.plans += 1;
    }

    /// Reason for a call: cost and expected gain.
    pub fn explain(&self, round: &Round, call: &Call) -> String {
        match actions::because(self.setting.domain, call) {
            Some(said) => said,
            None => actions::foremost(self.setting.domain, call)
                .map_or_else(String::new, |part| part.because(&round.situation)),
        }
    }

    /// Job for part `step` of a call, with its time limit; `None` past the last part. `Job::skill`
    /// holds the failure if the call cannot be grounded now.
    ///
    /// # Errors
    /// [`WorldError`] if the call can never be grounded.
    pub fn ground(&self, call: &Call, step: usize) -> Result<Option<Job>, WorldError> {
        let domain = self.setting.domain;
        let limit_s = actions::limit_s(domain, call);
        if let Some(program) = self.programs.action(&call.action) {
            return Ok((step == 0).then(|| Job { skill: Ok(program.perform(call)), limit_s }));
        }
        let Some(grounded) = self.grounded(call, step) else {
            return if step == 0 { Err(WorldError::Bug(format!("{call} has no meaning"))) } else { Ok(None) };
        };
        let s = Situation::new(self.mind.known.clone(), domain.config.thresholds);
        Ok(Some(Job { skill: grounded.skill(&s), limit_s }))
    }

    /// True if a program carries a call out.
    pub fn is_by_program(&self, call: &Call) -> bool {
        self.programs.action(&call.action).is_some()
    }

    fn grounded(&self, call: &Call, step: usize) -> Option<Grounded> {
        actions::grounded(self.setting.domain, call, step)
    }

    /// Adds the body's pose as a viewpoint: after a failure it may be anywhere.
    pub fn stands_at(&mut self, here: &PoseEstimate) {
        let place = here.place();
        let known = &mut self.mind.known;
        let from = &known.candidates[known.at].place;
        if *from != place {
            // The way of a drive that did not arrive was driven all the same, as far as it came.
            let way = self.setting.robot.travel(from, std::slice::from_ref(&place), &[]);
            if let Some(Ok(way)) = way.first() {
                self.mind.distance_m += way.distance_m;
            }
            known.has_moved();
        }
        let found = known.candidates.iter().position(|c| c.place == place);
        known.at = found.unwrap_or_else(|| {
            let symbol = format!("here-{}", known.candidates.len());
            known.candidates.push(Candidate { symbol, place });
            known.candidates.len() - 1
        });
    }
}

/// Recognisers of learned objects of all abilities.
static KNOWS_AGAIN: LazyLock<Vec<KnowsAgain>> =
    LazyLock::new(|| abilities::ALL.iter().filter_map(|ability| ability.again).collect());

/// Perception context of a world.
fn context<'e>(setting: &'e Setting<'_>, robot: &'e dyn Robot) -> Eyes<'e> {
    Eyes {
        record: setting.record,
        recogniser: setting.recogniser,
        objects: &setting.domain.objects,
        robot,
        thresholds: setting.domain.config.thresholds,
        again: KNOWS_AGAIN.as_slice(),
    }
}

/// Part of a call for the body.
pub struct Job {
    /// Skill to run, or the failure if the call cannot be grounded.
    pub skill: Result<Box<dyn Skill>, SkillFailure>,
    /// Time limit on the body's clock, seconds.
    pub limit_s: f64,
}

/// Name of the domain in its PDDL text.
fn domain_name(domain: &Domain) -> &str {
    &domain.vocabulary.task.domain
}
