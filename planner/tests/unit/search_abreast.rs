//! Tests of `search::abreast`.

use descry_planner::search::abreast::*;
use std::sync::atomic::{AtomicBool, Ordering};

/// Jobs that end with a number, or once they are cancelled with none.
fn check(jobs: &[Option<u32>], last: u32, expected: &[u32]) {
    let job = |number: Option<u32>| {
        move |cancelled: &AtomicBool| match number {
            Some(number) => number,
            None => {
                while !cancelled.load(Ordering::Relaxed) {
                    std::thread::yield_now();
                }
                u32::MAX
            }
        }
    };
    let jobs = jobs.iter().map(|number| job(*number)).collect();
    assert_eq!(in_order(jobs, |number| *number == last), expected);
}

#[test]
fn the_first_in_order_that_ends_the_matter_counts() {
    check(&[], 7, &[]);
    check(&[Some(1)], 7, &[1]);
    check(&[Some(1), Some(2), Some(3)], 7, &[1, 2, 3]);
    check(&[Some(1), Some(7), Some(7)], 7, &[1, 7]);
    check(&[Some(7), None, None], 7, &[7]);
    check(&[Some(1), Some(7), None], 7, &[1, 7]);
}
