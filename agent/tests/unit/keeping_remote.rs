//! Tests of `keeping::remote`.

use descry_agent::keeping::remote::{Address, is_address};
use std::path::Path;

#[test]
fn addresses_are_read() {
    let run = |text: &str| Address::read(text).unwrap().of_run(Path::new("runs/find-1")).to_string();
    assert_eq!(run("mongodb://host/db"), "mongodb://host/db#find-1");
    assert_eq!(run("mongodb://a,b:3/db?w=1#mine"), "mongodb://a,b:3/db?w=1#mine");
    assert_eq!(Address::read("mongodb://host#").unwrap().to_string(), "mongodb://host");
    for (text, word) in [
        ("mongo://host/db", "expected: mongodb://HOST"),
        ("mongodb+srv://host/db", "expected: mongodb://HOST"),
        ("mongodb://me:secret@host/db", "DESCRY_MONGODB_LOGIN"),
    ] {
        let error = Address::read(text).unwrap_err().to_string();
        assert!(error.contains(word) && !error.contains("secret"), "{error}");
    }
    assert!(is_address(Path::new("mongodb+srv://x")) && !is_address(Path::new("runs/mongodb")));
}
