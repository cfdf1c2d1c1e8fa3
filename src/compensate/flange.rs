//! The flange as its maker draws it.

use std::f64::consts::PI;

use crate::robot::{FramePose, Robot};

/// The maker's flange in the last MDH frame: its z axis points away from the arm.
///
/// Where the last line has a negative d, the last axis points back into the wrist, as on KUKA's arms (paper Table 4: d_6 = -80 mm),
/// and the flange is that frame turned by 180 deg about y. Otherwise the two are one.
pub fn flange_frame(robot: &Robot) -> FramePose {
    let looks_back = robot.links.last().is_some_and(|link| link.mdh.d < 0.0);
    FramePose { xyz: [0.0; 3], rz_ry_rx: [0.0, if looks_back { PI } else { 0.0 }, 0.0] }
}
