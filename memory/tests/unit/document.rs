//! Tests of `document`.

use descry_memory::document::*;

/// Fields missing in older formats take their defaults; fields added by newer ones are ignored.
#[test]
fn documents_of_other_formats_are_read() {
    let old: Document = serde_json::from_str(r#"{"id":3,"kind":"scan","stamp_ns":5}"#).unwrap();
    assert_eq!((old.id, old.kind.as_str(), old.stamp_ns, old.end_ns), (RecordId(3), "scan", 5, None));
    assert!(old.blobs.is_empty() && old.body.is_null() && old.robot.is_empty());
    let new: Document = serde_json::from_str(
        r#"{"id":4,"kind":"scan","stamp_ns":6,"weather":{"rain":true},"body":[1,2],
            "blobs":[{"name":"b","form":"bytes","bytes":7,"codec":"none"}]}"#,
    )
    .unwrap();
    assert_eq!((new.body, new.blobs[0].bytes), (serde_json::json!([1, 2]), 7));
}
