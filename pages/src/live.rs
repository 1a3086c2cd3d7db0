//! Live page, served by its own thread to browsers on this machine alone.
//!
//! The server is read-only. It refuses requests that other sites' pages cause: by the `Host` and `Origin`
//! headers (DNS rebinding and cross-site requests), and by restrictive response headers.

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

/// Script of a page that subscribes to updates.
pub const FOLLOW: &str = include_str!("live/follow.js");

/// Interval between checks for a new revision while a reader is connected.
const LOOK_EVERY: Duration = Duration::from_millis(250);
/// Maximum wait for readers to fetch the final state.
const LINGER: Duration = Duration::from_secs(5);
/// Maximum number of open connections; a further one evicts another, preferably one that has sent no request.
const MOST_CONNECTIONS: usize = 64;
/// Time within which a client must have sent its request.
const ASK_WITHIN: Duration = Duration::from_secs(10);

/// Source of a live page.
pub trait Shown: Send + Sync + 'static {
    /// Revision of the content; changes with every update.
    fn revision(&self) -> u64;

    /// Content at a path, the page itself at `/`; none if the path does not exist.
    ///
    /// # Errors
    /// [`CommandError`] if the content is unavailable now; a later call may succeed.
    fn at(&self, path: &str) -> Result<Option<Found>, CommandError>;
}

/// Content at a path.
pub struct Found {
    /// Media type.
    pub kind: &'static str,
    /// Body.
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

    /// Starts to serve a page on the port.
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
    /// Announces the end, and waits briefly for readers to fetch the final state.
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
