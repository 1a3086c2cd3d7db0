//! Answer text of a phrase, with placeholders filled from the current belief and changes since an
//! earlier run.

use std::collections::BTreeSet;

use descry_memory::belief::Track;
use descry_memory::remember::Remembered;
use descry_planner::{FactValue, Plan, after};

use super::{Asker, CHANGES};
use crate::conclusion::Verdict;
use crate::config::Answers;
use crate::english::{self, plural};
use crate::reasons;
use crate::symbol::symbol;

/// Maximum distance at which objects of two runs count as the same, metres.
const SAME_M: f64 = 0.10;

impl Asker<'_> {
    /// Answer to a verdict in the phrase's own words; `None` if the phrase has none.
    pub(super) fn worded(&self, verdict: Verdict) -> Option<String> {
        let Answers { achieved, not_found, cannot_tell } = &self.goal.answer;
        let text = match verdict {
            Verdict::Achieved => achieved,
            Verdict::NotFound => not_found,
            Verdict::CannotTell => cannot_tell,
            Verdict::Impossible | Verdict::Failed => &None,
        };
        let text = text.as_ref()?;
        let mut out = String::new();
        let mut rest = text.as_str();
        while let Some((before, behind)) = rest.split_once('{') {
            let (atom, after) = behind.split_once('}').unwrap_or((behind, ""));
            out += before;
            out += &self.value(atom);
            rest = after;
        }
        Some(out + rest)
    }

    /// Sentence on the changes on a surface since an earlier run.
    fn changes(&self, surface: &str) -> String {
        let Some(past) = &self.s.past else { return "nothing is remembered of earlier".into() };
        changes(&past.remembered, &self.s.belief.tracks, surface, self.lexicon.name_of(surface))
    }

    /// Sentence on the changes on all surfaces seen by an earlier run, and on the surfaces that no
    /// earlier run saw.
    fn all_changes(&self) -> String {
        let Some(past) = &self.s.past else { return "nothing is remembered of earlier".into() };
        let (known, new): (Vec<_>, Vec<_>) =
            self.s.surfaces.iter().partition(|s| past.remembered.has_looked_at(&s.symbol));
        let told = known.iter().map(|s| format!("on the {}: {}", s.name, self.changes(&s.symbol)));
        let names: Vec<&str> = new.iter().map(|s| s.name.as_str()).collect();
        let left_out = (!names.is_empty()).then(|| never_seen(&names.join(" and the ")));
        told.chain(left_out).collect::<Vec<_>>().join("; ")
    }

    /// Current value of an atom as text: the names that fit its question mark, a number, or yes or no.
    pub(super) fn value(&self, atom: &str) -> String {
        let tokens: Vec<String> =
            atom.trim_matches(|c| c == '(' || c == ')').split_whitespace().map(str::to_lowercase).collect();
        let Some((word, arguments)) = tokens.split_first() else { return String::new() };
        if word == CHANGES {
            return arguments.first().map_or_else(|| self.all_changes(), |surface| self.changes(surface));
        }
        let (task, attachments) = match self.listed {
            Some(listed) => (&listed.task, &listed.attachments),
            None => (&self.round.task, &self.round.attachments),
        };
        let readings = after(task, attachments, &Plan::default(), &[word]).unwrap_or_default();
        let fitting = readings.iter().filter(|r| {
            r.arguments.len() == arguments.len()
                && r.arguments.iter().zip(arguments).all(|(a, b)| b == "?" || **a == *symbol(b))
        });
        let mut names: Vec<String> = Vec::new();
        let mut told: BTreeSet<u64> = BTreeSet::new();
        for reading in fitting {
            match (&reading.value, arguments.iter().position(|a| a == "?")) {
                (FactValue::Number(n), None) => return english::number(*n),
                (_, Some(at)) => {
                    let symbol = &reading.arguments[at];
                    match self.listed.and_then(|listed| listed.things.get(symbol.as_ref())) {
                        // One object may be known under several symbols.
                        Some((object, name)) => names.extend(told.insert(*object).then(|| name.clone())),
                        None => names.push(self.lexicon.name_of(symbol).to_string()),
                    }
                }
                (_, None) => return "yes".into(),
            }
        }
        match (names.is_empty(), arguments.iter().any(|a| a == "?")) {
            (false, _) => counted(names),
            (true, true) => "none".into(),
            (true, false) => "no".into(),
        }
    }
}

/// Names in order, equal ones counted: `2 cups, mug`.
fn counted(names: Vec<String>) -> String {
    let mut all: Vec<(String, usize)> = Vec::new();
    for name in names {
        match all.iter_mut().find(|(known, _)| *known == name) {
            Some((_, count)) => *count += 1,
            None => all.push((name, 1)),
        }
    }
    let one =
        |(name, count): (String, usize)| if count == 1 { name } else { format!("{count} {}", plural(&name)) };
    all.into_iter().map(one).collect::<Vec<_>>().join(", ")
}

/// Sentence on the changes on a surface since an earlier run; `name` is the spoken name of the surface.
pub fn changes(past: &Remembered, now: &[Track], surface: &str, name: &str) -> String {
    if !past.has_looked_at(surface) {
        return never_seen(name);
    }
    let before: Vec<&Track> = past.present.iter().map(|r| &r.track).filter(|t| t.on == *surface).collect();
    let now: Vec<&Track> = now.iter().filter(|t| t.on == *surface).collect();
    let name = |t: &Track| t.label().unwrap_or("something unknown").to_string();
    let near = |a: &Track, b: &Track| (a.position_m - b.position_m).norm() < SAME_M;
    let came: Vec<&&Track> = now.iter().filter(|t| !before.iter().any(|b| near(t, b))).collect();
    let went: Vec<&&Track> = before.iter().filter(|b| !now.iter().any(|t| near(t, b))).collect();
    let moved = |t: &Track| t.label().is_some() && went.iter().any(|b| b.label() == t.label());
    let at = |t: &Track| reasons::place(&t.position_m);
    let came_lines = came.iter().map(|t| match moved(t) {
        true => format!("{} was moved to {}", name(t), at(t)),
        false => format!("{} came, at {}", name(t), at(t)),
    });
    let stays_gone = |b: &&&&Track| b.label().is_none() || !came.iter().any(|t| t.label() == b.label());
    let went_lines = went.iter().filter(stays_gone).map(|b| format!("{} is gone from {}", name(b), at(b)));
    let lines: Vec<String> = came_lines.chain(went_lines).collect();
    if lines.is_empty() { "nothing has changed".into() } else { lines.join("; ") }
}

fn never_seen(surface: &str) -> String {
    format!("nothing is remembered of the {surface}: no earlier run looked at it")
}
