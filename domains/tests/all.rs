//! Promises of domains, tested from outside: one program, so that what all tests share is built and linked
//! once.

mod phrases;
mod unit;
