//! Where robot and tool were found, in the frames in which a dataset states them: for a camera, the hand-eye calibration.

use std::f64::consts::TAU;

use nalgebra::{Matrix6, Rotation3, Vector3, Vector6};

use super::{Calibration, Estimate, MeasuredSetup};
use crate::robot::{FramePose, Pose};

/// Step of each number, m and rad, by which a frame is differentiated.
const STEP: f64 = 1e-6;

/// Plain names of the numbers of a base, `Tr Rz Ry Rx`.
const BASE: [&str; 6] = ["base_x", "base_y", "base_z", "base_rz", "base_ry", "base_rx"];

/// Plain names of the numbers of a tool: its place in the last frame, and the rotation vector of the probe in it.
const TOOL: [&str; 6] = ["tool_x", "tool_y", "tool_z", "probe_rx", "probe_ry", "probe_rz"];

/// A frame of a set-up as identified.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundFrame {
    /// Label of the set-up; empty if there is one only.
    pub setup: String,
    /// True for the robot's base in the world, false for the tool in the flange.
    pub is_base: bool,
    /// The frame, as `dataset.toml` states it.
    pub frame: FramePose,
    /// One-sigma of x, y, z, m, and of the rotations about z, y, x, rad.
    pub sigma: [f64; 6],
}

impl FoundFrame {
    /// `base` or `tool`.
    pub fn name(&self) -> &'static str {
        if self.is_base { "base" } else { "tool" }
    }
}

impl Calibration {
    /// Base in the world and tool in the flange of every set-up, each with the uncertainty of what was identified of it; none where
    /// only positions were measured, which do not determine them.
    pub fn found_frames(&self) -> Vec<FoundFrame> {
        if self.rms_orientation.is_none() {
            return Vec::new();
        }
        let of = |setup: &MeasuredSetup| {
            let root = self.robot.root.inverse();
            let start = setup.base.to_array();
            let base = self.found(setup, BASE, start, |v| FramePose::from_array(v).then(&root));
            let turned = setup.tool.pose().rotation;
            let flange = self.robot.flange.inverse();
            let start = [setup.tool.xyz, [0.0; 3]].concat().try_into().unwrap_or([0.0; 6]);
            let tool = self.found(setup, TOOL, start, |[x, y, z, a, b, c]| {
                let last = Pose::from_parts(Vector3::new(x, y, z).into(), turned * Rotation3::new(Vector3::new(a, b, c)));
                flange.then(&FramePose::from_pose(&last))
            });
            let named = |is_base: bool, (frame, sigma): (FramePose, [f64; 6])| {
                let setup = if self.setups.len() > 1 { setup.label.clone() } else { String::new() };
                FoundFrame { setup, is_base, frame, sigma }
            };
            [named(true, base), named(false, tool)]
        };
        self.setups.iter().flat_map(of).collect()
    }

    /// A frame of six numbers, of which those that were not identified are as at `start`, and its uncertainty.
    fn found(
        &self,
        setup: &MeasuredSetup,
        names: [&str; 6],
        start: [f64; 6],
        frame: impl Fn([f64; 6]) -> FramePose,
    ) -> (FramePose, [f64; 6]) {
        let place = |name: &str| self.estimates.iter().position(|e: &Estimate| e.name == self.name_in(setup, name));
        let known: Vec<(usize, usize)> = (0..6).filter_map(|k| place(names[k]).map(|place| (k, place))).collect();
        let mut at = start;
        known.iter().for_each(|&(k, place)| at[k] = self.estimates[place].value);
        let mut slopes = Matrix6::<f64>::zeros();
        for &(k, _) in &known {
            let moved = |by: f64| {
                let mut moved = at;
                moved[k] += by;
                Vector6::from(frame(moved).to_array())
            };
            slopes.set_column(k, &(moved(STEP) - moved(-STEP)).map(|by| (by - TAU * (by / TAU).round()) / (2.0 * STEP)));
        }
        let mut covariance = Matrix6::<f64>::zeros();
        for &(k, p) in &known {
            for &(l, q) in &known {
                covariance[(k, l)] = self.correlation[(p, q)] * self.estimates[p].sigma * self.estimates[q].sigma;
            }
        }
        let spread = slopes * covariance * slopes.transpose();
        (frame(at), std::array::from_fn(|k| spread[(k, k)].max(0.0).sqrt()))
    }
}
