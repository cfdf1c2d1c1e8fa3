//! A folder that appears whole or not at all.

use std::fs;
use std::io;
use std::path::Path;

use super::output::target_of;
use super::{FileError, cannot_be_written};

/// Fills a new folder beside `folder` and puts it in its place, keeping whatever lies there besides `names`.
///
/// A process that is killed meanwhile leaves a hidden folder `.NAME.XXXXXX` beside it, that may be deleted; one killed between the two
/// renames leaves there, as `old`, what was to be replaced.
///
/// `what` is the kind of folder in words, for messages; a folder that holds something is replaced only when it holds the first of
/// `names`.
///
/// # Errors
/// Those of `fill`, with the name the files were to have; that `folder` holds something else; those of the disk.
pub fn replace_folder(
    folder: &Path,
    what: &str,
    names: &[&str],
    fill: impl FnOnce(&Path) -> Result<(), FileError>,
) -> Result<(), FileError> {
    let fail = |e: io::Error| FileError {
        remedy: "check the folder above, its permissions and free space".into(),
        ..cannot_be_written(folder, &e)
    };
    // Through links to the folder itself, which is what is to be replaced.
    let target = if folder.exists() { fs::canonicalize(folder) } else { target_of(folder) }.map_err(fail)?;
    refuse_other_content(folder, &target, what, names)?;
    let (Some(name), Some(parent)) = (target.file_name(), target.parent()) else {
        return Err(FileError::whole(folder, "cannot be made", format!("name a new folder, or one that holds a {what}")));
    };
    let parent = if parent.as_os_str().is_empty() { Path::new(".") } else { parent };
    fs::create_dir_all(parent).map_err(fail)?;
    let prefix = format!(".{}.", name.to_string_lossy());
    // A sibling, so that a robot named relative to the folder is found from it too.
    let beside = |mode: u32| new_folder(&prefix, mode).tempdir_in(parent).map_err(fail);
    let there = mode_of(&target);
    // Everything for everybody, less what the umask takes; as before, where it is replaced.
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

/// That `target`, to which `folder` leads, is no file, and no folder that holds something but not the first of `names`.
pub(super) fn refuse_other_content(folder: &Path, target: &Path, what: &str, names: &[&str]) -> Result<(), FileError> {
    if !target.exists() {
        return Ok(());
    }
    if !target.is_dir() {
        return Err(FileError::whole(folder, "is a file", "name a folder"));
    }
    let is_empty = fs::read_dir(target).map_err(|e| cannot_be_written(folder, &e))?.next().is_none();
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

/// A hidden folder of a name that begins so; with these permissions less the umask's, where there are such.
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

/// Links (or where that cannot be, copies) everything in a folder into another, but the names of `except`.
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
