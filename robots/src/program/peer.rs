//! Robot program at the other end of the protocol: a child process, or a running program.

use crate::program::process::Process;
use crate::program::socket::Socket;

/// Robot program at the other end. Dropping it ends a child process, or closes the connection to a running
/// program.
pub(super) enum Peer {
    Started(Process),
    Reached(Socket),
}

impl Peer {
    /// Message for the case that the program's output has ended.
    pub fn farewell(&self) -> &'static str {
        match self {
            Self::Started(_) => "the program has ended",
            Self::Reached(_) => "it has closed the connection",
        }
    }

    /// True if a child process has ended, even if its output is still open; false for a connection, whose end
    /// shows by itself.
    pub fn has_ended(&self) -> bool {
        match self {
            Self::Started(process) => process.has_ended(),
            Self::Reached(_) => false,
        }
    }

    /// Ends the program or the connection; returns the exit status and the last lines of standard error,
    /// empty for a connection.
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
