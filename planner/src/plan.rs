//! Plans: steps with start times and durations, in the text format of the planning competitions.

#[doc(hidden)]
pub mod format;

use std::fmt;

use crate::diagnostic::{Diagnostic, Findings, Source, Span};

/// Minimum time between two happenings that interfere with each other (epsilon), seconds.
pub const EPSILON_S: f64 = 0.001;

/// Step of a plan.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Step {
    /// Start time, seconds from the beginning of the plan; `None` in a plan without times.
    pub start_s: Option<f64>,
    /// Name of the action.
    pub action: String,
    /// Names of the argument objects, then the parameters proposed by grounding modules.
    pub arguments: Vec<String>,
    /// Duration, seconds; 0 for an instantaneous action.
    pub duration_s: f64,
}

/// Plan.
#[derive(Debug, Clone, PartialEq, Default, serde::Serialize)]
pub struct Plan {
    /// Steps in order of time.
    pub steps: Vec<Step>,
    /// Metric value of the plan; `None` if not known.
    pub cost: Option<f64>,
}

impl Plan {
    /// Parses steps such as `0.000: (move a b) [3.200]` or `(move a b)`, one or more per line, and
    /// sorts them by time.
    ///
    /// # Errors
    /// Findings about lines that are not steps, and about steps with and without times in one plan.
    pub fn read(source: &Source) -> Result<Plan, Findings> {
        let at = source.text.len() - source.text.trim_start_matches('\u{feff}').len();
        let mut reader = Reader { text: &source.text, at, findings: Vec::new() };
        let mut plan = Plan { steps: Vec::new(), cost: cost_comment(&source.text) };
        let mut places: Vec<Span> = Vec::new();
        while let Some((step, place)) = reader.step() {
            plan.steps.push(step);
            places.push(place);
        }
        let timed = plan.steps.first().map(|step| step.start_s.is_some());
        let other = plan.steps.iter().position(|step| Some(step.start_s.is_some()) != timed);
        if let (Some(other), Some(&first)) = (other, places.first()) {
            let message = "some steps have a time and some have none";
            let finding = Diagnostic::error("plan", message, places[other], "unlike the first step");
            reader.findings.push(finding.with_label(first, "the first step"));
        }
        if !reader.findings.is_empty() {
            return Err(Findings { sources: vec![source.clone()], list: reader.findings });
        }
        plan.steps.sort_by(|one, other| one.start_s.unwrap_or(0.0).total_cmp(&other.start_s.unwrap_or(0.0)));
        Ok(plan)
    }

    /// Plan whose times are rounded to microseconds where that changes them by less than a
    /// nanosecond (rounding noise).
    pub fn tidy(&self) -> Plan {
        let rounded = |seconds: f64| {
            let short = (seconds * 1e6).round() / 1e6;
            if (short - seconds).abs() < 1e-9 { short } else { seconds }
        };
        let mut plan = self.clone();
        for step in &mut plan.steps {
            step.start_s = step.start_s.map(rounded);
            step.duration_s = rounded(step.duration_s);
        }
        plan
    }

    /// End time of the last step, seconds; 0 for an empty plan, `None` for a plan without times.
    pub fn makespan_s(&self) -> Option<f64> {
        self.steps.iter().try_fold(0.0, |last: f64, step| Some(last.max(step.start_s? + step.duration_s)))
    }
}

impl fmt::Display for Plan {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for step in &self.steps {
            if let Some(start_s) = step.start_s {
                write!(f, "{}: ", seconds(start_s))?;
            }
            write!(f, "({}", step.action)?;
            for argument in &step.arguments {
                write!(f, " {argument}")?;
            }
            f.write_str(")")?;
            if step.start_s.is_some() {
                write!(f, " [{}]", seconds(step.duration_s))?;
            }
            f.write_str("\n")?;
        }
        if let Some(cost) = self.cost {
            writeln!(f, "; cost = {}", number_text(cost))?;
        }
        Ok(())
    }
}

/// Seconds as text, with three decimals; six if three are inexact, or as many as needed.
pub fn seconds(value: f64) -> String {
    let short = [3, 6].map(|digits| format!("{value:.digits$}"));
    let exact = |text: &&String| text.parse() == Ok(value);
    short.iter().find(exact).cloned().unwrap_or_else(|| format!("{value}"))
}

/// Number as text, rounded to six decimals; very small and very large numbers with an exponent.
pub fn number_text(value: f64) -> String {
    const DIGITS: f64 = 1e6;
    let size = value.abs();
    if size != 0.0 && !(1.0 / DIGITS..1e15).contains(&size) {
        return if value.is_finite() { format!("{value:e}") } else { format!("{value}") };
    }
    let rounded = (value * DIGITS).round() / DIGITS;
    format!("{}", if size < 1e9 { rounded + 0.0 } else { value })
}

fn cost_comment(text: &str) -> Option<f64> {
    let comment = text.lines().filter_map(|line| line.trim().strip_prefix(';'));
    let value =
        comment.filter_map(|line| line.trim().strip_prefix("cost")?.trim().strip_prefix('=')).next()?;
    value.split_whitespace().next()?.parse().ok()
}

#[doc(hidden)]
pub struct Reader<'a> {
    text: &'a str,
    at: usize,
    findings: Vec<Diagnostic>,
}

impl Reader<'_> {
    fn rest(&self) -> &str {
        &self.text[self.at..]
    }

    fn skip_blanks(&mut self) {
        loop {
            let blanks = self.rest().len() - self.rest().trim_start().len();
            self.at += blanks;
            if !self.rest().starts_with(';') {
                return;
            }
            self.at += self.rest().find('\n').unwrap_or(self.rest().len());
        }
    }

    /// Next step of the text; `None` at the end. Reports text that is not a step, and skips its
    /// line.
    fn step(&mut self) -> Option<(Step, Span)> {
        loop {
            self.skip_blanks();
            if self.rest().is_empty() {
                return None;
            }
            let start = self.at;
            match self.try_step() {
                Ok(step) => return Some((step, span(start, self.at))),
                Err((message, help)) => {
                    let end = self.text[start..].find('\n').map_or(self.text.len(), |line| start + line);
                    let written = self.text[start..end].trim_end().len();
                    let finding =
                        Diagnostic::error("plan", message, span(start, start + written), "not a step");
                    self.findings.push(finding.with_help(help));
                    self.at = end;
                }
            }
        }
    }

    fn try_step(&mut self) -> Result<Step, (&'static str, &'static str)> {
        const SHAPE: &str =
            "a step looks like `0.000: (move a b) [3.200]`, or `(move a b)` in a plan without times";
        let start_s = match self.rest().find([':', '(', '\n']) {
            Some(colon) if self.rest()[colon..].starts_with(':') => {
                let time = self.rest()[..colon].trim().parse::<f64>().ok().filter(|time| time.is_finite());
                let time = time.ok_or(("a time was expected before `:`", SHAPE))?;
                self.at += colon + 1;
                self.skip_blanks();
                Some(time)
            }
            _ => None,
        };
        if start_s.is_some_and(|time| time < 0.0) {
            return Err(("a step before the beginning of the plan", "times start at 0"));
        }
        if !self.rest().starts_with('(') {
            return Err(("a step was expected", SHAPE));
        }
        let close = self.rest().find(')').ok_or(("a step without its `)`", SHAPE))?;
        let mut words = self.rest()[1..close].split_whitespace().map(str::to_string);
        let action = words.next().ok_or(("a step without an action", SHAPE))?.to_ascii_lowercase();
        let arguments: Vec<String> = words.collect();
        if action.contains('(') || arguments.iter().any(|word| word.contains('(')) {
            return Err(("a step without its `)`", SHAPE));
        }
        self.at += close + 1;
        let line = self.rest().trim_start_matches([' ', '\t']);
        let mut duration_s = 0.0;
        if line.starts_with('[') {
            let end = line.find(']').ok_or(("a duration without its `]`", SHAPE))?;
            // Some planners write `[D:3.0; C:1.0]`.
            let inside = line[1..end].split(';').next().unwrap_or("").trim().trim_start_matches("D:").trim();
            duration_s = inside
                .parse::<f64>()
                .ok()
                .filter(|duration| duration.is_finite() && *duration >= 0.0)
                .ok_or(("a duration that is not a number from 0", SHAPE))?;
            self.at = self.text.len() - line.len() + end + 1;
        }
        Ok(Step { start_s, action, arguments, duration_s })
    }
}

fn span(start: usize, end: usize) -> Span {
    Span { source: 0, start: start as u32, end: end as u32 }
}
