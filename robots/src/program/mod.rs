//! A robot that is a program in any language: one JSON line a message, raw bytes after it for maps and images, over its standard
//! input and output or a socket. The protocol is `robots/PROTOCOL.md`.
//!
//! A program is not trusted: it has limits on time, on what it may send and on memory, it sees no secrets of the environment, and
//! whatever it does that the protocol does not allow ends it, with [`Failure::Broken`](crate::Failure::Broken) that says what.

mod hello;
mod link;
mod message;
mod peer;
mod places;
mod process;
mod robot;
mod socket;
mod talk;

pub use hello::PROTOCOL;
pub use robot::{Limits, ProgramRobot};
