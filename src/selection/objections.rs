//! Objections to a step: evidence that the model after it predicts no better than the one before.

use super::fit_scores::{SessionError, rms};
use super::hold_out::Check;
use super::recommend::Gain;
use super::withdrawal::Contradiction;
use crate::diagnosis::Diagnosis;
use crate::diagnosis::folds::Division;
use crate::effects::{self, EffectId};
use crate::prediction::{PoseSource, WorkspaceError};

/// Smallest share by which the cross-validated rms or the predicted error must decrease to count as an improvement.
const A_FALL: f64 = 0.005;

/// Share by which the error of the other samples must decrease to justify the exclusion of samples.
const WORTH_A_SAMPLE: f64 = 0.05;

/// If at least one sample in this many postures is excluded, the gain of the others must be significant: of few postures, none
/// can be spared.
const MISSED: usize = 40;

/// Share by which the error of a campaign must increase to count as worse.
const WORSE: f64 = 0.01;

/// Number of standard errors by which the measured error may not rise.
const ONE_ERROR: f64 = 1.0;

/// An objection to a step.
#[derive(Debug, Clone, PartialEq)]
pub enum Objection {
    /// The gain at left-out postures is too small, or not significant.
    Gain(Gain),
    /// Blocks that were not fitted are not predicted better.
    CrossValidation {
        /// Rms before and after, m.
        rms: [f64; 2],
    },
    /// The expected error does not decrease.
    Workspace {
        /// Where it is expected.
        at: PoseSource,
        /// Mean before and after, m.
        mean: [f64; 2],
    },
    /// A session is predicted worse.
    Session {
        /// Its name.
        name: String,
        /// Rms before and after, m.
        rms: [f64; 2],
    },
    /// A campaign is predicted significantly worse by the robot calibrated on the others.
    Campaign {
        /// Its name.
        name: String,
        /// Size and significance of the increase.
        by: Contradiction,
    },
    /// A campaign that was not fitted is predicted significantly worse.
    Check {
        /// Its name.
        name: String,
        /// Size and significance of the increase.
        by: Contradiction,
    },
    /// A campaign that was not fitted can no longer be judged.
    CheckUnjudged {
        /// Its name.
        name: String,
        /// Reason.
        because: String,
    },
    /// Rows of set `validation`, which were not fitted, are predicted worse by more than one standard error.
    Measured {
        /// Size and significance of the increase.
        by: Contradiction,
    },
    /// The data do not determine the model.
    NotFitted {
        /// Reason.
        because: String,
    },
}

impl Objection {
    /// True if the objection comes from campaigns that the step was not fitted to.
    pub fn is_measured_elsewhere(&self) -> bool {
        matches!(self, Objection::Check { .. } | Objection::CheckUnjudged { .. } | Objection::Campaign { .. })
    }

    /// True if the step is refused because of it; false if it is only a warning.
    pub fn refuses(&self) -> bool {
        !matches!(self, Objection::Workspace { .. })
    }
}

/// The parts of a judged model by which a step is judged.
#[derive(Clone, Copy)]
pub(crate) struct Scored<'a> {
    pub blocks: &'a [(String, f64)],
    pub posture: &'a [usize],
    pub sessions: &'a [SessionError],
    pub checks: &'a [Check],
    /// Squared errors at rows of set `validation`, m².
    pub held_out: &'a [f64],
    /// `None` if it cannot be predicted, or is not yet.
    pub workspace: Option<&'a WorkspaceError>,
    /// `None` before the diagnosis.
    pub diagnosis: Option<&'a Diagnosis>,
}

/// A step from one model to another.
pub(crate) struct Compared<'a> {
    /// The effects added.
    pub added: &'a [EffectId],
    /// Their gains.
    pub gains: &'a [Gain],
    pub before: Scored<'a>,
    pub after: Scored<'a>,
}

impl<'a> Scored<'a> {
    /// True if the campaign has so few postures that it would miss this many samples.
    pub fn would_miss(&self, samples: usize) -> bool {
        samples * MISSED >= self.postures()
    }

    /// Number of postures at which it was judged.
    fn postures(&self) -> usize {
        self.posture.iter().max().map_or(0, |p| p + 1)
    }

    /// Posture index and cross-validated squared residual of each sample, m², except for these.
    fn blocks_without(&self, samples: &[&str]) -> impl Iterator<Item = (usize, f64)> {
        let of_all = self.posture.iter().zip(self.blocks);
        of_all.filter(|(_, (id, _))| !samples.contains(&id.as_str())).map(|(posture, (_, squares))| (*posture, *squares))
    }

    /// Mean cross-validated squared residual of each posture, m², without these samples; `None` for a posture with no
    /// other sample.
    fn mean_squares(&self, without: &[&str]) -> Vec<Option<f64>> {
        let mut sums = vec![(0.0, 0.0); self.postures()];
        for (posture, squares) in self.blocks_without(without) {
            let (sum, count) = &mut sums[posture];
            (*sum, *count) = (*sum + squares, *count + 1.0);
        }
        sums.into_iter().map(|(sum, count)| (count > 0.0).then(|| sum / count)).collect()
    }
}

impl<'a> Compared<'a> {
    /// Samples that this step excludes.
    fn added_aside(&self) -> Vec<&'a str> {
        self.added.iter().filter_map(|effect| effects::catalogue::set_aside_by(effect)).collect()
    }

    /// Cross-validated rms error of the samples that are not excluded, before and after the step, m.
    fn of_the_others(&self) -> [f64; 2] {
        let aside = self.added_aside();
        [self.before, self.after].map(|r| rms(r.blocks_without(&aside).map(|(_, squares)| squares)))
    }

    /// Objection to excluding suspects for good. If an arm has large errors everywhere, distant rows are no
    /// accident, and removing them does not improve the prediction of the others; with few postures, the improvement
    /// must be significant.
    pub fn objection_of_the_others(&self) -> Option<Objection> {
        let rms = self.of_the_others();
        if rms[1] > rms[0] * (1.0 - WORTH_A_SAMPLE) {
            return Some(Objection::CrossValidation { rms });
        }
        let aside = self.added_aside();
        if !self.before.would_miss(aside.len()) {
            return None;
        }
        let [before, after] = [self.before, self.after].map(|scored| scored.mean_squares(&aside));
        Gain::of(Division::Time, &before, &after).filter(|gain| !gain.convinces()).map(Objection::Gain)
    }

    /// Objection that rows of set `validation` are predicted worse. The measured error decides before any that is expected.
    pub fn objection_of_the_measured(&self) -> Option<Objection> {
        let rows: Vec<usize> = (0..self.after.held_out.len()).collect();
        let by = Contradiction::beyond(ONE_ERROR, self.before.held_out, self.after.held_out, &rows);
        by.map(|by| Objection::Measured { by })
    }

    /// Objections to the step.
    pub fn objections(&self) -> Vec<Objection> {
        let mut all = Vec::new();
        let (below, above) = (&self.before, &self.after);
        // A sample that is excluded need not be predicted; the others must not be predicted worse because of it.
        let aside = self.added_aside();
        let sets_aside = !aside.is_empty() && aside.len() == self.added.len();
        // With a second bad sample present, excluding the first may not seem to help; the diagnosis has judged them
        // together.
        let advised =
            sets_aside && aside.iter().all(|sample| self.before.diagnosis.is_some_and(|d| d.advises_to_set_aside(sample)));
        let squares = self.of_the_others();
        // A sample is excluded only for a clear improvement; otherwise it is a measurement like any other.
        let enough = 1.0 - if sets_aside { WORTH_A_SAMPLE } else { A_FALL };
        all.extend(self.gains.iter().find(|gain| !gain.convinces()).copied().map(Objection::Gain));
        if self.gains.is_empty() && !advised && squares[1] > squares[0] * enough {
            all.push(Objection::CrossValidation { rms: squares });
        }
        // With one session, this is the cross-validation above.
        let several = above.sessions.len() > 1 && !sets_aside;
        for (before, after) in below.sessions.iter().zip(above.sessions).filter(|_| several) {
            let name = after.name.clone();
            if let Some(by) = Contradiction::of(&before.squares, &after.squares, &after.posture) {
                all.push(Objection::Campaign { name, by });
            } else if self.gains.is_empty() && after.cross_validated > before.cross_validated * (1.0 + WORSE) {
                all.push(Objection::Session { name, rms: [before.cross_validated, after.cross_validated] });
            }
        }
        for (before, after) in below.checks.iter().zip(above.checks) {
            let name = after.name.clone();
            match (&before.result, &after.result) {
                (Ok(_), Ok(_)) => {
                    let by = Contradiction::of(&before.squares, &after.squares, &after.posture);
                    all.extend(by.map(|by| Objection::Check { name, by }));
                }
                (Ok(_), Err(because)) => all.push(Objection::CheckUnjudged { name, because: because.to_string() }),
                _ => {}
            }
        }
        all.extend(self.objection_of_the_measured());
        if let (Some(before), Some(after)) = (below.workspace, above.workspace) {
            let mean = [before.mean.expected, after.mean.expected];
            if mean[1] > mean[0] * (1.0 - A_FALL) {
                all.push(Objection::Workspace { at: after.at, mean });
            }
        }
        all
    }
}
