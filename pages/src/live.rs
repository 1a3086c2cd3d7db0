//! Live page, served by a thread of its own to browsers on this machine only.
//!
//! The server is read-only. It refuses requests caused by pages of other sites, which it recognises by the `Host` and
//! `Origin` headers (DNS rebinding and cross-site requests); restrictive response headers protect the page.

#[doc(hidden)]
pub mod answers;
mod connections;
mod news;

use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use tokio::sync::watch;

use connections::Connections;
use descry_agent::exit::CommandError;
use news::News;

/// Script by which a page subscribes to updates.
pub const FOLLOW: &str = include_str!("live/follow.js");

/// Interval between checks for a new revision while a reader is connected.
const LOOK_EVERY: Duration = Duration::from_millis(250);
/// Maximum time that the server waits, after the end, for readers to fetch the final state.
const LINGER: Duration = Duration::from_secs(5);
/// Maximum number of open connections; a further one closes another, preferably one that has sent no request.
const MOST_CONNECTIONS: usize = 64;
/// Time within which a client must have sent its request.
const ASK_WITHIN: Duration = Duration::from_secs(10);

/// Content that a live page shows.
pub trait Shown: Send + Sync + 'static {
    /// Revision number of the content; changes with every update.
    fn revision(&self) -> u64;

    /// Content at a path of the URL, the page itself at `/`; `None` if there is nothing at the path.
    ///
    /// # Errors
    /// [`CommandError`] if the content is unavailable now; a later call may succeed.
    fn at(&self, path: &str) -> Result<Option<Found>, CommandError>;
}

/// Content at a path of the URL.
pub struct Found {
    /// Media type (HTTP `Content-Type`).
    pub kind: &'static str,
    /// Body of the response.
    pub text: String,
}

impl Found {
    /// Content of type HTML.
    pub fn html(text: String) -> Self {
        Self { kind: "text/html; charset=utf-8", text }
    }

    /// Content of type JSON.
    pub fn json(text: String) -> Self {
        Self { kind: "application/json", text }
    }
}

/// TCP port on the loopback interface, bound before the work to be shown begins.
pub struct Port {
    listener: TcpListener,
    address: SocketAddr,
}

impl Port {
    /// Binds a port; 0 selects a free one.
    ///
    /// # Errors
    /// [`CommandError::BadInput`] if the port cannot be bound.
    pub fn take(port: u16) -> Result<Self, CommandError> {
        let refused = |e: std::io::Error| {
            CommandError::BadInput(format!(
                "--live={port}: {e}\n  name another port, or none: --live takes one that is free"
            ))
        };
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(refused)?;
        let address = listener.local_addr().map_err(refused)?;
        listener.set_nonblocking(true).map_err(refused)?;
        Ok(Self { listener, address })
    }

    /// URL of the page.
    pub fn url(&self) -> String {
        format!("http://{}/", self.address)
    }

    /// Starts to serve content on the port, in a thread of its own.
    ///
    /// # Errors
    /// [`CommandError::Broken`] if the system cannot start a thread.
    pub fn show(self, shown: Arc<dyn Shown>) -> Result<Live, CommandError> {
        let broken = |e: std::io::Error| CommandError::broken(format!("the page cannot be served: {e}"));
        let (end, ended) = watch::channel(false);
        let runtime =
            tokio::runtime::Builder::new_current_thread().enable_all().max_blocking_threads(2).build();
        let runtime = runtime.map_err(broken)?;
        let thread = std::thread::Builder::new().name("page".into()).spawn(move || {
            if let Err(e) = runtime.block_on(serve(self, shown, ended)) {
                tracing::warn!("the page is served no more: {e}");
            }
            // What a reader has asked for and nobody waits for any more need not be finished.
            runtime.shutdown_background();
        });
        Ok(Live { end, thread: thread.map_err(broken)? })
    }
}

/// Running server of a page.
pub struct Live {
    end: watch::Sender<bool>,
    thread: JoinHandle<()>,
}

impl Live {
    /// Announces the end to readers, waits briefly for them to fetch the final state, and stops the server.
    pub fn end(self) {
        let _ = self.end.send(true);
        let _ = self.thread.join();
    }
}

async fn serve(port: Port, shown: Arc<dyn Shown>, mut ended: watch::Receiver<bool>) -> std::io::Result<()> {
    let listener = tokio::net::TcpListener::from_std(port.listener)?;
    let (news, _) = watch::channel(News::default());
    let news = Arc::new(news);
    tokio::spawn(news::watch(Arc::clone(&shown), Arc::clone(&news)));
    let connections = Arc::new(Connections::default());
    let accept = async {
        loop {
            // What goes wrong with one connection is no matter of the others.
            let Ok((stream, _)) = listener.accept().await else {
                tokio::time::sleep(LOOK_EVERY).await;
                continue;
            };
            let (shown, news) = (Arc::clone(&shown), Arc::clone(&news));
            let place = connections.open(MOST_CONNECTIONS);
            let asked = place.clone();
            let service = service_fn(move |request| {
                asked.has_asked();
                answers::answer(request, port.address.port(), Arc::clone(&shown), Arc::clone(&news))
            });
            let connections = Arc::clone(&connections);
            tokio::spawn(async move {
                let mut http = http1::Builder::new();
                http.timer(TokioTimer::new()).header_read_timeout(ASK_WITHIN);
                tokio::select! {
                    _ = http.serve_connection(TokioIo::new(stream), service) => (),
                    () = place.evicted() => (),
                }
                connections.close(&place);
            });
        }
    };
    let over = async {
        let _ = ended.wait_for(|ended| *ended).await;
        news.send_modify(|news| *news = News { revision: news.revision + 1, ended: true });
        let _ = tokio::time::timeout(LINGER, news.closed()).await;
    };
    tokio::select! {
        () = accept => (),
        () = over => (),
    }
    Ok(())
}
