//! SVG plots: lines over a numeric axis, and dots by category. Axes have units, and intervals are bars.
//! Series differ in colour and shape, so that they are distinguishable without colour.

use std::fmt::Write;

use descry_pages::escaped;

#[doc(hidden)]
pub mod axis;

use axis::Scale;

/// Colours distinguishable with any colour vision (Okabe and Ito).
const COLOURS: [&str; 8] =
    ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#8A8A00"];
/// Width of a plot, pixels: its letters stay legible on a telephone.
const WIDTH: f64 = 480.0;
/// Margin on the right, pixels.
const RIGHT: f64 = 24.0;
/// Height of the axis's numbers and label, pixels.
const BOTTOM: f64 = 54.0;
/// Height of a row of the legend, and of a line of the title, pixels.
const ROW: f64 = 19.0;
/// Height of the strip of counts under a reliability plot, pixels.
const STRIP: f64 = 64.0;
/// Average width of a letter in the axes' text, pixels.
const LETTER: f64 = 6.6;
/// Average width of a letter in the title, pixels.
const TITLE_LETTER: f64 = 7.6;
/// Maximum number of letters in a line of a category's name.
const CATEGORY: usize = 20;

/// Point of a series: a measured value with its interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Position along the numeric axis of [`Plot::Lines`], or the index of the category in [`Plot::Dots`].
    pub at: f64,
    /// Measured value.
    pub value: f64,
    /// 95 % interval; `None` if unknown.
    pub interval: Option<[f64; 2]>,
}

/// Points of one series.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name of the series in the legend.
    pub name: String,
    /// Points, in the order in which a line joins them.
    pub points: Vec<Point>,
    /// True for a dashed line: a reference instead of a measurement.
    pub broken: bool,
}

/// Axis of a plot.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Label of the axis, with its unit.
    pub label: String,
    /// Fixed ends; `None`: from the data.
    pub range: Option<[f64; 2]>,
}

impl Axis {
    /// An axis with its ends from the data.
    pub fn free(label: impl Into<String>) -> Self {
        Self { label: label.into(), range: None }
    }

    /// An axis with fixed ends.
    pub fn fixed(label: impl Into<String>, from: f64, to: f64) -> Self {
        Self { label: label.into(), range: Some([from, to]) }
    }
}

/// Plot, drawn as SVG.
#[derive(Debug, Clone, PartialEq)]
pub enum Plot {
    /// Lines over a numeric axis.
    Lines {
        /// File name without its extension.
        name: String,
        /// Heading of the plot.
        title: String,
        /// Horizontal axis.
        x: Axis,
        /// Vertical axis.
        y: Axis,
        /// Lines of the plot, one for each series.
        series: Vec<Series>,
        /// True to draw the diagonal, the reference of a reliability plot.
        diagonal: bool,
        /// Counts for a strip below the plot: position along x, and number.
        counts: Vec<(f64, usize)>,
    },
    /// A dot with its interval for each category, the series beside each other.
    Dots {
        /// File name without its extension.
        name: String,
        /// Heading of the plot.
        title: String,
        /// Names of the categories, from the top.
        categories: Vec<String>,
        /// Horizontal axis of values.
        x: Axis,
        /// The dots; [`Point::at`] is the index of the category.
        series: Vec<Series>,
    },
}

impl Plot {
    /// File name without its extension.
    pub fn name(&self) -> &str {
        match self {
            Self::Lines { name, .. } | Self::Dots { name, .. } => name,
        }
    }

    /// Heading of the plot.
    pub fn title(&self) -> &str {
        match self {
            Self::Lines { title, .. } | Self::Dots { title, .. } => title,
        }
    }

    /// Renders the plot.
    pub fn svg(&self) -> String {
        match self {
            Self::Lines { title, x, y, series, diagonal, counts, .. } => {
                lines(title, x, y, series, *diagonal, counts)
            }
            Self::Dots { title, categories, x, series, .. } => dots(title, categories, x, series),
        }
    }
}

/// Sides of the plot's data area, pixels.
struct Frame {
    left: f64,
    top: f64,
    right: f64,
    bottom: f64,
}

#[doc(hidden)]
pub fn lines(
    title: &str,
    x: &Axis,
    y: &Axis,
    series: &[Series],
    diagonal: bool,
    counts: &[(f64, usize)],
) -> String {
    let strip = if counts.is_empty() { 0.0 } else { STRIP };
    let top = top(title);
    let frame = Frame { left: 62.0, top, right: WIDTH - RIGHT, bottom: top + 290.0 };
    let below = frame.bottom + BOTTOM + strip;
    let points = || series.iter().flat_map(|s| &s.points);
    let xs = Scale::new(x.range, points().map(|p| p.at), frame.left, frame.right);
    let ys = Scale::new(y.range, points().flat_map(extent), frame.bottom, frame.top);
    let mut svg = begin(title, below + ROW * legend(series).len() as f64);
    grid_across(&mut svg, &ys, &frame);
    for tick in xs.ticks() {
        let at = xs.at(tick);
        let _ = writeln!(
            svg,
            r##"<line x1="{at:.1}" y1="{:.1}" x2="{at:.1}" y2="{:.1}" stroke="#888"/>"##,
            frame.bottom,
            frame.bottom + 5.0
        );
        label(&mut svg, at, frame.bottom + 19.0, "middle", &xs.text(tick));
    }
    axis_lines(&mut svg, &frame);
    label(&mut svg, (frame.left + frame.right) / 2.0, frame.bottom + 40.0, "middle", &x.label);
    label_upright(&mut svg, 18.0, (frame.top + frame.bottom) / 2.0, &y.label);
    if diagonal {
        let (low, high) = (xs.low.max(ys.low), xs.high.min(ys.high));
        let _ = writeln!(
            svg,
            r##"<line x1="{:.1}" y1="{:.1}" x2="{:.1}" y2="{:.1}" stroke="#999" stroke-dasharray="5 4"/>"##,
            xs.at(low),
            ys.at(low),
            xs.at(high),
            ys.at(high)
        );
    }
    for (n, s) in series.iter().enumerate() {
        // Intervals of several lines at one place stand side by side.
        let aside = (n as f64 - (series.len() as f64 - 1.0) / 2.0) * 3.0;
        let placed: Vec<(f64, &Point)> = s.points.iter().map(|p| (xs.at(p.at) + aside, p)).collect();
        let path: Vec<String> =
            placed.iter().map(|(at, p)| format!("{at:.1},{:.1}", ys.at(p.value))).collect();
        let broken = if s.broken { r#" stroke-dasharray="6 4""# } else { "" };
        let _ = writeln!(
            svg,
            r#"<polyline points="{}" fill="none" stroke="{}" stroke-width="1.8"{broken}/>"#,
            path.join(" "),
            colour(n)
        );
        for (at, p) in placed {
            if let Some([low, high]) = p.interval {
                bar(&mut svg, (at, ys.at(low)), (at, ys.at(high)), colour(n));
            }
            mark(&mut svg, at, ys.at(p.value), n);
        }
    }
    if !counts.is_empty() {
        count_strip(&mut svg, &xs, &frame, counts);
    }
    draw_legend(&mut svg, below, series);
    svg + "</svg>\n"
}

#[doc(hidden)]
pub fn dots(title: &str, categories: &[String], x: &Axis, series: &[Series]) -> String {
    let categories: Vec<Vec<String>> = categories.iter().map(|name| wrapped(name, CATEGORY)).collect();
    let widest = categories.iter().flatten().map(|line| line.chars().count()).max().unwrap_or(0) as f64;
    let most_lines = categories.iter().map(Vec::len).max().unwrap_or(1) as f64;
    let row = (10.0 + 13.0 * most_lines.max(series.len() as f64)).max(26.0);
    let top = top(title);
    let bottom = top + row * categories.len().max(1) as f64;
    let frame = Frame { left: 24.0 + LETTER * widest, top, right: WIDTH - RIGHT, bottom };
    let named = if series.len() > 1 { series } else { &[] };
    let values = series.iter().flat_map(|s| &s.points).flat_map(extent);
    let xs = Scale::new(x.range, values, frame.left + 8.0, frame.right - 8.0);
    let mut svg = begin(title, bottom + BOTTOM + ROW * legend(named).len() as f64);
    for tick in xs.ticks() {
        let at = xs.at(tick);
        let _ = writeln!(
            svg,
            r##"<line x1="{at:.1}" y1="{:.1}" x2="{at:.1}" y2="{:.1}" stroke="#e2e2e2"/>"##,
            frame.top, frame.bottom
        );
        label(&mut svg, at, frame.bottom + 19.0, "middle", &xs.text(tick));
    }
    for (n, category) in categories.iter().enumerate() {
        let top = frame.top + row * n as f64;
        if n % 2 == 1 {
            let _ = writeln!(
                svg,
                r##"<rect x="{:.1}" y="{top:.1}" width="{:.1}" height="{row:.1}" fill="#000" fill-opacity=".035"/>"##,
                frame.left,
                frame.right - frame.left
            );
        }
        for (line, at) in category.iter().zip(0..) {
            let y = top + row / 2.0 + 4.0 + 13.0 * (f64::from(at) - (category.len() as f64 - 1.0) / 2.0);
            label(&mut svg, frame.left - 8.0, y, "end", line);
        }
    }
    axis_lines(&mut svg, &frame);
    label(&mut svg, (frame.left + frame.right) / 2.0, frame.bottom + 40.0, "middle", &x.label);
    for (n, s) in series.iter().enumerate() {
        let aside = (n as f64 - (series.len() as f64 - 1.0) / 2.0) * 13.0;
        for p in &s.points {
            let y = frame.top + row * (p.at + 0.5) + aside;
            if let Some([low, high]) = p.interval {
                bar(&mut svg, (xs.at(low), y), (xs.at(high), y), colour(n));
            }
            mark(&mut svg, xs.at(p.value), y, n);
        }
    }
    draw_legend(&mut svg, bottom + BOTTOM, named);
    svg + "</svg>\n"
}

fn extent(p: &Point) -> impl Iterator<Item = f64> + use<> {
    let [low, high] = p.interval.unwrap_or([p.value; 2]);
    [p.value, low, high].into_iter()
}

/// Splits a text into lines of at most this many letters, at its spaces.
fn wrapped(text: &str, most: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= most => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.into()),
        }
    }
    lines
}

fn title_lines(title: &str) -> Vec<String> {
    wrapped(title, ((WIDTH - 28.0) / TITLE_LETTER) as usize)
}

/// Upper end of the plot's data area, below the lines of the title, pixels.
fn top(title: &str) -> f64 {
    23.0 + ROW * title_lines(title).len() as f64
}

/// Start of the SVG text, with the title. The white background has the class `paper`, so that a page may
/// hide it.
fn begin(title: &str, height: f64) -> String {
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" height=\"{height}\" \
         font-family=\"system-ui, 'DejaVu Sans', Arial, sans-serif\" font-size=\"12\" fill=\"#1a1a1a\" role=\"img\">\n\
         <title>{0}</title>\n<rect class=\"paper\" width=\"{WIDTH}\" height=\"{height}\" fill=\"#fff\"/>\n",
        escaped(title)
    );
    for (line, n) in title_lines(title).iter().zip(0..) {
        let y = 22.0 + ROW * f64::from(n);
        let _ = writeln!(
            svg,
            r#"<text x="14" y="{y}" font-size="14" font-weight="600">{}</text>"#,
            escaped(line)
        );
    }
    svg
}

fn axis_lines(svg: &mut String, f: &Frame) {
    let _ = writeln!(
        svg,
        r##"<path d="M{:.1},{:.1} V{:.1} H{:.1}" fill="none" stroke="#888"/>"##,
        f.left, f.top, f.bottom, f.right
    );
}

fn grid_across(svg: &mut String, ys: &Scale, f: &Frame) {
    for tick in ys.ticks() {
        let at = ys.at(tick);
        let _ = writeln!(
            svg,
            r##"<line x1="{:.1}" y1="{at:.1}" x2="{:.1}" y2="{at:.1}" stroke="#e2e2e2"/>"##,
            f.left, f.right
        );
        label(svg, f.left - 8.0, at + 4.0, "end", &ys.text(tick));
    }
}

fn count_strip(svg: &mut String, xs: &Scale, f: &Frame, counts: &[(f64, usize)]) {
    let most = counts.iter().map(|(_, n)| *n).max().unwrap_or(1).max(1) as f64;
    let base = f.bottom + BOTTOM + STRIP - 6.0;
    label_upright(svg, 18.0, base - STRIP / 2.0 + 8.0, "count");
    for (at, n) in counts {
        let (x, tall) = (xs.at(*at), (STRIP - 26.0) * *n as f64 / most);
        let _ = writeln!(
            svg,
            r##"<rect x="{:.1}" y="{:.1}" width="26" height="{tall:.1}" fill="#bbb"/>"##,
            x - 13.0,
            base - tall
        );
        label(svg, x, base - tall - 4.0, "middle", &n.to_string());
    }
    let _ = writeln!(
        svg,
        r##"<line x1="{:.1}" y1="{base:.1}" x2="{:.1}" y2="{base:.1}" stroke="#888"/>"##,
        f.left, f.right
    );
}

/// Rows of the legend: indices of the series, each with its left end.
fn legend(series: &[Series]) -> Vec<Vec<(usize, f64)>> {
    let (mut rows, mut left) = (Vec::new(), WIDTH);
    for (n, s) in series.iter().enumerate() {
        let wide = 48.0 + LETTER * s.name.chars().count() as f64;
        if rows.is_empty() || left + wide > WIDTH {
            rows.push(Vec::new());
            left = 14.0;
        }
        rows.last_mut().into_iter().for_each(|row| row.push((n, left)));
        left += wide;
    }
    rows
}

fn draw_legend(svg: &mut String, top: f64, series: &[Series]) {
    for (row, at) in legend(series).iter().zip(0..) {
        let y = top + ROW * f64::from(at);
        for &(n, left) in row {
            let broken = if series[n].broken { r#" stroke-dasharray="6 4""# } else { "" };
            let _ = writeln!(
                svg,
                r#"<line x1="{left}" y1="{y}" x2="{}" y2="{y}" stroke="{}" stroke-width="1.8"{broken}/>"#,
                left + 24.0,
                colour(n)
            );
            mark(svg, left + 12.0, y, n);
            label(svg, left + 30.0, y + 4.0, "start", &series[n].name);
        }
    }
}

fn colour(n: usize) -> &'static str {
    COLOURS[n % COLOURS.len()]
}

fn label(svg: &mut String, x: f64, y: f64, anchor: &str, text: &str) {
    let _ = writeln!(svg, r#"<text x="{x:.1}" y="{y:.1}" text-anchor="{anchor}">{}</text>"#, escaped(text));
}

fn label_upright(svg: &mut String, x: f64, y: f64, text: &str) {
    let _ = writeln!(
        svg,
        r#"<text x="{x:.1}" y="{y:.1}" text-anchor="middle" transform="rotate(-90 {x:.1} {y:.1})">{}</text>"#,
        escaped(text)
    );
}

/// Draws an interval with end caps.
fn bar(svg: &mut String, (x1, y1): (f64, f64), (x2, y2): (f64, f64), colour: &str) {
    let (dx, dy) = if (x1 - x2).abs() > (y1 - y2).abs() { (0.0, 3.5) } else { (3.5, 0.0) };
    let cap = |x: f64, y: f64| format!("M{:.1},{:.1} L{:.1},{:.1}", x - dx, y - dy, x + dx, y + dy);
    let _ = writeln!(
        svg,
        r#"<path d="M{x1:.1},{y1:.1} L{x2:.1},{y2:.1} {} {}" stroke="{colour}" stroke-width="1.2" fill="none"/>"#,
        cap(x1, y1),
        cap(x2, y2)
    );
}

/// Draws the marker of a series: circle, square, triangle, diamond, each filled or hollow.
fn mark(svg: &mut String, x: f64, y: f64, n: usize) {
    let fill = if n % 8 < 4 { colour(n) } else { "#fff" };
    let style = format!(r#"fill="{fill}" stroke="{}" stroke-width="1.5""#, colour(n));
    let _ = match n % 4 {
        0 => writeln!(svg, r#"<circle cx="{x:.1}" cy="{y:.1}" r="3.8" {style}/>"#),
        1 => writeln!(svg, r#"<rect x="{:.1}" y="{:.1}" width="7" height="7" {style}/>"#, x - 3.5, y - 3.5),
        2 => writeln!(svg, r#"<path d="M{x:.1},{:.1} l4.6,8 h-9.2 z" {style}/>"#, y - 5.0),
        _ => writeln!(svg, r#"<path d="M{x:.1},{:.1} l4.6,4.6 l-4.6,4.6 l-4.6,-4.6 z" {style}/>"#, y - 4.6),
    };
}
