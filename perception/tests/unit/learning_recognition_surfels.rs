//! Tests of `learning::recognition::surfels`.

use descry_perception::learning::recognition::surfels::*;

#[test]
fn colours_as_the_standard_says() {
    for (rgb, expected) in [
        ([255, 255, 255], [100.0, 0.0, 0.0]),
        ([0, 0, 0], [0.0, 0.0, 0.0]),
        ([255, 0, 0], [53.2, 80.1, 67.2]),
        ([0, 0, 255], [32.3, 79.2, -107.9]),
    ] {
        let found = lab(rgb);
        assert!((0..3).all(|k| (found[k] - expected[k]).abs() < 0.3), "{rgb:?}: {found:?}");
    }
}
