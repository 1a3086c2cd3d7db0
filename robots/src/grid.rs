//! Occupancy grid of the floor.

use nalgebra::Point2;
use serde::{Deserialize, Serialize};

/// Free and occupied cells of the floor, in the map frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct OccupancyGrid {
    /// Side of a cell, metres.
    pub resolution_m: f64,
    /// Outer corner of cell (0, 0), metres.
    pub origin_m: Point2<f64>,
    /// Number of cells along x.
    pub width: usize,
    /// Number of cells along y.
    pub height: usize,
    /// Row by row (x fastest); true for occupied cells.
    pub occupied: Vec<bool>,
}

impl OccupancyGrid {
    /// Creates the smallest grid that covers the rectangle between two corners (map frame, metres), with all
    /// cells free.
    pub fn covering(low: Point2<f64>, high: Point2<f64>, resolution_m: f64) -> Self {
        let cells = |from: f64, to: f64| (((to - from) / resolution_m).ceil() as usize).max(1);
        let (width, height) = (cells(low.x, high.x), cells(low.y, high.y));
        OccupancyGrid { resolution_m, origin_m: low, width, height, occupied: vec![false; width * height] }
    }

    /// Column and row of the cell that holds a point; `None` for a point outside the grid.
    pub fn cell(&self, p: &Point2<f64>) -> Option<(usize, usize)> {
        let column = ((p.x - self.origin_m.x) / self.resolution_m).floor();
        let row = ((p.y - self.origin_m.y) / self.resolution_m).floor();
        let inside = column >= 0.0 && row >= 0.0 && column < self.width as f64 && row < self.height as f64;
        inside.then_some((column as usize, row as usize))
    }

    /// Centre of a cell, metres.
    pub fn centre(&self, column: usize, row: usize) -> Point2<f64> {
        Point2::new(
            self.origin_m.x + (column as f64 + 0.5) * self.resolution_m,
            self.origin_m.y + (row as f64 + 0.5) * self.resolution_m,
        )
    }

    /// True for an occupied cell, and for every point outside the grid.
    pub fn is_occupied(&self, p: &Point2<f64>) -> bool {
        self.cell(p).is_none_or(|(c, r)| self.occupied[r * self.width + c])
    }

    /// Marks as occupied the cells whose centres satisfy `inside`.
    pub fn occupy(&mut self, inside: impl Fn(&Point2<f64>) -> bool) {
        self.occupy_in([(0, self.width), (0, self.height)], inside);
    }

    /// Marks as occupied the cells whose centres satisfy `inside`, which must be false for points farther
    /// than `reach_m` from `middle`.
    pub fn occupy_near(&mut self, middle: &Point2<f64>, reach_m: f64, inside: impl Fn(&Point2<f64>) -> bool) {
        let span = |k: usize, size: usize| {
            let at = |p: f64| ((p - self.origin_m[k]) / self.resolution_m).clamp(0.0, size as f64);
            (at(middle[k] - reach_m).floor() as usize, at(middle[k] + reach_m).ceil() as usize)
        };
        self.occupy_in([span(0, self.width), span(1, self.height)], inside);
    }

    fn occupy_in(&mut self, [columns, rows]: [(usize, usize); 2], inside: impl Fn(&Point2<f64>) -> bool) {
        for row in rows.0..rows.1 {
            for column in columns.0..columns.1 {
                if inside(&self.centre(column, row)) {
                    self.occupied[row * self.width + column] = true;
                }
            }
        }
    }
}
