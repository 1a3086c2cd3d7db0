//! Runs, plans and clouds to look at: pages that need nothing else, also while they go on, and drawings.

pub mod gantt;
pub mod live;
pub mod page;
pub mod picture;

/// Text for HTML and SVG.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
