//! Tests of `commands::keeping`.

#[test]
fn sizes_are_read_with_their_units() {
    let cases = [("12", 12), ("500MB", 500_000_000), ("1.5 GB", 1_500_000_000), ("3kB", 3000), ("7B", 7)];
    for (text, bytes) in cases {
        assert_eq!(descry_cli::commands::keeping::size(text), Ok(bytes), "{text}");
    }
    for text in ["", "much", "-1MB", "1 mile"] {
        assert!(descry_cli::commands::keeping::size(text).is_err(), "{text}");
    }
}
