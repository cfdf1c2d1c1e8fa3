//! The target of a path to be written, and its folder.

use std::fs;
use std::io::{self, ErrorKind};
use std::path::{Component, Path, PathBuf};

/// Links followed before a cycle is assumed: the limit of Linux.
const MOST_LINKS: usize = 40;

/// Resolves symbolic links in `path`, even if their target does not exist yet.
pub(super) fn target_of(path: &Path) -> io::Result<PathBuf> {
    let mut target = path.to_owned();
    for _ in 0..MOST_LINKS {
        match fs::read_link(&target) {
            Ok(next) => target = folder_of(&target).join(next),
            // Not a link, or nothing there.
            Err(_) => return Ok(target),
        }
    }
    Err(io::Error::new(ErrorKind::InvalidInput, "its symbolic links lead in a circle"))
}

/// The folder in which `path` is an entry.
pub(super) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// The file to which a path leads, through whatever folders and links, be it there already or not: paths with the same result
/// are names of one file.
#[must_use]
pub fn full_path(path: &Path) -> PathBuf {
    let path = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let target = target_of(&path).unwrap_or(path);
    let there = target.ancestors().find(|above| above.exists()).unwrap_or(&target);
    let mut full = fs::canonicalize(there).unwrap_or_else(|_| there.to_owned());
    for part in target.strip_prefix(there).unwrap_or(Path::new("")).components() {
        match part {
            Component::ParentDir => {
                full.pop();
            }
            part => full.push(part),
        }
    }
    full
}

#[cfg(all(test, unix))]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    #[test]
    fn a_file_has_one_full_path_whatever_it_is_called() {
        let folder = tempfile::tempdir().unwrap();
        let full = |name: &str| full_path(&folder.path().join(name));
        fs::create_dir(folder.path().join("house")).unwrap();
        fs::write(folder.path().join("house/old"), "").unwrap();
        for (to, link) in [("house", "home"), ("home/old", "first"), ("first", "second"), ("home/new", "later")] {
            symlink(to, folder.path().join(link)).unwrap();
        }
        for name in ["house/./old", "house/../home/old", "first", "second"] {
            assert_eq!(full(name), full("house/old"), "{name}");
        }
        // So has one that is not there yet, in a folder that may not be either.
        for name in ["home/new", "later", "nowhere/../house/new"] {
            assert_eq!(full(name), full("house/new"), "{name}");
        }
        assert_eq!(full("home/new/below"), full("house/new").join("below"));
        assert_ne!(full("house/new"), full("house/old"));
    }

    #[test]
    fn links_in_a_circle_have_an_end() {
        let folder = tempfile::tempdir().unwrap();
        for (to, link) in [("round", "round"), ("deeper/x", "deeper")] {
            symlink(to, folder.path().join(link)).unwrap();
            assert!(full_path(&folder.path().join(link)).is_absolute(), "{link}");
        }
    }
}
