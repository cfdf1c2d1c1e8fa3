//! A cheap check of a calibrated robot: a few poses are measured again, and what has changed since is named.
//!
//! Each new measurement is compared with that of the same pose when the robot was calibrated, so that whatever the model
//! lacks cancels, and noise and the change remain. With whitened differences `d` of covariance `I` if nothing has changed,
//! every condition that may have arisen displaces them along the columns of a matrix `A` that depends on the poses alone.
//!
//! The test is sequential. For a condition with a Gaussian prior of covariance `s² A Aᵀ` the likelihood ratio to "nothing has
//! changed" after n samples, and so the average of such ratios over conditions and sizes, is a non-negative martingale of mean
//! one while nothing has changed. It ever exceeds `1 / alpha` with a probability of at most `alpha` (J. Ville, *Étude critique
//! de la notion de collectif*, 1939): one may look after every sample. A check ends when it has and one change is
//! nearly sure to be the one that occurred, or with the last sample.

pub mod charts;
mod choose;
pub mod conditions;
pub(crate) mod copies;
mod evidence;
mod loads;
mod noise;
pub mod power;
mod scene;
mod seen;

use self::conditions::Condition;
use self::power::{ChangeSize, SmallestDetectable, size_of};
pub use choose::choose_sentinels;
pub use copies::rows_again;
pub use noise::NoiseOf;

use nalgebra::Vector3;
use thiserror::Error;

use self::conditions::{Columns, of_samples};
use self::copies::{same_measurement, too_alike};
use self::evidence::Evidence;
use self::loads::other_loads;
use self::noise::ComparisonNoise;
use self::scene::{Scene, noise_of};
use self::seen::{Seen, ends};
use crate::identify::are_copied;
use crate::identify::calibration::{Calibration, IdentifyError};
use crate::identify::problem::Use;
use crate::math::rms;
use crate::measure::dataset::{Ball, Dataset, NamedDataset};
use crate::robot::{FramePose, Robot};
use crate::units::MM;

/// Probability that a check ever reports a change where there is none (by Ville's inequality, decision 0035).
pub const FALSE_ALARM: f64 = 0.01;

/// Prior probability that something has changed before a check.
const CHANGED_BEFOREHAND: f64 = 0.1;

/// Largest logarithm of a ratio of probabilities that is stated, dimensionless.
const LARGEST: f64 = 600.0;

/// Ratio of a campaign's residual under the calibration to the residual of its own, from which it is not of the robot that was
/// calibrated.
const FOREIGN: f64 = 3.0;

/// Fewest poses that can tell that nothing has changed: one or two do not show every change (docs/check.md).
const FEWEST_POSES: usize = 3;

/// Ratio of the stated noise to that of the campaign, or its inverse, from which the difference is remarked on (docs/check.md).
pub const NOISE_ALIKE: f64 = 3.0;

/// Reasons why a check is not possible.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CheckError {
    /// The samples cannot be compared with the calibration.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// A sample has no counterpart.
    #[error(
        "{sample}: was not measured when the robot was calibrated: no joint may differ by more than 1 deg, and the target must be the same"
    )]
    NoCounterpart {
        /// Id of the sample.
        sample: String,
    },
    /// The calibration does not hold the set-up of the samples, or several of them; or the samples are described with another one
    /// than those of the campaign.
    #[error("the base, tool and balls of these samples are not those of the calibration")]
    OtherSetUp,
    /// The samples are described under other loads, which bend the arm otherwise.
    #[error("{field} is {now} here, and {then} in the campaign")]
    OtherLoads {
        /// Name in the dataset of the quantity that differs.
        field: &'static str,
        /// As stated for the samples.
        now: String,
        /// As stated for the campaign.
        then: String,
    },
    /// Two rows are one measurement: counted twice, it would make the check surer than it is.
    #[error("'{second}' is a copy of '{first}', equal in every number")]
    SameRows {
        /// Id of the one row.
        first: String,
        /// Id of the other.
        second: String,
    },
    /// Nothing was found at so few poses, which does not say that nothing has changed.
    #[error("too few poses to say that nothing has changed: a check needs at least three, and this one has {poses}")]
    TooFewPoses {
        /// Number of different poses.
        poses: usize,
    },
    /// The campaign is of another robot, or of one that had changed by then: compared with it, a robot would be called unchanged
    /// although the calibration does not hold.
    #[error(
        "is not the campaign that was calibrated, whose residual is {:.3} mm: this calibration leaves {:.3} mm of it",
        calibrated / MM, left / MM
    )]
    Foreign {
        /// Residual of the campaign that was calibrated, 3-D rms, m.
        calibrated: f64,
        /// Residual of this campaign under the calibration, 3-D rms, m.
        left: f64,
    },
    /// Rows of the campaign were not measured again.
    #[error("is the campaign itself, or mostly rows of it: the same joints with the same readings")]
    Itself,
    /// The noise is needed to tell a change from chance.
    #[error("the noise of the measurements is not stated, and the campaign came back to too few of its poses to estimate it")]
    NoNoise,
    /// Nothing was measured.
    #[error("there are no samples to check")]
    Nothing,
}

/// A condition and its probability.
#[derive(Debug, Clone, PartialEq)]
pub struct Judged {
    /// The condition.
    pub condition: Condition,
    /// Its probability after the samples used.
    pub probability: f64,
}

/// The state of the check after one sample.
#[derive(Debug, Clone, PartialEq)]
pub struct ViewResult {
    /// Id of the sample.
    pub sample: String,
    /// Id of its counterpart.
    pub counterpart: String,
    /// Change of the position error, 3-D, m.
    pub change: f64,
    /// Its noise, one-sigma per axis, m.
    pub noise: f64,
    /// Average likelihood ratio of all changes to none.
    pub ratio: f64,
}

/// The single change that comes closest to the differences.
#[derive(Debug, Clone, PartialEq)]
pub struct Closest {
    /// The change.
    pub condition: Condition,
    /// Residual of the differences after this condition, rms per axis, m.
    pub left: f64,
    /// The noise of a comparison, rms per axis, m.
    pub noise: f64,
    /// True if noise, and what a change of its size is off its shape, leave as much.
    pub explains: bool,
}

/// The result of a check.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotCheck {
    /// The samples in order, up to the one with which a change was named.
    pub looks: Vec<ViewResult>,
    /// Number of samples given.
    pub given: usize,
    /// True if something has changed: the ratio exceeded one over [`FALSE_ALARM`].
    pub changed: bool,
    /// All conditions, the most probable first.
    pub conditions: Vec<Judged>,
    /// True if the change is named as well: further samples are not needed.
    pub settled: bool,
    /// Conditions that these poses cannot distinguish from the most probable change.
    pub aliased: Vec<Condition>,
    /// If something has changed: the single change that comes closest, and what it leaves. It is the one named, unless that is
    /// something else, or several things.
    pub closest: Option<Closest>,
    /// If something has changed: the size of what is named, if it has one.
    pub size: Option<ChangeSize>,
    /// Source of the noise of a comparison.
    pub noise: NoiseOf,
    /// Noise of one measurement, as stated for the samples, in units of that of the campaign.
    pub noise_ratio: f64,
    /// Root mean square of the changes in units of their noise, where chance hardly ever leaves so little.
    pub too_alike: Option<f64>,
}

impl RobotCheck {
    /// The most probable change, if something has changed.
    pub fn named(&self) -> Option<&Judged> {
        self.conditions.iter().find(|j| self.changed && j.condition != Condition::Valid)
    }

    /// Checks the rows of `now`, in order, against those of `then`, as [`CheckReference::check`] does.
    ///
    /// # Errors
    /// As [`CheckReference::new`] and [`CheckReference::check`].
    pub fn of(calibration: &Calibration, then: NamedDataset<'_>, now: NamedDataset<'_>) -> Result<RobotCheck, CheckError> {
        CheckReference::new(calibration, then)?.check(now)
    }

    fn on(Judging { scene, columns, evidence }: &Judging, noise: NoiseOf, robot: &Robot) -> RobotCheck {
        let (used, changed) = evidence.decide(&scene.differences);
        let look = |(k, pair): (usize, &Pair)| ViewResult {
            sample: pair.now.clone(),
            counterpart: pair.then.clone(),
            change: pair.change.norm(),
            noise: pair.noise,
            ratio: evidence.ln_ratio(&scene.differences, k + 1).min(LARGEST).exp(),
        };
        let looks: Vec<ViewResult> = scene.pairs.iter().enumerate().take(used).map(look).collect();
        let conditions = evidence.probabilities(&scene.differences, used, CHANGED_BEFOREHAND);
        let named = conditions.iter().find(|j| j.condition != Condition::Valid).map(|j| &j.condition);
        let aliased = named.filter(|_| changed).map(|c| evidence.aliased_with(c, &scene.differences, used)).unwrap_or_default();
        let settled = changed && evidence.is_settled(&scene.differences, used);
        let noise_of_all = rms_of(looks.iter().map(|l| l.noise));
        let closest = named.filter(|_| changed).and_then(|named| {
            let (condition, left) = evidence.closest(named, &scene.differences, used)?;
            Some(Closest { condition, left: left.rms()? * noise_of_all, noise: noise_of_all, explains: left.fits })
        });
        let end = scene.seen[..used].last().map_or(0, |s| s.rows.end);
        let size = named.filter(|_| changed).and_then(|named| {
            let columns = columns.iter().find(|columns| columns.condition == *named)?;
            size_of(columns, &scene.differences.rows(0, end).into_owned(), robot)
        });
        let noise_ratio = scene.noise_ratio();
        let (given, too_alike) = (scene.pairs.len(), too_alike(&scene.differences));
        RobotCheck { looks, given, changed, conditions, settled, aliased, closest, size, noise, noise_ratio, too_alike }
    }
}

/// Reference of a check: a calibration, and the campaign from which it was identified.
pub struct CheckReference<'a> {
    calibration: &'a Calibration,
    then: NamedDataset<'a>,
    noise: ComparisonNoise,
}

impl<'a> CheckReference<'a> {
    /// From the campaign that was calibrated, or an earlier check: its repeats, if it has enough, tell the noise.
    ///
    /// # Errors
    /// When the noise is neither stated nor estimated from repeats, or the data do not belong to the calibration.
    pub fn new(calibration: &'a Calibration, then: NamedDataset<'a>) -> Result<Self, CheckError> {
        let reference = CheckReference { calibration, then, noise: noise_of(calibration, then)? };
        if !reference.is_as_calibrated() {
            let left = rms(&calibration.predict(&[then], Use::All)?.residuals);
            // A fit to few samples, or to exact ones, leaves less than the noise of the next.
            let noise = then.dataset.noise.point.unwrap_or(0.0) * f64::sqrt(3.0);
            if left > FOREIGN * calibration.rms.hypot(noise) {
                return Err(CheckError::Foreign { calibrated: calibration.rms, left });
            }
        }
        Ok(reference)
    }

    /// The campaign, with its name.
    pub fn campaign(&self) -> NamedDataset<'a> {
        self.then
    }

    /// True if this is the very campaign that was calibrated, to the last byte of its files.
    pub fn is_as_calibrated(&self) -> bool {
        // A dataset that was never written has no hash.
        !self.then.dataset.hash.is_empty() && self.calibration.dataset_hashes.contains(&self.then.dataset.hash)
    }

    /// Checks the rows of `now`, in order, against those of the campaign. Both are of the calibration's set-up.
    ///
    /// # Errors
    /// When a row has no counterpart, does not belong to the calibration, or is of the campaign itself; when two rows are one
    /// measurement; or when nothing is found at fewer than three poses.
    pub fn check(&self, now: NamedDataset<'_>) -> Result<RobotCheck, CheckError> {
        let judging = self.judging(now)?;
        self.concluded(&judging, now.dataset)
    }

    /// The same with the smallest changes that the rows of `now` show, whether something has changed or not.
    ///
    /// # Errors
    /// As [`CheckReference::check`].
    pub fn check_with_power(&self, now: NamedDataset<'_>) -> Result<(RobotCheck, Vec<SmallestDetectable>), CheckError> {
        let judging = self.judging(now)?;
        let check = self.concluded(&judging, now.dataset)?;
        let shown = power::shown(&judging.columns, &judging.evidence, &self.calibration.robot);
        Ok((check, shown))
    }

    /// True if something had changed, of a check that was accepted before, however few poses it has.
    fn has_changed(&self, now: NamedDataset<'_>) -> Result<bool, CheckError> {
        let Judging { scene, evidence, .. } = self.judging(now)?;
        Ok(evidence.decide(&scene.differences).1)
    }

    fn judging(&self, now: NamedDataset<'_>) -> Result<Judging, CheckError> {
        let scene = self.comparable(now)?;
        if are_copied(now.dataset.samples.iter(), self.then.dataset.samples.iter()) {
            return Err(CheckError::Itself);
        }
        let seen: Vec<&Seen> = scene.seen.iter().collect();
        let columns = of_samples(&seen, &scene.whitening);
        let evidence = Evidence::new(&columns, ends(&seen));
        Ok(Judging { scene, columns, evidence })
    }

    fn concluded(&self, judging: &Judging, now: &Dataset) -> Result<RobotCheck, CheckError> {
        if let Some((first, second)) = same_measurement(&now.samples) {
            return Err(CheckError::SameRows { first: first.id.clone(), second: second.id.clone() });
        }
        let check = RobotCheck::on(judging, self.noise.of.clone(), &self.calibration.robot);
        let poses = judging.scene.poses();
        if !check.changed && poses < FEWEST_POSES {
            return Err(CheckError::TooFewPoses { poses });
        }
        Ok(check)
    }

    /// The noise of each comparison, one sigma per axis, m, whether the rows are measured already or not.
    ///
    /// # Errors
    /// When a row has no counterpart, or does not belong to the calibration.
    pub fn noise(&self, now: NamedDataset<'_>) -> Result<Vec<f64>, CheckError> {
        Ok(self.comparable(now)?.pairs.iter().map(|pair| pair.noise).collect())
    }

    fn comparable(&self, now: NamedDataset<'_>) -> Result<Scene, CheckError> {
        if !is_set_up_alike(self.then.dataset, now.dataset) {
            return Err(CheckError::OtherSetUp);
        }
        if let Some(other) = other_loads(self.then.dataset, now.dataset) {
            return Err(other);
        }
        self.scene(self.then, now)
    }

    /// A comparison under the same noise with more than the campaign.
    fn scene(&self, then: NamedDataset<'_>, now: NamedDataset<'_>) -> Result<Scene, CheckError> {
        Scene::new(self.calibration, &self.noise, then, now)
    }
}

/// Lengths, m, and angles, rad, that differ by less are equal: files are rounded.
const EQUAL: f64 = 1e-9;

/// True if two datasets state the same base, tool and places of the balls that both have.
fn is_set_up_alike(then: &Dataset, now: &Dataset) -> bool {
    let equal = |a: &FramePose, b: &FramePose| a.to_array().iter().zip(b.to_array()).all(|(a, b)| (a - b).abs() <= EQUAL);
    let ball_stays = |ball: &Ball| {
        let other = now.balls.iter().find(|other| other.id == ball.id);
        other.is_none_or(|other| (other.position - ball.position).norm() <= EQUAL)
    };
    equal(&then.base, &now.base) && equal(&then.tool, &now.tool) && then.balls.iter().all(ball_stays)
}

/// Root mean square.
fn rms_of(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len().max(1) as f64;
    (values.map(|x| x * x).sum::<f64>() / count).sqrt()
}

/// Inputs of a judgement.
struct Judging {
    scene: Scene,
    columns: Vec<Columns>,
    evidence: Evidence,
}

/// A sample and its counterpart.
struct Pair {
    now: String,
    then: String,
    change: Vector3<f64>,
    noise: f64,
}
