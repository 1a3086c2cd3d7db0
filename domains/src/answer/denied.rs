//! That something is not so is answered only where it is known: what nobody has looked for is not believed, and may be so.

use descry_memory::belief::Track;

use super::{Asker, Verdict};
use crate::abilities::searching::reasons;
use crate::asked::Denied;
use crate::lexicon::plural;
use crate::situation::{Situation, Thing};

/// Whether something that must not be so may be so, for all that was seen.
pub(crate) fn is_open(s: &Situation, denied: &[Denied]) -> bool {
    denied.iter().any(|one| open(s, denied, one).is_some())
}

/// Where something may be so that must not be: the thing or kind, and the surface.
enum Open {
    Thing { what: usize, on: usize },
    Kind(usize),
    Surface(usize),
}

fn open(s: &Situation, all: &[Denied], one: &Denied) -> Option<Open> {
    let is_clear = |denied: &Denied| !denied.surfaces.is_empty() && unclear(s, denied).is_none();
    // What must not be two things at once is not, where one of them is known of all there are.
    let shares = |other: &&Denied| other.variables.iter().any(|v| one.variables.contains(v));
    if is_clear(one) || all.iter().filter(shares).any(is_clear) {
        return None;
    }
    let surfaces = || (0..s.surfaces.len()).filter(|&on| is_about(s, one, on));
    let things = || (0..s.things.len()).filter(|&n| one.things.contains(&s.things[n].symbol));
    let may_be = |&(what, on): &(usize, usize)| chance_on(s, what, on) > s.thresholds.not_there;
    let pairs = things().flat_map(|what| surfaces().map(move |on| (what, on)));
    if let Some((what, on)) = pairs.into_iter().find(may_be) {
        return Some(Open::Thing { what, on });
    }
    let kinds = (0..s.kinds.len()).filter(|&n| one.kinds.contains(&s.kinds[n].symbol));
    let is_known = |&of: &usize| s.completeness(of) >= s.wanted_of(of);
    if let Some(of) = kinds.into_iter().find(|of| !is_known(of)) {
        return Some(Open::Kind(of));
    }
    let is_of_all = one.things.is_empty() && one.kinds.is_empty();
    // What is said of kinds elsewhere says which objects these are.
    let is_settled = all.iter().filter(shares).any(|other| !other.kinds.is_empty());
    unclear(s, one).filter(|_| is_of_all && !is_settled).map(Open::Surface)
}

/// Whether it is denied of a surface.
fn is_about(s: &Situation, denied: &Denied, on: usize) -> bool {
    let surface = &s.surfaces[on];
    let is_named = denied.surfaces.contains(&surface.symbol) || surface.is_in(&denied.surfaces);
    denied.surfaces.is_empty() || is_named
}

/// A surface of those that it is denied of on which it is not sure what stands.
fn unclear(s: &Situation, denied: &Denied) -> Option<usize> {
    (0..s.surfaces.len()).find(|&on| is_about(s, denied, on) && s.clarity(on) < s.threshold)
}

/// The probability that a thing is on a surface: as one of the objects that were seen, or hidden.
fn chance_on(s: &Situation, what: usize, on: usize) -> f64 {
    let name = &s.things[what].name;
    let none_is = s.on_surface(on).map(|t| 1.0 - t.probability_of(name)).product::<f64>();
    (1.0 - none_is + s.doubt_about_on(what, on).hidden).min(1.0)
}

impl Asker<'_> {
    /// Why it cannot be told that what must not be so is not; none if that is known.
    pub(super) fn undenied(&self) -> Option<String> {
        let (s, all) = (self.s, &self.goal.asked.denied);
        let open = all.iter().find_map(|one| open(s, all, one))?;
        let on_there = |on: usize| Thing { on: Some(vec![on]), ..Thing::default() };
        let why = |on: usize| {
            let there = on_there(on);
            let looks = self.mind.regions[on].taken;
            let unseen = (looks == 0).then(|| format!("the {} was not looked at", s.surfaces[on].name));
            unseen.or_else(|| self.nothing_seen(&there)).or_else(|| reasons::may_be_none(s, &there))
        };
        Some(match open {
            Open::Thing { what, on } => {
                let (thing, surface) = (&s.things[what].name, &s.surfaces[on].name);
                let chance = chance_on(s, what, on);
                let why = why(on).unwrap_or_else(|| format!("a chance of {chance:.2} is left that it is"));
                format!("it cannot be told that {thing} is not on the {surface}: {why}")
            }
            Open::Kind(of) => {
                let kind = &s.kinds[of];
                let (name, place) = (plural(&kind.name), reasons::in_room(s, kind));
                format!("it cannot be told, for not all {name}{place} are known")
            }
            Open::Surface(on) => {
                let surface = &s.surfaces[on].name;
                let why = why(on).unwrap_or_else(|| "not all on it is identified".into());
                format!("it cannot be told what stands on the {surface}: {why}")
            }
        })
    }

    /// That a question about things has the answer no: it is known where they stand, and it is not so, unless another of the same stands elsewhere;
    /// none if it is another question.
    pub(super) fn no_of_things(&self) -> Option<(Verdict, String)> {
        let (s, said) = (self.s, self.surely().join("; "));
        let is_of_things = self.goal.question && !self.goal.asked.more && self.own().next().is_some();
        if !is_of_things {
            return None;
        }
        let may_be = |&(what, on): &(usize, usize)| {
            let is_known = s.presence(what, on) >= s.threshold;
            !is_known && chance_on(s, what, on) > s.thresholds.not_there
        };
        let mut places = self.own().flat_map(|(what, _)| (0..s.surfaces.len()).map(move |on| (what, on)));
        Some(match places.find(may_be) {
            Some((what, on)) => {
                let (thing, surface) = (&s.things[what].name, &s.surfaces[on].name);
                let chance = chance_on(s, what, on);
                let left =
                    format!("a chance of {chance:.2} is left that there is another {thing} on the {surface}");
                (Verdict::CannotTell, format!("{said}; it cannot be told more, {left}; {}", self.looks()))
            }
            None => (
                Verdict::NotFound,
                format!("{said}; so it does not hold that {}", self.saying.say(&self.goal.pddl)),
            ),
        })
    }

    /// What surely is so and must not be: where such a thing, or one of such a kind, stands.
    pub(super) fn contradicted(&self) -> Option<String> {
        let (s, all) = (self.s, &self.goal.asked.denied);
        let find = |name: &str, places: &Denied| {
            let is_there = |t: &&Track| s.surface_of(t).is_some_and(|on| is_about(s, places, on));
            let mut there = s.belief.tracks.iter().filter(is_there);
            let track = there.find(|t| t.probability_of(name) >= s.threshold)?;
            Some(format!("{name} {}", self.standing(track)))
        };
        let things = |denied: &Denied| {
            let mut own = s.things.iter().filter(|t| denied.things.contains(&t.symbol));
            own.find_map(|thing| find(&thing.name, denied))
        };
        // Where one of the kind must not be is said of the same variable.
        let kinds = |denied: &Denied| {
            let shares = |other: &&Denied| other.variables.iter().any(|v| denied.variables.contains(v));
            let places = all.iter().filter(shares).find(|other| !other.surfaces.is_empty())?;
            let mut kinds = s.kinds.iter().filter(|k| denied.kinds.contains(&k.symbol));
            kinds.find_map(|kind| find(&kind.name, places))
        };
        all.iter().find_map(|denied| things(denied).or_else(|| kinds(denied)))
    }
}
