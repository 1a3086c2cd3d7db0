//! Notification of readers about new revisions of the content.

use std::sync::Arc;

use futures_util::{Stream, StreamExt, stream};
use hyper::body::{Bytes, Frame};
use tokio::sync::watch;

use super::{LOOK_EVERY, Shown};

/// State of the shown content.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct News {
    /// Current revision number; changes with every update.
    pub revision: u64,
    /// True if no further update follows.
    pub ended: bool,
}

/// Checks for new revisions periodically while a reader is subscribed, and announces them in `news`; never returns.
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

/// Updates as server-sent events: the current state, then each change, until the reader disconnects.
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
