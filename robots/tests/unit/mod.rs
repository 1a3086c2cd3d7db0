//! Tests of single modules.

mod sim_composed;
mod sim_laser;
mod sim_stereo;
