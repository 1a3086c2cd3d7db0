//! Integration tests of bodies, in one binary.

mod camera;
mod conformance;
mod consistency;
mod flat;
mod folders;
mod home;
mod import;
mod pinned;
mod program;
mod recorded;
mod route;
mod scene;
mod scenes;
mod sim;
mod taped;
mod unit;
mod unmapped;
