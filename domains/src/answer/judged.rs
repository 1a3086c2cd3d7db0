//! Answers from the three-valued judgement of the goal: open conditions with reasons, and
//! counter-evidence.

use descry_memory::belief::Track;

use super::Asker;
use crate::conclusion::Verdict;
use crate::english::{percent, plural, the};
use crate::judge::{Decisive, Judge, Judgement, Truth};
use crate::known::Thing;
use crate::origin::{self, Origin};
use crate::reasons;

impl Asker<'_> {
    /// Truth of the goal in the last round; unknown if an attachment fails.
    pub(super) fn judgement(&self) -> Judgement {
        let round = self.round;
        let judge = Judge::new(self.domain, &self.mind.words, self.s, &round.task, &round.attachments);
        judge.map_or(Judgement::UNKNOWN, |judge| judge.goal())
    }

    /// Sentence on why the truth of the goal cannot be told; `word` is the fact on which it depends.
    pub(super) fn open(&self, word: Option<&Decisive>) -> String {
        let Some(word) = word else {
            return format!("it cannot be told whether {}", self.saying.say(&self.goal.pddl));
        };
        if !word.is_seen {
            return self.untold(word);
        }
        let s = self.s;
        let thing = self.thing_of(word);
        let surface = self.surface_of(word);
        if let Some(what) = thing {
            let may_be = |on: &usize| s.chance_on(what, *on) > s.thresholds.not_there;
            let asked = (0..s.surfaces.len()).filter(|&on| s.things[what].may_be_on(on));
            if let Some(on) = surface.or_else(|| asked.into_iter().find(may_be)) {
                return self.open_on(what, on);
            }
            let name = the(&s.things[what].name);
            return format!("it cannot be told where {name} is: no surface is known");
        }
        if let Some(of) = self.kind_of(word) {
            let kind = &s.kinds[of];
            let (name, place) = (plural(&kind.name), reasons::in_room(s, kind));
            return format!("it cannot be told, for not all {name}{place} are known");
        }
        let unclear = (0..s.surfaces.len()).find(|&on| !s.is_clear(on));
        match surface.or(unclear) {
            Some(on) => {
                let name = &s.surfaces[on].name;
                let why = self.why_open(on).unwrap_or_else(|| "not all on it is identified".into());
                format!("it cannot be told what stands on the {name}: {why}")
            }
            None => format!("it cannot be told whether {}", self.saying.say(&self.goal.pddl)),
        }
    }

    fn open_on(&self, what: usize, on: usize) -> String {
        let s = self.s;
        let (thing, surface) = (the(&s.things[what].name), &s.surfaces[on].name);
        let chance = s.chance_on(what, on);
        let left = || format!("a chance of {} is left that it is", percent(chance));
        let why = self.why_open(on).unwrap_or_else(left);
        format!("it cannot be told that {thing} is not on the {surface}: {why}")
    }

    /// Reason why the views of a surface are insufficient; `None` if no reason is known.
    fn why_open(&self, on: usize) -> Option<String> {
        let there = Thing { on: Some(vec![on]), ..Thing::default() };
        let looks = self.mind.regions[on].taken;
        let closed = self.closed().map(|closed| format!(", {closed}")).unwrap_or_default();
        let unseen =
            (looks == 0).then(|| format!("the {} was not looked at{closed}", self.s.surfaces[on].name));
        unseen.or_else(|| self.nothing_seen(&there)).or_else(|| reasons::may_be_none(self.s, &there))
    }

    /// Sentence about a shut door, which a question leaves shut; `None` if no door is in the way.
    pub(super) fn closed(&self) -> Option<String> {
        let s = self.s;
        let shut: Vec<&str> = s.shut.iter().map(|&door| s.doors[door].door.name.as_str()).collect();
        let is_behind = |&n: &usize| !s.can_drive_to(n) && s.can_reach(n);
        let is_closed = self.goal.question && (0..s.candidates.len()).any(|n| is_behind(&n));
        let are = if shut.len() == 1 { "is" } else { "are" };
        is_closed
            .then(|| format!("for the {} {are} shut, and a question opens nothing", shut.join(" and the ")))
    }

    /// Sentence about a fact that no view can show and no other source states.
    fn untold(&self, word: &Decisive) -> String {
        let said = word.pddl().map_or_else(|| word.word.clone(), |pddl| self.saying.say(&pddl));
        let declared = self.domain.vocabulary.word(&word.word);
        let unsaid = declared.as_ref().and_then(|word| origin::unsaid(self.domain, word));
        let is_found_out = declared.as_ref().is_some_and(|word| origin::is_found_out(self.domain, word));
        let late =
            (is_found_out && self.s.time_left_s.is_some()).then(|| "in the time that was given".into());
        let unreached = self.closed().or(late).filter(|_| unsaid.is_none());
        let unreached = unreached.map(|because| format!(", {because}")).unwrap_or_default();
        let why = match (unsaid, word.is_number) {
            (Some(action), _) => {
                format!("the domain does not say whether ({action}) finds that out, by its `kind`")
            }
            (None, true) => "nothing gives it a value".into(),
            (None, false) => "no look shows that, and nothing has said so".into(),
        };
        let open = if word.is_number { format!("how much {said} is") } else { format!("whether {said}") };
        format!("it cannot be told {open}: {why}{unreached}")
    }

    fn thing_of(&self, word: &Decisive) -> Option<usize> {
        word.objects.iter().flatten().find_map(|name| self.s.thing(name).ok())
    }

    fn surface_of(&self, word: &Decisive) -> Option<usize> {
        word.objects.iter().flatten().find_map(|name| self.s.surface(name).ok())
    }

    fn kind_of(&self, word: &Decisive) -> Option<usize> {
        // A thing and a kind may have one name: the word says which is meant.
        let types = self.domain.vocabulary.word(&word.word)?.types;
        let mut named =
            word.objects.iter().zip(&types).filter(|(_, of)| self.domain.vocabulary.is_a(of, "kind"));
        named.find_map(|(name, _)| self.s.kind(name.as_ref()?).ok())
    }

    /// Sentence that denies the goal, with the evidence.
    pub(super) fn denial(&self, word: Option<&Decisive>) -> String {
        let denied = format!("it does not hold that {}", self.saying.say(&self.goal.pddl));
        let Some(word) = word else { return denied };
        if let Some(standing) = self.stands_against(word) {
            return standing;
        }
        if word.is_seen {
            let said = self.surely().join("; ");
            return if said.is_empty() { denied } else { format!("{said}; so {denied}") };
        }
        let Some(pddl) = word.pddl() else { return denied };
        let fact = match (word.is_number, word.holds) {
            (true, _) => return denied + &self.value_of(word),
            (false, true) => self.saying.say(&pddl),
            (false, false) => self.saying.deny(&pddl),
        };
        format!("{denied}: {fact}{}", self.source(word))
    }

    /// Clause on the value of a numeric function, with its source.
    fn value_of(&self, word: &Decisive) -> String {
        let objects: Vec<&str> = word.objects.iter().flatten().map(String::as_str).collect();
        let atom = [&[word.word.as_str()], objects.as_slice()].concat().join(" ");
        let pddl = format!("({atom})");
        format!(": {} is {}{}", self.saying.say(&pddl), self.value(&atom), self.source(word))
    }

    /// Clause on the source of a fact that no view can show; empty if the source is the body, a program,
    /// or an action of this run.
    pub(super) fn source(&self, decisive: &Decisive) -> &'static str {
        let name = &decisive.word;
        let Some(word) = self.domain.vocabulary.word(name) else { return "" };
        let objects: Vec<String> = decisive.objects.iter().flatten().cloned().collect();
        let words = &self.mind.words;
        match origin::of(self.domain, &word) {
            Origin::Fixed => ", as the domain says",
            Origin::Remembered if words.is_spoken_of(name) && !words.is_told(name, &objects) => {
                ", as the domain says in the beginning"
            }
            _ => "",
        }
    }

    /// Sentence on an object that stands where the goal wants none; `None` if there is no such object.
    fn stands_against(&self, word: &Decisive) -> Option<String> {
        let s = self.s;
        if !self.goal.asked.denies {
            return None;
        }
        let is_there = |t: &&Track| self.surface_of(word).is_none_or(|on| s.surface_of(t) == Some(on));
        match word.objects.first()? {
            Some(name) => {
                let thing = &s.things[s.thing(name).ok()?];
                let mut there = s.belief.tracks.iter().filter(is_there);
                let track = there.find(|track| s.is_taken_for(thing, track))?;
                Some(format!("{} {}", the(&thing.name), self.standing(track)))
            }
            None => {
                let track = s.strangers().find(is_there)?;
                let name = track.label().or_else(|| track.kind()).map_or("something unknown".into(), the);
                Some(format!("{name} {}", self.standing(track)))
            }
        }
    }

    /// Verdict and sentence for a question that further actions cannot settle better.
    pub(super) fn to_question(&self) -> (Verdict, String) {
        let judged = self.judgement();
        let word = judged.word();
        match judged.value {
            Truth::True => self.reached(),
            Truth::False => (Verdict::NotFound, self.no_of_kinds().unwrap_or_else(|| self.denial(word))),
            Truth::Unknown => (Verdict::CannotTell, self.another().unwrap_or_else(|| self.open(word))),
        }
    }

    /// Sentence that another object of the kind may stand at the requested place, though one is known
    /// elsewhere; `None` if not.
    fn another(&self) -> Option<String> {
        let s = self.s;
        let is_known = |what: usize, on: usize| s.presence(what, on) >= s.threshold;
        let said = self.surely();
        let mut places = self.own().flat_map(|(what, _)| (0..s.surfaces.len()).map(move |on| (what, on)));
        let (what, on) = places
            .find(|&(what, on)| !is_known(what, on) && s.chance_on(what, on) > s.thresholds.not_there)
            .filter(|_| !said.is_empty() && !self.goal.asked.more)?;
        let (thing, surface) = (&s.things[what].name, &s.surfaces[on].name);
        let chance = percent(s.chance_on(what, on));
        let left = format!("a chance of {chance} is left that there is another {thing} on the {surface}");
        Some(format!("{}; it cannot be told more, {left}; {}", said.join("; "), self.looks()))
    }
}
