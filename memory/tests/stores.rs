//! The local store meets the requirements of every store.

use crate::suite;
use descry_memory::{LocalOptions, LocalStore, Retention};

#[test]
fn the_local_store_does_what_every_store_does() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    suite::check(&LocalStore::create(&at("one"), "robot", LocalOptions::default()).unwrap());
    let small = LocalOptions { segment_bytes: 64 << 10, ..LocalOptions::default() };
    suite::check(&LocalStore::create(&at("many"), "robot", small).unwrap());
    suite::check_prune(&LocalStore::create(&at("pruned"), "robot", small).unwrap());
    let retention = Retention { max_bytes: Some(4 << 20), ..Retention::default() };
    let bounded = LocalOptions { retention, ..LocalOptions::default() };
    suite::check_bounded(&LocalStore::create(&at("bounded"), "robot", bounded).unwrap());
}
