//! Self-contained HTML page of a run: map with route and views, plans next to their execution, confidence after each
//! observation, point clouds in 3-D, and the narration, all synchronised by one time slider.

mod live;
#[doc(hidden)]
pub mod points;
mod story;

use descry_memory::Record;

use crate::escaped;
use crate::live::FOLLOW;
use descry_agent::exit::CommandError;
use descry_agent::report::Report;
pub use live::Running;

const HTML: &str = include_str!("page/page.html");
/// Style sheet with the colours of every page, light and dark.
pub const COLOURS: &str = include_str!("page/colours.css");
const STYLE: &str = include_str!("page/page.css");
const SCRIPT: &str = include_str!("page/page.js");

/// Renders the page of a run from its record, with its report if the run has finished.
///
/// # Errors
/// [`CommandError::Broken`] if the record cannot be read.
pub fn of_run(record: &Record, report: Option<&Report>) -> Result<String, CommandError> {
    let story = story::of(record, report, &mut story::Looks::default())?;
    let told = serde_json::to_string(&story).map_err(|e| CommandError::Bug(e.to_string()))?;
    Ok(laid_out(&format!("descry: {}", story.goal), &told))
}

/// Renders the page around a story, given as JSON in `told`.
pub fn laid_out(title: &str, told: &str) -> String {
    let title = escaped(title);
    let (style, script) = ([COLOURS, STYLE].concat(), [FOLLOW, SCRIPT].concat());
    let parts = [("{{title}}", title.as_str()), ("{{style}}", &style), ("{{script}}", &script)];
    let page = parts.into_iter().fold(HTML.to_owned(), |page, (name, part)| page.replace(name, part));
    // Within a script nothing may look like markup: neither its end nor a comment that would hide it.
    page.replace("{{story}}", &told.replace('<', "\\u003c"))
}
