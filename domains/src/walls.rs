//! Occlusion by the walls of the map: a line of sight leads from room to room through open doors only.

use std::collections::BTreeSet;

use descry_robots::nalgebra::{Point2, Vector2};
use descry_robots::{Door, Room};

/// Distance from the end of a line of sight within which a wall does not block it, metres.
const BEFORE_M: f64 = 0.05;
/// Maximum thickness of a wall, metres: the distance of two rooms' outlines from the centre of the
/// door between them.
const THICK_M: f64 = 0.3;
/// Minimum side of a cell of the index, metres.
const CELL_M: f64 = 2.0;
/// Maximum number of cells along a side of the index.
const MOST_CELLS: f64 = 256.0;

/// Walls of a map in a spatial index: the cost of a line of sight depends on its length, not on the
/// map's size.
#[derive(Debug, Default)]
pub struct Walls {
    walls: Vec<Wall>,
    doors: Vec<Door>,
    low: Point2<f64>,
    cell_m: f64,
    /// Number of cells along each axis.
    size: [usize; 2],
    /// Indices of the walls whose bounding box touches each cell.
    cells: Vec<Vec<u32>>,
}

/// Side of a room's outline.
#[derive(Debug)]
struct Wall {
    from: Point2<f64>,
    to: Point2<f64>,
    /// Indices of doors that may lead through the wall.
    doors: Vec<usize>,
}

impl Walls {
    /// Walls of rooms, and the doors through them.
    pub fn new(rooms: &[Room], doors: &[Door]) -> Walls {
        let outlines = rooms.iter().map(|room| &room.outline_m).filter(|outline| outline.len() >= 3);
        let sides = outlines
            .flat_map(|corners| (0..corners.len()).map(|n| (corners[n], corners[(n + 1) % corners.len()])));
        let is_finite = |p: &Point2<f64>| p.x.is_finite() && p.y.is_finite();
        let walls: Vec<Wall> = sides
            .filter(|(from, to)| is_finite(from) && is_finite(to))
            .map(|(from, to)| Wall { from, to, doors: doors_near(doors, &from, &to) })
            .collect();
        let ends = || walls.iter().flat_map(|wall| [wall.from, wall.to]);
        let low = ends().reduce(|a, b| a.inf(&b)).unwrap_or_default();
        let extent = ends().reduce(|a, b| a.sup(&b)).unwrap_or_default() - low;
        let cell_m = CELL_M.max(extent.x.max(extent.y) / MOST_CELLS);
        let size = [extent.x, extent.y].map(|m| (m / cell_m) as usize + 1);
        let cells = vec![Vec::new(); size[0] * size[1]];
        let mut indexed = Walls { walls: Vec::new(), doors: doors.to_vec(), low, cell_m, size, cells };
        for (wall, n) in walls.iter().zip(0..) {
            for cell in indexed.cells_of(&wall.from, &wall.to) {
                indexed.cells[cell].push(n);
            }
        }
        Walls { walls, ..indexed }
    }

    /// True if the line between two points crosses a wall other than at a door that is not `shut`.
    pub fn stand_between(&self, shut: &BTreeSet<usize>, from: &Point2<f64>, to: &Point2<f64>) -> bool {
        let way = to - from;
        let far = way.norm() - BEFORE_M;
        let Some(ahead) = way.try_normalize(1e-9) else { return false };
        let crossing = |wall: &Wall| {
            let (a, side) = (wall.from, wall.to - wall.from);
            let turn = ahead.perp(&side);
            let (along, share) = ((a - from).perp(&side) / turn, (a - from).perp(&ahead) / turn);
            let is_met = turn != 0.0 && (0.0..=1.0).contains(&share) && (0.0..far).contains(&along);
            is_met.then(|| from + ahead * along)
        };
        let is_opaque = |&n: &u32| {
            let wall = &self.walls[n as usize];
            let open = || wall.doors.iter().filter(|door| !shut.contains(door));
            crossing(wall).is_some_and(|at| !open().any(|&door| leads_through(&self.doors[door], &at)))
        };
        !self.walls.is_empty() && self.cells_of(from, to).any(|cell| self.cells[cell].iter().any(is_opaque))
    }

    /// Cells that the bounding box of a segment touches.
    fn cells_of(&self, a: &Point2<f64>, b: &Point2<f64>) -> impl Iterator<Item = usize> + use<> {
        let cell = |at: f64, axis: usize| {
            let n = ((at - self.low[axis]) / self.cell_m).floor().clamp(0.0, self.size[axis] as f64 - 1.0);
            n as usize
        };
        let range = |axis: usize| cell(a[axis].min(b[axis]), axis)..=cell(a[axis].max(b[axis]), axis);
        let (columns, rows, width) = (range(0), range(1), self.size[0]);
        rows.flat_map(move |row| columns.clone().map(move |column| row * width + column))
    }
}

/// Indices of doors near enough to a wall to lead through it.
fn doors_near(doors: &[Door], a: &Point2<f64>, b: &Point2<f64>) -> Vec<usize> {
    let side = b - a;
    let distance_m = |door: &Door| {
        let share = (door.centre_m - a).dot(&side) / side.norm_squared().max(f64::MIN_POSITIVE);
        (door.centre_m - (a + side * share.clamp(0.0, 1.0))).norm()
    };
    let is_near = |door: &Door| distance_m(door) <= (door.width_m / 2.0).hypot(THICK_M) + BEFORE_M;
    (0..doors.len()).filter(|&n| is_near(&doors[n])).collect()
}

fn leads_through(door: &Door, at: &Point2<f64>) -> bool {
    let along = Vector2::new(door.along_rad.cos(), door.along_rad.sin());
    let aside = at - door.centre_m;
    aside.dot(&along).abs() <= door.width_m / 2.0 && aside.perp(&along).abs() <= THICK_M
}
