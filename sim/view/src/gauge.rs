//! The TriCal: three plungers in their channels.

use calibench::cell::TriCal;
use calibench::robot::Pose;
use calibench::units::MM;
use nalgebra::Vector3;
use rerun::{Arrows3D, Cylinders3D, FillMode, Points3D, Quaternion, RecordingStream, Transform3D};

use crate::ViewError;
use crate::paint::{self, solid};
use crate::scene::{single, transform};

/// Length of a rendered tip, m: that of an ordinary indicator.
const TIP: f64 = 3.0 * MM;
/// Length of a rendered spindle, m: that of an ordinary indicator, which the measurement does not depend on.
const SPINDLE: f64 = 36.0 * MM;
/// Radius of a rendered spindle, m: likewise.
const SPINDLE_RADIUS: f64 = 2.25 * MM;

/// Entity of the plungers' numbers: hidden where the gauge is shown small.
pub const NUMBERS: &str = "world/tool/numbers";

/// Draws the static parts of the gauge.
pub fn plungers(rec: &RecordingStream) -> Result<(), ViewError> {
    let axes = [Vector3::x(), Vector3::y(), Vector3::z()];
    // A cylinder's axis is z, and must be turned along the channel.
    let along = [
        Quaternion::from_xyzw([0.0, std::f32::consts::FRAC_1_SQRT_2, 0.0, std::f32::consts::FRAC_1_SQRT_2]),
        Quaternion::from_xyzw([-std::f32::consts::FRAC_1_SQRT_2, 0.0, 0.0, std::f32::consts::FRAC_1_SQRT_2]),
        Quaternion::IDENTITY,
    ];
    for k in 0..3 {
        let centres = [axes[k] * (TIP / 2.0), axes[k] * (TIP + SPINDLE / 2.0)];
        let plunger = Cylinders3D::from_lengths_and_radii(
            [TIP as f32, SPINDLE as f32],
            [TriCal::PAPER.tip_radius as f32, SPINDLE_RADIUS as f32],
        )
        .with_centers(centres.map(|c| single(&c)))
        .with_quaternions([along[k]; 2])
        .with_colors([solid(paint::AXES[k])])
        .with_fill_mode(FillMode::Solid);
        rec.log_static(plunger_path(k), &plunger)?;
    }
    let ends = axes.map(|axis| single(&(axis * (TriCal::PAPER.datum_radius + TIP + SPINDLE))));
    let numbers = Points3D::new(ends).with_radii([0.0]).with_colors(paint::AXES.map(solid));
    rec.log_static(NUMBERS, &numbers.with_labels(["1", "2", "3"]).with_show_labels(true))?;
    let length = 20.0 * MM;
    let arrows = Arrows3D::from_vectors(axes.map(|a| single(&(a * length)))).with_colors(paint::AXES.map(solid));
    rec.log_static("world/tool/axes", &arrows.with_radii([0.0005]))?;
    Ok(())
}

fn plunger_path(k: usize) -> String {
    format!("world/tool/plunger {}", k + 1)
}

/// Moves the gauge to a stop: the tip of each plunger touches the ball according to its reading, or is free.
pub fn show(rec: &RecordingStream, world_from_tool: &Pose, reading: Option<&Vector3<f64>>) -> Result<(), ViewError> {
    let trical = TriCal::PAPER;
    rec.log("world/tool", &transform(world_from_tool))?;
    for k in 0..3 {
        let reading = reading.map_or(trical.free_reading(), |r| r[k]);
        let tip = Vector3::ith(k, reading + trical.datum_radius);
        rec.log(plunger_path(k), &Transform3D::from_translation(single(&tip)))?;
    }
    Ok(())
}
