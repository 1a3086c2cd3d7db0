//! Comparison of a plan with its alternatives: the gain of each, its total to the goal, or the
//! obstacle that keeps the rest of the plan from following.

use descry_agent::reason::Break;
use descry_agent::standing::{FirstLook, Seen};
use descry_agent::weigh::{MOST_STEPS, Way, Weighed};
use descry_domains::symbol::symbol;
use descry_skills::Call;

use super::Asked;
use super::chapters::Chapter;
use super::wording::{listed, share};

/// Relative difference up to which two gains or rates of gain count as equal.
const ALIKE: f64 = 0.02;
/// Difference up to which two durations count as equal, seconds.
pub const LONGER_S: f64 = 0.05;
/// Number of alternatives that a record holds in the order of their gain per second.
const MOST_KEPT: usize = descry_agent::weigh::MOST_KEPT;

/// Sentences that justify a plan against its alternatives with all figures, as far as the record
/// allows.
pub fn why(chapter: &Chapter, asked: &Asked<'_>) -> Vec<String> {
    let Some(weighed) = &chapter.weighed else {
        return vec!["what else could have been done, and at what cost, is not in the record.".into()];
    };
    let Some(chosen) = &weighed.chosen else {
        if chapter.is_late() {
            return vec![IN_TIME.into()];
        }
        if let Some(cut) = &chapter.cut() {
            return vec![cut_short(cut)];
        }
        let why = match chapter.steps.len() <= MOST_STEPS {
            true => "no step of it is there to learn more",
            false => "none of its first steps is there to learn more",
        };
        return vec![format!("it does what the goal asks next. Nothing was compared: {why}.")];
    };
    let longer = longer(weighed, chosen, asked);
    let through = weighed.through.as_ref().map(|way| {
        let against = against(way, chosen, asked).map(|against| format!("; {against}")).unwrap_or_default();
        format!("By another way, with a step more: {}{against}.", figures(way, asked))
    });
    let said = match (weighed.others.is_empty(), by_the_end(chapter, weighed, chosen, asked)) {
        (true, _) => vec![format!("{} was the only next step known.", steps(chosen, asked))],
        (false, Some(said)) => said,
        (false, None) => by_the_second(chapter, weighed, chosen, asked),
    };
    let left = left(chapter, weighed, chosen, asked);
    let first = first_looks(chapter).filter(|_| asked.counts_in_vain);
    let late = chapter.is_late().then(|| IN_TIME.to_string());
    late.into_iter().chain(said).chain(left).chain(longer).chain(through).chain(first).collect()
}

/// Sentence for a search that was ended (after `cut`) before it had a plan.
pub fn cut_short(cut: &str) -> String {
    format!(
        "the planner's search was ended after {cut}, without a plan that it expected to reach the goal: what settles most a \
         second of what is in doubt is done."
    )
}

/// Sentence for the case that no plan reaches the goal in time.
pub const IN_TIME: &str = "No plan would bring it about in the time that is left: the look that settles most a second, of those \
                           that end in time, is taken all the same.";

/// Sentence about the same steps, some merged, that would be quicker; `None` if there is no such
/// sequence.
pub fn longer(weighed: &Weighed, chosen: &Way, asked: &Asked<'_>) -> Option<String> {
    let way = weighed.shorter.as_ref()?;
    let (steps, takes_s, chosen_s) = (steps(way, asked), way.takes_s, chosen.takes_s);
    Some(format!(
        "{steps} would do the same in {takes_s:.1} s instead of {chosen_s:.1} s: the planner did not come upon that."
    ))
}

/// Justification of a plan by its total to the goal, with the totals of its alternatives; `None` if
/// its total is unknown.
fn by_the_end(chapter: &Chapter, weighed: &Weighed, chosen: &Way, asked: &Asked<'_>) -> Option<Vec<String>> {
    let whole_s = whole_s(chosen).filter(|_| asked.policy.is_none())?;
    let rule = match &chapter.cut() {
        Some(cut) => {
            format!("the planner's search was ended after {cut}: this is the best that it had by then")
        }
        None => "the planner takes the quickest whole plan that it finds".to_string(),
    };
    let first = format!(
        "{} is one of {} ways to get further. With the rest of the plan it takes {whole_s:.1} s, and {rule}.",
        figures(chosen, asked),
        weighed.open
    );
    let rivals = rivals(chapter, weighed, chosen).into_iter().map(|(way, roles)| {
        let against = against(way, chosen, asked).map(|against| format!("; {against}")).unwrap_or_default();
        format!("{} {}{against}.", figures(way, asked), listed(&roles, roles.len()))
    });
    Some(std::iter::once(first).chain(rivals).collect())
}

/// Notable alternatives, each with the reasons why it is notable as clauses.
pub fn rivals<'w>(chapter: &Chapter, weighed: &'w Weighed, chosen: &Way) -> Vec<(&'w Way, Vec<String>)> {
    let others = || weighed.others.iter();
    let likeliest = likeliest_besides(chapter, chosen);
    let rate = others().max_by(|a, b| a.rate().total_cmp(&b.rate()));
    let quickest = others().min_by(|a, b| a.takes_s.total_cmp(&b.takes_s));
    let most = others().max_by(|a, b| a.gains.total_cmp(&b.gains));
    let is_more = |o: &&Way, of: fn(&Way) -> f64| of(o) > of(chosen) * (1.0 + ALIKE);
    let rate_role = match rate.map(|o| o.rate() / chosen.rate()) {
        Some(ratio) if ratio > 1.0 + ALIKE => "gains most a second",
        Some(ratio) if ratio > 1.0 - ALIKE => "gains about as much a second",
        _ => "gains most a second of the others",
    };
    let cheapest = |of: &dyn Fn(Option<&str>) -> bool| {
        let alike = others().filter(|o| of(o.about()));
        let known = alike.clone().filter(|o| whole_s(o).is_some());
        let cheapest =
            known.min_by(|a, b| whole_s(a).unwrap_or(f64::MAX).total_cmp(&whole_s(b).unwrap_or(f64::MAX)));
        cheapest.or_else(|| alike.max_by(|a, b| a.gains.total_cmp(&b.gains)))
    };
    let roles = [
        (
            cheapest(&|about| about == chosen.about()),
            "is the best of the others that end with the same object",
        ),
        (cheapest(&|about| about != chosen.about()), "is the best of those that end with another object"),
        (
            likeliest.and_then(|on| cheapest(&|about| about == Some(&on))),
            "is the best of those where it most likely stands else",
        ),
        (rate, rate_role),
        (quickest.filter(|o| o.takes_s < chosen.takes_s - LONGER_S), "is the quickest"),
        (most.filter(|o| is_more(o, |way| way.gains)), "gains most in all"),
    ];
    let mut rivals: Vec<(&Way, Vec<String>)> = Vec::new();
    for (way, role) in roles.into_iter().filter_map(|(way, role)| Some((way?, role.to_string()))) {
        match rivals.iter_mut().find(|(other, _)| other.steps == way.steps) {
            Some((_, roles)) => roles.push(role),
            None => rivals.push((way, vec![role])),
        }
    }
    rivals
}

/// Symbol of the surface on which something most probably stands unseen, other than the one that
/// `chosen` is about; `None` if there is none.
fn likeliest_besides(chapter: &Chapter, chosen: &Way) -> Option<String> {
    let doubts = chapter.before.iter().flat_map(|standing| &standing.doubts);
    let seen = doubts.flat_map(|doubt| &doubt.seen).filter(|seen| seen.hidden > 0.0);
    let besides =
        seen.map(|seen| (symbol(&seen.on), seen.hidden)).filter(|(on, _)| chosen.about() != Some(on));
    besides.max_by(|a, b| a.1.total_cmp(&b.1)).map(|(on, _)| on)
}

/// Sentence about the remaining previous plan, if the new plan was made only because a duration had
/// changed; `None` otherwise.
pub fn left(chapter: &Chapter, weighed: &Weighed, chosen: &Way, asked: &Asked<'_>) -> Option<String> {
    let left = weighed.left.as_ref().filter(|_| chapter.is_reckoned())?;
    let what = format!("what was left of plan {}", chapter.round - 1);
    let Some(whole_s) = whole_s(left) else {
        let why = left.blocked.as_ref().map(|blocked| would_be(blocked, asked));
        return Some(format!(
            "{what} would not do{}.",
            why.map(|why| format!(": {why}")).unwrap_or_default()
        ));
    };
    let chosen_s = self::whole_s(chosen).filter(|_| asked.policy.is_none())?;
    Some(format!("{what} would do, and takes {whole_s:.1} s{}.", more_than(whole_s, chosen_s)))
}

/// Clause about the obstacle to steps that were not executed.
pub fn would_be(blocked: &Break, asked: &Asked<'_>) -> String {
    let said = blocked.would_be(asked.saying);
    let counted = blocked.reckoned().and_then(|(call, ..)| (asked.counts)(&call.action));
    match counted {
        Some(counted) => format!("{said}; counted are the {counted}"),
        None => said,
    }
}

/// Clause about the difference of a total from that of the chosen plan, seconds rounded to tenths.
fn more_than(whole_s: f64, chosen_s: f64) -> String {
    let tenths = |s: f64| (s * 10.0).round() / 10.0;
    let more_s = tenths(whole_s) - tenths(chosen_s);
    match more_s.abs() {
        off_s if off_s <= LONGER_S => ", which is as long".into(),
        off_s if more_s > 0.0 => format!(", {off_s:.1} s more"),
        off_s => format!(", {off_s:.1} s less: the planner did not come upon that"),
    }
}

/// Sentence with the probability that a first observation of each surface finds something, if the
/// metric counts observations in vain; `None` otherwise.
fn first_looks(chapter: &Chapter) -> Option<String> {
    let doubts = chapter.before.iter().flat_map(|standing| &standing.doubts);
    let looks = doubts.flat_map(|doubt| &doubt.seen).filter_map(|seen| Some((seen, seen.first?)));
    let mut all: Vec<(&Seen, FirstLook)> = Vec::new();
    for (on, look) in looks {
        if all.iter().all(|(known, _)| known.on != on.on) {
            all.push((on, look));
        }
    }
    all.sort_by(|a, b| b.1.finds.total_cmp(&a.1.finds));
    let one = |(seen, look): &(&Seen, FirstLook)| {
        let unseen = match seen.hidden > 0.0 {
            true => format!("it stands there unseen with {}; ", share(seen.hidden)),
            false => String::new(),
        };
        let finds = share(look.finds);
        format!("{finds} for the {} ({unseen}going there and looking takes {:.1} s)", seen.on, look.takes_s)
    };
    let said: Vec<String> = all.iter().map(one).collect();
    (!said.is_empty()).then(|| format!("p is {}.", listed(&said, said.len())))
}

/// Justification of a plan by its gain per second, if totals to the goal are unknown.
fn by_the_second(chapter: &Chapter, weighed: &Weighed, chosen: &Way, asked: &Asked<'_>) -> Vec<String> {
    let mut named = Named::default();
    let mut said = vec![compared(chapter, weighed, chosen, asked, &mut named)];
    said.extend(quickest(chapter, weighed, chosen, asked, &mut named));
    let most = weighed.others.iter().max_by(|a, b| a.gains.total_cmp(&b.gains));
    if let Some(other) = most.filter(|o| o.gains > chosen.gains * (1.0 + ALIKE)) {
        let more_s = other.takes_s - chosen.takes_s;
        let more = match (more_s > 0.0, &chapter.cut(), &asked.policy) {
            (true, ..) => format!(", but is reckoned at {more_s:.1} s more"),
            (false, Some(cut), None) => format!(
                ", and takes no longer: the planner's search was ended after {cut}, before it came upon that"
            ),
            (false, ..) => ", and takes no longer: what follows counts as well".to_string(),
        };
        said.push(format!("{} gains most{more}.", named.once(other, asked)));
    }
    said
}

/// Clause that compares an alternative, with the rest of the plan after it, to the chosen plan;
/// `None` if the total of the chosen plan is unknown.
fn against(other: &Way, chosen: &Way, asked: &Asked<'_>) -> Option<String> {
    let chosen_s = whole_s(chosen).filter(|_| asked.policy.is_none())?;
    let Some(whole) = other.whole else {
        let is_goal = other.blocked.as_ref().is_some_and(|blocked| blocked.missed_goal().is_some());
        let but = match (is_goal, chosen.steps.len() == chosen.whole?.steps) {
            (true, true) => "it would not be enough",
            (true, false) => "with the rest of the plan, it would not be enough",
            (false, _) => "the rest of the plan could not follow it",
        };
        let why = other.blocked.as_ref().map(|blocked| format!(": {}", would_be(blocked, asked)));
        return Some(format!("{but}{}", why.unwrap_or_default()));
    };
    if !whole.reaches {
        return Some("with the rest of the plan, it would not be enough".into());
    }
    let alone =
        if whole.steps == other.steps.len() { "alone it would be enough, in" } else { "to its end it takes" };
    Some(format!("{alone} {:.1} s{}", whole.takes_s, more_than(whole.takes_s, chosen_s)))
}

/// Metric value of steps with the rest of the plan after them, seconds; `None` if they are not
/// expected to reach the goal.
pub fn whole_s(way: &Way) -> Option<f64> {
    way.whole.filter(|whole| whole.reaches).map(|whole| whole.takes_s)
}

/// Alternatives whose figures were given already.
#[derive(Default)]
struct Named(Vec<Vec<Call>>);

impl Named {
    /// Alternative as text, with its figures at the first mention only.
    fn once(&mut self, way: &Way, asked: &Asked<'_>) -> String {
        if self.0.contains(&way.steps) {
            return asked.say_all(&way.steps, ", ");
        }
        self.0.push(way.steps.clone());
        figures(way, asked)
    }
}

/// Alternative as text with its figures: gain, duration and gain per second.
fn figures(way: &Way, asked: &Asked<'_>) -> String {
    let gains = if way.gains < 0.01 { share(way.gains) } else { format!("{:.2}", way.gains) };
    format!("{} [+{gains} in {:.1} s, {} a second]", steps(way, asked), way.takes_s, rate(way.rate()))
}

/// Steps of an alternative as text; if there are several, each with its duration, as far as
/// recorded.
fn steps(way: &Way, asked: &Asked<'_>) -> String {
    if way.each_s.len() != way.steps.len() || way.steps.len() < 2 {
        return asked.say_all(&way.steps, ", ");
    }
    let each = way.steps.iter().zip(&way.each_s);
    each.map(|(step, takes_s)| format!("{} ({takes_s:.1} s)", asked.say(step))).collect::<Vec<_>>().join(", ")
}

/// Rate as text, with three significant digits.
fn rate(rate: f64) -> String {
    let digits = if rate > 0.0 { (2.0 - rate.log10().floor()).clamp(1.0, 8.0) as usize } else { 1 };
    format!("{rate:.digits$}")
}

/// Sentences about the rank of the chosen steps among all alternatives by gain per second.
fn compared(
    chapter: &Chapter,
    weighed: &Weighed,
    chosen: &Way,
    asked: &Asked<'_>,
    named: &mut Named,
) -> String {
    let all = weighed.open;
    let ratio = |o: &Way| o.rate() / chosen.rate();
    let better: Vec<&Way> = weighed.others.iter().filter(|o| ratio(o) > 1.0 + ALIKE).collect();
    let mine = named.once(chosen, asked);
    if better.is_empty() {
        let alike = weighed.others.iter().find(|o| ratio(o) >= 1.0 - ALIKE);
        let next = weighed.others.iter().find(|o| ratio(o) < 1.0 - ALIKE);
        let gains = match alike.filter(|o| ratio(o) > 1.0) {
            Some(_) => "is among those that gain most a second",
            None => "gains most a second",
        };
        let alike = alike.map(|o| format!(" About as good is {}.", named.once(o, asked))).unwrap_or_default();
        let next = next.map(|o| format!(" Next comes {}.", named.once(o, asked))).unwrap_or_default();
        return format!("of {all} ways to get further, {mine} {gains}.{alike}{next}");
    }
    let more = if better.len() >= MOST_KEPT { "at least " } else { "" };
    let many = match better.len() {
        1 => "1 gains more a second:".into(),
        n => format!("{more}{n} gain more a second, most of all"),
    };
    let first = named.once(better[0], asked);
    let plan_s = whole_s(chosen).unwrap_or(chapter.makespan_s);
    let rule = match (&asked.policy, &chapter.cut()) {
        (Some(policy), _) => format!("The policy {policy} goes by its own rule."),
        (None, Some(cut)) => {
            format!("The planner's search was ended after {cut}: this is the best that it had by then.")
        }
        (None, None) if chapter.is_late() => {
            "It goes by all that is in doubt, not by these numbers alone.".into()
        }
        (None, None) => {
            let alone = match enough(chapter, weighed, better[0], asked) {
                Some(false) if chosen.reaches == Some(true) || better[0].takes_s < plan_s => {
                    " By what is hoped of it, that one would not be enough by itself."
                }
                Some(true) if better[0].takes_s < plan_s => {
                    " By what is hoped of it, that one would be enough, and sooner: the planner did not come upon it."
                }
                _ => "",
            };
            let whole = match plan_s {
                // Nothing in the domain takes time.
                s if s <= 0.0 => "a whole plan".to_string(),
                s => format!("the quickest whole plan that it finds, here {s:.1} s"),
            };
            format!(
                "The planner counts to the end: it takes {whole}, not what gains most a second at first.{alone}"
            )
        }
    };
    format!("{mine} is one of {all} ways to get further; {many} {first}. {rule}")
}

/// True if an alternative alone is expected to reach the goal; `None` if unknown.
fn enough(chapter: &Chapter, weighed: &Weighed, way: &Way, asked: &Asked<'_>) -> Option<bool> {
    // That a part is not the whole says nothing of it: it is held against plans that end with such a step.
    let last = |steps: &[Call]| steps.last().map(|step| step.action.clone());
    let is_alike = || last(&way.steps) == last(&chapter.calls);
    match way.reaches {
        Some(true) => return Some(true),
        Some(false) if is_alike() => return Some(false),
        _ => {}
    }
    let [only] = weighed.numbers.as_slice() else { return None };
    let wanted = asked.wanted(&only.name)?;
    Some(if only.then >= only.now { only.now + way.gains >= wanted } else { only.now - way.gains <= wanted })
}

/// Sentence about the quickest alternative and what speaks against it; `None` if the chosen steps
/// are as quick or it was explained before.
fn quickest(
    chapter: &Chapter,
    weighed: &Weighed,
    chosen: &Way,
    asked: &Asked<'_>,
    named: &mut Named,
) -> Option<String> {
    let other = weighed.others.iter().min_by(|a, b| a.takes_s.total_cmp(&b.takes_s))?;
    let is_whole_search = chapter.cut().is_none();
    // Where what is done is not enough either, that says nothing against another.
    let would_do = enough(chapter, weighed, other, asked).filter(|enough| *enough || is_whole_search);
    // Of what was named as better and enough it has been said.
    let is_said =
        would_do == Some(true) && asked.policy.is_none() && is_whole_search && named.0.contains(&other.steps);
    if other.takes_s > chosen.takes_s - 0.1 || is_said {
        return None;
    }
    let but = match would_do {
        Some(true) if asked.policy.is_none() && is_whole_search => {
            ", and by what is hoped of it would be enough: the planner did not come upon it"
        }
        Some(false) => ", but by what is hoped of it would not be enough by itself",
        _ if other.gains < chosen.gains => ", but gains less",
        _ => ", and gains no less: the rest of the plan counts as well",
    };
    Some(format!("{} is the quickest{but}.", named.once(other, asked)))
}
