//! Recovery after a crash: from a few touches, what moved, and which mastering values put it right.
//!
//! What was known before the crash, from a campaign, a fleet or the nominal robot, is the prior of every parameter. Zeros of up
//! to three joints, the tool, the base and one bent link are the candidates; every combination is weighed by its marginal
//! likelihood, with whatever is not known exactly integrated out. A zero that the touches do not show is said to be so.
//!
//! ```
//! use calibench::identify::{Model, identify};
//! # use calibench::measure::dataset::{Dataset, Measured, NamedDataset, Noise, Sample};
//! use calibench_recovery::{Earlier, Verdict, recover};
//! # use calibench::robot::kinematics::world_from_tool;
//! # use calibench::robot::{FramePose, built_in};
//! use calibench::units::{DEG, UM};
//! # let robot = std::sync::Arc::new(built_in("ur5").ok_or("built in")?);
//! # let measured = |k: usize, slip: f64| {
//! #     let q: Vec<f64> = (1..=6).map(|i| 2.0 * ((k * i) as f64 * 0.618).fract() - 1.0).collect();
//! #     let mut there = q.clone();
//! #     there[3] += slip;
//! #     let noise = calibench::nalgebra::Vector3::from_fn(|i, _| 40.0 * UM * (((k * (i + 3)) as f64 * 0.414).fract() - 0.5));
//! #     let seen = world_from_tool(&robot, &FramePose::default(), &FramePose::default(), &there).translation.vector;
//! #     Sample::new(format!("p{k}"), q, Measured::Point(seen + noise))
//! # };
//! # let dataset = |samples: Vec<Sample>| {
//! #     let noise = Noise { point: Some(20.0 * UM), ..Noise::default() };
//! #     Dataset { robot: robot.clone(), noise, samples, ..Dataset::default() }
//! # };
//!
//! // Twelve points after joint 4 has slipped by half a degree.
//! let campaign = dataset((0..60).map(|k| measured(k, 0.0)).collect());
//! let touches = dataset((60..72).map(|k| measured(k, 0.5 * DEG)).collect());
//! let calibration = identify(&[NamedDataset::new("campaign", &campaign)], &Model::of(&["base_frame", "mdh"]))?;
//! let found = recover(Earlier::Campaign(&calibration), NamedDataset::new("touches", &touches), false)?;
//! assert_eq!((found.verdict, found.moved.zeros.as_slice()), (Verdict::Moved, [4].as_slice()));
//! assert!((found.zeros[0].change - 0.5 * DEG).abs() < 0.01 * DEG);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod mastering;
mod result;
mod scene;
mod search;
pub mod touches;

use statrs::distribution::{ChiSquared, ContinuousCDF};
use thiserror::Error;

use self::scene::Scene;
use self::search::{Search, Solution};
use calibench::identify::calibration::{Calibration, IdentifyError};
use calibench::identify::fleet::Fleet;
use calibench::identify::problem::ProblemError;
use calibench::math::rms;
use calibench::measure::dataset::NamedDataset;
use calibench::measure::poses::pool::PoolError;

/// Probability of a report that something moved where nothing did (Markov's inequality).
pub const FALSE_ALARM: f64 = 0.01;

/// Most touches: more are a campaign.
pub const MOST_TOUCHES: usize = 200;

/// Fewest touches: two do not tell a zero from the tool.
const FEWEST_TOUCHES: usize = 3;

/// Share of the probability below which another combination is not mentioned.
const RIVAL: f64 = 0.05;

/// Significance level at which no combination explains the touches.
const MISFIT: f64 = 1e-4;

/// A joint whose zero is not known better than this from the touches, one-sigma, rad, is not seen by them: about half the
/// smallest zero that anyone masters for.
const UNSEEN: f64 = 0.5 * calibench::units::DEG;

/// What was known of the robot before the crash.
#[derive(Debug, Clone, Copy)]
pub enum Earlier<'a> {
    /// The calibration of an earlier campaign.
    Campaign(&'a Calibration),
    /// The robots of its type.
    Fleet(&'a Fleet),
    /// Its nominal model.
    Nominal,
}

/// Reasons why nothing can be said.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RecoveryError {
    /// The touches cannot be compared with what was known.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// The touches are of another robot.
    #[error("the touches are of '{touched}', what was known before is of '{known}'")]
    OtherRobot {
        /// Robot of the touches.
        touched: String,
        /// Robot known before.
        known: String,
    },
    /// The noise is needed to tell a change from chance.
    #[error("the noise of the touches is not stated")]
    NoNoise,
    /// Too few touches.
    #[error("{touches} touches do not tell a zero from the tool: at least {FEWEST_TOUCHES} are needed, and 12 are usual")]
    TooFew {
        /// Their number.
        touches: usize,
    },
    /// A campaign in place of touches.
    #[error("{touches} touches are a campaign: identify the robot with it; {MOST_TOUCHES} at most")]
    TooMany {
        /// Their number.
        touches: usize,
    },
    /// Several sessions.
    #[error("the touches are of several sessions, each with a base and a tool of its own")]
    Sessions,
    /// No posture was found for a touch.
    #[error(transparent)]
    Pool(#[from] PoolError),
}

impl From<ProblemError> for RecoveryError {
    fn from(error: ProblemError) -> Self {
        RecoveryError::Identify(error.into())
    }
}

/// A combination of things that moved.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Moved {
    /// Joints that lost their zero, counted from 1, ascending.
    pub zeros: Vec<usize>,
    /// True if the tool moved on the flange, or was bent.
    pub tool: bool,
    /// True if the base, the artifact or the instrument moved.
    pub base: bool,
    /// The joint behind which the link is bent, counted from 1.
    pub bent: Option<usize>,
}

impl Moved {
    /// True if nothing moved.
    pub fn is_nothing(&self) -> bool {
        *self == Moved::default()
    }
}

/// The result in one word.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Verdict {
    /// Nothing moved that these touches show.
    NothingMoved,
    /// Zeros, the tool or the base moved: they can be put right.
    Moved,
    /// A link is bent: mastering would put a second error on top of the first.
    BentLink,
    /// No combination explains the touches.
    Unexplained,
}

/// A number that changed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Changed {
    /// Change since before the crash, SI: of a zero, what is to be added to the angle that the controller shows.
    pub change: f64,
    /// Its standard uncertainty.
    pub sigma: f64,
}

/// The zero of a joint that changed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZeroChange {
    /// The joint, counted from 1.
    pub joint: usize,
    /// Change of the angle that the arm stands at, while the controller shows the same, rad.
    pub change: f64,
    /// Its standard uncertainty.
    pub sigma: f64,
}

/// Another combination that these touches allow.
#[derive(Debug, Clone, PartialEq)]
pub struct RivalCombination {
    /// The combination.
    pub moved: Moved,
    /// Its share of the probability of all changes.
    pub probability: f64,
    /// Of the first: the posture, rad, of the reachable ones tried, whose touch would tell it best from what is reported; `None`
    /// if none does.
    pub posture: Option<Vec<f64>>,
}

/// What moved, and how sure that is.
#[derive(Debug, Clone, PartialEq)]
pub struct Recovery {
    /// The result in one word.
    pub verdict: Verdict,
    /// What moved; empty if nothing did.
    pub moved: Moved,
    /// Its share of the probability of all changes.
    pub probability: f64,
    /// The zeros that changed.
    pub zeros: Vec<ZeroChange>,
    /// Change of the TCP in the last frame, m; `None` if it did not move.
    pub tool: Option<[Changed; 3]>,
    /// Average likelihood ratio of all changes to none: something is reported from one over [`FALSE_ALARM`].
    pub ratio: f64,
    /// Other combinations with at least a twentieth of the probability.
    pub rivals: Vec<RivalCombination>,
    /// Residual of the touches, 3-D rms, m, if only pin, artifact or instrument stand elsewhere than before; `None` if that does not
    /// explain them, or they are known to have moved.
    pub elsewhere: Option<f64>,
    /// Standard uncertainty with which these touches show the zero of each joint alone, rad; infinite where they do not show it.
    pub shown: Vec<f64>,
    /// Number of touches.
    pub touches: usize,
    /// Residual of the touches under what was known before, 3-D rms, m.
    pub before: f64,
    /// The same with what moved, m.
    pub after: f64,
    /// The touch that is furthest from what is found, in units of its noise, and by how many.
    pub worst: WorstTouch,
    /// The robot as it is now, for compensation until it is mastered.
    pub now: Calibration,
    /// The robot as it will be after the new values were entered: the next touches are judged by it.
    pub mastered: Calibration,
}

/// The touch that is furthest from what is found.
#[derive(Debug, Clone, PartialEq)]
pub struct WorstTouch {
    /// Its id.
    pub id: String,
    /// Residual, 3-D, m.
    pub residual: f64,
    /// The same in units of its noise.
    pub sigmas: f64,
}

impl Recovery {
    /// The TCP as it is now, in the last frame, m.
    pub fn tcp(&self) -> [f64; 3] {
        let stated = self.now.setups.first().map_or([0.0; 3], |setup| setup.tool.xyz);
        std::array::from_fn(|k| {
            let estimate = self.now.estimate(["tool_x", "tool_y", "tool_z"][k]);
            estimate.map_or(stated[k] + self.tool.map_or(0.0, |tool| tool[k].change), |e| e.value)
        })
    }

    /// Joints, counted from 1, whose zeros these touches do not show, and that are not found to have changed.
    pub fn unseen(&self) -> Vec<usize> {
        let unseen = self.shown.iter().enumerate().filter(|(_, s)| **s > UNSEEN).map(|(j, _)| j + 1);
        unseen.filter(|j| !self.moved.zeros.contains(j)).collect()
    }
}

/// Finds what moved between what was known before and these touches; all rows of them are used. If `instrument_moved`, the base in
/// the world is open, and a zero of a joint that turns as the base does is not seen.
///
/// # Errors
/// When the touches do not belong to the robot, their noise is not stated, or they are too few or a campaign.
pub fn recover(earlier: Earlier<'_>, touches: NamedDataset<'_>, instrument_moved: bool) -> Result<Recovery, RecoveryError> {
    let count = touches.dataset.samples.len();
    if count < FEWEST_TOUCHES {
        return Err(RecoveryError::TooFew { touches: count });
    }
    if count > MOST_TOUCHES {
        return Err(RecoveryError::TooMany { touches: count });
    }
    let robot = &touches.dataset.robot;
    let known = match earlier {
        Earlier::Campaign(c) if !c.robot.is_same_arm(robot) => Some(c.robot.name.clone()),
        Earlier::Fleet(fleet) if !fleet.is_of(robot) => Some(fleet.robot.clone()),
        _ => None,
    };
    if let Some(known) = known {
        return Err(RecoveryError::OtherRobot { touched: robot.name.clone(), known });
    }
    let scene = Scene::new(&earlier, touches, instrument_moved)?;
    let search = scene.search()?;
    let found = concluded(&scene, &search, &earlier, touches)?;
    if instrument_moved || found.verdict == Verdict::NothingMoved {
        return Ok(found);
    }
    let open = recover(earlier, touches, true)?;
    Ok(Recovery { elsewhere: (open.verdict == Verdict::NothingMoved).then_some(open.after), ..found })
}

fn concluded(
    scene: &Scene,
    search: &Search,
    earlier: &Earlier<'_>,
    touches: NamedDataset<'_>,
) -> Result<Recovery, RecoveryError> {
    let Search { nothing, found, .. } = search;
    let of_nothing = nothing.weighed.ln - scene.ln_share(&Moved::default());
    let top = found.first().map_or(f64::NEG_INFINITY, |s| s.weighed.ln);
    let sum: f64 = found.iter().map(|s| (s.weighed.ln - top).exp()).sum();
    let ln_ratio = top + sum.ln() - of_nothing;
    let something = ln_ratio >= -FALSE_ALARM.ln();
    let best = found.first().filter(|_| something).unwrap_or(nothing);
    let moved = best.weighed.moved.clone();
    let share = |s: &Solution| (s.weighed.ln - top).exp() / sum;
    let misfit = ChiSquared::new(scene.rows() as f64).map_or(1.0, |chi2| chi2.sf(best.squares / result::NOISE_ALLOWED));
    let verdict = match () {
        () if misfit < MISFIT => Verdict::Unexplained,
        () if !something => Verdict::NothingMoved,
        () if moved.bent.is_some() => Verdict::BentLink,
        () => Verdict::Moved,
    };
    // The next touch tells the first rival; what is left after it is seen then.
    let rival = |(k, s): (usize, &Solution)| RivalCombination {
        moved: s.weighed.moved.clone(),
        probability: share(s),
        posture: if k == 0 { touches::telling(scene, touches, best, s) } else { None },
    };
    let rivals = found.iter().skip(1).filter(|s| something && share(s) >= RIVAL).enumerate().map(rival).collect();
    let average = result::Average::new(scene, found, best);
    let residuals = |s: &Solution| rms(&scene.problem.residuals(s.values.as_slice()));
    let (now, mastered) = result::calibrations(scene, earlier, touches, best);
    Ok(Recovery {
        verdict,
        probability: if something { share(best) } else { 1.0 },
        zeros: average.zeros(),
        tool: average.tool(),
        ratio: ln_ratio.min(600.0).exp(),
        rivals,
        elsewhere: None,
        shown: result::shown(scene, search)?,
        touches: touches.dataset.samples.len(),
        before: rms(&scene.problem.residuals(scene.mean.as_slice())),
        after: residuals(best),
        worst: result::worst(scene, best),
        now,
        mastered,
        moved,
    })
}
