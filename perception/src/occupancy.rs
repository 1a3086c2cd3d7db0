//! Occupancy grid: a map as cells that are free, occupied or unknown.

use nalgebra::{Point2, Vector2};
use serde::{Deserialize, Serialize};

/// Content of a cell of a map.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Space {
    /// Not reliably observed.
    #[default]
    Unknown,
    /// Reliably empty.
    Free,
    /// Reliably occupied.
    Occupied,
}

/// Occupancy grid of the static environment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Occupancy {
    /// Corner of the grid with the least coordinates, in the map, metres.
    pub origin: Point2<f64>,
    /// Edge of a cell, metres.
    pub cell_m: f64,
    /// Number of cells along x.
    pub width: usize,
    /// Cells along x, row by row in ascending y; missing cells are unknown.
    pub cells: Vec<Space>,
}

impl Occupancy {
    /// Content of the cell at a place (map, metres); unknown outside the grid.
    pub fn at(&self, place: &Point2<f64>) -> Space {
        let cell = (place - self.origin) / self.cell_m;
        self.cell(cell.x.floor(), cell.y.floor())
    }

    fn cell(&self, column: f64, row: f64) -> Space {
        if column >= 0.0 && row >= 0.0 && column < self.width as f64 {
            let index = row as usize * self.width + column as usize;
            return self.cells.get(index).copied().unwrap_or_default();
        }
        Space::Unknown
    }

    /// True if a reading at a place may be of the environment: the place is not free, or an occupied cell is within
    /// `margin_m`.
    pub fn is_background(&self, place: &Point2<f64>, margin_m: f64) -> bool {
        if self.at(place) != Space::Free {
            return true;
        }
        let middle = (place - self.origin) / self.cell_m;
        let reach = margin_m / self.cell_m;
        let span = |c: f64, count: usize| {
            (c - reach).max(0.0) as usize..count.min(((c + reach).max(-1.0) + 1.0) as usize)
        };
        span(middle.y, self.cells.len() / self.width + 1).any(|row| {
            span(middle.x, self.width).any(|column| {
                let nearest = Vector2::new(
                    middle.x.clamp(column as f64, column as f64 + 1.0),
                    middle.y.clamp(row as f64, row as f64 + 1.0),
                );
                (nearest - middle).norm() <= reach && self.cell(column as f64, row as f64) == Space::Occupied
            })
        })
    }
}
