//! What is done where the planner has no plan.

use super::{Choice, NOTHING_LEFT, Round, World, WorldError};
use crate::abilities;
use crate::abilities::searching::{policies, reasons};
use crate::judge::Judge;

impl World<'_> {
    /// What is surely no waste, for when the planner has run out of states: a step, or else a look behind what is shut.
    ///
    /// # Errors
    /// [`WorldError::Domain`] if the domain has no word for being at a pose.
    pub fn fallback(&mut self, round: &Round) -> Result<Choice, WorldError> {
        let s = &round.situation;
        self.heading_for = None;
        let own = abilities::used(&self.setting.domain.config.uses).find_map(|a| a.fallback);
        match own.map_or_else(|| reasons::one_look(s), |fallback| fallback(s)) {
            Some(plan) => Ok(Choice::Steps(plan)),
            None => self.behind(round),
        }
    }

    /// A look behind what is shut.
    fn behind(&mut self, round: &Round) -> Result<Choice, WorldError> {
        let s = &round.situation;
        let look = policies::behind(s, &self.barred).filter(|_| s.held.is_none());
        look.map_or_else(|| Ok(Choice::Nothing(NOTHING_LEFT.into())), |look| self.head_for(round, look))
    }

    /// Whether looks may decide whether the goal holds.
    fn is_open_to_looks(&self, round: &Round) -> bool {
        let (domain, words) = (self.setting.domain, &self.mind.words);
        let judge = Judge::new(domain, words, &round.situation, &round.task, &round.attachments);
        judge.is_some_and(|judge| judge.goal().is_open_to_looks())
    }

    /// Where the goal holds since nothing speaks against it: the look that settles most of what may do so, or else one behind what is shut,
    /// if it is not known.
    ///
    /// # Errors
    /// [`WorldError::Domain`] if the domain has no word for being at a pose.
    pub fn before_denying(&mut self, round: &Round) -> Result<Choice, WorldError> {
        let s = &round.situation;
        self.heading_for = None;
        if s.held.is_some() || !self.is_open_to_looks(round) {
            return Ok(Choice::Nothing(NOTHING_LEFT.into()));
        }
        match reasons::one_look(s) {
            Some(plan) => Ok(Choice::Steps(plan)),
            None => self.behind(round),
        }
    }

    /// What may still help where there is no plan since the time that was given is too short for any, or since what is asked is nothing that
    /// a look promises: the look that settles most a second, if it ends in time.
    ///
    /// # Errors
    /// Never: it is chosen as [`World::fallback`] is.
    pub fn in_time(&mut self, round: &Round) -> Result<Choice, WorldError> {
        let s = &round.situation;
        self.heading_for = None;
        let is_searching = self.setting.domain.config.uses.iter().any(|ability| ability == "searching");
        let is_asked = self.setting.goal.question && self.is_open_to_looks(round);
        let may_look = (s.time_left_s.is_some() || is_asked) && s.held.is_none() && is_searching;
        let look = reasons::one_look(s).filter(|_| may_look);
        Ok(look.map_or_else(|| Choice::Nothing(NOTHING_LEFT.into()), Choice::Steps))
    }
}
