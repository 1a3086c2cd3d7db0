//! Work that is shared out among threads.

use rayon::prelude::*;
use std::cmp::Reverse;
use tracing::Span;

/// Does a piece of work in a thread of the pool: what it shares out again need not wake the pool and wait for it each time.
pub(crate) fn within<R: Send>(span: Span, work: impl FnOnce() -> R + Send) -> R {
    rayon::scope(|_| span.in_scope(work))
}

/// What comes of each, in their order. The heaviest are begun first, so that none is left to one thread in the end.
pub fn heaviest_first<T: Sync, R: Send>(
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
