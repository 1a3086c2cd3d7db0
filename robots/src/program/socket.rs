//! Connection to a running robot program.

use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream, ToSocketAddrs};
use std::os::unix::net::UnixStream;
use std::time::Duration;

/// A connection, closed on drop.
pub(super) enum Socket {
    Unix(UnixStream),
    Tcp(TcpStream),
}

/// Stream from the program.
type Reader = Box<dyn Read + Send>;
/// Stream to the program.
type Writer = Box<dyn Write + Send>;

impl Socket {
    /// Connects to `HOST:PORT`, or to the path of a Unix socket, which contains a `/`.
    ///
    /// # Errors
    /// The reason, and the expected form of an address.
    pub fn connect(address: &str, limit: Duration) -> Result<Self, String> {
        let refused = |e: std::io::Error| format!("nobody answers there: {e}\n  start the robot first");
        if address.contains('/') {
            return UnixStream::connect(address).map(Self::Unix).map_err(refused);
        }
        let none = |e: std::io::Error| {
            format!("no address: {e}\n  expected HOST:PORT, or the path of a Unix socket with a / in it")
        };
        let mut last = None;
        for place in address.to_socket_addrs().map_err(none)? {
            match TcpStream::connect_timeout(&place, limit) {
                Ok(stream) => {
                    // A request is a line that is waited for.
                    stream.set_nodelay(true).map_err(refused)?;
                    return Ok(Self::Tcp(stream));
                }
                Err(e) => last = Some(refused(e)),
            }
        }
        Err(last.unwrap_or_else(|| "no address has this name".into()))
    }

    /// Streams from and to the program.
    ///
    /// # Errors
    /// If the system has no more handles.
    pub fn ways(&self) -> Result<(Reader, Writer), String> {
        let both = match self {
            Self::Unix(s) => {
                s.try_clone().and_then(|to| Ok((Box::new(s.try_clone()?) as _, Box::new(to) as _)))
            }
            Self::Tcp(s) => {
                s.try_clone().and_then(|to| Ok((Box::new(s.try_clone()?) as _, Box::new(to) as _)))
            }
        };
        both.map_err(|e| e.to_string())
    }

    /// Closes the connection for all readers and writers; it may be closed already.
    pub fn close(&self) {
        let _ = match self {
            Self::Unix(stream) => stream.shutdown(Shutdown::Both),
            Self::Tcp(stream) => stream.shutdown(Shutdown::Both),
        };
    }
}

impl Drop for Socket {
    fn drop(&mut self) {
        self.close();
    }
}
