//! Evidence for the verdict of a run: the belief about the requested object and its views, the
//! share seen of each surface, and the probability that is left.

use std::collections::{BTreeMap, BTreeSet};

use descry_agent::exit::CommandError;
use descry_agent::report::{self, Report};
use descry_agent::standing::{self, End, InDoubt, Of, Rests, Seen};
use descry_domains::conclusion::Verdict;
use descry_domains::saying::Saying;
use descry_domains::symbol::symbol;
use descry_domains::{english, no_plan};
use descry_memory::belief::{Belief, Track};
use descry_memory::{Document, Query, Record};
use descry_planner::NoPlan;

use super::looks::HARDLY;
use super::standings::Standing;
use super::states::{Difference, States};
use super::wording::{count, listed, place, share};

/// Maximum number of objects described one by one; the rest are counted.
const MOST_NAMED: usize = 12;

/// Wording of a run's domain, and what else the evidence depends on.
pub struct Wording<'a> {
    /// Description of an attachment call, by name.
    pub meanings: no_plan::Meanings<'a>,
    /// True for an attachment call that an action of the run's plans makes.
    pub is_used: &'a dyn Fn(&str) -> bool,
    /// Wording of the domain.
    pub saying: &'a Saying,
    /// States of the run after its steps.
    pub stood: &'a [&'a Standing],
    /// Probability below which the object is reported to be absent; `None` if unknown.
    pub not_there: Option<f64>,
    /// Probability below which a further observation is not worthwhile; `None` if unknown.
    pub negligible: Option<f64>,
}

/// Sentences about the evidence. Messages about damaged records are added to `lost`.
///
/// # Errors
/// [`CommandError::Broken`] if the record cannot be read.
pub fn rests_on(
    record: &Record,
    report: Option<&Report>,
    states: &States,
    words: &Wording<'_>,
    lost: &mut Vec<String>,
) -> Result<Vec<String>, CommandError> {
    let Some(report) = report else {
        return Ok(vec!["there is no verdict: the run was cut off (descry do --resume goes on with it), or its report is lost.".into()]);
    };
    let (found, faults) =
        record.find_whole(&Query::of_kind(standing::RESTS)).map_err(CommandError::broken)?;
    lost.extend(faults.iter().map(ToString::to_string));
    let rests = found.last().and_then(|d| serde_json::from_value::<Rests>(d.body.clone()).ok());
    let verdict = report::words(report.verdict);
    let verdict = match &report.answer {
        Some(answer) if answer != verdict => format!("the answer is {answer} ({verdict})"),
        Some(answer) => format!("the answer is {answer}"),
        None => verdict.to_string(),
    };
    let mut said = vec![format!("{verdict}: {}.", report.why)];
    let (beliefs, faults) = record.find_whole(&Query::of_kind("belief")).map_err(CommandError::broken)?;
    lost.extend(faults.iter().map(ToString::to_string));
    let mut newest = beliefs.last().and_then(|d| serde_json::from_value::<Belief>(d.body.clone()).ok());
    if rests.iter().flat_map(|rests| &rests.in_doubt).any(|doubt| doubt.lost > HARDLY) {
        // It was in the hand at the last look, and no longer is.
        newest.iter_mut().for_each(|belief| belief.tracks.retain(|track| !track.on.is_empty()));
    }
    match &newest {
        Some(belief) => {
            said.push("after the last look this was believed:".into());
            said.extend(believed(belief, report, words));
            let since = beliefs.last().and_then(|look| states.since(look.id));
            let since = since.filter(|since: &Difference| !since.is_empty());
            said.extend(since.map(|since| {
                let since = since.told(words.saying);
                format!("and by what was done since that look: {since}.")
            }));
        }
        None if report.objects.is_empty() => said.push("no object was looked for.".into()),
        None => said.push("what was believed of each object is not in the record.".into()),
    }
    let looks = Looks::of(record)?;
    match rests {
        Some(rests) => {
            said.extend(rests.in_doubt.iter().map(|doubt| seen(doubt, words.stood, &looks)));
            said.extend(left(&rests, report, states.left_s(), words));
        }
        None => said
            .push("what was seen of each surface in the end, and what is left, is not in the record.".into()),
    }
    Ok(said)
}

/// Observations of a run: viewpoint, and the symbols of the surfaces that were seen.
struct Looks(Vec<(String, Vec<String>)>);

impl Looks {
    fn of(record: &Record) -> Result<Self, CommandError> {
        let (clouds, _) = record.find_whole(&Query::of_kind("cloud")).map_err(CommandError::broken)?;
        let part = |d: &Document| {
            let on = serde_json::from_value(d.body["on"].clone()).ok()?;
            Some((d.body["from"].as_str()?.to_owned(), on))
        };
        Ok(Looks(clouds.iter().filter_map(part).collect()))
    }

    /// Number of viewpoints from which a surface was seen.
    fn places(&self, on: &str) -> usize {
        let on = symbol(on);
        let from = self.0.iter().filter(|(_, shown)| shown.contains(&on)).map(|(from, _)| from);
        from.collect::<BTreeSet<_>>().len()
    }
}

/// Sentences about the requested object; if the request was not for one object, about every object,
/// least certain first.
fn believed(belief: &Belief, report: &Report, words: &Wording<'_>) -> Vec<String> {
    let mut tracks: Vec<&Track> = belief.tracks.iter().collect();
    let Some(name) = &report.object else {
        let (strange, mut tracks): (Vec<&Track>, Vec<&Track>) =
            tracks.into_iter().partition(|track| track.unknown > 1.0 - HARDLY);
        tracks.sort_by(|a, b| a.certainty().total_cmp(&b.certainty()));
        let mut said: Vec<String> = tracks.iter().take(MOST_NAMED).map(|t| object(t, None, words)).collect();
        said.extend(several(&tracks));
        if tracks.len() > MOST_NAMED {
            said.push(format!("{} of which it is surer.", count(tracks.len() - MOST_NAMED, "more object")));
        }
        said.extend(surely_none(&strange, words));
        return said;
    };
    tracks.sort_by(|a, b| b.probability_of(name).total_cmp(&a.probability_of(name)));
    let may_be: Vec<&&Track> = tracks.iter().filter(|t| t.probability_of(name) > HARDLY).collect();
    let mut said: Vec<String> =
        may_be.iter().take(MOST_NAMED).map(|t| object(t, Some(name), words)).collect();
    if may_be.iter().map(|t| t.probability_of(name)).sum::<f64>() > 1.0 + HARDLY {
        said.push(format!("each is judged by itself, since more than one may be as {name} is."));
    }
    let (rest, known) = (tracks.len() - may_be.len(), belief.tracks.len());
    said.push(match (known, rest) {
        (0, _) => "no object was seen.".into(),
        (_, 0) => format!("no other object was seen: {} in all.", count(known, "object")),
        (1, 1) => format!("the one object that was seen is surely not {name}."),
        (_, rest) if rest == known => format!("all {rest} objects that were seen are surely not {name}."),
        (_, 1) => format!("one other object is surely not {name}."),
        (_, rest) => format!("{rest} other objects are surely not {name}."),
    });
    said
}

/// Sentence about known objects that were recognised in several places; `None` if there are none.
fn several(tracks: &[&Track]) -> Option<String> {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    let taken = tracks.iter().flat_map(|track| track.probabilities.iter().filter(|(_, p)| *p > 0.5));
    taken.for_each(|(name, _)| *counts.entry(name).or_default() += 1);
    let all: Vec<String> =
        counts.iter().filter(|(_, n)| **n > 1).map(|(name, n)| format!("{n} are {name}")).collect();
    (!all.is_empty()).then(|| {
        format!(
            "{}: objects are told by what they look like, and each that looks so counts.",
            listed(&all, all.len())
        )
    })
}

/// Sentence with the number of objects that are certainly none of the known ones, by surface;
/// `None` without such objects.
fn surely_none(strange: &[&Track], words: &Wording<'_>) -> Option<String> {
    let mut on: BTreeMap<&str, usize> = BTreeMap::new();
    strange.iter().for_each(|track| *on.entry(&track.on).or_default() += 1);
    let one = |(on, many): (&&str, &usize)| match *on {
        "" => format!("{many} in the hand"),
        on => format!("{many} on the {}", words.saying.name_of(on)),
    };
    let all: Vec<String> = on.iter().map(one).collect();
    let are = if strange.len() == 1 { "is" } else { "are" };
    (!all.is_empty()).then(|| format!("{} {are} surely none of the known objects.", listed(&all, all.len())))
}

/// Sentence about an object: its probable identities (the requested one `asked` first), its place,
/// and the share seen of it.
fn object(track: &Track, asked: Option<&str>, words: &Wording<'_>) -> String {
    let mut names: Vec<(&str, f64)> = track.probabilities.iter().map(|(n, p)| (n.as_str(), *p)).collect();
    names.push(("none of the known objects", track.unknown));
    names.sort_by(|a, b| b.1.total_cmp(&a.1));
    let first = asked.map_or(names[0], |name| (name, track.probability_of(name)));
    let others: Vec<String> = names
        .iter()
        .filter(|(n, p)| *n != first.0 && *p > HARDLY)
        .take(2)
        .map(|(n, p)| format!("{n} {}", share(*p)))
        .collect();
    let others = if others.is_empty() { String::new() } else { format!(" ({})", others.join(", ")) };
    let on = match track.on.as_str() {
        "" => "is in the hand".into(),
        on => format!("stands on the {}", words.saying.name_of(on)),
    };
    // Of what no model fits it is not known how large its outside is.
    let seen = match track.seen_fraction > 0.0 {
        true => format!("; {:.0} % of its outside was seen", track.seen_fraction * 100.0),
        false => String::new(),
    };
    let at = place(track);
    format!("what {on} at {at} is {} with a probability of {}{others}{seen}.", first.0, share(first.1))
}

/// Sentences about the probability that is left and about why the run ended. `left_s`: time left
/// until the deadline, seconds; `None` without one.
fn left(rests: &Rests, report: &Report, left_s: Option<f64>, words: &Wording<'_>) -> Vec<String> {
    let mut said = Vec::new();
    if let Some(left) = report.remaining.filter(|_| report.verdict != Verdict::Achieved) {
        said.push(format!(
            "the probability that it is there after all, unseen or as one of the objects that were seen, is {}{}.",
            share(left),
            words.not_there.filter(|least| left >= *least || report.verdict == Verdict::NotFound).map(|least| format!(" (it is said not to be there below {})", share(least))).unwrap_or_default()
        ));
    }
    let is_told = |doubt: &&InDoubt| doubt.lost > HARDLY && report.verdict != Verdict::Achieved;
    let lost = rests.in_doubt.iter().filter(is_told);
    said.extend(lost.map(|doubt| {
        let (lost, about) = (share(doubt.lost), &doubt.about);
        format!("of that, {lost} is that {about} was lost out of the hand, and lies where no look shows it.")
    }));
    if report.remaining.is_none() && report.verdict != Verdict::Achieved {
        // Of many objects together it says little what hangs on each.
        let open = rests.in_doubt.iter().filter(|doubt| doubt.of == Of::Thing && doubt.left > HARDLY);
        said.extend(open.map(|d| format!("about {}, {} is still open in all.", d.about, share(d.left))));
    }
    let because = why_no_plan(rests, words);
    said.push(match (rests.ended, left_s) {
        (End::Reached, _) if report.verdict == Verdict::CannotTell => {
            let least = words.not_there.map(|least| format!(", which is said only below {}", share(least)));
            format!(
                "it ended because the goal held: it is sure enough that no more is to be found, but not that there is none{}.",
                least.unwrap_or_default()
            )
        }
        (End::Reached, _) => "it ended because the goal held.".into(),
        (End::NoPlan, Some(left_s)) if left_s > 0.0 => {
            format!(
                "it ended because no plan would still bring it about in the {left_s:.1} s that were left."
            )
        }
        (End::NoPlan, Some(_)) => "it ended because the time that was given was over.".into(),
        (End::NoPlan, _) if because.is_empty() => "it ended because no plan would still bring it about.".into(),
        (End::NoPlan, _) => format!("it ended because no plan would still bring it about: {because}."),
        _ => format!("it ended because {because}."),
    });
    let is_negative = matches!(report.verdict, Verdict::CannotTell | Verdict::NotFound);
    if let (End::NoPlan, Some(least)) = (rests.ended, words.negligible.filter(|_| is_negative)) {
        said.push(format!("what looks may settle counts from {} on: for less none is taken.", share(least)));
    }
    said
}

/// Clause about why there is no plan; refusals by attachments that no plan calls are left out if
/// there are others.
fn why_no_plan(rests: &Rests, words: &Wording<'_>) -> String {
    if rests.no_plan.is_empty() {
        return rests.said.clone();
    }
    let refused = |reason: &NoPlan| match reason {
        NoPlan::Refused { module, .. } => Some((words.is_used)(module)),
        _ => None,
    };
    let is_any_used = rests.no_plan.iter().any(|reason| refused(reason) == Some(true));
    let counts = |reason: &&NoPlan| !is_any_used || refused(reason) != Some(false);
    let counting: Vec<NoPlan> = rests.no_plan.iter().filter(counts).cloned().collect();
    no_plan::told(&counting, words.meanings)
}

/// Sentence about the share seen of each surface where the object may be.
fn seen(doubt: &InDoubt, stood: &[&Standing], looks: &Looks) -> String {
    let percent = |part: f64| (part * 100.0).floor();
    let was = |seen: &Seen| {
        let then = stood.iter().filter_map(|then| then.same(doubt)).flat_map(|then| &then.seen);
        let shares = then.filter(|then| then.on == seen.on).filter_map(|then| then.share);
        shares.filter(|was| percent(*was) > percent(seen.share.unwrap_or(1.0))).max_by(f64::total_cmp)
    };
    let one = |seen: &Seen| {
        let was = was(seen).map_or(String::new(), |was| {
            format!(" (once {:.0} %: what was touched there since, or turned out to lie otherwise, counts as not seen)", percent(was))
        });
        let from = match seen.places {
            0 => "of which no look holds any more".to_string(),
            places => format!("from {}", count(places, "place")),
        };
        match seen.share {
            None => format!("the {} {from}", seen.on),
            Some(part) => format!("{:.0} % of the {} {from}{was}", percent(part), seen.on),
        }
    };
    let is_seen = |seen: &&Seen| seen.places > 0 || looks.places(&seen.on) > 0;
    let (looked_at, others): (Vec<&Seen>, Vec<&Seen>) = doubt.seen.iter().partition(is_seen);
    let others: Vec<String> = others.iter().map(|seen| format!("the {}", seen.on)).collect();
    let not = match others.as_slice() {
        [] => String::new(),
        others => format!("; {} not looked at", {
            let were = if others.len() == 1 { "was" } else { "were" };
            format!("{} {were}", listed(others, others.len()))
        }),
    };
    let about = match doubt.of {
        Of::Thing => format!("of where {} may be", doubt.about),
        Of::Kind => format!("of where {} may be", english::one(&doubt.about)),
        Of::Surface => "in all".into(),
    };
    match looked_at.into_iter().map(one).collect::<Vec<_>>().as_slice() {
        [] => format!("nothing was seen {about}{not}."),
        all => format!("{about}, this was seen: {}{not}.", all.join(", ")),
    }
}
