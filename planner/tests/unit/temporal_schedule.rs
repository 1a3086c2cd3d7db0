//! Tests of `temporal::schedule`.

use descry_planner::temporal::order::Access;
use descry_planner::temporal::order::Order;
use descry_planner::temporal::schedule::*;
use descry_planner::temporal::world::DurationRange;

#[test]
fn the_longest_path_leads_from_the_end_to_the_beginning() {
    let access = |reads: &[u32], writes: &[u32]| Access {
        reads: reads.to_vec(),
        writes: writes.to_vec(),
        ..Access::default()
    };
    // An action of 3 s and after it one of 4 s, beside one of 5 s: the first two decide.
    let mut order = Order::new(3);
    for (reads, writes, seconds) in [(0, 0, 3.0), (1, 1, 5.0), (0, 2, 4.0)] {
        let start = order.push(&access(&[reads], &[]));
        let span = DurationRange { least_s: seconds, most_s: seconds };
        order.push_end(start, &access(&[], &[writes]), span).expect("fits");
    }
    assert_eq!(longest_path(&order), [5, 4, 1, 0]);
    // What is given from outside at 20 s, and asked for by a last happening, is where the path begins.
    order.push_fixed(&access(&[], &[2]), 20.0).expect("fits");
    order.push(&access(&[2], &[]));
    assert_eq!(longest_path(&order), [7, 6]);
}
