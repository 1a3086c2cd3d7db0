//! Tests of `spread`.

use descry_perception::spread::*;
use nalgebra::Matrix3;
use nalgebra::Vector3;
use proptest::prelude::*;

proptest! {
    #[test]
    fn agrees_with_an_iterative_solver(v in proptest::array::uniform9(-1.0f64..1.0)) {
        let a = Matrix3::from_row_slice(&v);
        let m = a.transpose() * a;
        let c = [m[(0, 0)], m[(0, 1)], m[(0, 2)], m[(1, 1)], m[(1, 2)], m[(2, 2)]];
        let values = m.symmetric_eigenvalues();
        let mut sorted = [values[0], values[1], values[2]];
        sorted.sort_by(f64::total_cmp);
        prop_assume!(sorted[1] > 1e-3 && sorted[1] - sorted[0] > 1e-3);
        let found = least(&c).unwrap();
        let n = Vector3::from(found.normal);
        prop_assert!((m * n - n * sorted[0]).norm() < 1e-6);
        // Whatever lies beside it.
        let [same, none] = least_of(&c.map(|value| [value, 0.0]));
        prop_assert_eq!(same.map(|same| same.normal), Some(found.normal));
        prop_assert!(none.is_none());
    }
}

#[test]
fn no_direction_for_a_line_or_a_place() {
    assert!(least(&[1.0, 0.0, 0.0, 0.0, 0.0, 0.0]).is_none());
    assert!(least(&[0.0; 6]).is_none());
    assert!(least(&[f64::NAN; 6]).is_none());
    assert!(least(&[1.0, 0.0, 0.0, 1.0, 0.0, 0.0]).is_some_and(|l| l.normal[2].abs() == 1.0));
}
