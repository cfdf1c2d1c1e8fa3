//! Merging of a study's shards, byte-identical to one run.

use std::path::{Path, PathBuf};

use calibench::files::disk::write_streamed;
use calibench::files::{FileError, cannot_be_written};
use csv::StringRecord;

use super::{Extent, RowsReader, Summary};

/// Shards that make one study.
pub struct Merged {
    /// Their files, in the order of their trials.
    pub shards: Vec<PathBuf>,
    /// Their common summary.
    pub summary: Summary,
    /// The trials they hold.
    pub extent: Extent,
}

/// Reads the shards of one study, in any order, into a summary; their rows are written to `output`, if given, in order.
///
/// # Errors
/// If they are not of one study, one is incomplete, or trials are missing between them or duplicated.
pub fn merge(shards: &[PathBuf], output: Option<&Path>) -> Result<Merged, FileError> {
    let mut opened = shards.iter().map(|path| Shard::open(path)).collect::<Result<Vec<_>, _>>()?;
    opened.sort_by_key(|s| s.first);
    let (summary, extent) = match output {
        None => joined(&opened, &mut |_| Ok(()))?,
        Some(path) => write_streamed(path, |file| {
            let mut table = csv::Writer::from_writer(file);
            let merged = joined(&opened, &mut |row| table.write_record(row).map_err(|e| cannot_be_written(path, e)))?;
            table.flush().map_err(|e| cannot_be_written(path, e))?;
            Ok(merged)
        })?,
    };
    Ok(Merged { shards: opened.into_iter().map(|s| s.path).collect(), summary, extent })
}

/// Passes the header and then every row to `line`.
fn joined(
    shards: &[Shard],
    line: &mut dyn FnMut(&StringRecord) -> Result<(), FileError>,
) -> Result<(Summary, Extent), FileError> {
    let nothing = |path: &Path| FileError::whole(path, "is not a table of a study", "name the files that `sim study` wrote");
    let begin = shards.first().ok_or_else(|| nothing(Path::new("shards")))?;
    let mut summary = Summary::new(&begin.header).ok_or_else(|| nothing(&begin.path))?;
    line(&begin.header)?;
    let (mut next, mut before) = (begin.first, begin);
    for shard in shards {
        shard.follows(before, next)?;
        let mut reader = RowsReader::open(&shard.path)?;
        while let Some(row) = reader.next_row()? {
            summary.add(row);
            line(row)?;
        }
        let Extent { first, trials } = reader.extent();
        next = first + trials;
        let line = reader.cut_line();
        if line.is_some() || !reader.is_whole() {
            let remedy = "give the command that wrote it again: it goes on there";
            return Err(FileError { line, ..FileError::whole(&shard.path, format!("was cut in trial {next}"), remedy) });
        }
        before = shard;
    }
    Ok((summary, Extent { first: begin.first, trials: next - begin.first }))
}

/// Properties of a shard, from its first row.
struct Shard {
    path: PathBuf,
    header: StringRecord,
    study: String,
    first: u64,
}

impl Shard {
    fn open(path: &Path) -> Result<Self, FileError> {
        let mut reader = RowsReader::open(path)?;
        if reader.next_row()?.is_none() {
            return Err(FileError::whole(path, "has no rows", "give the command that wrote it again"));
        }
        let (header, study) = (reader.header().clone(), reader.study().to_owned());
        Ok(Shard { path: path.into(), header, study, first: reader.extent().first })
    }

    /// Checks that this shard continues where the one before it ended: with trial `next`.
    fn follows(&self, before: &Shard, next: u64) -> Result<(), FileError> {
        let Shard { path, header, study, first } = self;
        let other = before.path.display();
        let (problem, remedy) = if *header != before.header || *study != before.study {
            (format!("is of {study}, where {other} is of {}", before.study), "merge the shards of one study")
        } else if *first > next {
            let last = first - 1;
            (
                format!("begins with trial {first}; trials {next} to {last} are in no shard"),
                "name the missing shard too, or run it",
            )
        } else if *first < next {
            (format!("begins with trial {first}, which {other} has too"), "leave one of them out")
        } else {
            return Ok(());
        };
        Err(FileError::whole(path, problem, remedy))
    }
}
