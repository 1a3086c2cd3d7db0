//! The other end of the protocol: a child process, or a running program.

use crate::program::process::Process;
use crate::program::socket::Socket;

/// The other end. Dropping it ends a child process, or closes the connection to a running program.
pub(super) enum Peer {
    Started(Process),
    Reached(Socket),
}

impl Peer {
    /// Message for the end of its output.
    pub fn farewell(&self) -> &'static str {
        match self {
            Self::Started(_) => "the program has ended",
            Self::Reached(_) => "it has closed the connection",
        }
    }

    /// True if the process has ended although its output may still be open. A connection reports its end
    /// itself.
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
