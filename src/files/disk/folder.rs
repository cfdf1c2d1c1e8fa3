//! A folder that appears whole or not at all.

use std::fs;
use std::io;
use std::path::Path;

use super::target::target_of;
use crate::files::{FileError, cannot_be_written};

/// Fills a new folder beside `folder` and puts it in its place, keeping its other entries besides `names`.
///
/// If the process is killed before that, a hidden folder `.NAME.XXXXXX` remains beside it, which may be deleted; if it is
/// killed
/// between the two renames, that folder contains the replaced one as `old`.
///
/// `what` is the kind of folder in words, for messages; a non-empty folder is replaced only if it contains the first of
/// `names`.
///
/// # Errors
/// Those of `fill`, with the final names of the files; if `folder` has other content; those of the disk.
pub fn replace_folder(
    folder: &Path,
    what: &str,
    names: &[&str],
    fill: impl FnOnce(&Path) -> Result<(), FileError>,
) -> Result<(), FileError> {
    let fail = |e: io::Error| FileError {
        remedy: "check the folder above, its permissions and free space".into(),
        ..cannot_be_written(folder, e)
    };
    // Links are followed to the folder itself, which is what is replaced.
    let target = if folder.exists() { fs::canonicalize(folder) } else { target_of(folder) }.map_err(fail)?;
    refuse_other_content(folder, &target, what, names)?;
    let (Some(name), Some(parent)) = (target.file_name(), target.parent()) else {
        return Err(FileError::whole(folder, "cannot be made", format!("name a new folder, or one that holds a {what}")));
    };
    let parent = if parent.as_os_str().is_empty() { Path::new(".") } else { parent };
    fs::create_dir_all(parent).map_err(fail)?;
    let prefix = format!(".{}.", name.to_string_lossy());
    // A sibling, so that a robot path relative to the folder also resolves from it.
    let beside = |mode: u32| new_folder(&prefix, mode).tempdir_in(parent).map_err(fail);
    let there = mode_of(&target);
    // Full permissions less the umask; those of the replaced folder, if there is one.
    let new = beside(there.unwrap_or(0o777))?;
    if target.exists() {
        carry_over(&target, new.path(), names).map_err(fail)?;
    }
    fill(new.path()).map_err(|e| match e.path.strip_prefix(new.path()) {
        Ok(inside) => FileError { path: folder.join(inside), ..e },
        Err(_) => e,
    })?;
    #[cfg(unix)]
    {
        fs::File::open(new.path()).and_then(|f| f.sync_all()).map_err(fail)?;
    }
    let attic = beside(0o700)?;
    let old = attic.path().join("old");
    let replaces = target.exists();
    if replaces {
        fs::rename(&target, &old).map_err(fail)?;
    }
    if let Err(e) = fs::rename(new.path(), &target) {
        if replaces {
            fs::rename(&old, &target).map_err(fail)?;
        }
        return Err(fail(e));
    }
    #[cfg(unix)]
    fs::File::open(parent).and_then(|f| f.sync_all()).map_err(fail)?;
    Ok(())
}

/// Checks that `target`, to which `folder` resolves, is not a file, and not a non-empty folder without the first of `names`.
pub(super) fn refuse_other_content(folder: &Path, target: &Path, what: &str, names: &[&str]) -> Result<(), FileError> {
    if !target.exists() {
        return Ok(());
    }
    if !target.is_dir() {
        return Err(FileError::whole(folder, "is a file", "name a folder"));
    }
    let is_empty = fs::read_dir(target).map_err(|e| cannot_be_written(folder, e))?.next().is_none();
    if is_empty || names.iter().take(1).all(|mark| target.join(mark).is_file()) {
        return Ok(());
    }
    let problem = format!("holds something that is not a {what}");
    Err(FileError::whole(folder, problem, format!("name a new folder, or one that holds a {what}")))
}

#[cfg(unix)]
fn mode_of(folder: &Path) -> Option<u32> {
    use std::os::unix::fs::PermissionsExt;
    fs::metadata(folder).ok().map(|there| there.permissions().mode() & 0o777)
}

#[cfg(not(unix))]
fn mode_of(_: &Path) -> Option<u32> {
    None
}

/// A hidden folder whose name has this prefix; with these permissions less the umask, where supported.
fn new_folder(prefix: &str, mode: u32) -> tempfile::Builder<'_, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(prefix);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(mode));
    }
    #[cfg(not(unix))]
    let _ = mode;
    builder
}

/// Hard-links (or else copies) all entries of a folder into another, except those in `except`.
fn carry_over(from: &Path, to: &Path, except: &[&str]) -> io::Result<()> {
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let (source, copy) = (entry.path(), to.join(entry.file_name()));
        if except.iter().any(|name| entry.file_name() == *name) {
            continue;
        }
        if entry.file_type()?.is_dir() {
            fs::create_dir(&copy)?;
            carry_over(&source, &copy, &[])?;
        } else if fs::hard_link(&source, &copy).is_err() {
            fs::copy(&source, &copy)?;
        }
    }
    Ok(())
}
