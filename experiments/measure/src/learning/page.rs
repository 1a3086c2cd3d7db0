//! HTML page of tables, plots and pictures; tables are printed as well.

use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Table with a header, printed and shown on the page.
pub struct PageTable {
    head: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl PageTable {
    pub fn new(head: &[&str]) -> PageTable {
        PageTable { head: head.iter().map(|&cell| cell.to_owned()).collect(), rows: Vec::new() }
    }

    pub fn row(&mut self, cells: Vec<String>) {
        self.rows.push(cells);
    }

    fn print(&self) {
        let line = |cells: &[String]| println!("| {} |", cells.join(" | "));
        println!();
        line(&self.head);
        line(&vec!["---".to_owned(); self.head.len()]);
        self.rows.iter().for_each(|row| line(row));
    }
}

/// HTML page under construction, with the folder of its files.
pub struct Page {
    dir: PathBuf,
    body: String,
}

const STYLE: &str = "body{font:15px/1.5 system-ui,sans-serif;max-width:1180px;margin:2em auto;padding:0 1em;color:#1d2027}\
table{border-collapse:collapse;font-size:13px;margin:1em 0}th,td{padding:.25em .6em;border-bottom:1px solid #d8dbe2;text-align:right}\
th{background:#f2f3f6;vertical-align:bottom}th:first-child,td:first-child{text-align:left}img{max-width:100%}figure{margin:1em 0}\
figcaption{color:#555;font-size:13px}tr:has(td.paper){background:#f7f5ea}";

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

impl Page {
    pub fn new(dir: &Path) -> Page {
        Page { dir: dir.to_owned(), body: String::new() }
    }

    /// Path of a file in the page's folder.
    pub fn file(&self, name: &str) -> PathBuf {
        self.dir.join(name)
    }

    pub fn heading(&mut self, text: &str) {
        println!("\n## {text}");
        let _ = writeln!(self.body, "<h2>{}</h2>", escaped(text));
    }

    pub fn say(&mut self, text: &str) {
        println!("\n{text}");
        let _ = writeln!(self.body, "<p>{}</p>", escaped(text));
    }

    /// Adds a table; rows that begin with "paper" are highlighted.
    pub fn table(&mut self, table: &PageTable) {
        table.print();
        let cells = |row: &[String], kind: &str| -> String {
            let class = if row[0].starts_with("paper") { " class=\"paper\"" } else { "" };
            row.iter().map(|cell| format!("<{kind}{class}>{}</{kind}>", escaped(cell))).collect()
        };
        let _ = write!(self.body, "<table><tr>{}</tr>", cells(&table.head, "th"));
        for row in &table.rows {
            let _ = write!(self.body, "<tr>{}</tr>", cells(row, "td"));
        }
        self.body.push_str("</table>\n");
    }

    /// Adds a picture from a file in the page's folder, with a caption.
    pub fn figure(&mut self, name: &str, words: &str) {
        println!("\n{name}: {words}");
        let _ = writeln!(
            self.body,
            "<figure><img src=\"{name}\" alt=\"\"><figcaption>{}</figcaption></figure>",
            escaped(words)
        );
    }

    /// Writes the page as it stands.
    pub fn write(&self) -> Result<(), String> {
        let path = self.file("page.html");
        let text = format!(
            "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>Objects learned and known again</title><style>{STYLE}</style>\
             <h1>Objects learned and known again</h1>\n{}</html>\n",
            self.body
        );
        std::fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()))
    }
}
