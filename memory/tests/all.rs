//! What records promise, from outside: one program, so that what all tests share is built and linked once.

mod crash;
mod damage;
mod formats;
mod record;
mod stores;
mod suite;
mod unit;
