//! Searches side by side that come to what they would come to one after another.

use std::sync::atomic::{AtomicBool, Ordering};

/// Does jobs at the same time, each in a thread. Returns what they came to in their order, up to the first that ends the matter;
/// those behind it are told that nobody waits for them.
pub(crate) fn in_order<R: Send>(
    jobs: Vec<impl FnOnce(&AtomicBool) -> R + Send>,
    ends_it: impl Fn(&R) -> bool,
) -> Vec<R> {
    let cancelled = AtomicBool::new(false);
    let mut jobs = jobs.into_iter();
    let Some(first) = jobs.next() else { return Vec::new() };
    std::thread::scope(|scope| {
        let others: Vec<_> = jobs.map(|job| scope.spawn(|| job(&cancelled))).collect();
        let mut results = vec![first(&cancelled)];
        for other in others {
            if results.last().is_some_and(&ends_it) {
                cancelled.store(true, Ordering::Relaxed);
                break;
            }
            results.push(other.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
        }
        results
    })
}

#[cfg(test)]
mod tests {
    use super::*;

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
}
