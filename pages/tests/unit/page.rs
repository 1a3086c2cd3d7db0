//! Tests of `page`.

use descry_pages::page::*;

#[test]
fn what_people_wrote_is_no_markup() {
    let page = laid_out("descry: <b> & co", r#"{"goal":"</script><!--<script>{{style}}"}"#);
    assert!(page.contains("<title>descry: &lt;b&gt; &amp; co</title>"));
    let told = r#"{"goal":"\u003c/script>\u003c!--\u003cscript>{{style}}"}"#;
    assert!(page.contains(told), "{page}");
    assert_eq!(page.matches("</script>").count(), 2);
}
