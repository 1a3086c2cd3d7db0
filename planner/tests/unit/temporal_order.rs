//! Tests of `temporal::order`.

use descry_planner::plan::EPSILON_S;
use descry_planner::temporal::order::*;
use descry_planner::temporal::world::DurationRange;

fn access(reads: &[u32], writes: &[u32]) -> Access {
    Access { reads: reads.to_vec(), writes: writes.to_vec(), ..Access::default() }
}

fn holding(holds: &[u32]) -> Access {
    Access { holds: holds.to_vec(), ..Access::default() }
}

fn exactly(seconds: f64) -> DurationRange {
    DurationRange { least_s: seconds, most_s: seconds }
}

#[test]
fn independent_actions_overlap_and_dependent_ones_follow() {
    let mut order = Order::new(2);
    let first = order.push(&access(&[], &[0]));
    let first_end = order.push_end(first, &access(&[], &[0]), exactly(3.0)).expect("fits");
    let second = order.push(&access(&[], &[1]));
    order.push_end(second, &access(&[], &[1]), exactly(5.0)).expect("fits");
    let third = order.push(&access(&[0], &[]));
    assert_eq!(order.earliest_s(first_end), 3.0);
    assert_eq!(order.earliest_s(second), 0.0);
    assert_eq!(order.earliest_s(third), 3.0 + EPSILON_S);
    assert_eq!(order.makespan_s(), 5.0);
}

#[test]
fn an_envelope_starts_late_enough_to_hold_what_it_must() {
    // The envelope (resource 0, 4 s) must end after an action of 2 s that needs it and, from before, 3 s on resource 1.
    let mut order = Order::new(2);
    let before = order.push(&access(&[], &[1]));
    order.push_end(before, &access(&[], &[1]), exactly(3.0)).expect("fits");
    let envelope = order.push(&access(&[], &[0]));
    let inside = order.push(&access(&[0, 1], &[]));
    order.push_end(inside, &access(&[0], &[]), exactly(2.0)).expect("fits");
    order.push_end(envelope, &access(&[], &[0]), exactly(4.0)).expect("fits");
    assert!((order.earliest_s(envelope) - (3.0 + 2.0 + 2.0 * EPSILON_S - 4.0)).abs() < 1e-9);
}

#[test]
fn what_does_not_fit_is_found() {
    let mut order = Order::new(1);
    let envelope = order.push(&access(&[], &[0]));
    let inside = order.push(&access(&[0], &[]));
    order.push_end(inside, &access(&[0], &[]), exactly(4.0)).expect("fits");
    assert_eq!(order.push_end(envelope, &access(&[], &[0]), exactly(4.0)), Err(Inconsistent));
}

#[test]
fn what_holds_over_all_fills_a_window_to_its_very_ends() {
    for (last_s, fits) in [(4.0, true), (4.001, false)] {
        let mut order = Order::new(2);
        let window = order.push(&access(&[], &[0]));
        for seconds in [3.0, last_s] {
            let start = order.push(&holding(&[0, 1]));
            let end = Access { writes: vec![1], ..holding(&[0]) };
            order.push_end(start, &end, exactly(seconds)).expect("fits");
        }
        assert_eq!(order.push_end(window, &access(&[], &[0]), exactly(7.0)).is_ok(), fits);
    }
}

#[test]
fn the_clock_tells_what_the_order_tells() {
    let actions =
        [(0, 0, 0, 3.0), (1, 2, 1, 5.0), (0, 1, 1, 2.0), (2, 0, 0, 1.0), (1, 1, 2, 4.0), (2, 2, 1, 2.0)];
    let (mut order, mut clock) = (Order::new(3), Clock::new(3));
    for (reads, holds, writes, seconds) in actions {
        let start = Access { reads: vec![reads], ..holding(&[holds]) };
        let end = Access { writes: vec![writes], ..start.clone() };
        let node = order.push(&start);
        order.push_end(node, &end, exactly(seconds)).expect("fits");
        clock.push(&start, Some((&end, exactly(seconds))));
        assert!((order.makespan_s() - clock.makespan_s()).abs() < 1e-9);
    }
}

#[test]
fn a_deadline_bounds_what_comes_before_it() {
    for (deadline_s, fits) in [(2.0, false), (4.0, true)] {
        let mut order = Order::new(1);
        let start = order.push(&access(&[0], &[]));
        order.push_end(start, &access(&[0], &[]), exactly(3.0)).expect("fits");
        assert_eq!(order.push_fixed(&access(&[], &[0]), deadline_s).is_ok(), fits);
    }
}
