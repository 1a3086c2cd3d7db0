//! Surfaces outside the map: associates the visible ones with the surface that was viewed and with
//! others.
//!
//! Without a map, a view shows whatever stands in front of the camera. Each supporting surface in view
//! gets its own views, belief and observed space: the requested object may be on any of them.

use std::sync::Arc;

use descry_perception::merge::Merged;
use descry_perception::nalgebra::Point3;
use descry_perception::surface::{Role, Surface, SurfaceError, SurfaceOptions, best, find_surfaces};

use crate::mind::{Mind, Region};
use crate::note::Note;
use crate::surface::KnownSurface;
use crate::symbol::symbol;

/// Minimum area of an additional surface, square metres.
const LEAST_M2: f64 = 0.1;
/// Maximum height difference between two parts of one surface, metres.
const LEVEL_M: f64 = 0.08;
/// Margin around an outline within which the centre of another part of the same surface may lie,
/// metres.
const BESIDE_M: f64 = 0.05;
/// Ordinals for naming further surfaces.
const ORDINALS: [&str; 9] =
    ["second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth", "tenth"];

/// Surface that was viewed, and the other supporting surfaces in view. If the viewed one has no outline
/// yet, the best surface that is not known as another is taken for it.
pub(super) fn look(
    merged: &Merged,
    options: &SurfaceOptions,
    surfaces: &[KnownSurface],
    on: usize,
) -> Result<(Surface, Vec<Surface>), SurfaceError> {
    let found = find_surfaces(&merged.cloud, &merged.visibility, options)?;
    let is_known_as = |s: &Surface, n: usize| is_one(s, &surfaces[n]);
    let (mut others, here): (Vec<Surface>, Vec<Surface>) = match surfaces[on].outline.is_empty() {
        true => found.into_iter().partition(|s| (0..surfaces.len()).any(|n| n != on && is_known_as(s, n))),
        false => found.into_iter().partition(|s| !is_known_as(s, on)),
    };
    let surface = best(here.clone(), options)?;
    others.extend(here.into_iter().filter(|s| surfaces[on].outline.is_empty() && *s != surface));
    others.retain(|s| s.role == Role::Support && s.area_m2 >= LEAST_M2);
    Ok((surface, others))
}

/// Adds surfaces found beside the viewed one, with its views; returns the indices of the new ones.
pub(super) fn adopt(mind: &mut Mind, on: usize, others: Vec<Surface>, notes: &mut Vec<Note>) -> Vec<usize> {
    let fresh = |s: &Surface, mind: &Mind| !mind.known.surfaces.iter().any(|known| is_one(s, known));
    let mut new = Vec::new();
    for surface in others {
        if !fresh(&surface, mind) {
            continue;
        }
        let number = mind.known.surfaces.len();
        let first = mind.known.surfaces[0].name.clone();
        let name = match ORDINALS.get(number - 1) {
            Some(ordinal) => format!("{ordinal} {first}"),
            None => format!("{first} {}", number + 1),
        };
        let known = KnownSurface {
            symbol: symbol(&name),
            name: name.clone(),
            room: None,
            floor: Vec::new(),
            outline: surface.hull.clone(),
            up: surface.up.into_inner(),
            whole: false,
            doubtful: None,
            placed: None,
            displaced_m: 0.0,
            sensor_doubt: 0.0,
        };
        let at = known.centre().unwrap_or_else(Point3::origin);
        notes.push(Note::Surface { name, at_m: at.into(), area_m2: surface.area_m2 });
        let looked_from: Vec<String> = mind
            .words
            .instances("observed")
            .filter(|a| a.get(1).is_some_and(|s| *s == mind.known.surfaces[on].symbol))
            .filter_map(|a| a.first().cloned())
            .collect();
        for from in looked_from {
            mind.words.set("observed", vec![from, known.symbol.clone()], Some(1.0));
        }
        mind.known.surfaces.push(known);
        mind.known.spaces.push(Arc::default());
        let seen = &mind.regions[on];
        let region = Region { looks: seen.looks.clone(), taken: seen.taken, ..Region::default() };
        mind.regions.push(region);
        new.push(number);
    }
    mind.attend();
    new
}

/// Joins two discovered surfaces that turn out to be one: the later is dropped, and its objects move to
/// the other.
pub(super) fn join(mind: &mut Mind, on: usize, surface: &Surface) {
    let known = &mind.known.surfaces;
    let Some(last) = (on + 1..known.len()).rev().find(|&n| !known[n].whole && is_one(surface, &known[n]))
    else {
        return;
    };
    // A later one is known by no index but its own: those that the goal names come first.
    let gone = mind.known.surfaces.remove(last);
    mind.known.spaces.remove(last);
    mind.regions.remove(last);
    mind.forget_looks(Some(&gone.symbol));
    let into = mind.known.surfaces[on].symbol.clone();
    let belief = Arc::make_mut(&mut mind.known.belief);
    belief.tracks.iter_mut().filter(|t| t.on == gone.symbol).for_each(|t| t.on.clone_from(&into));
    mind.attend();
}

/// True if a found surface is a known one: level with it and overlapping.
fn is_one(found: &Surface, known: &KnownSurface) -> bool {
    let Some(centre) = known.centre() else { return false };
    let middle = found.surface_from_world.inverse() * Point3::origin();
    known.up.dot(&(middle - centre)).abs() < LEVEL_M
        && (found.covers(&centre, BESIDE_M) || known.covers(&middle, BESIDE_M))
}
