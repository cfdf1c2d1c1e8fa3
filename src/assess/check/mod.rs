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

mod charts;
mod choose;
mod conditions;
mod evidence;
mod noise;
mod power;
mod scene;
mod seen;

use thiserror::Error;

pub use charts::{Chart, ChartPoint, Charts, RUN_LENGTH};
pub use choose::choose_sentinels;
pub use conditions::{Condition, Elementary};
pub use noise::NoiseOf;
pub use power::{Power, PowerAt, power_of_check};

use self::conditions::of_samples;
use self::evidence::Evidence;
use self::noise::ComparisonNoise;
use self::scene::{Scene, near, noise_of};
use self::seen::ends;
use crate::identify::{Calibration, IdentifyError, Use, are_copied};
use crate::math::rms;
use crate::measure::{Ball, Dataset, Sample};
use crate::robot::FramePose;
use crate::units::{DEG, MM};

/// Probability that a check ever reports a change where there is none.
pub const FALSE_ALARM: f64 = 0.01;

/// Share of the checks before which something has changed, for the probabilities.
const CHANGED_BEFOREHAND: f64 = 0.1;

/// Logarithm of the largest ratio that is stated.
const LARGEST: f64 = 600.0;

/// A campaign of which the calibration leaves this many times its own residual is not of the robot that was calibrated.
const FOREIGN: f64 = 3.0;

/// Two samples are of one pose if no joint differs by more, rad or 0.01 m.
const SAME_POSE: f64 = 1.0 * DEG;

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
    /// The campaign is of another robot, or of one that had changed by then: compared with it, a robot would be called unchanged
    /// although the calibration does not hold.
    #[error(
        "is not the campaign that was calibrated, whose residual is {:.3} mm: this calibration leaves {:.3} mm of it",
        calibrated / MM, left / MM
    )]
    Foreign {
        /// Residual of the campaign that was calibrated, 3-D rms, m.
        calibrated: f64,
        /// What the calibration leaves of this one, 3-D rms, m.
        left: f64,
    },
    /// Rows of the campaign were not measured again.
    #[error("is the campaign itself, or mostly rows of it: the same joints with the same readings")]
    Itself,
    /// The noise is needed to tell a change from chance.
    #[error("the noise of the measurements is not stated, and the campaign came back to too few of its poses to tell it")]
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
pub struct Looked {
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

/// The result of a check.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotCheck {
    /// The samples in order, up to the one with which a change was named.
    pub looks: Vec<Looked>,
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
    /// Where the noise of a comparison is from.
    pub noise: NoiseOf,
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
    pub fn of(calibration: &Calibration, then: (&str, &Dataset), now: (&str, &Dataset)) -> Result<RobotCheck, CheckError> {
        CheckReference::new(calibration, then)?.check(now)
    }

    fn on(scene: &Scene, noise: NoiseOf) -> RobotCheck {
        let seen: Vec<_> = scene.seen.iter().collect();
        let evidence = Evidence::new(&of_samples(&seen, &scene.whitening), ends(&seen));
        let (used, changed) = evidence.decide(&scene.differences);
        let look = |(k, pair): (usize, &Pair)| Looked {
            sample: pair.now.clone(),
            counterpart: pair.then.clone(),
            change: pair.change.norm(),
            noise: pair.noise,
            ratio: evidence.ln_ratio(&scene.differences, k + 1).min(LARGEST).exp(),
        };
        let looks: Vec<Looked> = scene.pairs.iter().enumerate().take(used).map(look).collect();
        let conditions = evidence.probabilities(&scene.differences, used, CHANGED_BEFOREHAND);
        let named = conditions.iter().find(|j| j.condition != Condition::Valid).map(|j| &j.condition);
        let aliased = named.filter(|_| changed).map(|c| evidence.aliased_with(c, &scene.differences, used)).unwrap_or_default();
        let settled = changed && evidence.is_settled(&scene.differences, used);
        RobotCheck { looks, given: scene.pairs.len(), changed, conditions, settled, aliased, noise }
    }
}

/// What checks are compared with: a calibration, and what was measured under it.
pub struct CheckReference<'a> {
    calibration: &'a Calibration,
    then: (&'a str, &'a Dataset),
    noise: ComparisonNoise,
}

impl<'a> CheckReference<'a> {
    /// From the campaign that was calibrated, or an earlier check: its repeats, if it has enough, tell the noise.
    ///
    /// # Errors
    /// When the noise is neither stated nor told by repeats, or the data do not belong to the calibration.
    pub fn new(calibration: &'a Calibration, then: (&'a str, &'a Dataset)) -> Result<Self, CheckError> {
        let reference = CheckReference { calibration, then, noise: noise_of(calibration, then)? };
        if !reference.is_as_calibrated() {
            let left = rms(&calibration.predict(&[then], Use::All)?.residuals);
            // A fit to few samples, or to exact ones, leaves less than the noise of the next.
            let noise = then.1.noise.point.unwrap_or(0.0) * f64::sqrt(3.0);
            if left > FOREIGN * calibration.rms.hypot(noise) {
                return Err(CheckError::Foreign { calibrated: calibration.rms, left });
            }
        }
        Ok(reference)
    }

    /// The campaign, with its name.
    pub fn campaign(&self) -> (&'a str, &'a Dataset) {
        self.then
    }

    /// True if this is the very campaign that was calibrated, to the last byte of its files.
    pub fn is_as_calibrated(&self) -> bool {
        // A dataset that was never written has no hash.
        !self.then.1.hash.is_empty() && self.calibration.dataset_hashes.contains(&self.then.1.hash)
    }

    /// Checks the rows of `now`, in order, against those of the campaign. Both are of the calibration's set-up.
    ///
    /// # Errors
    /// When a row has no counterpart, does not belong to the calibration, or is of the campaign itself.
    pub fn check(&self, now: (&str, &Dataset)) -> Result<RobotCheck, CheckError> {
        let scene = self.comparable(now)?;
        if are_copied(now.1.samples.iter(), self.then.1.samples.iter()) {
            return Err(CheckError::Itself);
        }
        Ok(RobotCheck::on(&scene, self.noise.of.clone()))
    }

    /// The noise of each comparison, one sigma per axis, m, whether the rows are measured already or not.
    ///
    /// # Errors
    /// When a row has no counterpart, or does not belong to the calibration.
    pub fn noise(&self, now: (&str, &Dataset)) -> Result<Vec<f64>, CheckError> {
        Ok(self.comparable(now)?.pairs.iter().map(|pair| pair.noise).collect())
    }

    fn comparable(&self, now: (&str, &Dataset)) -> Result<Scene, CheckError> {
        if !is_set_up_alike(self.then.1, now.1) {
            return Err(CheckError::OtherSetUp);
        }
        self.scene(self.then, now)
    }

    /// A comparison under the same noise with more than the campaign.
    fn scene(&self, then: (&str, &Dataset), now: (&str, &Dataset)) -> Result<Scene, CheckError> {
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

/// A sample and its counterpart.
struct Pair {
    now: String,
    then: String,
    change: nalgebra::Vector3<f64>,
    noise: f64,
}

/// The counterparts of a sample: all rows of the same target, payload and pose.
fn counterparts(sample: &Sample, now: &Dataset, then: &Dataset) -> Vec<usize> {
    use crate::measure::Measured;
    let ball = |d: &Dataset, s: &Sample| match &s.measured {
        Measured::Ball { ball, .. } => d.balls.get(*ball).map(|b| b.id.clone()),
        Measured::Distance { anchor, .. } => d.anchors.get(*anchor).map(|a| format!("anchor {}", a.id)),
        Measured::Point(_) => None,
    };
    let payload = |d: &Dataset, s: &Sample| d.payloads.get(s.payload).map(|p| p.name.clone());
    let point = |d: &Dataset, s: &Sample| s.tool_target.and_then(|t| d.tool_targets.get(t)).map(|t| t.id.clone());
    let alike = |other: &Sample| {
        near(other, sample)
            && ball(then, other) == ball(now, sample)
            && payload(then, other) == payload(now, sample)
            && point(then, other) == point(now, sample)
            && std::mem::discriminant(&other.measured) == std::mem::discriminant(&sample.measured)
    };
    (0..then.samples.len()).filter(|&k| Use::All.takes(&then.samples[k]) && alike(&then.samples[k])).collect()
}
