//! Parallel execution of searches with the results of running them one after another.

use std::sync::atomic::{AtomicBool, Ordering};

/// Runs jobs in parallel threads. Returns their results in order, up to and including the first for
/// which `ends_it` is true; the jobs after that one are told to stop through their flag.
pub fn in_order<R: Send>(
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
