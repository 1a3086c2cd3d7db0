//! Tests of single modules.

mod batch;
mod cluster;
mod hash;
mod journal;
mod kinds;
mod page;
mod plot;
mod plot_axis;
mod statistics;
mod table;
mod write;
