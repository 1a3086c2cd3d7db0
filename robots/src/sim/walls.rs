//! Walls of a flat: everything within its outline that is neither floor of a room nor opening of a door.

use crate::sim::scene::{Doorway, RoomSpec};
use nalgebra::{Point2, Point3};
use serde::{Deserialize, Serialize};

/// An axis-aligned box of wall.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Wall {
    /// Minimum corner, map frame, metres; above the floor for the lintel of a door.
    pub low: Point3<f64>,
    /// Maximum corner, map frame, metres.
    pub high: Point3<f64>,
}

impl Wall {
    /// True if the wall stands on the floor and contains a point of the floor, within a margin of `margin_m`.
    pub fn blocks(&self, p: &Point2<f64>, margin_m: f64) -> bool {
        let within = |k: usize| p[k] >= self.low[k] - margin_m && p[k] <= self.high[k] + margin_m;
        self.low.z <= 0.0 && within(0) && within(1)
    }
}

/// Distance below which two edges coincide, metres.
const SAME_EDGE_M: f64 = 1e-6;

/// Subdivision of the plane at every edge of a room or a door.
struct Cells {
    edges: [Vec<f64>; 2],
    /// Height of the wall's lower end above the floor for each cell, row by row, metres; `None` where there
    /// is no wall.
    from_m: Vec<Option<f64>>,
}

impl Cells {
    fn new(rooms: &[RoomSpec], doors: &[Doorway]) -> Cells {
        let edges = [0, 1].map(|k| {
            let of_rooms = rooms.iter().flat_map(|r| [r.low()[k], r.high()[k]]);
            let of_doors = doors.iter().flat_map(|d| [-1.0, 1.0].map(|s| d.centre_m[k] + s * d.half_m()[k]));
            let mut edges: Vec<f64> = of_rooms.chain(of_doors).collect();
            edges.sort_by(f64::total_cmp);
            edges.dedup_by(|a, b| *a - *b < SAME_EDGE_M);
            edges
        });
        let middle = |k: usize, i: usize| 0.5 * (edges[k][i] + edges[k][i + 1]);
        let (width, height) = (edges[0].len() - 1, edges[1].len() - 1);
        let from_m = (0..width * height).map(|cell| {
            let p = Point2::new(middle(0, cell % width), middle(1, cell / width));
            let opening = |d: &&Doorway| (0..2).all(|k| (p[k] - d.centre_m[k]).abs() < d.half_m()[k]);
            match doors.iter().find(opening) {
                _ if rooms.iter().any(|r| r.holds(&p, 0.0)) => None,
                Some(door) => Some(door.height_m),
                None => Some(0.0),
            }
        });
        Cells { from_m: from_m.collect(), edges }
    }

    fn width(&self) -> usize {
        self.edges[0].len() - 1
    }

    fn height(&self) -> usize {
        self.edges[1].len() - 1
    }

    /// Removes the block of equal cells that begins at a cell and grows to the right, then up. Returns the
    /// height of the wall's lower end, metres, and the column and row behind the block; `None` where there is
    /// no wall.
    fn take(&mut self, column: usize, row: usize) -> Option<(f64, [usize; 2])> {
        let from_m = self.from_m[row * self.width() + column]?;
        let same = |cells: &Cells, c: usize, r: usize| cells.from_m[r * cells.width() + c] == Some(from_m);
        let right = (column..self.width()).take_while(|&c| same(self, c, row)).last()? + 1;
        let full = |r: &usize| (column..right).all(|c| same(self, c, *r));
        let top = (row..self.height()).take_while(full).last()? + 1;
        let width = self.width();
        for r in row..top {
            self.from_m[r * width + column..r * width + right].fill(None);
        }
        Some((from_m, [right, top]))
    }
}

/// Walls between rooms, up to the height of the rooms' bounding rectangle. A single room has only the walls
/// of that rectangle.
pub fn walls(rooms: &[RoomSpec], doors: &[Doorway]) -> Vec<Wall> {
    if rooms.len() < 2 {
        return Vec::new();
    }
    let top_m = RoomSpec::around(rooms).wall_height_m;
    let mut cells = Cells::new(rooms, doors);
    let mut walls = Vec::new();
    for row in 0..cells.height() {
        for column in 0..cells.width() {
            if let Some((from_m, [right, top])) = cells.take(column, row)
                && from_m < top_m
            {
                let [x, y] = &cells.edges;
                walls.push(Wall {
                    low: Point3::new(x[column], y[row], from_m),
                    high: Point3::new(x[right], y[top], top_m),
                });
            }
        }
    }
    walls
}
