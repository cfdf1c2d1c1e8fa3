//! Messages common to targets and programs.

use calibench::compensate::Compensator;
use calibench::robot::{FramePose, Pose};
use calibench::units::{DEG, MM};

use crate::terminal::failure::Failure;
use crate::terminal::output::print;

/// Number of refused targets, or of lines, printed; the file or the document lists all.
pub const MOST_TOLD: usize = 20;

/// Targets, one after another, of which the same is told.
pub struct Stretch<'t, T> {
    /// What it is.
    pub what: T,
    /// Their number.
    pub count: usize,
    first: &'t str,
    last: &'t str,
}

impl<T> Stretch<'_, T> {
    /// The first and the last, and their number.
    pub fn targets(&self) -> String {
        let Stretch { first, last, count, .. } = self;
        if *count > 1 { format!("{first} to {last} ({count})") } else { (*first).to_owned() }
    }
}

/// The stretches of a list in which `what` is the same and not `None`.
pub fn stretches<'t, T: PartialEq>(
    ids: impl Iterator<Item = &'t str>,
    what: impl Iterator<Item = Option<T>>,
) -> Vec<Stretch<'t, T>> {
    let mut found: Vec<Stretch<'t, T>> = Vec::new();
    let mut goes_on = false;
    for (id, what) in ids.zip(what) {
        let Some(what) = what else {
            goes_on = false;
            continue;
        };
        match found.last_mut().filter(|stretch| goes_on && stretch.what == what) {
            Some(stretch) => (stretch.last, stretch.count) = (id, stretch.count + 1),
            None => found.push(Stretch { what, count: 1, first: id, last: id }),
        }
        goes_on = true;
    }
    found
}

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
