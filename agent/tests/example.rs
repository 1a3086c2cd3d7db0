//! The example of an own body keeps the promises of bodies, and the agent comes to a verdict with it.

use crate::own_body;

#[test]
fn the_example_passes_and_is_lived_with() {
    let folder = tempfile::TempDir::new().expect("a folder can be made");
    let said = own_body::pursue("find cup A", &folder.path().join("run")).unwrap_or_else(|e| panic!("{e}"));
    assert!(said.contains("cup A is not there"), "{said}");
    assert!(folder.path().join("run/report.json").is_file());
}
