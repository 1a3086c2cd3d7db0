//! Work that is shared out among threads.

use tracing::Span;

/// Does a piece of work in a thread of the pool: what it shares out again need not wake the pool and wait for it each time.
pub(crate) fn within<R: Send>(span: Span, work: impl FnOnce() -> R + Send) -> R {
    rayon::scope(|_| span.in_scope(work))
}
