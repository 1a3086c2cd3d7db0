//! Floor that no laser sweep has passed over, where objects may stand.

use descry_perception::laser::Scan;
use descry_perception::nalgebra::{Point2, Vector2};
use descry_robots::OccupancyGrid;

/// Length at the end of a ray that does not count as free floor, metres.
const BEFORE_M: f64 = 0.05;
/// Maximum number of points whose visibility from a pose is tested.
const ASKED: usize = 200;

/// Floor not covered by any sweep.
#[derive(Clone, Default)]
pub struct UnseenFloor {
    grid: Option<OccupancyGrid>,
    /// For each cell, true if the map shows it free and no sweep has covered it.
    open: Vec<bool>,
}

impl UnseenFloor {
    /// Unseen floor before any sweep: all that the map shows as free.
    pub fn of(map: &OccupancyGrid) -> Self {
        UnseenFloor { open: map.occupied.iter().map(|taken| !taken).collect(), grid: Some(map.clone()) }
    }

    /// Marks the floor that a sweep passed over, up to `reach_m` metres.
    pub fn pass(&mut self, scan: &Scan, reach_m: f64) {
        let Some(grid) = &self.grid else { return };
        let from = scan.map_from_laser.translation.vector;
        let step_m = 0.5 * grid.resolution_m;
        for (angle, range) in scan.angles_rad.iter().zip(&scan.ranges_m) {
            if range.is_nan() || *range <= 0.0 {
                continue;
            }
            let along = scan.map_from_laser.rotation * Vector2::new(angle.cos(), angle.sin());
            let until_m = range.min(reach_m) - BEFORE_M;
            for k in 0..(until_m / step_m).max(0.0) as usize {
                if let Some((column, row)) = grid.cell(&Point2::from(from + along * (k as f64 * step_m))) {
                    self.open[row * grid.width + column] = false;
                }
            }
        }
    }

    /// Marks a disc of the floor as known, because a detected object stands there.
    pub fn know(&mut self, middle: &Point2<f64>, radius_m: f64) {
        let Some(grid) = &self.grid else { return };
        for (index, open) in self.open.iter_mut().enumerate() {
            *open &= (grid.centre(index % grid.width, index / grid.width) - middle).norm() > radius_m;
        }
    }

    /// Centres of the discs of this radius (metres) that no sweep has touched, so that an object may
    /// stand there.
    pub fn room_for(&self, radius_m: f64) -> Vec<Point2<f64>> {
        let Some(grid) = &self.grid else { return Vec::new() };
        let reach = (radius_m / grid.resolution_m).floor() as isize;
        let disc: Vec<(isize, isize)> = (-reach..=reach)
            .flat_map(|row| (-reach..=reach).map(move |column| (column, row)))
            .filter(|(column, row)| column * column + row * row <= reach * reach)
            .collect();
        let open = |column: isize, row: isize| {
            let inside =
                column >= 0 && row >= 0 && column < grid.width as isize && row < grid.height as isize;
            inside && self.open[row as usize * grid.width + column as usize]
        };
        let cells = (0..grid.height as isize).flat_map(|row| (0..grid.width as isize).map(move |c| (c, row)));
        cells
            .filter(|(column, row)| {
                open(*column, *row) && disc.iter().all(|(dc, dr)| open(column + dc, row + dr))
            })
            .map(|(column, row)| grid.centre(column as usize, row as usize))
            .collect()
    }

    /// True if a half-circle sweep from a place and heading would pass over one of the points `middles`,
    /// given the map and the objects `discs` (centre and radius).
    pub fn would_pass(
        &self,
        from: &Point2<f64>,
        heading: &Vector2<f64>,
        reach_m: f64,
        middles: &[Point2<f64>],
        discs: &[(Point2<f64>, f64)],
    ) -> bool {
        let Some(grid) = &self.grid else { return false };
        let blocked = |p: &Point2<f64>| {
            grid.is_occupied(p) || discs.iter().any(|(middle, radius_m)| (p - middle).norm() < *radius_m)
        };
        let seen = |p: &Point2<f64>| {
            let way = p - from;
            let steps = (way.norm() / grid.resolution_m).ceil().max(1.0);
            way.norm() < reach_m
                && way.dot(heading) > 0.0
                && (0..steps as usize).all(|k| !blocked(&(from + way * (k as f64 / steps))))
        };
        let every = middles.len().div_ceil(ASKED).max(1);
        middles.iter().step_by(every).any(seen)
    }
}
