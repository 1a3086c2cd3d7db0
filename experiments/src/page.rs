//! Self-contained HTML page of the results: tables, plots, the experiment's text, and how to reproduce it.

use descry_pages::escaped;
use descry_pages::live::FOLLOW;
use descry_pages::page::COLOURS;

use super::plot::Plot;
use super::table::Table;

const SCRIPT: &str = include_str!("live.js");

/// Section of the results: one element of the page.
#[derive(Debug, Clone, PartialEq)]
pub enum Section {
    /// A heading.
    Heading(String),
    /// A paragraph.
    Text(String),
    /// A table.
    Table(Table),
    /// A plot.
    Plot(Box<Plot>),
}

/// Facts at the top of the page: name and value.
pub type Facts = Vec<(&'static str, String)>;

const STYLE: &str = "
* { box-sizing: border-box; }
body { font: 15px/1.5 system-ui, sans-serif; color: var(--text); background: var(--ground); max-width: 100rem; margin: 2rem auto; padding: 0 1.5rem; }
h1 { margin-bottom: 0; } h2 { margin-top: 2.5rem; border-bottom: 1px solid var(--line); } h3 { margin: 1.8rem 0 .4rem; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: .2rem .5rem; text-align: left; border-bottom: 1px solid var(--line); vertical-align: top; } td { white-space: nowrap; }
td.t { white-space: normal; } td i { display: block; font-style: normal; font-size: 80%; color: var(--faint); }
th { border-bottom: 2px solid var(--faint); vertical-align: bottom; } th.n, td.n { text-align: right; } tbody tr:hover { background: var(--field); }
.scroll { overflow-x: auto; } .note { color: var(--faint); margin: .4rem 0 0; max-width: 60rem; } #live { color: var(--now); }
figure { margin: 1.2rem 0; } figure svg { display: block; width: 100%; max-width: 40rem; height: auto; } figure svg .paper { display: none; }
progress { width: 100%; accent-color: var(--done); }
pre { background: var(--field); padding: 1rem; overflow-x: auto; } dl { display: grid; grid-template-columns: max-content minmax(0, 1fr); gap: .1rem 1rem; }
dt { color: var(--faint); } dd { margin: 0; font-family: ui-monospace, monospace; font-size: 90%; overflow-wrap: anywhere; }
@media screen and (max-width: 600px) {
  body { padding: 0 .8rem; } dl { display: block; } thead { display: none; } table, tbody, tr, td { display: block; }
  tr { border-bottom: 2px solid var(--line); padding: .4rem 0; }
  td, td.n { display: flex; gap: .6rem; align-items: baseline; white-space: normal; text-align: right; border: 0; padding: .1rem 0; }
  td::before { content: attr(data-name); color: var(--faint); text-align: left; margin-right: auto; } td i { white-space: nowrap; }
}
@media screen and (prefers-color-scheme: dark) { figure svg { filter: invert(1) hue-rotate(180deg); } }
@media print {
  @page { size: A4 landscape; margin: 12mm; }
  :root { color-scheme: light; --ground: #fff; --text: #000; --faint: #555; --line: #ccc; --field: #f4f6f8; }
  body { font-size: 11px; margin: 0; padding: 0; max-width: none; } th, td { padding: .1rem .3rem; }
  .scroll, pre { overflow: visible; } pre { white-space: pre-wrap; } h2, h3 { break-after: avoid; } tr, figure { break-inside: avoid; } figure svg { max-width: 15cm; }
}
";

/// Progress of a batch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Progress {
    /// Number of finished jobs.
    pub done: usize,
    /// Number of all jobs.
    pub all: usize,
}

impl Progress {
    fn html(self) -> String {
        let Self { done, all } = self;
        format!(
            "<p id=\"live\">live</p>\n<progress max=\"{all}\" value=\"{done}\">{done} of {all} jobs</progress>\n"
        )
    }
}

/// HTML page of the results, or of a batch under way.
pub fn html(
    (title, about): (&str, &str),
    facts: &Facts,
    sections: &[Section],
    source: &str,
    progress: Option<Progress>,
) -> String {
    let script = progress.map_or(String::new(), |_| format!("<script>\n{FOLLOW}{SCRIPT}</script>\n"));
    let facts: String =
        facts.iter().map(|(name, value)| format!("<dt>{name}</dt><dd>{}</dd>\n", escaped(value))).collect();
    let body: String = sections.iter().map(section).collect();
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width\">\n\
         <title>{title}</title>\n<style>\n{COLOURS}{STYLE}</style>\n{script}</head>\n<body>\n<h1>{title}</h1>\n<p>{}</p>\n{}<dl>\n{facts}</dl>\n{body}\
         <h2>The experiment file</h2>\n<pre>{}</pre>\n</body>\n</html>\n",
        escaped(about),
        progress.map_or(String::new(), Progress::html),
        escaped(source),
        title = escaped(title),
    )
}

fn section(section: &Section) -> String {
    match section {
        Section::Heading(text) => format!("<h2>{}</h2>\n", escaped(text)),
        Section::Text(text) => format!("<p>{}</p>\n", escaped(text)),
        Section::Table(table) => format!("<div class=\"scroll\">{}</div>\n", table.html()),
        Section::Plot(plot) => format!("<figure>{}</figure>\n", plot.svg()),
    }
}

/// The tables as Markdown.
pub fn markdown(title: &str, facts: &Facts, sections: &[Section]) -> String {
    let mut text = format!("# {title}\n\n");
    facts.iter().for_each(|(name, value)| text += &format!("- {name}: {value}\n"));
    for section in sections {
        match section {
            Section::Heading(heading) => text += &format!("\n## {heading}\n"),
            Section::Text(paragraph) => text += &format!("\n{paragraph}\n"),
            Section::Table(table) => text += &format!("\n{}", table.markdown()),
            Section::Plot(plot) => text += &format!("\n![{}](plots/{}.svg)\n", plot.title(), plot.name()),
        }
    }
    text
}
