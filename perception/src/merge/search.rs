//! Step 4, first half: where the objects of a view fall best onto those of the others, before their distances can be trusted.
//!
//! With the table level, what localisation leaves open is a shift along the table and a turn about the vertical. Small objects far apart
//! give many wrong valleys to a local method; so the few degrees of freedom are searched on a grid, coarse to fine.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};
use rustc_hash::FxHashMap;

/// Fewest points off the planes for a search to mean something.
const FEWEST: usize = 60;
/// Points of the view that are tried against the others.
const TRIED: usize = 350;
/// Side of the coarse and fine cells, metres.
const CELLS_M: [f64; 2] = [0.03, 0.012];
/// Smallest share of points that must fall on the others' surfaces.
const LEAST_SHARE: f64 = 0.25;

/// What a correction at the edge of the window (three spreads of localisation) costs, as a share of the points.
const PRIOR: f64 = 0.15;

/// Surfaces of placed views in cells, with the sides they face.
struct Cells {
    side_m: f64,
    /// For each cell the sides present in it (low 6 bits) and in the cells around (next 6 bits).
    sides: FxHashMap<[i32; 3], u16>,
}

/// Sides that a normal faces: ±x, ±y, ±z.
fn sides(normal: &Vector3<f64>, least: f64) -> u16 {
    (0..3).fold(0, |bits, k| {
        bits | u16::from(normal[k] > least) << (2 * k) | u16::from(normal[k] < -least) << (2 * k + 1)
    })
}

impl Cells {
    fn new(points: &[(Point3<f64>, Vector3<f64>)], side_m: f64) -> Cells {
        let mut cells = Cells { side_m, sides: FxHashMap::default() };
        for (p, n) in points {
            let bits = sides(n, 0.3);
            *cells.sides.entry(cells.key(p)).or_default() |= bits;
        }
        let present: Vec<([i32; 3], u16)> = cells.sides.iter().map(|(k, b)| (*k, *b)).collect();
        for (key, bits) in present {
            for dx in -1..=1 {
                for dy in -1..=1 {
                    for dz in -1..=1 {
                        *cells.sides.entry([key[0] + dx, key[1] + dy, key[2] + dz]).or_default() |=
                            (bits & 0x3f) << 6;
                    }
                }
            }
        }
        cells
    }

    fn key(&self, p: &Point3<f64>) -> [i32; 3] {
        [p.x, p.y, p.z].map(|c| (c / self.side_m).floor() as i32)
    }

    /// 1 for a surface of that side in the cell, less beside it, 0 for none.
    fn hit(&self, p: &Point3<f64>, side: u16) -> f64 {
        match self.sides.get(&self.key(p)) {
            Some(bits) if bits & side != 0 => 1.0,
            Some(bits) if (bits >> 6) & side != 0 => 0.35,
            _ => 0.0,
        }
    }
}

/// How far off a view may be along the table and about the vertical.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    pub shift_m: f64,
    pub turn_rad: f64,
}

/// Where a view falls best.
#[derive(Clone, Copy, Debug)]
pub(super) struct Placed {
    /// World from world.
    pub correction: Isometry3<f64>,
    /// Share of its points that fall on the others' surfaces then.
    pub share: f64,
}

/// Share of the view's points that fall on the placed surfaces as they are.
pub(super) fn fits(
    view: &[(Point3<f64>, Vector3<f64>)],
    placed: &[(Point3<f64>, Vector3<f64>)],
    up: &Unit<Vector3<f64>>,
) -> f64 {
    let level = frame(up);
    let flat = |of: &[(Point3<f64>, Vector3<f64>)]| {
        of.iter().map(|(p, n)| (level * p, level * n)).collect::<Vec<_>>()
    };
    let (view, placed) = (flat(view), flat(placed));
    let stride = (view.len() / TRIED).max(1);
    let tried: Vec<_> = view.into_iter().step_by(stride).collect();
    if tried.is_empty() {
        return 0.0;
    }
    score(&Cells::new(&placed, CELLS_M[1]), &turned(&tried, &Vector3::zeros(), 0.0), 0.0, 0.0)
}

/// The correction (world from world) that puts `view` (points and normals off the planes, world frame) best onto `placed`.
/// `None` if there is too little to go by or nothing falls together.
pub(super) fn place(
    view: &[(Point3<f64>, Vector3<f64>)],
    placed: &[(Point3<f64>, Vector3<f64>)],
    up: &Unit<Vector3<f64>>,
    window: Window,
) -> Option<Placed> {
    if view.len() < FEWEST || placed.len() < FEWEST {
        return None;
    }
    let level = frame(up);
    let flat = |of: &[(Point3<f64>, Vector3<f64>)]| -> Vec<(Point3<f64>, Vector3<f64>)> {
        of.iter().map(|(p, n)| (level * p, level * n)).collect()
    };
    let placed = flat(placed);
    let stride = (view.len() / TRIED).max(1);
    let tried: Vec<(Point3<f64>, Vector3<f64>)> = flat(view).into_iter().step_by(stride).collect();
    let middle = tried.iter().fold(Vector3::zeros(), |m, (p, _)| m + p.coords) / tried.len() as f64;
    let mut best = [Candidate { x: 0.0, y: 0.0, turn: 0.0, score: 0.0 }; 3];
    for (stage, side_m) in CELLS_M.into_iter().enumerate() {
        let cells = Cells::new(&placed, side_m);
        let (shift, turn) = if stage == 0 { (window.shift_m, window.turn_rad) } else { (0.03, 0.027) };
        let turn_step = if stage == 0 { 0.03 } else { 0.009 };
        let mut found: Vec<Candidate> = Vec::new();
        let starts: &[Candidate] = if stage == 0 { &best[..1] } else { &best };
        for start in starts {
            let turns = (turn / turn_step).ceil() as i32;
            let shifts = (shift / side_m).ceil() as i32;
            for t in -turns..=turns {
                let angle = start.turn + f64::from(t) * turn_step;
                let turned = turned(&tried, &middle, angle);
                for i in -shifts..=shifts {
                    for j in -shifts..=shifts {
                        let (x, y) = (start.x + f64::from(i) * side_m, start.y + f64::from(j) * side_m);
                        let score = score(&cells, &turned, x, y)
                            - PRIOR * (x.hypot(y) / window.shift_m).powi(2)
                            - PRIOR * (angle / window.turn_rad).powi(2);
                        found.push(Candidate { x, y, turn: angle, score });
                    }
                }
            }
        }
        found.sort_by(|a, b| b.score.total_cmp(&a.score));
        best = distinct(&found, 2.0 * side_m);
    }
    let Candidate { x, y, turn: angle, score } = best[0];
    if score < LEAST_SHARE {
        return None;
    }
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
    let about = Translation3::from(middle) * turn * Translation3::from(-middle);
    let correction = Translation3::new(x, y, 0.0) * about;
    let costs = PRIOR * (x.hypot(y) / window.shift_m).powi(2) + PRIOR * (angle / window.turn_rad).powi(2);
    Some(Placed { correction: level.inverse() * correction * level, share: score + costs })
}

#[derive(Clone, Copy, Debug)]
struct Candidate {
    x: f64,
    y: f64,
    turn: f64,
    score: f64,
}

/// The three best that are not the same valley.
fn distinct(sorted: &[Candidate], apart: f64) -> [Candidate; 3] {
    let mut kept: Vec<Candidate> = Vec::with_capacity(3);
    for c in sorted {
        if kept.iter().all(|k| (k.x - c.x).hypot(k.y - c.y) > apart) {
            kept.push(*c);
            if kept.len() == 3 {
                break;
            }
        }
    }
    let first = kept[0];
    kept.resize(3, first);
    [kept[0], kept[1], kept[2]]
}

fn turned(
    points: &[(Point3<f64>, Vector3<f64>)],
    middle: &Vector3<f64>,
    angle: f64,
) -> Vec<(Point3<f64>, u16)> {
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), angle);
    points
        .iter()
        .map(|(p, n)| {
            let n = turn * n;
            let side = sides(&n, n.amax() - 1e-9);
            (Point3::from(turn * (p.coords - middle) + middle), side)
        })
        .collect()
}

fn score(cells: &Cells, points: &[(Point3<f64>, u16)], x: f64, y: f64) -> f64 {
    let shift = Vector3::new(x, y, 0.0);
    points.iter().map(|(p, side)| cells.hit(&(p + shift), *side)).sum::<f64>() / points.len() as f64
}

/// World to a frame with z up.
fn frame(up: &Unit<Vector3<f64>>) -> Isometry3<f64> {
    let turn = UnitQuaternion::rotation_between(up, &Vector3::z()).unwrap_or_else(|| {
        UnitQuaternion::from_matrix(&Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0)))
    });
    Isometry3::from_parts(Translation3::identity(), turn)
}
