//! Stress tests of records: `cargo run --release -p descry-measure --bin endurance -- WHAT DIR [SIZE]`.
//!
//! | WHAT | shows | SIZE |
//! |---|---|---|
//! | `clouds` | sustained clouds of 5 MB, alternating with a raw append with `fdatasync` | clouds, 200 |
//! | `transforms` | 3,500 transforms a second: blocking time of the caller, and the greatest burst | simulated seconds, 600 |
//! | `nearest` | lookup of the nearest in time among many documents | documents, 1000000 |
//! | `open` | opening a large record | gigabytes, 5 |
//! | `kills` | kills at random moments of a recording process | kills, 200 |
//! | `full` | a full disk; DIR is on a small file system, as `mount -t tmpfs -o size=24m tmpfs DIR` makes | rounds, 20 |
//! | `retention` | a recording ten times its limit | megabytes of the limit, 64 |
//!
//! Everything is written below DIR, which must not hold anything else, and is deleted at the end.

use descry_memory::{
    Blob, Draft, Error, Form, Meta, Options, Query, Record, RecordId, Retention, Sensing, kind,
    perception::Cloud,
};
use nalgebra::{Isometry3, Point3};
use serde_json::{Value, json};
use std::fs::{self, File};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::time::{Duration, Instant};

type Outcome = Result<(), Box<dyn std::error::Error>>;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some((what, dir)) = arguments.first().zip(arguments.get(1)) else {
        eprintln!("endurance WHAT DIR [SIZE]: clouds, transforms, nearest, open, kills, full, retention");
        return ExitCode::from(2);
    };
    let size: Option<u64> = arguments.get(2).and_then(|s| s.parse().ok());
    let dir = PathBuf::from(dir);
    let result = match what.as_str() {
        "clouds" => clouds(&dir, size.unwrap_or(200)),
        "transforms" => transforms(&dir, size.unwrap_or(600)),
        "nearest" => nearest(&dir, size.unwrap_or(1_000_000)),
        "open" => open(&dir, size.unwrap_or(5)),
        "kills" => kills(&dir, size.unwrap_or(200)),
        "full" => full(&dir, size.unwrap_or(20)),
        "retention" => retention(&dir, size.unwrap_or(64)),
        "record-until-killed" => record_until_killed(&dir, size.unwrap_or(0)),
        other => Err(format!("`{other}` is nothing that is measured").into()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("{what}: {e}");
            ExitCode::FAILURE
        }
    }
}

/// Seeded random number generator.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D)
    }
    fn below(&mut self, n: u64) -> u64 {
        self.next() % n.max(1)
    }
}

/// Current and peak memory of this process, megabytes.
fn memory_mb() -> (u64, u64) {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let field = |name: &str| {
        let line = status.lines().find(|l| l.starts_with(name));
        line.and_then(|l| l.split_whitespace().nth(1)).and_then(|v| v.parse::<u64>().ok()).unwrap_or(0) / 1024
    };
    (field("VmRSS:"), field("VmHWM:"))
}

fn cloud(points: usize, seed: u64) -> Cloud {
    let mut random = Random(seed | 1);
    let mut coordinate = || random.below(1 << 20) as f32 / 1e5;
    Cloud::from_points((0..points).map(|_| Point3::new(coordinate(), coordinate(), coordinate())).collect())
}

fn sorted(mut times: Vec<Duration>) -> Vec<Duration> {
    times.sort_unstable();
    times
}

fn clean(dir: &Path) -> Outcome {
    for name in ["record", "raw"] {
        let path = dir.join(name);
        if path.is_dir() {
            fs::remove_dir_all(path)?;
        } else if path.exists() {
            fs::remove_file(path)?;
        }
    }
    Ok(())
}

fn clouds(dir: &Path, count: u64) -> Outcome {
    clean(dir)?;
    let frames: Vec<Cloud> = (0..4).map(|i| cloud(5_000_000 / 12, i)).collect();
    let record = Record::create(&dir.join("record"), Options::default())?;
    let mut raw = File::create(dir.join("raw"))?;
    let before = memory_mb().0;
    let (mut ours, mut theirs) = (Vec::new(), Vec::new());
    // In turns, so that whatever else the machine does falls on both.
    for i in 0..count {
        let frame = &frames[i as usize % frames.len()];
        let bytes: &[u8] = bytemuck::cast_slice(&frame.points);
        let start = Instant::now();
        raw.write_all(bytes)?;
        raw.sync_data()?;
        theirs.push(start.elapsed());
        let start = Instant::now();
        record.put_cloud(i as i64 * 1_000_000, "camera", frame, &Sensing::default(), Meta::default())?;
        ours.push(start.elapsed());
    }
    let rate = |times: &[Duration]| count as f64 * 5.0 / times.iter().sum::<Duration>().as_secs_f64();
    let (our_rate, their_rate) = (rate(&ours), rate(&theirs));
    let (ours, theirs) = (sorted(ours), sorted(theirs));
    let middle = |times: &[Duration]| times[times.len() / 2].as_secs_f64() * 1e3;
    println!(
        "clouds of 5 MB, each acknowledged on the disk: {our_rate:.0} MB/s (median {:.2} ms, worst {:.1} ms)",
        middle(&ours),
        ours[ours.len() - 1].as_secs_f64() * 1e3
    );
    println!(
        "raw append with fdatasync, in turns with it: {their_rate:.0} MB/s (median {:.2} ms, worst {:.1} ms)",
        middle(&theirs),
        theirs[theirs.len() - 1].as_secs_f64() * 1e3
    );
    println!(
        "share: {:.2} by sums, {:.2} by medians",
        our_rate / their_rate,
        middle(&theirs) / middle(&ours)
    );
    println!("memory: {before} MB before, {} MB after, at most {} MB", memory_mb().0, memory_mb().1);
    drop(record);
    clean(dir)
}

const RATE_HZ: u64 = 3500;
const CHILDREN: u64 = 100;

/// Factor by which the transforms arrive faster than in real time.
const SPEED_UP: u64 = 10;

fn transforms(dir: &Path, seconds: u64) -> Outcome {
    clean(dir)?;
    let record = Record::create(&dir.join("record"), Options::default())?;
    let names: Vec<String> = (0..CHILDREN).map(|i| format!("link_{i}")).collect();
    let put = |i: u64| {
        let stamp_ns = (i * 1_000_000_000 / RATE_HZ) as i64;
        record.put_transform(
            stamp_ns,
            "base",
            &names[(i % CHILDREN) as usize],
            &Isometry3::translation(i as f64 * 1e-3, 0.0, 1.0),
        )
    };
    // So many calls waited less than 2^k nanoseconds and not less than half of that.
    let mut waits = [0_u64; 64];
    let (mut worst, mut memory) = (Duration::ZERO, Vec::new());
    let begin = Instant::now();
    let count = seconds * RATE_HZ;
    for i in 0..count {
        let due = Duration::from_nanos(i * (1_000_000_000 / RATE_HZ / SPEED_UP));
        while begin.elapsed() < due {
            std::thread::sleep(Duration::from_micros(200));
        }
        let start = Instant::now();
        put(i)?;
        let wait = start.elapsed();
        waits[wait.as_nanos().max(1).ilog2() as usize + 1] += 1;
        worst = worst.max(wait);
        if i % (count / 10).max(1) == 0 {
            memory.push(memory_mb().0);
        }
    }
    record.sync()?;
    let wall = begin.elapsed().as_secs_f64();
    println!(
        "{count} transforms, {seconds} s at {RATE_HZ}/s, {SPEED_UP} times as fast: {wall:.1} s of wall time"
    );
    let below = |share: f64| {
        let mut sum = 0;
        let k = waits.iter().position(|n| {
            sum += n;
            sum as f64 >= share * count as f64
        });
        (1_u64 << k.unwrap_or(63)) as f64 * 1e-3
    };
    println!(
        "the caller waits: 50 % below {:.1} us, 99.9 % below {:.1} us, 99.999 % below {:.0} us, worst {:.2} ms",
        below(0.5),
        below(0.999),
        below(0.99999),
        worst.as_secs_f64() * 1e3
    );
    println!("memory through the run, MB: {memory:?}");
    let stats = record.stats()?;
    let per_second = stats.records as f64 / seconds as f64;
    println!(
        "{} documents, {per_second:.1} a simulated second; {} bytes a transform",
        stats.records,
        stats.bytes / count
    );
    let found = record.transform("base", "link_7", (seconds as i64 * 1_000_000_000) / 2 + 123_456)?;
    println!("half way through the run link_7 stood at x = {:.4} m", found.translation.x);
    let begin = Instant::now();
    let burst = 300 * RATE_HZ;
    (count..count + burst).try_for_each(put)?;
    record.sync()?;
    let rate = burst as f64 / begin.elapsed().as_secs_f64();
    println!("greatest burst: {rate:.0} transforms a second, until they are on the disk");
    drop(record);
    clean(dir)
}

fn nearest(dir: &Path, count: u64) -> Outcome {
    clean(dir)?;
    let options = Options::default();
    let record = Record::create(&dir.join("record"), options.clone())?;
    let start = Instant::now();
    let mut random = Random(7);
    for first in (0..count).step_by(1000) {
        let drafts: Vec<Draft> = (first..(first + 1000).min(count))
            .map(|i| {
                let mut draft = Draft::new(
                    ["percept", "belief", "skill"][i as usize % 3],
                    (i * 1000 + random.below(900)) as i64,
                );
                draft.meta.body = json!({ "i": i, "text": "what was seen and what was made of it" });
                draft
            })
            .collect();
        record.put_all(&drafts)?;
    }
    println!("{count} documents written in {:.1} s", start.elapsed().as_secs_f64());
    drop(record);
    let start = Instant::now();
    let record = Record::open(&dir.join("record"), options)?;
    println!("opened in {:.1} ms", start.elapsed().as_secs_f64() * 1e3);
    let mut times = Vec::new();
    for _ in 0..10_000 {
        let stamp_ns = random.below(count * 1000) as i64;
        let start = Instant::now();
        let found = record.nearest("percept", stamp_ns, i64::MAX)?;
        times.push(start.elapsed());
        if found.stamp_ns.abs_diff(stamp_ns) > 4000 {
            return Err(format!("{} is not the nearest to {stamp_ns}", found.stamp_ns).into());
        }
    }
    let times = sorted(times);
    let at = |share: f64| times[((times.len() - 1) as f64 * share) as usize].as_secs_f64() * 1e6;
    println!("nearest in time: median {:.0} us, 99 % {:.0} us, worst {:.0} us", at(0.5), at(0.99), at(1.0));
    drop(record);
    clean(dir)
}

fn open(dir: &Path, gigabytes: u64) -> Outcome {
    clean(dir)?;
    let options = Options { durability: descry_memory::Durability::Process, ..Options::default() };
    let record = Record::create(&dir.join("record"), options.clone())?;
    let frame = cloud(5_000_000 / 12, 1);
    for i in 0..gigabytes * 200 {
        record.put_cloud(i as i64 * 1_000_000, "camera", &frame, &Sensing::default(), Meta::default())?;
    }
    record.sync()?;
    let size = record.stats()?.bytes as f64 / 1e9;
    // As after a kill: the last segment is not finished.
    std::mem::forget(record);
    let copy = dir.join("record").join("lock");
    fs::remove_file(copy)?;
    for round in ["after a kill", "after a proper end"] {
        let start = Instant::now();
        let record = Record::open(&dir.join("record"), options.clone())?;
        println!(
            "{size:.1} GB opened {round} in {:.1} ms ({:?})",
            start.elapsed().as_secs_f64() * 1e3,
            record.recovery()
        );
        drop(record);
    }
    clean(dir)
}

/// The content of a record, derived from its number.
fn numbered(i: u64) -> Draft<'static> {
    let length = Random(i + 1).below(200_000) as usize;
    let mut random = Random(i.wrapping_mul(77) | 1);
    let data: Vec<u8> = (0..length).map(|_| random.next() as u8).collect();
    let mut draft = Draft::new("scan", i as i64 * 1000);
    draft.meta.body = json!({ "i": i });
    draft.blobs.push(Blob { name: "data".into(), form: Form::Bytes, layout: Value::Null, data: data.into() });
    draft
}

/// Records and prints each acknowledged number, until killed.
fn record_until_killed(dir: &Path, first: u64) -> Outcome {
    let record = match Record::open(dir, small_segments()) {
        Err(Error::NoRecord { .. }) => Record::create(dir, small_segments())?,
        opened => opened?,
    };
    let mut out = std::io::stdout().lock();
    for i in first.. {
        let id = record.put(numbered(i))?;
        record.put_transform(i as i64 * 1000, "map", "base", &Isometry3::translation(i as f64, 0.0, 0.0))?;
        if i % 7 == 0 {
            record.sync()?;
            writeln!(out, "synced {i} {i}")?;
        }
        if i % 11 == 0 {
            record.pin(&[id], "test")?;
        }
        writeln!(out, "put {i} {id}")?;
        out.flush()?;
    }
    Ok(())
}

fn small_segments() -> Options {
    Options { segment_bytes: 2 << 20, ..Options::default() }
}

fn kills(dir: &Path, count: u64) -> Outcome {
    clean(dir)?;
    let place = dir.join("record");
    let mut random = Random(std::process::id().into());
    let mut acknowledged: Vec<(u64, RecordId)> = Vec::new();
    let (mut next, mut lost, mut unreadable, mut surplus) = (0, 0, 0, 0);
    let mut synced = None;
    for round in 0..count {
        let mut child = Command::new(std::env::current_exe()?)
            .args(["record-until-killed", &place.to_string_lossy(), &next.to_string()])
            .stdout(Stdio::piped())
            .spawn()?;
        let out = child.stdout.take().ok_or("the child has no output")?;
        let wait = Duration::from_micros(10_000 + random.below(250_000));
        let reader =
            std::thread::spawn(move || BufReader::new(out).lines().map_while(Result::ok).collect::<Vec<_>>());
        std::thread::sleep(wait);
        child.kill()?;
        child.wait()?;
        let lines = reader.join().map_err(|_| "the reader failed")?;
        for line in lines {
            let words: Vec<&str> = line.split(' ').collect();
            match words[..] {
                ["put", i, id] => acknowledged.push((i.parse()?, RecordId(id.parse()?))),
                ["synced", i, _] => synced = Some(i.parse::<u64>()?),
                _ => (),
            }
        }
        if !place.join("segments").exists() {
            continue;
        }
        match Record::open(&place, small_segments()) {
            Ok(record) => {
                // All of the last rounds, and of earlier ones every tenth.
                let from = acknowledged.len().saturating_sub(60);
                for (k, (i, id)) in acknowledged.iter().enumerate() {
                    if (k >= from || round % 10 == 9 || round + 1 == count) && !is_there(&record, *i, *id) {
                        lost += 1;
                        eprintln!(
                            "round {round}: record {id}, number {i}, was acknowledged and is not there"
                        );
                    }
                }
                if let Some(i) = synced
                    && record.transform("map", "base", i as i64 * 1000)?.translation.x != i as f64
                {
                    lost += 1;
                }
                let scans = record.find(&Query::of_kind("scan"))?;
                surplus = scans.len() as i64 - acknowledged.len() as i64;
                next = scans.iter().filter_map(|d| d.body["i"].as_u64()).max().map_or(0, |i| i + 1);
                if round % 10 == 9 && !record.verify()?.is_whole() {
                    unreadable += 1;
                }
            }
            Err(e) => {
                unreadable += 1;
                eprintln!("round {round}: {e}");
            }
        }
    }
    println!(
        "{count} kills: {} records acknowledged, {lost} of them lost, {unreadable} stores unreadable ({surplus} records were written whole and not yet acknowledged)",
        acknowledged.len()
    );
    clean(dir)
}

fn is_there(record: &Record, i: u64, id: RecordId) -> bool {
    let expected = numbered(i);
    let same = |data: Vec<u8>| data == expected.blobs[0].data.as_ref();
    record.store().blob(id, "data").is_ok_and(same)
        && record.store().get(id).is_ok_and(|d| d.body["i"] == json!(i))
}

fn full(dir: &Path, rounds: u64) -> Outcome {
    clean(dir)?;
    let place = dir.join("record");
    let mut record = Record::create(&place, small_segments())?;
    let mut acknowledged = Vec::new();
    let (mut lost, mut i, mut refused) = (0, 0, 0);
    let ballast = dir.join("raw");
    for round in 0..rounds {
        // Something else fills the disk, to another rest each time.
        let mut file = File::create(&ballast)?;
        let rest = 200_000 + round * 37_000;
        while free_bytes(dir)? > rest && file.write_all(&vec![0; 16 << 10]).is_ok() {}
        drop(file);
        let error = loop {
            match record.put(numbered(i)) {
                Ok(id) => acknowledged.push((i, id)),
                Err(e) => break e,
            }
            i += 1;
        };
        if !error.is_full() {
            return Err(error.into());
        }
        refused += 1;
        lost += acknowledged.iter().filter(|(i, id)| !is_there(&record, *i, *id)).count();
        // Every second time the process ends here, and the record is opened on the full disk.
        if round % 2 == 1 {
            drop(record);
            let reader = Record::open_shared(&place)?;
            lost += acknowledged.iter().filter(|(i, id)| !is_there(&reader, *i, *id)).count();
            drop(reader);
            fs::remove_file(&ballast)?;
            record = Record::open(&place, small_segments())?;
        } else {
            fs::remove_file(&ballast)?;
        }
        let id = record.put(numbered(i))?;
        acknowledged.push((i, id));
        i += 1;
        lost += acknowledged.iter().filter(|(i, id)| !is_there(&record, *i, *id)).count();
        if acknowledged.len() > 60 {
            acknowledged.clear();
            drop(record);
            clean(dir)?;
            record = Record::create(&place, small_segments())?;
        }
    }
    let whole = record.verify()?.is_whole();
    println!(
        "{refused} times the disk was full: {lost} acknowledged records lost, the store is {}",
        if whole { "whole" } else { "not whole" }
    );
    drop(record);
    clean(dir)
}

fn free_bytes(dir: &Path) -> std::io::Result<u64> {
    let free = rustix::fs::statvfs(dir)?;
    Ok(free.f_bavail * free.f_frsize)
}

fn retention(dir: &Path, megabytes: u64) -> Outcome {
    clean(dir)?;
    let limit = megabytes << 20;
    let retention = Retention { max_bytes: Some(limit), ..Retention::default() };
    let record = Record::create(&dir.join("record"), Options { retention, ..Options::default() })?;
    let frame = cloud(1_000_000 / 12, 3);
    let (mut most, mut pinned, mut written) = (0, Vec::new(), 0);
    while written < 10 * limit {
        let id = record.put_cloud(written as i64, "camera", &frame, &Sensing::default(), Meta::default())?;
        written += 12 * frame.len() as u64;
        if written / (limit / 4) != (written - 12 * frame.len() as u64) / (limit / 4) {
            record.pin(&[id], "model")?;
            pinned.push(id);
        }
        most = most.max(record.stats()?.bytes);
    }
    let there = pinned
        .iter()
        .filter(|id| record.store().get(**id).and_then(|d| record.cloud(&d)).is_ok_and(|(c, _)| c == frame))
        .count();
    let stats = record.stats()?;
    println!(
        "limit {:.1} MB, written {:.1} MB, never more than {:.1} MB on the disk; {there} of {} pinned records are there, {} records in all ({} clouds); whole: {}",
        limit as f64 / 1e6,
        written as f64 / 1e6,
        most as f64 / 1e6,
        pinned.len(),
        stats.records,
        stats.kinds.get(kind::CLOUD).map_or(0, |c| c.records),
        record.verify()?.is_whole()
    );
    drop(record);
    clean(dir)
}
