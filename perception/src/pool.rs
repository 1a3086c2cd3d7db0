//! Thread pool. Work is passed as a reference to a closure, so that the scheduling code is compiled once instead of for
//! every use. Results are in index order, whatever the number of threads.

use std::cmp::Reverse;
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use tracing::Span;

/// Number of chunks of work per thread, for load balancing.
const SHARES: usize = 8;

type Work<'a> = &'a mut (dyn FnMut() + Send);

fn both(one: Work<'_>, other: Work<'_>) {
    rayon::join(one, other);
}

/// Runs two pieces of work, in parallel if a thread is free.
pub(crate) fn join<A: Send, B: Send>(
    one: impl FnOnce() -> A + Send,
    other: impl FnOnce() -> B + Send,
) -> (A, B) {
    let (mut one, mut other) = (Some(one), Some(other));
    let (mut first, mut second) = (None, None);
    both(&mut || first = one.take().map(|work| work()), &mut || second = other.take().map(|work| work()));
    (first.expect("the first was done"), second.expect("the second was done"))
}

/// Runs work on chunks of a range; a range of fewer than twice `least` items is not split.
fn share(range: Range<usize>, least: usize, work: &(dyn Fn(Range<usize>) + Sync)) {
    if range.len() < 2 * least {
        return work(range);
    }
    let middle = range.start + range.len() / 2;
    both(&mut || share(range.start..middle, least, work), &mut || share(middle..range.end, least, work));
}

/// Chunk length for `count` items, with at least `least` per chunk.
fn length(count: usize, least: usize) -> usize {
    count.div_ceil(SHARES * rayon::current_num_threads()).max(least).max(1)
}

/// Collects the results other than `None` for the indices below `count`; a chunk has at least `least` indices, and a
/// `state` of its own.
pub(crate) fn filter_with<S, R: Send>(
    count: usize,
    least: usize,
    state: impl Fn() -> S + Sync,
    result: impl Fn(&mut S, usize) -> Option<R> + Sync,
) -> Vec<R> {
    let shares = Mutex::new(Vec::new());
    share(0..count, length(count, least), &|range| {
        let (start, mut state) = (range.start, state());
        let some: Vec<R> = range.filter_map(|n| result(&mut state, n)).collect();
        shares.lock().unwrap_or_else(PoisonError::into_inner).push((start, some));
    });
    let mut shares = shares.into_inner().unwrap_or_else(PoisonError::into_inner);
    shares.sort_unstable_by_key(|(start, _)| *start);
    let mut all = Vec::with_capacity(shares.iter().map(|(_, some)| some.len()).sum());
    shares.into_iter().for_each(|(_, some)| all.extend(some));
    all
}

/// Collects the results other than `None` for the indices below `count`; a chunk has at least `least` indices.
pub(crate) fn filter<R: Send>(
    count: usize,
    least: usize,
    result: impl Fn(usize) -> Option<R> + Sync,
) -> Vec<R> {
    filter_with(count, least, || (), |(), n| result(n))
}

/// Collects the results for the indices below `count`; a chunk has at least `least` indices.
pub(crate) fn each<R: Send>(count: usize, least: usize, result: impl Fn(usize) -> R + Sync) -> Vec<R> {
    filter(count, least, |n| Some(result(n)))
}

/// Collects the results for the items of a slice; a chunk has at least `least` items.
pub(crate) fn map<T: Sync, R: Send>(all: &[T], least: usize, result: impl Fn(&T) -> R + Sync) -> Vec<R> {
    each(all.len(), least, |n| result(&all[n]))
}

/// Calls `work` for each element with its index; a chunk has at least `least` elements, and a `state` of its own.
pub(crate) fn for_each<T: Send, S>(
    all: &mut [T],
    least: usize,
    state: impl Fn() -> S + Sync,
    work: impl Fn(&mut S, usize, &mut T) + Sync,
) {
    let length = length(all.len(), least);
    let mut slices: Vec<Mutex<&mut [T]>> = all.chunks_mut(length).map(Mutex::new).collect();
    share(0..slices.len(), 1, &|range| {
        let mut state = state();
        for n in range {
            let mut slice = slices[n].lock().unwrap_or_else(PoisonError::into_inner);
            (n * length..).zip(slice.iter_mut()).for_each(|(n, one)| work(&mut state, n, one));
        }
    });
    slices.clear();
}

/// Result for the first number of the range whose result is not `None`.
pub(crate) fn find_first<R: Send>(
    range: Range<usize>,
    result: impl Fn(usize) -> Option<R> + Sync,
) -> Option<R> {
    let best = AtomicUsize::new(usize::MAX);
    let found = filter(range.len(), 1, |n| {
        if n > best.load(Ordering::Relaxed) {
            return None;
        }
        let result = result(range.start + n)?;
        best.fetch_min(n, Ordering::Relaxed);
        Some(result)
    });
    found.into_iter().next()
}

/// Runs work inside a thread of the pool, so that nested parallel steps need not wake the pool each time.
pub(crate) fn within<R: Send>(span: Span, work: impl FnOnce() -> R + Send) -> R {
    rayon::scope(|_| span.in_scope(work))
}

/// Collects the results for the items of a slice, in order; items of greatest weight start first, for load balancing.
pub fn heaviest_first<T: Sync, R: Send>(
    all: &[T],
    weight: impl Fn(&T) -> usize,
    each: impl Fn(&T) -> R + Sync + Send,
) -> Vec<R> {
    let mut order: Vec<usize> = (0..all.len()).collect();
    order.sort_by_key(|&n| Reverse(weight(&all[n])));
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::with_capacity(all.len()));
    let take = || {
        while let Some(&n) = order.get(next.fetch_add(1, Ordering::Relaxed)) {
            let result = each(&all[n]);
            done.lock().unwrap_or_else(PoisonError::into_inner).push((n, result));
        }
    };
    share(0..rayon::current_num_threads(), 1, &|_| take());
    let mut done: Vec<(usize, R)> = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_unstable_by_key(|(n, _)| *n);
    done.into_iter().map(|(_, result)| result).collect()
}
