//! Open connections, limited in number; silent clients cannot use them all up.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use tokio::sync::Notify;

/// Open connections, the oldest first.
#[derive(Debug, Default)]
pub struct Connections(Mutex<Vec<Arc<Connection>>>);

/// Open connection.
#[derive(Debug, Default)]
pub struct Connection {
    has_asked: AtomicBool,
    eviction: Notify,
}

impl Connections {
    /// Registers a new connection. If `most` are open already, evicts the oldest that has sent no request, or else the
    /// oldest.
    pub fn open(&self, most: usize) -> Arc<Connection> {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        while all.len() >= most.max(1) {
            let silent = all.iter().position(|one| !one.has_asked.load(Ordering::Relaxed));
            all.remove(silent.unwrap_or(0)).eviction.notify_one();
        }
        let connection = Arc::new(Connection::default());
        all.push(Arc::clone(&connection));
        connection
    }

    /// Removes a closed connection.
    pub fn close(&self, connection: &Arc<Connection>) {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        all.retain(|one| !Arc::ptr_eq(one, connection));
    }
}

impl Connection {
    /// Marks the connection as having sent a request.
    pub fn has_asked(&self) {
        self.has_asked.store(true, Ordering::Relaxed);
    }

    /// Waits for the eviction of the connection.
    pub async fn evicted(&self) {
        self.eviction.notified().await;
    }
}
