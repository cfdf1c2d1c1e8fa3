//! A file that appears whole or not at all.

use std::io::Write;
use std::path::Path;

use super::target::{folder_of, target_of};
use crate::files::streams::{is_standard_output, write_to_standard_output};
use crate::files::{FileError, cannot_be_written};

/// Writes a file whole: to a temporary name in the same folder, synced, then renamed. A device or a pipe is written directly.
/// Symbolic links are followed; an existing file keeps its permissions, and a new one gets those of the process (umask).
/// So is [standard output](crate::files::streams::STANDARD_OUTPUT).
///
/// # Errors
/// When the folder cannot be written.
pub fn write_whole(path: &Path, content: &[u8]) -> Result<(), FileError> {
    let fail = |e: std::io::Error| cannot_be_written(path, e);
    // A device or a pipe is written to; a file put in its place would take it from everybody.
    if std::fs::metadata(path).is_ok_and(|there| !there.is_file() && !there.is_dir()) {
        return std::fs::OpenOptions::new()
            .write(true)
            .open(path)
            .and_then(|mut device| device.write_all(content))
            .map_err(fail);
    }
    write_streamed(path, |file| file.write_all(content).map_err(fail))
}

/// Writes a file whole that is too long to be held in memory: the output of `write` appears under its name when all of it is on
/// the disk. Otherwise as [`write_whole`].
///
/// # Errors
/// Those of `write`, or when the folder cannot be written.
pub fn write_streamed<T>(
    path: &Path,
    write: impl FnOnce(&mut (dyn Write + Send)) -> Result<T, FileError>,
) -> Result<T, FileError> {
    let fail = |e: std::io::Error| cannot_be_written(path, e);
    if is_standard_output(path) {
        let mut all = Vec::new();
        let written = write(&mut all)?;
        write_to_standard_output(&all).map_err(fail)?;
        return Ok(written);
    }
    let target = target_of(path).map_err(fail)?;
    let folder = folder_of(&target);
    std::fs::create_dir_all(folder).map_err(fail)?;
    let mut file = new_file(&target).tempfile_in(folder).map_err(fail)?;
    let written = write(&mut file)?;
    file.as_file().sync_all().map_err(fail)?;
    file.persist(&target).map_err(|e| fail(e.error))?;
    Ok(written)
}

/// Creates the temporary file that replaces `target`.
fn new_file(target: &Path) -> tempfile::Builder<'static, 'static> {
    #[cfg_attr(not(unix), allow(unused_mut))]
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let there = std::fs::metadata(target).map(|there| there.permissions().mode() & 0o777);
        // Read and write permission for everybody, less the umask.
        builder.permissions(std::fs::Permissions::from_mode(there.unwrap_or(0o666)));
    }
    #[cfg(not(unix))]
    let _ = target;
    builder
}

/// Ensures that entries created, renamed or removed in the folder of `path` are on the disk.
pub(crate) fn sync_folder_of(path: &Path) -> std::io::Result<()> {
    #[cfg(unix)]
    {
        std::fs::File::open(folder_of(path))?.sync_all()?;
    }
    Ok(())
}

#[cfg(all(test, unix))]
#[allow(clippy::unwrap_used)]
mod tests {
    use std::os::unix::fs::FileTypeExt;

    use super::*;

    /// `-o /dev/null`, by a user with the permission, once replaced the device by a file.
    #[test]
    fn a_pipe_is_written_to_and_stays_a_pipe() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let reader = std::thread::spawn({
            let pipe = pipe.clone();
            move || std::fs::read(pipe).unwrap()
        });
        write_whole(&pipe, b"whole").unwrap();
        assert_eq!(reader.join().unwrap(), b"whole");
        assert!(std::fs::metadata(&pipe).unwrap().file_type().is_fifo());
    }
}
