//! Store in MongoDB, as in paper 004 (section IV): one document per record, found by time, with
//! large data in GridFS. Several robots write into one store under names of their own; a database
//! shards if one machine is not enough.
//!
//! | collection | holds |
//! |---|---|
//! | `records` | a document for each record: `_id` its number above the index of its name, the fields of [`Document`], `blobs[].file` and `blobs[].crc32` of its files, `pins`, `bytes`; `pending` while it is being written or removed, and by whom |
//! | `fs.files`, `fs.chunks` | blobs (GridFS), named `kind/number/blob` |
//! | `names` | a document for each name: its place among them (`index`), the last number it gave to a record (`last`) |

mod keep;
#[doc(hidden)]
pub mod number;
mod query;
mod write;

use crate::document::{BlobInfo, Document, Order, Query, RecordId};
use crate::error::Error;
use crate::stores::local::Durability;
use crate::stores::{Count, Fault, Report, Retention, Stats, Store, no_blob};
use mongodb::IndexModel;
use mongodb::bson::{self, Bson, Document as Fields, doc, oid::ObjectId};
use mongodb::error::{Error as Refusal, ErrorKind, WriteFailure};
use mongodb::options::{
    Acknowledgment, ClientOptions, CollectionOptions, Credential, GridFsBucketOptions, WriteConcern,
};
use mongodb::sync::gridfs::GridFsBucket;
use mongodb::sync::{Client, Collection, Database};
use number::Name;
use std::collections::{BTreeMap, BTreeSet};
use std::io::Read;
use std::sync::atomic::AtomicU64;
use std::time::Duration;

/// Maximum time for an answer of the server.
const SERVER_WAIT: Duration = Duration::from_secs(5);
/// Default database name.
const DATABASE: &str = "descry";

/// Options of a store in MongoDB.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MongoOptions {
    /// Name of the robot; one process at a time writes under a name. Queries without a robot, counts, limits
    /// and verification concern the records of that name, or all records if it is "".
    pub robot: String,
    /// Condition for acknowledging a write: in the journal of a majority of servers, or in the memory of one.
    pub durability: Durability,
    /// Limits beyond which old data is pruned.
    pub retention: Retention,
    /// User name and password, if the server requires them.
    pub login: Option<(String, String)>,
}

/// A store in a MongoDB server.
pub struct MongoStore {
    place: String,
    name: Name,
    retention: Retention,
    database: Database,
    records: Collection<Fields>,
    names: Collection<Fields>,
    files: GridFsBucket,
    /// Number of bytes written since the limits were checked.
    unchecked: AtomicU64,
}

impl MongoStore {
    /// Opens the store at an address such as `mongodb://host:27017/database` for writing. Unfinished data of
    /// a killed process of that name is removed.
    ///
    /// # Errors
    /// [`Error::Remote`] if no server answers there, [`Error::Input`] for a limit that no server can keep.
    pub fn open(address: &str, options: &MongoOptions) -> Result<Self, Error> {
        if options.retention.min_free_bytes.is_some() {
            return Err(Error::Input {
                what: "a MongoDB server keeps the room of what is deleted, so that no room on its disk can be kept free".into(),
                mend: "bound the record by bytes or by age".into(),
            });
        }
        apart(|| {
            let mut store = Self::connect(address, options)?;
            store.make_indexes()?;
            store.name.index = Some(store.take_index()?);
            if !store.name.robot.is_empty() {
                store.remove_pending()?;
                store.free_numbers()?;
            }
            Ok(store)
        })
    }

    /// Opens the store at an address for reading.
    ///
    /// # Errors
    /// [`Error::Remote`] if no server answers there.
    pub fn open_shared(address: &str, options: &MongoOptions) -> Result<Self, Error> {
        apart(|| {
            let mut store = Self::connect(address, options)?;
            store.name.index = store.index()?;
            Ok(store)
        })
    }

    /// Names of the robots with records, sorted.
    ///
    /// # Errors
    /// If the store cannot be read.
    pub fn robots(&self) -> Result<Vec<String>, Error> {
        apart(|| self.distinct("robot", self.own()))
    }

    fn distinct(&self, field: &str, filter: Fields) -> Result<Vec<String>, Error> {
        let found = self.said(self.records.distinct(field, filter).run())?;
        let mut values: Vec<String> = found.iter().filter_map(|v| v.as_str().map(str::to_owned)).collect();
        values.sort();
        Ok(values)
    }

    fn connect(address: &str, with: &MongoOptions) -> Result<Self, Error> {
        // Whoever reads an error must not read a password.
        let place =
            address.rsplit_once('@').map_or(address.to_owned(), |(_, host)| format!("mongodb://{host}"));
        let remote =
            |because: Refusal| Error::Remote { place: place.clone(), because: because.kind.to_string() };
        let mut options = ClientOptions::parse(address).run().map_err(remote)?;
        options.server_selection_timeout = Some(SERVER_WAIT);
        options.connect_timeout = Some(SERVER_WAIT);
        if let Some((name, password)) = with.login.clone() {
            options.credential = Some(Credential::builder().username(name).password(password).build());
        }
        let client = Client::with_options(options).map_err(remote)?;
        let database = client.default_database().unwrap_or_else(|| client.database(DATABASE));
        let concern = match with.durability {
            Durability::Disk => journalled(),
            Durability::Process => WriteConcern::builder().w(Acknowledgment::Nodes(1)).build(),
        };
        let kept = CollectionOptions::builder().write_concern(concern.clone()).build();
        let files = GridFsBucketOptions::builder().write_concern(concern).build();
        Ok(MongoStore {
            name: Name { robot: with.robot.clone(), index: None },
            retention: with.retention,
            records: database.collection_with_options("records", kept.clone()),
            names: database.collection_with_options("names", kept),
            files: database.gridfs_bucket(files),
            database,
            place,
            // The first record looks at the limits.
            unchecked: AtomicU64::new(with.retention.max_bytes.unwrap_or(0)),
        })
    }

    fn make_indexes(&self) -> Result<(), Error> {
        let keys = [
            doc! { "stamp_ns": 1, "_id": 1 },
            doc! { "kind": 1, "stamp_ns": 1, "_id": 1 },
            doc! { "kind": 1, "frame": 1, "stamp_ns": 1, "_id": 1 },
            doc! { "robot": 1, "stamp_ns": 1, "_id": 1 },
            doc! { "robot": 1, "kind": 1, "stamp_ns": 1, "_id": 1 },
            doc! { "robot": 1, "kind": 1, "frame": 1, "stamp_ns": 1, "_id": 1 },
            doc! { "objects.object": 1, "objects.confidence": 1 },
            doc! { "pins": 1 },
            doc! { "pending": 1 },
        ];
        let indexes = keys.map(|keys| IndexModel::builder().keys(keys).build());
        self.said(self.records.create_indexes(indexes).run()).map(|_| ())
    }

    /// Converts an error of the driver to one of this crate.
    fn said<T>(&self, answer: mongodb::error::Result<T>) -> Result<T, Error> {
        /// Error code `OutOfDiskSpace`.
        const NO_ROOM: i32 = 14031;
        answer.map_err(|refusal| match &*refusal.kind {
            ErrorKind::Command(c) if c.code == NO_ROOM => Error::Full { place: self.place.clone().into() },
            ErrorKind::Write(WriteFailure::WriteError(e)) if e.code == NO_ROOM => {
                Error::Full { place: self.place.clone().into() }
            }
            ErrorKind::ServerSelection { .. } => self.remote(format!(
                "no server answers there within {} s: start one, or mend the address",
                SERVER_WAIT.as_secs()
            )),
            kind => self.remote(kind),
        })
    }

    fn remote(&self, because: impl std::fmt::Display) -> Error {
        Error::Remote { place: self.place.clone(), because: because.to_string() }
    }

    /// Filter for the complete records of this store's robot, or of all robots if it has no name.
    fn own(&self) -> Fields {
        query::filter(&Query::default(), &self.name)
    }

    fn document(&self, mut fields: Fields) -> Result<Document, Error> {
        let id = number_of(&fields).map(|id| self.name.outward(id));
        let id = id.map_or(Bson::Null, |id| Bson::Int64(id.0 as i64));
        fields.insert("id", id.clone());
        bson::deserialize_from_document(fields).map_err(|e| Error::Damaged {
            place: format!("{}, record {id}", self.place).into(),
            at: 0,
            what: format!("it is no document of a record: {e}"),
        })
    }

    fn one(&self, id: RecordId) -> Result<Fields, Error> {
        let this = doc! { "_id": self.name.inward(id), "pending": { "$exists": false } };
        self.said(self.records.find_one(this).run())?.ok_or(Error::Missing { id: id.0 })
    }

    /// Reads and verifies the `n`-th blob of a record, from 0.
    fn whole_blob(
        &self,
        document: &Document,
        fields: &Fields,
        n: usize,
        info: &BlobInfo,
    ) -> Result<Vec<u8>, Error> {
        let (file, crc32) = file_of(fields, n).ok_or_else(|| no_blob(document, &info.name))?;
        let mut bytes = Vec::new();
        let mut stream = self.said(self.files.open_download_stream(file.into()).run())?;
        stream.read_to_end(&mut bytes).map_err(|e| self.remote(e))?;
        if bytes.len() as u64 != info.bytes || crc32.is_some_and(|c| c != crc32fast::hash(&bytes)) {
            let what =
                format!("record {}: the file of blob `{}` is not what was written", document.id, info.name);
            return Err(Error::Damaged { place: self.place.clone().into(), at: 0, what });
        }
        Ok(bytes)
    }

    /// First document that matches a query and a further condition, in ascending (`sign` 1) or descending
    /// (-1) order of time.
    fn first(&self, query: &Query, side: Fields, sign: i32) -> Result<Option<Document>, Error> {
        let filter = doc! { "$and": [query::filter(query, &self.name), side] };
        let mut find = self.records.find(filter).sort(doc! { "stamp_ns": sign, "_id": sign });
        if !query::is_of_places(query) {
            find = find.limit(1);
        }
        for fields in self.said(find.run())? {
            let document = self.document(self.said(fields)?)?;
            if query::is_there(query, &document) {
                return Ok(Some(document));
            }
        }
        Ok(None)
    }

    fn verify_one(&self, fields: Fields, report: &mut Report) {
        let record = number_of(&fields).map(|id| self.name.outward(id));
        let bytes = fields.get_i64("bytes").unwrap_or(0);
        let whole = self.document(fields.clone()).and_then(|document| {
            for (n, info) in document.blobs.iter().enumerate() {
                self.whole_blob(&document, &fields, n, info)?;
            }
            Ok(())
        });
        match whole {
            Ok(()) => {
                report.whole += 1;
                report.bytes += bytes as u64;
            }
            Err(e) => report.faults.push(Fault { record, place: self.place.clone(), what: e.to_string() }),
        }
    }
}

/// Write concern for data in the journal of a majority of servers.
fn journalled() -> WriteConcern {
    WriteConcern::builder().w(Acknowledgment::Majority).journal(true).build()
}

fn number_of(fields: &Fields) -> Option<i64> {
    fields.get_i64("_id").ok()
}

/// File ID and checksum of the `n`-th blob of a record, from 0; `None` without one.
fn file_of(fields: &Fields, n: usize) -> Option<(ObjectId, Option<u32>)> {
    let blob = fields.get_array("blobs").ok()?.get(n)?.as_document()?;
    let crc32 = blob.get_i64("crc32").ok().and_then(|c| u32::try_from(c).ok());
    Some((blob.get_object_id("file").ok()?, crc32))
}

/// Converts any BSON number to an integer; `None` for other values.
fn whole(value: &Bson) -> Option<i64> {
    match value {
        Bson::Int32(n) => Some(i64::from(*n)),
        Bson::Int64(n) => Some(*n),
        Bson::Double(n) => Some(*n as i64),
        _ => None,
    }
}

/// Runs work on a thread of its own, since the driver blocks, which is not allowed in asynchronous tasks.
fn apart<T: Send>(work: impl FnOnce() -> Result<T, Error> + Send) -> Result<T, Error> {
    std::thread::scope(|scope| scope.spawn(work).join()).unwrap_or_else(|_| {
        Err(Error::Remote { place: "MongoDB".into(), because: "the driver failed".into() })
    })
}

impl Store for MongoStore {
    fn append(&self, drafts: &[crate::document::Draft]) -> Result<Vec<RecordId>, Error> {
        apart(|| self.record(drafts))
    }

    fn get(&self, id: RecordId) -> Result<Document, Error> {
        apart(|| self.document(self.one(id)?))
    }

    fn blob(&self, id: RecordId, name: &str) -> Result<Vec<u8>, Error> {
        apart(|| {
            let fields = self.one(id)?;
            let document = self.document(fields.clone())?;
            let mut blobs = document.blobs.iter().enumerate();
            let (n, info) = blobs.find(|(_, b)| b.name == name).ok_or_else(|| no_blob(&document, name))?;
            self.whole_blob(&document, &fields, n, info)
        })
    }

    fn find(&self, query: &Query) -> Result<Vec<Document>, Error> {
        let sign = if query.order == Order::Oldest { 1 } else { -1 };
        let most = query.limit.unwrap_or(usize::MAX);
        if most == 0 {
            return Ok(Vec::new());
        }
        apart(|| {
            let filter = query::filter(query, &self.name);
            let mut find = self.records.find(filter).sort(doc! { "stamp_ns": sign, "_id": sign });
            if let (Ok(limit), false) = (i64::try_from(most), query::is_of_places(query)) {
                find = find.limit(limit);
            }
            let mut found = Vec::new();
            for fields in self.said(find.run())? {
                let document = self.document(self.said(fields)?)?;
                if query::is_there(query, &document) {
                    found.push(document);
                }
                if found.len() >= most {
                    break;
                }
            }
            Ok(found)
        })
    }

    fn nearest(&self, query: &Query, stamp_ns: i64) -> Result<Option<Document>, Error> {
        apart(|| {
            let query = Query { after: None, ..query.clone() };
            let before = self.first(&query, doc! { "stamp_ns": { "$lte": stamp_ns } }, -1)?;
            let off = |d: &Document| d.stamp_ns.abs_diff(stamp_ns);
            if before.as_ref().is_some_and(|d| off(d) == 0) {
                return Ok(before);
            }
            let after = self.first(&query, doc! { "stamp_ns": { "$gt": stamp_ns } }, 1)?;
            match (before, after) {
                (Some(b), Some(a)) if off(&b) <= off(&a) => Ok(Some(b)),
                (_, Some(a)) => self.first(&query, doc! { "stamp_ns": a.stamp_ns }, -1),
                (before, None) => Ok(before),
            }
        })
    }

    fn frames(&self, kind: &str) -> Result<Vec<String>, Error> {
        apart(|| self.distinct("frame", query::filter(&Query::of_kind(kind), &self.name)))
    }

    fn pin(&self, ids: &[RecordId], by: &str) -> Result<(), Error> {
        apart(|| self.pin_records(ids, by, false))
    }

    fn hold(&self, ids: &[RecordId], by: &str) -> Result<(), Error> {
        apart(|| self.pin_records(ids, by, true))
    }

    fn unpin(&self, by: &str) -> Result<(), Error> {
        apart(|| self.unpin_records(by))
    }

    fn pins(&self) -> Result<BTreeMap<RecordId, BTreeSet<String>>, Error> {
        apart(|| {
            let mut pins = BTreeMap::new();
            let pinned = doc! { "$and": [self.own(), { "pins.0": { "$exists": true } }] };
            for fields in self.said(self.records.find(pinned).run())? {
                let fields = self.said(fields)?;
                let (Some(id), Ok(by)) = (number_of(&fields), fields.get_array("pins")) else { continue };
                pins.insert(
                    self.name.outward(id),
                    by.iter().filter_map(|b| b.as_str().map(str::to_owned)).collect(),
                );
            }
            Ok(pins)
        })
    }

    /// Makes earlier writes durable: a journalled write implies the durability of all before it.
    fn sync(&self) -> Result<(), Error> {
        apart(|| {
            let touch = doc! { "$inc": { "synced": 1_i64 } };
            let own = self.names.update_one(doc! { "_id": &self.name.robot }, touch);
            self.said(own.write_concern(journalled()).run()).map(|_| ())
        })
    }

    fn prune(&self, retention: &Retention) -> Result<u64, Error> {
        apart(|| Ok(self.keep_within(retention, 0, i64::MAX)?.0))
    }

    fn stats(&self) -> Result<Stats, Error> {
        apart(|| {
            let mut stats = Stats::default();
            let by_kind = doc! { "$group": {
                "_id": "$kind", "records": { "$sum": 1_i64 }, "bytes": { "$sum": "$bytes" },
                "oldest": { "$min": "$stamp_ns" }, "newest": { "$max": "$stamp_ns" },
            } };
            for row in self.said(self.records.aggregate([doc! { "$match": self.own() }, by_kind]).run())? {
                let row = self.said(row)?;
                let number = |key: &str| row.get(key).and_then(whole).unwrap_or(0);
                let count = Count { records: number("records") as u64, bytes: number("bytes") as u64 };
                stats.records += count.records;
                stats.bytes += count.bytes;
                stats.oldest_ns = Some(stats.oldest_ns.map_or(number("oldest"), |o| o.min(number("oldest"))));
                stats.newest_ns = Some(stats.newest_ns.map_or(number("newest"), |n| n.max(number("newest"))));
                stats.kinds.insert(row.get_str("_id").unwrap_or("").to_owned(), count);
            }
            let pinned = doc! { "$and": [self.own(), { "pins.0": { "$exists": true } }] };
            stats.pinned = self.said(self.records.count_documents(pinned).run())?;
            Ok(stats)
        })
    }

    fn verify(&self) -> Result<Report, Error> {
        apart(|| {
            let mut report = Report::default();
            for fields in self.said(self.records.find(self.own()).sort(doc! { "_id": 1 }).run())? {
                self.verify_one(self.said(fields)?, &mut report);
            }
            Ok(report)
        })
    }
}
