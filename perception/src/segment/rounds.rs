//! Extraction of upright round bodies from larger parts: a cup beside a box, where no crease
//! separates them.
//!
//! The normals of a round body's side point away from its axis. Each voxel of a side votes for the
//! axes that it may belong to; where many votes agree, a body is fitted, and separated if the
//! remainder is more than a handle.

use super::patches::{SIDE_VOXELS, Voxels, is_upright, members, take_away};
use super::vessels::round_body;
use super::votes::{RADII, Votes};
use crate::outline;
use crate::pool;
use crate::quantile::{VOXEL_ENDS, quantile};
use crate::round::{SECTORS, distance, sector};
use crate::scale::{APART_M, PLACE_M};
use crate::surface::floor;
use nalgebra::{Point2, Point3, Vector2};
use std::collections::{BTreeMap, BTreeSet};

/// Radii that are sought, metres. From: chosen.
const RADII_M: (f64, f64) = (0.025, 0.085);
/// Step of the radii and of the positions, metres. From: derived, so many radii in that range.
const STEP_M: f64 = (RADII_M.1 - RADII_M.0) / (RADII - 1) as f64;
/// Maximum distance of a point from the side of the body that it belongs to, metres. From: chosen,
/// a millimetre less leaves a piece beside one thing in 32.
const CLEAR_M: f64 = 0.009;
/// Minimum distance from the body of a point that cannot be an image of the body in a misregistered
/// view, metres. From: chosen.
const BESIDE_M: f64 = 0.035;
/// Minimum cosine between a normal of the side and the direction away from the axis; the normals on
/// a box's faces turn by up to 45° from it. From: chosen, between 1 and the cosine of 45°.
const FACING: f64 = 0.9;
/// Minimum share, of the upright voxels at the radius, of those with normals away from the axis.
/// From: chosen.
const ROUND_SHARE: f64 = 0.75;
/// Minimum number of directions (of 36) around an axis that must show the side. From: chosen.
const LEAST_SECTORS: usize = 12;
/// Minimum vertical component of the normal of a level face. From: chosen.
const LEVEL: f64 = 0.8;
/// Minimum concentration of the normals of a box's sides at right angles (1: all). From: chosen.
const SQUARE: f64 = 0.55;

/// Separates round bodies from parts, and joins their pieces split by creases.
pub(super) fn part(
    voxels: &Voxels,
    points: &[Point3<f64>],
    part_of_voxel: &mut [u32],
    viewpoints: &[Point3<f64>],
) {
    let all = members(part_of_voxel);
    let is_one = |of: &[usize]| is_box(voxels, of, points) || is_round(voxels, of, points, viewpoints);
    let one = pool::heaviest_first(&all, |(_, of)| of.len(), |(_, of)| is_one(of));
    let more = all.into_iter().zip(one).filter(|(_, is_one)| !is_one);
    let mut members: BTreeMap<u32, Vec<usize>> = more.map(|(part, _)| part).collect();
    let all: Vec<usize> = members.values().flatten().copied().collect();
    for mut together in voxels.together(&all) {
        let mut votes = votes_of(voxels, &together);
        loop {
            let axes = Axis::sought(&votes);
            let cut = pool::find_first(0..axes.len(), |n| {
                let body = axes[n].body(voxels, &together)?;
                // Most are round.
                let (is_round, cut) = pool::join(
                    || is_round(voxels, &body, points, viewpoints),
                    || Cut::around(voxels, &body, &axes[n], part_of_voxel, &members),
                );
                cut.filter(|_| is_round)
            });
            let Some(cut) = cut else { break };
            cut.body.iter().for_each(|v| {
                members.remove(&part_of_voxel[*v]);
            });
            take_away(&mut together, &cut.body);
            cut.body.iter().filter_map(|&v| voted_for(voxels, v)).for_each(|cells| votes.take_back(&cells));
            cut.body.iter().for_each(|&v| part_of_voxel[v] = cut.body[0] as u32);
            for left in cut.left {
                left.iter().for_each(|&v| part_of_voxel[v] = left[0] as u32);
                members.insert(left[0] as u32, left);
            }
        }
    }
}

/// True if a part's side is that of a box: normals at right angles, and a fitting rectangle.
fn is_box(voxels: &Voxels, of: &[usize], points: &[Point3<f64>]) -> bool {
    let side: Vec<usize> = of.iter().copied().filter(|&v| is_upright(&voxels.normals[v])).collect();
    // Turned by four times their angle, the normals of all sides of a rectangle are one.
    let twice = |a: Vector2<f64>| Vector2::new(a.x * a.x - a.y * a.y, 2.0 * a.x * a.y);
    let turned = side.iter().map(|&v| twice(twice(voxels.normals[v].xy().normalize())));
    let square = turned.sum::<Vector2<f64>>().norm() / side.len().max(1) as f64;
    if square <= SQUARE {
        return false;
    }
    outline::fits(&voxels.points_of(&side, points), PLACE_M)
}

/// Round body, and the remainders of the parts that it takes voxels from.
struct Cut {
    /// Voxels of the body with its handle and frayed edge, ascending.
    body: Vec<usize>,
    /// The voxels apart from the body, in connected pieces, each ascending.
    left: Vec<Vec<usize>>,
}

impl Cut {
    /// Body about an axis; `None` if there is no body, or if it is exactly one of the parts.
    fn around(
        voxels: &Voxels,
        body: &[usize],
        axis: &Axis,
        part_of_voxel: &[u32],
        members: &BTreeMap<u32, Vec<usize>>,
    ) -> Option<Cut> {
        let touched: BTreeSet<u32> = body.iter().map(|&v| part_of_voxel[v]).collect();
        let mut rest: Vec<usize> =
            touched.iter().filter_map(|part| members.get(part)).flatten().copied().collect();
        rest.sort_unstable();
        take_away(&mut rest, body);
        let (left, own): (Vec<_>, Vec<_>) =
            voxels.together(&rest).into_iter().partition(|piece| is_apart(voxels, piece, body, axis));
        // What two parts leave stays two.
        let left: Vec<Vec<usize>> = left
            .iter()
            .flat_map(|piece| touched.iter().map(move |part| (piece, *part)))
            .map(|(piece, part)| {
                piece.iter().copied().filter(|v| part_of_voxel[*v] == part).collect::<Vec<_>>()
            })
            .flat_map(|piece| voxels.together(&piece))
            .collect();
        if touched.len() == 1 && left.is_empty() {
            return None;
        }
        let mut body = body.to_vec();
        body.extend(own.into_iter().flatten());
        body.sort_unstable();
        (!axis.parts_a_top(voxels, &body, &left)).then_some(Cut { body, left })
    }
}

/// True if the remainder beside a body is more than its handle, its frayed edge or its image in a
/// misaligned view, or rises above the body.
fn is_apart(voxels: &Voxels, rest: &[usize], body: &[usize], axis: &Axis) -> bool {
    let heights = |of: &[usize]| {
        let mut heights: Vec<f64> = of.iter().map(|&v| voxels.centres[v].z).collect();
        (quantile(&mut heights, VOXEL_ENDS.0), quantile(&mut heights, VOXEL_ENDS.1))
    };
    let ((low_m, top_m), (base_m, rim_m)) = (heights(rest), heights(body));
    let hangs = low_m > base_m + APART_M && top_m < rim_m;
    let beyond = |v: &&usize| axis.distance_m(&voxels.centres[**v]) > axis.radius_m + BESIDE_M;
    let is_object = !hangs && rest.iter().filter(beyond).count() >= SIDE_VOXELS;
    is_object || top_m > rim_m + APART_M
}

/// True if the side of the voxels is that of an upright round body.
fn is_round(voxels: &Voxels, body: &[usize], points: &[Point3<f64>], viewpoints: &[Point3<f64>]) -> bool {
    // A face on top would speak against a box as well as against a cup.
    let side: Vec<usize> = body.iter().copied().filter(|&v| is_upright(&voxels.normals[v])).collect();
    let points = voxels.points_of(&side, points);
    let heights = points.iter().map(|p| p.z).fold((f64::INFINITY, 0.0_f64), |(l, h), z| (l.min(z), h.max(z)));
    round_body(&points, heights.0, heights.1, viewpoints).is_some()
}

/// Hough votes of some voxels' sides for the axes of round bodies.
fn votes_of(voxels: &Voxels, of: &[usize]) -> Votes {
    let (low, high) = bounds(of.iter().map(|&v| voxels.centres[v].xy()));
    let low = [low.x, low.y].map(|c| cell_of(c - RADII_M.1) - 1);
    let high = [high.x, high.y].map(|c| cell_of(c + RADII_M.1) + 1);
    let some = |of: &[usize]| {
        let mut votes = Votes::over(low, high);
        of.iter().filter_map(|&v| voted_for(voxels, v)).for_each(|cells| votes.add(&cells));
        votes
    };
    let (first, second) = of.split_at(of.len() / 2);
    let (mut votes, more) = pool::join(|| some(first), || some(second));
    votes.join(&more);
    votes
}

/// Cells of the possible axes of a side voxel, by radius; `None` for other voxels.
fn voted_for(voxels: &Voxels, voxel: usize) -> Option<[[i32; 2]; RADII]> {
    let (place, normal) = (&voxels.centres[voxel], &voxels.normals[voxel]);
    is_upright(normal).then(|| {
        let across = normal.xy().normalize();
        std::array::from_fn(|k| {
            let r = RADII_M.0 + k as f64 * STEP_M;
            [place.x - across.x * r, place.y - across.y * r].map(cell_of)
        })
    })
}

fn cell_of(m: f64) -> i32 {
    floor(m * (1.0 / STEP_M) + 0.5)
}

/// An upright axis and a radius that a round body may have.
#[derive(Clone, Copy, Debug)]
struct Axis {
    x: f64,
    y: f64,
    radius_m: f64,
}

impl Axis {
    /// Axes with the most votes, best first.
    fn sought(votes: &Votes) -> Vec<Axis> {
        /// Maximum number of axes that are tried. From: chosen.
        const MOST: usize = 8;
        /// Number of own votes that a position and radius must exceed. From: chosen.
        const FEW: u16 = 3;
        /// Minimum distance between axes, in steps. From: chosen.
        const APART: f64 = 3.0;
        let mut cells = votes.peaks(FEW, SIDE_VOXELS as u32);
        cells.sort_unstable_by(|a, b| b.0.cmp(&a.0).then(a.1.cmp(&b.1)));
        let mut axes: Vec<Axis> = Vec::new();
        for (_, [i, j, k]) in cells {
            let axis = Axis {
                x: f64::from(i) * STEP_M,
                y: f64::from(j) * STEP_M,
                radius_m: RADII_M.0 + f64::from(k) * STEP_M,
            };
            let is_new = axes.iter().all(|a| (a.x - axis.x).hypot(a.y - axis.y) > APART * STEP_M);
            if axes.len() == MOST {
                break;
            }
            if is_new {
                axes.push(axis);
            }
        }
        axes
    }

    fn distance_m(&self, p: &Point3<f64>) -> f64 {
        distance(p.x - self.x, p.y - self.y)
    }

    /// Voxels (ascending) of the body about an axis: its side and its inside; `None` if the side is
    /// not seen from enough directions.
    fn body(&self, voxels: &Voxels, of: &[usize]) -> Option<Vec<usize>> {
        let near = |v: &usize| {
            is_upright(&voxels.normals[*v])
                && (self.distance_m(&voxels.centres[*v]) - self.radius_m).abs() < CLEAR_M
        };
        let faces = |v: &usize| {
            let (place, normal) = (&voxels.centres[*v], &voxels.normals[*v]);
            let away = Vector2::new(place.x - self.x, place.y - self.y);
            normal.xy().dot(&away).abs() > FACING * normal.xy().norm() * away.norm()
        };
        let (side, other): (Vec<usize>, Vec<usize>) = of.iter().copied().filter(near).partition(faces);
        if (side.len() as f64) < ROUND_SHARE * (side.len() + other.len()) as f64 {
            return None;
        }
        let mut tops = [f64::NEG_INFINITY; SECTORS];
        for &v in &side {
            let place = &voxels.centres[v];
            let top = &mut tops[sector(place.x - self.x, place.y - self.y)];
            *top = top.max(place.z);
        }
        let mut seen: Vec<f64> = tops.into_iter().filter(|top| top.is_finite()).collect();
        let wide = side.len() >= SIDE_VOXELS && seen.len() >= LEAST_SECTORS;
        // What it touches may be taller.
        let top_m = quantile(&mut seen, 0.5);
        let belongs = |v: &usize| {
            let place = &voxels.centres[*v];
            self.distance_m(place) < self.radius_m + CLEAR_M && place.z < top_m + CLEAR_M
        };
        wide.then(|| of.iter().copied().filter(belongs).collect())
    }

    /// True if the body's top continues into the remainder in many directions, so that the circle
    /// merely cuts the top of a low box.
    fn parts_a_top(&self, voxels: &Voxels, body: &[usize], left: &[Vec<usize>]) -> bool {
        let mut heights: Vec<f64> = body.iter().map(|&v| voxels.centres[v].z).collect();
        let top_m = quantile(&mut heights, VOXEL_ENDS.1);
        let is_top = |v: usize| {
            voxels.normals[v].z.abs() > LEVEL && (voxels.centres[v].z - top_m).abs() < CLEAR_M / 2.0
        };
        let runs_on = |v: usize| {
            let mut beside = voxels.neighbours(v).iter().map(|&n| n as usize);
            beside.any(|n| is_top(n) && body.binary_search(&n).is_ok())
        };
        let outline = left.iter().flatten().copied().filter(|&v| is_top(v) && runs_on(v));
        let direction = |v: usize| sector(voxels.centres[v].x - self.x, voxels.centres[v].y - self.y);
        let sectors: BTreeSet<usize> = outline.map(direction).collect();
        sectors.len() >= LEAST_SECTORS
    }
}

/// Minimum and maximum corner of the bounding box.
fn bounds(places: impl Iterator<Item = Point2<f64>> + Clone) -> (Point2<f64>, Point2<f64>) {
    let first = places.clone().next().unwrap_or_else(Point2::origin);
    places.fold((first, first), |(low, high), p| (low.inf(&p), high.sup(&p)))
}
