//! The folder of public measurements, which are not part of the repository.

use std::path::{Path, PathBuf};

/// That folder: `CALIBENCH_DATA`, or `shared/data` beside the repository; or the reason why a test does nothing.
pub fn data(folder: &str) -> Option<PathBuf> {
    // Of a package within the repository, the repository's root is further up.
    let beside = || {
        let package = Path::new(env!("CARGO_MANIFEST_DIR"));
        let mut candidates = package.ancestors().map(|up| up.join("../shared/data"));
        candidates.find(|c| c.is_dir()).unwrap_or_else(|| package.join("../shared/data"))
    };
    let root = std::env::var_os("CALIBENCH_DATA").map_or_else(beside, PathBuf::from).join(folder);
    if !root.is_dir() {
        println!("SKIPPED: {} is not there; set CALIBENCH_DATA to the folder of the public data", root.display());
        return None;
    }
    Some(root)
}
