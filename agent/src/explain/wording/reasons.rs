//! What the monitor and the planner said, in fewer and plainer words. What is not known here is passed on as it is.

/// Why the rest of a plan would not do; `is` stands between a number of the goal and its value.
pub fn missed(because: &str, is: &str) -> String {
    goal(because, is)
        .or_else(|| takes(because))
        .or_else(|| no_longer(because))
        .unwrap_or_else(|| because.trim_end_matches('.').to_string())
}

/// `the goal G is not reached: N is V`, of which the last part may be missing.
fn goal(because: &str, is: &str) -> Option<String> {
    let rest = because.strip_prefix("the goal ")?;
    let (goal, values) = rest.split_once(" is not reached")?;
    let values = values.trim_start_matches(':').trim();
    if values.is_empty() {
        return Some(format!("{goal} does not hold"));
    }
    Some(format!("{} where {goal} is wanted", short(&values.replacen(" is ", &format!(" {is} "), 1))))
}

/// `step N CALL at T takes A, B is asked for`.
fn takes(because: &str) -> Option<String> {
    let (call, rest) = step(because)?;
    let (had, asked) = rest.split_once(" takes ")?.1.split_once(", ")?;
    let asked = asked.strip_suffix(" is asked for")?;
    let (had_s, asked_s): (f64, f64) = (had.parse().ok()?, asked.parse().ok()?);
    Some(format!("{call} would now count for {asked_s:.1} s, not for {had_s:.1}"))
}

/// `step N CALL at T: C does not hold at its start…`, or not all the time.
fn no_longer(because: &str) -> Option<String> {
    let (call, rest) = step(because)?;
    let (_, rest) = rest.split_once(": ")?;
    let (condition, after) = rest.split_once(" does not hold")?;
    let values = after.split_once(": ").map(|(_, values)| format!(", {}", short(values))).unwrap_or_default();
    if after.trim_start().starts_with("all the time") {
        return Some(format!(
            "{call} asks for {condition} as long as it lasts, which would end before{values}"
        ));
    }
    Some(format!("{call} asks for {condition}, which does not hold{values}"))
}

/// What is concluded from a failure: `try N of M`, or what is true from then on.
pub fn follows(therefore: &str) -> String {
    let tried = therefore.strip_prefix("try ").and_then(|tried| tried.split_once(" of "));
    match tried {
        Some((n, most)) if most.bytes().all(|b| b.is_ascii_digit()) => {
            format!("{n} of {most} tries are used, and the plan is made anew with what is known now")
        }
        _ => therefore.to_string(),
    }
}

/// The call of `step N CALL …`, and what follows.
fn step(because: &str) -> Option<(&str, &str)> {
    let rest = because.strip_prefix("step ")?;
    let from = rest.find('(')?;
    let to = from + rest[from..].find(')')? + 1;
    Some((&rest[from..to], &rest[to..]))
}

/// Numbers with at most three digits behind the point.
fn short(text: &str) -> String {
    let word = |word: &str| {
        let bare = word.trim_end_matches([',', '.', ';']);
        match bare.parse::<f64>() {
            Ok(value) if bare.contains('.') => {
                let digits = format!("{value:.3}");
                format!("{}{}", digits.trim_end_matches('0').trim_end_matches('.'), &word[bare.len()..])
            }
            _ => word.to_string(),
        }
    };
    text.split(' ').map(word).collect::<Vec<_>>().join(" ")
}

/// What the planner said of a task without a plan; calls of which there are many are counted, for which of them comes first says nothing.
pub fn no_plan(said: &str) -> String {
    const LIST: &str = " said no to: ";
    let mut out = String::new();
    for part in said.split('\n').filter(|part| !part.trim().is_empty()) {
        if !out.is_empty() {
            out += "; ";
        }
        let Some((before, list)) = part.split_once(LIST) else {
            out += part.trim_end_matches('.');
            continue;
        };
        let list = list.split_once(" (with any").map_or(list, |(list, _)| list);
        let mut calls = list.split("], ");
        let first = calls.next().unwrap_or_default().trim_end_matches(']');
        let named = calls.count();
        let more: usize = list
            .rsplit_once(" and ")
            .and_then(|(_, more)| more.strip_suffix(" more")?.trim().parse().ok())
            .unwrap_or(0);
        let first = first.split_once(" and ").map_or(first, |(first, _)| first.trim_end_matches(']'));
        match named + more {
            0 => out += &format!("{before}{LIST}{first}]"),
            others => out += &format!("{before} said no to all of {} calls", others + 1),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_monitor_says_is_made_plain() {
        let cases = [
            (
                "the goal (>= (confidence cup-a) 0.8) is not reached: (confidence cup-a) is 0.628928",
                "(confidence cup-a) would be only 0.629 where (>= (confidence cup-a) 0.8) is wanted",
            ),
            ("the goal (on a b) is not reached", "(on a b) does not hold"),
            (
                "step 2 (observe a b) at 28.464493 takes 2, 12.911622 is asked for",
                "(observe a b) would now count for 12.9 s, not for 2.0",
            ),
            (
                "step 1 (pick-up a) at 1.5: (>= (presence a) (sure)) does not hold at its start: (presence a) is 0.000008, (sure) is 0.8",
                "(pick-up a) asks for (>= (presence a) (sure)), which does not hold, (presence a) is 0, (sure) is 0.8",
            ),
            (
                "step 2 (go) at 3: [worth x] does not hold at its start",
                "(go) asks for [worth x], which does not hold",
            ),
            (
                "step 1 (observe a b) at 2.26: (time-left) does not hold all the time",
                "(observe a b) asks for (time-left) as long as it lasts, which would end before",
            ),
            ("something else.", "something else"),
        ];
        cases.iter().for_each(|(said, plain)| assert_eq!(missed(said, "would be only"), *plain));
    }

    #[test]
    fn what_follows_from_a_failure_is_no_promise_to_do_it_again() {
        let plain = "1 of 4 tries are used, and the plan is made anew with what is known now";
        assert_eq!(follows("try 1 of 4"), plain);
        assert_eq!(follows("(shut study-door)"), "(shut study-door)");
    }

    #[test]
    fn long_lists_are_cut() {
        let said = "the attachment of `w` said no to: [w a b], [w c d] and 5 more (with any of these answered otherwise there might be a plan)\nthe attachment of `v` said no to: [v x] (with any …)";
        let plain =
            "the attachment of `w` said no to all of 7 calls; the attachment of `v` said no to: [v x]";
        assert_eq!(no_plan(said), plain);
        assert_eq!(no_plan("nothing."), "nothing");
    }
}
