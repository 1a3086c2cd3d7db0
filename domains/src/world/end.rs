//! End of a run: final check for remaining work, persistent belief, answer.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use descry_memory::remember::Remembered;
use descry_planner::Task;

use super::grounds::expected;
use super::{Setting, World};
use crate::abilities;
use crate::answer::{self, Asker, Listed};
use crate::conclusion::{Conclusion, Ended};
use crate::config::Answers;
use crate::known::{Thing, thing};
use crate::mind::Region;
use crate::round::Round;
use crate::saying::Saying;
use crate::situation::Situation;
use crate::symbol::symbol;

impl World<'_> {
    /// Reason why the run cannot go on, if any: a limit is reached, or steps fail for good or
    /// change nothing.
    pub fn exhausted(&mut self, round: &Round) -> Option<Ended> {
        if let Some(why) = self.given_up.take() {
            return Some(Ended::Failed(why));
        }
        let limits = &self.setting.domain.config.limits;
        if self.mind.views >= limits.views {
            return Some(Ended::Limit(format!("{} looks were taken and it is still in doubt", limits.views)));
        }
        if self.plans >= limits.plans {
            return Some(Ended::Limit(format!(
                "{} plans were made and the goal is not reached",
                limits.plans
            )));
        }
        let gone_s = (self.setting.robot.now_ns() - self.began_ns) as f64 * 1e-9;
        if gone_s >= limits.seconds {
            return Some(Ended::Limit(format!(
                "{:.0} s are over, the most that a run may take",
                limits.seconds
            )));
        }
        if self.setting.goal.deadline_s.is_some_and(|deadline_s| gone_s >= deadline_s) {
            return Some(Ended::Undecided("the time that was given is over".into()));
        }
        // A failure that is tried again is progress of a kind: it is counted elsewhere.
        let tries: usize = self.tries.values().sum();
        let times = self.seen_before.entry(format!("{tries} {}", round.problem.text)).or_insert(0);
        *times += 1;
        let why = || format!("the same situation has come back {times} times: what is done changes nothing");
        (*times > limits.repeats).then(|| Ended::Failed(why()))
    }

    /// Persistent belief after this run; `None` if the run keeps none.
    pub fn to_remember(&self) -> Option<Remembered> {
        let known = &self.mind.known;
        let past = known.past.as_ref()?;
        let tells =
            |region: &Region| region.taken > 0 && region.nothing.is_none() && region.contradiction.is_none();
        let looked_at: Vec<String> = (0..known.surfaces.len())
            .filter(|&on| tells(&self.mind.regions[on]))
            .map(|on| known.surfaces[on].symbol.clone())
            .collect();
        let mut before = Remembered::clone(&past.remembered);
        abilities::ALL
            .iter()
            .filter_map(|ability| ability.keeps)
            .for_each(|keeps| keeps(known, past, &mut before));
        Some(before.after(&known.belief, &looked_at, past.now_unix_s))
    }

    /// Final answer of a run.
    pub fn answer(&self, round: &Round, ended: &Ended) -> Conclusion {
        let abilities = || abilities::used(&self.setting.domain.config.uses);
        // A question has the answer that its condition has.
        let own = abilities().find_map(|a| a.answers).filter(|_| !self.setting.goal.question);
        let body = round.situation.robot.description();
        let lacks = abilities().flat_map(|a| a.needs).copied().find(|part| !body.has(*part));
        let (domain, goal) = (self.setting.domain, self.setting.goal);
        own.and_then(|answers| answers(goal, &self.mind, &round.situation, ended)).unwrap_or_else(|| {
            let (saying, listed) = (Saying::of_lexicon(domain, &self.lexicon), self.listed());
            let asker = Asker {
                domain,
                goal,
                lexicon: &self.lexicon,
                mind: &self.mind,
                round,
                lacks,
                s: &round.situation,
                saying: &saying,
                listed: listed.as_ref(),
            };
            answer::conclude(&asker, ended)
        })
    }

    /// Whole belief, if the phrase's answer lists parts of it: identity and place of each seen
    /// object, and every kind.
    fn listed(&self) -> Option<Listed> {
        let Setting { domain, goal, .. } = &self.setting;
        let lists = |answer: &Option<String>| answer.as_ref().is_some_and(|text| text.contains('{'));
        let Answers { achieved, not_found, cannot_tell } = &goal.answer;
        [achieved, not_found, cannot_tell].into_iter().any(lists).then_some(())?;
        let mut known = self.mind.known.clone();
        for kind in self.lexicon.of_type("kind") {
            if known.kinds.iter().all(|of| of.symbol != kind.symbol) {
                known.kinds.push(thing(domain, &kind.symbol));
            }
        }
        let mut things = BTreeMap::new();
        for track in &known.belief.tracks {
            let name = track.label().or_else(|| track.kind()).unwrap_or("unknown object");
            let named = |of: &Thing| Thing {
                symbol: format!("{}-{}", of.symbol, track.id),
                track: Some(track.id),
                ..of.clone()
            };
            let kinds = known.kinds.iter().filter(|kind| track.probability_of(&kind.name) > 0.5);
            let label = track.label().map(|label| thing(domain, &symbol(label)));
            for one in kinds.map(named).chain(label.as_ref().map(named)) {
                things.insert(one.symbol.clone(), (track.id, name.to_string(), one));
            }
        }
        let asked: BTreeSet<&String> = self.asked.iter().map(|thing| &thing.symbol).collect();
        things.retain(|symbol, _| !asked.contains(symbol));
        known.things =
            self.asked.iter().cloned().chain(things.values().map(|(.., one)| one.clone())).collect();
        known.expected = expected(domain, &known);
        let situation = Arc::new(Situation::new(known, domain.config.thresholds));
        let task = Task::read(&domain.pddl, &self.problem(&situation).ok()?).ok()?;
        let best = |of: &Thing| {
            let tracks = situation.belief.tracks.iter();
            tracks.max_by(|a, b| a.probability_of(&of.name).total_cmp(&b.probability_of(&of.name)))
        };
        let asked =
            self.asked.iter().filter_map(|of| Some((of.symbol.clone(), (best(of)?.id, of.name.clone()))));
        let things = things.into_iter().map(|(symbol, (id, name, _))| (symbol, (id, name)));
        let things = things.chain(asked).collect();
        Some(Listed { task, attachments: self.bind(&situation), things })
    }
}
