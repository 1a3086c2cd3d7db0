#![doc = include_str!("../README.md")]

pub mod belief;
#[doc(hidden)]
pub mod clouds;
#[doc(hidden)]
pub mod document;
mod error;
mod export;
mod flusher;
#[doc(hidden)]
pub mod foxglove;
pub mod learned;
#[doc(hidden)]
pub mod packed;
mod record;
pub mod remember;
mod retrace;
#[doc(hidden)]
pub mod scans;
pub mod space;
pub mod stores;
pub mod transforms;
pub mod viewer;

pub use clouds::Sensing;
pub use descry_perception as perception;
pub use document::{
    Blob, BlobInfo, Bounds, Document, Draft, Form, Meta, Near, Order, Query, RecordId, Sighting,
};
pub use error::Error;
pub use export::{Exported, export};
pub use foxglove::LogLevel;
pub use nalgebra;
pub use record::{Image, Options, Record, kind};
pub use stores::local::{Durability, LocalOptions, LocalStore, Recovery, free_bytes};
#[cfg(feature = "mongodb")]
pub use stores::mongo::{MongoOptions, MongoStore};
pub use stores::{Count, Fault, Report, Retention, Stats, Store};
