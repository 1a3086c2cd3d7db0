//! Final answers about shapes: identity and place of an object, and viewpoints that could not be
//! used.

use descry_perception::laser::Verdict as Taken;

use super::floor::{THIS, place};
use super::taken::contradict;
use crate::abilities::shapes::floor::FloorThing;
use crate::conclusion::{Believed, Conclusion, Ended, Verdict};
use crate::mind::Mind;
use crate::objective::Goal;
use crate::situation::Situation;
use crate::symbol::symbol;

/// Open length of an outline above which the answer mentions it, metres.
const OPEN_M: f64 = 0.02;

/// Answers a goal about one shape or one thing; `s` is the situation of the last round. None for other goals.
pub(super) fn answer(goal: &Goal, mind: &Mind, s: &Situation, ended: &Ended) -> Option<Conclusion> {
    goal.asked.plain.then_some(())?;
    let teller = Teller { mind, s };
    let is_to_learn = goal.asked.of_word("learned").next().is_some();
    let (verdict, why, thing) = match s.floor().sought.first() {
        Some(shape) => teller.where_is(shape, ended),
        None if is_to_learn => teller.learned(ended),
        None => teller.which(ended),
    };
    let believed: Vec<Believed> = s.floor().things.iter().map(|t| teller.believed(t)).collect();
    let found = thing.and_then(|t| s.floor().things.iter().position(|o| o.symbol == t.symbol));
    let found = found.map(|n| believed[n].clone());
    // What is learned may have another name already.
    let is_learned = is_to_learn && verdict == Verdict::Achieved;
    let learned = s.floor().learned.last().filter(|_| is_learned).map(|shape| shape.name.clone());
    Some(Conclusion {
        verdict,
        why,
        confidence: thing.map_or(0.0, |t| t.sureness(s.floor().known.len())),
        remaining: None,
        object: learned.or_else(|| found.as_ref().and_then(|b| b.label.clone())),
        found,
        objects: believed,
        remembered: None,
    })
}

struct Teller<'a> {
    mind: &'a Mind,
    s: &'a Situation,
}

type Told<'a> = (Verdict, String, Option<&'a FloorThing>);

impl<'a> Teller<'a> {
    fn name(&self, shape: &str) -> String {
        let floor = self.s.floor();
        let known = floor.names.iter().find(|(symbol, _)| symbol == shape).map(|(_, name)| name.clone());
        known.unwrap_or_else(|| shape.into())
    }

    /// Verdict and reason if a limit, a failure or the deadline ended the run; `None` otherwise.
    fn cut(&self, ended: &Ended) -> Option<(Verdict, String)> {
        match ended {
            Ended::Limit(why) => Some((Verdict::CannotTell, why.clone())),
            Ended::Failed(why) => Some((Verdict::Failed, why.clone())),
            Ended::NoPlan(_) | Ended::Undecided(_)
                if self.s.time_left_s.is_some_and(|left_s| left_s <= 0.0) =>
            {
                Some((Verdict::CannotTell, "there is no time left".into()))
            }
            // Nothing that can be done promises anything.
            Ended::Reached | Ended::NoPlan(_) | Ended::Undecided(_) => None,
        }
    }

    fn nothing(&self) -> Told<'a> {
        let text = "nothing stands before the robot that its map does not show";
        (Verdict::CannotTell, format!("{text}, after {} sweeps", self.mind.views), None)
    }

    fn which(&self, ended: &Ended) -> Told<'a> {
        let known = self.s.floor().known.len();
        let Some(thing) = self.s.floor().thing(THIS) else { return self.nothing() };
        let scans = self.scans(thing);
        if let Some((verdict, why)) = self.cut(ended) {
            return (verdict, format!("it cannot be told what this is: {why}; {scans}"), Some(thing));
        }
        let at = self.at(thing);
        let told = match (thing.taken_for.as_ref().map(|r| &r.verdict), ended) {
            (Some(Taken::Is(name)), Ended::Reached) => {
                (Verdict::Achieved, format!("this is {}, {at}", article(name)))
            }
            (Some(Taken::Unknown), Ended::Reached) => (
                Verdict::NotFound,
                format!("this is something unknown, {at}: it fits none of the {known} known shapes"),
            ),
            (Some(Taken::OneOf(names)), _) => {
                (Verdict::CannotTell, format!("this is {at}, and may be {}", names.join(" or ")))
            }
            (Some(Taken::Is(name)), _) => (
                Verdict::CannotTell,
                format!(
                    "this is {at}, and may be {}, or something unknown that looks like it from where it could be scanned",
                    article(name)
                ),
            ),
            _ => (Verdict::CannotTell, format!("it cannot be told what this is, {at}")),
        };
        (told.0, format!("{}; {scans}", told.1), Some(thing))
    }

    fn learned(&self, ended: &Ended) -> Told<'a> {
        let Some(thing) = self.s.floor().thing(THIS) else { return self.nothing() };
        let scans = self.scans(thing);
        let told = match (ended, self.s.floor().learned.last()) {
            (Ended::Reached, Some(shape)) => {
                let f = shape.features();
                let size = format!("{:.0} cm², {:.0} cm around", 1e4 * f.area_m2, 1e2 * f.perimeter_m);
                (Verdict::Achieved, format!("the shape of {} is learned, {size}", article(&shape.name)))
            }
            _ => self.cut(ended).unwrap_or_else(|| {
                let text = format!(
                    "the shape of what is {} is not learned: too much of its outline is open",
                    self.at(thing)
                );
                (Verdict::CannotTell, text)
            }),
        };
        (told.0, format!("{}; {scans}", told.1), Some(thing))
    }

    fn where_is(&self, shape: &str, ended: &Ended) -> Told<'a> {
        let (floor, name) = (self.s.floor(), self.name(shape));
        if !floor.knows(shape) {
            let known: Vec<&str> = floor.known.iter().map(|k| k.name.as_str()).collect();
            let text = format!(
                "nobody has learned what {} looks like; stand before one and say: learn {name}; known are: {}",
                article(&name),
                known.join(", ")
            );
            return (Verdict::CannotTell, text, None);
        }
        let found: Vec<&FloorThing> =
            floor.things.iter().filter(|t| t.is().is_some_and(|is| symbol(is) == shape)).collect();
        let sure = |t: &FloorThing| t.sureness(floor.known.len());
        let best = found.iter().copied().max_by(|a, b| sure(a).total_cmp(&sure(b)));
        if let (Ended::Reached, Some(thing)) = (ended, best) {
            let text = format!("{} stands {}; {}", article(&name), self.at(thing), self.scans(thing));
            return (Verdict::Achieved, text, Some(thing));
        }
        let open: Vec<&FloorThing> =
            floor.things.iter().filter(|t| t.may_have(shape, floor.known.len(), self.s.threshold)).collect();
        let others = floor.things.len() - open.len();
        let seen = format!("{others} things on the floor are something else");
        if let Some((verdict, why)) = self.cut(ended) {
            return (verdict, format!("it cannot be told where {} is: {why}; {seen}", article(&name)), best);
        }
        if !open.is_empty() {
            let places: Vec<String> = open.iter().map(|t| format!("what is {}", self.at(t))).collect();
            let text = format!(
                "{} may be it, and nothing that can be scanned settles it; {seen}",
                places.join(" and ")
            );
            return (Verdict::CannotTell, text, best);
        }
        if let Some(first) = floor.room.first() {
            let text = format!(
                "{} is nowhere that could be scanned, and there is room for it where no sweep passed, as near ({:.2}, {:.2}) m; {seen}",
                article(&name),
                first.x,
                first.y
            );
            return (Verdict::CannotTell, text, None);
        }
        let text = format!(
            "there is no {name} on the floor: {seen}, and the laser passed over all the rest in {} sweeps",
            self.mind.views
        );
        (Verdict::NotFound, text, None)
    }

    fn at(&self, thing: &FloorThing) -> String {
        let (middle, _) = place(self.s.floor(), thing);
        format!("at ({:.2}, {:.2}) m", middle.x, middle.y)
    }

    /// Clauses on the used scans of an object, those left out, poses that could not be reached, and the
    /// open outline.
    fn scans(&self, thing: &FloorThing) -> String {
        let used = thing.outline.as_ref().map_or(0, |o| o.alignment.model.scans().len());
        let mut parts = vec![format!("from {used} scans")];
        for (pose, why) in &thing.ignored {
            parts.push(format!("the one from {pose} is left out: {why}"));
        }
        let poses = self.s.floor().poses.poses;
        if thing.ring.len() < poses {
            parts.push(format!("{} of {poses} poses around it cannot be reached", poses - thing.ring.len()));
        }
        let loose_m = thing.looseness_m();
        if loose_m > OPEN_M && thing.outline.is_some() {
            parts.push(format!(
                "it was not scanned from all sides, and may reach {:.0} cm beyond what was met on average",
                1e2 * loose_m
            ));
        }
        parts.join("; ") + &thing.outline.as_ref().map_or(String::new(), |o| contradict(&o.alignment))
    }

    fn believed(&self, thing: &FloorThing) -> Believed {
        let s = self.s;
        let (middle, width_m) = place(s.floor(), thing);
        let label = thing.is().map(str::to_string);
        let room = s.robot.rooms().iter().find(|r| within(&r.outline_m, &middle)).map(|r| r.name.clone());
        Believed {
            asked: match s.floor().sought.is_empty() {
                false => label.as_ref().is_some_and(|l| s.floor().sought.contains(&symbol(l))),
                true => thing.symbol == THIS,
            },
            kind: label.clone(),
            label,
            confidence: thing.sureness(s.floor().known.len()),
            position_m: Some([middle.x, middle.y, 0.0]),
            position_sigma_m: None,
            size_m: [width_m, width_m, 0.0],
            on: None,
            room,
        }
    }
}

fn within(
    outline: &[descry_perception::nalgebra::Point2<f64>],
    p: &descry_perception::nalgebra::Point2<f64>,
) -> bool {
    let n = outline.len();
    n >= 3 && (0..n).all(|i| (outline[(i + 1) % n] - outline[i]).perp(&(p - outline[i])) >= 0.0)
}

fn article(name: &str) -> String {
    format!("the {name}")
}
