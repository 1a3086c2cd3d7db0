//! Tests of `page`.

use descry_experiments::page::*;
use descry_experiments::table::Table;

#[test]
fn a_page_holds_everything_and_escapes_it() {
    let table =
        Table { title: "T".into(), head: vec!["a".into()], rows: vec![vec!["1".into()]], ..Table::default() };
    let sections = [Section::Heading("H & I".into()), Section::Table(table)];
    let page = html(("<name>", "about"), &vec![("hash", "h".into())], &sections, "a = \"<b>\"", None);
    for part in [
        "<h1>&lt;name&gt;</h1>",
        "<dd>h</dd>",
        "H &amp; I",
        "<td class=\"n\" data-name=\"a\">1</td>",
        "a = &quot;&lt;b&gt;&quot;",
    ] {
        assert!(page.contains(part), "{part} is not in\n{page}");
    }
    assert!(!page.contains("src=") && !page.contains("<script"), "a page stands alone");
    let live = html(("n", "a"), &vec![], &[], "", Some(Progress { done: 3, all: 8 }));
    assert!(live.contains("<progress max=\"8\" value=\"3\">") && live.contains("follow("), "{live}");
}
