//! Requirements of every store.

use descry_memory::stores::Store;
use descry_memory::{
    Blob, Bounds, Draft, Error, Form, Meta, Near, Order, Query, RecordId, Retention, Sighting,
};
use serde_json::{Value, json};

/// A blob of bytes.
pub fn blob(name: &str, data: Vec<u8>) -> Blob<'static> {
    Blob { name: name.into(), form: Form::Bytes, layout: Value::Null, data: data.into() }
}

/// `length` pseudo-random bytes from a seed.
pub fn bytes(seed: u64, length: usize) -> Vec<u8> {
    let mut x = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut next = || {
        x ^= x << 13;
        x ^= x >> 7;
        x ^= x << 17;
        x as u8
    };
    (0..length).map(|_| next()).collect()
}

/// Forty records: every second one a `scan` in one of two frames, seen from points along a line, covering a
/// box ahead of it.
pub fn fill(store: &dyn Store) -> Vec<RecordId> {
    let mut ids = Vec::new();
    for i in 0..40_i64 {
        let x = i as f64 * 0.5;
        let object =
            Sighting { object: if i % 2 == 0 { "cup A" } else { "mug" }.into(), confidence: i as f64 / 40.0 };
        let draft = Draft {
            frame: if i % 4 == 0 { "left" } else { "right" }.into(),
            end_ns: (i == 7).then_some(20_500),
            meta: Meta {
                seen_from_m: Some([x, 0.0, 1.3]),
                covers_m: Some(Bounds { min_m: [x, 1.0, 0.0], max_m: [x + 0.25, 2.0, 1.0] }),
                objects: vec![object],
                body: json!({ "i": i, "third": i as f64 / 3.0, "text": "naïve \"quoted\" \u{1F916}", "nested": { "list": [1, null, true] } }),
            },
            blobs: vec![blob("points", bytes(i as u64, 1 << (i % 18))), blob("none", Vec::new())],
            ..Draft::new("scan", i * 1000)
        };
        ids.extend(store.append(&[draft]).unwrap());
    }
    ids
}

fn stamps(store: &dyn Store, query: Query) -> Vec<i64> {
    store.find(&query).unwrap().iter().map(|d| d.stamp_ns / 1000).collect()
}

/// Checks all requirements on an empty store.
pub fn check(store: &dyn Store) {
    let ids = fill(store);
    check_content(store, &ids);
    check_queries(store, &ids);
    check_nearest(store);
    check_refusals(store);
    check_pins(store, &ids);
    let report = store.verify().unwrap();
    assert!(report.is_whole(), "{:?}", report.faults);
    let stats = store.stats().unwrap();
    assert_eq!(stats.kinds["scan"].records, 40);
    assert_eq!((stats.oldest_ns, stats.newest_ns), (Some(0), Some(39_000)));
    assert_eq!(report.whole, stats.records);
    store.sync().unwrap();
    assert_eq!(store.frames("scan").unwrap(), ["left", "right"]);
    check_twins(store);
}

/// Among records of one stamp, the newest is the nearest, and results are ordered by number.
fn check_twins(store: &dyn Store) {
    let twins = store.append(&[Draft::new("twin", 7000), Draft::new("twin", 7000)]).unwrap();
    let of_kind = Query::of_kind("twin");
    for stamp in [0, 7000, 9000] {
        assert_eq!(store.nearest(&of_kind, stamp).unwrap().map(|d| d.id), Some(twins[1]), "{stamp}");
    }
    let found: Vec<_> = store.find(&of_kind).unwrap().iter().map(|d| d.id).collect();
    assert_eq!(found, twins);
}

fn check_content(store: &dyn Store, ids: &[RecordId]) {
    assert!(ids.windows(2).all(|w| w[0] < w[1]), "{ids:?}");
    for (i, id) in ids.iter().enumerate() {
        let document = store.get(*id).unwrap();
        assert_eq!(document.body["i"], json!(i));
        assert_eq!(document.body["third"].as_f64().unwrap().to_bits(), (i as f64 / 3.0).to_bits());
        assert_eq!(document.body["nested"]["list"], json!([1, null, true]));
        assert_eq!(document.seen_from_m, Some([i as f64 * 0.5, 0.0, 1.3]));
        assert_eq!(store.blob(*id, "points").unwrap(), bytes(i as u64, 1 << (i % 18)));
        assert!(store.blob(*id, "none").unwrap().is_empty());
    }
    assert!(matches!(store.get(RecordId(1 << 40)), Err(Error::Missing { .. })));
    let error = store.blob(ids[0], "colour").unwrap_err().to_string();
    assert!(error.contains("no blob `colour`; it has: `points`, `none`"), "{error}");
}

fn check_queries(store: &dyn Store, ids: &[RecordId]) {
    let scan = || Query::of_kind("scan");
    let cases = [
        (Query { from_ns: Some(37_000), ..scan() }, vec![37, 38, 39]),
        (Query { to_ns: Some(1999), ..scan() }, vec![0, 1]),
        (Query { from_ns: Some(20_200), to_ns: Some(21_000), ..scan() }, vec![7, 21]),
        (Query { frame: Some("left".into()), to_ns: Some(9000), ..scan() }, vec![0, 4, 8]),
        (Query { frame: Some("nowhere".into()), ..scan() }, vec![]),
        (Query { kind: Some("dream".into()), ..scan() }, vec![]),
        (Query { order: Order::Newest, limit: Some(3), ..scan() }, vec![39, 38, 37]),
        (Query { after: Some((2000, ids[2])), limit: Some(2), ..scan() }, vec![3, 4]),
        (Query { after: Some((2000, ids[2])), order: Order::Newest, ..scan() }, vec![1, 0]),
        (Query { object: Some("cup A".into()), min_confidence: Some(0.9), ..scan() }, vec![36, 38]),
        (Query { min_confidence: Some(0.95), ..scan() }, vec![38, 39]),
        (Query { object: Some("mug".into()), to_ns: Some(4000), ..scan() }, vec![1, 3]),
        (
            Query { seen_from: Some(Near { place_m: [5.0, 0.0, 1.0], radius_m: 0.6 }), ..scan() },
            vec![9, 10, 11],
        ),
        (Query { seen_from: Some(Near { place_m: [5.0, 0.3, 1.0], radius_m: 0.6 }), ..scan() }, vec![10]),
        (Query { covers: Some(Near { place_m: [3.1, 1.5, 0.5], radius_m: 0.0 }), ..scan() }, vec![6]),
        (Query { covers: Some(Near { place_m: [3.4, 1.5, 0.5], radius_m: 0.2 }), ..scan() }, vec![6, 7]),
        (Query { covers: Some(Near { place_m: [3.4, 2.1, 1.1], radius_m: 0.15 }), ..scan() }, vec![]),
    ];
    for (query, expected) in cases {
        assert_eq!(stamps(store, query.clone()), expected, "{query:?}");
    }
}

fn check_nearest(store: &dyn Store) {
    let left = Query { frame: Some("left".into()), ..Query::of_kind("scan") };
    let any = Query::of_kind("scan");
    for (query, stamp, expected) in [
        (&any, 5000, Some(5)),
        (&any, 5499, Some(5)),
        (&any, 5500, Some(5)),
        (&any, 5501, Some(6)),
        (&any, 0, Some(0)),
        (&any, i64::MAX, Some(39)),
        (&left, 5999, Some(4)),
        (&left, 6001, Some(8)),
        (&Query::of_kind("dream"), 0, None),
    ] {
        let found = store.nearest(query, stamp).unwrap().map(|d| d.stamp_ns / 1000);
        assert_eq!(found, expected, "{stamp}");
    }
}

fn check_refusals(store: &dyn Store) {
    let sure =
        |confidence| Meta { objects: vec![Sighting { object: "mug".into(), confidence }], ..Meta::default() };
    let lost = Meta { seen_from_m: Some([f64::NAN, 0.0, 0.0]), ..Meta::default() };
    let cases = [
        (Draft::new("", 0), "the kind \"\" is no word"),
        (Draft::new("scan", -1), "the stamp -1 ns is negative"),
        (Draft { end_ns: Some(4), ..Draft::new("scan", 5) }, "before its start"),
        (
            Draft { meta: sure(1.5), ..Draft::new("scan", 5) },
            "the confidence 1.5 of mug is not within 0 to 1",
        ),
        (Draft { meta: sure(f64::NAN), ..Draft::new("scan", 5) }, "the confidence NaN"),
        (Draft { meta: lost, ..Draft::new("scan", 5) }, "a place is not finite"),
        (
            Draft { blobs: vec![blob("a", vec![]), blob("a", vec![])], ..Draft::new("scan", 5) },
            "two blobs are called",
        ),
    ];
    let before = store.stats().unwrap().records;
    for (draft, message) in cases {
        // Together with one that is in order: all or none.
        let error = store.append(&[Draft::new("scan", 5), draft]).unwrap_err();
        assert!(matches!(error, Error::Input { .. }) && error.to_string().contains(message), "{error}");
    }
    assert_eq!(store.stats().unwrap().records, before);
}

fn check_pins(store: &dyn Store, ids: &[RecordId]) {
    store.pin(&ids[3..5], "belief 1").unwrap();
    store.pin(&ids[4..6], "model").unwrap();
    assert!(matches!(store.pin(&[ids[9], RecordId(1 << 40)], "plan"), Err(Error::Missing { .. })));
    let held = |id: RecordId| -> Vec<String> {
        store.pins().unwrap().get(&id).into_iter().flatten().cloned().collect()
    };
    assert_eq!(held(ids[3]), ["belief 1"]);
    assert_eq!(held(ids[4]), ["belief 1", "model"]);
    assert!(held(ids[9]).is_empty());
    store.unpin("belief 1").unwrap();
    assert_eq!(held(ids[4]), ["model"]);
    assert!(held(ids[3]).is_empty());
    store.hold(&ids[5..8], "model").unwrap();
    assert!(matches!(store.hold(&[ids[9], RecordId(1 << 40)], "model"), Err(Error::Missing { .. })));
    assert_eq!([4, 5, 7, 9].map(|i| held(ids[i]).len()), [0, 1, 1, 0]);
    store.hold(&[], "model").unwrap();
    assert!(store.pins().unwrap().is_empty());
}

/// Pruning by age removes old records, keeps pinned ones, and keeps the counts correct.
pub fn check_prune(store: &dyn Store) {
    let ids = fill(store);
    store.pin(&ids[2..4], "belief").unwrap();
    store.pin(&ids[5..6], "model").unwrap();
    let gone = store.prune(&Retention { max_age_ns: Some(10_000), ..Retention::default() }).unwrap();
    let left = stamps(store, Query::of_kind("scan"));
    assert!(
        gone > 0 && left.starts_with(&[2, 3, 5]) && left.ends_with(&[37, 38, 39]),
        "{gone} gone: {left:?}"
    );
    assert!(matches!(store.get(ids[0]), Err(Error::Missing { .. })));
    assert_eq!(store.blob(ids[5], "points").unwrap(), bytes(5, 1 << 5));
    let stats = store.stats().unwrap();
    assert_eq!(stats.kinds["scan"].records, left.len() as u64);
    let report = store.verify().unwrap();
    assert!(report.is_whole() && report.whole == stats.records, "{report:?}");
    let next = store.append(&[Draft::new("scan", 50_000)]).unwrap()[0];
    assert!(next > ids[39], "{next}");
}

/// In a store limited to 4 MiB, pinned records and those of the same moment as new data are not pruned; where
/// that leaves too little room, recording fails without a loss.
pub fn check_bounded(store: &dyn Store) {
    let scan = |i: i64, kilobytes: usize| Draft {
        blobs: vec![blob("points", bytes(i as u64, kilobytes * 1000))],
        ..Draft::new("scan", i * 1000)
    };
    let put = |i: i64, kilobytes: usize| store.append(&[scan(i, kilobytes)]);
    store.append(&[Draft { kept: true, ..Draft::new("run", 0) }]).unwrap();
    let pinned: Vec<RecordId> = (0..5).map(|i| put(i, 600).unwrap()[0]).collect();
    store.pin(&pinned, "model").unwrap();
    put(10, 700).unwrap();
    put(11, 700).unwrap();
    assert_eq!(stamps(store, Query::of_kind("scan")), [0, 1, 2, 3, 4, 11]);
    let error = put(12, 1500).unwrap_err();
    assert!(matches!(error, Error::Bounded { .. }), "{error}");
    for word in ["bounded to 4.2 MB, and 1.", "in 6 records by `model`", "allow 4.", "--max-bytes"] {
        assert!(error.to_string().contains(word), "no {word}: {error}");
    }
    assert_eq!(stamps(store, Query::of_kind("scan")), [0, 1, 2, 3, 4, 11], "refused without loss");
    let error = put(11, 800).unwrap_err();
    assert!(matches!(error, Error::Bounded { .. }), "it pushes out what is of its own moment: {error}");
    store.unpin("model").unwrap();
    put(12, 1500).unwrap();
    let left = stamps(store, Query::of_kind("scan"));
    assert!(left.ends_with(&[11, 12]) && left.len() < 6, "{left:?}");
    assert_eq!(stamps(store, Query::of_kind("run")).len(), 1, "what is kept is never pruned");
    assert!(store.stats().unwrap().bytes <= 4 << 20);
    assert!(store.verify().unwrap().is_whole());
}
