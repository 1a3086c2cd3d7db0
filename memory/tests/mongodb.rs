//! The store in MongoDB: the common requirements, and its own.

mod server;
mod suite;

use descry_memory::perception::Cloud;
use descry_memory::stores::Store;
use descry_memory::{
    Draft, Durability, Error, Meta, MongoOptions, MongoStore, Options, Query, Record, RecordId, Retention,
    Sensing,
};
use mongodb::bson::{Document as Fields, doc};
use nalgebra::{Isometry3, Point3};
use serde_json::json;
use server::Server;
use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use std::sync::Arc;
use suite::{blob, bytes, fill};

fn named(robot: &str) -> MongoOptions {
    MongoOptions { robot: robot.into(), ..MongoOptions::default() }
}

fn open(server: &Server, database: &str, robot: &str) -> MongoStore {
    MongoStore::open(&server.address(database), &named(robot)).unwrap()
}

#[test]
fn does_what_every_store_does() {
    let Some(server) = Server::shared() else { return };
    suite::check(&open(&server, "one", "robot"));
    suite::check_prune(&open(&server, "pruned", "robot"));
    let retention = Retention { max_bytes: Some(4 << 20), ..Retention::default() };
    let options = MongoOptions { retention, ..named("robot") };
    suite::check_bounded(&MongoStore::open(&server.address("little"), &options).unwrap());
    // Without a name, and read by another.
    let nameless = open(&server, "nameless", "");
    suite::check(&nameless);
    let reader = MongoStore::open_shared(&server.address("nameless"), &named("")).unwrap();
    assert_eq!(reader.find(&Query::default()).unwrap(), nameless.find(&Query::default()).unwrap());
}

/// A name in a shared store sees, counts, verifies and prunes only its own records.
#[test]
fn one_name_does_not_touch_another() {
    let Some(server) = Server::shared() else { return };
    let other = open(&server, "apart", "other");
    fill(&other);
    let before = other.find(&Query::default()).unwrap();
    let robot = open(&server, "apart", "robot");
    suite::check(&robot);
    suite::check_prune(&open(&server, "apart", "third"));
    assert_eq!(other.find(&Query::default()).unwrap(), before);
    assert_eq!(robot.robots().unwrap(), ["robot"]);
    let all = open(&server, "apart", "");
    assert_eq!(all.robots().unwrap(), ["other", "robot", "third"]);
    // Each counts its records from 1; those of another have numbers by which they are read all the same.
    let of_other = Query { robot: Some("other".into()), ..Query::default() };
    for reader in [&robot, &all] {
        let found = reader.find(&of_other).unwrap();
        assert_eq!(found.len(), before.len());
        for (found, own) in found.iter().zip(&before) {
            assert!(found.id > own.id && found.body == own.body);
            assert_eq!(reader.get(found.id).unwrap(), *found);
            assert_eq!(reader.blob(found.id, "points").unwrap(), other.blob(own.id, "points").unwrap());
        }
    }
    assert_eq!([&before[0], &robot.find(&Query::default()).unwrap()[0]].map(|d| d.id), [RecordId(1); 2]);
    assert!(all.stats().unwrap().kinds["scan"].records > 80 && all.verify().unwrap().is_whole());
}

#[test]
fn keeps_within_its_limits_while_recording() {
    let Some(server) = Server::shared() else { return };
    let limit = 1 << 20;
    let retention = Retention { max_bytes: Some(limit), ..Retention::default() };
    let options = MongoOptions { durability: Durability::Process, retention, ..named("robot") };
    let store = MongoStore::open(&server.address("bounded"), &options).unwrap();
    let mut pinned = Vec::new();
    for i in 0..160_u64 {
        let draft = Draft { blobs: vec![blob("points", bytes(i, 64 << 10))], ..Draft::new("scan", i as i64) };
        let id = store.append(&[draft]).unwrap()[0];
        if i % 50 == 7 {
            store.pin(&[id], "model").unwrap();
            pinned.push((id, i));
        }
        assert!(store.stats().unwrap().bytes <= limit, "after {i}");
    }
    for (id, i) in pinned {
        assert_eq!(store.blob(id, "points").unwrap(), bytes(i, 64 << 10));
    }
    assert!(store.verify().unwrap().is_whole());
    check_no_remains(&server, "bounded", store.stats().unwrap().records);
    let free = Retention { min_free_bytes: Some(1), ..Retention::default() };
    let refused = MongoStore::open(
        &server.address("bounded"),
        &MongoOptions { retention: free, ..MongoOptions::default() },
    );
    assert!(matches!(refused.map(|_| ()), Err(Error::Input { .. })));
}

/// Checks that a database holds only complete records and their files.
fn check_no_remains(server: &Server, database: &str, records: u64) {
    let database = server.database(database);
    let all = |name: &str| -> Vec<Fields> {
        database.collection::<Fields>(name).find(doc! {}).run().unwrap().map(Result::unwrap).collect()
    };
    let kept = all("records");
    assert_eq!(kept.len() as u64, records);
    assert!(kept.iter().all(|r| !r.contains_key("pending")));
    let cited = |r: &Fields| {
        let blobs = r.get_array("blobs").into_iter().flatten();
        blobs.map(|b| b.as_document().unwrap().get_object_id("file").unwrap()).collect::<Vec<_>>()
    };
    let mut cited: Vec<_> = kept.iter().flat_map(cited).collect();
    let mut files: Vec<_> = all("fs.files").iter().map(|f| f.get_object_id("_id").unwrap()).collect();
    cited.sort();
    files.sort();
    assert_eq!(cited, files);
    assert!(all("fs.chunks").iter().all(|c| files.contains(&c.get_object_id("files_id").unwrap())));
}

fn camera(x: f32) -> Cloud {
    Cloud::from_points((0..1000).map(|i| Point3::new(x, i as f32 * 0.1, f32::NAN)).collect())
}

/// Robots that record at the same times in the same frames each find their own records.
#[test]
fn several_robots_write_into_one() {
    let Some(server) = Server::shared() else { return };
    let record = |robot: &str| {
        let options = Options { robot: robot.into(), ..Options::default() };
        Record::on(Arc::new(open(&server, "shared", robot)), options)
    };
    std::thread::scope(|scope| {
        for (n, robot) in ["alice", "bob", "carol"].into_iter().enumerate() {
            let record = record(robot);
            scope.spawn(move || {
                for i in 0..10_i64 {
                    let stamp_ns = i * 1_000_000_000;
                    let pose = Isometry3::translation(n as f64, i as f64, 0.0);
                    record.put_transform(stamp_ns, "map", "camera", &pose).unwrap();
                    let cloud = camera(n as f32);
                    record
                        .put_cloud(stamp_ns, "camera", &cloud, &Sensing::default(), Meta::default())
                        .unwrap();
                }
                record.sync().unwrap();
            });
        }
    });
    for (n, robot) in ["alice", "bob", "carol"].into_iter().enumerate() {
        let record = record(robot);
        let view = record.view_at(4_100_000_000, "map").unwrap();
        assert_eq!((view.stamp_ns, view.cloud.points[0].x), (4_000_000_000, n as f32), "{robot}");
        assert_eq!(view.world_from_camera, Isometry3::translation(n as f64, 4.0, 0.0), "{robot}");
        assert_eq!(record.stats().unwrap().kinds["cloud"].records, 10);
    }
    let store = open(&server, "shared", "");
    let all = store.find(&Query::of_kind("cloud")).unwrap();
    let of_bob = Query { robot: Some("bob".into()), ..Query::of_kind("cloud") };
    assert_eq!((all.len(), store.find(&of_bob).unwrap().len()), (30, 10));
    assert!(store.verify().unwrap().is_whole());
}

/// Environment variable that turns this test binary into the recording process; holds the address.
const RECORDING: &str = "DESCRY_TEST_RECORDS_INTO";

/// A recording process is killed repeatedly: acknowledged records remain, and no partial ones.
#[test]
fn a_kill_loses_nothing_and_leaves_nothing() {
    if let Ok(address) = std::env::var(RECORDING) {
        return record_until_killed(&address);
    }
    let Some(server) = Server::shared() else { return };
    let address = server.address("killed");
    let mut acknowledged = Vec::new();
    for round in 0..6_u64 {
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "a_kill_loses_nothing_and_leaves_nothing", "--nocapture"])
            .env(RECORDING, &address)
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let said = BufReader::new(child.stdout.take().unwrap()).lines().map_while(Result::ok);
        let ids = said.filter_map(|line| line.strip_prefix("recorded ")?.parse().ok().map(RecordId));
        acknowledged.extend(ids.take(3 + round as usize));
        // Into the middle of the next record.
        std::thread::sleep(std::time::Duration::from_millis(7 * round));
        child.kill().unwrap();
        child.wait().unwrap();
        let store = open(&server, "killed", "robot");
        for id in &acknowledged {
            let i = store.get(*id).unwrap().stamp_ns as u64;
            assert_eq!(store.blob(*id, "points").unwrap(), bytes(i, 1 << 20), "round {round}");
        }
        let report = store.verify().unwrap();
        assert!(report.is_whole(), "{report:?}");
        check_no_remains(&server, "killed", store.stats().unwrap().records);
    }
    assert_eq!(acknowledged.len(), 3 + 4 + 5 + 6 + 7 + 8);
    // Numbers that no record got are given to others: a record that was cut off counts on as if it had not been.
    let all = open(&server, "killed", "robot").find(&Query::default()).unwrap();
    let mut numbers: Vec<u64> = all.iter().map(|d| d.id.0).collect();
    numbers.sort_unstable();
    assert!(numbers.iter().copied().eq(1..=numbers.len() as u64), "{numbers:?}");
}

fn record_until_killed(address: &str) {
    let store = MongoStore::open(address, &named("robot")).unwrap();
    println!();
    for i in 0.. {
        let draft = Draft { blobs: vec![blob("points", bytes(i, 1 << 20))], ..Draft::new("scan", i as i64) };
        println!("recorded {}", store.append(&[draft]).unwrap()[0]);
    }
}

const READ_FILES: &str = r#"
import sys, zlib, pymongo, gridfs
db = pymongo.MongoClient(sys.argv[1]).get_default_database()
files = gridfs.GridFS(db)
for record in db.records.find({"blobs": {"$exists": True}}).sort("_id"):
    for blob in record["blobs"]:
        file = files.get(blob["file"])
        data = file.read()
        print(record["_id"], blob["name"], file.filename, len(data), zlib.crc32(data), record["stamp_ns"])
indexes = [list(index["key"]) for index in db.records.list_indexes()]
assert ["stamp_ns", "_id"] in indexes, indexes
"#;

#[test]
fn files_are_those_that_anyone_reads() {
    let Some(server) = Server::shared() else { return };
    let store = open(&server, "files", "robot");
    let ids = fill(&store);
    let Some(read) = server.python(READ_FILES, &[&server.address("files")]) else { return };
    let line = |i: usize, name: &str, data: &[u8]| {
        let id = ids[i];
        let number = (1 << 32) + id.0;
        format!("{number} {name} scan/{id}/{name} {} {} {}", data.len(), crc32fast::hash(data), i * 1000)
    };
    let expected = (0..ids.len())
        .flat_map(|i| [line(i, "points", &bytes(i as u64, 1 << (i % 18))), line(i, "none", &[])]);
    assert_eq!(read.lines().collect::<Vec<_>>(), expected.collect::<Vec<_>>());
}

#[test]
fn damage_is_found() {
    let Some(server) = Server::shared() else { return };
    let store = open(&server, "damaged", "robot");
    let ids = fill(&store);
    let database = server.database("damaged");
    let named = doc! { "filename": format!("scan/{}/points", ids[9]) };
    let file = database.collection::<Fields>("fs.files").find_one(named).run().unwrap().unwrap();
    let chunks = database.collection::<Fields>("fs.chunks");
    let this = doc! { "files_id": file.get_object_id("_id").unwrap() };
    let mut chunk = chunks.find_one(this.clone()).run().unwrap().unwrap();
    let Some(mongodb::bson::Bson::Binary(data)) = chunk.get_mut("data") else { panic!("{chunk}") };
    data.bytes[3] ^= 1;
    chunks.replace_one(this, chunk).run().unwrap();
    let report = store.verify().unwrap();
    assert_eq!((report.whole, report.faults.len()), (39, 1), "{report:?}");
    assert_eq!(report.faults[0].record, Some(ids[9]));
}

#[test]
fn what_cannot_be_kept_is_said() {
    let nowhere = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
    let address = format!("mongodb://name:secret@127.0.0.1:{nowhere}/gone");
    let error = MongoStore::open_shared(&address, &named("")).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains(&format!("127.0.0.1:{nowhere}/gone: no server answers")), "{error}");
    assert!(!error.contains("secret"), "{error}");
    let error = MongoStore::open_shared("mongodb://", &named("")).map(|_| ()).unwrap_err();
    assert!(matches!(error, Error::Remote { .. }), "{error}");
    let Some(server) = Server::shared() else { return };
    let store = open(&server, "refused", "robot");
    let mut draft = Draft::new("scan", 0);
    draft.meta.body = json!({ "seed": u64::MAX });
    let error = store.append(&[draft]).unwrap_err();
    assert!(matches!(error, Error::Input { .. }) && error.to_string().contains("2^63"), "{error}");
    assert_eq!(store.stats().unwrap().records, 0);
}
