//! Who is at the other end: a program of our own, or one that was there before.

use crate::program::process::Process;
use crate::program::socket::Socket;

/// The other end. Dropping it ends a program of our own, and closes the connection to another.
pub(super) enum Peer {
    Started(Process),
    Reached(Socket),
}

impl Peer {
    /// Meaning of the end of its output.
    pub fn farewell(&self) -> &'static str {
        match self {
            Self::Started(_) => "the program has ended",
            Self::Reached(_) => "it has closed the connection",
        }
    }

    /// True if it has ended although its output may still be open. A connection says so itself.
    pub fn has_ended(&self) -> bool {
        match self {
            Self::Started(process) => process.has_ended(),
            Self::Reached(_) => false,
        }
    }

    /// Exit status and last words; empty for a remote peer.
    pub fn epitaph(&mut self) -> String {
        match self {
            Self::Started(process) => process.epitaph(),
            Self::Reached(socket) => {
                socket.close();
                String::new()
            }
        }
    }
}
