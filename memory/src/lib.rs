//! What was seen and what is believed.
//!
//! ```
//! use descry_memory::{Options, Query, Record};
//! use serde_json::json;
//!
//! let folder = tempfile::tempdir()?;
//! let record = Record::create(folder.path(), Options::default())?;
//! record.put_document("note", 1_000_000_000, json!({ "said": "a cup" }), vec![])?;
//! record.put_document("note", 3_000_000_000, json!({ "said": "no cup" }), vec![])?;
//! record.sync()?;
//!
//! // Whoever reads locks nothing, and changes nothing.
//! let reader = Record::open_shared(folder.path())?;
//! let near = reader.nearest("note", 1_400_000_000, 500_000_000)?;
//! assert_eq!(near.body["said"], "a cup");
//! assert_eq!(reader.find(&Query::of_kind("note"))?.len(), 2);
//! assert!(reader.verify()?.faults.is_empty());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

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
