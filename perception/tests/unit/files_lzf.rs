//! Tests of `files::lzf`.

use descry_perception::files::lzf::*;
use proptest::prelude::*;

fn check(data: &[u8]) {
    assert_eq!(unpack(&pack(data), data.len()).as_deref(), Ok(data));
}

#[test]
fn packs_and_unpacks() {
    check(b"");
    check(b"ab");
    check(&[7; 100_000]);
    check(b"abcabcabcabcabcabcabcabcabcabcabcabcabcabcabcabcabc");
}

#[test]
fn a_claim_no_stream_can_keep_allocates_nothing() {
    assert!(matches!(unpack(&[0, 1], usize::MAX), Err(LzfError::TooShort { .. })));
}

proptest! {
    #[test]
    fn round_trip(data in proptest::collection::vec(0u8..4, 0..3000)) { check(&data); }

    #[test]
    fn never_panics(data in proptest::collection::vec(any::<u8>(), 0..300), expected in 0usize..2000) {
        let _ = unpack(&data, expected);
    }
}
