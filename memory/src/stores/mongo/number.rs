//! Record numbers in a shared store: each robot's name counts from 1 as if it were alone, so that the records
//! of one robot, and the references in its documents, do not depend on the others.
//!
//! The database key has the index of the name above the number: `_id = (index << 32) + number`. Without a
//! name the index is 0.

use super::{MongoStore, number_of};
use crate::document::RecordId;
use crate::error::Error;
use mongodb::bson::{Document as Fields, doc};
use mongodb::options::ReturnDocument;

const BITS: u32 = 32;
/// Key of the document in `names` that counts the names; no robot's name equals it.
const ALL: i64 = 0;

/// Name of the robot that a store serves; empty for all robots.
pub struct Name {
    pub robot: String,
    /// Index of the name in the store; `None` before the first record.
    pub index: Option<i64>,
}

impl Name {
    /// Converts a public record number to the database key.
    pub fn inward(&self, id: RecordId) -> i64 {
        let number = i64::try_from(id.0).unwrap_or(i64::MAX);
        if number >> BITS == 0 { (self.index.unwrap_or(0) << BITS) | number } else { number }
    }

    /// Converts public record numbers to database keys.
    pub fn all_inward(&self, ids: &[RecordId]) -> Vec<i64> {
        ids.iter().map(|id| self.inward(*id)).collect()
    }

    /// Converts a database key to the public record number, which for records of this name is without the
    /// index.
    pub fn outward(&self, number: i64) -> RecordId {
        let own = self.index == Some(number >> BITS);
        RecordId(if own { number & ((1 << BITS) - 1) } else { number }.unsigned_abs())
    }
}

impl MongoStore {
    /// Index of this store's name; `None` if it has none yet.
    pub(super) fn index(&self) -> Result<Option<i64>, Error> {
        let own = self.said(self.names.find_one(doc! { "_id": &self.name.robot }).run())?;
        Ok(own.and_then(|own| own.get_i64("index").ok()))
    }

    /// Index of this store's name; reserves the next free one if the name has none yet.
    pub(super) fn take_index(&self) -> Result<i64, Error> {
        if let Some(index) = self.index()? {
            return Ok(index);
        }
        let index = match self.name.robot.is_empty() {
            true => 0,
            false => self.count(doc! { "_id": ALL }, 1)?,
        };
        let own = doc! { "_id": &self.name.robot, "index": index, "last": 0_i64 };
        let made = self.said(self.names.insert_one(own).run());
        // Another may have been faster.
        self.index()?.map_or_else(|| made.and(Err(self.remote("its names cannot be read"))), Ok)
    }

    /// Reserves `count` consecutive record numbers; returns the first.
    pub(super) fn numbers(&self, count: usize) -> Result<u64, Error> {
        let last = self.count(doc! { "_id": &self.name.robot }, count as i64)?;
        if last >> BITS != 0 {
            let what = format!("`{}` has given away all of its numbers", self.name.robot);
            return Err(Error::Input { what, mend: "go on under another name".into() });
        }
        Ok((last - count as i64 + 1).unsigned_abs())
    }

    fn count(&self, which: Fields, more: i64) -> Result<i64, Error> {
        let take = self.names.find_one_and_update(which, doc! { "$inc": { "last": more } });
        let after = self.said(take.upsert(true).return_document(ReturnDocument::After).run())?;
        let last = after.and_then(|after| after.get_i64("last").ok());
        last.ok_or_else(|| self.remote("the last number of a name is no number"))
    }

    /// Releases the numbers that a killed process of this name reserved, but used in no complete record.
    pub(super) fn free_numbers(&self) -> Result<(), Error> {
        let newest = self.records.find_one(self.own()).sort(doc! { "_id": -1 });
        let newest = self.said(newest.run())?.and_then(|fields| number_of(&fields)).unwrap_or(0);
        let own = self.said(self.names.find_one(doc! { "_id": &self.name.robot }).run())?;
        let pruned = own.and_then(|own| own.get_i64("pruned").ok()).unwrap_or(0);
        let known = newest.max(pruned) & ((1 << BITS) - 1);
        let back = doc! { "$min": { "last": known } };
        self.said(self.names.update_one(doc! { "_id": &self.name.robot }, back).run()).map(|_| ())
    }

    /// Stores the highest of the numbers of records that are about to be removed, so that it is not used
    /// again.
    pub(super) fn remember_numbers(&self, numbers: &[i64]) -> Result<(), Error> {
        let newest = numbers.iter().max().copied().unwrap_or(0);
        let keep = doc! { "$max": { "pruned": newest } };
        self.said(self.names.update_one(doc! { "_id": &self.name.robot }, keep).run()).map(|_| ())
    }
}
