//! What stands out of a comparison.

use crate::assess::residual_views::ViewTest;

/// What a finding is about, by place in the lists of the comparison.
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
    /// Which.
    pub subject: Subject,
    /// Whether it is more than chance beyond the findings before it; the family is that of all views.
    pub test: ViewTest,
    /// What would take it away, SI: displacement of the ball (3), TCP off by (3, tool axes), motion of the base (3 m, 3 rad), bins of the
    /// curve (rad), offset of the joint (1 rad), displacement of the sample (3).
    pub sizes: Vec<f64>,
    /// One-sigma of each.
    pub sigmas: Vec<f64>,
    /// Effects of the catalogue that the model lacks and that would leave such a mark.
    pub effects: Vec<String>,
}
