//! Origins of the constants of segmentation, recognition, round bodies, surfaces and merging.

use crate::constants;
use constants::{PARTS, all, faults, read, table};
use std::path::Path;

/// The faults of a text, in words.
fn check(text: &str, expected: &[&str]) {
    assert_eq!(faults(&read("a.rs", text)), expected, "{text}");
}

#[test]
fn what_a_constant_lacks_is_told() {
    check("/// How far, metres. From: chosen.\nconst FAR_M: f64 = 0.3;", &[]);
    check(
        "/// How far, metres.\nconst FAR_M: f64 = 0.3;",
        &["a.rs:2: FAR_M does not say where its value is from"],
    );
    check("const FAR_M: f64 = 0.3;", &["a.rs:1: FAR_M is not documented"]);
    check(
        "/// Far. From: nowhere.\nconst FAR_M: f64 = 0.3;",
        &["a.rs:2: FAR_M has its value from something that is no kind of origin"],
    );
    check("/// Far. From: paper.\nconst FAR_M: f64 = 0.3;", &["a.rs:2: FAR_M does not say from which"]);
    check("/// Far. From: paper, section V.\nconst FAR_M: f64 = 0.3;", &[]);
    // One after another shares what is said; after anything else it does not.
    check("/// Ends. From: chosen.\nconst LOW: f64 = 0.3;\nconst HIGH: f64 = 0.4;", &[]);
    check(
        "/// Ends. From: chosen.\nconst LOW: f64 = 0.3;\n\nconst HIGH: f64 = 0.4;",
        &["a.rs:4: HIGH is not documented"],
    );
    check("/// Far. From: chosen.\nfn far() -> f64 {\n    0.3\n}", &[]);
    check("/// Far.\nfn far() -> f64 {\n    0.3\n}", &["a.rs:3: 0.3 has no name"]);
    check("    /// Within. From: work.\n    const ROOM: Row = Row {\n        wide: 0.3,\n    };", &[]);
}

#[test]
fn a_number_without_a_name_is_told() {
    check("let far = 3.5 * sigma;", &["a.rs:1: 3.5 has no name"]);
    check(
        "let far = near.max(1e-9) + 0.3_f64.ln();",
        &["a.rs:1: 1e-9 has no name", "a.rs:1: 0.3_f64 has no name"],
    );
    check("let half = 0.5 * (pair.0.1 + 1.0) * x2; // 0.7\nlet all = 0..9;", &[]);
    check("let text = \"0.7 of it\"; let per_cent = 100.0 * share;", &[]);
    check("#[cfg(test)]\nlet far = 3.5;", &[]);
}

#[test]
fn options_say_it_at_their_fields() {
    let options = |doc: &str| {
        format!(
            "pub struct Way {{\n    /// {doc}\n    pub far_m: f64,\n}}\n\nimpl Default for Way {{\n    Way {{ far_m: 0.3 }}\n}}\n"
        )
    };
    check(&options("How far. From: chosen."), &[]);
    check(&options("How far."), &["a.rs:7: far_m does not say where its value is from"]);
}

#[test]
fn every_constant_says_where_its_value_is_from() {
    let found = all(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"));
    for part in PARTS {
        assert!(found.constants.iter().any(|c| c.file.starts_with(part)), "{part} has no constants");
    }
    let faults = faults(&found);
    assert!(faults.is_empty(), "{} constants lack something:\n{}", faults.len(), faults.join("\n"));
    let rows = table(&found).lines().filter(|line| line.starts_with("| ")).count();
    assert_eq!(rows, found.constants.len() + 1, "a row for each, and the head");
}
