//! Reports of a run: events while it runs, for people and for the record, and the final result.

use std::fmt;

use descry_domains::conclusion::{Believed, Verdict};
use descry_domains::english;
use descry_domains::lesson::Lesson;
use descry_domains::note::Note;
use descry_domains::objective::Goal;
use descry_domains::saying::Saying;
use descry_planner::Step;
use descry_skills::Call;
use serde::{Deserialize, Serialize};

use crate::numbers::count;
use crate::reason::Reason;
use crate::written;

/// Event of a run, with the reason for it.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "event")]
pub enum Event {
    /// The goal was understood.
    Goal {
        /// Goal in words, as given.
        said: String,
        /// Goal in PDDL.
        pddl: String,
        /// Place at which the body starts.
        start: String,
        /// Number of candidate viewpoints.
        candidates: usize,
    },
    /// A new plan was made.
    Planned {
        /// Number of the plan, from 1.
        round: usize,
        /// Reason why the plan was made, in a sentence.
        because: String,
        /// Reason why the plan was made, with its values; `None` in records of earlier versions.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        reason: Option<Reason>,
        /// Steps of the plan.
        #[serde(with = "written::steps")]
        steps: Vec<Step>,
        /// Makespan of the plan, seconds.
        makespan_s: f64,
        /// Number of calls of each attachment during planning, by name.
        calls: Vec<(String, u64)>,
    },
    /// The rest of the plan still reaches the goal.
    Kept {
        /// Number of steps left.
        left: usize,
    },
    /// A step begins.
    Acting {
        /// Action with its arguments.
        #[serde(with = "written::call")]
        call: Call,
        /// Cost and expected gain of the step, in a sentence.
        because: String,
    },
    /// A part of a step has succeeded.
    Acted {
        /// Action with its arguments.
        #[serde(with = "written::call")]
        call: Call,
        /// Outcome, in a sentence.
        outcome: String,
    },
    /// A step failed.
    Failed {
        /// Action with its arguments.
        #[serde(with = "written::call")]
        call: Call,
        /// Failure as reported, in a sentence.
        because: String,
        /// Violated invariant in PDDL; `None` if the failure is another.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        unkept: Option<String>,
        /// Conclusion drawn from the failure, in a sentence.
        therefore: String,
        /// Conclusion as a value; `None` in records of earlier versions.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        lesson: Option<Lesson>,
    },
    /// The world model noted something: a perception, a change of belief or the like.
    #[serde(untagged)]
    Noted(Note),
}

impl Event {
    /// Heading of the event and its text (lines), worded with `saying`.
    pub fn parts(&self, saying: &Saying) -> (String, String) {
        let said = |call: &Call| saying.say(&call.to_string());
        match self {
            Event::Goal { said, pddl, start, candidates } => {
                let (wanted, viewpoints) = (saying.say(pddl), count(*candidates, "viewpoint"));
                ("goal".into(), format!("{said}\n{wanted}\nfrom {start}; {viewpoints}"))
            }
            Event::Planned { round, because, reason, steps, makespan_s, calls } => {
                let because = reason.as_ref().map_or_else(|| because.clone(), |reason| reason.told(saying));
                let steps: String = steps.iter().map(|step| timed(step, saying) + "\n").collect();
                let calls: Vec<String> = calls.iter().map(|(name, n)| format!("{n} x {name}")).collect();
                let asked = if calls.is_empty() { "nothing".into() } else { calls.join(", ") };
                let text = format!(
                    "because {because}\n{steps}{makespan_s:.1} s in all; asked of attachments: {asked}"
                );
                (format!("plan {round}"), text)
            }
            Event::Kept { left } => {
                let steps = count(*left, "step");
                ("keep".into(), format!("the rest of the plan still reaches the goal ({steps} left)"))
            }
            Event::Acting { call, because } if because.is_empty() => ("do".into(), said(call)),
            Event::Acting { call, because } => ("do".into(), format!("{}: {because}", said(call))),
            Event::Acted { call: _, outcome } => (String::new(), outcome.clone()),
            Event::Failed { call, because, unkept, therefore, lesson } => {
                let because = failed(because, unkept.as_deref(), saying);
                let therefore =
                    lesson.as_ref().map_or_else(|| therefore.clone(), |lesson| lesson.told(call, saying));
                ("failed".into(), format!("{}: {because}; {therefore}", said(call)))
            }
            Event::Noted(note) => (note.head().into(), note.to_string()),
        }
    }

    /// Event as lines of text, with the heading in a column on the left.
    pub fn told(&self, saying: &Saying) -> String {
        let (head, text) = self.parts(saying);
        let line =
            |(n, line): (usize, &str)| format!("{:<10}{line}", if n == 0 { head.as_str() } else { "" });
        text.lines().enumerate().map(line).collect::<Vec<_>>().join("\n")
    }
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.told(&Saying::default()))
    }
}

/// Step of a plan as text: start time, action, and duration.
pub fn timed(step: &Step, saying: &Saying) -> String {
    let call = saying.say(&written::call_of(step).to_string());
    match step.start_s {
        Some(start_s) => format!("{start_s:5.1} s  {call}, {:.1} s", step.duration_s),
        None => call,
    }
}

/// Reason why a step failed, in a sentence. `unkept`: violated invariant in PDDL.
pub fn failed(because: &str, unkept: Option<&str>, saying: &Saying) -> String {
    match unkept {
        Some(condition) => {
            format!("it came to its end, but until then it was not always so that {}", saying.say(condition))
        }
        None => because.to_string(),
    }
}

/// Result of a run, printed with `--json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Goal in words, as given.
    pub goal: String,
    /// Goal in PDDL.
    pub pddl_goal: String,
    /// Verdict of the run.
    pub verdict: Verdict,
    /// "yes", "no" or "cannot tell"; `None` if the goal is not a question.
    pub answer: Option<String>,
    /// Reason for the verdict, in a sentence.
    pub why: String,
    /// Requested object; `None` if the goal is not about a single one.
    pub object: Option<String>,
    /// Confidence of the answer, 0 to 1.
    pub confidence: f64,
    /// Confidence that an answer requires, 0 to 1.
    pub threshold: f64,
    /// Probability that the requested object is there although it was not found; `None` if not
    /// applicable.
    pub remaining: Option<f64>,
    /// Believed position of the requested object's centre, map frame, metres; `None` if it is in
    /// the hand or unknown.
    pub position_m: Option<[f64; 3]>,
    /// Standard deviation of that position in its least certain direction, metres.
    #[serde(default)]
    pub position_sigma_m: Option<f64>,
    /// True position of the requested object's centre, map frame, metres; only with ground truth.
    pub true_position_m: Option<[f64; 3]>,
    /// Spoken name of the surface that the object is believed to stand on.
    pub on: Option<String>,
    /// True surface that the object stands on; only with ground truth.
    pub true_on: Option<String>,
    /// Room that the object is believed to be in.
    #[serde(rename = "in")]
    pub room: Option<String>,
    /// True room of the object; only with ground truth.
    #[serde(rename = "true_in")]
    pub true_room: Option<String>,
    /// All objects that are believed to exist.
    pub objects: Vec<Believed>,
    /// Number of views taken.
    pub views: usize,
    /// Number of plans after the first.
    pub replans: usize,
    /// Distance driven, metres.
    pub distance_m: f64,
    /// Duration of the run on the body's clock, seconds.
    pub sim_time_s: f64,
    /// Duration of the run in real time, seconds.
    pub wall_s: f64,
    /// Longest planning call in real time, without attachments, seconds; 0 if nothing was planned
    /// or the time is unknown.
    #[serde(default)]
    pub planning_s: f64,
    /// Longest time in attachments during one planning call, seconds.
    #[serde(default)]
    pub geometry_s: f64,
    /// Folder of the run.
    pub run: String,
}

impl Report {
    /// Copy of the report without values that differ between repetitions, and without ground truth.
    pub(crate) fn as_recorded(&self) -> Self {
        Self {
            true_position_m: None,
            true_on: None,
            true_room: None,
            wall_s: 0.0,
            planning_s: 0.0,
            geometry_s: 0.0,
            run: String::new(),
            ..self.clone()
        }
    }

    /// Report of a run that has just begun.
    pub fn begin(goal: &Goal, run: String) -> Self {
        Self {
            goal: goal.said.clone(),
            pddl_goal: goal.pddl.clone(),
            verdict: Verdict::Failed,
            answer: None,
            why: String::new(),
            object: None,
            confidence: 0.0,
            threshold: goal.threshold,
            remaining: None,
            position_m: None,
            position_sigma_m: None,
            true_position_m: None,
            on: None,
            true_on: None,
            room: None,
            true_room: None,
            objects: Vec::new(),
            views: 0,
            replans: 0,
            distance_m: 0.0,
            sim_time_s: 0.0,
            wall_s: 0.0,
            planning_s: 0.0,
            geometry_s: 0.0,
            run,
        }
    }
}

/// Duration as text, in milliseconds below a second.
pub fn brief(time_s: f64) -> String {
    match time_s {
        s if s >= 1.0 => format!("{s:.1} s"),
        s if s >= 1e-3 => format!("{:.0} ms", s * 1e3),
        _ => "less than 1 ms".into(),
    }
}

/// Verdict in words.
pub fn words(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Achieved => "achieved",
        Verdict::NotFound => "not found",
        Verdict::CannotTell => "cannot tell",
        Verdict::Impossible => "cannot be done",
        Verdict::Failed => "failed",
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = words(self.verdict);
        // Of a question the answer comes first, and the verdict says no more.
        let first = self.answer.as_deref().unwrap_or(verdict);
        writeln!(f, "\n{first}: {}", self.why)?;
        let is_held = self.objects.iter().any(|o| o.asked && o.position_m.is_none());
        if let Some(object) = self.object.as_ref().filter(|_| is_held) {
            writeln!(f, "  {object} in the hand, {} sure", english::percent(self.confidence))?;
        } else if let (Some(object), Some(at)) = (&self.object, self.position_m.map(english::position)) {
            let on = self.on.as_ref().map(|on| format!(" on the {on}")).unwrap_or_default();
            let give = self
                .position_sigma_m
                .map(|sigma_m| format!(" give or take {:.0} cm", (1e2 * sigma_m).max(1.0)));
            let give = give.unwrap_or_default();
            writeln!(f, "  {object}{on} at {at}{give}, {} sure", english::percent(self.confidence))?;
        }
        if let Some(at) = self.true_position_m.map(english::position) {
            writeln!(f, "  in truth at {at}")?;
        }
        let any_asked = self.objects.iter().any(|o| o.asked);
        for (n, o) in self.objects.iter().enumerate().filter(|_| self.object.is_none()) {
            if any_asked && !o.asked && self.objects[..n].last().is_some_and(|before| before.asked) {
                writeln!(f, "  besides:")?;
            }
            let name = o.label.as_deref().unwrap_or("unknown");
            let on = o.on.as_ref().map(|on| format!(" on the {on}")).unwrap_or_default();
            let at = match o.position_m.map(english::position) {
                Some(at) => format!("at {at}{on}"),
                None => "in the hand".into(),
            };
            writeln!(f, "  {name:16} {:>6} sure {at}", english::percent(o.confidence))?;
        }
        writeln!(
            f,
            "  {}, {}, {:.1} m driven; {:.0} s of the robot's time, {:.1} s of yours",
            count(self.views, "view"),
            count(self.replans, "replan"),
            self.distance_m,
            self.sim_time_s,
            self.wall_s
        )?;
        if self.planning_s > 0.0 {
            let [plan, geometry] = [self.planning_s, self.geometry_s].map(brief);
            writeln!(f, "  slowest plan: {plan}, and {geometry} for its calls of geometry")?;
        }
        write!(f, "  record: {}", self.run)
    }
}
