//! Recovery of a store: truncated files, damaged bytes, a lost index, a full disk.

use descry_memory::stores::Store;
use descry_memory::{
    Blob, Draft, Durability, Error, Fault, Form, LocalOptions, LocalStore, Query, RecordId, Retention,
};
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};

fn options() -> LocalOptions {
    LocalOptions { segment_bytes: 1 << 20, ..LocalOptions::default() }
}

fn draft(i: u64, bytes: usize) -> Draft<'static> {
    let data: Vec<u8> = (0..bytes).map(|k| (i as usize * 31 + k) as u8).collect();
    let mut draft = Draft::new("scan", i as i64);
    draft.meta.body = json!({ "i": i });
    draft.blobs.push(Blob { name: "data".into(), form: Form::Bytes, layout: Value::Null, data: data.into() });
    draft
}

/// Checks that a record is what [`draft`] made of its number.
fn assert_whole(store: &dyn Store, id: RecordId, i: u64, bytes: usize) {
    assert_eq!(store.get(id).unwrap().body, json!({ "i": i }));
    assert_eq!(store.blob(id, "data").unwrap(), draft(i, bytes).blobs[0].data.as_ref());
}

/// The undamaged records of a kind, and the faults of the others.
fn whole(store: &dyn Store) -> (Vec<RecordId>, Vec<Fault>) {
    let mut whole = Vec::new();
    let faults = store.each_whole(&Query::of_kind("scan"), &mut |document, _| {
        whole.push(document.id);
        Ok(())
    });
    (whole, faults.unwrap())
}

fn segments(dir: &Path) -> Vec<PathBuf> {
    let mut paths: Vec<_> = fs::read_dir(dir.join("segments")).unwrap().map(|e| e.unwrap().path()).collect();
    paths.sort();
    paths
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to.join("segments")).unwrap();
    for entry in fs::read_dir(from).unwrap().chain(fs::read_dir(from.join("segments")).unwrap()) {
        let path = entry.unwrap().path();
        if path.is_file() {
            fs::copy(&path, to.join(path.strip_prefix(from).unwrap())).unwrap();
        }
    }
}

/// Size of the message index behind a chunk of one record with one blob, bytes: one message on each of two
/// channels.
const MESSAGE_INDEX: u64 = 2 * (9 + 2 + 4 + 16);

/// A store as a killed process leaves it, with five records and nothing finished; also the end of each
/// record's chunk data.
fn killed(dir: &Path) -> (Vec<RecordId>, Vec<u64>) {
    let live = dir.join("live");
    let store = LocalStore::create(&live, "", options()).unwrap();
    let mut ends = Vec::new();
    let mut ids = Vec::new();
    for i in 0..5 {
        ids.extend(store.append(&[draft(i, 300 + 40 * i as usize)]).unwrap());
        ends.push(fs::metadata(&segments(&live)[0]).unwrap().len() - MESSAGE_INDEX);
    }
    copy(&live, &dir.join("killed"));
    (ids, ends)
}

/// Removes the index of a store.
fn forget_index(dir: &Path) {
    for file in ["index.sqlite", "index.sqlite-wal", "index.sqlite-shm"] {
        drop(fs::remove_file(dir.join(file)));
    }
}

/// Truncates a file.
fn cut(path: &Path, to: u64) {
    fs::File::options().write(true).open(path).unwrap().set_len(to).unwrap();
}

/// Faults for which a store is not opened for writing.
fn refusal(dir: &Path, options: LocalOptions) -> String {
    match LocalStore::open(dir, "", options).map(drop) {
        Err(e @ Error::Faulty { .. }) => e.to_string(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_segment_cut_anywhere_keeps_what_was_whole_and_goes_on() {
    let dir = tempfile::tempdir().unwrap();
    let (ids, ends) = killed(dir.path());
    let source = dir.path().join("killed");
    let length = ends[4];
    // Without the index nobody knows of more than what is whole.
    for (round, cut) in (0..length).step_by(37).chain(ends.iter().copied()).enumerate() {
        let here = dir.path().join(format!("cut-{round}"));
        copy(&source, &here);
        let segment = segments(&here)[0].clone();
        self::cut(&segment, cut);
        forget_index(&here);
        let store = LocalStore::open(&here, "", options()).unwrap();
        let whole = ends.iter().filter(|end| **end <= cut).count();
        let found = store.find(&Query::default()).unwrap();
        assert_eq!(found.len(), whole, "cut at {cut} of {ends:?}: {:?}", store.recovery());
        for (i, id) in ids.iter().take(whole).enumerate() {
            assert_whole(&store, *id, i as u64, 300 + 40 * i);
        }
        let next = store.append(&[draft(9, 10)]).unwrap()[0];
        assert_whole(&store, next, 9, 10);
        let report = store.verify().unwrap();
        assert!(report.is_whole() && report.whole == whole as u64 + 1, "cut at {cut}: {report:?}");
        assert_eq!(store.stats().unwrap().kinds["scan"].records, whole as u64 + 1);
        drop(store);
        for path in segments(&here) {
            let bytes = fs::read(path).unwrap();
            assert!(mcap::Summary::read(&bytes).unwrap().is_some(), "every segment is complete");
        }
        fs::remove_dir_all(here).unwrap();
    }
}

/// The index knows the records that were acknowledged: a segment without one of them stays as it is.
#[test]
fn what_was_acknowledged_is_never_cut_off() {
    let dir = tempfile::tempdir().unwrap();
    let (_, ends) = killed(dir.path());
    let here = dir.path().join("here");
    for to in (0..ends[4]).step_by(211) {
        copy(&dir.path().join("killed"), &here);
        let segment = segments(&here)[0].clone();
        cut(&segment, to);
        let first_lost = ends.iter().filter(|end| **end <= to).count() + 1;
        let lost = match first_lost {
            5 => "record 5 is lost".to_owned(),
            first => format!("{} records are lost: {first} to 5", 6 - first),
        };
        for _ in 0..2 {
            let said = refusal(&here, options());
            assert!(said.contains(&lost) && said.contains("from a copy"), "cut at {to}: {said}");
            assert_eq!(fs::metadata(&segment).unwrap().len(), to, "nothing is cut");
        }
        let said = format!("{:?}", LocalStore::open_shared(&here).unwrap().verify().unwrap());
        assert!(said.contains(&lost), "cut at {to}: {said}");
        fs::remove_dir_all(&here).unwrap();
    }
}

/// Records that were acknowledged before they were on the disk may be gone after a power cut; they are named.
#[test]
fn what_a_power_cut_may_cost_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let (_, ends) = killed(dir.path());
    let here = dir.path().join("killed");
    cut(&segments(&here)[0], ends[3] - 1);
    let not_waited_for = LocalOptions { durability: Durability::Process, ..options() };
    let store = LocalStore::open(&here, "", not_waited_for).unwrap();
    let lost: Vec<String> = store.recovery().lost.iter().map(ToString::to_string).collect();
    assert!(lost.len() == 1 && lost[0].contains("2 records are lost: 4 to 5"), "{lost:?}");
    assert_eq!(store.append(&[draft(9, 10)]).unwrap(), [RecordId(6)], "no number is given again");
}

/// A segment under another name is not read, and named, whatever the index knows of it.
#[test]
fn a_file_that_is_no_segment_by_its_name_is_told() {
    let dir = tempfile::tempdir().unwrap();
    killed(dir.path());
    let here = dir.path().join("here");
    for (name, has_index) in [
        ("00000001x.mcap", false),
        ("1.mcap", false),
        ("00000001.mcap.bak", false),
        (".mcap", true),
        ("000000001.mcap", true),
    ] {
        copy(&dir.path().join("killed"), &here);
        if !has_index {
            forget_index(&here);
        }
        let segment = segments(&here)[0].clone();
        let stray = segment.with_file_name(name);
        fs::write(here.join("segments/notes.txt"), "nothing of ours").unwrap();
        fs::rename(&segment, &stray).unwrap();
        let said = format!("{}: is no segment by its name", stray.display());
        let store = LocalStore::open_shared(&here).unwrap();
        let faults: Vec<String> = store.verify().unwrap().faults.iter().map(ToString::to_string).collect();
        assert!(faults.iter().any(|fault| fault.contains(&said)), "{name}: {faults:?}");
        assert!(!faults.iter().any(|fault| fault.contains("notes.txt")), "{name}: {faults:?}");
        assert!(refusal(&here, options()).contains(&said), "{name}");
        fs::rename(&stray, &segment).unwrap();
        assert_eq!(LocalStore::open(&here, "", options()).unwrap().verify().unwrap().whole, 5, "{name}");
        fs::remove_dir_all(&here).unwrap();
    }
}

/// Without an index the numbers of lost records are unknown; the count is told, and nothing else.
#[test]
fn how_many_records_are_lost_is_said_once() {
    let dir = tempfile::tempdir().unwrap();
    let store = LocalStore::create(dir.path(), "", options()).unwrap();
    store.append(&[draft(0, 100), draft(1, 100)]).unwrap();
    drop(store);
    let segment = &segments(dir.path())[0];
    let length = fs::metadata(segment).unwrap().len();
    cut(segment, 0);
    forget_index(dir.path());
    let said = refusal(dir.path(), options());
    assert!(said.contains(&format!("has 0 of {length} bytes\n")), "{said}");
    assert!(said.contains("2 of 2 records are lost") && !said.contains("no record is lost"), "{said}");
}

#[test]
fn rubbish_behind_the_last_record_is_dropped() {
    let dir = tempfile::tempdir().unwrap();
    killed(dir.path());
    let rubbish =
        [vec![0_u8; 5000], vec![6; 100], b"\x06\xff\xff\xff\xff\xff\xff\xff\xff".to_vec(), vec![0xff; 3]];
    for (i, rubbish) in rubbish.into_iter().enumerate() {
        let here = dir.path().join(format!("rubbish-{i}"));
        copy(&dir.path().join("killed"), &here);
        let path = segments(&here)[0].clone();
        let mut bytes = fs::read(&path).unwrap();
        bytes.extend_from_slice(&rubbish);
        fs::write(&path, bytes).unwrap();
        let store = LocalStore::open(&here, "", options()).unwrap();
        assert_eq!(store.find(&Query::default()).unwrap().len(), 5);
        assert_eq!(store.recovery().dropped_bytes, rubbish.len() as u64);
        assert!(store.verify().unwrap().is_whole());
    }
}

#[test]
fn damage_costs_the_batch_that_it_hits_and_is_reported() {
    let dir = tempfile::tempdir().unwrap();
    let source = dir.path().join("source");
    let store = LocalStore::create(&source, "", options()).unwrap();
    let ids: Vec<_> = (0..5).map(|i| store.append(&[draft(i, 1000)]).unwrap()[0]).collect();
    drop(store);
    let original = fs::read(&segments(&source)[0]).unwrap();
    let data = mcap::read::footer(&original).unwrap().summary_start as usize;
    // The header names the program that wrote; nothing depends on it.
    let header = 8 + 9 + u64::from_le_bytes(original[9..17].try_into().unwrap()) as usize;
    let here = dir.path().join("here");
    for hit in (header..original.len()).step_by(53) {
        copy(&source, &here);
        let mut bytes = original.clone();
        bytes[hit] ^= 1 << (hit % 8);
        fs::write(&segments(&here)[0], bytes).unwrap();
        let store = LocalStore::open(&here, "", options()).unwrap();
        let report = store.verify().unwrap();
        assert!(!report.is_whole(), "byte {hit} of {data}");
        let lost: Vec<_> = report.faults.iter().filter_map(|f| f.record).collect();
        assert_eq!(report.whole + lost.len() as u64, 5, "byte {hit} of {data}: {report:?}");
        assert!(lost.len() <= 1, "byte {hit} of {data}: {report:?}");
        for (i, id) in ids.iter().enumerate().filter(|(_, id)| !lost.contains(id)) {
            assert_whole(&store, *id, i as u64, 1000);
        }
        drop(store);
        fs::remove_dir_all(&here).unwrap();
    }
}

#[test]
fn an_index_that_is_none_is_made_again_with_its_pins() {
    let dir = tempfile::tempdir().unwrap();
    let store = LocalStore::create(dir.path(), "", options()).unwrap();
    let ids: Vec<_> = (0..5).map(|i| store.append(&[draft(i, 1000)]).unwrap()[0]).collect();
    store.pin(&ids[1..3], "belief").unwrap();
    store.pin(&ids[4..5], "plan").unwrap();
    store.unpin("plan").unwrap();
    let (stats, pins) = (store.stats().unwrap(), store.pins().unwrap());
    drop(store);
    fs::write(dir.path().join("index.sqlite"), b"this is no index, whatever its name may say").unwrap();
    let store = LocalStore::open(dir.path(), "", options()).unwrap();
    assert!(store.recovery().index_rebuilt);
    assert_eq!(store.pins().unwrap(), pins);
    assert_eq!(store.stats().unwrap().kinds, stats.kinds);
    (0..5).for_each(|i| assert_whole(&store, ids[i], i as u64, 1000));
}

/// Checks which records survive damage to a closed store, by their place.
fn check_damage(what: &str, spoil: impl Fn(&Path), left: &[usize]) {
    let dir = tempfile::tempdir().unwrap();
    let store =
        LocalStore::create(dir.path(), "", LocalOptions { segment_bytes: 10 << 10, ..options() }).unwrap();
    let ids: Vec<_> = (0..5).map(|i| store.append(&[draft(i, 40 << 10)]).unwrap()[0]).collect();
    store.pin(&ids[..2], "belief").unwrap();
    store.hold(&ids[2..4], "plan").unwrap();
    let pins = store.pins().unwrap();
    drop(store);
    spoil(dir.path());
    let all_left = left.len() == ids.len();
    for _ in 0..2 {
        // Whoever reads changes nothing, so that the next one finds the same.
        let store = LocalStore::open_shared(dir.path()).unwrap();
        assert_eq!(store.recovery().faults.is_empty(), all_left, "{what}: {:?}", store.recovery());
        assert_eq!(whole(&store).0, left.iter().map(|i| ids[*i]).collect::<Vec<_>>(), "{what}");
        left.iter().for_each(|i| assert_whole(&store, ids[*i], *i as u64, 40 << 10));
        assert!(!store.verify().unwrap().is_whole(), "{what}");
        if all_left {
            assert_eq!(store.pins().unwrap(), pins, "{what}");
        }
    }
    match LocalStore::open(dir.path(), "", options()) {
        Ok(store) => {
            assert!(all_left, "{what}: who writes must not go on with what is left");
            assert!(store.recovery().index_rebuilt && store.verify().unwrap().is_whole(), "{what}");
            assert_eq!(store.pins().unwrap(), pins, "{what}");
        }
        Err(Error::Faulty { faults, .. }) => assert!(!all_left && !faults.is_empty(), "{what}"),
        Err(e) => panic!("{what}: {e}"),
    }
}

#[test]
fn what_is_lost_is_said_and_the_rest_is_read() {
    let flip = |path: PathBuf, at: fn(usize) -> usize| {
        let mut bytes = fs::read(&path).unwrap();
        let at = at(bytes.len());
        bytes[at] ^= 4;
        fs::write(path, bytes).unwrap();
    };
    let cut = |path: PathBuf, to: fn(u64) -> u64| {
        let length = fs::metadata(&path).unwrap().len();
        fs::File::options().write(true).open(path).unwrap().set_len(to(length)).unwrap();
    };
    let index = |dir: &Path| dir.join("index.sqlite");
    let all = [0, 1, 2, 3, 4];
    for eighth in 0..8 {
        let spoil = |dir: &Path| {
            let mut bytes = fs::read(index(dir)).unwrap();
            let at = bytes.len() * eighth / 8 + 20;
            bytes[at] ^= 1;
            fs::write(index(dir), bytes).unwrap();
        };
        check_damage("a flipped bit in the index", spoil, &all);
    }
    check_damage("a cut index", |dir| cut(index(dir), |n| n / 2), &all);
    check_damage("an empty index", |dir| cut(index(dir), |_| 0), &all);
    check_damage("no index", |dir| fs::remove_file(index(dir)).unwrap(), &all);
    check_damage("a cut segment", |dir| cut(segments(dir)[1].clone(), |n| n / 2), &[0, 2, 3, 4]);
    check_damage("a missing segment", |dir| fs::remove_file(&segments(dir)[2]).unwrap(), &[0, 1, 3, 4]);
    let both = |dir: &Path| {
        fs::remove_file(&segments(dir)[2]).unwrap();
        flip(index(dir), |n| n / 2);
    };
    check_damage("a missing segment and a flipped bit in the index", both, &[0, 1, 3, 4]);
    let both = |dir: &Path| {
        cut(segments(dir)[4].clone(), |n| n / 2);
        fs::remove_file(index(dir)).unwrap();
    };
    check_damage("a cut segment and no index", both, &[0, 1, 2, 3]);
}

/// A flipped bit in a blob or a document: whatever reads it fails and names the record.
#[test]
fn no_byte_is_read_that_was_not_written() {
    let dir = tempfile::tempdir().unwrap();
    let store = LocalStore::create(dir.path(), "", options()).unwrap();
    let ids: Vec<_> = (0..3).map(|i| store.append(&[draft(i, 40 << 10)]).unwrap()[0]).collect();
    let path = segments(dir.path())[0].clone();
    drop(store);
    let original = fs::read(&path).unwrap();
    let data = draft(1, 40 << 10).blobs[0].data.to_vec();
    let blob = original.windows(data.len()).position(|w| w == data).unwrap();
    let document = blob + original[blob..].windows(7).position(|w| w == br#"{"i":1}"#).unwrap();
    for (hit, is_blob) in [(blob, true), (blob + data.len() - 1, true), (document + 5, false)] {
        let mut bytes = original.clone();
        bytes[hit] ^= 1;
        fs::write(&path, bytes).unwrap();
        let store = LocalStore::open_shared(dir.path()).unwrap();
        let read = store.blob(ids[1], "data").map(drop);
        let refused = if is_blob { read } else { store.get(ids[1]).map(drop) }.unwrap_err();
        assert!(refused.to_string().contains(&format!("record {} is damaged", ids[1])), "{refused}");
        assert_eq!(store.find(&Query::default()).is_err(), !is_blob);
        let (whole, faults) = whole(&store);
        assert_eq!(whole, [ids[0], ids[2]]);
        assert_eq!(faults.iter().map(|f| f.record).collect::<Vec<_>>(), [Some(ids[1])]);
        let file = dir.path().join("all.mcap");
        let exported = descry_memory::export(&store, &Query::of_kind("scan"), &file).unwrap();
        assert_eq!((exported.records, exported.faults), (2, faults));
        let written = fs::read(&file).unwrap();
        let damaged = format!(r#"{{"id":{},"#, ids[1]);
        assert!(!written.windows(damaged.len()).any(|w| w == damaged.as_bytes()), "it is in no new file");
        fs::remove_file(file).unwrap();
    }
}

/// Readers neither lock nor write: a writer that opens while they open is never turned away.
#[test]
fn readers_are_in_nobodys_way() {
    let dir = tempfile::tempdir().unwrap();
    let store = LocalStore::create(dir.path(), "", options()).unwrap();
    store.append(&[draft(0, 100)]).unwrap();
    drop(store);
    let done = std::sync::atomic::AtomicBool::new(false);
    std::thread::scope(|scope| {
        for _ in 0..3 {
            scope.spawn(|| {
                while !done.load(std::sync::atomic::Ordering::Relaxed) {
                    let store = LocalStore::open_shared(dir.path()).unwrap();
                    assert!(!store.find(&Query::default()).unwrap().is_empty());
                    assert!(store.recovery().faults.is_empty(), "{:?}", store.recovery());
                }
            });
        }
        for i in 1..100 {
            let store = LocalStore::open(dir.path(), "", options()).map_err(|e| e.to_string());
            let recorded = store.and_then(|store| store.append(&[draft(i, 100)]).map_err(|e| e.to_string()));
            if recorded.is_err() {
                done.store(true, std::sync::atomic::Ordering::Relaxed);
            }
            recorded.unwrap();
        }
        done.store(true, std::sync::atomic::Ordering::Relaxed);
    });
    let store = LocalStore::open_shared(dir.path()).unwrap();
    assert_eq!(store.find(&Query::default()).unwrap().len(), 100);
}

/// Only one of several concurrent creators of a store in one folder succeeds, and none overwrites it.
#[test]
fn one_of_several_makes_a_store() {
    for _ in 0..20 {
        let dir = tempfile::tempdir().unwrap();
        let made = std::thread::scope(|scope| {
            let make = |i| {
                let store = LocalStore::create(dir.path(), "", options());
                store.and_then(|store| store.append(&[draft(i, 10)]))
            };
            let all: Vec<_> = (0..4).map(|i| scope.spawn(move || make(i))).collect();
            all.into_iter().map(|t| t.join().unwrap()).collect::<Vec<_>>()
        });
        let won = made.iter().filter(|m| m.is_ok()).count();
        assert_eq!(won, 1, "{made:?}");
        let store = LocalStore::open_shared(dir.path()).unwrap();
        assert_eq!(store.find(&Query::default()).unwrap().len(), 1);
    }
}

#[test]
fn one_writes_and_many_read() {
    let dir = tempfile::tempdir().unwrap();
    let nothing = LocalStore::open(&dir.path().join("none"), "", options());
    assert!(matches!(nothing, Err(Error::NoRecord { .. })));
    let store = LocalStore::create(dir.path(), "", options()).unwrap();
    assert!(matches!(LocalStore::create(dir.path(), "", options()), Err(Error::Exists { .. })));
    assert!(matches!(LocalStore::open(dir.path(), "", options()), Err(Error::InUse { .. })));
    let reader = LocalStore::open_shared(dir.path()).unwrap();
    for i in 0..3 {
        let id = store.append(&[draft(i, 10)]).unwrap()[0];
        assert_whole(&reader, id, i, 10);
    }
    assert!(matches!(reader.append(&[draft(3, 10)]), Err(Error::Input { .. })));
    assert!(reader.verify().unwrap().is_whole());
    drop(store);
    assert_eq!(LocalStore::open_shared(dir.path()).unwrap().find(&Query::default()).unwrap().len(), 3);
}

/// Records ten times the size limit: the limit holds at every moment, within a segment, and pinned records
/// stay.
#[test]
fn a_bound_in_bytes_holds_while_recording() {
    let dir = tempfile::tempdir().unwrap();
    let limit = 4 << 20;
    let retention = Retention { max_bytes: Some(limit), ..Retention::default() };
    let bounded = LocalOptions { retention, durability: Durability::Process, ..options() };
    let segment = limit / 16;
    let store = LocalStore::create(dir.path(), "", bounded).unwrap();
    let mut pinned = Vec::new();
    for i in 0..640 {
        let id = store.append(&[draft(i, 64 << 10)]).unwrap()[0];
        if i % 100 == 7 {
            store.pin(&[id], "model").unwrap();
            pinned.push((id, i));
        }
        let used: u64 = segments(dir.path()).iter().map(|p| fs::metadata(p).unwrap().len()).sum();
        let index: u64 = ["index.sqlite", "index.sqlite-wal", "index.sqlite-shm"]
            .iter()
            .map(|f| fs::metadata(dir.path().join(f)).map_or(0, |m| m.len()))
            .sum();
        assert!(used + index <= limit + segment, "after {i}: {used} + {index} of {limit}");
        assert_eq!(store.stats().unwrap().bytes, used + index);
    }
    for (id, i) in &pinned {
        assert_whole(&store, *id, *i, 64 << 10);
    }
    let report = store.verify().unwrap();
    let stats = store.stats().unwrap();
    assert!(report.is_whole() && report.whole == stats.records, "{report:?} {stats:?}");
    assert!(stats.records > 30 && stats.records < 64 + 20, "{stats:?}");
    drop(store);
    let store = LocalStore::open(dir.path(), "", bounded).unwrap();
    assert_eq!(store.recovery().regained, 0);
    for (id, i) in &pinned {
        assert_whole(&store, *id, *i, 64 << 10);
    }
}
