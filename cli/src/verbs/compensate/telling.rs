//! Messages common to targets and programs.

use calibench::compensate::Compensator;
use calibench::robot::{FramePose, Pose};
use calibench::units::{DEG, MM};

use crate::terminal::failure::Failure;
use crate::terminal::output::print;

/// Number of refused targets, or of lines, printed; the file or the document lists all.
pub const MOST_TOLD: usize = 20;

/// The controller's frames, what was assumed, and what spoils the result.
pub fn tell_setting(compensator: &Compensator<'_>, assumed: &[String]) -> Result<(), Failure> {
    print(format!("controller's base  {}", words(&compensator.base_link_from_work())))?;
    print(format!("controller's tool  {}", words(&compensator.flange_from_tool())))?;
    for sentence in assumed {
        print(format!("assumed: {sentence}"))?;
    }
    if compensator.calibration().absolute_accuracy == Some(true) {
        print(
            "WARNING: the robot was measured with its controller's own absolute accuracy on; fake targets are for a controller that computes with the drawing, so switch it off and measure again.",
        )?;
    }
    Ok(())
}

fn words(pose: &Pose) -> String {
    let FramePose { xyz, rz_ry_rx } = FramePose::from_pose(pose);
    let ([x, y, z], [a, b, c]) = (xyz.map(|v| v / MM), rz_ry_rx.map(|v| v / DEG));
    // Adding zero removes the sign of a negative zero.
    let tidy = |v: f64| (v * 1e5).round() / 1e5 + 0.0;
    let [x, y, z, a, b, c] = [x, y, z, a, b, c].map(tidy);
    format!("X {x:.4}  Y {y:.4}  Z {z:.4}  A {a:.5}  B {b:.5}  C {c:.5}")
}
