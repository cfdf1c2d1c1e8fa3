//! Results of independent programs and measurements by others, for comparison: the files of `tests/data`, unpacked.
#![allow(dead_code)] // each test uses its own part

use std::fs;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use lzma_rust2::XzReader;
use tempfile::NamedTempFile;

/// `tests/data` with its files unpacked, in the build directory.
pub fn folder() -> &'static Path {
    static UNPACKED: OnceLock<PathBuf> = OnceLock::new();
    UNPACKED.get_or_init(|| {
        // Seen from a package within the repository, the root is further up.
        let package = Path::new(env!("CARGO_MANIFEST_DIR"));
        let packed = package.ancestors().map(|up| up.join("tests/data")).find(|folder| folder.is_dir());
        let unpacked = Path::new(env!("CARGO_TARGET_TMPDIR")).join("oracles");
        unpack(&packed.expect("the repository has tests/data"), &unpacked);
        unpacked
    })
}

/// A folder of public measurements: one of `tests/data`, or of the folder that `CALIBENCH_DATA` names.
pub fn data(name: &str) -> PathBuf {
    let root = std::env::var_os("CALIBENCH_DATA").map_or_else(|| folder().to_owned(), PathBuf::from);
    let found = root.join(name);
    assert!(found.is_dir(), "{} is not there", found.display());
    found
}

/// Does what of `packed` is not yet in `unpacked`.
fn unpack(packed: &Path, unpacked: &Path) {
    let failed = |e: io::Error| -> ! { panic!("{}: {e}", packed.display()) };
    fs::create_dir_all(unpacked).unwrap_or_else(|e| failed(e));
    for entry in fs::read_dir(packed).unwrap_or_else(|e| failed(e)) {
        let from = entry.unwrap_or_else(|e| failed(e)).path();
        let to = unpacked.join(from.file_name().expect("an entry has a name"));
        if from.is_dir() {
            unpack(&from, &to);
        } else {
            unpack_file(&from, &to).unwrap_or_else(|e| panic!("{}: {e}", from.display()));
        }
    }
}

/// Other processes may be at the same file: it appears whole, and with the time of its source, by which the next one knows it.
fn unpack_file(from: &Path, to: &Path) -> io::Result<()> {
    let is_packed = from.extension().is_some_and(|e| e == "xz");
    let to = if is_packed { to.with_extension("") } else { to.to_owned() };
    let time = fs::metadata(from)?.modified()?;
    if fs::metadata(&to).and_then(|found| found.modified()).is_ok_and(|found| found == time) {
        return Ok(());
    }
    let mut bytes = fs::read(from)?;
    if is_packed {
        let packed = std::mem::take(&mut bytes);
        XzReader::new(&packed[..], false).read_to_end(&mut bytes)?;
    }
    let mut file = NamedTempFile::new_in(env!("CARGO_TARGET_TMPDIR"))?;
    file.write_all(&bytes)?;
    file.as_file().set_modified(time)?;
    file.persist(to)?;
    Ok(())
}
