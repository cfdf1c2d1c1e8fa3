//! The manufacturer's flange frame.

use std::f64::consts::PI;

use crate::robot::{FramePose, Robot};

/// The manufacturer's flange in the last MDH frame: its z axis points away from the arm.
///
/// A robot from a URDF file states it. Otherwise, if the last row has a negative d, the last axis points back into the wrist, as on KUKA's arms (paper Table 4: d_6 = -80
/// mm), and the flange is that frame rotated by 180 deg about y. Otherwise the two are the same.
///
/// ```
/// use std::f64::consts::PI;
///
/// use calibench::compensate::flange::flange_frame;
/// use calibench::robot::built_in;
///
/// assert_eq!(flange_frame(&built_in("kr6_r700").ok_or("built in")?).rz_ry_rx, [0.0, PI, 0.0]);
/// assert_eq!(flange_frame(&built_in("ur10").ok_or("built in")?).rz_ry_rx, [0.0; 3]);
/// # Ok::<(), &str>(())
/// ```
pub fn flange_frame(robot: &Robot) -> FramePose {
    if robot.flange != FramePose::default() {
        return robot.flange;
    }
    let looks_back = robot.links.last().is_some_and(|link| link.mdh.d < 0.0);
    FramePose { xyz: [0.0; 3], rz_ry_rx: [0.0, if looks_back { PI } else { 0.0 }, 0.0] }
}
