#![doc = include_str!("../README.md")]

pub mod gantt;
pub mod live;
pub mod page;
pub mod picture;

/// Escapes text for HTML and SVG.
pub fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
