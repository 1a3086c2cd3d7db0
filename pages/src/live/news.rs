//! That there is something new, for readers who listen.

use std::sync::Arc;

use futures_util::{Stream, StreamExt, stream};
use hyper::body::{Bytes, Frame};
use tokio::sync::watch;

use super::{LOOK_EVERY, Shown};

/// How far what is shown has come.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct News {
    /// Another one whenever there is something new.
    pub revision: u64,
    /// Whether nothing more will come.
    pub ended: bool,
}

/// Looks for something new as long as somebody listens.
pub async fn watch(shown: Arc<dyn Shown>, news: Arc<watch::Sender<News>>) {
    loop {
        tokio::time::sleep(LOOK_EVERY).await;
        if news.is_closed() {
            continue;
        }
        let shown = Arc::clone(&shown);
        let Ok(revision) = tokio::task::spawn_blocking(move || shown.revision()).await else { continue };
        news.send_if_modified(|news| {
            let is_new = !news.ended && news.revision != revision;
            if is_new {
                news.revision = revision;
            }
            is_new
        });
    }
}

/// The news as server-sent events: how it stands now, and whenever that changes, until the reader goes away.
pub fn events(news: watch::Receiver<News>) -> impl Stream<Item = Result<Frame<Bytes>, std::io::Error>> {
    let now = stream::once(async move { news }).flat_map(|mut news| {
        let first = *news.borrow_and_update();
        let later = stream::unfold(news, async |mut news| {
            news.changed().await.ok()?;
            let next = *news.borrow_and_update();
            Some((next, news))
        });
        stream::iter([first]).chain(later)
    });
    now.map(|News { revision, ended }| {
        let event = format!("data: {{\"revision\": {revision}, \"ended\": {ended}}}\n\n");
        Ok(Frame::data(Bytes::from(event)))
    })
}
