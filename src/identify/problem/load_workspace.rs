//! Workspace for computing the gravity loads of samples.

use nalgebra::Vector3;

use super::batch::{BATCH, Batch};
use crate::robot::Robot;
use crate::robot::statics::{Loads, LoadsBatch, Payload, Weights};

/// Workspace for the loads of a batch of samples.
pub(in crate::identify) struct LoadWorkspace {
    pub(super) batch: Batch,
    pub(super) weights: Weights<BATCH>,
    pub(super) all: LoadsBatch<BATCH>,
    pub(super) loads: Loads,
}

impl LoadWorkspace {
    pub(in crate::identify) fn new(robot: &Robot) -> Self {
        LoadWorkspace {
            batch: Batch::new(robot),
            weights: Weights::of(&Payload::none(), &Vector3::zeros()),
            all: LoadsBatch::new(robot.joints()),
            loads: Loads::new(robot.joints()),
        }
    }
}
