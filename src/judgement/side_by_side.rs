//! Calibrations of one robot, side by side: judged on the same rows, pose by pose, and where they place the tool differently.

use nalgebra::Vector3;
use thiserror::Error;

use crate::identify::calibration::{Calibration, IdentifyError};
use crate::identify::problem::Use;
use crate::identify::{Model, identify};
use crate::measure::dataset::{Dataset, Measured, NamedDataset, Sample, SampleSet};
use crate::prediction::{PoseSource, WorkspaceMap, WorkspacePoses};
use crate::residuals::Validation;
use crate::selection::FittedModel;

/// Number of blocks of consecutive poses, whose means are compared where neighbours err alike.
const BLOCKS: usize = 20;

/// The mean of paired differences, a second calibration minus a first, pose by pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairedDifference {
    /// Number of poses.
    pub poses: usize,
    /// Number of poses at which the second has the smaller error.
    pub better_at: usize,
    /// Mean difference of the errors, m; negative if the second errs less.
    pub mean: f64,
    /// Two standard errors of that mean, m; infinite for a single pose.
    pub two_errors: f64,
}

impl PairedDifference {
    /// Compares errors (m) at the same poses. Neighbouring poses may err alike; then the means of blocks of them scatter more than
    /// independent poses would, and the larger of the two standard errors is taken. Where both err alike, a preference is wrong once
    /// in twenty.
    ///
    /// ```
    /// use calibench::judgement::side_by_side::PairedDifference;
    ///
    /// let pair = PairedDifference::of(&[3.0, 4.0, 5.0], &[1.0, 1.9, 3.1]);
    /// assert!((pair.mean + 2.0).abs() < 1e-12 && pair.better_at == 3);
    /// assert_eq!(pair.better(), Some(1));
    /// ```
    #[must_use]
    pub fn of(first: &[f64], second: &[f64]) -> Self {
        let differences: Vec<f64> = first.iter().zip(second).map(|(a, b)| b - a).collect();
        let standard_error = |x: &[f64]| {
            let n = x.len() as f64;
            let mean = x.iter().sum::<f64>() / n;
            (x.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / (n - 1.0) / n).sqrt()
        };
        let poses = differences.len();
        let plain = if poses > 1 { standard_error(&differences) } else { f64::INFINITY };
        let blocks: Vec<f64> = if poses >= 2 * BLOCKS {
            let edge = |k: usize| k * poses / BLOCKS;
            let block = |k: usize| &differences[edge(k)..edge(k + 1)];
            (0..BLOCKS).map(|k| block(k).iter().sum::<f64>() / block(k).len() as f64).collect()
        } else {
            Vec::new()
        };
        let of_blocks = if blocks.is_empty() { 0.0 } else { standard_error(&blocks) };
        PairedDifference {
            poses,
            better_at: differences.iter().filter(|d| **d < 0.0).count(),
            mean: differences.iter().sum::<f64>() / poses.max(1) as f64,
            two_errors: 2.0 * plain.max(of_blocks),
        }
    }

    /// 0 if the first is better beyond the error of the difference, 1 if the second is; `None` if these poses do not tell.
    #[must_use]
    pub fn better(&self) -> Option<usize> {
        (self.mean.abs() > self.two_errors).then(|| usize::from(self.mean < 0.0))
    }
}

/// What is compared.
#[derive(Debug, Clone)]
pub enum Compared {
    /// A calibration.
    Calibration(Box<Calibration>),
    /// A model, fitted to the data first.
    Model(Box<Model>),
}

/// The rows on which calibrations are judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JudgedOn {
    /// Rows of set `validation`, which no fit has seen.
    HeldOut,
    /// Rows of data to which none of the calibrations was fitted.
    OtherData,
    /// Rows that are fitted, each predicted by a fit without its neighbourhood.
    LeftOut,
}

/// The distance between the tool positions that two calibrations predict for the same joint angles.
#[derive(Debug, Clone, PartialEq)]
pub struct Apart {
    /// Poses of the robot.
    pub at: PoseSource,
    /// Mean distance, m.
    pub mean: f64,
    /// Largest distance, m.
    pub max: f64,
    /// The distance over the workspace.
    pub map: WorkspaceMap,
}

/// One of the calibrations.
#[derive(Debug, Clone)]
pub struct Judged {
    /// Its name.
    pub name: String,
    /// The calibration, or that of the model.
    pub calibration: Calibration,
    /// Its errors.
    pub errors: Validation,
    /// Its errors against those of the first; `None` for the first itself.
    pub difference: Option<PairedDifference>,
    /// Distances from the tool positions of the first, inside the ranges in which the first was measured and over the limits of the
    /// joints; empty for the first itself, and where base or tool are not known of both.
    pub apart: Vec<Apart>,
}

/// Calibrations of one robot, judged on the same rows.
#[derive(Debug, Clone)]
pub struct SideBySide {
    /// The rows.
    pub judged_on: JudgedOn,
    /// The calibrations, in the order in which they were given.
    pub all: Vec<Judged>,
}

/// The reason why calibrations cannot be compared.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum NotComparable {
    /// One was fitted to the rows and another was not.
    #[error(
        "{fitted} was fitted to these rows and {other} was not: what remains of fitted rows is smaller than an error. Hold rows out, or compare on other data"
    )]
    Mixed {
        /// One that was fitted.
        fitted: String,
        /// One that was not.
        other: String,
    },
    /// There are no rows.
    #[error("there are no rows to judge")]
    Empty,
    /// One of them cannot be fitted or applied.
    #[error("{name}: {error}")]
    Failed {
        /// Its name.
        name: String,
        /// What is wrong.
        #[source]
        error: IdentifyError,
    },
}

impl SideBySide {
    /// Judges calibrations and models on rows of set `validation`; without any, on all rows, or, if they were fitted to these very
    /// data, each row left out of a fit in turn, neighbours together.
    ///
    /// # Errors
    /// If one is of another robot or cannot be fitted, and if some were fitted to the rows and others were not.
    pub fn of(datasets: &[NamedDataset<'_>], compared: &[(String, Compared)]) -> Result<Self, NotComparable> {
        let judged_on = judged_on(datasets, compared)?;
        let judged = |(name, one): &(String, Compared)| {
            judged(datasets, one, judged_on).map_err(|error| NotComparable::Failed { name: name.clone(), error })
        };
        let (calibrations, errors): (Vec<Calibration>, Vec<Errors>) =
            compared.iter().map(judged).collect::<Result<Vec<_>, _>>()?.into_iter().unzip();
        let models: Vec<&Model> = calibrations.iter().map(|c| &c.model).collect();
        let length = |errors: Errors| match errors {
            Errors::OfRows(lengths) => lengths,
            Errors::LeftOut(squares) => left_out_errors(&models, &squares),
        };
        let lengths: Vec<Vec<f64>> = errors.into_iter().map(length).collect();
        let [first, ..] = calibrations.as_slice() else { return Err(NotComparable::Empty) };
        let all = calibrations.iter().enumerate().map(|(k, calibration)| {
            Ok(Judged {
                name: compared[k].0.clone(),
                calibration: calibration.clone(),
                errors: Validation::of_lengths(&lengths[k]).ok_or(NotComparable::Empty)?,
                difference: (k > 0).then(|| PairedDifference::of(&lengths[0], &lengths[k])),
                apart: if k > 0 { apart(datasets, first, calibration) } else { Vec::new() },
            })
        });
        Ok(SideBySide { judged_on, all: all.collect::<Result<_, NotComparable>>()? })
    }
}

/// Errors of a calibration at the rows that judge it.
enum Errors {
    /// Lengths, m.
    OfRows(Vec<f64>),
    /// Name of each fitted sample, and its squared error where it was left out, m².
    LeftOut(Vec<(String, f64)>),
}

/// Errors, m, of fitted samples that were left out in turn, from their names and squares (m²). A sample that one of the models
/// excludes judges none of them.
pub fn left_out_errors(models: &[&Model], squares: &[(String, f64)]) -> Vec<f64> {
    let judges = |sample: &str| !models.iter().any(|model| model.excludes(sample));
    squares.iter().filter(|(sample, _)| judges(sample)).map(|(_, squared)| squared.sqrt()).collect()
}

/// The rows that judge all of them.
fn judged_on(datasets: &[NamedDataset<'_>], compared: &[(String, Compared)]) -> Result<JudgedOn, NotComparable> {
    if datasets.iter().any(|d| d.dataset.samples.iter().any(|s| s.set == SampleSet::Validation)) {
        return Ok(JudgedOn::HeldOut);
    }
    let is_fitted = |one: &Compared| match one {
        Compared::Model(_) => true,
        Compared::Calibration(c) => {
            datasets.iter().any(|d| c.dataset_hashes.contains(&d.dataset.hash))
                || c.fitted_rows.share(datasets, Use::All).is_some_and(|share| share > 0.5)
        }
    };
    let find = |fitted: bool| compared.iter().find(|(_, one)| is_fitted(one) == fitted).map(|(name, _)| name.clone());
    match (find(true), find(false)) {
        (Some(fitted), Some(other)) => Err(NotComparable::Mixed { fitted, other }),
        (Some(_), None) => Ok(JudgedOn::LeftOut),
        _ => Ok(JudgedOn::OtherData),
    }
}

/// The calibration, and its error at every row.
fn judged(datasets: &[NamedDataset<'_>], one: &Compared, judged_on: JudgedOn) -> Result<(Calibration, Errors), IdentifyError> {
    let which = match judged_on {
        JudgedOn::HeldOut => Use::Validation,
        JudgedOn::OtherData => Use::All,
        JudgedOn::LeftOut => {
            let model = match one {
                Compared::Calibration(calibration) => &calibration.model,
                Compared::Model(model) => model,
            };
            let scores = FittedModel::new(datasets, model)?.scores;
            return Ok((scores.calibration.clone(), Errors::LeftOut(scores.blocks.clone())));
        }
    };
    let calibration = match one {
        Compared::Calibration(calibration) => Calibration::clone(calibration),
        Compared::Model(model) => identify(datasets, model)?,
    };
    let lengths = calibration.predict(datasets, which)?.residuals.iter().map(Vector3::norm).collect();
    Ok((calibration, Errors::OfRows(lengths)))
}

/// How far apart two calibrations place the tool, inside the ranges of the first and over the limits of the joints.
fn apart(datasets: &[NamedDataset<'_>], first: &Calibration, second: &Calibration) -> Vec<Apart> {
    let at = [WorkspacePoses::inside(datasets, &first.joint_ranges), WorkspacePoses::over_limits(datasets)];
    at.iter().filter_map(|poses| distances(datasets.first()?, poses, [first, second])).collect()
}

/// The distances at these poses; `None` without poses, and if base or tool of the data are not known of both.
fn distances(first: &NamedDataset<'_>, poses: &WorkspacePoses, [a, b]: [&Calibration; 2]) -> Option<Apart> {
    let there = at_poses(first.dataset, poses)?;
    let there = [NamedDataset::new(first.name, &there)];
    let residuals = |calibration: &Calibration| -> Option<Vec<Vector3<f64>>> {
        let prediction = calibration.predict(&there, Use::All).ok()?;
        (prediction.refitted.is_empty()).then_some(prediction.residuals)
    };
    let lengths: Vec<f64> = residuals(a)?.iter().zip(&residuals(b)?).map(|(a, b)| (a - b).norm()).collect();
    let mean = lengths.iter().sum::<f64>() / lengths.len() as f64;
    let max = lengths.iter().copied().fold(0.0, f64::max);
    Some(Apart { at: poses.source, mean, max, map: WorkspaceMap::over(there[0].dataset, &poses.q, |p| lengths[p]) })
}

/// Point measurements at these poses, under the conditions of the first row; where they were measured does not matter.
fn at_poses(dataset: &Dataset, poses: &WorkspacePoses) -> Option<Dataset> {
    let like = dataset.samples.first().filter(|_| !poses.q.is_empty())?;
    let sample = |(k, q): (usize, &Vec<f64>)| Sample {
        payload: like.payload,
        time_s: like.time_s,
        temp_c: like.temp_c,
        approach: like.approach.clone(),
        session: like.session.clone(),
        q_commanded: Some(q.clone()),
        ..Sample::new(format!("w{k}"), q.clone(), Measured::Point(Vector3::zeros()))
    };
    let samples = poses.q.iter().enumerate().map(sample).collect();
    Some(Dataset { samples, ball_distances: Vec::new(), ..dataset.clone() })
}

#[cfg(test)]
mod tests {
    use super::PairedDifference;

    fn alternating(n: usize, mean: f64, swing: f64, run: usize) -> PairedDifference {
        let second: Vec<f64> = (0..n).map(|k| mean + if (k / run).is_multiple_of(2) { swing } else { -swing }).collect();
        PairedDifference::of(&vec![0.0; n], &second)
    }

    #[test]
    fn the_better_one_is_named_only_beyond_two_standard_errors() {
        // 100 poses, scatter 1: the standard error is 0.1.
        assert_eq!(alternating(100, -0.3, 1.0, 1).better(), Some(1));
        assert_eq!(alternating(100, 0.3, 1.0, 1).better(), Some(0));
        assert_eq!(alternating(100, -0.15, 1.0, 1).better(), None);
    }

    #[test]
    fn neighbours_that_err_alike_do_not_count_as_many() {
        let (plain, alike) = (alternating(400, -0.15, 1.0, 1), alternating(400, -0.15, 1.0, 20));
        assert_eq!(plain.better(), Some(1));
        assert!(alike.two_errors > 4.0 * plain.two_errors && alike.better().is_none());
    }

    #[test]
    fn a_single_pose_prefers_nobody() {
        assert_eq!(PairedDifference::of(&[1.0], &[0.0]).better(), None);
    }
}
