//! Views that are significant, strongest first, each tested beyond those before it.
//!
//! A displaced ball affects every view: the other balls, and the joints whose angles differ from ball to ball. Hence
//! the view with the largest gain is selected first (Schwarz 1978, with the noise as the smallest possible remainder)
//! and added to the model, and the others are judged by what they show beyond it.

use super::layout::Layout;
use super::standout::{Standout, Subject};
use crate::residuals::noise_floor::{NoiseFloor, fisher_chance};
use crate::residuals::views::{ScoreReduction, Scores, ViewTest};

/// Level of the tests for findings, lack of fit and views, for each kind separately (docs/comparing.md).
pub const SIGNIFICANCE: f64 = 0.01;

/// Largest number of findings; if more views are significant, the model is wrong in many small ways.
const MOST: usize = 5;

/// A view that explains less than this share of what noise does not explain is not reported, however significant it is.
const WORTH: f64 = 0.02;

/// Judges the contributions of views.
pub(super) struct Judge<'a> {
    pub noise: &'a NoiseFloor,
    pub samples: usize,
    /// Number of times that a posture's error is counted: scalar measurements over three per posture, at least 1.
    pub repetition: f64,
}

impl Judge<'_> {
    /// One-sigma of the whitened residuals: the noise, or the rms of the residuals if it is unknown.
    pub fn unit(&self, scores: &Scores) -> f64 {
        match &self.noise.level {
            Some(level) => level.relative,
            None => (scores.squares / scores.dof.max(1.0)).sqrt(),
        }
    }

    /// Tests a view with this contribution, one of `family` views of its kind.
    pub fn test(&self, scores: &Scores, reduction: &ScoreReduction, family: f64) -> ViewTest {
        let (squares, dof) = (reduction.squares, reduction.dof as f64);
        let unit = self.unit(scores);
        let beyond = scores.dof - dof;
        let rest = (scores.squares - squares).max(0.0);
        let p = if reduction.dof == 0 {
            1.0
        } else {
            // A model error is the same in all replicates of a posture (Kish's design effect); noise is not.
            let wrong = self.noise.level.map_or(1.0, |l| (1.0 - l.relative.powi(2) * beyond / rest).clamp(0.0, 1.0));
            let effect = 1.0 + (self.repetition - 1.0) * if rest > 0.0 { wrong } else { 0.0 };
            let below = beyond / effect;
            let against_rest =
                if below >= 1.0 { fisher_chance((squares / dof) / (rest / beyond) / effect, dof, below) } else { None };
            let against_noise = self.noise.chance_of(squares, dof);
            match (against_noise, against_rest) {
                (Some(a), Some(b)) => a.max(b),
                (a, b) => a.or(b).unwrap_or(1.0),
            }
        };
        let by_chance = if beyond >= 1.0 { dof * rest / beyond } else { squares };
        ViewTest {
            chi2: if unit > 0.0 { squares / (unit * unit) } else { 0.0 },
            dof: reduction.dof,
            p_family: (p * family).min(1.0),
            explains: if scores.squares > 0.0 { ((squares - by_chance) / scores.squares).clamp(0.0, 1.0) } else { 0.0 },
        }
    }

    /// True if a share of the residual sum of squares is large enough to be reported.
    fn is_worth_saying(&self, scores: &Scores, share: f64) -> bool {
        let noise = self.noise.level.map_or(0.0, |l| l.relative.powi(2) * scores.dof);
        share * scores.squares >= WORTH * (scores.squares - noise)
    }

    /// Gain of a view by the Bayesian information criterion: twice the gain in log likelihood minus the penalty for its
    /// degrees of freedom.
    pub fn gain(&self, scores: &Scores, reduction: &ScoreReduction) -> f64 {
        let dof = reduction.dof as f64;
        let floor = self.noise.level.map_or(0.0, |l| l.relative * l.relative * (scores.dof - dof).max(0.0));
        let rest = (scores.squares - reduction.squares).max(floor).max(f64::MIN_POSITIVE);
        scores.dof * (scores.squares.max(f64::MIN_POSITIVE) / rest).ln() - dof * scores.dof.max(1.0).ln()
    }
}

/// Findings, and the share of the residual sum of squares that remains after them.
pub(super) fn findings(layout: &Layout, judge: &Judge<'_>, scores: &Scores) -> (Vec<Standout>, f64) {
    let mut now = scores.clone();
    let mut found: Vec<Standout> = Vec::new();
    let candidates = layout.candidates();
    let scanned = |subject: Subject| matches!(subject, Subject::Sample(_));
    // All samples count as one candidate with as many places.
    let family = candidates.iter().filter(|(s, _, _)| !scanned(*s)).count() as f64 + 1.0;
    while found.len() < MOST {
        let mut best: Option<([f64; 2], Standout, &[usize])> = None;
        for (subject, patterns, level) in candidates.iter().filter(|(s, _, _)| found.iter().all(|f| f.subject != *s)) {
            let reduction = match level {
                Some(level) => now.reduction_beyond(patterns, *level),
                None => now.reduction(patterns),
            };
            let places = if scanned(*subject) { judge.samples as f64 } else { 1.0 };
            let mut test = judge.test(&now, &reduction, family * places);
            // The share refers to the whole residual, not to what the findings before it leave.
            test.explains *= if scores.squares > 0.0 { now.squares / scores.squares } else { 0.0 };
            // Several views may each leave no more than the noise: then the one that takes away most counts.
            let gain = [judge.gain(&now, &reduction) - 2.0 * places.ln(), reduction.squares];
            // What other views leave is small where they take much; a sample is accused only if it disagrees with the others
            // as they were measured, too.
            let as_measured = || {
                !scanned(*subject) || judge.test(scores, &scores.reduction(patterns), family * places).p_family < SIGNIFICANCE
            };
            let stands_out = test.p_family < SIGNIFICANCE && judge.is_worth_saying(scores, test.explains) && as_measured();
            if stands_out && best.as_ref().is_none_or(|(most, _, _)| gain > *most) {
                let unit = judge.unit(&now);
                let sigmas = (0..patterns.len()).map(|i| unit * reduction.covariance[(i, i)].max(0.0).sqrt()).collect();
                // The TCP follows a displaced ball: the residual, stated ball position minus TCP, is the negative
                // displacement.
                let sign = if matches!(subject, Subject::Ball(_)) { -1.0 } else { 1.0 };
                let sizes = reduction.sizes.iter().map(|x| sign * x).collect();
                best = Some((gain, Standout { subject: *subject, test, sizes, sigmas, effects: Vec::new() }, patterns));
            }
        }
        let Some((_, finding, patterns)) = best else { break };
        now.give(&layout.given(finding.subject, patterns));
        found.push(finding);
    }
    let left = if scores.squares > 0.0 { now.squares / scores.squares } else { 0.0 };
    (found, left)
}
