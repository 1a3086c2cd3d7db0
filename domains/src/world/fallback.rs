//! What is done where the planner has no plan.

use super::{Choice, NOTHING_LEFT, Round, World, WorldError};
use crate::abilities;
use crate::abilities::searching::{policies, reasons};
use crate::answer::denied;

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

    /// Where the goal holds since nothing speaks against it: the look that settles most of what may do so, or else one behind what is shut,
    /// if it is not known.
    ///
    /// # Errors
    /// [`WorldError::Domain`] if the domain has no word for being at a pose.
    pub fn before_denying(&mut self, round: &Round) -> Result<Choice, WorldError> {
        let s = &round.situation;
        self.heading_for = None;
        if s.held.is_some() || !denied::is_open(s, &self.setting.goal.asked.denied) {
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
        let is_short = s.time_left_s.is_some() || self.setting.goal.question;
        let may_look = is_short && s.held.is_none() && is_searching;
        let look = reasons::one_look(s).filter(|_| may_look);
        Ok(look.map_or_else(|| Choice::Nothing(NOTHING_LEFT.into()), Choice::Steps))
    }
}
