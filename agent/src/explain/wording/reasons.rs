//! What the monitor and the planner said, in fewer and plainer words. What is not known here is passed on as it is.

use descry_domains::world::NOT_AS_SAID;

use crate::agent::AT_THE_END;

/// What a call of the domain asks, in words.
pub type Meanings<'a> = &'a dyn Fn(&str) -> Option<String>;

/// Why the rest of a plan would not do; `is` stands between a number of the goal and its value, and `counts` says what an action's
/// seconds are.
pub fn missed(because: &str, is: &str, counts: Meanings<'_>) -> String {
    goal(because, is)
        .or_else(|| reckoned(because, counts))
        .or_else(|| no_longer(because))
        .unwrap_or_else(|| because.trim_end_matches('.').to_string())
}

/// `the goal G is not reached: N is V`, of which the last part may be missing; at the end of a plan, or now.
pub fn goal(because: &str, is: &str) -> Option<String> {
    // What is so at the end of a plan is not so now.
    let (because, is) = match because.strip_prefix(AT_THE_END) {
        Some(at_the_end) => (at_the_end, "would be only"),
        None => (because, is),
    };
    let rest = because.strip_prefix("the goal ")?;
    let (goal, values) = rest.split_once(" is not reached")?;
    let values = values.trim_start_matches(':').trim();
    if values.is_empty() {
        return Some(format!("{goal} does not hold"));
    }
    let found = short(&values.replacen(" is ", &format!(" {is} "), 1));
    Some(match bound(goal) {
        Some((number, wanted)) if values.starts_with(number) => {
            format!("{}, and {wanted} is wanted", unlike(&found, values, &wanted))
        }
        _ => format!("{found} where {goal} is wanted"),
    })
}

/// What was found, with more digits where it would read as what is wanted, and is less.
fn unlike(found: &str, values: &str, wanted: &str) -> String {
    let number = |text: &str| text.rsplit(' ').next().and_then(|last| last.parse::<f64>().ok());
    match (number(values), number(wanted), found.rsplit_once(' ')) {
        (Some(value), Some(least), Some((before, said))) if value < least && said.parse() == Ok(least) => {
            format!("{before} {}", super::below(value))
        }
        _ => found.to_string(),
    }
}

/// The number that a comparison is about, and what it has to be: `(>= N V)`.
fn bound(condition: &str) -> Option<(&str, String)> {
    let rest = condition.strip_suffix(')')?;
    const SIGNS: [(&str, &str); 4] =
        [("(>= (", "at least"), ("(<= (", "at most"), ("(> (", "more than"), ("(< (", "less than")];
    let (most, rest) = SIGNS.iter().find_map(|(sign, most)| Some((*most, rest.strip_prefix(sign)?)))?;
    let end = rest.find(')')?;
    let from = condition.len() - 1 - rest.len() - 1;
    let number = &condition[from..from + end + 2];
    let value = &short(rest[end + 1..].trim());
    let is_one = !value.contains(' ') && !value.is_empty();
    is_one.then(|| (number, format!("{most} {value}")))
}

/// `step N CALL at T takes A, B is asked for`: nothing is wrong with the rest of a plan, but it counts for more or less. None for
/// another reason.
pub fn reckoned(because: &str, counts: Meanings<'_>) -> Option<String> {
    let (call, rest) = step(because)?;
    let (had, asked) = rest.split_once(" takes ")?.1.split_once(", ")?;
    let asked = asked.strip_suffix(" is asked for")?;
    let (had_s, asked_s): (f64, f64) = (had.parse().ok()?, asked.parse().ok()?);
    let counted = counts(call.trim_matches(['(', ')']).split(' ').next()?);
    let counted = counted.map(|about| format!("; counted are the {about}")).unwrap_or_default();
    Some(format!("{call} is now reckoned at {asked_s:.1} s instead of {had_s:.1} s{counted}"))
}

/// `step N CALL at T: C does not hold at its start…`, or not all the time.
fn no_longer(because: &str) -> Option<String> {
    let (call, rest) = step(because)?;
    let (_, rest) = rest.split_once(": ")?;
    let (condition, after) = rest.split_once(" does not hold")?;
    let all_the_time = after.trim_start().starts_with("all the time");
    if let (Some((number, wanted)), false) = (bound(condition), all_the_time)
        && let Some((_, values)) = after.split_once(": ")
        && let Some(found) = values.strip_prefix(number).and_then(|rest| rest.strip_prefix(" is "))
    {
        let (is, name) = (found.split(", ").next().unwrap_or(found), wanted.rsplit(' ').next().unwrap_or(""));
        // What is wanted may be a number that has a name of its own.
        let named = values.split(", ").find_map(|v| v.strip_prefix(name)?.strip_prefix(" is "));
        let wanted = named.map_or(wanted.clone(), |value| wanted.replace(name, &short(value)));
        // Of a step that others come before, it is what they are hoped to lead to.
        let verb = if because.starts_with("step 1 ") { "is" } else { "would be" };
        let is = unlike(&format!("it {verb} {}", short(is)), is, &wanted);
        return Some(format!("{call} needs {number} to be {wanted}, and {is}"));
    }
    let values = after.split_once(": ").map(|(_, values)| format!(", {}", short(values))).unwrap_or_default();
    if all_the_time {
        return Some(format!(
            "{call} asks that {condition} until it has ended, which would not be so{values}"
        ));
    }
    Some(format!("{call} asks that {condition}, which is not so{values}"))
}

/// Why a step failed.
pub fn failed(because: &str) -> String {
    let condition = because
        .strip_prefix(NOT_AS_SAID)
        .and_then(|broken| broken.split_once(": ")?.1.split_once(" does not hold all the time"));
    match condition {
        Some((condition, _)) => {
            format!("it came to its end, but until then it was not always so that {condition}")
        }
        None => because.to_string(),
    }
}

/// What is concluded from a failure: `try N of M`, or what is true from then on.
pub fn follows(therefore: &str) -> String {
    let tried = therefore.strip_prefix("try ").and_then(|tried| tried.split_once(" of "));
    match tried {
        Some((n, most)) if most.bytes().all(|b| b.is_ascii_digit()) => {
            let are = if n == "1" { "is" } else { "are" };
            format!(
                "{n} of {most} tries of this very step {are} used, and the plan is made anew with what is known now"
            )
        }
        _ => therefore.to_string(),
    }
}

/// The call of `step N CALL …`, and what follows.
pub fn step(because: &str) -> Option<(&str, &str)> {
    let rest = because.strip_prefix("step ")?;
    let from = rest.find('(')?;
    let to = from + rest[from..].find(')')? + 1;
    Some((&rest[from..to], &rest[to..]))
}

/// Numbers with at most three digits behind the point; what may be a share as shares are told.
fn short(text: &str) -> String {
    let word = |word: &str| {
        let bare = word.trim_end_matches([',', '.', ';']);
        match bare.parse::<f64>() {
            Ok(value) if bare.contains('.') && (0.0..=1.0).contains(&value) => {
                format!("{}{}", super::share(value), &word[bare.len()..])
            }
            Ok(value) if bare.contains('.') => {
                let digits = format!("{value:.3}");
                format!("{}{}", digits.trim_end_matches('0').trim_end_matches('.'), &word[bare.len()..])
            }
            _ => word.to_string(),
        }
    };
    text.split(' ').map(word).collect::<Vec<_>>().join(" ")
}

/// What the planner said of a task without a plan. Calls that were refused are told by what they ask, and counted: which of them
/// comes first says nothing. Those that `is_used` says no plan of the run has asked are left out, where there are others.
pub fn no_plan(said: &str, meanings: Meanings<'_>, is_used: &dyn Fn(&str) -> bool) -> String {
    let all: Vec<&str> = said.split('\n').filter(|part| !part.trim().is_empty()).collect();
    let counts = |part: &&&str| refused_call(part).is_none_or(is_used);
    let used: Vec<&str> = all.iter().filter(counts).copied().collect();
    let is_any = used.iter().any(|part| refused_call(part).is_some());
    let parts = if is_any { used } else { all };
    let told = parts.iter().map(|part| refused(part, meanings).unwrap_or_else(|| plain(part)));
    told.collect::<Vec<_>>().join("; ")
}

/// Before which words it is said that an attachment gave the wrong answer, its name, and how it answered.
fn refusal(part: &str) -> Option<(&str, &str, &str)> {
    let (before, rest) = part.split_once("the attachment of `")?;
    let (name, rest) = rest.split_once("` ")?;
    Some((before, name, rest))
}

fn refused_call(part: &str) -> Option<&str> {
    refusal(part).map(|(_, name, _)| name)
}

/// What the planner says when it has looked at everything.
const ALL_SEEN: &str = "every state that can be reached was seen, and none fulfils the whole goal";

#[doc(hidden)]
pub fn plain(part: &str) -> String {
    let plainer = "whatever is done next, and in whatever order, the goal is not reached: what it needs excludes each other, or \
                   would end too late";
    match part.split_once(ALL_SEEN) {
        Some((before, _)) => format!("{before}{plainer}"),
        None => part.trim_end_matches('.').to_string(),
    }
}

/// ``the attachment of `NAME` said no to: LIST``, or how else it answered, at the end of a text.
fn refused(part: &str, meanings: Meanings<'_>) -> Option<String> {
    let (before, name, rest) = refusal(part)?;
    let (answer, list) = rest.split_once(": ")?;
    let answer = match answer {
        "said no to" => "no",
        "said yes, where no is needed, to" => "yes, where no is needed,",
        _ => "impossible",
    };
    let list = list.split_once(" (with any").map_or(list, |(list, _)| list);
    let mut calls = list.split("], ");
    let first = calls.next().unwrap_or_default();
    let first = first.split_once(" and ").map_or(first, |(first, _)| first).trim_end_matches(']');
    let named = calls.count();
    let more =
        list.rsplit_once(" and ").and_then(|(_, more)| more.strip_suffix(" more")?.trim().parse().ok());
    // What a number is stands before what it is in cases that are rare.
    let about = meanings(name).map(|about| {
        let about = about.split(';').next().unwrap_or_default().to_string();
        if about.starts_with("whether ") { about } else { format!("for the {about}") }
    });
    if let (Some(about), "impossible") = (&about, answer) {
        let times = named + more.unwrap_or(0) + 1;
        return Some(format!("{before}it was asked {about}, and {times} times there were none"));
    }
    Some(match (about, named + more.unwrap_or(0)) {
        (Some(about), 0) => format!("{before}asked {about}, the answer is {answer} for {first}]"),
        (Some(about), others) => {
            format!(
                "{before}it was asked {about}, {} times, and each time the answer was {answer}",
                others + 1
            )
        }
        (None, 0) => format!("{before}{name} is {answer} for {first}]"),
        (None, others) => format!("{before}{name} is {answer} in {} cases", others + 1),
    })
}
