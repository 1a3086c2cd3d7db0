//! Recognition with many learned models: time, and confusions.

use crate::household::{Body, Room, bodies, made::made};
use crate::knowing::{Model, Scene, is_right, learned_steps, library, options, scene, some};
use crate::measure::median;
use crate::page::{Page, PageTable};
use crate::plot::{heat, sheet};
use crate::runs::{RunOptions, radius_m};
use crate::tabletop::Draws;
use descry_perception::Cloud;
use descry_perception::calibration::Claim;
use descry_perception::learning::{Recognised, choose};
use std::time::Instant;

/// Numbers of models that are known at once, in turn.
const KNOWN: [usize; 3] = [5, 20, 50];
/// Number of objects in a scene.
const THINGS: usize = 5;
/// Offset of the seeds of generated objects, which keeps them apart from those that confidence was fitted to.
const APART: u64 = 1 << 32;
/// Number of scenes in which recognition is timed.
const TIMED: usize = 5;

/// Scores over all scenes.
#[derive(Default)]
struct Said {
    /// Number of known objects with the correct name and pose.
    right: usize,
    /// Number of known objects with the correct name at a wrong pose.
    askew: usize,
    /// Number of known objects confused with another.
    other: usize,
    /// Number of known objects that were not named.
    silent: usize,
    /// Numbers of unknown objects that were mistaken for a known one, and that were not named.
    strangers: (usize, usize),
    /// Number of answers where no object stands.
    nowhere: usize,
}

/// Prints and plots the results; `known` limits the number of learned objects, `scenes` the number of
/// scenes.
pub fn print(seed: u64, known: usize, scenes: usize, page: &mut Page) -> Result<Vec<Claim>, String> {
    page.heading("Many models known at once");
    let mut draws = Draws(seed ^ 0x3a27);
    let most = known.min(KNOWN[KNOWN.len() - 1]);
    let (learned, all) = learn_all(seed, most, &mut draws, page)?;
    let models: Vec<&Model> = learned.iter().collect();
    let everything = library(&models);
    let surfaces: Vec<Cloud> = all.iter().map(|b| Room::surface(b, 0.004)).collect();
    let mut sums: [Said; KNOWN.len()] = Default::default();
    let mut confusion = vec![vec![0; most + 1]; most + 1];
    let mut claims = Vec::new();
    let mut wrong = PageTable::new(&[
        "scene",
        "said",
        "confidence",
        "stands there",
        "off its place",
        "what speaks for it",
    ]);
    let scenes: Vec<Scene> = (0..scenes)
        .map(|k| {
            let mut things = some(&mut draws, most, THINGS - 1);
            things.push(most + (draws.next() * (all.len() - most) as f64) as usize);
            scene(&all, &things, seed * 70_000 + k as u64)
        })
        .collect();
    for (number, scene) in scenes.iter().enumerate() {
        let found = everything.judged(&scene.view, &options()).map_err(|e| e.to_string())?;
        for (count, said) in KNOWN.iter().zip(&mut sums) {
            let of_these = found.iter().filter(|c| c.recognised.model < *count).cloned().collect();
            let told = choose(of_these, options().least_confidence);
            said.add(scene, &told, &all, &surfaces, *count);
            if *count >= most {
                confuse(scene, &told, &all, &mut confusion);
                for answer in &told {
                    let right = is_right(scene, &surfaces, answer.model, answer);
                    claims.push((answer.confidence, right));
                    if !right {
                        wrong.row(told_wrongly(number, scene, &all, answer));
                    }
                }
            }
        }
    }
    page.table(&counted(&learned, &sums, &scenes)?);
    page.say("Wrong answers with all models known:");
    page.table(&wrong);
    heat(
        &confusion,
        ("said (the last: nothing)", "truly (the last: strangers)"),
        &page.file("confusion.svg"),
    )?;
    page.figure("confusion.svg", "What is taken for what, with all models known");
    Ok(claims)
}

/// Table of scores and recognition time, for each number of known models.
fn counted(learned: &[Model], sums: &[Said], scenes: &[Scene]) -> Result<PageTable, String> {
    let mut table = PageTable::new(&[
        "models known",
        "named rightly",
        "askew by 1 cm or more",
        "taken for another",
        "not named",
        "strangers named",
        "strangers not named",
        "said where nothing stands",
        "s a recognition",
    ]);
    for (count, said) in KNOWN.iter().zip(sums) {
        let few: Vec<&Model> = learned.iter().take(*count).collect();
        let known = library(&few);
        let mut seconds = Vec::new();
        for scene in scenes.iter().take(TIMED) {
            let start = Instant::now();
            known.recognise(&scene.view, &options()).map_err(|e| e.to_string())?;
            seconds.push(start.elapsed().as_secs_f64());
        }
        let counts = [
            said.right,
            said.askew,
            said.other,
            said.silent,
            said.strangers.0,
            said.strangers.1,
            said.nowhere,
        ];
        let mut row = vec![few.len().to_string()];
        row.extend(counts.map(|c| c.to_string()));
        row.push(format!("{:.2}", median(&mut seconds)));
        table.row(row);
    }
    Ok(table)
}

/// Learns `most` objects by the robot, in random order; returns models indexed by body, and the bodies,
/// unknown ones last.
fn learn_all(
    seed: u64,
    most: usize,
    draws: &mut Draws,
    page: &mut Page,
) -> Result<(Vec<Model>, Vec<Body>), String> {
    let mut drawn = seed * 100 + APART;
    let mut open = bodies();
    let (mut models, mut all): (Vec<Model>, Vec<Body>) = (Vec::new(), Vec::new());
    let mut failed = 0;
    while models.len() < most {
        // Now and then one of our own making, as long as there are any.
        let body = if !open.is_empty() && draws.next() < 0.3 {
            open.remove(0)
        } else {
            drawn += 1;
            made(drawn)
        };
        let options = RunOptions {
            controlled: true,
            noise: (0.005, 0.5_f64.to_radians()),
            touching: false,
            step_rad: 15_f64.to_radians(),
            seed: seed * 4000 + all.len() as u64,
        };
        match learned_steps(std::slice::from_ref(&body), 0, options, &[usize::MAX]) {
            Ok(learned) => {
                models.extend(learned.into_iter().map(|m| Model { body: all.len(), ..m }));
                all.push(body);
            }
            Err(why) => {
                failed += 1;
                page.say(&format!("{}: not learned: {why}", body.name));
                if failed > most {
                    return Err("more than half could not be learned".to_owned());
                }
            }
        }
    }
    let clouds: Vec<&Cloud> = models.iter().take(20).map(|m| &m.cloud).collect();
    sheet(&clouds, &page.file("models-many.png"))?;
    page.figure(
        "models-many.png",
        "The first of them as they were learned: from the front and, below, from behind",
    );
    all.extend((1..=most.max(8) as u64).map(|k| made(drawn + 1000 + k)));
    Ok((models, all))
}

/// Index of the object in the scene at the pose of an answer; `None` if no object stands there.
fn thing_at(scene: &Scene, all: &[Body], found: &Recognised) -> Option<usize> {
    let away = |k: usize| {
        let pose = scene.things[k].1;
        (pose.translation.vector - found.world_from_model.translation.vector).norm()
    };
    let nearest = (0..scene.things.len()).min_by(|a, b| away(*a).total_cmp(&away(*b)))?;
    (away(nearest) < radius_m(&all[scene.things[nearest].0]).max(0.08)).then_some(nearest)
}

/// A row about a wrong answer: the answer, and the truth.
fn told_wrongly(number: usize, scene: &Scene, all: &[Body], found: &Recognised) -> Vec<String> {
    let at = found.world_from_model.translation.vector;
    let there = thing_at(scene, all, found).map_or_else(
        || format!("nothing, ({:.2}, {:.2}, {:.2}) m", at.x, at.y, at.z),
        |k| all[scene.things[k].0].name.to_owned(),
    );
    let said = found.world_from_model;
    let place = scene.things.iter().find(|thing| thing.0 == found.model).map(|thing| thing.1);
    let off = place.map_or("not in the scene".to_owned(), |truly| {
        let off_m = (truly.translation.vector - said.translation.vector).norm();
        format!("{:.1} cm, {:.0}°", 100.0 * off_m, truly.rotation.angle_to(&said.rotation).to_degrees())
    });
    let evidence = &found.evidence;
    let share = |count: usize| 100 * count / evidence.facing.max(1);
    let speaks = format!(
        "of {} points {} % explained, {} % looked through, {} % hidden; colours {:.2}, beyond {:.2}, normals {:.2} rad off, {} votes",
        evidence.facing,
        share(evidence.explained),
        share(evidence.through),
        share(evidence.hidden),
        evidence.colour.unwrap_or(f64::NAN),
        evidence.beyond,
        evidence.turned_rad,
        evidence.votes
    );
    let confidence = format!("{:.3}", found.confidence);
    vec![number.to_string(), all[found.model].name.to_owned(), confidence, there, off, speaks]
}

impl Said {
    fn add(&mut self, scene: &Scene, told: &[Recognised], all: &[Body], surfaces: &[Cloud], known: usize) {
        let places: Vec<Option<usize>> = told.iter().map(|f| thing_at(scene, all, f)).collect();
        self.nowhere += places.iter().filter(|p| p.is_none()).count();
        for (k, thing) in scene.things.iter().enumerate() {
            let here: Vec<&Recognised> =
                told.iter().zip(&places).filter(|(_, p)| **p == Some(k)).map(|(f, _)| f).collect();
            if thing.0 >= known {
                self.strangers.0 += usize::from(!here.is_empty());
                self.strangers.1 += usize::from(here.is_empty());
            } else if here.is_empty() {
                self.silent += 1;
            } else if here.iter().any(|f| f.model != thing.0) {
                self.other += 1;
            } else if here.iter().any(|f| is_right(scene, surfaces, thing.0, f)) {
                self.right += 1;
            } else {
                self.askew += 1;
            }
        }
    }
}

/// Updates the confusion matrix: rows are the truth, columns the answers.
fn confuse(scene: &Scene, told: &[Recognised], all: &[Body], confusion: &mut [Vec<usize>]) {
    let nothing = confusion.len() - 1;
    for (k, thing) in scene.things.iter().enumerate() {
        let said = told.iter().find(|f| thing_at(scene, all, f) == Some(k)).map_or(nothing, |f| f.model);
        confusion[thing.0.min(nothing)][said.min(nothing)] += 1;
    }
}
