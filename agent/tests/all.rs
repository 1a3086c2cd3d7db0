//! Tests of the agent's public interface, in one program, so that shared code is built and linked
//! once.

#[path = "../examples/own_body.rs"]
mod own_body;

mod colours;
mod example;
mod goals;
mod lived;
mod renamed;
mod unit;
