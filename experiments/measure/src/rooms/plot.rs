//! SVG plots: points from above, walls, and the grid.

use descry_perception::mapping::{RoomMap, Station, UprightCylinder};
use descry_perception::nalgebra::{Isometry2, Point2};
use descry_perception::occupancy::{Occupancy, Space};
use std::fmt::Write;
use std::path::Path;

/// Part of a floor plan, drawn to scale as SVG.
pub struct Sheet {
    low: Point2<f64>,
    high: Point2<f64>,
    /// Scale, pixels a metre.
    scale: f64,
    text: String,
}

/// Colours of Okabe and Ito.
const COLOURS: [&str; 7] = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#8A8A00"];

impl Sheet {
    pub fn new(low: Point2<f64>, high: Point2<f64>, scale: f64) -> Sheet {
        Sheet { low, high, scale, text: String::new() }
    }

    /// Sheet around points, with a margin.
    pub fn around(places: impl Iterator<Item = Point2<f64>>, scale: f64) -> Sheet {
        let (low, high) = places.fold(
            (Point2::new(f64::INFINITY, f64::INFINITY), Point2::new(f64::NEG_INFINITY, f64::NEG_INFINITY)),
            |(l, h), p| (l.inf(&p), h.sup(&p)),
        );
        let margin = descry_perception::nalgebra::Vector2::repeat(0.5);
        Sheet::new(low - margin, high + margin, scale)
    }

    /// Enlarges the margin by `by_m` metres.
    pub fn grown(mut self, by_m: f64) -> Sheet {
        let by = descry_perception::nalgebra::Vector2::repeat(by_m);
        (self.low, self.high) = (self.low - by, self.high + by);
        self
    }

    fn at(&self, p: &Point2<f64>) -> (f64, f64) {
        (self.scale * (p.x - self.low.x), self.scale * (self.high.y - p.y))
    }

    pub fn line(&mut self, a: &Point2<f64>, b: &Point2<f64>, style: &str) {
        let ((x, y), (u, v)) = (self.at(a), self.at(b));
        let _ = writeln!(self.text, r#"<line x1="{x:.1}" y1="{y:.1}" x2="{u:.1}" y2="{v:.1}" {style}/>"#);
    }

    fn square(&mut self, middle: &Point2<f64>, side_m: f64, colour: &str) {
        let (x, y) = self.at(middle);
        let side = self.scale * side_m;
        let (x, y) = (x - 0.5 * side, y - 0.5 * side);
        let _ = writeln!(
            self.text,
            r#"<rect x="{x:.1}" y="{y:.1}" width="{side:.1}" height="{side:.1}" fill="{colour}"/>"#
        );
    }

    /// Draws squares of 10 cm with points between floor and ceiling, darker with the number of stations that
    /// saw them.
    pub fn stations(&mut self, stations: &[Station], poses: &[Isometry2<f64>], far_m: f64) {
        let mut squares: std::collections::BTreeMap<(i32, i32), u32> = std::collections::BTreeMap::new();
        for (station, pose) in stations.iter().zip(poses) {
            for p in station.points.iter().filter(|p| p.z > 0.2 && p.z < 2.2 && f64::from(p.x) < far_m) {
                let at = pose * Point2::new(f64::from(p.x), f64::from(p.y));
                *squares.entry(((at.x * 10.0).floor() as i32, (at.y * 10.0).floor() as i32)).or_default() +=
                    1;
            }
        }
        for ((x, y), count) in squares.into_iter().filter(|(_, count)| *count >= 4) {
            let middle = Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5) * 0.1;
            let shade = 200_u32.saturating_sub(3 * count);
            self.square(&middle, 0.1, &format!("rgb({shade},{shade},{shade})"));
        }
    }

    pub fn grid(&mut self, grid: &Occupancy) {
        for (i, cell) in grid.cells.iter().enumerate() {
            let colour = match cell {
                Space::Unknown => continue,
                Space::Free => "#dcebf7",
                Space::Occupied => "#444444",
            };
            let square = descry_perception::nalgebra::Vector2::new(
                (i % grid.width) as f64 + 0.5,
                (i / grid.width) as f64 + 0.5,
            );
            self.square(&(grid.origin + square * grid.cell_m), grid.cell_m, colour);
        }
    }

    /// Draws walls in different colours, cylinders in one.
    pub fn upright(&mut self, map: &RoomMap) {
        for (i, wall) in map.walls.iter().enumerate() {
            let style = format!(r#"stroke="{}" stroke-width="2.5""#, COLOURS[i % COLOURS.len()]);
            for (a, b) in wall.feet() {
                self.line(&a, &b, &style);
            }
        }
        for (a, b) in map.cylinders.iter().flat_map(UprightCylinder::feet) {
            self.line(&a, &b, r##"stroke="#C00000" stroke-width="2.5""##);
        }
    }

    pub fn levels(&mut self, map: &RoomMap) {
        for level in map.levels.iter().filter(|l| l.faces_up && l.height_m > 0.3) {
            let n = level.outline.len();
            (0..n).for_each(|i| {
                self.line(
                    &level.outline[i],
                    &level.outline[(i + 1) % n],
                    r##"stroke="#009E73" stroke-width="1.5" stroke-dasharray="3 2""##,
                )
            });
        }
    }

    pub fn drive(&mut self, poses: &[Isometry2<f64>]) {
        for pair in poses.windows(2) {
            let [a, b] = [&pair[0], &pair[1]].map(|p| Point2::from(p.translation.vector));
            self.line(&a, &b, r##"stroke="#D55E00" stroke-width="1""##);
        }
    }

    fn panel(&self, left: f64, title: &str) -> String {
        format!(
            "<g transform=\"translate({left:.0} 0)\">\n{}<text x=\"8\" y=\"16\" font-family=\"sans-serif\" font-size=\"13\">{title}</text></g>\n",
            self.text
        )
    }

    fn size(&self) -> (f64, f64) {
        (self.scale * (self.high.x - self.low.x), self.scale * (self.high.y - self.low.y))
    }
}

/// Writes sheets side by side.
pub fn write(dir: &Path, name: &str, sheets: &[(&str, Sheet)]) -> Result<(), String> {
    std::fs::create_dir_all(dir).map_err(|e| format!("{}: {e}", dir.display()))?;
    let (mut body, mut left, mut height) = (String::new(), 0.0, 0.0_f64);
    for (title, sheet) in sheets {
        body += &sheet.panel(left, title);
        let size = sheet.size();
        left += size.0 + 10.0;
        height = height.max(size.1);
    }
    let text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{left:.0}\" height=\"{height:.0}\" viewBox=\"0 0 {left:.0} {height:.0}\">\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n{body}</svg>\n"
    );
    let path = dir.join(name);
    std::fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()))
}
