//! Tests of the planner's public interface, in one program, so that shared code is built and linked
//! once.

mod attachments;
mod broken;
mod classical;
mod differential;
mod durations;
mod formatting;
mod layers;
mod linear;
mod modules;
mod numeric;
mod objects;
mod optimal;
mod preferences;
mod reading;
mod replanning;
mod solving;
mod temporal;
mod timed_literals;
mod unit;
mod unsolvable;
mod validating;
mod without;
