//! Why a run went as it did, from its record alone, in plain sentences: why each plan was made and why it was this one, what came of it,
//! and what the verdict rests on. What the record does not say is said not to be known.

mod chapters;
mod plans;
mod states;
mod verdict;
mod wording;

use descry_domains::abilities;
use descry_domains::load::Domain;
use descry_domains::vocabulary::Ground;
use descry_memory::Record;
use serde::Serialize;

use crate::exit::CommandError;
use crate::report::Report;
use crate::run::{Beginning, Header};
use states::States;
use wording::{count, wrapped};

/// What a run is explained by.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Explanation {
    /// What was asked for, and how it ended.
    pub asked: Vec<String>,
    /// The plans, one after the other.
    pub plans: Vec<Told>,
    /// What the verdict rests on.
    pub verdict: Vec<String>,
    /// What of the record is lost.
    pub lost: Vec<String>,
}

/// What is told of one plan.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Told {
    /// Its number, from 1.
    pub round: usize,
    /// When it was made, seconds since the run began, on the body's clock.
    pub at_s: f64,
    /// What it was caused by.
    pub cause: String,
    /// What it is to do.
    pub intent: Vec<String>,
    /// Why this and nothing else.
    pub why: Vec<String>,
    /// What came of it.
    pub outcome: Vec<String>,
}

/// Explains a run, from its record, what it was started with, and its report, if it has one.
///
/// # Errors
/// [`CommandError::Broken`] if the record cannot be read.
pub fn of(record: &Record, header: &Header, report: Option<&Report>) -> Result<Explanation, CommandError> {
    let states = States::of(record)?;
    let (chapters, mut lost) = chapters::of(record, &states, &header.resumed)?;
    // The words of the domain of that time, if this version still understands it.
    let domain = Beginning::of(record).ok().flatten().and_then(|beginning| beginning.domain().ok());
    let planner = descry_domains::abilities::searching::policies::PLAN;
    let policy = Some(&header.settings.policy).filter(|policy| *policy != planner).cloned();
    let asked = Asked { goal: header.pddl_goal.clone(), policy };
    let plans = plans::told(&chapters, &asked);
    let is_weighed = chapters.iter().any(|c| c.weighed.as_ref().is_some_and(|w| w.chosen.is_some()));
    let mut said = said(header, &asked, report, chapters.len(), is_weighed);
    said.splice(1..1, domain.as_ref().and_then(|domain| numbers(domain, &chapters)));
    let meanings = |call: &str| domain.as_ref().and_then(|domain| meaning(domain, call));
    let verdict = verdict::rests_on(record, report, &states, &meanings, &mut lost)?;
    Ok(Explanation { asked: said, plans, verdict, lost })
}

/// What a call of the domain asks, if descry itself answers it.
fn meaning(domain: &Domain, call: &str) -> Option<String> {
    let own = domain.config.attachments.contains_key(call);
    let mut calls = abilities::used(&domain.config.uses).flat_map(|ability| ability.calls);
    calls.find(|c| c.name == call && !own).map(|c| c.about.to_string())
}

/// What the numbers say that plans are to change.
fn numbers(domain: &Domain, chapters: &[chapters::Chapter]) -> Option<String> {
    let expected = chapters.iter().filter_map(|c| c.weighed.as_ref()).flat_map(|w| &w.numbers);
    let names = expected.filter_map(|n| n.name.trim_matches(['(', ')']).split(' ').next());
    let names: std::collections::BTreeSet<&str> = names.collect();
    let about = |name: &&str| match domain.vocabulary.ground(&domain.vocabulary.word(name)?, &domain.config) {
        Ground::Sensed(fact) => Some(format!("({name} …) is {}", fact.about)),
        _ => None,
    };
    let all: Vec<String> = names.iter().filter_map(about).collect();
    (!all.is_empty()).then(|| format!("Numbers: {}.", all.join("; ")))
}

/// What a run was asked, as far as plans depend on it.
struct Asked {
    /// The goal in PDDL.
    goal: String,
    /// Who chose where to look next, if not the planner.
    policy: Option<String>,
}

impl Asked {
    /// What the goal wants of a number: that with which it compares it, if it names it so.
    fn wanted(&self, number: &str) -> Option<f64> {
        let word = number.trim_matches(['(', ')']).split(' ').next()?;
        let (_, rest) = self.goal.split_once(&format!("= ({word}"))?;
        rest.starts_with([' ', ')']).then_some(())?;
        rest.split_once(')')?.1.split(')').next()?.trim().parse().ok()
    }
}

fn said(
    header: &Header,
    asked: &Asked,
    report: Option<&Report>,
    plans: usize,
    is_weighed: bool,
) -> Vec<String> {
    let settings = &header.settings;
    let scene = settings.scene.as_ref().map(|s| format!(", scene {s}")).unwrap_or_default();
    let seed = if settings.robot == "sim" { format!(", seed {}", settings.seed) } else { String::new() };
    let mut said = vec![format!(
        "\"{}\" was asked of the body {}{scene}{seed}, in the domain {}. It means: bring about {}.",
        header.goal, settings.robot, settings.domain, header.pddl_goal
    )];
    if let Some(policy) = &asked.policy {
        said.push(format!("Where to look next was chosen by the policy {policy}, not by the planner."));
    }
    said.push(match report {
        Some(report) => format!(
            "It ended after {}, {}, {:.1} m and {:.0} s.",
            count(plans, "plan"),
            count(report.views, "look"),
            report.distance_m,
            report.sim_time_s
        ),
        None => format!("It has not ended: the record goes as far as plan {plans}."),
    });
    if !header.resumed.is_empty() {
        let times = match header.resumed.len() {
            1 => "once".into(),
            n => format!("{n} times"),
        };
        said.push(format!("It was cut off {times}, and gone on with from its record."));
    }
    if is_weighed {
        said.push(
            "In brackets: by how much steps are expected to bring the numbers nearer to what is wanted, the seconds at \
             which the domain reckons them, time for looks in vain included where it counts that, and the gain a second."
                .into(),
        );
    }
    said
}

impl std::fmt::Display for Explanation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        const WIDTH: usize = 80;
        let all = |f: &mut std::fmt::Formatter<'_>, lines: &[String], first: &str| {
            lines.iter().try_for_each(|line| writeln!(f, "{}", wrapped(line, first, WIDTH)))
        };
        all(f, &self.asked, "")?;
        for plan in &self.plans {
            writeln!(f, "\nPlan {}, at {:.1} s", plan.round, plan.at_s)?;
            writeln!(f, "{}", wrapped(&plan.cause, "  because  ", WIDTH))?;
            all(f, &plan.intent, "  do       ")?;
            all(f, &plan.why, "  why      ")?;
            all(f, &plan.outcome, "  then     ")?;
        }
        writeln!(f, "\nWhat the verdict rests on")?;
        all(f, &self.verdict, "  - ")?;
        all(f, &self.lost, "lost: ")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_wanted_stands_in_the_goal() {
        let check = |goal: &str, number: &str, expected: Option<f64>| {
            let asked = Asked { goal: goal.into(), policy: None };
            assert_eq!(asked.wanted(number), expected, "{goal}: {number}");
        };
        check("(>= (confidence cup-a) 0.8)", "(confidence cup-a)", Some(0.8));
        check("(exists (?s - surface) (>= (presence cup-a ?s) 0.9))", "(presence cup-a desk)", Some(0.9));
        check("(and (a) (<= (unseen) 0.5))", "(unseen)", Some(0.5));
        check("(>= (presence cup-a) (sure))", "(presence cup-a)", None);
        check("(on cup-a desk)", "(clarity desk)", None);
        check("(>= (unseen-part) 0.5)", "(unseen)", None);
    }
}
