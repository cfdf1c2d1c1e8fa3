//! Where files are: on the disk or, in a browser, which has none for a program, in memory.

use std::io;
use std::path::Path;

/// An open file.
#[cfg(not(target_family = "wasm"))]
pub type OpenFile = std::fs::File;

/// An open file.
#[cfg(target_family = "wasm")]
pub type OpenFile = io::Cursor<std::sync::Arc<[u8]>>;

/// True if there is a file with this name.
#[must_use]
pub fn is_file(path: &Path) -> bool {
    #[cfg(not(target_family = "wasm"))]
    return path.is_file();
    #[cfg(target_family = "wasm")]
    return super::memory::content(path).is_some();
}

/// True if there is a folder with this name.
#[must_use]
pub fn is_folder(path: &Path) -> bool {
    #[cfg(not(target_family = "wasm"))]
    return path.is_dir();
    #[cfg(target_family = "wasm")]
    return super::memory::is_folder(path);
}

/// True if there is anything with this name.
#[must_use]
pub fn is_there(path: &Path) -> bool {
    #[cfg(not(target_family = "wasm"))]
    return path.exists();
    #[cfg(target_family = "wasm")]
    return is_file(path) || is_folder(path);
}

/// Reads a file whole, whatever is in it.
///
/// # Errors
/// When it cannot be read.
pub fn read_bytes(path: &Path) -> io::Result<Vec<u8>> {
    #[cfg(not(target_family = "wasm"))]
    return std::fs::read(path);
    #[cfg(target_family = "wasm")]
    return super::memory::open(path).map(|file| file.into_inner().to_vec());
}
