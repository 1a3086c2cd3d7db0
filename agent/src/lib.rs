//! The continual loop.
