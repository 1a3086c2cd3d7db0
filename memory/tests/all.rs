//! Integration tests of records, in one binary.

mod crash;
mod damage;
mod formats;
mod record;
mod stores;
mod suite;
mod unit;
