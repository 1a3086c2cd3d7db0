//! Explanation of a run from its record alone, in plain sentences: why each plan was made and
//! chosen, what came of it, and the evidence for the verdict. Facts that are not in the record are
//! reported as unknown.

pub mod basis;
#[doc(hidden)]
pub mod brief;
#[doc(hidden)]
pub mod chapters;
mod domains;
#[doc(hidden)]
pub mod looks;
#[doc(hidden)]
pub mod numbers;
#[doc(hidden)]
pub mod outcomes;
#[doc(hidden)]
pub mod plans;
#[doc(hidden)]
pub mod rivals;
#[doc(hidden)]
pub mod standings;
#[doc(hidden)]
pub mod states;
mod summary;
mod verdict;
pub mod wording;

use std::collections::BTreeSet;

use descry_domains::abilities::searching::policies;
use descry_domains::lexicon::Places;
use descry_domains::saying::Saying;
use descry_memory::{Query, Record};
use descry_robots::sim::SceneSpec;
use descry_skills::Call;
use serde::Serialize;

use basis::Basis;
use descry_agent::compared;
use descry_agent::exit::CommandError;
use descry_agent::report::Report;
use descry_agent::run::{Beginning, Header};
use domains::Words;
use states::States;
use wording::wrapped;

/// Explanation of a run; each text is one or a few sentences.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Explanation {
    /// Summary: the goal, the answer, the evidence for it, and the worst trouble.
    pub summary: Vec<String>,
    /// Goal, and notes that help to read what follows.
    pub asked: Vec<String>,
    /// Notes that help to read the figures.
    pub reading: Vec<String>,
    /// Explanations of the plans, in order.
    pub plans: Vec<Told>,
    /// Evidence for the verdict.
    pub verdict: Vec<String>,
    /// Lost parts of the record, one message each.
    pub lost: Vec<String>,
}

/// Explanation of one plan.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Told {
    /// Number of the plan, from 1.
    pub round: usize,
    /// Time at which the plan was made, seconds since the run began, on the body's clock.
    pub at_s: f64,
    /// Event that made the plan necessary.
    pub cause: String,
    /// Steps of the plan, and the improvements that it is to bring, one sentence each.
    pub intent: Vec<String>,
    /// Reasons for choosing this plan over its alternatives, in short, one sentence each.
    pub why: Vec<String>,
    /// Reasons for choosing this plan, with the duration and gain of each alternative, one sentence
    /// each.
    pub figures: Vec<String>,
    /// Outcomes of the plan, one text per event or observation.
    pub outcome: Vec<String>,
    /// Number of steps executed, and why others were left out.
    pub done: String,
}

/// Explains a run from its record, its settings, and its report if it has one.
///
/// # Errors
/// [`CommandError::Broken`] if the record cannot be read.
pub fn of(record: &Record, header: &Header, report: Option<&Report>) -> Result<Explanation, CommandError> {
    let states = States::of(record)?;
    let mut lost = missing(record, report)?;
    let (chapters, unread) = chapters::of(record, &states, &header.resumed)?;
    lost.extend(unread);
    // The words of the domain of that time, if this version still understands it.
    let beginning = Beginning::of(record).ok().flatten();
    let domain = beginning.as_ref().and_then(|beginning| beginning.domain().ok());
    let saying = beginning.as_ref().map(saying_of).unwrap_or_default();
    let words = domain.as_ref().map(|domain| Words { domain, saying: &saying, chapters: &chapters });
    let policy = Some(&header.settings.policy).filter(|policy| *policy != policies::PLAN).cloned();
    let meanings = |call: &str| words.as_ref().and_then(|words| words.meaning(call));
    let briefly = |about: String| about.split(';').next().unwrap_or_default().to_string();
    let counts = |action: &str| words.as_ref().and_then(|words| words.counts(action, briefly));
    let goal = header.pddl_goal.clone();
    let is_more = chapters.iter().any(brief::counts_more);
    let in_vain = words.as_ref().and_then(|words| {
        let besides = words.besides_time().filter(|_| is_more);
        besides.or_else(|| words.seconds())
    });
    let counts_in_vain = in_vain.is_some();
    let asked =
        Asked { goal, policy, counts: &counts, saying: &saying, has_ended: report.is_some(), counts_in_vain };
    let plans = plans::told(&chapters, &asked);
    let summary = summary::of(header, report, &chapters, states.left_s(), &saying);
    let mut said = said(header, &asked, states.given_s(), &saying);
    let mut reading = Vec::new();
    if chapters.iter().any(|c| c.weighed.as_ref().is_some_and(|w| w.chosen.is_some())) {
        said.extend(words.as_ref().and_then(Words::numbers));
        said.extend(words.as_ref().and_then(|words| words.poses(&header.settings.robot)));
        said.push(OTHERWISE.into());
        said.extend(in_vain.as_ref().map(|_| COUNTED.to_string()));
        reading.push(WAYS.into());
        reading.extend(in_vain);
    }
    let not_there = domain.as_ref().map(|domain| domain.config.thresholds.not_there);
    let negligible = domain.as_ref().map(|domain| domain.config.thresholds.remaining);
    let is_used = |call: &str| words.as_ref().is_none_or(|words| words.is_used(call));
    let stood: Vec<&standings::Standing> = chapters.iter().flat_map(chapters::Chapter::stood).collect();
    let known = verdict::Wording {
        meanings: &meanings,
        is_used: &is_used,
        saying: &saying,
        stood: &stood,
        not_there,
        negligible,
    };
    let verdict = verdict::rests_on(record, report, &states, &known, &mut lost)?;
    let mut told = BTreeSet::new();
    lost.retain(|message| told.insert(message.clone()));
    Ok(Explanation { summary, asked: said, reading, plans, verdict, lost })
}

/// Messages about records of a run that cannot be read, and about missing evidence for its verdict.
fn missing(record: &Record, report: Option<&Report>) -> Result<Vec<String>, CommandError> {
    let (documents, faults) = record.find_whole(&Query::default()).map_err(CommandError::broken)?;
    let mut lost: Vec<String> = faults.iter().map(ToString::to_string).collect();
    lost.extend(report.map(|_| Basis::among(&documents)).into_iter().flat_map(|basis| basis.lost));
    Ok(lost)
}

/// State of the run after each observation, as a sentence, with its time on the body's clock,
/// nanoseconds; empty if the record holds none. `goal` is in PDDL.
///
/// # Errors
/// [`CommandError::Broken`] if the record cannot be read.
pub fn after_looks(record: &Record, goal: &str, saying: &Saying) -> Result<Vec<(i64, String)>, CommandError> {
    let (chapters, _) = chapters::of(record, &States::of(record)?, &[])?;
    let all = chapters.iter().flat_map(|chapter| outcomes::of(chapter, goal, saying));
    Ok(all.filter_map(|outcome| Some((outcome.stood_ns?, outcome.said))).collect())
}

/// History of a numeric fluent that the goal compares.
#[derive(Debug, Clone, PartialEq)]
pub struct Sought {
    /// Number, in the domain's wording.
    pub name: String,
    /// Bound that the goal sets.
    pub wanted: f64,
    /// Values with their times on the body's clock, nanoseconds.
    pub values: Vec<(i64, f64)>,
}

/// History of each number that the goal compares, at every plan and observation. `goal` is in PDDL.
///
/// # Errors
/// [`CommandError::Broken`] if the record cannot be read.
pub fn sought(record: &Record, goal: &str, saying: &Saying) -> Result<Vec<Sought>, CommandError> {
    let (chapters, _) = chapters::of(record, &States::of(record)?, &[])?;
    let mut all: Vec<Sought> = Vec::new();
    for standing in chapters.iter().flat_map(|chapter| chapter.before.iter().chain(chapter.stood())) {
        let asked = standing.doubts.iter().flat_map(|doubt| numbers::of(doubt, None, standing, goal, &[]));
        for sure in asked {
            let (name, at) = (saying.say(&sure.name), (standing.stamp_ns, sure.now));
            match all.iter_mut().find(|sought| sought.name == name) {
                Some(sought) if sought.values.last() == Some(&at) => {}
                Some(sought) => sought.values.push(at),
                None => all.push(Sought { name, wanted: sure.wanted, values: vec![at] }),
            }
        }
    }
    Ok(all)
}

/// Wording of a run's domain; the default wording (PDDL as written) if this version cannot read the
/// domain.
pub fn saying_of(beginning: &Beginning) -> Saying {
    let Ok(domain) = beginning.domain() else { return Saying::default() };
    let scene = beginning.scene.as_ref().and_then(|(name, text)| SceneSpec::parse(name, text).ok());
    Saying::of(&domain, &scene.as_ref().map(Places::of_spec).unwrap_or_default())
}

/// Note that explains the figures of an alternative.
const WAYS: &str = "A way to get further is a sequence of steps up to the first that may bring the numbers nearer to what is \
                    wanted. In brackets behind it: the sum of all improvements, the seconds until then, and the \
                    improvement a second; behind each step its seconds. Numbers that are hoped for assume that what is \
                    looked for is there: a look may show more, or less.";

/// Note that explains what alternatives assume.
const OTHERWISE: &str = "What is hoped for assumes that what is looked for is there. The time of a plan that begins otherwise \
                         includes the rest of the plan behind it, as far as that can follow and is needed.";
/// Note about a metric that counts more seconds than pass.
const COUNTED: &str = "Beside the time that a plan takes, the planner counts for the first look of each plan at a surface, also where \
                       earlier plans have looked, what it costs on average to look there in vain: the more, the less likely it finds \
                       something and the farther it is, so that what is likely and near comes first (--figures says how).";

/// Context on which the explanation of plans depends.
pub struct Asked<'a> {
    /// Goal in PDDL.
    pub goal: String,
    /// Policy that chose the next observation; `None` if the planner chose.
    pub policy: Option<String>,
    /// Describes what the duration of an action (by name) is computed from; `None` if unknown or
    /// constant.
    pub counts: &'a dyn Fn(&str) -> Option<String>,
    /// Wording of the domain.
    pub saying: &'a Saying,
    /// True if the run has a verdict.
    pub has_ended: bool,
    /// True if the metric counts the expected cost of observations that find nothing.
    pub counts_in_vain: bool,
}

impl Asked<'_> {
    /// Call in the domain's wording.
    fn say(&self, call: &Call) -> String {
        self.saying.say(&call.to_string())
    }

    /// Calls in the domain's wording, joined by `then`.
    fn say_all(&self, calls: &[Call], then: &str) -> String {
        calls.iter().map(|call| self.say(call)).collect::<Vec<_>>().join(then)
    }

    /// Bound that the goal sets on a number; `None` if the goal does not compare the number with a
    /// constant.
    fn wanted(&self, number: &str) -> Option<f64> {
        compared::wanted(&self.goal, number)
    }
}

fn said(header: &Header, asked: &Asked<'_>, given_s: Option<f64>, saying: &Saying) -> Vec<String> {
    let (pddl, goal) = (&header.pddl_goal, saying.say(&header.pddl_goal));
    let mut said = vec![match goal == *pddl {
        true => format!("Wanted: {pddl}."),
        false => format!("Wanted: {goal}. In PDDL: {pddl}."),
    }];
    said.extend(given_s.map(|given_s| format!("It was to be done within {given_s:.0} s.")));
    if let Some(policy) = &asked.policy {
        let rule = policies::about(policy).map(|about| format!(" It {about}.")).unwrap_or_default();
        said.push(format!("Where to look next was chosen by the policy {policy}, not by the planner.{rule}"));
    }
    if !header.resumed.is_empty() {
        let times = match header.resumed.len() {
            1 => "once".into(),
            n => format!("{n} times"),
        };
        said.push(format!("It was cut off {times}, and gone on with from its record."));
    }
    said
}

impl Explanation {
    /// Explanation as text of 80 columns, with all figures or in short.
    pub fn text(&self, has_figures: bool) -> String {
        const WIDTH: usize = 80;
        let all = |lines: &[String], first: &str| -> String {
            lines.iter().map(|line| wrapped(line, first, WIDTH) + "\n").collect()
        };
        let mut text = wrapped(&self.summary.join(" "), "", WIDTH) + "\n\n" + &all(&self.asked, "");
        if has_figures {
            text += &all(&self.reading, "");
        }
        for plan in &self.plans {
            text += &format!("\nPlan {}, at {:.1} s\n", plan.round, plan.at_s);
            text += &all(std::slice::from_ref(&plan.cause), "  because  ");
            text += &all(&plan.intent, "  do       ");
            text += &all(if has_figures { &plan.figures } else { &plan.why }, "  why      ");
            text += &all(&plan.outcome, "  then     ");
            text += &all(std::slice::from_ref(&plan.done), "  done     ");
        }
        text += &format!("\nWhat the verdict rests on\n{}", all(&self.verdict, "  - "));
        text + &all(&self.lost, "lost: ")
    }
}

impl std::fmt::Display for Explanation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.text(false))
    }
}
