//! Retention: the oldest records are removed first, together with the files of their blobs.

use super::{MongoStore, number_of, whole};
use crate::document::Draft;
use crate::error::Error;
use crate::stores::Retention;
use mongodb::bson::{Bson, Document as Fields, doc, oid::ObjectId};
use std::sync::atomic::Ordering;

/// Number of records removed at a time.
const AT_A_TIME: i64 = 64;

impl MongoStore {
    /// Makes room for `coming` bytes of drafts. With a size limit, the limits are checked once for every
    /// sixty-fourth of it that is written, else each time.
    ///
    /// # Errors
    /// [`Error::Bounded`] if pinned records, and those of the same moment, leave too little.
    pub(super) fn make_room(&self, coming: u64, drafts: &[Draft]) -> Result<(), Error> {
        if self.retention == Retention::default() {
            return Ok(());
        }
        let bound = self.retention.max_bytes.unwrap_or(u64::MAX);
        let unchecked = self.unchecked.fetch_add(coming, Ordering::Relaxed) + coming;
        if bound < u64::MAX && unchecked < bound / 64 {
            return Ok(());
        }
        self.unchecked.store(0, Ordering::Relaxed);
        let now_ns = drafts.iter().map(Draft::until_ns).max().unwrap_or(i64::MAX);
        let refused = |staying: u64| {
            let place = self.place.clone();
            Err(Error::Bounded { place, bound, coming, staying, held: self.holders()? })
        };
        let must_fit = !drafts.iter().all(Draft::is_of_pins);
        let pinned = self.bytes(doc! { "pins.0": { "$exists": true } })?;
        if must_fit && pinned.saturating_add(coming) > bound {
            return refused(pinned);
        }
        let over = self.keep_within(&self.retention, coming, now_ns)?.1;
        // What was to be spare until the limits are looked at again may be used up.
        if must_fit && over > bound / 64 { refused(self.bytes(doc! {})?) } else { Ok(()) }
    }

    /// Removes records until the limits hold with `coming` more bytes; data from `now_ns` on stays. Returns
    /// the number of removed records, and the bytes by which the size limit is still exceeded.
    pub(super) fn keep_within(
        &self,
        retention: &Retention,
        coming: u64,
        now_ns: i64,
    ) -> Result<(u64, u64), Error> {
        let mut gone = 0;
        if let Some(age_ns) = retention.max_age_ns
            && let Some(newest_ns) = self.newest_ns()?
        {
            let oldest = newest_ns.saturating_sub(age_ns).min(now_ns);
            while let (records @ 1.., _) = self.remove_oldest(oldest, u64::MAX)? {
                gone += records;
            }
        }
        let mut over = match retention.max_bytes {
            // A sixty-fourth below, since only then the limits are looked at again.
            Some(bound) => (self.bytes(doc! {})? + coming).saturating_sub(bound - bound / 64),
            None => 0,
        };
        while over > 0 {
            let (records, bytes) = self.remove_oldest(now_ns, over)?;
            if records == 0 {
                break;
            }
            gone += records;
            over = over.saturating_sub(bytes);
        }
        Ok((gone, over))
    }

    /// Names of the holders of pins, with the number and the bytes of the records that each holds, largest
    /// first.
    fn holders(&self) -> Result<Vec<(String, u64, u64)>, Error> {
        let each = doc! { "$unwind": "$pins" };
        let sum = doc! { "$group": { "_id": "$pins", "records": { "$sum": 1_i64 }, "bytes": { "$sum": "$bytes" } } };
        let mut held = Vec::new();
        for row in self.said(self.records.aggregate([doc! { "$match": self.own() }, each, sum]).run())? {
            let row = self.said(row)?;
            let number = |key: &str| row.get(key).and_then(whole).map_or(0, |n| n.max(0) as u64);
            held.push((row.get_str("_id").unwrap_or("").to_owned(), number("records"), number("bytes")));
        }
        held.sort_by_key(|(by, _, bytes)| (std::cmp::Reverse(*bytes), by.clone()));
        Ok(held)
    }

    /// End of the record with the newest stamp, or that stamp if it has no end, nanoseconds; `None` without
    /// records.
    pub(super) fn newest_ns(&self) -> Result<Option<i64>, Error> {
        let newest = self.records.find_one(self.own()).sort(doc! { "stamp_ns": -1, "_id": -1 });
        let newest = self.said(newest.run())?;
        Ok(newest.and_then(|d| d.get_i64("end_ns").or_else(|_| d.get_i64("stamp_ns")).ok()))
    }

    /// Total bytes of documents and blobs of this store's records that meet a condition.
    fn bytes(&self, which: Fields) -> Result<u64, Error> {
        let these = doc! { "$match": { "$and": [self.own(), which] } };
        let sum = doc! { "$group": { "_id": Bson::Null, "bytes": { "$sum": "$bytes" } } };
        let row = self.said(self.records.aggregate([these, sum]).run())?.next();
        let row = row.map(|row| self.said(row)).transpose()?;
        let bytes = row.as_ref().and_then(|row| row.get("bytes")).and_then(whole).unwrap_or(0);
        Ok(bytes.max(0) as u64)
    }

    /// Removes up to [`AT_A_TIME`] of the oldest unpinned records that end before a time, until `wanted`
    /// bytes are freed. Returns the number and bytes of removed records.
    fn remove_oldest(&self, before_ns: i64, wanted: u64) -> Result<(u64, u64), Error> {
        let ended = doc! { "stamp_ns": { "$lt": before_ns }, "end_ns": { "$not": { "$gte": before_ns } } };
        let filter = doc! { "$and": [self.own(), ended, { "pins.0": { "$exists": false } }] };
        let oldest = self.records.find(filter).sort(doc! { "stamp_ns": 1, "_id": 1 }).limit(AT_A_TIME);
        let (mut ids, mut bytes) = (Vec::new(), 0);
        for fields in self.said(oldest.run())? {
            let fields = self.said(fields)?;
            ids.extend(number_of(&fields));
            bytes += fields.get_i64("bytes").map_or(0, |n| n.max(0) as u64);
            if bytes >= wanted {
                break;
            }
        }
        self.remember_numbers(&ids)?;
        self.remove(&ids)?;
        Ok((ids.len() as u64, bytes))
    }

    /// Removes records with their files. They are marked as pending first, so that no partial record is ever
    /// found.
    pub(super) fn remove(&self, ids: &[i64]) -> Result<(), Error> {
        if ids.is_empty() {
            return Ok(());
        }
        let these = doc! { "_id": { "$in": ids.to_vec() } };
        let going = doc! { "$set": { "pending": self.name.robot.clone() } };
        self.said(self.records.update_many(these.clone(), going).run())?;
        self.remove_marked(these)
    }

    /// Removes the half-written and half-removed records that a killed process of this name left.
    pub(super) fn remove_pending(&self) -> Result<(), Error> {
        self.remove_marked(doc! { "pending": self.name.robot.clone() })
    }

    fn remove_marked(&self, which: Fields) -> Result<(), Error> {
        let (mut ids, mut files): (Vec<i64>, Vec<ObjectId>) = Default::default();
        for fields in self.said(self.records.find(which).run())? {
            let fields = self.said(fields)?;
            ids.extend(number_of(&fields));
            let blobs = fields.get_array("blobs").into_iter().flatten();
            files.extend(blobs.filter_map(|b| b.as_document()?.get_object_id("file").ok()));
        }
        if ids.is_empty() {
            return Ok(());
        }
        for (collection, key) in [("fs.chunks", "files_id"), ("fs.files", "_id")] {
            let collection = self.database.collection::<Fields>(collection);
            self.said(collection.delete_many(doc! { key: { "$in": files.clone() } }).run())?;
        }
        self.said(self.records.delete_many(doc! { "_id": { "$in": ids } }).run()).map(|_| ())
    }
}
