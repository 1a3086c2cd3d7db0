//! A page that shows something while it goes on: a thread of its own serves it to browsers on this machine, and to nobody else.
//!
//! Readers ask and get; nothing that they send reaches what is shown. A page of another site that makes a browser ask is refused: by
//! the `Host` that it names (a name of its own that leads here), by its `Origin`, and by what browsers are told in the answer.

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

/// The part of a page's script that hears of news.
pub const FOLLOW: &str = include_str!("live/follow.js");

/// How often it is looked whether there is something new, while somebody reads.
const LOOK_EVERY: Duration = Duration::from_millis(250);
/// How long readers are waited for that have not fetched the end yet.
const LINGER: Duration = Duration::from_secs(5);
/// Most connections at a time; for a further one another is closed, first one that has not asked for anything.
const MOST_CONNECTIONS: usize = 64;
/// Within this a reader must have said what it wants.
const ASK_WITHIN: Duration = Duration::from_secs(10);

/// Something that goes on, and its page.
pub trait Shown: Send + Sync + 'static {
    /// Another number whenever there is something new.
    fn revision(&self) -> u64;

    /// What is found at a path, the page itself at `/`; none if nothing is.
    ///
    /// # Errors
    /// [`CommandError`] if it cannot be told now; it may be later.
    fn at(&self, path: &str) -> Result<Option<Found>, CommandError>;
}

/// What is found at a path.
pub struct Found {
    /// Its media type.
    pub kind: &'static str,
    /// Its text.
    pub text: String,
}

impl Found {
    /// A page.
    pub fn html(text: String) -> Self {
        Self { kind: "text/html; charset=utf-8", text }
    }

    /// Something for the script of a page.
    pub fn json(text: String) -> Self {
        Self { kind: "application/json", text }
    }
}

/// A port on this machine, taken before anything begins that is to be shown there.
pub struct Port {
    listener: TcpListener,
    address: SocketAddr,
}

impl Port {
    /// Takes a port; 0: any that is free.
    ///
    /// # Errors
    /// [`CommandError::BadInput`] if it is not to be had.
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

    /// Where the page will be.
    pub fn url(&self) -> String {
        format!("http://{}/", self.address)
    }

    /// Begins to show something there.
    ///
    /// # Errors
    /// [`CommandError::Broken`] if the system gives no thread.
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

/// A page that is served.
pub struct Live {
    end: watch::Sender<bool>,
    thread: JoinHandle<()>,
}

impl Live {
    /// Says that nothing new will come, and waits a moment for readers to fetch the end.
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
