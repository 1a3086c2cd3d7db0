//! Fallback steps when the planner has no plan.

use descry_planner::task::{Condition, Scoped};
use descry_planner::{NoPlan, Plan};

use super::{Choice, NOTHING_LEFT, World};
use crate::abilities::searching::policies::{self, Look};
use crate::ability::Deed;
use crate::judge::{Decisive, Judge, Judgement, Truth};
use crate::looking::looks;
use crate::round::Round;
use crate::situation::Situation;
use crate::{abilities, actions, culprit, origin, words};

impl World<'_> {
    /// Choice after the planner has hit its state limit: a certainly useful step, or else a view behind
    /// a shut door.
    pub fn fallback(&mut self, round: &Round) -> Choice {
        let s = &round.situation;
        (self.heading_for, self.is_unasked) = (None, false);
        if self.is_beyond_looks(round) {
            return Choice::Nothing(NOTHING_LEFT.into());
        }
        if let Some(choice) = self.reveals_to_question(round) {
            return choice;
        }
        let all = self.own_fallback(s).unwrap_or_else(|| looks::look_deeds(s));
        match self.first_of(round, &all) {
            Some(choice) => choice,
            None => self.behind(round),
        }
    }

    /// Fallback plans of the first used ability that has its own; `None` if none has.
    fn own_fallback(&self, s: &Situation) -> Option<Vec<Vec<Deed>>> {
        let own = abilities::used(&self.setting.domain.config.uses).find_map(|a| a.fallback);
        own.map(|fallback| fallback(s))
    }

    /// Choice of a view behind a shut door; [`Choice::Nothing`] if there is none.
    fn behind(&mut self, round: &Round) -> Choice {
        let s = &round.situation;
        loop {
            let barred = &self.barred;
            let is_barred = |look: &Look| barred.contains(&looks::look(s, look.from, look.on));
            let Some(look) = policies::behind(s, &is_barred).filter(|_| s.held.is_none()) else {
                return Choice::Nothing(NOTHING_LEFT.into());
            };
            let deed = looks::look(s, look.from, look.on);
            if let Some(choice) = self.head_for(round, deed, look.from, false) {
                return choice;
            }
        }
    }

    /// Reasons for no plan; a condition that forbids every drive comes first.
    pub fn reasons(&self, round: &Round, all: Vec<NoPlan>) -> Vec<NoPlan> {
        culprit::reasons(self.setting.domain, round, all)
    }

    fn judgement(&self, round: &Round) -> Option<Judgement> {
        let (domain, words) = (self.setting.domain, &self.mind.words);
        let judge = Judge::new(domain, words, &round.situation, &round.task, &round.attachments);
        judge.map(|judge| judge.goal())
    }

    /// True if views may decide the goal.
    fn is_open_to_looks(&self, round: &Round) -> bool {
        self.judgement(round).is_some_and(|judged| judged.is_open_to_looks())
    }

    /// True if the goal is a question that depends on facts of which neither views nor other sensing
    /// actions can tell any.
    pub(super) fn is_beyond_looks(&self, round: &Round) -> bool {
        let of_no_look = |judged: Judgement| {
            let is_open = judged.value == Truth::Unknown;
            let may_be_told = |word: &Decisive| word.is_seen || is_open && self.is_revealed(word);
            !judged.words.is_empty() && !judged.words.iter().any(may_be_told)
        };
        self.setting.goal.question && self.judgement(round).is_some_and(of_no_look)
    }

    /// True if a sensing action can still tell a fact that a program states.
    fn is_revealed(&self, fact: &Decisive) -> bool {
        let domain = self.setting.domain;
        let is_told = || {
            let objects: Option<Vec<String>> = fact.objects.iter().cloned().collect();
            objects.is_some_and(|objects| self.mind.words.is_told(&fact.word, &objects))
        };
        let word = domain.vocabulary.word(&fact.word);
        word.is_some_and(|word| origin::is_found_out(domain, &word)) && !is_told()
    }

    /// Choice of a plan for the sensing actions that reveal one of the facts which leave the goal open;
    /// `None` if no such action is left to try.
    fn reveals(&mut self, round: &Round) -> Option<Choice> {
        let judged = self.judgement(round).filter(|judged| judged.value == Truth::Unknown)?;
        let goal = self.goal_now(&round.situation);
        for fact in judged.words.iter().filter(|fact| self.is_revealed(fact)) {
            let Some(atom) = fact.pddl() else { continue };
            // Whatever its value is to be: a number equals itself once it has one.
            let pddl = if fact.is_number { format!("(= {atom} {atom})") } else { atom };
            let aim = Deed::new("reveal", [pddl.clone()]);
            if self.barred.contains(&aim) {
                continue;
            }
            let mut task = words::with_goal(self.setting.domain, &round.problem, &goal, &pddl).ok()?;
            actions::only_looking(&self.setting.domain.config, &mut task);
            self.heading_for = Some(aim);
            return Some(Choice::Towards { task: Box::new(task), then: Plan::default() });
        }
        None
    }

    /// Choice of the sensing actions that reveal a fact which leaves a question open, though no plan was
    /// found that answers it with yes.
    fn reveals_to_question(&mut self, round: &Round) -> Option<Choice> {
        let choice = self.setting.goal.question.then(|| self.reveals(round)).flatten();
        self.is_unasked = choice.is_some();
        choice
    }

    /// Choice of a view to take before accepting a goal that holds by absence of evidence: the one that
    /// settles most of the contrary evidence, or else one behind a shut door, while the answer is
    /// unknown.
    pub fn before_denying(&mut self, round: &Round) -> Choice {
        let s = &round.situation;
        (self.heading_for, self.is_unasked) = (None, false);
        if let Some(choice) = self.reveals(round) {
            return choice;
        }
        if !self.is_open_to_looks(round) {
            return Choice::Nothing(NOTHING_LEFT.into());
        }
        if s.held.is_some() {
            return self.with_free_hand(round);
        }
        let looks = looks::look_deeds(s).into_iter().chain(self.own_fallback(s).unwrap_or_default());
        match self.first_of(round, &looks.collect::<Vec<_>>()) {
            Some(choice) => choice,
            None => self.behind(round),
        }
    }

    /// Choice of a view while something is in the hand: by a plan that keeps the goal true, and so
    /// puts the object down where the goal allows it.
    fn with_free_hand(&mut self, round: &Round) -> Choice {
        let looks = looks::look_deeds(&round.situation);
        let mut open = looks.into_iter().filter_map(|mut deeds| deeds.pop());
        while let Some(deed) = open.by_ref().find(|deed| !self.barred.contains(deed)) {
            if let Some(Choice::Towards { mut task, then }) =
                self.towards(round, std::slice::from_ref(&deed), false)
            {
                let goal = &round.task.goal;
                let body = Condition::And(vec![task.goal.body, goal.body.clone()]);
                task.goal = Scoped { slots: task.goal.slots.max(goal.slots), body };
                self.heading_for = Some(deed);
                return Choice::Towards { task, then };
            }
            self.barred.extend([deed]);
        }
        Choice::Nothing(NOTHING_LEFT.into())
    }

    /// Choice of a view that may still help without a plan, if time is too short or no view promises the
    /// goal: the one with the highest gain per second that ends in time.
    pub fn in_time(&mut self, round: &Round) -> Choice {
        let s = &round.situation;
        (self.heading_for, self.is_unasked) = (None, false);
        if let Some(choice) = self.reveals_to_question(round) {
            return choice;
        }
        let is_searching = self.setting.domain.config.uses.iter().any(|ability| ability == "searching");
        let is_asked = self.setting.goal.question && self.is_open_to_looks(round);
        let is_of_objects =
            s.things.iter().any(|t| t.track.is_none()) || !(s.kinds.is_empty() && s.asked.is_empty());
        let is_late = s.time_left_s.is_some() && is_of_objects;
        let may_look = (is_late || is_asked) && s.held.is_none() && is_searching;
        let mut looks = if may_look { looks::look_deeds(s) } else { Vec::new() };
        looks.extend(self.own_fallback(s).filter(|_| is_asked && s.held.is_none()).unwrap_or_default());
        self.first_of(round, &looks).unwrap_or_else(|| Choice::Nothing(NOTHING_LEFT.into()))
    }
}
