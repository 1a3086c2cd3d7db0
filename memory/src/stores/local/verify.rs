//! Verification of a whole store.

use super::index::Place;
use super::scan::scan;
use super::{LocalStore, segment_path};
use crate::document::RecordId;
use crate::error::Error;
use crate::stores::{Fault, Report};
use std::collections::BTreeMap;

/// Verifies the checksums of every segment, and compares the content of the segments with the index.
pub(super) fn verify(store: &LocalStore) -> Result<Report, Error> {
    let mut report = Report::default();
    let faults = |what: Vec<String>| {
        what.into_iter().map(|what| Fault { record: None, place: super::INDEX.into(), what })
    };
    report.faults.extend(faults(store.index().check()?));
    if store.recovery.index_rebuilt && store.writer.is_none() {
        report
            .faults
            .extend(faults(vec!["it is not what was written; it is made again from the segments".into()]));
    }
    report.faults.extend(store.recovery.faults.iter().cloned());
    let segments = store.index().segments()?;
    for row in segments {
        let path = segment_path(&store.dir, row.number);
        let place = path.display().to_string();
        let mut expected: BTreeMap<RecordId, Place> =
            store.index().places(row.number, false)?.into_iter().map(|p| (p.id, p)).collect();
        let mut misplaced = Vec::new();
        let result = scan(&path, (!row.sealed).then_some(row.bytes), |records, _| {
            for (document, located) in records {
                // Records that were pinned and moved on are found here and expected elsewhere.
                if let Some(known) = expected.remove(&document.id) {
                    let known = &known.located;
                    if known.document == located.document && known.blobs == located.blobs {
                        report.whole += 1;
                        report.bytes +=
                            located.document_bytes + document.blobs.iter().map(|b| b.bytes).sum::<u64>();
                    } else {
                        misplaced.push(document.id);
                    }
                }
            }
            Ok(())
        });
        match result {
            Ok(scan) => {
                // What stands behind the last record of a segment that still grows is on its way.
                let torn = scan.torn.filter(|(at, _)| row.sealed || *at < row.bytes);
                let found = scan.damaged.into_iter().chain(torn).map(|(at, what)| Fault {
                    record: None,
                    place: place.clone(),
                    what: format!("byte {at}: {what}"),
                });
                let new: Vec<Fault> = found.filter(|fault| !report.faults.contains(fault)).collect();
                report.faults.extend(new);
            }
            Err(e) => report.faults.push(Fault { record: None, place: place.clone(), what: e.to_string() }),
        }
        for id in misplaced {
            let what = "lies elsewhere than the index says".to_owned();
            report.faults.push(Fault { record: Some(id), place: place.clone(), what });
        }
        for (id, known) in expected {
            // A record can be whole in a chunk that is not.
            match store.whole(&known) {
                Ok((_, blobs)) => {
                    report.whole += 1;
                    report.bytes += known.located.document_bytes;
                    report.bytes += blobs.iter().map(|blob| blob.len() as u64).sum::<u64>();
                }
                Err(_) => {
                    let what = "is lost: it cannot be read from its segment any more".to_owned();
                    report.faults.push(Fault { record: Some(id), place: place.clone(), what });
                }
            }
        }
    }
    Ok(report)
}
