//! Bodies: the `Robot` trait and its implementations.
