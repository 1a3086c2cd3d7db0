//! Readers of bytes from outside, fed with inputs that differ a little from good ones. `fuzz/` does the same led by coverage.

use std::panic::{AssertUnwindSafe, catch_unwind};

use descry_tests::fuzz::{Draw, TARGETS, Target, mutate};

/// Inputs from the corpus, then as many made from it. Where the process itself ends, the file that is named holds the input.
fn check(target: &Target, made: usize) {
    let corpus = (target.corpus)();
    assert!(!corpus.is_empty(), "{} has no corpus", target.name);
    let mut draw = Draw(62);
    let mutated = std::iter::repeat_with(|| mutate(&mut draw, &corpus)).take(made);
    let last = std::env::temp_dir().join(format!("descry-fuzz-{}-{}", target.name, std::process::id()));
    for (n, input) in corpus.iter().cloned().chain(mutated).enumerate() {
        std::fs::write(&last, &input).expect("the folder for temporary files can be written");
        let judged = catch_unwind(AssertUnwindSafe(|| (target.judge)(&input)));
        assert!(judged.is_ok(), "{} fails on its input {n}: {}", target.name, last.display());
    }
    std::fs::remove_file(&last).expect("it was written");
}

#[test]
fn no_reader_fails_on_inputs_near_to_good_ones() {
    for target in TARGETS {
        check(target, 20);
    }
}

#[test]
#[ignore = "slow: thousands of inputs a reader"]
fn no_reader_fails_on_thousands_of_inputs() {
    for target in TARGETS {
        check(target, 4_000);
    }
}
