//! Explanation of each plan: why it was made, what for, and what came of it.

use descry_agent::reason::{Break, Reason, Trigger};
use descry_domains::lesson::Lesson;
use descry_domains::note::Note;
use descry_skills::Call;

use super::chapters::{Chapter, Deed};
use super::wording::{capital, listed, share, share_of};
use super::{Asked, Told, brief, outcomes, rivals};
use descry_agent::standing::{InDoubt, Of};
use descry_agent::weigh::Expected;

/// Maximum number of numbers listed by name; the rest are counted.
const MOST_NAMED: usize = 3;
/// Maximum number of steps left out that are listed by name; the rest are counted.
const MOST_LEFT_OUT: usize = 4;

/// Explanations of all plans of a run.
pub fn told(chapters: &[Chapter], asked: &Asked<'_>) -> Vec<Told> {
    let at = |n: usize| chapters.get(n);
    let all = chapters.iter().enumerate();
    all.map(|(n, chapter)| tell(chapter, n.checked_sub(1).and_then(at), at(n + 1), asked)).collect()
}

pub fn tell(chapter: &Chapter, before: Option<&Chapter>, after: Option<&Chapter>, asked: &Asked<'_>) -> Told {
    Told {
        round: chapter.round,
        at_s: chapter.at_s,
        cause: cause(chapter, before, asked),
        intent: intent(chapter, asked),
        why: brief::why(chapter, asked),
        figures: rivals::why(chapter, asked),
        outcome: outcomes::of(chapter, &asked.goal, asked.saying)
            .into_iter()
            .map(|outcome| outcome.said)
            .collect(),
        done: done(chapter, after, asked),
    }
}

/// Sentence about the steps executed, and the steps left out with the reason. `after` is the next
/// plan.
fn done(chapter: &Chapter, after: Option<&Chapter>, asked: &Asked<'_>) -> String {
    let (_, open) = chapter.steps_done();
    let all = chapter.steps.len();
    if open.is_empty() {
        return if all == 1 { "its only step.".into() } else { format!("all of its {all} steps.") };
    }
    let done = if open.len() == all { "none".into() } else { (all - open.len()).to_string() };
    let failed = chapter.failures(asked.saying).last().map(|(call, _)| *call);
    let left_out: Vec<String> =
        open.iter().filter(|call| failed != Some(**call)).map(|call| asked.say(call)).collect();
    let left_out = listed(&left_out, MOST_LEFT_OUT);
    let because = match (failed, after) {
        (Some(call), _) if left_out.is_empty() => {
            return format!("{done} of its {all} steps: {} failed.", asked.say(call));
        }
        (Some(call), _) => {
            let call = asked.say(call);
            return format!("{done} of its {all} steps: {call} failed. Left out with it: {left_out}.");
        }
        (None, Some(after)) if after.calls.iter().eq(open.iter().copied()) => {
            return format!(
                "{done} of its {all} steps. Left to plan {}, which has the same steps: {left_out}.",
                after.round
            );
        }
        (None, Some(after)) => format!("plan {} was made instead, for what is said there", after.round),
        (None, None) if asked.has_ended => "the run ended before, for what is said below".into(),
        (None, None) => "the record ends here".into(),
    };
    format!("{done} of its {all} steps. Left out: {left_out}, because {because}.")
}

/// Sentence about the event that made a plan necessary: a failure, new knowledge that invalidated
/// the previous plan, or its completion without reaching the goal.
fn cause(chapter: &Chapter, before: Option<&Chapter>, asked: &Asked<'_>) -> String {
    let Some(before) = before else { return "the run began, and there was no plan.".into() };
    let last = before.deeds.iter().rev().find(|deed| !matches!(deed, Deed::Resumed | Deed::Stands(_)));
    if let Some(Deed::Failed { call, therefore, lesson, .. }) = last {
        let follows = follows(call, therefore, lesson.as_ref(), asked);
        let (call, less) = (asked.say(call), seen_less(chapter, before));
        return format!("{call} failed. What follows from that: {follows}.{less}");
    }
    let moved = before.deeds.iter().rev().find_map(|deed| match deed {
        Deed::Noted(Note::Changed { because }) => Some(format!("something was moved: {because}. ")),
        _ => None,
    });
    let done = match before.steps_done().1.len() {
        0 => {
            format!("plan {} was carried out to its end, and {}.", before.round, missed(chapter, asked))
        }
        left => {
            let (rest, count) = match left {
                1 => ("step that was".into(), "counts"),
                _ => (format!("{left} steps that were"), "count"),
            };
            let rest = format!("the {rest} left of plan {}", before.round);
            let now = missed(chapter, asked);
            match chapter.broken().and_then(Break::reckoned) {
                Some((call, ..)) => {
                    let counted = (asked.counts)(&call.action);
                    let now = match counted {
                        Some(counted) if is_first_now(call, before) => format!(
                            "{now}: it was a further look there, and would be the first of a new plan, with which the {counted} \
                             are counted"
                        ),
                        Some(counted) => format!("{now}; counted are the {counted}"),
                        None => now,
                    };
                    format!(
                        "with what was learned, {rest} {count} differently: {now}.{}",
                        enough_now(chapter, before)
                    )
                }
                None => {
                    let open = before.steps_done().1;
                    match chapter.calls.iter().eq(open.iter().copied()) {
                        true => format!(
                            "what was left of plan {} would not do: {now}. No plan that would is known: it is gone on \
                             with.",
                            before.round
                        ),
                        false => format!("with what was learned, {rest} would not do: {now}."),
                    }
                }
            }
        }
    };
    let done = if moved.is_some() { capital(&done) } else { done };
    // None of many that are all nothing is the greatest.
    let most = chapter.most.as_ref().filter(|(_, most)| share(*most) != share(0.0));
    let least = |name: &str| asked.wanted(name).unwrap_or(0.0);
    let most = most.map(|(name, most)| match hoped_of_left(chapter, name) {
        Some((hoped, now, then)) => {
            let hoped = asked.saying.say(hoped);
            format!(" Hoped of that: {hoped} from {} to {}.", share(now), share(then))
        }
        None => {
            let said = asked.saying.say(name);
            format!(" The greatest by now: {said}, {}.", share_of(*most, least(name)))
        }
    });
    format!("{}{done}{}", moved.unwrap_or_default(), most.unwrap_or_default())
}

/// Name, present value and expected value of the best number that differs from `number` only in its
/// last argument, as expected of the remaining previous plan; `None` if there is none.
fn hoped_of_left<'c>(chapter: &'c Chapter, number: &str) -> Option<(&'c str, f64, f64)> {
    let (begins, _) = number.rsplit_once(' ')?;
    let all = chapter.weighed.iter().flat_map(|weighed| &weighed.left_numbers);
    let alike = all.filter(|expected| expected.name.rsplit_once(' ').is_some_and(|(own, _)| own == begins));
    let most = alike.max_by(|a, b| a.then.total_cmp(&b.then))?;
    Some((&most.name, most.now, most.then))
}

/// Clause about why the previous plan became invalid.
fn missed(chapter: &Chapter, asked: &Asked<'_>) -> String {
    match &chapter.reason {
        Some(Reason { trigger: Trigger::Broken(broken), .. }) => broken.told(asked.saying),
        Some(reason) => Reason::of(reason.trigger.clone()).told(asked.saying),
        None => chapter.because.clone(),
    }
}

/// Clause about the conclusion drawn from a failure.
fn follows(call: &Call, therefore: &str, lesson: Option<&Lesson>, asked: &Asked<'_>) -> String {
    match lesson {
        Some(Lesson::Retry { tries, most }) => {
            let are = if *tries == 1 { "is" } else { "are" };
            format!(
                "{tries} of {most} tries of this very step {are} used, and the plan is made anew with what is known now"
            )
        }
        Some(lesson) => lesson.told(call, asked.saying),
        None => therefore.to_string(),
    }
}

/// True if the previous plan has executed a step with the same action and the same last argument.
fn is_first_now(step: &Call, before: &Chapter) -> bool {
    let is_like = |done: &&Call| done.action == step.action && done.arguments.last() == step.arguments.last();
    before.steps_done().0.iter().any(is_like)
}

/// Sentences about the objects whose position became certain enough since the previous plan; empty
/// if there are none.
fn enough_now(chapter: &Chapter, before: &Chapter) -> String {
    let (Some(now), Some(then)) = (&chapter.before, &before.before) else { return String::new() };
    let is_new = |doubt: &&InDoubt| {
        let is_enough = |doubt: &InDoubt| doubt.sure.is_some_and(|sure| sure >= doubt.wanted);
        doubt.of == Of::Thing && is_enough(doubt) && then.same(doubt).is_some_and(|then| !is_enough(then))
    };
    let all = now.doubts.iter().filter(is_new);
    let told = all.filter_map(|doubt| {
        let sure = share(doubt.sure?);
        Some(format!(" It is sure enough of where {} stands by now, with {sure}.", doubt.about))
    });
    told.collect()
}

/// Sentence about surfaces of which less counts as seen than after the last step of the previous
/// plan; empty if there are none.
fn seen_less(chapter: &Chapter, before: &Chapter) -> String {
    let Some(now) = &chapter.before else { return String::new() };
    // How things stood before what made them so as they are now.
    let Some(then) = before.stood().filter(|then| then.stamp_ns < now.stamp_ns).last() else {
        return String::new();
    };
    let percent = |share: f64| (share * 100.0).floor();
    let mut all: Vec<String> = Vec::new();
    for (now, then) in now.doubts.iter().filter_map(|now| Some((now, then.same(now)?))) {
        for (now, then) in now.seen.iter().filter_map(|s| Some((s, then.seen.iter().find(|t| t.on == s.on)?)))
        {
            if let (Some(less), Some(was)) = (now.share, then.share)
                && percent(less) < percent(was)
            {
                all.push(format!(
                    "{:.0} % of the {} instead of {:.0} %",
                    percent(less),
                    now.on,
                    percent(was)
                ));
            }
        }
    }
    all.dedup();
    match all.len() {
        0 => String::new(),
        n => format!(" What was touched counts as not seen: {} is seen by now.", listed(&all, n)),
    }
}

pub fn intent(chapter: &Chapter, asked: &Asked<'_>) -> Vec<String> {
    let steps: Vec<String> = chapter.calls.iter().map(|call| asked.say(call)).collect();
    let mut said = vec![format!("{}.", steps.join(", then "))];
    let mut numbers: Vec<&Expected> = chapter.weighed.iter().flat_map(|w| &w.numbers).collect();
    numbers.sort_by(|a, b| (b.then - b.now).abs().total_cmp(&(a.then - a.now).abs()));
    let one = |n: &&Expected| {
        let wanted = asked.wanted(&n.name);
        // What looks promise is added up: of what ends at 1 it may be more.
        let is_share = wanted.is_some_and(|wanted| wanted <= 1.0) && (0.0..=1.0).contains(&n.now);
        let then = if is_share { n.then.min(1.0) } else { n.then };
        let least = wanted.unwrap_or(0.0);
        let wanted = wanted.map(|w| format!(" ({} is wanted)", share(w))).unwrap_or_default();
        let name = asked.saying.say(&n.name);
        format!("{name} from {} to {}{wanted}", share_of(n.now, least), share_of(then, least))
    };
    let named: Vec<String> = numbers.iter().take(MOST_NAMED).map(one).collect();
    if !named.is_empty() {
        let more = numbers.len().saturating_sub(MOST_NAMED);
        let more = if more > 0 { format!(", and {more} more") } else { String::new() };
        said.push(format!("Hoped for: {}{more}.", named.join(", ")));
    }
    said
}
