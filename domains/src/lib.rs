//! Words and their meanings.
