//! A pose of the plan: where a ball is probed, and how the arm gets there.

use serde::Serialize;

use crate::measure::dataset::{Measured, Sample};

/// A pose at which a ball is to be probed, or a point measured.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlannedPose {
    /// Unique name, also that of the sample.
    pub id: String,
    /// The ball, by its index in the artifact; `None` where a point is measured.
    pub ball: Option<usize>,
    /// The payload, by its index in the dataset.
    pub payload: usize,
    /// Joints at which it is measured: where the nominal robot has its TCP on the ball, rad (N).
    pub contact: Vec<f64>,
    /// Joints at the end of the straight retreat along the approach, clear of the ball, rad (N); where a point is measured, the
    /// same.
    pub approach: Vec<f64>,
    /// Probed only in place of a pose on the same ball that failed.
    pub reserve: bool,
    /// Name of an earlier pose: every joint is to arrive finally in the direction opposite to that of its sample.
    pub reverses: Option<String>,
    /// Joints through which the arm moves from the approach of the preceding pose of the plan, rad; for the first pose of a
    /// payload, and for a reserve, from home. Empty if it moves directly.
    pub via: Vec<Vec<f64>>,
    /// The least gap on that path and on the approach, m, if known.
    pub clearance: Option<f64>,
}

impl PlannedPose {
    /// The sample that a nominal robot would give: its ball centred, without a reading; `None` where a point is measured.
    pub fn nominal_sample(&self) -> Option<Sample> {
        let measured = Measured::Ball { ball: self.ball?, reading: None };
        Some(Sample { payload: self.payload, ..Sample::new(self.id.clone(), self.contact.clone(), measured) })
    }
}
