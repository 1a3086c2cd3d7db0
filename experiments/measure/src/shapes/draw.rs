//! SVG drawings of scans and models.

use descry_perception::laser::{PosedScan, ShapeModel};
use descry_perception::nalgebra::{Point2, Vector2};
use std::fmt::Write;

/// Colours of Okabe and Ito.
const COLOURS: [&str; 8] =
    ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#8A8A00"];

/// Square section of the plane around a centre, drawn at a position on the page.
pub struct Panel {
    pub left: f64,
    pub top: f64,
    pub side_m: f64,
    /// Scale, pixels a metre.
    pub scale: f64,
    pub centre: Point2<f64>,
    pub text: String,
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

    pub fn title(&mut self, text: &str) {
        let (x, y) = (self.left + 6.0, self.top + 14.0);
        let _ = writeln!(
            self.text,
            r#"<text x="{x}" y="{y}" font-family="sans-serif" font-size="12">{text}</text>"#
        );
    }

    /// Draws readings, and for each scan its pose and the rays that bound the object.
    pub fn scans(&mut self, scans: &[PosedScan], rays: bool) {
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

pub fn page(width: f64, height: f64, panels: &[Panel]) -> String {
    let body: String = panels.iter().map(|p| p.text.as_str()).collect();
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width:.0}\" height=\"{height:.0}\" viewBox=\"0 0 {width:.0} {height:.0}\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n{body}</svg>\n"
    )
}

/// Panels side by side, each of scans around the centre of their readings.
pub fn side_by_side(rows: &[(&str, Vec<PosedScan>)], side_m: f64, scale: f64, rays: bool) -> String {
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
