//! How a run ends: when there is nothing left to do, what is remembered, what is answered.

use descry_memory::remember::Remembered;
use descry_robots::Place;

use super::{Round, World};
use crate::abilities;
use crate::answer::{self, Conclusion, Ended};

impl World<'_> {
    /// Why the run cannot go on, if it cannot: a limit is reached, or what is done fails for good or changes nothing.
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
        // A failure that is tried again is progress of a kind: it is counted elsewhere.
        let tries: usize = self.tries.values().sum();
        let times = self.seen_before.entry(format!("{tries} {}", round.problem.text)).or_insert(0);
        *times += 1;
        let why = || format!("the same situation has come back {times} times: what is done changes nothing");
        (*times > limits.repeats).then(|| Ended::Failed(why()))
    }

    /// What is to be remembered after this run, if anything is.
    pub fn to_remember(&self) -> Option<Remembered> {
        let known = &self.mind.known;
        let past = known.past.as_ref()?;
        let looked_at: Vec<String> = (0..known.surfaces.len())
            .filter(|&on| self.mind.regions[on].taken > 0 && self.mind.regions[on].nothing.is_none())
            .map(|on| known.surfaces[on].symbol.clone())
            .collect();
        let mut before = Remembered::clone(&past.remembered);
        before.shapes.extend(known.floor.learned.iter().cloned());
        before.surveyed = known.chart.kept().or(before.surveyed);
        before.things.clone_from(&known.news.things);
        let pose = |waypoint: &str| match &known.candidates.iter().find(|c| c.symbol == waypoint)?.place {
            Place::Pose(pose) => Some([pose.x_m, pose.y_m, pose.yaw_rad]),
            Place::Station(_) => Some([0.0; 3]),
        };
        before.visited = known.news.visited(std::mem::take(&mut before.visited), pose, past.now_unix_s);
        Some(before.after(&known.belief, &looked_at, past.now_unix_s))
    }

    /// What is answered in the end.
    pub fn answer(&self, round: &Round, ended: &Ended) -> Conclusion {
        let abilities = || abilities::used(&self.setting.domain.config.uses);
        let own = abilities().find_map(|a| a.answers);
        let body = round.situation.robot.description();
        let lacks = abilities().flat_map(|a| a.needs).copied().find(|part| !body.has(*part));
        let goal = self.setting.goal;
        own.and_then(|answers| answers(goal, &self.mind, &round.situation, ended))
            .unwrap_or_else(|| answer::conclude(goal, &self.lexicon, &self.mind, round, lacks, ended))
    }
}
