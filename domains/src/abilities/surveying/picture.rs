//! Top view of the map as a picture: open floor, walls, pillars, surfaces and viewpoints.

use std::io::Cursor;

use descry_perception::mapping::{RoomMap, UprightCylinder, Wall};
use descry_perception::nalgebra::{Point2, Vector2};
use descry_perception::occupancy::{Occupancy, Space};
use descry_robots::image::{ImageFormat, ImageResult, Rgb, RgbImage};

use super::chart::Chart;

/// Pixels per metre.
const SCALE: f64 = 40.0;
/// Maximum number of pixels along a side.
const MOST: f64 = 8000.0;
const UNKNOWN: [u8; 3] = [255, 255, 255];
const FREE: [u8; 3] = [220, 235, 247];
const OCCUPIED: [u8; 3] = [150, 150, 150];
const WALL: [u8; 3] = [0, 70, 140];
const CYLINDER: [u8; 3] = [190, 0, 0];
const SURFACE: [u8; 3] = [0, 140, 100];
const STOOD: [u8; 3] = [213, 94, 0];

struct Canvas {
    low: Point2<f64>,
    image: RgbImage,
}

impl Canvas {
    fn dot(&mut self, at: &Point2<f64>, radius: i64, colour: [u8; 3]) {
        let p = (at - self.low) * SCALE;
        let (width, height) = (i64::from(self.image.width()), i64::from(self.image.height()));
        for (dx, dy) in (-radius..=radius).flat_map(|x| (-radius..=radius).map(move |y| (x, y))) {
            let (x, y) = (p.x as i64 + dx, height - 1 - p.y as i64 + dy);
            if x >= 0 && y >= 0 && x < width && y < height {
                self.image.put_pixel(x as u32, y as u32, Rgb(colour));
            }
        }
    }

    fn line(&mut self, a: &Point2<f64>, b: &Point2<f64>, radius: i64, colour: [u8; 3]) {
        let steps = ((b - a).norm() * SCALE).ceil().max(1.0) as usize;
        (0..=steps).for_each(|k| self.dot(&(a + (b - a) * (k as f64 / steps as f64)), radius, colour));
    }
}

/// Picture of the grid's cells, to draw on.
fn ground(grid: &Occupancy) -> RgbImage {
    let cells = [grid.width, grid.cells.len() / grid.width.max(1)];
    let per_cell = SCALE * grid.cell_m;
    let [width, height] = cells.map(|n| (n as f64 * per_cell).ceil().clamp(1.0, MOST) as u32);
    RgbImage::from_fn(width, height, |x, y| {
        let at = Vector2::new(f64::from(x) + 0.5, f64::from(height - 1 - y) + 0.5) / SCALE;
        Rgb(match grid.at(&(grid.origin + at)) {
            Space::Unknown => UNKNOWN,
            Space::Free => FREE,
            Space::Occupied => OCCUPIED,
        })
    })
}

/// Draws the map as a PNG.
///
/// # Errors
///
/// If the picture cannot be encoded.
pub(super) fn png(chart: &Chart, map: &RoomMap) -> ImageResult<Vec<u8>> {
    let nothing = Occupancy { origin: Point2::origin(), cell_m: 1.0, width: 1, cells: vec![Space::Unknown] };
    let grid = map.grid.as_ref().unwrap_or(&nothing);
    let mut canvas = Canvas { low: grid.origin, image: ground(grid) };
    for (_, level) in &chart.surfaces {
        let n = level.outline.len();
        (0..n).for_each(|i| canvas.line(&level.outline[i], &level.outline[(i + 1) % n], 1, SURFACE));
    }
    map.walls.iter().flat_map(Wall::feet).for_each(|(a, b)| canvas.line(&a, &b, 1, WALL));
    let round = map.cylinders.iter().flat_map(UprightCylinder::feet);
    round.for_each(|(a, b)| canvas.line(&a, &b, 1, CYLINDER));
    for pair in chart.stood.windows(2) {
        canvas.line(&pair[0].translation.vector.into(), &pair[1].translation.vector.into(), 0, STOOD);
    }
    for pose in &chart.stood {
        let at = Point2::from(pose.translation.vector);
        canvas.dot(&at, 3, STOOD);
        canvas.line(&at, &(pose * Point2::new(0.3, 0.0)), 0, STOOD);
    }
    let mut bytes = Cursor::new(Vec::new());
    canvas.image.write_to(&mut bytes, ImageFormat::Png)?;
    Ok(bytes.into_inner())
}
