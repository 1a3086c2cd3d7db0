//! Tests of the agent's public interface, in one program, so that shared code is built and linked
//! once.

#[path = "../examples/own_body.rs"]
mod own_body;

#[allow(dead_code)]
#[path = "../../experiments/measure/src/evaluate/lies.rs"]
mod lies;
#[allow(dead_code)]
#[path = "../../experiments/measure/src/evaluate/room.rs"]
mod room;
#[path = "../../perception/tests/tabletop/mod.rs"]
mod tabletop;

mod colours;
mod example;
mod goals;
mod lived;
mod pouring;
mod renamed;
mod sensor_faults;
mod unit;
