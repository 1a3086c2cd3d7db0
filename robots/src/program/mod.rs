//! Robot as a program in any language: one JSON message a line, followed by raw bytes for maps and images,
//! over standard input and output or a socket. `robots/PROTOCOL.md` describes the protocol.
//!
//! A program is not trusted: its time, output and memory are limited, it sees no secrets of the environment,
//! and any violation of the protocol ends the program, with [`Failure::Broken`](crate::Failure::Broken) and
//! the reason.

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
