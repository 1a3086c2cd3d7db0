//! Tests of single modules.

mod belief;
mod clouds;
mod document;
mod foxglove_descriptor;
mod packed;
mod remember;
mod remember_joined;
mod scans;
mod space;
#[cfg(feature = "mongodb")]
mod stores_mongo_number;
mod transforms;
