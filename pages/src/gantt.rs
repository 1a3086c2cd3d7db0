//! Gantt chart of a plan: a row for each step, ordered by start time.

use descry_planner::{Plan, Step};

use crate::escaped;

/// Width of the chart, pixels.
const WIDE: f64 = 1000.0;
/// Width of the column with the steps' names, pixels.
const NAMES: f64 = 300.0;
/// Height of a row, pixels.
const ROW: f64 = 22.0;
/// Maximum number of letters of a step's label; longer ones are cut.
const LETTERS: usize = 42;

/// Draws a plan as an SVG image. Steps of a plan without times last one unit each.
pub fn svg(plan: &Plan) -> String {
    let timed = plan.makespan_s();
    let begins = |n: usize, step: &Step| step.start_s.unwrap_or(n as f64);
    let lasts = |step: &Step| if timed.is_some() { step.duration_s } else { 1.0 };
    let mut steps: Vec<(f64, &Step)> =
        plan.steps.iter().enumerate().map(|(n, step)| (begins(n, step), step)).collect();
    steps.sort_by(|a, b| a.0.total_cmp(&b.0));
    let ends = steps.iter().map(|(from, step)| from + lasts(step)).fold(0.0, f64::max).max(1e-9);
    let x = |time: f64| NAMES + time / ends * (WIDE - NAMES - 20.0);
    let low = ROW * steps.len() as f64;
    let mut drawn = String::new();
    for (n, (from, step)) in steps.iter().enumerate() {
        let name = std::iter::once(&step.action).chain(&step.arguments);
        let name = format!("({})", name.map(String::as_str).collect::<Vec<_>>().join(" "));
        let short = match name.char_indices().nth(LETTERS) {
            Some((cut, _)) => format!("{}…", &name[..cut]),
            None => name.clone(),
        };
        let (y, wide) = (ROW * n as f64, (x(lasts(step)) - x(0.0)).max(2.0));
        drawn += &format!(
            "<g><title>{}</title><text x=\"0\" y=\"{:.0}\">{}</text>\
             <rect x=\"{:.1}\" y=\"{:.0}\" width=\"{wide:.1}\" height=\"{:.0}\" rx=\"2\" fill=\"#2f6db3\"/></g>\n",
            escaped(&format!("{name} from {from:.3} for {:.3}", lasts(step))),
            y + 15.0,
            escaped(&short),
            x(*from),
            y + 4.0,
            ROW - 8.0,
        );
    }
    for part in [0.0, 0.25, 0.5, 0.75, 1.0] {
        let (time, at) = (part * ends, x(part * ends));
        let text = if timed.is_some() { format!("{time:.1}") } else { format!("{time:.0}") };
        drawn += &format!(
            "<line x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"0\" y2=\"{low:.0}\" stroke=\"#8a8f98\" stroke-opacity=\".4\"/>\
             <text x=\"{at:.1}\" y=\"{:.0}\" text-anchor=\"middle\">{text}</text>\n",
            low + 18.0,
        );
    }
    let high = low + 26.0;
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDE} {high}\" width=\"{WIDE}\" height=\"{high}\">\n\
         <style>text {{ font: 12px system-ui, sans-serif; fill: #777 }}</style>\n{drawn}</svg>\n"
    )
}
