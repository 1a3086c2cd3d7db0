//! What a run says: events as they happen, for people and for the record, and the result at the end.

use std::fmt;

use descry_domains::answer::{Believed, Verdict};
use descry_domains::goal::Goal;
use descry_domains::note::Note;
use serde::{Deserialize, Serialize};

/// Something that happened in a run, with its reason.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", tag = "event")]
pub enum Event {
    /// The goal was understood.
    Goal {
        /// The words as they were given.
        said: String,
        /// The goal in PDDL.
        pddl: String,
        /// From where the body starts.
        start: String,
        /// How many poses there are to look from.
        candidates: usize,
    },
    /// A new plan was made.
    Planned {
        /// Number of the planning round, from 1.
        round: usize,
        /// Why the previous plan no longer does.
        because: String,
        /// The steps with what each costs.
        steps: Vec<String>,
        /// Duration of the plan.
        makespan_s: f64,
        /// Calls of attachments that planning made, by name.
        calls: Vec<(String, u64)>,
    },
    /// The rest of the plan still reaches the goal.
    Kept {
        /// Steps that are left.
        left: usize,
    },
    /// A step begins.
    Acting {
        /// The call.
        call: String,
        /// What it costs and what is hoped from it.
        because: String,
    },
    /// A step ended well.
    Acted {
        /// The call.
        call: String,
        /// What came of it.
        outcome: String,
    },
    /// A step failed.
    Failed {
        /// The call.
        call: String,
        /// What the body said.
        because: String,
        /// What is concluded from it.
        therefore: String,
    },
    /// The world has learned something.
    #[serde(untagged)]
    Noted(Note),
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Event::Goal { said, pddl, start, candidates } => {
                writeln!(f, "goal      {said}")?;
                writeln!(f, "          {pddl}")?;
                write!(f, "start     {start}; {candidates} poses to look from")
            }
            Event::Planned { round, because, steps, makespan_s, calls } => {
                writeln!(f, "plan {round:<4} because {because}")?;
                for step in steps {
                    writeln!(f, "          {step}")?;
                }
                let calls: Vec<String> = calls.iter().map(|(name, n)| format!("{n} x {name}")).collect();
                let asked = if calls.is_empty() { "nothing".into() } else { calls.join(", ") };
                write!(f, "          {makespan_s:.1} s in all; asked of attachments: {asked}")
            }
            Event::Kept { left } => {
                let steps = if *left == 1 { "step" } else { "steps" };
                write!(f, "keep      the rest of the plan still reaches the goal ({left} {steps} left)")
            }
            Event::Acting { call, because } if because.is_empty() => write!(f, "do        {call}"),
            Event::Acting { call, because } => write!(f, "do        {call}: {because}"),
            Event::Acted { call: _, outcome } => write!(f, "          {outcome}"),
            Event::Failed { call, because, therefore } => {
                write!(f, "failed    {call}: {because}; {therefore}")
            }
            Event::Noted(note) => write!(f, "{note}"),
        }
    }
}

/// The result of a run: what `--json` prints.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// The words as they were given.
    pub goal: String,
    /// The goal in PDDL.
    pub pddl_goal: String,
    /// How it ended.
    pub verdict: Verdict,
    /// "yes", "no" or "cannot tell", if the goal was a question.
    pub answer: Option<String>,
    /// Why, in a sentence.
    pub why: String,
    /// What was looked for, if it was one thing.
    pub object: Option<String>,
    /// How sure it is.
    pub confidence: f64,
    /// How sure it had to be.
    pub threshold: f64,
    /// Probability that what was looked for is there after all.
    pub remaining: Option<f64>,
    /// Where it is believed to be: the middle of its body, in the map; none in the hand.
    pub position_m: Option<[f64; 3]>,
    /// Standard deviation of that, in the direction in which it is known worst.
    #[serde(default)]
    pub position_sigma_m: Option<f64>,
    /// Where it is; simulation only.
    pub true_position_m: Option<[f64; 3]>,
    /// The surface that it is believed to stand on, as people call it.
    pub on: Option<String>,
    /// The surface that it stands on; simulation only.
    pub true_on: Option<String>,
    /// The room that it is believed to be in.
    #[serde(rename = "in")]
    pub room: Option<String>,
    /// The room that it is in; simulation only.
    #[serde(rename = "true_in")]
    pub true_room: Option<String>,
    /// Everything that was seen on the surface.
    pub objects: Vec<Believed>,
    /// Views that were taken.
    pub views: usize,
    /// Plans after the first.
    pub replans: usize,
    /// Driven.
    pub distance_m: f64,
    /// On the body's clock.
    pub sim_time_s: f64,
    /// On the wall.
    pub wall_s: f64,
    /// The longest that one planning call took on the wall, what it asked of geometry apart; 0: nothing was planned, or it is not known.
    #[serde(default)]
    pub planning_s: f64,
    /// The longest that one planning call waited for geometry.
    #[serde(default)]
    pub geometry_s: f64,
    /// The run's folder.
    pub run: String,
}

impl Report {
    /// It without what differs however often the run is lived through, and without what only a simulation knows.
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

    /// A report of a run that has only begun.
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

/// A time in which little happens: milliseconds below a second.
pub fn brief(time_s: f64) -> String {
    match time_s {
        s if s >= 1.0 => format!("{s:.1} s"),
        s if s >= 1e-3 => format!("{:.0} ms", s * 1e3),
        _ => "less than 1 ms".into(),
    }
}

/// A verdict as people read it.
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
        let answer = self.answer.as_ref().map(|a| format!("{a}; ")).unwrap_or_default();
        writeln!(f, "\n{answer}{verdict}: {}", self.why)?;
        let is_held = self.objects.iter().any(|o| o.asked && o.position_m.is_none());
        if let Some(object) = self.object.as_ref().filter(|_| is_held) {
            writeln!(f, "  {object} in the hand, confidence {:.2}", self.confidence)?;
        } else if let (Some(object), Some([x, y, z])) = (&self.object, self.position_m) {
            let on = self.on.as_ref().map(|on| format!(" on the {on}")).unwrap_or_default();
            let give_cm = self.position_sigma_m.map_or(0.0, |sigma_m| 1e2 * sigma_m);
            let give = if give_cm >= 1.0 { format!(" give or take {give_cm:.0} cm") } else { String::new() };
            writeln!(
                f,
                "  {object}{on} at ({x:.3}, {y:.3}, {z:.3}) m{give}, confidence {:.2}",
                self.confidence
            )?;
        }
        if let Some([x, y, z]) = self.true_position_m {
            writeln!(f, "  in truth at ({x:.3}, {y:.3}, {z:.3}) m")?;
        }
        let any_asked = self.objects.iter().any(|o| o.asked);
        for (n, o) in self.objects.iter().enumerate().filter(|_| self.object.is_none()) {
            if any_asked && !o.asked && self.objects[..n].last().is_some_and(|before| before.asked) {
                writeln!(f, "  besides:")?;
            }
            let name = o.label.as_deref().unwrap_or("unknown");
            let on = o.on.as_ref().map(|on| format!(" on the {on}")).unwrap_or_default();
            let at = match o.position_m {
                Some([x, y, z]) => format!("at ({x:.3}, {y:.3}, {z:.3}) m{on}"),
                None => "in the hand".into(),
            };
            writeln!(f, "  {name:16} {:.2} {at}", o.confidence)?;
        }
        let counted = |n: usize, of: &str| format!("{n} {of}{}", if n == 1 { "" } else { "s" });
        writeln!(
            f,
            "  {}, {}, {:.1} m and {:.0} s on the body's clock, {:.1} s on the wall",
            counted(self.views, "view"),
            counted(self.replans, "replan"),
            self.distance_m,
            self.sim_time_s,
            self.wall_s
        )?;
        if self.planning_s > 0.0 {
            let [plan, geometry] = [self.planning_s, self.geometry_s].map(brief);
            writeln!(f, "  at most {plan} to plan and {geometry} for its questions to geometry")?;
        }
        write!(f, "  record: {}", self.run)
    }
}
