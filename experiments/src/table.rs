//! Tables as aligned Markdown and as HTML.

use descry_pages::escaped;

use super::statistics::Estimate;

/// A table with its heading.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Table {
    /// Heading of the table.
    pub title: String,
    /// Note below the table: meaning of its numbers and intervals.
    pub note: String,
    /// Column names, with units.
    pub head: Vec<String>,
    /// Cells, row by row.
    pub rows: Vec<Vec<String>>,
}

impl Table {
    /// Table without rows, with the names of its columns in `head`.
    pub fn new(title: impl Into<String>, note: impl Into<String>, head: &[&str]) -> Self {
        let head = head.iter().map(ToString::to_string).collect();
        Self { title: title.into(), note: note.into(), head, rows: Vec::new() }
    }

    /// Renders the table as aligned Markdown.
    pub fn markdown(&self) -> String {
        let columns = 0..self.head.len();
        let cell =
            |row: &[String], c: usize| row.get(c).map_or(String::new(), |text| text.replace('|', "\\|"));
        let widths: Vec<usize> = columns
            .map(|c| {
                let below = self.rows.iter().map(|row| cell(row, c).chars().count());
                below.chain([self.head[c].chars().count(), 3]).max().unwrap_or(3)
            })
            .collect();
        let line = |row: &[String]| {
            let padded = widths.iter().enumerate().map(|(c, &width)| match self.is_numeric(c) {
                true => format!("{:>width$}", cell(row, c)),
                false => format!("{:width$}", cell(row, c)),
            });
            format!("| {} |\n", padded.collect::<Vec<_>>().join(" | "))
        };
        let rules = widths.iter().enumerate().map(|(c, &width)| match self.is_numeric(c) {
            true => format!("{}:", "-".repeat(width + 1)),
            false => "-".repeat(width + 2),
        });
        let mut text =
            format!("### {}\n\n{}|{}|\n", self.title, line(&self.head), rules.collect::<Vec<_>>().join("|"));
        self.rows.iter().for_each(|row| text += &line(row));
        if !self.note.is_empty() {
            text += &format!("\n{}\n", self.note);
        }
        text
    }

    /// Renders the table as HTML. Each cell has the name of its column, for narrow screens.
    pub fn html(&self) -> String {
        let class = |c: usize| if self.is_numeric(c) { "n" } else { "t" };
        let head = self.head.iter().enumerate();
        let head = head.map(|(c, text)| format!("<th class=\"{}\">{}</th>", class(c), escaped(text)));
        let row = |row: &Vec<String>| {
            let cells = row.iter().zip(&self.head).enumerate().map(|(c, (text, name))| {
                format!("<td class=\"{}\" data-name=\"{}\">{}</td>", class(c), escaped(name), cell(text))
            });
            format!("<tr>{}</tr>\n", cells.collect::<String>())
        };
        let rows: String = self.rows.iter().map(row).collect();
        let note = if self.note.is_empty() {
            String::new()
        } else {
            format!("<p class=\"note\">{}</p>\n", escaped(&self.note))
        };
        format!(
            "<h3>{}</h3>\n<table>\n<thead><tr>{}</tr>\n</thead>\n<tbody>\n{rows}</tbody>\n</table>\n{note}",
            escaped(&self.title),
            head.collect::<String>()
        )
    }

    /// True for a column of numbers, which is aligned to the right.
    fn is_numeric(&self, column: usize) -> bool {
        let numeric = |text: &String| {
            text.is_empty()
                || text == "-"
                || text.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c))
        };
        !self.rows.is_empty() && self.rows.iter().filter_map(|row| row.get(column)).all(numeric)
    }
}

/// A cell in HTML, the interval of a value below it.
fn cell(text: &str) -> String {
    match text.split_once(" [") {
        Some((value, interval)) => format!("{}<i>[{}</i>", escaped(value), escaped(interval)),
        None => escaped(text),
    }
}

/// Formats a value with its interval, as `0.98 [0.95, 0.99]`; a dash if there is none.
pub fn shown(estimate: Option<Estimate>, decimals: usize) -> String {
    match estimate {
        None => "-".into(),
        Some(Estimate { value, interval: None, .. }) => format!("{value:.decimals$}"),
        Some(Estimate { value, interval: Some([low, high]), .. }) => {
            format!("{value:.decimals$} [{low:.decimals$}, {high:.decimals$}]")
        }
    }
}

/// Formats the numbers of runs behind the values of a plot, as `n = 6` or `n = 4 to 6`.
pub fn counted(counts: impl Iterator<Item = usize>) -> String {
    let (least, most) = counts.fold((usize::MAX, 0), |(least, most), n| (least.min(n), most.max(n)));
    if least < most { format!("n = {least} to {most}") } else { format!("n = {most}") }
}

/// Formats a number, or a dash.
pub fn number(value: Option<f64>, decimals: usize) -> String {
    value.map_or("-".into(), |value| format!("{value:.decimals$}"))
}
