//! Pictures of models and plots of recognition against coverage.

use descry_perception::Cloud;
use descry_perception::nalgebra::{Point3, Vector3};
use descry_perception::picture::{PictureOptions, png};
use std::fmt::Write;
use std::path::Path;

/// A picture of a cloud, colours by label, from an eye to a target with a direction up.
pub fn picture(
    cloud: &Cloud,
    labels: &[u32],
    path: &Path,
    (eye, target, up): (Point3<f64>, Point3<f64>, Vector3<f64>),
) -> Result<(), String> {
    let options = PictureOptions {
        width: 640,
        height: 480,
        eye,
        target,
        up,
        point_m: 0.003,
        ..PictureOptions::default()
    };
    let bytes = png(cloud, labels, &options).map_err(|e| e.to_string())?;
    std::fs::write(path, bytes).map_err(|e| format!("{}: {e}", path.display()))
}

/// Models beside each other in their own colours, seen from the front and from behind, as a PNG.
pub fn sheet(models: &[(&str, &Cloud)], path: &Path) -> Result<(), String> {
    const SIDE: u32 = 240;
    let columns = models.len().div_ceil(2) as u32;
    let mut image = image::RgbImage::from_pixel(columns * SIDE, 4 * SIDE, image::Rgb([18, 20, 26]));
    for (k, (_, cloud)) in models.iter().enumerate() {
        let Some((low, high)) = cloud.bounds() else { continue };
        let middle = descry_perception::nalgebra::center(&low, &high).cast::<f64>();
        for (half, side) in [(0, 1.0), (1, -1.0)] {
            let away = Vector3::new(0.7 * side, -0.6 * side, 0.5).normalize();
            let corner = ((k as u32 % columns) * SIDE, (k as u32 / columns * 2 + half) * SIDE);
            draw(&mut image, cloud, &middle, &away, corner, SIDE);
        }
    }
    image.save(path).map_err(|e| format!("{}: {e}", path.display()))
}

/// Orthographic, least depth a pixel.
fn draw(
    image: &mut image::RgbImage,
    cloud: &Cloud,
    middle: &Point3<f64>,
    away: &Vector3<f64>,
    corner: (u32, u32),
    side: u32,
) {
    const PER_M: f64 = 650.0;
    let right = Vector3::z().cross(away).normalize();
    let up = away.cross(&right);
    let mut depths = vec![f64::NEG_INFINITY; (side * side) as usize];
    let none = [200, 200, 200];
    for (i, p) in cloud.points.iter().enumerate() {
        let off = p.cast::<f64>() - middle;
        let facing = cloud.normals.as_ref().map_or(1.0, |n| n[i].cast::<f64>().dot(away));
        if facing < 0.0 {
            continue;
        }
        let (x, y) = (off.dot(&right) * PER_M, -off.dot(&up) * PER_M);
        for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            let (u, v) = (0.5 * f64::from(side) + x + dx, 0.5 * f64::from(side) + y + dy);
            if u < 0.0 || v < 0.0 || u >= f64::from(side) || v >= f64::from(side) {
                continue;
            }
            let at = v as u32 * side + u as u32;
            if off.dot(away) > depths[at as usize] {
                depths[at as usize] = off.dot(away);
                let colour = cloud.colours.as_ref().map_or(none, |c| c[i]);
                let shade = |c: u8| (f64::from(c) * (0.6 + 0.4 * facing)) as u8;
                image.put_pixel(corner.0 + u as u32, corner.1 + v as u32, image::Rgb(colour.map(shade)));
            }
        }
    }
}

/// A line of a plot: its name and colour, and points (coverage, f-score).
pub struct Line {
    pub name: String,
    pub dashed: bool,
    pub colour: usize,
    pub points: Vec<(f64, f64)>,
}

/// Okabe and Ito.
const COLOURS: [&str; 7] = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#8A8A00"];

/// F-score against coverage, as Fig. 5.
pub fn curves(lines: &[Line], path: &Path) -> Result<(), String> {
    let (width, height, left, top) = (620.0, 420.0, 60.0, 30.0);
    let at = |(x, y): (f64, f64)| (left + x * width, top + (1.0 - y) * height);
    let mut text = String::from(
        r#"<svg xmlns="http://www.w3.org/2000/svg" width="900" height="520" font-family="sans-serif" font-size="13"><rect width="900" height="520" fill="white"/>"#,
    );
    for k in 0..=5 {
        let share = f64::from(k) / 5.0;
        let ((x0, y), (x1, _)) = (at((0.0, share)), at((1.0, share)));
        let (x, y1) = at((share, 0.0));
        let _ = write!(
            text,
            r##"<line x1="{x0}" y1="{y}" x2="{x1}" y2="{y}" stroke="#ddd"/><text x="{}" y="{}" text-anchor="end">{share:.1}</text><text x="{x}" y="{}" text-anchor="middle">{share:.1}</text>"##,
            x0 - 8.0,
            y + 4.0,
            y1 + 20.0
        );
    }
    let _ = write!(
        text,
        r#"<text x="{}" y="{}" text-anchor="middle">coverage of the model</text><text x="16" y="{}" transform="rotate(-90 16 {})" text-anchor="middle">f-score</text>"#,
        left + 0.5 * width,
        top + height + 42.0,
        top + 0.5 * height,
        top + 0.5 * height
    );
    for (k, line) in lines.iter().enumerate() {
        let colour = COLOURS[line.colour % COLOURS.len()];
        let dash = if line.dashed { r#" stroke-dasharray="6 4""# } else { "" };
        let points: Vec<String> =
            line.points.iter().map(|p| at(*p)).map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
        let _ = write!(
            text,
            r#"<polyline points="{}" fill="none" stroke="{colour}" stroke-width="2"{dash}/>"#,
            points.join(" ")
        );
        for p in &line.points {
            let (x, y) = at(*p);
            let _ = write!(text, r#"<circle cx="{x:.1}" cy="{y:.1}" r="3" fill="{colour}"/>"#);
        }
        let y = top + 16.0 * k as f64 + 10.0;
        let _ = write!(
            text,
            r#"<line x1="{0}" y1="{y}" x2="{1}" y2="{y}" stroke="{colour}" stroke-width="2"{dash}/><text x="{2}" y="{3}">{4}</text>"#,
            left + width + 12.0,
            left + width + 42.0,
            left + width + 48.0,
            y + 4.0,
            line.name
        );
    }
    text.push_str("</svg>\n");
    std::fs::write(path, text).map_err(|e| format!("{}: {e}", path.display()))
}
