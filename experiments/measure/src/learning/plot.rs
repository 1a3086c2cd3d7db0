//! Pictures of models and plots of recognition against coverage.

use descry_perception::nalgebra::{Isometry3, Point3, Vector3};
use descry_perception::picture::{PictureOptions, png};
use descry_perception::{Cloud, View};
use std::fmt::Write;
use std::path::Path;

/// Picture of a cloud, coloured by label, from an eye to a target with an up direction.
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

/// A camera frame with models drawn at the answers' poses: green if right, red if wrong.
pub fn said(view: &View, answers: &[(&Cloud, Isometry3<f64>, bool)], path: &Path) -> Result<(), String> {
    let (Some(grid), Some(camera)) = (view.cloud.grid, view.intrinsics) else { return Ok(()) };
    let colours = view.cloud.colours.as_deref().unwrap_or_default();
    let mut image = image::RgbImage::from_fn(grid.width as u32, grid.height as u32, |u, v| {
        let i = v as usize * grid.width + u as usize;
        let known = view.cloud.points[i].z.is_finite().then(|| colours.get(i)).flatten();
        image::Rgb(known.copied().unwrap_or([18, 20, 26]))
    });
    for (model, world_from_model, right) in answers {
        let camera_from_model = view.world_from_camera.inverse() * world_from_model;
        let channel = usize::from(*right);
        for p in model.points.iter().step_by(3) {
            let q = camera_from_model * p.cast::<f64>();
            let Some(i) = camera.project(&q).and_then(|(u, v)| camera.pixel(u, v)) else { continue };
            image.get_pixel_mut((i % grid.width) as u32, (i / grid.width) as u32).0[channel] = 255;
        }
    }
    image.save(path).map_err(|e| format!("{}: {e}", path.display()))
}

/// Contact sheet of models in their own colours, from the front and from behind, as PNG.
pub fn sheet(models: &[&Cloud], path: &Path) -> Result<(), String> {
    const SIDE: u32 = 240;
    let columns = models.len().div_ceil(2) as u32;
    let mut image = image::RgbImage::from_pixel(columns * SIDE, 4 * SIDE, image::Rgb([18, 20, 26]));
    for (k, cloud) in models.iter().enumerate() {
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

/// Draws a cloud orthographically, the nearest point of each pixel in front.
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

/// Line of a panel: points (x, y) from 0 to 1, joined if there are several.
pub struct Line {
    pub dashed: bool,
    pub colour: &'static str,
    pub points: Vec<(f64, f64)>,
}

/// Panel of lines, with its name.
pub struct LinePlot {
    pub name: String,
    pub lines: Vec<Line>,
}

/// Colours of Okabe and Ito.
pub const BLUE: &str = "#0072B2";
pub const ORANGE: &str = "#D55E00";
pub const GREEN: &str = "#009E73";

const OPEN: &str = r#"<svg xmlns="http://www.w3.org/2000/svg" font-family="sans-serif" font-size="11""#;

/// Writes panels side by side, both axes from 0 to 1.
pub fn panels(panels: &[LinePlot], axes: (&str, &str), path: &Path) -> Result<(), String> {
    const COLUMNS: usize = 5;
    let (side, left, top, gap) = (160.0, 46.0, 24.0, (56.0, 62.0));
    let (columns, rows) = (panels.len().min(COLUMNS), panels.len().div_ceil(COLUMNS));
    let (width, height) = (columns as f64 * (side + gap.0) + 10.0, rows as f64 * (side + gap.1) + 6.0);
    let mut text = format!(
        r#"{OPEN} width="{width}" height="{height}" viewBox="0 0 {width} {height}"><rect width="100%" height="100%" fill="white"/>"#
    );
    for (k, panel) in panels.iter().enumerate() {
        let corner =
            (left + (k % COLUMNS) as f64 * (side + gap.0), top + (k / COLUMNS) as f64 * (side + gap.1));
        let at = |(x, y): (f64, f64)| (corner.0 + x * side, corner.1 + (1.0 - y) * side);
        for k in 0..=2 {
            let share = 0.5 * f64::from(k);
            let ((x0, y), (x1, _)) = (at((0.0, share)), at((1.0, share)));
            let (x, low) = at((share, 0.0));
            let _ = write!(
                text,
                r##"<line x1="{x0}" y1="{y}" x2="{x1}" y2="{y}" stroke="#ddd"/><text x="{}" y="{}" text-anchor="end">{share}</text><text x="{x}" y="{}" text-anchor="middle">{share}</text>"##,
                x0 - 5.0,
                y + 4.0,
                low + 14.0
            );
        }
        let ((x, high), (_, low)) = (at((0.5, 1.0)), at((0.5, 0.0)));
        let aside = corner.0 - 30.0;
        let _ = write!(
            text,
            r#"<text x="{x}" y="{}" text-anchor="middle" font-weight="bold">{}</text><text x="{x}" y="{}" text-anchor="middle">{}</text><text x="{aside}" y="{y}" transform="rotate(-90 {aside} {y})" text-anchor="middle">{}</text>"#,
            high - 8.0,
            panel.name,
            low + 29.0,
            axes.0,
            axes.1,
            y = 0.5 * (high + low)
        );
        for line in &panel.lines {
            let dash = if line.dashed { r#" stroke-dasharray="5 3""# } else { "" };
            let points: Vec<(f64, f64)> = line.points.iter().map(|p| at(*p)).collect();
            let path: Vec<String> = points.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
            let _ = write!(
                text,
                r#"<polyline points="{}" fill="none" stroke="{}" stroke-width="2"{dash}/>"#,
                path.join(" "),
                line.colour
            );
            for (x, y) in points {
                let _ = write!(text, r#"<circle cx="{x:.1}" cy="{y:.1}" r="3.2" fill="{}"/>"#, line.colour);
            }
        }
    }
    text.push_str("</svg>\n");
    std::fs::write(path, text).map_err(|e| format!("{}: {e}", path.display()))
}

/// Cross-section of a model: its name, and points in metres.
pub struct Slice {
    pub name: &'static str,
    pub points: Vec<(f32, f32)>,
}

/// Writes cross-sections side by side at one scale.
pub fn slices(cuts: &[Slice], path: &Path) -> Result<(), String> {
    const PER_M: f32 = 1150.0;
    let (wide, high) = (270.0, 150.0);
    let width = wide * cuts.len() as f32;
    let mut text = format!(
        r#"{OPEN} width="{width}" height="{}" viewBox="0 0 {width} {}"><rect width="100%" height="100%" fill="white"/>"#,
        high + 20.0,
        high + 20.0
    );
    for (k, cut) in cuts.iter().enumerate() {
        let middle = (wide * (k as f32 + 0.5), 20.0 + 0.5 * high);
        let _ = write!(
            text,
            r#"<text x="{}" y="14" text-anchor="middle" font-size="10">{}</text>"#,
            middle.0, cut.name
        );
        for (x, y) in &cut.points {
            let _ = write!(
                text,
                r##"<circle cx="{:.1}" cy="{:.1}" r="1" fill="#333"/>"##,
                middle.0 + PER_M * x,
                middle.1 - PER_M * y
            );
        }
    }
    text.push_str("</svg>\n");
    std::fs::write(path, text).map_err(|e| format!("{}: {e}", path.display()))
}

/// Writes a heat map of counts, each row normalised by its sum.
pub fn heat(counts: &[Vec<usize>], names: (&str, &str), path: &Path) -> Result<(), String> {
    let (rows, columns) = (counts.len(), counts.first().map_or(0, Vec::len));
    let cell = (620.0 / columns.max(1) as f64).min(26.0);
    let (left, top) = (30.0, 24.0);
    let (width, height) = (left + cell * columns as f64 + 6.0, top + cell * rows as f64 + 6.0);
    let mut text = format!(
        r#"{OPEN} width="{width}" height="{height}" viewBox="0 0 {width} {height}"><rect width="100%" height="100%" fill="white"/><text x="{left}" y="15">{}</text><text x="15" y="{top}" transform="rotate(-90 15 {top})" text-anchor="end">{}</text>"#,
        names.0, names.1
    );
    for (j, row) in counts.iter().enumerate() {
        let sum = row.iter().sum::<usize>().max(1) as f64;
        for (i, count) in row.iter().enumerate() {
            let (x, y) = (left + cell * i as f64, top + cell * j as f64);
            let light = (255.0 * (1.0 - *count as f64 / sum)) as u8;
            let _ = write!(
                text,
                r##"<rect x="{x:.1}" y="{y:.1}" width="{cell:.1}" height="{cell:.1}" fill="rgb({light},{light},255)" stroke="#e4e6ec" stroke-width=".5"/>"##
            );
        }
    }
    text.push_str("</svg>\n");
    std::fs::write(path, text).map_err(|e| format!("{}: {e}", path.display()))
}
