//! Lines and bytes to and from a program: one thread for each direction, with a bounded buffer.

use std::io::{BufRead, BufReader, Read, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, channel, sync_channel};
use std::thread;
use std::time::Duration;
use tokio::sync::mpsc;

/// Maximum length of a line, bytes.
const LONGEST_LINE: u64 = 4 << 20;
/// Maximum number of bytes after the hello (the first message): the cells of a map.
const MOST_HELLO_BYTES: usize = 1 << 25;
/// Maximum number of buffered messages; a program that sends more blocks.
const WAITING: usize = 16;

/// A message of a program: a line of JSON, and the bytes after the line.
pub(super) struct Message {
    pub line: String,
    pub bytes: Vec<u8>,
}

/// End of the stream, or a violation of the protocol.
#[derive(Clone, Debug)]
pub(super) enum Ended {
    Closed,
    Breach(String),
}

type Heard = Result<Message, Ended>;

/// Sender of lines to a program.
#[derive(Clone)]
pub(super) struct Lines(Sender<String>);

impl Lines {
    /// Sends a message as a line of JSON. Failures are ignored: if the program no longer reads, receiving
    /// reports it.
    pub fn send(&self, message: &impl serde::Serialize) {
        if let Ok(mut line) = serde_json::to_string(message) {
            line.push('\n');
            let _ = self.0.send(line);
        }
    }
}

/// Connection to a program: sender of lines, and receiver of messages.
pub(super) struct Link {
    lines: Lines,
    heard: mpsc::Receiver<Heard>,
    most_bytes: Arc<AtomicUsize>,
}

impl Link {
    /// Starts the threads that read and write, and receives the first message.
    ///
    /// # Errors
    /// If no message arrives within `hello_limit`, or the stream ends or violates the protocol.
    pub fn open(
        from: impl Read + Send + 'static,
        to: impl Write + Send + 'static,
        hello_limit: Duration,
    ) -> Result<(Self, Message), String> {
        let (lines, to_write) = channel();
        thread::spawn(move || write_lines(to, &to_write));
        let most_bytes = Arc::new(AtomicUsize::new(MOST_HELLO_BYTES));
        let (first, greeted) = sync_channel(1);
        let (say, heard) = mpsc::channel(WAITING);
        let most = Arc::clone(&most_bytes);
        thread::spawn(move || read_messages(BufReader::new(from), &most, &first, &say));
        match greeted.recv_timeout(hello_limit) {
            Ok(Ok(message)) => Ok((Link { lines: Lines(lines), heard, most_bytes }, message)),
            Ok(Err(Ended::Breach(because))) => Err(because),
            Ok(Err(Ended::Closed)) | Err(RecvTimeoutError::Disconnected) => {
                Err("it ended without a hello".into())
            }
            Err(RecvTimeoutError::Timeout) => {
                Err(format!("no hello came within {} s", hello_limit.as_secs_f64()))
            }
        }
    }

    /// Sets the maximum number of bytes after the line of each further message.
    pub fn allow_bytes(&self, most: usize) {
        self.most_bytes.store(most, Ordering::Relaxed);
    }

    /// Returns another sender of lines to the program.
    pub fn lines(&self) -> Lines {
        self.lines.clone()
    }

    /// Receives the next message.
    ///
    /// # Errors
    /// The end of the stream, or a violation of the protocol.
    pub async fn next(&mut self) -> Heard {
        self.heard.recv().await.unwrap_or(Err(Ended::Closed))
    }
}

fn write_lines(mut to: impl Write, lines: &Receiver<String>) {
    for line in lines {
        if to.write_all(line.as_bytes()).and_then(|()| to.flush()).is_err() {
            return;
        }
    }
}

fn read_messages(
    mut from: impl BufRead,
    most: &AtomicUsize,
    first: &SyncSender<Heard>,
    say: &mpsc::Sender<Heard>,
) {
    let mut greeted = false;
    loop {
        let heard = read_message(&mut from, most);
        let ended = heard.is_err();
        let taken = if greeted { say.blocking_send(heard).is_ok() } else { first.send(heard).is_ok() };
        greeted = true;
        if ended || !taken {
            return;
        }
    }
}

fn read_message(from: &mut impl BufRead, most: &AtomicUsize) -> Heard {
    let line = read_line(from)?;
    // Bytes follow where the line says so; all else about it is for who takes it.
    #[derive(serde::Deserialize)]
    struct Length {
        #[serde(default)]
        bytes: usize,
    }
    let Ok(Length { bytes }) = serde_json::from_str(&line) else {
        return Err(Ended::Breach(format!("it said no JSON object: {}", start_of(&line))));
    };
    let most = most.load(Ordering::Relaxed);
    if bytes > most {
        return Err(Ended::Breach(format!("it announced {bytes} bytes, expected {most} at most")));
    }
    let mut blob = vec![0; bytes];
    from.read_exact(&mut blob).map_err(|_| Ended::Breach(format!("it ended within {bytes} bytes")))?;
    Ok(Message { line, bytes: blob })
}

fn read_line(from: &mut impl BufRead) -> Result<String, Ended> {
    let mut line = Vec::new();
    let read = from.take(LONGEST_LINE).read_until(b'\n', &mut line);
    match read {
        Ok(0) | Err(_) => return Err(Ended::Closed),
        Ok(_) => {}
    }
    if line.last() != Some(&b'\n') {
        let full = line.len() as u64 == LONGEST_LINE;
        let why = if full {
            format!("a line has more than {LONGEST_LINE} bytes")
        } else {
            "it ended within a line".into()
        };
        return Err(Ended::Breach(why));
    }
    String::from_utf8(line).map_err(|_| Ended::Breach("a line is not UTF-8".into()))
}

/// Start of a line between backquotes, shortened for display.
pub(super) fn start_of(line: &str) -> String {
    const SHOWN: usize = 120;
    let start: String = line.trim_end().chars().take(SHOWN).collect();
    if start.len() < line.trim_end().len() { format!("`{start}…`") } else { format!("`{start}`") }
}
