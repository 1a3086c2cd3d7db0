//! What a run says: events as they happen, for people and for the record, and the result at the end.

use std::fmt;

use descry_domains::goal::Goal;
use descry_perception::Percept;
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
    /// Views were merged and looked through.
    Perceived {
        /// Views in the merged cloud.
        merged: usize,
        /// Views that could not be aligned, with the reason.
        left_out: Vec<String>,
        /// Points of the merged cloud.
        points: usize,
        /// Root mean square distance between the views, metres.
        residual_m: f64,
        /// What each object on the surface is taken for.
        objects: Vec<String>,
        /// What the last view changed in the belief.
        changed: Vec<String>,
    },
    /// Somebody has moved something: what was seen before the last view no longer holds.
    Changed {
        /// What shows it.
        because: String,
    },
    /// Nothing could be made of what has been seen so far.
    Nothing {
        /// Why.
        because: String,
    },
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
                write!(f, "          {makespan_s:.1} s in all; asked of geometry: {}", calls.join(", "))
            }
            Event::Kept { left } => {
                write!(f, "keep      the rest of the plan still reaches the goal ({left} steps left)")
            }
            Event::Acting { call, because } => write!(f, "do        {call}: {because}"),
            Event::Acted { call: _, outcome } => write!(f, "          {outcome}"),
            Event::Failed { call, because, therefore } => {
                write!(f, "failed    {call}: {because}; {therefore}")
            }
            Event::Perceived { merged, left_out, points, residual_m, objects, changed } => {
                let (views, mm) = (if *merged == 1 { "view" } else { "views" }, residual_m * 1e3);
                write!(
                    f,
                    "see       {merged} {views} merged, {points} points, {mm:.1} mm apart; {} objects",
                    objects.len()
                )?;
                lines(f, left_out)?;
                lines(f, objects)?;
                lines(f, changed)
            }
            Event::Changed { because } => write!(f, "changed   {because}; only the last view still holds"),
            Event::Nothing { because } => write!(f, "see       nothing yet: {because}"),
        }
    }
}

fn lines(f: &mut fmt::Formatter<'_>, texts: &[String]) -> fmt::Result {
    texts.iter().try_for_each(|text| write!(f, "\n          {text}"))
}

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The goal is reached with the confidence that was asked for.
    Achieved,
    /// Every useful pose has been tried: it is not there.
    NotFound,
    /// Nothing that the body can do would settle it.
    CannotTell,
    /// The body or the store failed, or a limit was reached.
    Failed,
}

/// An object on the surface, as believed at the end.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Believed {
    /// The known object that it most likely is; none: unknown.
    pub label: Option<String>,
    /// Its kind.
    pub kind: Option<String>,
    /// Probability of that.
    pub confidence: f64,
    /// The middle of its body, in the map.
    pub position_m: [f64; 3],
    /// Sides of its footprint and height.
    pub size_m: [f64; 3],
}

/// The result of a run: what `--json` prints.
#[derive(Debug, Clone, Serialize, Deserialize)]
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
    /// Where it is believed to be: the middle of its body, in the map.
    pub position_m: Option<[f64; 3]>,
    /// Where it is; simulation only.
    pub true_position_m: Option<[f64; 3]>,
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
    /// The longest that one planning call took, what it asked of geometry apart. Not in the JSON: it differs from run to run.
    #[serde(skip)]
    pub planning_s: f64,
    /// The longest that one planning call waited for geometry. Not in the JSON either.
    #[serde(skip)]
    pub geometry_s: f64,
    /// The run's folder.
    pub run: String,
}

impl Report {
    /// A report of a run that has only begun.
    pub fn begin(goal: &Goal, object: Option<String>, run: String) -> Self {
        Self {
            goal: goal.said.clone(),
            pddl_goal: goal.pddl.clone(),
            verdict: Verdict::Failed,
            answer: None,
            why: String::new(),
            object,
            confidence: 0.0,
            threshold: goal.threshold,
            remaining: None,
            position_m: None,
            true_position_m: None,
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

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let verdict = match self.verdict {
            Verdict::Achieved => "achieved",
            Verdict::NotFound => "not found",
            Verdict::CannotTell => "cannot tell",
            Verdict::Failed => "failed",
        };
        let answer = self.answer.as_ref().map(|a| format!("{a}; ")).unwrap_or_default();
        writeln!(f, "\n{answer}{verdict}: {}", self.why)?;
        if let (Some(object), Some([x, y, z])) = (&self.object, self.position_m) {
            writeln!(f, "  {object} at ({x:.3}, {y:.3}, {z:.3}) m, confidence {:.2}", self.confidence)?;
        }
        if let Some([x, y, z]) = self.true_position_m {
            writeln!(f, "  in truth at ({x:.3}, {y:.3}, {z:.3}) m")?;
        }
        for o in self.objects.iter().filter(|_| self.object.is_none()) {
            let [x, y, z] = o.position_m;
            let name = o.label.as_deref().unwrap_or("unknown");
            writeln!(f, "  {name:16} {:.2} at ({x:.3}, {y:.3}, {z:.3}) m", o.confidence)?;
        }
        writeln!(
            f,
            "  {} views, {} replans, {:.1} m and {:.0} s on the body's clock, {:.1} s on the wall, at most {:.3} s to plan and {:.3} s for its questions to geometry",
            self.views,
            self.replans,
            self.distance_m,
            self.sim_time_s,
            self.wall_s,
            self.planning_s,
            self.geometry_s
        )?;
        write!(f, "  record: {}", self.run)
    }
}

/// A percept in a line.
pub fn percept(p: &Percept) -> String {
    let name = p.label.as_deref().unwrap_or("unknown");
    let probability = p.label.as_deref().map_or(p.unknown, |label| p.probability_of(label));
    let (at, [w, d, h]) = (p.position_m, p.size_m.map(|m| m * 100.0));
    let seen = p.seen_fraction * 100.0;
    format!(
        "{name:16} {probability:.2}  at ({:.2}, {:.2}, {:.2}) m, {w:.0} x {d:.0} x {h:.0} cm, {seen:.0} % seen",
        at.x, at.y, at.z
    )
}
