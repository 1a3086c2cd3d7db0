//! Data beside the checkout.

use std::path::{Path, PathBuf};

/// A folder beside the checkout, for tests that are run on request.
pub fn shared(path: &str) -> PathBuf {
    let found = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared").join(path);
    assert!(found.exists(), "{} is not there", found.display());
    found
}
