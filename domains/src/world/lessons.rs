//! Lessons of completed and failed calls: what is remembered, revealed, tried again or given up.

use descry_planner::{Cause, Plan, after, monitor};
use descry_robots::Failure;
use descry_skills::{Call, Outcome, SkillFailure};
use serde_json::json;
use std::sync::Arc;

use super::{World, context};
use crate::ability::MOVE;
use crate::actions::{self, Carried};
use crate::error::WorldError;
use crate::lesson::Lesson;
use crate::note::Note;
use crate::round::Round;
use crate::situation::Situation;
use crate::symbol::symbol;
use crate::{abilities, english, eyes, origin, words};

impl World<'_> {
    /// Updates the world model from the outcome of a call's part; returns a sentence, empty if its
    /// notes say everything.
    ///
    /// # Errors
    /// [`WorldError::Store`] if the record fails.
    pub fn learn(
        &mut self,
        call: &Call,
        step: usize,
        outcome: &Outcome,
        notes: &mut Vec<Note>,
    ) -> Result<String, WorldError> {
        let said = json!({ "call": call.to_string(), "outcome": actions::outcome(outcome) });
        // With what it brings about: a look that came to its end is not in the record without its view.
        self.setting.record.put_soon(eyes::draft("skill", self.setting.robot.now_ns(), &said)?)?;
        if let Outcome::Told(word) = outcome {
            return Ok(word.clone());
        }
        let Some(grounded) = self.grounded(call, step) else { return Ok(String::new()) };
        let s = Situation::new(self.mind.known.clone(), self.setting.domain.config.thresholds);
        let robot = Arc::clone(&self.setting.robot);
        let eyes = context(&self.setting, &*robot);
        let said = (grounded.word.learn)(&mut self.mind, eyes, &s, &grounded.arguments(), outcome, notes)?;
        if matches!(outcome, Outcome::Driven(_)) {
            let hear = abilities::ALL.iter().filter_map(|ability| ability.has_driven);
            hear.for_each(|has_driven| has_driven(&mut self.mind, &s));
        }
        Ok(said)
    }

    /// Handles completed calls: applies their effects on remembered facts and checks their required
    /// effects. Returns the calls whose check failed.
    ///
    /// # Errors
    /// [`WorldError`] as for [`World::round`].
    pub fn done(&mut self, round: &Round, done: &[Carried]) -> Result<Vec<(Call, SkillFailure)>, WorldError> {
        let domain = self.setting.domain;
        let names = origin::remembered(domain);
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let before = self.mind.words.clone();
        let steps = Plan { steps: done.iter().map(|d| d.step.clone()).collect(), ..Plan::default() };
        match after(&round.task, &round.attachments, &steps, &names) {
            Ok(readings) => {
                self.mind.words.take_over(&initial(round, &names), &readings);
                self.reveal(round, &steps);
            }
            // A policy may look where nothing is promised: what was seen is believed all the same.
            Err(_) if self.takes_steps_unasked() => {}
            Err(broken) => {
                let condition = match &broken.cause {
                    Cause::Condition { unmet, .. } => Some(unmet.condition.clone()),
                    _ => None,
                };
                let failure = SkillFailure::Unkept { because: broken.to_string(), condition };
                return Ok(done.iter().map(|d| (d.call.clone(), failure.clone())).collect());
            }
        }
        self.mind.attend();
        let mut unmet = Vec::new();
        for carried in done {
            if let Some(condition) = actions::check(domain, &carried.call)
                && !self.holds_now(&condition)?
            {
                unmet.push((carried.call.clone(), SkillFailure::Unmet { condition }));
            } else {
                self.tries.remove(&carried.call);
            }
        }
        if !unmet.is_empty() {
            self.mind.words = before;
            self.mind.attend();
        }
        Ok(unmet)
    }

    /// Notes the facts stated by programs that completed steps have revealed: those that the steps'
    /// effects set.
    fn reveal(&mut self, round: &Round, steps: &Plan) {
        let domain = self.setting.domain;
        let words = domain.vocabulary.words();
        let revealed = words.iter().filter(|word| origin::is_revealed(domain, word));
        let names: Vec<&str> = revealed.map(|word| word.name.as_str()).collect();
        let before = initial(round, &names);
        let set = after(&round.task, &round.attachments, steps, &names).unwrap_or_default();
        for reading in set.iter().filter(|reading| !before.contains(reading)) {
            let arguments = reading.arguments.iter().map(ToString::to_string).collect();
            self.mind.words.reveal(&reading.symbol, arguments);
        }
    }

    /// True if a condition holds under the current belief.
    fn holds_now(&mut self, condition: &str) -> Result<bool, WorldError> {
        self.attend();
        let domain = self.setting.domain;
        let situation = Arc::new(Situation::new(self.mind.known.clone(), domain.config.thresholds));
        let problem = self.problem(&situation)?;
        // What is no longer believed in holds of nothing.
        if !words::are_known(condition, &problem.text, domain) {
            return Ok(false);
        }
        let goal = self.goal_now(&situation);
        let task = words::with_goal(domain, &problem, &goal, condition).map_err(WorldError::Domain)?;
        Ok(monitor(&task, &self.bind(&situation), &Plan::default()).is_ok())
    }

    /// Updates the world model from a call's failure; returns the conclusion in words.
    ///
    /// # Errors
    /// [`WorldError::Store`] if the record fails.
    pub fn learn_from_failure(
        &mut self,
        round: &Round,
        call: &Call,
        step: usize,
        failure: &SkillFailure,
    ) -> Result<Lesson, WorldError> {
        let domain = self.setting.domain;
        let said = json!({ "call": call.to_string(), "failure": failure.to_string() });
        eyes::put(self.setting.record, "skill", self.setting.robot.now_ns(), &said)?;
        if let Some(grounded) = self.grounded(call, step) {
            let robot = Arc::clone(&self.setting.robot);
            let eyes = context(&self.setting, &*robot);
            let (failed, arguments, s) = (grounded.word.failed, grounded.arguments(), &round.situation);
            let mut therefore = failed(&mut self.mind, eyes, s, &arguments, failure)?;
            if grounded.word.name == MOVE {
                let hear = abilities::ALL.iter().filter_map(|ability| ability.drive_failed);
                for drive_failed in hear {
                    let said = drive_failed(&mut self.mind, &*robot, s, arguments[1], failure);
                    therefore = therefore.or(said);
                }
            }
            if let Some(therefore) = therefore {
                return Ok(Lesson::Said { text: therefore });
            }
        }
        let config = actions::config(domain, call);
        let by = match failure {
            SkillFailure::Body(Failure::Blocked { by: Some(by), .. }) => Some(symbol(by)),
            _ => None,
        };
        let taught: Vec<String> = actions::taught(domain, call, &config, failure, by.as_deref());
        if !taught.is_empty() {
            self.say_all(&taught)?;
            return Ok(Lesson::Facts { facts: taught });
        }
        let tries = self.tries.entry(call.clone()).or_insert(0);
        *tries += 1;
        let (tries, limit) = (*tries, config.retries());
        if failure.is_passing() && tries <= limit {
            return Ok(Lesson::Retry { tries, most: limit + 1 });
        }
        let given_up = actions::substituted(domain, call, &config.gives_up);
        self.say_all(&given_up)?;
        if given_up.is_empty() || tries > limit + 1 {
            self.given_up = Some(format!("{call} has failed {}: {failure}", english::times(tries)));
        }
        Ok(Lesson::GivenUp { facts: given_up })
    }

    fn say_all(&mut self, atoms: &[String]) -> Result<(), WorldError> {
        for atom in atoms {
            self.mind
                .words
                .say(atom)
                .map_err(|e| WorldError::Domain(format!("domain.toml: \"{atom}\": {e}")))?;
        }
        self.mind.attend();
        Ok(())
    }
}

/// Values of some predicates and functions at the beginning of a round.
fn initial(round: &Round, names: &[&str]) -> Vec<descry_planner::Reading> {
    after(&round.task, &round.attachments, &Plan::default(), names).unwrap_or_default()
}
