//! Trials by the batch, on all threads; their rows in order.

use calibench::files::FileError;
use rayon::prelude::*;

use super::rows::Place;
use super::trial::trial;
use super::{RowsFile, Study};

/// Trials of all points that a thread takes in one batch. The rows of a batch wait for each other: of 32, threads idle a few per cent.
const BATCH: usize = 32;

/// Which trials.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Extent {
    /// The first, counted from 0.
    pub first: u64,
    /// How many at each point.
    pub trials: u64,
}

impl Extent {
    /// Beyond this there are no trials: what is reckoned from their numbers stays far from the end of the integers.
    pub const END: u64 = 1 << 62;
}

/// Carries out the trials of a study that are not in `file` yet and appends their rows, which `rows` is told too, batch by batch; `done`
/// is told of every trial of a point.
///
/// # Errors
/// When rows cannot be written. A trial that fails is a row like any other.
pub fn run(
    study: &Study,
    extent: Extent,
    mut file: Option<RowsFile>,
    mut rows: impl FnMut(&[u8]),
    done: &(dyn Fn() + Sync),
) -> Result<(), FileError> {
    let points = study.points.len() as u64;
    let found = file.as_ref().map_or(0, |f| f.found);
    let batch = (BATCH * rayon::current_num_threads()) as u64;
    let (mut next, end) = (found * points, extent.trials * points);
    while next < end {
        let until = (next + batch).min(end);
        let lines: Vec<Vec<u8>> = (next..until)
            .into_par_iter()
            .map(|k| {
                let lines = lines(study, extent.first + k / points, (k % points) as usize);
                done();
                lines
            })
            .collect();
        let lines = lines.concat();
        if let Some(file) = &mut file {
            file.append(&lines)?;
        }
        rows(&lines);
        next = until;
    }
    file.map_or(Ok(()), RowsFile::finish)
}

/// The rows of one trial at one point.
fn lines(study: &Study, number: u64, point: usize) -> Vec<u8> {
    let at = &study.points[point];
    let place =
        Place { study: &study.id, points: study.points.len(), point, at: &at.at, trial: number, seed: at.scenario.seed };
    trial(at, study.diagnosed, number).iter().flat_map(|row| study.columns.line(&place, row)).collect()
}
