//! Summary of a run in a few sentences: the goal, the answer, the evidence for it, and the worst
//! trouble.

use descry_agent::report::{self, Report};
use descry_agent::run::Header;
use descry_agent::standing::{InDoubt, Of};
use descry_domains::conclusion::{Believed, Verdict};
use descry_domains::english::{percent, plural};
use descry_domains::note::Note;
use descry_domains::saying::Saying;

use super::chapters::{Chapter, Deed};
use super::looks;
use super::standings::Standing;
use super::wording::{count, listed, place};

/// Maximum number of failed steps listed by name; the rest are counted.
const MOST_FAILURES: usize = 4;

/// Sentences of the summary. `left_s`: time left until the deadline, seconds; `None` without a
/// deadline.
pub fn of(
    header: &Header,
    report: Option<&Report>,
    chapters: &[Chapter],
    left_s: Option<f64>,
    saying: &Saying,
) -> Vec<String> {
    let last = chapters.iter().flat_map(Chapter::stood).last();
    let rests = report.and_then(|report| last.and_then(|last| rests(report, last, saying)));
    let mut said = vec![asked(header), answer(report, chapters.len())];
    said.extend(rests);
    let is_absent = report.is_some_and(|report| report.verdict == Verdict::NotFound);
    let is_open = report.is_some_and(|report| report.verdict == Verdict::CannotTell);
    said.extend(trouble(chapters, left_s.filter(|_| is_open), is_absent, saying));
    said
}

fn asked(header: &Header) -> String {
    let settings = &header.settings;
    let scene = settings.scene.as_ref().map(|s| format!(", scene {s}")).unwrap_or_default();
    let seed = if settings.robot == "sim" { format!(", seed {}", settings.seed) } else { String::new() };
    let (goal, robot, domain) = (&header.goal, &settings.robot, &settings.domain);
    format!("\"{goal}\" was asked of the body {robot}{scene}{seed}, in the domain {domain}.")
}

fn answer(report: Option<&Report>, plans: usize) -> String {
    let Some(report) = report else {
        return format!("It has not ended: the record goes as far as plan {plans}.");
    };
    let verdict = report::words(report.verdict);
    let verdict = match &report.answer {
        Some(answer) if answer != verdict => format!("{answer} ({verdict})"),
        _ => verdict.to_string(),
    };
    format!(
        "The answer after {}, {}, {:.1} m and {:.0} s: {verdict}: {}.",
        count(plans, "plan"),
        count(report.views, "look"),
        report.distance_m,
        report.sim_time_s,
        report.why
    )
}

/// Sentence about the evidence for the answer, for the first of the requested things; `None` if it
/// is not in the record.
fn rests(report: &Report, last: &Standing, saying: &Saying) -> Option<String> {
    let doubt = last.doubts.first()?;
    let seen = seen(doubt);
    let objects = match last.asked_about(doubt).count() {
        0 => "no object was seen".to_string(),
        1 => "one object was seen".into(),
        n => format!("{n} objects were seen"),
    };
    let objects = format!("{objects}{}", doubt.within);
    let by = match (doubt.of, looks::best_seen(doubt, last)) {
        (Of::Thing, Some((track, p))) if p >= doubt.wanted => {
            // It may have been taken since that look: what stands nowhere is in the hand.
            let is_it = |o: &&Believed| [&o.label, &o.kind].contains(&&Some(doubt.about.clone()));
            let is_held = report.objects.iter().filter(is_it).any(|o| o.asked && o.position_m.is_none());
            let on = match track.on.as_str() {
                on if on.is_empty() || is_held => "is in the hand".into(),
                on => format!("stands on the {} at {}", saying.name_of(on), place(track)),
            };
            format!(
                "what {on} is {} with a probability of {}; {:.0} % of its outside was seen",
                doubt.about,
                percent(p),
                track.seen_fraction * 100.0
            )
        }
        (Of::Thing, _) => {
            looks::may_be(doubt, last, saying).unwrap_or_else(|| looks::none_may_be(doubt, last))
        }
        (Of::Kind, _) => format!(
            "{objects}; it is {} sure which of them are {} and that there are no more",
            percent(doubt.sure?),
            plural(&doubt.about)
        ),
        (Of::Surface, _) => {
            format!(
                "{objects}; it is {} sure of what kind each of them is and that there are no more",
                percent(doubt.sure?)
            )
        }
    };
    let left = match report.remaining.filter(|_| report.verdict != Verdict::Achieved) {
        Some(left) => format!("; the probability that it is there after all is {}", percent(left)),
        None => String::new(),
    };
    let seen = if seen.is_empty() {
        "nothing was seen of where it may be".into()
    } else {
        format!("{seen} was seen")
    };
    Some(format!("It rests on this: {by}; {seen}{left}."))
}

/// Share seen of each surface, as text; empty if nothing was seen.
fn seen(doubt: &InDoubt) -> String {
    let looked_at = doubt.seen.iter().filter(|seen| seen.places > 0);
    let one = |seen: &descry_agent::standing::Seen| {
        Some(format!("{:.0} % of the {}", (seen.share? * 100.0).floor(), seen.on))
    };
    let all: Vec<String> = looked_at.filter_map(one).collect();
    let open = doubt.seen.iter().filter(|seen| seen.places == 0).count();
    let open = if open > 0 && !all.is_empty() {
        format!(", and nothing of {}", count(open, "other surface"))
    } else {
        String::new()
    };
    listed(&all, all.len()) + &open
}

/// Sentence about what went wrong, worst first. `short_s`: time left, seconds, if it was too short;
/// `is_absent`: the object was found to be absent, so observations in vain are no trouble. `None`
/// if there is nothing to tell.
fn trouble(chapters: &[Chapter], short_s: Option<f64>, is_absent: bool, saying: &Saying) -> Option<String> {
    let deeds = || chapters.iter().flat_map(|chapter| &chapter.deeds);
    let notes = || deeds().filter_map(|deed| if let Deed::Noted(note) = deed { Some(note) } else { None });
    let failures = chapters.iter().flat_map(|chapter| chapter.failures(saying));
    let moved: Vec<&String> = notes()
        .filter_map(|n| if let Note::Changed { because } = n { Some(because) } else { None })
        .collect();
    let left_out = notes()
        .filter_map(|n| if let Note::Perceived { left_out, .. } = n { Some(left_out.len()) } else { None });
    let bare = notes().filter(|note| matches!(note, Note::Nothing { .. })).count();
    let cuts = deeds().filter(|deed| matches!(deed, Deed::Resumed)).count();
    let first =
        |n: usize, first: &str| if n > 1 { format!("; the first: {first}") } else { format!(": {first}") };
    let failed: Vec<String> =
        failures.map(|(call, because)| format!("{}, {because}", saying.say(&call.to_string()))).collect();
    let mut all: Vec<String> = Vec::new();
    all.extend(short_s.map(|left_s| {
        match left_s > 0.0 {
            true => format!("the time that was given did not do: {left_s:.1} s of it were left, too few for any way to get further"),
            false => "the time that was given was over".into(),
        }
    }));
    all.extend(
        moved.first().map(|because| format!("things were moved meanwhile{}", first(moved.len(), because))),
    );
    all.extend((!failed.is_empty()).then(|| {
        let steps = count(failed.len(), "step");
        format!("{steps} failed: {}", listed_apart(&failed, MOST_FAILURES))
    }));
    all.extend(
        left_out
            .max()
            .filter(|n| *n > 0)
            .map(|n| format!("{} of a surface did not fit the others", count(n, "view"))),
    );
    all.extend((bare > 0).then(|| format!("{} showed no surface", count(bare, "look"))));
    all.extend((cuts > 0).then(|| {
        format!("the run was cut off {}", if cuts == 1 { "once".into() } else { format!("{cuts} times") })
    }));
    // Where a thing is not there, that looks brought less than was hoped is the answer and no trouble.
    let vain = in_vain(chapters).filter(|_| !is_absent);
    Some(match (all.split_first(), vain) {
        (None, None) if is_absent => return None,
        (None, None) if chapters.len() == 1 => "Everything went as it was planned.".into(),
        (None, None) => "Nothing failed.".into(),
        (None, Some(vain)) => format!("The greatest trouble: {vain}."),
        (Some((first, more)), vain) => {
            let more: Vec<String> = more.iter().cloned().chain(vain).collect();
            let more =
                if more.is_empty() { String::new() } else { format!(" Besides, {}.", more.join("; ")) };
            format!("The greatest trouble: {first}.{more}")
        }
    })
}

/// Joins texts that contain commas with semicolons: the first `most`; the rest are counted.
fn listed_apart(all: &[String], most: usize) -> String {
    let more = all.len().saturating_sub(most);
    let more = if more > 0 { format!("; and {more} more") } else { String::new() };
    all[..all.len() - all.len().saturating_sub(most)].join("; ") + &more
}

/// Clause about plans that were completed and left a doubt, and about the most misleading object;
/// `None` without such plans.
fn in_vain(chapters: &[Chapter]) -> Option<String> {
    let is_short = |chapter: &&Chapter| {
        let hoped = chapter.weighed.as_ref().is_some_and(|weighed| !weighed.numbers.is_empty());
        let is_open = |doubt: &InDoubt| doubt.sure.is_some_and(|sure| sure < doubt.wanted);
        let is_done = chapter.steps_done().1.is_empty();
        hoped && is_done && chapter.stood().last().is_some_and(|now| now.doubts.iter().any(is_open))
    };
    let short = chapters.iter().filter(is_short).count();
    let misled = chapters.iter().flat_map(misled).max_by(|a, b| a.0.total_cmp(&b.0));
    let misled = misled.map(|(_, what)| format!("; {what}")).unwrap_or_default();
    let (plans, their) = match chapters.len() {
        1 => ("the plan".into(), "its"),
        all => (format!("{short} of {all} plans"), if short == 1 { "its" } else { "their" }),
    };
    (short > 0)
        .then(|| format!("{plans} came to {their} end without the certainty that was hoped for{misled}"))
}

/// Objects that were candidates for the requested one during a plan and were then ruled out:
/// earlier probability, and a clause about what each is.
fn misled(chapter: &Chapter) -> Vec<(f64, String)> {
    let all: Vec<&Standing> = chapter.before.iter().chain(chapter.stood()).collect();
    let lost = |pair: &[&Standing]| {
        let doubts = pair[1].doubts.iter().filter(|doubt| doubt.of == Of::Thing);
        doubts.filter_map(|doubt| looks::lost(&doubt.about, pair[0], pair[1])).collect::<Vec<_>>()
    };
    all.windows(2).flat_map(lost).collect()
}
