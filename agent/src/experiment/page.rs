//! The results as one page that needs nothing else: tables, plots, the experiment's text, and how to do it again.

use super::plot::Plot;
use super::table::{Table, escaped};

/// A part of the results as people read them.
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
body { font: 15px/1.5 system-ui, sans-serif; color: #1a1a1a; max-width: 76rem; margin: 2rem auto; padding: 0 1.5rem; }
h1 { margin-bottom: 0; } h2 { margin-top: 2.5rem; border-bottom: 1px solid #ccc; } h3 { margin: 1.8rem 0 .4rem; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: .2rem .8rem; text-align: left; border-bottom: 1px solid #e4e4e4; white-space: nowrap; }
th { border-bottom: 2px solid #888; } th.n, td.n { text-align: right; } tbody tr:hover { background: #f3f6fa; }
.scroll { overflow-x: auto; } .note { color: #555; margin: .4rem 0 0; max-width: 60rem; }
figure { margin: 1.2rem 0; } figure svg { max-width: 100%; height: auto; }
pre { background: #f6f6f6; padding: 1rem; overflow-x: auto; } dl { display: grid; grid-template-columns: max-content 1fr; gap: .1rem 1rem; }
dt { color: #555; } dd { margin: 0; font-family: ui-monospace, monospace; font-size: 90%; }
";

/// The page.
pub fn html(title: &str, about: &str, facts: &Facts, sections: &[Section], source: &str) -> String {
    let facts: String =
        facts.iter().map(|(name, value)| format!("<dt>{name}</dt><dd>{}</dd>\n", escaped(value))).collect();
    let body: String = sections.iter().map(section).collect();
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width\">\n\
         <title>{title}</title>\n<style>{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n<p>{}</p>\n<dl>\n{facts}</dl>\n{body}\
         <h2>The experiment file</h2>\n<pre>{}</pre>\n</body>\n</html>\n",
        escaped(about),
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

/// The tables alone, as Markdown.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_holds_everything_and_escapes_it() {
        let table = Table {
            title: "T".into(),
            head: vec!["a".into()],
            rows: vec![vec!["1".into()]],
            ..Table::default()
        };
        let sections = [Section::Heading("H & I".into()), Section::Table(table)];
        let page = html("<name>", "about", &vec![("hash", "h".into())], &sections, "a = \"<b>\"");
        for part in [
            "<h1>&lt;name&gt;</h1>",
            "<dd>h</dd>",
            "H &amp; I",
            "<td class=\"n\">1</td>",
            "a = &quot;&lt;b&gt;&quot;",
        ] {
            assert!(page.contains(part), "{part} is not in\n{page}");
        }
        assert!(!page.contains("src="), "a page stands alone");
    }
}
