//! Damaged records of every kind: no undamaged record is lost, and every loss is reported.
//!
//! A generator damages a store at places chosen by a seed. The layout of the undamaged file tells which
//! records are spared; each of them must be found again, byte for byte, with the index and without it.

use descry_memory::stores::Store;
use descry_memory::{Blob, Draft, Durability, Error, Form, LocalOptions, LocalStore, Query, RecordId};
use serde_json::{Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Seeded random numbers (SplitMix64).
struct Draw(u64);

impl Draw {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % end.max(1) as u64) as usize
    }

    fn within(&mut self, range: Range<usize>) -> usize {
        range.start + self.below(range.len())
    }
}

/// A kind of damage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// A flipped bit in a length field of a chunk.
    Length,
    /// A flipped bit in the head of a chunk, except its lengths.
    Head,
    /// A flipped bit in the records of a chunk.
    Body,
    /// A flipped bit in the message index behind a chunk.
    MessageIndex,
    /// A flipped bit in the header of the file.
    Header,
    /// A file truncated anywhere.
    Torn,
    /// A block of zeros.
    Zeroed,
    /// A block of random bytes.
    Rubbish,
    /// Bytes removed from the middle.
    Removed,
    /// A second segment file without valid content.
    Segment,
    /// A damaged index.
    Index,
    /// A file of no bytes.
    Emptied,
    /// A segment with the number of another.
    Renumbered,
    /// A segment with the name of none.
    Renamed,
}

const KINDS: [Kind; 14] = [
    Kind::Length,
    Kind::Head,
    Kind::Body,
    Kind::MessageIndex,
    Kind::Header,
    Kind::Torn,
    Kind::Zeroed,
    Kind::Rubbish,
    Kind::Removed,
    Kind::Segment,
    Kind::Index,
    Kind::Emptied,
    Kind::Renumbered,
    Kind::Renamed,
];

/// State in which the writer left the store.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// Left by a killed process.
    Killed,
    /// Left by a killed process, and the index is missing.
    KilledWithoutIndex,
    /// Closed.
    Closed,
    /// Closed, and the index is missing.
    ClosedWithoutIndex,
}

const STATES: [State; 4] =
    [State::Killed, State::KilledWithoutIndex, State::Closed, State::ClosedWithoutIndex];

/// A chunk: the ranges of its head, data and message index, and its records.
struct Chunk {
    head: Range<usize>,
    data: Range<usize>,
    index: Range<usize>,
    records: Vec<RecordId>,
}

/// A store in both states, with the layout of its one segment.
struct Original {
    dir: tempfile::TempDir,
    chunks: Vec<Chunk>,
    blobs: Vec<Vec<u8>>,
}

fn options() -> LocalOptions {
    LocalOptions { durability: Durability::Process, ..LocalOptions::default() }
}

fn segment(dir: &Path) -> PathBuf {
    dir.join("segments/00000001.mcap")
}

/// Files among the segments, with their content.
fn files(dir: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let paths = fs::read_dir(dir.join("segments")).unwrap().map(|entry| entry.unwrap().path());
    paths.map(|path| (path.clone(), fs::read(path).unwrap())).collect()
}

fn copy(from: &Path, to: &Path, with_index: bool) {
    fs::create_dir_all(to.join("segments")).unwrap();
    for entry in fs::read_dir(from).unwrap().chain(fs::read_dir(from.join("segments")).unwrap()) {
        let path = entry.unwrap().path();
        let is_index = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("index"));
        if path.is_file() && (with_index || !is_index) {
            fs::copy(&path, to.join(path.strip_prefix(from).unwrap())).unwrap();
        }
    }
}

/// Eight batches of one to three records, of blobs between nothing and 12 kB, some of which look like heads of chunks.
fn original() -> Original {
    let dir = tempfile::tempdir().unwrap();
    let live = dir.path().join("live");
    let store = LocalStore::create(&live, "", options()).unwrap();
    let mut draw = Draw(7);
    let (mut blobs, mut batches) = (Vec::new(), Vec::new());
    for batch in 0..8 {
        let mut drafts = Vec::new();
        for _ in 0..=batch % 3 {
            let length = [0, 30, 700, 12_000][draw.below(4)];
            let data: Vec<u8> =
                (0..length).map(|k| if k % 9 < 3 { 6 } else { draw.below(256) as u8 }).collect();
            let mut draft = Draft::new("scan", blobs.len() as i64 * 1000);
            draft.meta.body = json!({ "i": blobs.len() });
            blobs.push(data.clone());
            draft.blobs.push(Blob {
                name: "data".into(),
                form: Form::Bytes,
                layout: Value::Null,
                data: data.into(),
            });
            drafts.push(draft);
        }
        batches.push(store.append(&drafts).unwrap());
    }
    copy(&live, &dir.path().join("killed"), true);
    drop(store);
    fs::rename(&live, dir.path().join("closed")).unwrap();
    let bytes = fs::read(segment(&dir.path().join("closed"))).unwrap();
    let mut chunks: Vec<(usize, usize, usize)> = mcap::Summary::read(&bytes)
        .unwrap()
        .unwrap()
        .chunk_indexes
        .iter()
        .map(|c| (c.chunk_start_offset as usize, c.chunk_length as usize, c.message_index_length as usize))
        .collect();
    chunks.sort_unstable();
    let chunks = chunks.into_iter().zip(batches).map(|((at, length, index), records)| Chunk {
        head: at..at + 49,
        data: at + 49..at + length,
        index: at + length..at + length + index,
        records,
    });
    Original { chunks: chunks.collect(), blobs, dir }
}

fn touches(a: &Range<usize>, b: &Range<usize>) -> bool {
    a.start < b.end && b.start < a.end
}

/// Expected remains after damage.
struct Left {
    records: BTreeSet<RecordId>,
    /// True if an interrupted write explains the damage.
    is_torn: bool,
}

impl Original {
    /// Records of all chunks whose head and data lie outside these bytes.
    fn beside(&self, hit: &Range<usize>) -> BTreeSet<RecordId> {
        let spared = self.chunks.iter().filter(|c| !touches(&(c.head.start..c.data.end), hit));
        spared.flat_map(|c| c.records.iter().copied()).collect()
    }

    fn all(&self) -> BTreeSet<RecordId> {
        self.beside(&(0..0))
    }

    /// Damages the store in a folder and returns the expected remains.
    fn damage(&self, here: &Path, kind: Kind, draw: &mut Draw) -> Left {
        let path = segment(here);
        let mut bytes = fs::read(&path).unwrap();
        let chunk = &self.chunks[draw.below(self.chunks.len())];
        let end = self.chunks.last().unwrap().index.end;
        let whole = |records| Left { records, is_torn: false };
        let mut flip = |at: usize, draw: &mut Draw| bytes[at] ^= 1 << draw.below(8);
        let left = match kind {
            Kind::Length => {
                let field = [1, 25, 41][draw.below(3)];
                flip(chunk.head.start + field + draw.below(8), draw);
                whole(self.all())
            }
            Kind::Head => {
                let places: Vec<usize> =
                    (0..49).filter(|i| !(1..9).contains(i) && !(25..33).contains(i) && *i < 41).collect();
                flip(chunk.head.start + places[draw.below(places.len())], draw);
                whole(self.all())
            }
            Kind::Body => {
                let at = draw.within(chunk.data.clone());
                flip(at, draw);
                whole(self.beside(&(at..at + 1)))
            }
            Kind::MessageIndex => {
                flip(draw.within(chunk.index.clone()), draw);
                whole(self.all())
            }
            Kind::Header => {
                // The name of the program that wrote, behind it, may say anything.
                flip(draw.below(25), draw);
                whole(self.all())
            }
            Kind::Torn => {
                let cut = draw.below(bytes.len());
                bytes.truncate(cut);
                Left { records: self.beside(&(cut..usize::MAX)), is_torn: true }
            }
            Kind::Zeroed | Kind::Rubbish => {
                let length = [16, 512, 4096][draw.below(3)].min(end);
                let from = draw.below(end - length);
                let filled = from..from + length;
                for byte in &mut bytes[filled.clone()] {
                    *byte = if kind == Kind::Zeroed { 0 } else { draw.below(256) as u8 };
                }
                let is_torn = kind == Kind::Zeroed && bytes[from..].iter().all(|b| *b == 0);
                Left { records: self.beside(&filled), is_torn }
            }
            Kind::Removed => {
                let from = draw.below(end - 40);
                let gone = from..from + 1 + draw.below(39);
                bytes.drain(gone.clone());
                whole(self.beside(&gone))
            }
            Kind::Emptied => {
                bytes.clear();
                Left { records: BTreeSet::new(), is_torn: true }
            }
            Kind::Segment | Kind::Index | Kind::Renumbered | Kind::Renamed => {
                return self.damage_files(here, kind, draw);
            }
        };
        fs::write(path, bytes).unwrap();
        left
    }

    /// Damages files beside the bytes of the segment, or their names, and returns the expected remains.
    fn damage_files(&self, here: &Path, kind: Kind, draw: &mut Draw) -> Left {
        match kind {
            Kind::Segment => {
                let length = 50 + draw.below(3000);
                let rubbish: Vec<u8> = (0..length).map(|_| draw.below(256) as u8).collect();
                fs::write(here.join("segments/00000002.mcap"), rubbish).unwrap();
                Left { records: self.all(), is_torn: false }
            }
            Kind::Index => {
                let index = here.join("index.sqlite");
                if let Ok(mut bytes) = fs::read(&index) {
                    let at = draw.below(bytes.len());
                    bytes[at] ^= 1 << draw.below(8);
                    fs::write(index, bytes).unwrap();
                }
                Left { records: self.all(), is_torn: true }
            }
            _ => {
                let (name, records) = match kind {
                    Kind::Renumbered => (["00000002.mcap", "00000009.mcap"][draw.below(2)], self.all()),
                    _ => (["00000001x.mcap", "1.mcap", "old"][draw.below(3)], BTreeSet::new()),
                };
                let path = segment(here);
                fs::rename(&path, path.with_file_name(name)).unwrap();
                Left { records, is_torn: kind == Kind::Renumbered }
            }
        }
    }

    /// Checks that a store holds these records, byte for byte; returns the number of all that it holds.
    fn assert_holds(&self, store: &LocalStore, left: &BTreeSet<RecordId>, what: &str) -> usize {
        let mut found = BTreeSet::new();
        let faults = store.each_whole(&Query::of_kind("scan"), &mut |document, blobs| {
            let i = document.body["i"].as_u64().unwrap() as usize;
            assert_eq!(blobs[0], self.blobs[i], "{what}");
            assert_eq!(document.id.0, i as u64 + 1, "{what}");
            found.insert(document.id);
            Ok(())
        });
        faults.unwrap();
        assert!(found.is_superset(left), "{what}: {left:?} are whole, {found:?} are found");
        found.len()
    }

    /// Damages a copy, reads it, verifies it, and opens it for writing.
    fn check(&self, kind: Kind, state: State, seed: u64) {
        let mut draw = Draw(seed);
        let what = format!("{kind:?}, {state:?}, seed {seed}");
        let here = self.dir.path().join("here");
        let (from, with_index) = match state {
            State::Killed => ("killed", true),
            State::KilledWithoutIndex => ("killed", false),
            State::Closed => ("closed", true),
            State::ClosedWithoutIndex => ("closed", false),
        };
        copy(&self.dir.path().join(from), &here, with_index);
        let left = self.damage(&here, kind, &mut draw);
        let is_closed = from == "closed";
        // Without an index, nobody knows of a record in an end that looks unfinished.
        let may_be_unknown = state == State::KilledWithoutIndex && left.is_torn;
        let damaged = files(&here);
        {
            let store = LocalStore::open_shared(&here).unwrap();
            let found = self.assert_holds(&store, &left.records, &what);
            let report = store.verify().unwrap();
            assert!(report.whole >= left.records.len() as u64, "{what}: {report:?}");
            let must_tell = !left.is_torn
                || (is_closed && kind != Kind::Index)
                || (found < self.all().len() && !may_be_unknown);
            assert!(!must_tell || !report.is_whole(), "{what}: {report:?}");
        }
        match LocalStore::open(&here, "", LocalOptions::default()) {
            Ok(store) => {
                let next = store.append(&[Draft::new("more", 0)]).unwrap()[0];
                assert!(!left.records.contains(&next), "{what}");
                drop(store);
                let store = LocalStore::open(&here, "", options()).unwrap();
                let found = self.assert_holds(&store, &left.records, &what);
                assert!(may_be_unknown || is_closed || found == self.all().len(), "{what}: {found} are left");
                assert!(left.is_torn || is_closed, "{what}: {:?}", store.recovery());
            }
            Err(Error::Faulty { faults, .. }) => {
                assert!(!faults.is_empty(), "{what}");
                assert!(files(&here) == damaged, "{what}: nothing is changed");
            }
            Err(e) => panic!("{what}: {e}"),
        }
        fs::remove_dir_all(&here).unwrap();
    }
}

fn check_kinds(of_each: u64) {
    let original = original();
    for kind in KINDS {
        for seed in 0..of_each {
            original.check(kind, STATES[seed as usize % STATES.len()], seed);
        }
    }
}

#[test]
fn no_damage_costs_what_is_whole() {
    check_kinds(8);
}

#[test]
#[ignore = "slow: 200 damaged records of each kind, some minutes"]
fn no_damage_of_many_costs_what_is_whole() {
    check_kinds(200);
}

/// In a damaged batch, the checksums in the index prove the undamaged records.
#[test]
fn records_beside_a_damaged_one_are_proven_by_the_index() {
    let original = original();
    let here = original.dir.path().join("here");
    copy(&original.dir.path().join("killed"), &here, true);
    let chunk = original.chunks.iter().find(|c| c.records.len() == 3).unwrap();
    let path = segment(&here);
    let mut bytes = fs::read(&path).unwrap();
    bytes[chunk.data.end - 2] ^= 16;
    fs::write(&path, bytes).unwrap();
    let mut left = original.all();
    left.remove(&chunk.records[2]);
    let store = LocalStore::open_shared(&here).unwrap();
    original.assert_holds(&store, &left, "the last document of a batch of three");
    let said = format!("{:?}", store.recovery().faults);
    assert!(said.contains(&format!("record {} is lost", chunk.records[2])), "{said}");
    assert_eq!(store.verify().unwrap().whole, left.len() as u64);
    match LocalStore::open(&here, "", options()).map(drop) {
        Err(Error::Faulty { faults, .. }) => assert_eq!(faults, store.recovery().faults),
        other => panic!("{other:?}"),
    }
}

/// Three segments in a row, the middle one damaged and the first torn: opening for writing refuses before any
/// truncation.
#[test]
fn nothing_is_cut_where_anything_is_damaged() {
    let original = original();
    let here = original.dir.path().join("here");
    copy(&original.dir.path().join("killed"), &here, false);
    let path = segment(&here);
    let whole = fs::read(&path).unwrap();
    fs::write(&path, &whole[..whole.len() - 5]).unwrap();
    let mut second = whole.clone();
    second[original.chunks[2].data.start + 3] ^= 1;
    fs::write(here.join("segments/00000002.mcap"), &second).unwrap();
    let opened = LocalStore::open(&here, "", options()).map(drop);
    assert!(matches!(opened, Err(Error::Faulty { .. })), "{opened:?}");
    assert_eq!(fs::read(&path).unwrap().len(), whole.len() - 5);
    assert_eq!(fs::read(here.join("segments/00000002.mcap")).unwrap(), second);
}

/// Segments of one length with each other's names: no record is taken for another, and verification tells.
#[test]
fn swapped_segments_are_told() {
    let dir = tempfile::tempdir().unwrap();
    let small = LocalOptions { segment_bytes: 1 << 10, ..options() };
    let store = LocalStore::create(dir.path(), "", small).unwrap();
    let draft = |i: i64| {
        let mut draft = Draft::new("scan", i);
        draft.meta.body = json!({ "i": i, "fill": "x".repeat(2000) });
        draft
    };
    let ids: Vec<RecordId> = (0..4).map(|i| store.append(&[draft(i)]).unwrap()[0]).collect();
    drop(store);
    let names = [1, 2].map(|n| dir.path().join(format!("segments/{n:08}.mcap")));
    let [first, second] = names.each_ref().map(|path| fs::read(path).unwrap());
    assert_eq!(first.len(), second.len());
    fs::write(&names[0], second).unwrap();
    fs::write(&names[1], first).unwrap();
    let store = LocalStore::open_shared(dir.path()).unwrap();
    let lost: Vec<_> = store.verify().unwrap().faults.iter().filter_map(|fault| fault.record).collect();
    assert_eq!(lost, ids[..2]);
    for (i, id) in ids.iter().enumerate() {
        match store.get(*id) {
            Ok(document) => assert_eq!(document.body["i"], i),
            Err(e) => assert!(i < 2 && matches!(e, Error::Damaged { .. }), "{e}"),
        }
    }
}
