//! Estimates the unknown up direction: the one under which planes are level or upright, and objects
//! stand on the level ones.
//!
//! Every direction that the large planes in view suggest is a hypothesis: a plane may be level, or
//! upright as a wall, alone or with another. The likelihood of a hypothesis depends on how cameras
//! are usually held, on the share of returns on planes that are then level or upright, and on the
//! share of the other returns that stand on level planes. A wall seen head-on and a floor seen from
//! straight above differ in nothing else; where that is not enough, the search fails.

use super::level::{SURE, THINGS_M};
use super::outline::Outline;
use super::planes::{Plane, face_up, large_planes};
use super::sample::Sample;
use crate::polygon::convex_hull;
use crate::pool;
use crate::scale::floor;
use crate::spread::tangents;
use crate::visibility::Visibility;
use nalgebra::{Point3, Unit, Vector3};
use rustc_hash::FxHashMap;

/// Maximum number of planes that are sought. From: chosen, a shelf has a dozen.
const PLANES: usize = 12;
/// Minimum share of the returns on a plane; smaller ones are objects or their pieces. From: chosen.
const LEAST_SHARE: f64 = 0.0125;
/// Maximum deviation of level and upright planes, radians. From: chosen, 8°: twice what a poor
/// camera bends.
const ALIKE_RAD: f64 = 0.14;
/// Angle between hypotheses below which they are one, radians. From: chosen, 15°.
const ONE_RAD: f64 = 0.26;
/// Minimum probability of the up direction, against all other directions; [`SURE`] if the direction
/// contradicts how cameras are held. From: chosen, more likely than not.
const LIKELY: f64 = 0.5;
/// Angle from the cameras' usual attitude beyond which an up direction is implausible, radians.
/// From: chosen, about 70°.
const HELD_RAD: f64 = 1.2;
/// Number of independent pieces of evidence that all returns count for. From: chosen.
const PIECES: f64 = 20.0;
/// Likelihood of returns on level planes that face a camera, relative to an arbitrary plane.
/// From: chosen, most of what is built is level or upright.
const LEVEL: f64 = 4.0;
/// Likelihood of returns on upright planes, relative to an arbitrary plane. From: chosen, most of
/// what is built is level or upright.
const UPRIGHT: f64 = 4.0;
/// Likelihood of returns on level planes that face away from the cameras (undersides), relative to
/// an arbitrary plane. From: chosen.
const UNDERSIDE: f64 = 3.0;
/// Likelihood of returns on planes neither level nor upright, relative to an arbitrary plane.
/// From: chosen.
const OBLIQUE: f64 = 0.05;
/// Prior probability that no level surface is in view. From: chosen.
const NO_LEVEL: f64 = 0.1;
/// Share of the returns on level planes from which on [`NO_LEVEL`] does not count against an up
/// direction. From: chosen.
const SHOWN: f64 = 0.2;
/// Prior probability that planes say nothing about up. From: chosen.
const SHAPELESS: f64 = 0.2;
/// Share of the returns off the planes that stand on level planes if the up direction is right.
/// From: chosen.
const STANDS: f64 = 0.8;
/// Share of the returns off the planes that stand on level planes by chance. From: chosen.
const ANYHOW: f64 = 0.5;
/// Number of independent pieces of evidence that the returns off the planes count for.
/// From: chosen.
const THINGS: f64 = 10.0;
/// Share of returns off the planes from which on their evidence counts in full. From: chosen.
const MANY: f64 = 0.05;

/// Reason the up direction is undecided.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Doubt {
    /// No plane is in view.
    NoPlane,
    /// The up direction is ambiguous, or shows nothing level.
    Untold,
}

/// Up direction in the world, with its probability, or the reason it is undecided.
pub(super) fn up(
    samples: &[Sample],
    seen: &Visibility,
    seed: u64,
) -> Result<(Unit<Vector3<f64>>, f64), Doubt> {
    /// Sampling stride; large planes need no more points. From: work.
    const STRIDE: usize = 4;
    let samples: Vec<Sample> = samples.iter().step_by(STRIDE).copied().collect();
    let (faces, rest) = faces(&samples, seen, seed);
    if faces.is_empty() {
        return Err(Doubt::NoPlane);
    }
    let things = Things {
        standing: pool::map(&faces, 1, |face| face.carries(&rest)),
        share: rest.len() as f64 / samples.len() as f64,
    };
    let mut hypotheses: Vec<Hypothesis> =
        ways(&faces, seen).into_iter().map(|up| Hypothesis::of(up, &faces, &things, seen)).collect();
    hypotheses.sort_by(|a, b| b.log.total_cmp(&a.log));
    let mut distinct: Vec<Hypothesis> = Vec::new();
    for hypothesis in hypotheses {
        if distinct.iter().all(|better| better.up.angle(&hypothesis.up) > ONE_RAD) {
            distinct.push(hypothesis);
        }
    }
    let Some(best) = distinct.first() else { return Err(Doubt::Untold) };
    let rivals: f64 = distinct.iter().map(|h| (h.log - best.log).exp()).sum();
    let chance = 1.0 / (rivals + (SHAPELESS.ln() - best.log).exp());
    tracing::debug!(chance, is_level = best.is_level, "way up");
    let is_contrary = held_up(seen).is_some_and(|held| held.angle(&best.up) > HELD_RAD);
    let is_told = best.is_level && chance >= if is_contrary { SURE } else { LIKELY };
    if is_told { Ok((settled(&best.up, &faces), chance)) } else { Err(Doubt::Untold) }
}

/// Up direction refined over all level planes, weighted by returns, as a small plane's may be off.
fn settled(up: &Unit<Vector3<f64>>, faces: &[Face]) -> Unit<Vector3<f64>> {
    let level = faces.iter().filter(|face| is_level(face, up));
    let sum: Vector3<f64> = level.map(|face| face.plane.normal * face.share).sum();
    Unit::try_new(sum, 0.0).unwrap_or(*up)
}

/// True if a plane facing a camera is level under this up direction.
fn is_level(face: &Face, up: &Vector3<f64>) -> bool {
    face.plane.normal.dot(up) > ALIKE_RAD.cos()
}

/// Plane with its returns.
struct Face {
    /// Plane with its normal towards the cameras.
    plane: Plane,
    /// Returns on the plane, world frame, metres.
    members: Vec<Point3<f64>>,
    /// Share of the returns that lie on the plane.
    share: f64,
}

/// Large planes, and the points on none of them.
fn faces(samples: &[Sample], seen: &Visibility, seed: u64) -> (Vec<Face>, Vec<Point3<f64>>) {
    let viewpoints = seen.viewpoints();
    let mut planes: Vec<Plane> = Vec::new();
    large_planes(
        samples,
        (seed, PLANES),
        |_| true,
        |plane| {
            planes.push(face_up(&plane, None, &viewpoints));
        },
    );
    let mut members: Vec<Vec<Point3<f64>>> = vec![Vec::new(); planes.len()];
    let mut rest = Vec::new();
    for sample in samples {
        let holder = planes.iter().position(|plane| plane.holds(sample));
        holder.map_or(&mut rest, |n| &mut members[n]).push(sample.point);
    }
    let mut faces = Vec::new();
    for (plane, members) in planes.into_iter().zip(members) {
        let share = members.len() as f64 / samples.len() as f64;
        if share < LEAST_SHARE {
            rest.extend(members);
        } else {
            faces.push(Face { plane, members, share });
        }
    }
    (faces, rest)
}

impl Face {
    /// Marks the points of objects that would stand on the plane if it were level: objects that
    /// begin near the plane and are no taller than objects are.
    fn carries(&self, places: &[Point3<f64>]) -> Vec<bool> {
        /// Side of the cells that separate objects, metres. From: chosen.
        const CELL_M: f64 = 0.04;
        /// Maximum height above the plane at which an object begins, metres. From: chosen.
        const FOOT_M: f64 = 0.06;
        let Plane { normal, offset } = self.plane;
        let (a, b) = tangents(&normal);
        let flat = |p: &Point3<f64>| [a.dot(&p.coords), b.dot(&p.coords)];
        let corner = |[x, y]: [f64; 2]| Point3::from(a * x + b * y + normal * offset);
        let hull = convex_hull(self.members.iter().map(flat).collect());
        let outline = Outline::of(&hull.into_iter().map(corner).collect::<Vec<_>>(), &normal);
        let cell = |p: &Point3<f64>| flat(p).map(|m| floor(m / CELL_M));
        let over = |p: &Point3<f64>| {
            let high_m = self.plane.distance(p);
            let is_over = high_m > THINGS_M.0 && high_m < THINGS_M.1 && outline.covers(p, 0.0);
            is_over.then(|| (cell(p), high_m))
        };
        let over: Vec<Option<([i32; 2], f64)>> = places.iter().map(over).collect();
        let mut lowest: FxHashMap<[i32; 2], f64> = FxHashMap::default();
        for (cell, high_m) in over.iter().flatten() {
            let low = lowest.entry(*cell).or_insert(*high_m);
            *low = low.min(*high_m);
        }
        let begins = |cell: [i32; 2]| lowest.get(&cell).is_some_and(|low_m| *low_m < FOOT_M);
        let stands = |cell: [i32; 2]| super::extent::around(cell).any(begins);
        over.into_iter().map(|over| over.is_some_and(|(cell, _)| stands(cell))).collect()
    }
}

/// Returns off all planes.
struct Things {
    /// For each plane, true for each point that would stand on it.
    standing: Vec<Vec<bool>>,
    /// Share of the returns that lie off all planes.
    share: f64,
}

/// Candidate up directions: those that make a plane level, and those that make one or two upright.
fn ways(faces: &[Face], seen: &Visibility) -> Vec<Unit<Vector3<f64>>> {
    /// Minimum length of a projected direction; shorter ones are undefined. From: chosen.
    const LEAST: f64 = 0.1;
    /// Number of largest planes of which pairs are taken as walls. From: chosen.
    const WALLS: usize = 4;
    /// Minimum sine of the angle between two walls. From: chosen.
    const APART: f64 = 0.9;
    // Upright planes leave open where up is, but for how cameras are held.
    let held = held_up(seen);
    let aside = |normal: &Vector3<f64>| match held {
        Some(held) => held.into_inner() - normal * held.dot(normal),
        None => seen.maps.first().map_or(Vector3::zeros(), |map| {
            normal.cross(&(map.camera_from_world.rotation.inverse() * Vector3::z()))
        }),
    };
    let single = faces.iter().flat_map(|face| {
        let level = Some(Unit::new_unchecked(face.plane.normal));
        [level, Unit::try_new(aside(&face.plane.normal), LEAST)].into_iter().flatten()
    });
    let walls = &faces[..faces.len().min(WALLS)];
    let pairs = walls.iter().enumerate().flat_map(|(n, a)| walls[..n].iter().map(move |b| (a, b)));
    let crossing = pairs
        .filter_map(|(a, b)| Unit::try_new(a.plane.normal.cross(&b.plane.normal), APART))
        .flat_map(|way| [way, -way]);
    single.chain(crossing).collect()
}

/// A direction that may be up.
struct Hypothesis {
    up: Unit<Vector3<f64>>,
    /// Log likelihood ratio against arbitrarily oriented planes.
    log: f64,
    /// True if something level that faces a camera is in view.
    is_level: bool,
}

impl Hypothesis {
    fn of(up: Unit<Vector3<f64>>, faces: &[Face], things: &Things, seen: &Visibility) -> Hypothesis {
        let of_face = |face: &Face| {
            let rise = face.plane.normal.dot(&up);
            let times = match () {
                () if is_level(face, &up) => LEVEL,
                () if -rise > ALIKE_RAD.cos() => UNDERSIDE,
                () if rise.abs() < ALIKE_RAD.sin() => UPRIGHT,
                () => OBLIQUE,
            };
            PIECES * face.share * times.ln()
        };
        let planes: f64 = faces.iter().map(of_face).sum();
        let carriers: Vec<&Vec<bool>> = faces
            .iter()
            .zip(&things.standing)
            .filter(|(face, _)| is_level(face, &up))
            .map(|(_, on)| on)
            .collect();
        let all = things.standing.first().map_or(0, Vec::len);
        let standing = (0..all).filter(|&k| carriers.iter().any(|on| on[k])).count();
        let share = standing as f64 / all.max(1) as f64;
        let each = share * (STANDS / ANYHOW).ln() + (1.0 - share) * ((1.0 - STANDS) / (1.0 - ANYHOW)).ln();
        let stand = THINGS * (things.share / MANY).min(1.0) * each;
        let level: f64 = faces.iter().filter(|face| is_level(face, &up)).map(|face| face.share).sum();
        let bare = (NO_LEVEL + (1.0 - NO_LEVEL) * (level / SHOWN).min(1.0)).ln();
        Hypothesis { up, log: planes + stand + bare + held_log(&up, seen), is_level: !carriers.is_empty() }
    }
}

/// Log probability of this up direction given how cameras are held, all alike, relative to the
/// likeliest.
fn held_log(up: &Vector3<f64>, seen: &Visibility) -> f64 {
    /// Standard deviation of a camera's roll, radians. From: chosen.
    const ROLLED_RAD: f64 = 0.2;
    /// Probability of a camera rolled by a quarter or half turn. From: chosen.
    const TURNED: f64 = 0.003;
    /// Probability of a camera rolled by any other angle. From: chosen.
    const ANY_WAY: f64 = 0.0003;
    /// Maximum upward pitch of cameras at full probability, radians. From: chosen.
    const RAISED_RAD: f64 = 0.2;
    /// Standard deviation of a camera's upward pitch beyond [`RAISED_RAD`], radians. From: chosen.
    const RAISED_SPREAD_RAD: f64 = 0.25;
    /// Minimum log probability of an upward pitch. From: chosen.
    const LEAST_RAISED: f64 = -5.0;
    /// Downward pitch from which cameras become rarer, radians. From: chosen.
    const STEEP_RAD: f64 = 1.1;
    /// Range of downward pitch over which cameras become rarer, radians. From: chosen.
    const STEEPER_RAD: f64 = 0.3;
    /// Log probability of looking straight down. From: chosen.
    const STRAIGHT: f64 = -2.0;
    // Rightwards, downwards, and forwards in the image.
    let turns = [(1.0, [0.0, -1.0]), (TURNED, [1.0, 0.0]), (TURNED, [-1.0, 0.0]), (TURNED, [0.0, 1.0])];
    let log = |camera: Vector3<f64>| {
        let down_rad = (-camera.z).clamp(-1.0, 1.0).asin();
        let spreads = (-down_rad - RAISED_RAD).max(0.0) / RAISED_SPREAD_RAD;
        let raised = (-0.5 * spreads * spreads).max(LEAST_RAISED);
        let steep = STRAIGHT * ((down_rad - STEEP_RAD) / STEEPER_RAD).clamp(0.0, 1.0);
        let rolled = turns.map(|(chance, [x, y])| {
            let (along, across) = (camera.x * x + camera.y * y, camera.y * x - camera.x * y);
            let spreads = across.clamp(-1.0, 1.0).asin() / ROLLED_RAD;
            if along > -ROLLED_RAD { chance * (-0.5 * spreads * spreads).exp() } else { 0.0 }
        });
        // Of a bare cloud nobody knows how its sensor was turned.
        let rolled = if seen.held { rolled.into_iter().fold(ANY_WAY, f64::max).ln() } else { 0.0 };
        raised + steep + rolled
    };
    let logs = seen.maps.iter().map(|map| log(map.camera_from_world.rotation * up));
    logs.sum::<f64>() / seen.maps.len().max(1) as f64
}

/// Up direction if cameras are held as usual, against the images' downward axis; `None` if their
/// attitude is unknown.
fn held_up(seen: &Visibility) -> Option<Unit<Vector3<f64>>> {
    /// Minimum length of the mean up direction; shorter ones cancel out. From: rounding.
    const CANCELLED: f64 = 1e-6;
    if !seen.held {
        return None;
    }
    let sum: Vector3<f64> =
        seen.maps.iter().map(|m| m.camera_from_world.rotation.inverse() * -Vector3::y()).sum();
    Unit::try_new(sum, CANCELLED)
}
