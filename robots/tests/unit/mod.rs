//! Tests of single modules.

mod sim_composed;
mod sim_laser;
mod sim_light;
mod sim_stereo;
