//! Short justification of a plan: its total by the planner's metric, and the totals of its
//! alternatives.

use descry_planner::Unmet;

use super::Asked;
use super::chapters::Chapter;
use super::rivals::{self, LONGER_S, whole_s};
use super::wording::{by_share, share};
use descry_agent::numbers::number;
use descry_agent::reason::Break;
use descry_agent::standing::{Of, Seen};
use descry_agent::weigh::{Way, Weighed};

/// Sentences that justify a plan against its alternatives, as far as the record allows; those of
/// [`rivals::why`] where the totals are not known.
pub fn why(chapter: &Chapter, asked: &Asked<'_>) -> Vec<String> {
    if chapter.is_late() {
        return vec![rivals::IN_TIME.into()];
    }
    let chosen = chapter.weighed.as_ref().and_then(|weighed| weighed.chosen.as_ref());
    if let Some(cut) = &chapter.cut()
        && chosen.is_some_and(|chosen| !chosen.steps.is_empty() && self::whole_s(chosen).is_none())
        && asked.policy.is_none()
    {
        return vec![rivals::cut_short(cut)];
    }
    let known = chapter.weighed.as_ref().and_then(|weighed| {
        let chosen = weighed.chosen.as_ref()?;
        let whole_s = whole_s(chosen).filter(|_| asked.policy.is_none() && !weighed.others.is_empty())?;
        Some((weighed, chosen, whole_s))
    });
    let Some((weighed, chosen, whole_s)) = known else { return rivals::why(chapter, asked) };
    let of = format!("of {} ways to begin", weighed.open);
    let is_more = asked.counts_in_vain;
    let (best, comes_to) = match counts_more(chapter) {
        true => {
            let takes_s = chapter.makespan_s;
            ("cheapest", format!("it takes {takes_s:.1} s, and the planner counts {whole_s:.1} s"))
        }
        false => ("quickest", format!("{whole_s:.1} s as the planner counts")),
    };
    let first = match &chapter.cut() {
        Some(cut) => format!(
            "{of}, this is the best whole plan that the planner had when its search was ended after {cut}: {comes_to}."
        ),
        None => format!("{of}, this makes the {best} whole plan that was found: {comes_to}."),
    };
    let mut said = vec![first];
    said.extend(instead(chapter, (weighed, chosen), (whole_s, is_more), asked));
    said.extend(rivals::left(chapter, weighed, chosen, asked));
    said.extend(rivals::longer(weighed, chosen, asked));
    said.extend(unseen(chapter));
    said
}

/// True if the metric value of a plan exceeds its makespan by more than [`LONGER_S`].
pub fn counts_more(chapter: &Chapter) -> bool {
    let chosen = chapter.weighed.as_ref().and_then(|weighed| weighed.chosen.as_ref());
    chosen.and_then(whole_s).is_some_and(|whole_s| whole_s > chapter.makespan_s + LONGER_S)
}

/// Sentence with the total of each notable alternative; `None` without alternatives.
fn instead(
    chapter: &Chapter,
    (weighed, chosen): (&Weighed, &Way),
    counted: (f64, bool),
    asked: &Asked<'_>,
) -> Option<String> {
    let through = weighed.through.iter().map(|way| (way, Vec::new()));
    let rivals: Vec<&Way> =
        rivals::rivals(chapter, weighed, chosen).into_iter().chain(through).map(|(way, _)| way).collect();
    let all: Vec<String> = rivals
        .iter()
        .map(|way| format!("{} {}", called(way, chosen, &rivals, asked), comes_to(way, counted, asked)))
        .collect();
    (!all.is_empty()).then(|| format!("begun otherwise: {}.", all.join("; ")))
}

/// Name of an alternative: its last step, or all its steps if another one ends with the same step.
fn called(way: &Way, chosen: &Way, rivals: &[&Way], asked: &Asked<'_>) -> String {
    let alike = rivals.iter().copied().chain([chosen]).filter(|other| other.steps.last() == way.steps.last());
    match way.steps.last() {
        Some(last) if alike.count() <= 1 => asked.say(last),
        _ => asked.say_all(&way.steps, ", then "),
    }
}

/// Clause that compares the total of an alternative, with the rest of the plan after it, to that of
/// the chosen plan: (metric value, true if the metric counts more than time).
fn comes_to(way: &Way, (whole_s, is_more): (f64, bool), asked: &Asked<'_>) -> String {
    let take = if is_more { "count" } else { "take" };
    match way.whole {
        Some(whole) if whole.reaches => match whole.takes_s - whole_s {
            more_s if more_s.abs() <= LONGER_S && is_more => "would count as much".into(),
            more_s if more_s.abs() <= LONGER_S => "would take as long".into(),
            more_s if more_s > 0.0 => format!("would {take} {more_s:.1} s more"),
            more_s => format!("would {take} {:.1} s less: the planner did not come upon that", -more_s),
        },
        Some(_) => not_enough(way),
        None => match &way.blocked {
            Some(blocked) => blocked_by(way, blocked, asked),
            None => "could not be followed by the rest of the plan".into(),
        },
    }
}

/// Clause on the obstacle to the rest of the plan after an alternative.
fn blocked_by(way: &Way, blocked: &Break, asked: &Asked<'_>) -> String {
    let why = rivals::would_be(blocked, asked);
    match (blocked.missed_goal(), &blocked.step) {
        // What is wanted stands above; of a number how much it would be.
        (Some(Unmet { compared: Some(compared), .. }), _) => match compared.left_value {
            Some(value) => {
                let (name, value) = (asked.saying.say(&compared.left), number(value));
                format!("would not be enough ({name} would be {value})")
            }
            None => not_enough(way),
        },
        // Of one of several surfaces it says only that there is none.
        (Some(_), _) => not_enough(way),
        (None, Some(step)) if way.steps.contains(step) => format!("would not do: {why}"),
        (None, _) => format!("could not be followed by the rest of the plan: {why}"),
    }
}

/// Clause on an alternative that would miss the goal, with the gain that it promises.
fn not_enough(way: &Way) -> String {
    match way.gains > 0.0 {
        true => format!("would not be enough (+{} is hoped for)", share(way.gains)),
        false => "would not be enough".into(),
    }
}

/// Sentence with the probability of each place of the requested object before anything was seen;
/// `None` for later plans, which are explained by views.
fn unseen(chapter: &Chapter) -> Option<String> {
    let before = chapter.before.as_ref().filter(|_| chapter.round == 1)?;
    let doubt = before.doubts.iter().find(|doubt| doubt.of == Of::Thing && doubt.seen.len() > 1)?;
    let mut places: Vec<&Seen> = doubt.seen.iter().filter(|seen| seen.hidden > 0.0).collect();
    places.sort_by(|a, b| b.hidden.total_cmp(&a.hidden));
    let named = by_share(places.iter().map(|seen| (seen.hidden, format!("on the {}", seen.on))));
    (!named.is_empty()).then(|| format!("where {} may be before a first look: {named}.", doubt.about))
}
