//! Final answers about the goal, with the place of the found object and the evidence.

mod judged;
mod own;

use std::collections::BTreeMap;

use descry_memory::belief::Track;
use descry_perception::nalgebra::Vector3;
use descry_perception::recognise::ObjectModel;
use descry_planner::{Attachments, Task};
use descry_robots::Part;

pub use self::own::changes;
use crate::belief::adrift;
use crate::belief::doubt::Doubt;
use crate::conclusion::{Believed, Conclusion, Ended, Verdict};
use crate::contradiction::Contradiction;
use crate::english::{one, percent, plural, the};
use crate::judge::Truth;
use crate::known::{Thing, is_alike};
use crate::lexicon::Lexicon;
use crate::load::Domain;
use crate::mind::{Mind, Region};
use crate::objective::Goal;
use crate::round::Round;
use crate::saying::Saying;
use crate::situation::Situation;
use crate::{abilities, culprit, no_plan, reasons};

/// Draws the final conclusion of a run that has ended.
pub(crate) fn conclude(asker: &Asker<'_>, ended: &Ended) -> Conclusion {
    let (s, config) = (asker.s, &asker.domain.config);
    let (verdict, why) = match ended {
        Ended::Reached => asker.reached(),
        // On a map that the body has made itself ways may be missing.
        Ended::NoPlan(why) => {
            let why = no_plan::told(why, &|call| abilities::meaning(config, call));
            asker.gave_up(&why, !s.own_map.has_ways())
        }
        Ended::Undecided(why) => asker.gave_up(why, false),
        Ended::Limit(why) => (Verdict::CannotTell, format!("it cannot be told: {why}")),
        Ended::Failed(why) => (Verdict::Failed, why.clone()),
    };
    // A reason that nobody would guess is said with the phrase's own words, too.
    let reason = || asker.no_drive().filter(|_| verdict == Verdict::CannotTell);
    let with_reason = |own: String| reason().map_or(own.clone(), |reason| format!("{own}: {reason}"));
    let why = asker.worded(verdict).map_or(why, with_reason);
    let own = s.things.iter().filter(|t| t.track.is_none()).count();
    let judged = asker.judgement();
    let confidence = match (own, s.kinds.is_empty(), s.asked.first()) {
        _ if asker.goal.question && judged.value != Truth::Unknown => judged.sure,
        (1.., _, _) => (0..own).map(|n| s.confidence(n)).fold(1.0, f64::min),
        (_, false, _) => (0..s.kinds.len()).map(|n| s.completeness(n)).fold(1.0, f64::min),
        (_, _, Some(_)) => s.asked.iter().map(|&on| s.clarity(on)).fold(1.0, f64::min),
        _ => f64::from(u8::from(verdict == Verdict::Achieved)),
    };
    let first = s.things.first().filter(|_| own == 1);
    let may_be = |thing: &Thing, t: &Track| thing.probability(t, &s.surfaces) > 1.0 - s.thresholds.confidence;
    let mut objects: Vec<Believed> = s.belief.tracks.iter().map(|t| asker.believed(t)).collect();
    objects.sort_by_key(|o| !o.asked);
    Conclusion {
        verdict,
        why,
        confidence,
        remaining: first.map(|_| s.chance_there(0)),
        object: first.map(|t| t.name.clone()),
        found: first.and_then(|t| asker.best(t).filter(|track| may_be(t, track))).map(|t| asker.believed(t)),
        objects,
        remembered: None,
    }
}

/// Placeholder in answers: `{changes <surface>}` gives the changes on a surface since an earlier
/// run, `{changes}` those on all surfaces.
pub(crate) const CHANGES: &str = "changes";

/// Data from which an answer is made.
pub(crate) struct Asker<'a> {
    pub domain: &'a Domain,
    pub goal: &'a Goal,
    pub lexicon: &'a Lexicon,
    pub mind: &'a Mind,
    pub round: &'a Round,
    /// Part of a body that the domain needs and the body lacks, if any.
    pub lacks: Option<Part>,
    pub s: &'a Situation,
    /// Wording of PDDL conditions in the domain's language.
    pub saying: &'a Saying,
    /// Problem over all seen objects, if the phrase's own answer lists objects; `None` if it lists
    /// nothing.
    pub listed: Option<&'a Listed>,
}

/// Problem over all seen objects, requested or not, for answers that list objects.
pub(crate) struct Listed {
    /// Problem of the round with an object for every thing and every kind of the domain.
    pub task: Task,
    /// Attachments that answer the task's calls.
    pub attachments: Attachments,
    /// Number in the belief and name of each thing, by symbol.
    pub things: BTreeMap<String, (u64, String)>,
}

impl Asker<'_> {
    /// Verdict and sentence for a goal that the planner takes to hold: the requested object and its
    /// place.
    fn reached(&self) -> (Verdict, String) {
        let s = self.s;
        if let Some(unknown) = self.nowhere() {
            return (Verdict::CannotTell, unknown);
        }
        let judged = self.judgement();
        let word = judged.word();
        match judged.value {
            Truth::True => {}
            Truth::Unknown => return (Verdict::CannotTell, self.open(word)),
            Truth::False if self.goal.question => return (Verdict::NotFound, self.denial(word)),
            Truth::False => {
                return (Verdict::Impossible, self.impossible(&format!(": {}", self.denial(word))));
            }
        }
        let mut said = self.surely();
        // What was expected before anything was seen tells of no object.
        let is_of_objects = !(said.is_empty() && s.kinds.is_empty() && s.asked.is_empty());
        if self.mind.views == 0 && is_of_objects && !self.goal.asked.more {
            return (Verdict::CannotTell, "it cannot be told: no look was taken".into());
        }
        for (of, kind) in s.kinds.iter().enumerate() {
            let members = self.members(kind);
            let is_known = s.completeness(of) >= s.wanted_of(of);
            // What holds of all that stands where was looked is known without all of the kind.
            if members.is_empty() && !is_known {
                continue;
            }
            if members.is_empty() && said.is_empty() && s.kinds.len() == 1 && !self.goal.question {
                return self.none_of(kind);
            }
            said.push(match members.len() {
                0 => format!("there is no {}{}", kind.name, reasons::in_room(s, kind)),
                n => {
                    let (place, all) = (reasons::in_room(s, kind), if is_known { "all " } else { "" });
                    let of = if n == 1 { kind.name.clone() } else { plural(&kind.name) };
                    let count = if n == 1 && is_known { "the only".into() } else { format!("{all}{n}") };
                    format!("found {count} {of}{place}: {}", members.join("; "))
                }
            });
            // As sure as was asked for is not sure.
            let hidden = s.doubt_of(of).hidden;
            if is_known && hidden >= reasons::WORTH_SAYING {
                said.push(format!("where nothing was seen there may be another ({})", percent(hidden)));
            }
        }
        for &on in &s.asked {
            said.push(self.identified(on));
        }
        if said.is_empty() || self.goal.asked.more || self.goal.asked.denies {
            let source = word.filter(|word| !word.is_seen).map_or("", |word| self.source(word));
            said.insert(0, format!("it holds that {}{source}", self.saying.say(&self.goal.pddl)));
        }
        (Verdict::Achieved, said.join("; "))
    }

    /// Sentence about a surface whose objects are all identified, or certainly unknown.
    fn identified(&self, on: usize) -> String {
        let surface = &self.s.surfaces[on];
        let there = self.s.belief.tracks.iter().filter(|track| track.on == surface.symbol);
        let (known, strange): (Vec<&Track>, Vec<&Track>) = there.partition(|track| track.label().is_some());
        let objects = |n: usize| if n == 1 { "object" } else { "objects" };
        let name = &surface.name;
        match (known.len(), strange.len()) {
            (0, 0) => format!("there is nothing on the {name}"),
            (n, 0) => format!("everything on the {name} is identified: {n} {}", objects(n)),
            (0, n) => format!("of {n} {} on the {name} none is a known one", objects(n)),
            (k, n) => {
                let are = |n: usize| if n == 1 { "is" } else { "are" };
                let (objects, known, strange) = (objects(k), are(k), are(n));
                format!(
                    "on the {name} {k} {objects} {known} identified, and {n} {strange} none of the known ones"
                )
            }
        }
    }

    /// Verdict and sentence for a kind of which no object was seen, though the search reached the
    /// required confidence.
    fn none_of(&self, kind: &Thing) -> (Verdict, String) {
        let s = self.s;
        let left = 1.0 - s.completeness(0);
        let seen = self.seen_of(s.doubt_of(0), left);
        let open = self
            .nothing_seen(kind)
            .or_else(|| reasons::may_be_none(s, kind))
            .or_else(|| (left > s.thresholds.not_there).then(|| format!("none was seen: {seen}")));
        let about = format!("{}{}", kind.name, reasons::in_room(s, kind));
        match open {
            Some(open) => {
                (Verdict::CannotTell, format!("it cannot be told whether there is {}, {open}", one(&about)))
            }
            None => (Verdict::NotFound, format!("there is no {about}: {seen}")),
        }
    }

    /// Sentence about a requested room in which no surface is known; `None` if there is no such room.
    fn nowhere(&self) -> Option<String> {
        let asked = self.s.kinds.iter().zip(&self.goal.asked.kinds);
        let mut rooms = asked.flat_map(|(kind, (_, rooms))| rooms.iter().flatten().map(move |r| (kind, r)));
        let is_bare = |room: &String| !self.s.surfaces.iter().any(|k| k.is_in(std::slice::from_ref(room)));
        let (kind, room) = rooms.find(|(_, room)| is_bare(room))?;
        let room = self.lexicon.name_of(room);
        Some(format!(
            "it cannot be told whether there is {} in the {room}: no surface is known there",
            one(&kind.name)
        ))
    }

    /// Clause on why no drive can be taken; `None` if one can.
    fn no_drive(&self) -> Option<String> {
        let culprit = culprit::of_drives(self.domain, self.round)?;
        Some(format!("no drive can be taken: {}", culprit::told(&culprit, &|t| self.saying.say(t))))
    }

    /// Verdict and sentence when no plan is left: what is known about the goal, and why the rest is
    /// missing. `is_proven` is true if no plan can exist.
    fn gave_up(&self, planner_says: &str, is_proven: bool) -> (Verdict, String) {
        let s = self.s;
        let culprit = self.no_drive();
        let says = match culprit.as_deref().unwrap_or(planner_says) {
            "" => String::new(),
            says => format!(": {says}"),
        };
        let missing: Vec<usize> =
            self.own().map(|(n, _)| n).filter(|&n| s.confidence(n) < s.threshold).collect();
        // Where looks could still settle what they can, it is something else that cannot be brought about.
        let is_beyond_looks = self.goal.asked.more
            && !missing.is_empty()
            && missing.iter().all(|&n| s.doubt_about(n).can_be_settled(s));
        if let Some(part @ (Part::Camera | Part::Laser)) = self.lacks {
            return (Verdict::CannotTell, format!("the body has no {part}, so nothing can be looked at"));
        }
        // No look is needed to know it where a part is missing that nothing can be brought about without.
        let is_beyond_the_body = self.goal.asked.more && self.lacks.is_some() && self.mind.views == 0;
        if (is_beyond_looks || is_beyond_the_body) && is_proven {
            return (Verdict::Impossible, self.impossible(&says));
        }
        let judged = self.judgement();
        let (value, word) = (judged.value, judged.word());
        if value == Truth::True {
            return self.reached();
        }
        let left = |n: usize| self.nothing_seen(&s.things[n]).or_else(|| reasons::left_about(s, n));
        let open = missing.iter().find_map(|&n| Some((n, left(n)?)));
        // Where a thing is may be open, and the answer known all the same: where it is asked about it is not.
        let is_sound = |n: usize| {
            let thing = &s.things[n];
            let is_elsewhere = thing.on.is_none();
            is_elsewhere && self.nothing_seen(thing).or_else(|| reasons::may_be_none(s, thing)).is_none()
        };
        let is_settled = self.goal.asked.denies || open.as_ref().is_some_and(|(n, _)| is_sound(*n));
        if self.goal.question && value == Truth::False && is_settled {
            return (Verdict::NotFound, self.denial(word));
        }
        if let Some((n, doubt)) = open {
            let asked = self.where_asked(&s.things[n]);
            let closed = self.closed().or(culprit).map(|closed| format!(", {closed}")).unwrap_or_default();
            let text =
                format!("it cannot be told whether {} is {asked}, {doubt}{closed}", the(&s.things[n].name));
            return (Verdict::CannotTell, format!("{text}; {}", self.looks()));
        }
        if let Some(&n) = missing.first().filter(|_| !self.goal.question || value == Truth::False) {
            let thing = &s.things[n];
            let elsewhere = self.elsewhere(thing).map(|w| format!(", it {w}")).unwrap_or_default();
            let asked = self.where_asked(thing);
            let seen = self.seen_of(s.doubt_about(n), s.chance_there(n));
            return (Verdict::NotFound, format!("{} is not {asked}{elsewhere}: {seen}", the(&thing.name)));
        }
        if let Some(unknown) = self.nowhere() {
            return (Verdict::CannotTell, unknown);
        }
        if let [kind] = s.kinds.as_slice()
            && s.things.is_empty()
            && s.completeness(0) >= s.threshold
            && s.completeness(0) < s.wanted_of(0)
        {
            return self.none_of(kind);
        }
        let unclear = (0..s.kinds.len()).any(|n| s.completeness(n) < s.wanted_of(n))
            || s.asked.iter().any(|&on| s.clarity(on) < s.threshold);
        if unclear {
            let left = match reasons::left_in_all(s) {
                Some(doubt) => format!(", {doubt}{}; {}", self.known_members(), self.looks()),
                None => format!("{}; {}{says}", self.known_members(), self.looks()),
            };
            return (Verdict::CannotTell, format!("not everything could be identified{left}"));
        }
        if self.goal.question {
            return self.to_question();
        }
        if !is_proven {
            let text = format!("no plan was found that brings about {}", self.saying.say(&self.goal.pddl));
            return (Verdict::CannotTell, format!("{text}{says}"));
        }
        (Verdict::Impossible, self.impossible(&says))
    }

    /// Sentence that answers a question about kinds with no, if all members are known and the
    /// condition is false.
    fn no_of_kinds(&self) -> Option<String> {
        let s = self.s;
        let is_of_kinds = self.goal.question && !s.kinds.is_empty() && self.own().next().is_none();
        let said = s.kinds.iter().map(|kind| match self.members(kind) {
            none if none.is_empty() => format!("there is no {}{}", kind.name, reasons::in_room(s, kind)),
            members => members.join("; "),
        });
        is_of_kinds.then(|| {
            format!(
                "{}; so it does not hold that {}",
                said.collect::<Vec<_>>().join("; "),
                self.saying.say(&self.goal.pddl)
            )
        })
    }

    /// Reason why views for a thing prove nothing: they contradict the map or each other, or no
    /// supporting surface was seen; `None` if they prove something.
    fn nothing_seen(&self, thing: &Thing) -> Option<String> {
        let asked = || self.mind.regions.iter().enumerate().filter(|(on, _)| thing.may_be_on(*on));
        let contradicts =
            |(on, region): (usize, &Region)| Some(region.contradiction?.told(&self.s.surfaces[on].name));
        if let Some(contradiction) = asked().find_map(contradicts) {
            return Some(contradiction);
        }
        if let Some((on, _)) = asked().find(|(_, region)| region.disputed) {
            return Some(Contradiction::Apart.told(&self.s.surfaces[on].name));
        }
        let regions = asked();
        let named =
            |(on, because): (usize, &String)| format!("no {} was seen: {because}", self.s.surfaces[on].name);
        regions.filter_map(|(on, region)| Some((on, region.nothing.as_ref()?))).map(named).next()
    }

    fn impossible(&self, says: &str) -> String {
        let known = self.surely();
        let known = if known.is_empty() { String::new() } else { format!("{}; ", known.join("; ")) };
        let lacks = self.lacks.map(|part| format!("the body has no {part}; ")).unwrap_or_default();
        let wanted = self.saying.say(&self.goal.pddl);
        format!("{known}{lacks}nothing that can be done brings about {wanted}{says}")
    }

    /// Sentences on the things requested by name whose place is certain.
    fn surely(&self) -> Vec<String> {
        let is_sure = |what: usize| {
            let anywhere = (0..self.s.surfaces.len()).map(|on| self.s.presence(what, on));
            anywhere.fold(self.s.confidence(what), f64::max) >= self.s.threshold
        };
        self.own()
            .filter(|(n, _)| is_sure(*n))
            .map(|(_, t)| format!("{} {}", the(&t.name), self.stands(t)))
            .collect()
    }

    /// Things requested by name, with their indices.
    fn own(&self) -> impl Iterator<Item = (usize, &Thing)> {
        self.s.things.iter().enumerate().filter(|(_, t)| t.track.is_none())
    }

    /// Object that a thing most probably is; `None` if no object can be.
    fn best(&self, thing: &Thing) -> Option<&Track> {
        let p = |t: &Track| thing.probability(t, &self.s.surfaces);
        self.s.belief.tracks.iter().max_by(|a, b| p(a).total_cmp(&p(b))).filter(|t| p(t) > 0.0)
    }

    fn stands(&self, thing: &Thing) -> String {
        match self.best(thing) {
            Some(track) => format!("{}{}", self.standing(track), self.or_other(thing)),
            None => "has not been seen".into(),
        }
    }

    /// Clause that a thing may be another known object that no view can tell apart; empty if views can.
    fn or_other(&self, thing: &Thing) -> String {
        let [model] = thing.models.as_slice() else { return String::new() };
        let mut others = self.domain.objects.iter().filter(|o| o.name != model.name && is_alike(o, model));
        let told = |other: &ObjectModel| format!(", or it is {}: no look tells the two apart", other.name);
        others.next().map(told).unwrap_or_default()
    }

    fn standing(&self, track: &Track) -> String {
        match self.s.surface_of(track) {
            Some(on) => {
                let surface = &self.s.surfaces[on];
                let room = surface.room.as_ref().map(|room| format!(" in the {room}")).unwrap_or_default();
                let is_found = !surface.whole && self.s.surfaces.len() > 1;
                let at = surface.centre().filter(|_| is_found);
                let at =
                    at.map(|p| format!(", whose middle is at {}", reasons::place(&p))).unwrap_or_default();
                format!("stands on the {}{at}{room}", surface.name)
            }
            None => "is in the hand".into(),
        }
    }

    /// Clause on the place of a thing that certainly stands outside the requested places; `None` for any
    /// other thing.
    fn elsewhere(&self, thing: &Thing) -> Option<String> {
        thing.on.as_ref()?;
        let anywhere = Thing { on: None, ..thing.clone() };
        let track = self.best(&anywhere).filter(|t| t.probability_of(&thing.name) >= self.s.threshold)?;
        Some(self.standing(track))
    }

    fn where_asked(&self, thing: &Thing) -> String {
        match thing.on.as_deref() {
            None | Some([]) => "there".into(),
            Some(on) => {
                let names: Vec<&str> = on.iter().map(|&n| self.s.surfaces[n].name.as_str()).collect();
                format!("on the {}", names.join(" or the "))
            }
        }
    }

    fn members(&self, kind: &Thing) -> Vec<String> {
        let is = |t: &&Track| kind.probability(t, &self.s.surfaces) > 0.5;
        let named = |t: &Track| format!("{} {}", the(t.label().unwrap_or(&kind.name)), self.standing(t));
        self.s.belief.tracks.iter().filter(is).map(named).collect()
    }

    /// Clause on the certain members of incompletely known kinds; empty if there are none.
    fn known_members(&self) -> String {
        let s = self.s;
        let is_open = |&n: &usize| s.completeness(n) < s.wanted_of(n);
        let named = |kind: &Thing, t: &Track| {
            let label = t.label().filter(|label| t.probability_of(label) >= s.thresholds.confidence);
            format!("{} {}", the(label.unwrap_or(&kind.name)), self.standing(t))
        };
        let of_kind = |n: usize| {
            let (kind, tracks) = (&s.kinds[n], s.belief.tracks.iter());
            let is = |t: &&Track| kind.probability(t, &s.surfaces) >= s.threshold;
            let sure: Vec<String> = tracks.filter(is).map(|t| named(kind, t)).collect();
            let (count, of) = (sure.len(), plural(&kind.name));
            (count > 0).then(|| format!("; {of} that are surely there: {count}, {}", sure.join("; ")))
        };
        (0..s.kinds.len()).filter(is_open).filter_map(of_kind).collect()
    }

    fn looks(&self) -> String {
        let known = &self.mind.known;
        let poses = known.candidates.len() - known.out_of_reach.len();
        let looks = if self.mind.views == 1 { "look" } else { "looks" };
        format!("after {} {looks}, with {poses} poses that can be reached", self.mind.views)
    }

    fn seen_of(&self, doubt: &Doubt, left: f64) -> String {
        let seen = reasons::seen_of(self.s, doubt, left, |on| self.mind.regions[on].taken);
        match self.s.own_map.goes_on(self.s.robot.description()) {
            Some(goes_on) => format!("{seen}; {goes_on}"),
            None => seen,
        }
    }

    fn believed(&self, t: &Track) -> Believed {
        let on = self.s.surface_of(t).map(|n| &self.s.surfaces[n]);
        let up = on.map_or_else(Vector3::z, |s| s.up);
        let asked = |thing: &Thing| thing.probability(t, &self.s.surfaces) > 0.5;
        Believed {
            label: t.label().map(str::to_string),
            kind: t.kind().map(str::to_string),
            confidence: t.certainty(),
            position_m: (!t.on.is_empty()).then(|| (t.position_m + up * (t.size_m[2] / 2.0)).coords.into()),
            position_sigma_m: on.map(|surface| adrift::worst(surface, t).1),
            size_m: t.size_m,
            on: on.map(|s| s.name.clone()),
            room: on.and_then(|s| s.room.clone()),
            asked: self.s.things.iter().chain(&self.s.kinds).any(asked),
        }
    }
}
