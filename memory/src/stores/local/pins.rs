//! Pins of records: stored as documents, and in the index.

use crate::document::{Document, Draft, RecordId};
use crate::stores::{KEPT, PIN, UNPIN};
use rusqlite::{Transaction, params};
use serde_json::json;

/// Draft of a document that pins records on behalf of `by`, in place of the former pins of `by` if `instead`.
pub(crate) fn pinned(stamp_ns: i64, ids: &[RecordId], by: &str, instead: bool) -> Draft<'static> {
    let mut draft = Draft::new(PIN, stamp_ns);
    draft.meta.body = json!({ "records": ids, "by": by, "instead": instead });
    draft
}

/// Draft of a document that removes all pins of `by`.
pub(crate) fn unpinned(stamp_ns: i64, by: &str) -> Draft<'static> {
    let mut draft = Draft::new(UNPIN, stamp_ns);
    draft.meta.body = json!({ "by": by });
    draft
}

/// True if a document changes pins.
pub(super) fn speaks(document: &Document) -> bool {
    document.kept || [PIN, UNPIN].contains(&document.kind.as_str())
}

/// Applies the pins that a document adds or removes to the index. A document that pins records is pinned
/// itself.
pub(super) fn apply(tx: &Transaction, document: &Document) -> rusqlite::Result<()> {
    if document.kept {
        tx.prepare_cached("INSERT OR IGNORE INTO pins VALUES(?1, ?2)")?
            .execute(params![document.id.0 as i64, KEPT])?;
    }
    let says = |key: &str| document.body.get(key);
    let by = says("by").and_then(|v| v.as_str()).unwrap_or("");
    let instead = says("instead").and_then(|v| v.as_bool()).unwrap_or(false);
    if document.kind == UNPIN || (document.kind == PIN && instead) {
        tx.prepare_cached("DELETE FROM pins WHERE holder = ?1")?.execute([by])?;
    }
    let listed = says("records").and_then(|v| v.as_array()).into_iter().flatten().filter_map(|v| v.as_u64());
    let ids: Vec<u64> = listed.collect();
    // Who holds nothing keeps no record of it either.
    if document.kind == PIN && !ids.is_empty() {
        for id in ids.into_iter().chain([document.id.0]) {
            tx.prepare_cached("INSERT OR IGNORE INTO pins SELECT id, ?2 FROM records WHERE id = ?1")?
                .execute(params![id as i64, by])?;
        }
    }
    Ok(())
}
