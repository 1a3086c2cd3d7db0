//! Explanations of a domain's actions, attachment calls and numbers, as far as a run's explanation
//! mentions them.

use std::collections::BTreeSet;

use descry_agent::weigh::Expected;
use descry_domains::abilities;
use descry_domains::load::Domain;
use descry_domains::origin::{self, Origin};
use descry_domains::saying::Saying;
use descry_planner::task::{Action, CallTerm, Change, Expression};

use super::chapters::Chapter;
use super::wording::listed;

/// Domain of a run, with its wording and the run's plans.
pub struct Words<'a> {
    pub domain: &'a Domain,
    pub saying: &'a Saying,
    pub chapters: &'a [Chapter],
}

impl Words<'_> {
    /// Description of an attachment call that descry itself answers; `None` for other calls.
    pub fn meaning(&self, call: &str) -> Option<String> {
        abilities::meaning(&self.domain.config, call)
    }

    /// List of the attachment calls in an action's duration, each description passed through
    /// `told`; `None` if no call is known.
    pub fn counts(&self, action: &str, told: impl Fn(String) -> String) -> Option<String> {
        let bounds = self.action(action)?.duration.as_ref()?;
        let all = self.asked(bounds.iter().flat_map(|bound| bound.value.calls()));
        let all: Vec<String> = all.into_iter().map(told).collect();
        (!all.is_empty()).then(|| listed(&all, all.len()))
    }

    /// Sentence about a metric that adds numbers to the total time; `None` if it is the total time
    /// alone.
    pub fn besides_time(&self) -> Option<String> {
        let minimise = &self.domain.config.minimise;
        let task = &self.domain.vocabulary.task;
        let numbers = task.functions.iter().filter(|f| minimise.contains(&format!("({})", f.name)));
        let said: Vec<String> = numbers
            .map(|number| {
                let by = self.asked(self.grows_by(&number.name));
                let by = listed(&by, by.len()).replace(';', ":");
                let said = self.saying.say(&format!("({})", number.name));
                if by.is_empty() { said } else { format!("{said} (the {by})") }
            })
            .collect();
        (!said.is_empty()).then(|| {
            format!("What counts is {minimise}. (total-time) is the seconds that pass; {}.", said.join("; "))
        })
    }

    /// Sentence about actions of this run whose planned duration exceeds the time that they take;
    /// `None` if there are none.
    pub fn seconds(&self) -> Option<String> {
        let one = |action: &Action| {
            let takes_s = fixed_s(action)?;
            self.chapters.iter().any(|chapter| chapter.counts_more(&action.name, takes_s)).then_some(())?;
            let counts = self.counts(&action.name, |about| about.replace(';', ":"))?;
            Some(format!(
                "{}, besides its {takes_s:.1} s, the {counts}",
                self.saying.in_general(&action.name)
            ))
        };
        let all: Vec<String> = self.domain.vocabulary.task.actions.iter().filter_map(one).collect();
        (!all.is_empty()).then(|| {
            format!(
                "More seconds are counted than pass, so that what is likely comes first: for {}.",
                all.join("; for ")
            )
        })
    }

    /// True if an action in one of the plans makes this attachment call.
    pub fn is_used(&self, call: &str) -> bool {
        let steps = self.chapters.iter().flat_map(|chapter| &chapter.steps);
        let actions: BTreeSet<&str> = steps.map(|step| step.action.as_str()).collect();
        let asked = actions.into_iter().filter_map(|name| self.action(name)).flat_map(Action::calls);
        asked.into_iter().any(|asked| self.name(asked) == call)
    }

    /// Sentences about the names of viewpoints and the notation of places; `None` if the domain
    /// does not use the ability "searching".
    pub fn poses(&self, robot: &str) -> Option<String> {
        let text = match robot.starts_with("recorded:") {
            true => {
                "Poses are those from which the record was taken, each called after its frame: driving to frame-7 and looking from \
                 there is reading that frame."
            }
            false => {
                "Poses are called after what is looked at from them, as desk-1 and desk-2 after a desk, or after a door; here-N is \
                 where the body stopped on its way."
            }
        };
        let is_searching = self.domain.config.uses.iter().any(|ability| ability == "searching");
        is_searching.then(|| format!("{text} Places are x, y and height in the map, in metres."))
    }

    /// Sentences about the meaning of the numbers that plans are to improve; `None` if no meaning
    /// is known.
    pub fn numbers(&self) -> Option<String> {
        let Words { domain, saying, chapters } = self;
        let expected = || chapters.iter().filter_map(|c| c.weighed.as_ref()).flat_map(|w| &w.numbers);
        let names = expected().filter_map(|n| n.name.trim_matches(['(', ')']).split(' ').next());
        let names: BTreeSet<&str> = names.collect();
        let sensed = |name: &&str| match origin::of(domain, &domain.vocabulary.word(name)?) {
            Origin::Sensed(fact) => Some((name.to_string(), fact.about)),
            _ => None,
        };
        let all: Vec<(String, &str)> = names.iter().filter_map(sensed).collect();
        let (said, raw): (Vec<_>, Vec<_>) = all.into_iter().partition(|(name, _)| saying.has(name));
        let raw: Vec<String> = raw.iter().map(|(name, about)| format!("({name} …) is {about}")).collect();
        let raw = (!raw.is_empty()).then(|| format!("Numbers: {}.", raw.join("; ")));
        let is_share = |number: &Expected| (0.0..=1.0).contains(&number.now);
        let said = (!said.is_empty() && expected().all(is_share))
            .then(|| "A certainty is a number between 0 and 1.".to_string());
        let all: Vec<String> = said.into_iter().chain(raw).collect();
        (!all.is_empty()).then(|| all.join(" "))
    }

    fn action(&self, name: &str) -> Option<&Action> {
        self.domain.vocabulary.task.actions.iter().find(|action| action.name == name)
    }

    fn name(&self, call: &CallTerm) -> &str {
        &self.domain.vocabulary.task.module(call.module).name
    }

    /// Descriptions of those calls whose meaning is known, without adjacent duplicates.
    fn asked<'c>(&self, calls: impl IntoIterator<Item = &'c CallTerm>) -> Vec<String> {
        let mut all: Vec<String> =
            calls.into_iter().filter_map(|call| self.meaning(self.name(call))).collect();
        all.dedup();
        all
    }

    /// Attachment calls by which actions change a number.
    fn grows_by(&self, number: &str) -> Vec<&CallTerm> {
        let task = &self.domain.vocabulary.task;
        let effects =
            task.actions.iter().flat_map(|action| action.effects.start.iter().chain(&action.effects.end));
        let changes = effects.filter_map(|effect| match &effect.change {
            Change::Number(_, fluent, by) if task.function(fluent.function).name == number => Some(by),
            _ => None,
        });
        changes.flat_map(Expression::calls).collect()
    }
}

/// Constant term of an action's duration, seconds; `None` if the duration is no sum with a
/// constant.
fn fixed_s(action: &Action) -> Option<f64> {
    let [bound] = action.duration.as_deref()? else { return None };
    let Expression::Add(parts) = &bound.value else { return None };
    parts.iter().find_map(|part| if let Expression::Number(s) = part { Some(*s) } else { None })
}
