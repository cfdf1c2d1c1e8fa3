//! Position errors before and after a calibration, at the same poses.

use std::sync::Arc;

use nalgebra::Vector3;
use thiserror::Error;

use crate::identify::Prediction;
use crate::identify::calibration::{Calibration, IdentifyError};
use crate::identify::problem::Use;
use crate::math::CHI2_MEDIAN;
use crate::measure::dataset::{Measured, NamedDataset, Sample, SampleSet};
use crate::residuals::Validation;
use crate::units::MM;

/// A state of the robot, in the order in which it passes through them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stage {
    /// What the controller reaches: measured against commanded positions or, without any, against the nominal arm on its base and
    /// with its tool as stated.
    AsDelivered,
    /// The nominal arm, with base and whatever else is unknown of the set-up fitted.
    Nominal,
    /// Calibrated with the first model.
    Calibrated,
    /// Calibrated with the recommended model, if that is another one.
    Recommended,
}

/// The reason why a row has no errors.
#[derive(Debug, Clone, Error)]
#[non_exhaustive]
pub enum NoErrors {
    /// The data do not state the base or the tool: both are known from their rows alone.
    #[error("base or tool not stated")]
    NotStated,
    /// The commanded positions are in another frame than the measured ones.
    #[error("commanded in another frame")]
    OtherFrame,
    /// The recommended model is the first.
    #[error("nothing is recommended beyond the calibration")]
    SameModel,
    /// The rows cannot be predicted.
    #[error("{0}")]
    Unpredictable(Arc<IdentifyError>),
    /// There are no rows.
    #[error("there are no rows to judge")]
    Empty,
}

/// The errors in one state.
#[derive(Debug, Clone)]
pub struct ErrorRow {
    /// The state.
    pub stage: Stage,
    /// The errors, or the reason why there are none.
    pub errors: Result<Validation, NoErrors>,
}

/// A row that was held out and lies far off: no fit has seen it, and no diagnosis names it.
#[derive(Debug, Clone, PartialEq)]
pub struct FarOff {
    /// Name of the sample.
    pub sample: String,
    /// Its error in the last state, m.
    pub error: f64,
}

/// The errors in all states, at the same poses.
#[derive(Debug, Clone)]
pub struct ErrorTable {
    /// True if the poses were held out of the fit.
    pub held_out: bool,
    /// True if the errors as delivered are those of measured against commanded positions.
    pub by_commands: bool,
    /// Number of samples fitted.
    pub fitted: usize,
    /// Number of components of a measurement: one of distances, otherwise three.
    pub components: usize,
    /// Rows held out that are far off in the last state, the farthest first.
    pub far_off: Vec<FarOff>,
    /// One row a state, in their order.
    pub rows: [ErrorRow; 4],
}

impl ErrorTable {
    /// The errors of a robot on the rows of set `validation` of these data; if there are none, on all rows, which count as held out
    /// unless the calibration was fitted to their dataset. Its base and tool are found from rows of set `fit` first, if its
    /// calibration does not know them.
    ///
    /// ```
    /// use calibench::identify::{Model, identify};
    /// use calibench::judgement::{ErrorTable, Stage};
    /// use calibench::measure::dataset::{Dataset, NamedDataset};
    /// # use calibench::measure::dataset::{Measured, Noise, Sample};
    /// # use calibench::robot::kinematics::world_from_tool;
    /// # use calibench::robot::{FramePose, built_in};
    /// use calibench::units::MM;
    /// # let robot = std::sync::Arc::new(built_in("ur5").ok_or("built in")?);
    /// # let moved = FramePose { xyz: [1.0 * MM, 0.0, 0.0], ..FramePose::default() };
    /// # let sample = |k: usize| {
    /// #     let q: Vec<f64> = (1..=6).map(|i| 2.0 * ((k * i) as f64 * 0.618).fract() - 1.0).collect();
    /// #     let seen = world_from_tool(&robot, &moved, &FramePose::default(), &q).translation.vector;
    /// #     Sample::new(format!("p{k}"), q, Measured::Point(seen))
    /// # };
    /// # let samples = (0..20).map(sample).collect();
    /// # let noise = Noise { point: Some(0.02 * MM), ..Noise::default() };
    /// # let data = Dataset { robot: robot.clone(), noise, samples, ..Dataset::default() };
    ///
    /// // A UR5 whose base is 1 mm from where it is stated to be: as delivered it misses by that, its arm is as it should be.
    /// let data = [NamedDataset::new("campaign", &data)];
    /// let calibration = identify(&data, &Model::of(&["base_frame"]))?;
    /// let table = ErrorTable::of(&data, &calibration, None);
    /// let mean = |stage| table.errors(stage).map(|errors| errors.mean);
    /// assert!((mean(Stage::AsDelivered).ok_or("stated")? - 1.0 * MM).abs() < 1e-9);
    /// assert!(mean(Stage::Nominal).ok_or("fitted")? < 1e-9 && mean(Stage::Recommended).is_none());
    /// assert!(!table.held_out);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn of(judged: &[NamedDataset<'_>], calibrated: &Calibration, recommended: Option<&Calibration>) -> Self {
        let has_validation = judged.iter().any(|d| d.dataset.samples.iter().any(|s| s.set == SampleSet::Validation));
        let which = if has_validation { Use::Validation } else { Use::All };
        let is_fitted = |d: &NamedDataset<'_>| calibrated.dataset_hashes.contains(&d.dataset.hash);
        let predicted =
            |calibration: &Calibration| calibration.predict(judged, which).map_err(|e| NoErrors::Unpredictable(Arc::new(e)));
        let errors_of = |prediction: &Result<Prediction, NoErrors>| {
            Validation::of(prediction.as_ref().map_err(Clone::clone)?).ok_or(NoErrors::Empty)
        };
        let errors = |calibration: &Calibration| errors_of(&predicted(calibration));
        let first = predicted(calibrated);
        let other = recommended.map(predicted);
        let commanded = commanded_errors(judged, which);
        let is_distance = |s: &Sample| matches!(s.measured, Measured::Distance { .. });
        let is_stated = judged.iter().all(|d| !d.dataset.base_found && !d.dataset.tool_free);
        let as_delivered = if is_stated { errors(&calibrated.nominal()) } else { Err(NoErrors::NotStated) };
        let is_found = |v: &Validation| !(v.refitted.is_empty() && v.from_fit_rows.is_empty());
        let as_delivered = as_delivered.and_then(|v| if is_found(&v) { Err(NoErrors::NotStated) } else { Ok(v) });
        let by_commands = commanded.is_some();
        let as_delivered = commanded.unwrap_or(as_delivered);
        let row = |stage, errors| ErrorRow { stage, errors };
        let held_out = has_validation || !judged.iter().any(is_fitted);
        let components = if judged.iter().all(|d| d.dataset.samples.iter().all(is_distance)) { 1 } else { 3 };
        let last = other.as_ref().unwrap_or(&first).as_ref().ok().filter(|_| held_out);
        ErrorTable {
            held_out,
            by_commands,
            fitted: calibrated.samples,
            components,
            far_off: last.map_or_else(Vec::new, |last| far_off(last, FAR_OFF[components - 1])),
            rows: [
                row(Stage::AsDelivered, as_delivered),
                row(Stage::Nominal, errors(&calibrated.nominal().set_up_anew())),
                row(Stage::Calibrated, errors_of(&first)),
                row(Stage::Recommended, other.as_ref().map_or(Err(NoErrors::SameModel), errors_of)),
            ],
        }
    }

    /// One-sigma of each component of the measurements, m, that would leave the errors of the last state, by their median: single rows
    /// may be bad.
    #[must_use]
    pub fn noise(&self) -> Option<f64> {
        self.last().map(|errors| errors.quantiles[2] / CHI2_MEDIAN[self.components - 1].sqrt())
    }

    /// True if the calibration does harm: at held-out poses the last state errs more than the nominal arm, and by more than the few
    /// per cent that needless parameters cost.
    #[must_use]
    pub fn does_harm(&self) -> bool {
        let [nominal, last] = [self.errors(Stage::Nominal), self.last()];
        self.held_out && nominal.zip(last).is_some_and(|(nominal, last)| last.mean > HARM * nominal.mean)
    }

    /// True if the calibration gains nothing: at held-out poses the last state errs as much as the nominal arm, or more.
    #[must_use]
    pub fn gains_nothing(&self) -> bool {
        let [nominal, last] = [self.errors(Stage::Nominal), self.last()];
        self.held_out && nominal.zip(last).is_some_and(|(nominal, last)| last.mean >= nominal.mean)
    }

    /// The errors in a state; `None` if there are none.
    pub fn errors(&self, stage: Stage) -> Option<&Validation> {
        self.rows.iter().find(|row| row.stage == stage).and_then(|row| row.errors.as_ref().ok())
    }

    /// The errors in the last state that has any: those to go on with.
    pub fn last(&self) -> Option<&Validation> {
        self.rows.iter().rev().find_map(|row| row.errors.as_ref().ok())
    }
}

/// Mean error, in parts of that of the nominal arm, beyond which a calibration does harm.
const HARM: f64 = 1.1;

/// A row held out is far off beyond this many times the median error, of one, two and three components. Of a thousand normal errors
/// the largest is 4.9, 3.2 and 2.6 times, and what a model lacks is not normal.
const FAR_OFF: [f64; 3] = [8.0, 6.0, 5.0];

/// Mean distance of measured from commanded positions, m, from which they are in different frames: the worst arm that was seen errs
/// by some ten millimetres.
const OTHER_FRAME: f64 = 50.0 * MM;

/// The rows whose errors exceed this many times the median, the farthest first.
fn far_off(prediction: &Prediction, times: f64) -> Vec<FarOff> {
    let Some(limit) = Validation::of(prediction).map(|v| times * v.quantiles[2]) else { return Vec::new() };
    let errors = prediction.residuals.iter().map(Vector3::norm).zip(&prediction.sample_ids);
    let mut far: Vec<_> = errors.filter(|(error, _)| *error > limit).collect();
    far.sort_by(|a, b| b.0.total_cmp(&a.0));
    far.into_iter().map(|(error, sample)| FarOff { sample: sample.clone(), error }).collect()
}

/// The errors of measured against commanded positions; `None` unless every row has both.
fn commanded_errors(judged: &[NamedDataset<'_>], which: Use) -> Option<Result<Validation, NoErrors>> {
    let rows: Vec<&Sample> = judged.iter().flat_map(|d| d.dataset.samples.iter().filter(|s| which.takes(s))).collect();
    let miss = |s: &&Sample| match s.measured {
        Measured::Point(point) => s.commanded.map(|commanded| point - commanded),
        _ => None,
    };
    let residuals: Vec<_> = rows.iter().map(miss).collect::<Option<_>>()?;
    let prediction = Prediction {
        sample_ids: Vec::new(),
        orientations: Vec::new(),
        refitted: Vec::new(),
        from_fit_rows: Vec::new(),
        residuals,
    };
    let errors = Validation::of(&prediction)?;
    Some(if errors.mean < OTHER_FRAME { Ok(errors) } else { Err(NoErrors::OtherFrame) })
}
