//! Tests of `quantile`.

use descry_perception::quantile::*;
use proptest::prelude::*;

proptest! {
    #[test]
    fn an_end_is_the_quantile(
        mut values in prop::collection::vec((-9i32..9, 0.0..1.0_f64), 0..900),
        coarse in any::<bool>(),
        ascending in any::<bool>(),
    ) {
        if ascending {
            values.sort_by_key(|value| value.0);
        }
        let values: Vec<f64> =
            values.iter().map(|(whole, rest)| f64::from(*whole) * if coarse { 1.0 } else { *rest }).collect();
        for share in [0.0, 0.01, 0.02, 0.1, 0.9, 0.95, 0.98, 0.99, 1.0] {
            let expected = quantile(&mut values.clone(), share);
            prop_assert_eq!(end(&values, share).to_bits(), expected.to_bits());
        }
    }
}
