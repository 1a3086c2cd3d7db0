//! Work that is shared out among threads.

use rayon::Yield;
use rayon::prelude::*;
use std::cmp::Reverse;
use std::sync::atomic::{AtomicBool, Ordering};
use tracing::Span;

/// Does a piece of work in a thread of the pool: what it shares out again need not wake the pool and wait for it each time. Meanwhile another
/// thread stays awake between its shares, which often take less time than to wake up.
pub(crate) fn within<R: Send>(span: Span, work: impl FnOnce() -> R + Send) -> R {
    let is_outside = rayon::current_thread_index().is_none();
    let done = AtomicBool::new(false);
    rayon::scope(|scope| {
        // Even if it panics.
        let _end = OnDrop(|| done.store(true, Ordering::Release));
        if is_outside {
            scope.spawn(|_| {
                while !done.load(Ordering::Acquire) {
                    if rayon::yield_now() != Some(Yield::Executed) {
                        std::thread::yield_now();
                    }
                }
            });
        }
        span.in_scope(work)
    })
}

struct OnDrop<F: Fn()>(F);

impl<F: Fn()> Drop for OnDrop<F> {
    fn drop(&mut self) {
        self.0();
    }
}

/// What comes of each, in their order. The heaviest are begun first, so that none is left to one thread in the end.
pub(crate) fn heaviest_first<T: Sync, R: Send>(
    all: &[T],
    weight: impl Fn(&T) -> usize,
    each: impl Fn(&T) -> R + Sync + Send,
) -> Vec<R> {
    let mut order: Vec<usize> = (0..all.len()).collect();
    order.sort_by_key(|&n| Reverse(weight(&all[n])));
    let mut done: Vec<(usize, R)> = order.into_iter().par_bridge().map(|n| (n, each(&all[n]))).collect();
    done.sort_unstable_by_key(|(n, _)| *n);
    done.into_iter().map(|(_, result)| result).collect()
}
