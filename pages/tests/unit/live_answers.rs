//! Tests of `live::answers`.

use descry_pages::live::answers::*;
use hyper::header::{self, HeaderMap, HeaderName};

fn check(lines: &[(HeaderName, &str)], named: Option<&str>, port: u16, answered: bool) {
    let value = |text: &&str| header::HeaderValue::from_str(text).expect("a value");
    let headers: HeaderMap = lines.iter().map(|(name, text)| (name.clone(), value(text))).fold(
        HeaderMap::new(),
        |mut all, (name, value)| {
            all.append(name, value);
            all
        },
    );
    assert_eq!(refusal(&headers, named, port).is_none(), answered, "{lines:?} {named:?} {port}");
}

#[test]
fn only_this_machine_and_this_page_are_answered() {
    use header::{HOST, ORIGIN};
    check(&[(HOST, "127.0.0.1:8000")], None, 8000, true);
    check(&[(HOST, "localhost:8000"), (ORIGIN, "http://localhost:8000")], None, 8000, true);
    check(&[(HOST, "127.0.0.1:8000")], Some("127.0.0.1:8000"), 8000, true);
    check(&[(HOST, "localhost")], None, 80, true);
    for foreign in [
        "evil.example:8000",
        "127.0.0.1:8001",
        "127.0.0.1",
        "localhost.evil.example:8000",
        "",
        "127.0.0.1:8000.evil",
    ] {
        check(&[(HOST, foreign)], None, 8000, false);
        check(&[(HOST, "localhost:8000")], Some(foreign), 8000, false);
    }
    for origin in [
        "http://evil.example",
        "null",
        "https://localhost:8000",
        "http://localhost:8001",
        "http://localhost:8000.evil",
        "file://",
    ] {
        check(&[(HOST, "localhost:8000"), (ORIGIN, origin)], None, 8000, false);
    }
    check(&[], None, 8000, false);
    check(&[(HOST, "localhost:8000"), (HOST, "evil.example")], None, 8000, false);
    check(
        &[(HOST, "localhost:8000"), (ORIGIN, "http://localhost:8000"), (ORIGIN, "http://evil")],
        None,
        8000,
        false,
    );
}
