//! Tests of `table`.

use descry_experiments::statistics::Estimate;
use descry_experiments::table::*;

#[test]
fn markdown_is_aligned_and_html_escaped() {
    let mut table = Table::new("T", "A note.", &["policy", "views"]);
    table.rows = vec![vec!["a|b".into(), "12.5".into()], vec!["<c>".into(), "-".into()]];
    let expected = "### T\n\n| policy | views |\n|--------|------:|\n| a\\|b   |  12.5 |\n| <c>    |     - |\n\nA note.\n";
    assert_eq!(table.markdown(), expected);
    let cells =
        "<td class=\"t\" data-name=\"policy\">&lt;c&gt;</td><td class=\"n\" data-name=\"views\">-</td>";
    assert!(table.html().contains(cells), "{}", table.html());
    table.rows = vec![vec!["x".into(), "0.98 [0.90, 1.00]".into()]];
    assert!(table.html().contains(">0.98<i>[0.90, 1.00]</i></td>"), "{}", table.html());
}

#[test]
fn estimates() {
    let estimate = Estimate { value: 0.981, interval: Some([0.9, 1.0]), n: 3 };
    assert_eq!(shown(Some(estimate), 2), "0.98 [0.90, 1.00]");
    assert_eq!(
        (shown(None, 2), number(None, 1), number(Some(1.25), 1)),
        ("-".into(), "-".into(), "1.2".into())
    );
}
