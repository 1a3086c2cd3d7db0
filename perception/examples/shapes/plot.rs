//! Plots of aligned scans as Fig. 3 and 4, as SVG.

use super::lab::{INSTANCES, NAMES, Run, circled, four_legs, map_of_the_lab, object, seed_of};
use super::options;
use super::tabletop::Draws;
use super::variations::{FAR, by_icp};
use descry_perception::laser::{Alignment, PosedScan, ShapeModel, align};
use descry_perception::nalgebra::{Point2, Vector2};
use std::fmt::Write;
use std::path::Path;

/// Okabe and Ito.
const COLOURS: [&str; 8] =
    ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#8A8A00"];

/// A square of the plane around a centre, drawn at a place of the page.
struct Panel {
    left: f64,
    top: f64,
    side_m: f64,
    /// Pixels a metre.
    scale: f64,
    centre: Point2<f64>,
    text: String,
}

impl Panel {
    fn at(&self, p: &Point2<f64>) -> (f64, f64) {
        let off = p - self.centre;
        (
            self.left + self.scale * (0.5 * self.side_m + off.x),
            self.top + self.scale * (0.5 * self.side_m - off.y),
        )
    }

    fn line(&mut self, a: &Point2<f64>, b: &Point2<f64>, style: &str) {
        let ((x, y), (u, v)) = (self.at(a), self.at(b));
        let _ = writeln!(self.text, r#"<line x1="{x:.1}" y1="{y:.1}" x2="{u:.1}" y2="{v:.1}" {style}/>"#);
    }

    fn dot(&mut self, p: &Point2<f64>, colour: &str) {
        let (x, y) = self.at(p);
        let _ = writeln!(self.text, r#"<circle cx="{x:.1}" cy="{y:.1}" r="1.6" fill="{colour}"/>"#);
    }

    fn title(&mut self, text: &str) {
        let (x, y) = (self.left + 6.0, self.top + 14.0);
        let _ = writeln!(
            self.text,
            r#"<text x="{x}" y="{y}" font-family="sans-serif" font-size="12">{text}</text>"#
        );
    }

    /// Readings, and for each scan its pose and the rays that bound the thing.
    fn scans(&mut self, scans: &[PosedScan], rays: bool) {
        for (k, posed) in scans.iter().enumerate() {
            let colour = COLOURS[k % COLOURS.len()];
            let pose = &posed.model_from_laser;
            if rays {
                let style = format!(r#"stroke="{colour}" stroke-width="0.6""#);
                let from = pose * Point2::origin();
                for angle in [posed.scan.left_bound_rad, posed.scan.right_bound_rad] {
                    self.line(
                        &from,
                        &(pose * Point2::from(Vector2::new(angle.cos(), angle.sin()) * 2.6)),
                        &style,
                    );
                }
                let corners =
                    [(0.1, 0.0), (-0.05, 0.05), (-0.05, -0.05)].map(|(x, y)| pose * Point2::new(x, y));
                (0..3).for_each(|i| self.line(&corners[i], &corners[(i + 1) % 3], &style));
            }
            posed.scan.points.iter().for_each(|p| self.dot(&(pose * p), colour));
        }
    }
}

fn page(width: f64, height: f64, panels: &[Panel]) -> String {
    let body: String = panels.iter().map(|p| p.text.as_str()).collect();
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" viewBox=\"0 0 {width:.0} {height:.0}\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n{body}</svg>\n"
    )
}

/// Panels side by side, each of scans around the middle of their readings.
fn side_by_side(rows: &[(&str, Vec<PosedScan>)], side_m: f64, scale: f64, rays: bool) -> String {
    let panels: Vec<Panel> = rows
        .iter()
        .enumerate()
        .filter_map(|(i, (title, scans))| {
            let centre = ShapeModel::new(scans.clone()).ok()?.features().centre;
            let mut panel = Panel {
                left: scale * side_m * i as f64,
                top: 0.0,
                side_m,
                scale,
                centre,
                text: String::new(),
            };
            panel.scans(scans, rays);
            panel.title(title);
            Some(panel)
        })
        .collect();
    page(scale * side_m * rows.len() as f64, scale * side_m, &panels)
}

/// Fig. 4: every observation of every object, a column an object.
fn all_objects(learnt: &[Alignment]) -> String {
    const SIDE_M: f64 = 0.9;
    const SCALE: f64 = 220.0;
    let panel = |(i, alignment): (usize, &Alignment)| {
        let mut panel = Panel {
            left: SCALE * SIDE_M * (i / INSTANCES) as f64,
            top: SCALE * SIDE_M * (i % INSTANCES) as f64,
            side_m: SIDE_M,
            scale: SCALE,
            centre: alignment.model.features().centre,
            text: String::new(),
        };
        panel.scans(alignment.model.scans(), false);
        if i % INSTANCES == 0 {
            panel.title(NAMES[i / INSTANCES]);
        }
        panel
    };
    let panels: Vec<Panel> = learnt.iter().enumerate().map(panel).collect();
    page(SCALE * SIDE_M * NAMES.len() as f64, SCALE * SIDE_M * INSTANCES as f64, &panels)
}

/// Writes all plots into a folder.
pub fn write(seed: u64, learnt: &[Alignment], dir: &Path) -> Result<(), String> {
    std::fs::create_dir_all(dir).map_err(|e| format!("{}: {e}", dir.display()))?;
    let map = map_of_the_lab(&mut Draws(seed));
    let save = |name: &str, text: String| {
        let path = dir.join(name);
        std::fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()))
    };
    let chair = four_legs(45.0, 3.0);
    let things = [
        ("figure-3-big-chair", object(1), 1),
        ("figure-3-recycle-bin", object(0), 0),
        ("four-legs", chair, 0),
    ];
    for (name, outline, k) in things {
        let seen = circled(&outline, &Run::default(), &map, seed_of(seed, k, 0)).1.scans;
        let aligned = align(&seen, &options(0)).map_err(|e| e.to_string())?;
        let icp = by_icp(&seen, FAR);
        let rows = [("as localised", seen), ("aligned", aligned.model.scans().to_vec()), ("by ICP", icp)];
        save(&format!("{name}.svg"), side_by_side(&rows[..2], 4.2, 180.0, true))?;
        save(&format!("{name}-near.svg"), side_by_side(&rows, 1.2, 400.0, false))?;
    }
    save("figure-4.svg", all_objects(learnt))?;
    println!("plots written to {}\n", dir.display());
    Ok(())
}
