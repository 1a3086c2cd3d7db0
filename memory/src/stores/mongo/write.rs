//! Recording of documents, which stay pending until the files of their blobs are stored, so that no partial
//! record is ever found.

use super::{MongoStore, number_of};
use crate::document::{Document, Draft, RecordId};
use crate::error::Error;
use crate::stores::KEPT;
use crate::stores::local::pins;
use mongodb::bson::{self, Document as Fields, doc, oid::ObjectId};
use std::collections::BTreeSet;
use std::io::Write;

/// A record to be written: its fields, and the file IDs of its blobs.
struct Row {
    fields: Fields,
    files: Vec<ObjectId>,
}

impl MongoStore {
    /// Makes room and records a batch of drafts. A batch that cannot be recorded completely is removed again.
    pub(super) fn record(&self, drafts: &[Draft]) -> Result<Vec<RecordId>, Error> {
        if drafts.is_empty() {
            return Ok(Vec::new());
        }
        // Nothing is sent of a batch that holds something that cannot be recorded.
        let mut rows = drafts.iter().map(|draft| self.row(draft)).collect::<Result<Vec<_>, _>>()?;
        let coming = rows.iter().filter_map(|row| row.fields.get_i64("bytes").ok()).sum::<i64>();
        self.make_room(coming.max(0) as u64, drafts)?;
        let first = self.numbers(rows.len())?;
        let ids: Vec<RecordId> = (first..).take(rows.len()).map(RecordId).collect();
        for (row, id) in rows.iter_mut().zip(&ids) {
            row.fields.insert("_id", self.name.inward(*id));
        }
        if let Err(e) = self.write(&ids, &rows, drafts) {
            // What cannot be taken back now is removed when the store is next opened in that name.
            let _ = self.remove(&self.name.all_inward(&ids));
            return Err(e);
        }
        Ok(ids)
    }

    fn write(&self, ids: &[RecordId], rows: &[Row], drafts: &[Draft]) -> Result<(), Error> {
        let at_once = rows.len() == 1 && rows[0].files.is_empty();
        let documents = rows.iter().map(|row| {
            let mut fields = row.fields.clone();
            if !at_once {
                fields.insert("pending", self.name.robot.clone());
            }
            fields
        });
        self.said(self.records.insert_many(documents).run())?;
        if at_once {
            return Ok(());
        }
        for ((id, row), draft) in ids.iter().zip(rows).zip(drafts) {
            self.upload(*id, draft, &row.files)?;
        }
        let these = doc! { "_id": { "$in": self.name.all_inward(ids) }, "pending": self.name.robot.clone() };
        let done = self.said(self.records.update_many(these, doc! { "$unset": { "pending": "" } }).run())?;
        if done.matched_count != ids.len() as u64 {
            return Err(self.remote(format!(
                "another process writes under the name `{}`: give each a name of its own",
                self.name.robot
            )));
        }
        Ok(())
    }

    /// Converts a draft to its stored form, without a number.
    fn row(&self, draft: &Draft) -> Result<Row, Error> {
        let document = draft.document(RecordId(0), &self.name.robot)?;
        let files: Vec<ObjectId> = draft.blobs.iter().map(|_| ObjectId::new()).collect();
        let mut fields = fields(&document)?;
        if let Ok(blobs) = fields.get_array_mut("blobs") {
            for ((blob, file), given) in blobs.iter_mut().zip(&files).zip(&draft.blobs) {
                if let Some(blob) = blob.as_document_mut() {
                    blob.insert("file", *file);
                    blob.insert("crc32", i64::from(crc32fast::hash(&given.data)));
                }
            }
        }
        if draft.kept {
            fields.insert("pins", vec![KEPT]);
        }
        let own = bson::serialize_to_vec(&fields).map_or(0, |bytes| bytes.len() as u64);
        fields.insert("bytes", (own + document.blobs.iter().map(|b| b.bytes).sum::<u64>()) as i64);
        Ok(Row { fields, files })
    }

    /// Uploads the blobs of a record to GridFS.
    fn upload(&self, id: RecordId, draft: &Draft, files: &[ObjectId]) -> Result<(), Error> {
        for (blob, file) in draft.blobs.iter().zip(files) {
            let name = format!("{}/{id}/{}", draft.kind, blob.name);
            let about = doc! { "robot": self.name.robot.clone(), "record": self.name.inward(id), "blob": blob.name.clone() };
            let stream = self.files.open_upload_stream(name).id((*file).into()).metadata(about).run();
            let mut stream = self.said(stream)?;
            stream.write_all(&blob.data).and_then(|()| stream.close()).map_err(|e| self.remote(e))?;
        }
        Ok(())
    }

    /// Pins records on behalf of `by`, in place of the former pins of `by` if `instead`, and records the
    /// change in a document. An interruption leaves too many pins rather than too few.
    pub(super) fn pin_records(&self, ids: &[RecordId], by: &str, instead: bool) -> Result<(), Error> {
        self.check_there(ids)?;
        let now_ns = self.newest_ns()?.unwrap_or(0).max(0);
        self.add_pins(ids, by)?;
        let mut held = self.record(&[pins::pinned(now_ns, ids, by, instead)])?;
        if ids.is_empty() {
            held.clear();
        }
        self.add_pins(&held, by)?;
        held.extend_from_slice(ids);
        if instead { self.drop_pins(by, &held) } else { Ok(()) }
    }

    fn check_there(&self, ids: &[RecordId]) -> Result<(), Error> {
        let these = doc! { "_id": { "$in": self.name.all_inward(ids) }, "pending": { "$exists": false } };
        let mut there = BTreeSet::new();
        for fields in self.said(self.records.find(these).projection(doc! { "_id": 1 }).run())? {
            there.extend(number_of(&self.said(fields)?));
        }
        let missing = ids.iter().find(|id| !there.contains(&self.name.inward(**id)));
        missing.map_or(Ok(()), |id| Err(Error::Missing { id: id.0 }))
    }

    fn add_pins(&self, ids: &[RecordId], by: &str) -> Result<(), Error> {
        let these = doc! { "_id": { "$in": self.name.all_inward(ids) } };
        self.said(self.records.update_many(these, doc! { "$addToSet": { "pins": by } }).run()).map(|_| ())
    }

    /// Removes all pins of `by`, and records the change in a document.
    pub(super) fn unpin_records(&self, by: &str) -> Result<(), Error> {
        let now_ns = self.newest_ns()?.unwrap_or(0).max(0);
        self.record(&[pins::unpinned(now_ns, by)])?;
        self.drop_pins(by, &[])
    }

    fn drop_pins(&self, by: &str, but: &[RecordId]) -> Result<(), Error> {
        let others =
            doc! { "$and": [self.own(), { "pins": by, "_id": { "$nin": self.name.all_inward(but) } }] };
        self.said(self.records.update_many(others, doc! { "$pull": { "pins": by } }).run()).map(|_| ())
    }
}

/// Converts a document to the fields that are stored.
fn fields(document: &Document) -> Result<Fields, Error> {
    let mut fields = bson::serialize_to_document(document).map_err(|e| Error::Input {
        what: format!("what is to be recorded is no document of MongoDB: {e}"),
        mend: "keep whole numbers below 2^63".into(),
    })?;
    fields.remove("id");
    // What is searched for is there even where it is empty.
    let mut kept = doc! { "_id": 0_i64, "frame": document.frame.clone(), "robot": document.robot.clone() };
    kept.extend(fields);
    Ok(kept)
}
