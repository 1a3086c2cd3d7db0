//! Integration tests of pages, in one binary.

mod unit;
