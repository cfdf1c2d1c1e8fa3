//! Findings of a comparison.

use super::Comparison;
use crate::residuals::Look;
use crate::residuals::views::ViewTest;

/// Subject of a finding, with its index in the respective list of the comparison.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Subject {
    /// A ball.
    Ball(usize),
    /// The gauge or tool of a set-up.
    Tool(usize),
    /// The base of a set-up.
    World(usize),
    /// A curve of a joint.
    Curve(usize),
    /// The mean of a joint's apparent angle error.
    Offset(usize),
    /// One of the worst samples.
    Sample(usize),
}

/// A view that shows more than chance.
#[derive(Debug, Clone, PartialEq)]
pub struct Standout {
    /// Its subject.
    pub subject: Subject,
    /// Its significance beyond the findings before it; the family comprises all views.
    pub test: ViewTest,
    /// Amounts that would remove it, SI: displacement of the ball (3), error of the TCP (3, tool axes), motion of the
    /// base (3 m, 3 rad), bins of the curve (rad), offset of the joint (1 rad), displacement of the sample (3).
    pub sizes: Vec<f64>,
    /// One-sigma of each amount.
    pub sigmas: Vec<f64>,
    /// Effects of the catalogue that the model does not contain and that would show in this way.
    pub effects: Vec<String>,
}

/// A finding may mislead about another if it explains this share of what the other does.
const MISLEADS: f64 = 0.5;

impl Comparison {
    /// The finding to look at first: not the one that explains most, but the one that would mislead about the others; the
    /// stronger of two of a kind. A small one misleads about nothing, unless it is a single sample.
    pub fn first_look(&self) -> Option<&Standout> {
        let most = self.findings.iter().map(|f| f.test.explains).fold(0.0, f64::max);
        let misleads = |f: &&Standout| matches!(f.subject, Subject::Sample(_)) || f.test.explains >= MISLEADS * most;
        self.findings.iter().filter(misleads).min_by_key(|f| self.look_at(f.subject))
    }

    /// The step of the order at which a subject is met.
    pub fn look_at(&self, subject: Subject) -> Look {
        match subject {
            Subject::Sample(_) => Look::Samples,
            Subject::Curve(c) => Look::at_variable(self.joints[c].against),
            Subject::Tool(_) | Subject::World(_) => Look::SetUps,
            Subject::Ball(_) => Look::Balls,
            Subject::Offset(_) => Look::Angles,
        }
    }
}
