//! Promises of the agent, tested from outside: one program, so that what all tests share is built and linked
//! once.

#[path = "../examples/own_body.rs"]
mod own_body;

mod example;
mod goals;
mod unit;
