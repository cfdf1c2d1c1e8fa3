//! Batches of trials on all threads, with their rows in order.

use calibench::files::FileError;
use calibench_sim::random::Streams;
use rayon::prelude::*;

use super::extent::Extent;
use super::rows::Place;
use super::trial::trial;
use super::{RowsFile, Study};

/// Number of trials, over all points, per thread in one batch. The rows of a batch wait for each other: at 32, threads idle a
/// few per cent.
const BATCH: usize = 32;

/// Runs the trials of a study not yet in `file` and appends their rows, which are also passed to `rows`, batch by batch; `done`
/// is called for every trial of a point.
///
/// # Errors
/// If rows cannot be written. A trial that fails gives a row like any other.
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
    let weight = at.scenario.truth().weight(&Streams { seed: at.scenario.seed, trial: number });
    let place = Place {
        study: &study.id,
        points: study.points.len(),
        point,
        at: &at.at,
        trial: number,
        seed: at.scenario.seed,
        weight,
    };
    trial(at, study.methods, study.diagnosed, number).iter().flat_map(|row| study.columns.line(&place, row)).collect()
}
