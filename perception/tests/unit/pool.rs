//! Tests of `pool`.

use descry_perception::pool::*;

#[test]
fn what_comes_of_each_is_in_the_order_of_all() {
    let squares = heaviest_first(&[3, 1, 4, 1, 5, 9, 2, 6], |n| *n, |n| n * n);
    assert_eq!(squares, [9, 1, 16, 1, 25, 81, 4, 36]);
    assert_eq!(heaviest_first(&[] as &[usize], |n| *n, |n| n * n), [0_usize; 0]);
}
