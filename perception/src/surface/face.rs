//! Connected parts of a plane, each with its convex hull.

use super::connected::parts;
use super::extent::{Hiding, Owner, Owners, around};
use super::level::{Role, Sign, Surface};
use super::planes::{FEWEST, Plane, least_squares};
use super::sample::Sample;
use super::tiles::Tiles;
use crate::cloud::Cloud;
use crate::polygon::{area, convex_hull};
use crate::scale::{APART_M, SHAPE_M, floor};
use crate::visibility::Visibility;
use nalgebra::{Point3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};

/// Cell size for connecting a plane's points, metres. From: chosen.
const CELL_M: f64 = 0.03;
/// Minimum mean number of samples per cell of a wide plane; with fewer, its cells are wider.
/// From: chosen.
const FULL: f64 = 2.0;
/// Number of cells of a plane below which the cells are made smaller in any case. From: chosen.
const MANY: f64 = 1000.0;
/// Maximum side of a cell, metres. From: chosen.
const WIDEST_CELL_M: f64 = 4.0 * CELL_M;
/// Minimum number of samples of a piece of a plane. From: chosen.
const FEWEST_OF_PIECE: u32 = 5;

/// Connected parts of a plane by decreasing returns; empty if no camera is above.
pub(super) fn faces(plane: &Plane, samples: &[Sample], cloud: &Cloud, seen: &Visibility) -> Vec<Surface> {
    let viewpoints = seen.viewpoints();
    if !viewpoints.is_empty() && viewpoints.iter().all(|v| plane.distance(v) < APART_M) {
        return Vec::new();
    }
    let (mut held, mut beside, mut squares) = (Vec::with_capacity(samples.len()), Vec::new(), 0.0);
    for s in samples {
        let (distance_m, band_m) = (plane.distance(&s.point), Plane::band_m(s));
        if distance_m.abs() <= band_m {
            held.push(s);
            squares += distance_m * distance_m;
        } else if distance_m.abs() <= 2.0 * band_m {
            beside.push((s, usize::from(distance_m > 0.0)));
        }
    }
    let grid = Grid::filled_by(plane, &held);
    let held: Vec<([i32; 2], &Sample)> = held.into_iter().map(|s| (grid.cell_of(&s.point), s)).collect();
    let mut counts: Tiles<Counts> = Tiles::new();
    held.iter().for_each(|(cell, _)| counts.at(*cell).near += 1);
    beside.iter().for_each(|(s, side)| counts.at(grid.cell_of(&s.point)).beside[*side] += 1);
    let cells = counts.all();
    let mut beneath: Tiles<bool> = Tiles::new();
    let rising = cells.iter().filter(|(_, counts)| counts.beside[1] > 0);
    rising.flat_map(|(cell, _)| around(*cell)).for_each(|cell| *beneath.at(cell) = true);
    let is_face = |cell: [i32; 2]| {
        let all = || around(cell).map(|cell| counts.get(cell)).fold(Counts::default(), Counts::with);
        // Both need something above the plane.
        !beneath.get(cell) || (!all().is_slice() && !all().is_foot())
    };
    let near = cells.into_iter().filter(|(cell, counts)| counts.near > 0 && is_face(*cell));
    let mut pieces = parts(near.map(|(cell, counts)| (cell, counts.near)).collect());
    let residual_m = (squares / held.len().max(1) as f64).sqrt();
    let all =
        |cells: &[[i32; 2]]| cells.iter().map(|cell| counts.get(*cell)).fold(Counts::default(), Counts::with);
    pieces.retain(|cells| {
        let all = all(cells);
        all.near >= FEWEST_OF_PIECE && !all.is_slice()
    });
    let mut parts = joined(pieces, &Hiding::of(plane, &grid, seen));
    parts.sort_by_cached_key(|cells| std::cmp::Reverse(all(cells).near));
    let part_of = owners(&parts);
    let mut members: Vec<Vec<&Sample>> = vec![Vec::new(); parts.len()];
    for (cell, s) in held {
        if let Owner::Part(part) = part_of.get(cell) {
            members[part as usize].push(s);
        }
    }
    let scale = (cloud.len() as f64 / samples.len().max(1) as f64).max(1.0);
    let surface = |(n, (cells, members)): (usize, (&Vec<[i32; 2]>, &Vec<&Sample>))| {
        if n > 0 && members.len() < FEWEST {
            return None;
        }
        // The plane is the largest part's; another may lie a little off it, and then has one of its own.
        let mean = members.iter().map(|s| plane.distance(&s.point)).sum::<f64>() / members.len() as f64;
        let own = (n > 0 && mean.abs() > SHAPE_M)
            .then(|| least_squares(members.iter().copied(), &plane.normal))
            .flatten();
        let hull = hull_of(cells, grid.side_m);
        let own_plane = own.unwrap_or(*plane);
        let surface =
            || Surface { residual_m, ..face(&own_plane, plane, &hull, members, scale, samples.len()) };
        (hull.len() >= 3).then(surface)
    };
    parts.iter().zip(&members).enumerate().filter_map(surface).collect()
}

/// Part of each cell.
fn owners(parts: &[Vec<[i32; 2]>]) -> Owners {
    let mut owners = Owners::new();
    let all = parts.iter().enumerate().flat_map(|(n, part)| part.iter().map(move |cell| (*cell, n)));
    all.for_each(|(cell, n)| *owners.at(cell) = Owner::Part(n as u32));
    owners
}

/// Parts of a plane joined where they connect behind and beneath occluders.
fn joined(parts: Vec<Vec<[i32; 2]>>, hiding: &Hiding) -> Vec<Vec<[i32; 2]>> {
    let meeting = match parts.len() {
        0 | 1 => return parts,
        _ => hiding.spread(&mut owners(&parts), parts.concat(), false),
    };
    let mut of: Vec<usize> = (0..parts.len()).collect();
    for [a, b] in meeting {
        let (a, b) = (of[a as usize], of[b as usize]);
        of.iter_mut().filter(|part| **part == a.max(b)).for_each(|part| *part = a.min(b));
    }
    let mut whole = vec![Vec::new(); parts.len()];
    parts.into_iter().zip(of).for_each(|(part, n)| whole[n].extend(part));
    whole.retain(|part| !part.is_empty());
    whole
}

/// Numbers of samples near a plane.
#[derive(Clone, Copy, Default)]
struct Counts {
    /// Number of samples on the plane, within the measurement error.
    near: u32,
    /// Number of samples below and above the plane, up to twice the measurement error away.
    beside: [u32; 2],
}

impl Counts {
    fn with(self, other: Counts) -> Counts {
        let beside = [0, 1].map(|side| self.beside[side] + other.beside[side]);
        Counts { near: self.near + other.near, beside }
    }

    /// True if the plane cuts a wall or clutter: as many samples lie on either side as near it.
    fn is_slice(&self) -> bool {
        /// Minimum number of samples beside the plane, on the side with fewer, as a share of those
        /// on the plane, for the plane to cut a body; a body gives a half. From: chosen, less than
        /// that half.
        const SHARE: f64 = 0.2;
        f64::from(self.beside[0].min(self.beside[1])) > SHARE * f64::from(self.near)
    }

    /// True if the plane is merely the foot of something upright: a wall has half as many samples
    /// above as near.
    fn is_foot(&self) -> bool {
        /// Minimum number of samples above the plane, as a share of those on the plane, for
        /// something upright to begin there; a wall gives a half. From: chosen, less than that
        /// half.
        const SHARE: f64 = 0.35;
        f64::from(self.beside[1]) > SHARE * f64::from(self.near)
    }
}

/// Corners of the convex hull around cells, metres.
fn hull_of(cells: &[[i32; 2]], side_m: f64) -> Vec<[f64; 2]> {
    // What lies between two of one column is no corner.
    let columns = cells.chunk_by(|a, b| a[0] == b[0] && a[1] < b[1]);
    let ends = columns.flat_map(|column| [column[0], [column[0][0], column[column.len() - 1][1] + 1]]);
    let corners = ends.flat_map(|[x, y]| [[x, y], [x + 1, y]]);
    convex_hull(corners.map(|cell| cell.map(|at| f64::from(at) * side_m)).collect())
}

/// A plane divided into square cells.
pub(super) struct Grid {
    /// Rotation from the world that turns the plane's normal into z.
    pub turn: UnitQuaternion<f64>,
    /// Side of a cell, metres.
    pub side_m: f64,
    /// The two axes of the grid along the plane, in the world.
    axes: [Vector3<f64>; 2],
}

impl Grid {
    /// Finest grid of a plane.
    pub fn fine(plane: &Plane) -> Grid {
        let turn = level(plane);
        let axes = [Vector3::x(), Vector3::y()].map(|axis| turn.inverse() * axis);
        Grid { turn, side_m: CELL_M, axes }
    }

    /// Finest grid whose cells the plane's samples fill.
    fn filled_by(plane: &Plane, held: &[&Sample]) -> Grid {
        /// Stride of the samples that are enough for the widest cells. From: work.
        const STRIDE: usize = 4;
        /// Number of cells in a cell of twice the width. From: derived, two along each side.
        const QUARTERS: f64 = 4.0;
        let mut grid = Grid { side_m: WIDEST_CELL_M, ..Grid::fine(plane) };
        let (mut seen, mut cells) = (Tiles::new(), 0.0);
        for s in held.iter().step_by(STRIDE) {
            let is_seen: &mut bool = seen.at(grid.cell_of(&s.point));
            cells += if *is_seen { 0.0 } else { 1.0 };
            *is_seen = true;
        }
        while grid.side_m > CELL_M && (cells < MANY || held.len() as f64 >= QUARTERS * cells * FULL) {
            grid.side_m /= 2.0;
            cells *= QUARTERS;
        }
        grid
    }

    /// Cell of a point.
    pub fn cell_of(&self, p: &Point3<f64>) -> [i32; 2] {
        let per_m = 1.0 / self.side_m;
        self.axes.each_ref().map(|axis| floor(axis.dot(&p.coords) * per_m))
    }
}

/// Rotation that turns the normal of a plane into z.
fn level(plane: &Plane) -> UnitQuaternion<f64> {
    UnitQuaternion::rotation_between(&plane.normal, &Vector3::z()).unwrap_or_else(|| {
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_axis_angle(
            &Vector3::x_axis(),
            std::f64::consts::PI,
        ))
    })
}

/// Surface of a plane, with a hull found in the nearly equal plane `found_in`; `scale`: cloud
/// points per sample, `of`: number of all samples.
fn face(
    plane: &Plane,
    found_in: &Plane,
    hull: &[[f64; 2]],
    members: &[&Sample],
    scale: f64,
    of: usize,
) -> Surface {
    let up = Unit::new_normalize(plane.normal);
    let n = hull.len() as f64;
    let middle = hull.iter().fold([0.0, 0.0], |m, c| [m[0] + c[0], m[1] + c[1]]).map(|c| c / n);
    let lift = level(found_in).inverse();
    let onto = |[x, y]: [f64; 2]| {
        let p = lift * Point3::new(x, y, found_in.offset);
        p - plane.normal * plane.distance(&p)
    };
    let turn = level(plane);
    let surface_from_world = Translation3::from(-(turn * onto(middle)).coords) * turn;
    Surface {
        up,
        offset_m: plane.offset,
        hull: hull.iter().map(|c| onto(*c)).collect(),
        area_m2: area(hull),
        points: (members.len() as f64 * scale) as usize,
        share: members.len() as f64 / of.max(1) as f64,
        residual_m: 0.0,
        surface_from_world,
        role: Role::Untold,
        because: Sign::NoCamera,
        above_floor_m: None,
        up_chance: 1.0,
        over: Vec::new(),
    }
}
