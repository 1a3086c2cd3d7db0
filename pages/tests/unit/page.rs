//! Tests of `page`.

use descry_pages::page::*;

#[test]
fn what_people_wrote_is_no_markup() {
    let page = laid_out("descry: <b> & co", r#"{"goal":"</script><b>{{style}}"}"#);
    assert!(page.contains("<title>descry: &lt;b&gt; &amp; co</title>"));
    assert!(page.contains(r#"{"goal":"<\/script><b>{{style}}"}"#), "{page}");
    assert_eq!(page.matches("</script>").count(), 2);
}
