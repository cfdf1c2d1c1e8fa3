//! Residual arrows, before and after every step that reduces the error, and at the end.

use calibench::units::MM;
use rerun::{Arrows3D, Points3D, RecordingStream};

use crate::ViewError;
use crate::magnification::magnification;
use crate::paint::{self, solid};
use crate::scene::single;
use crate::steps::{Left, Residual, Steps};

/// Length of the longest arrow of a step, m: a third of the distance between two balls.
const LONGEST: f64 = 0.15;

/// Radius of the dot that represents a ball or point, m: a whole ball would hide the residual after a step.
const TARGET: f32 = 0.002;

/// Radius of the arrows before a step, and of those of the last step, m.
const FINE: f32 = 0.0015;
/// Radius of the arrows after a step, m: these are short at the scale of those before, and must be visible beside them.
const BOLD: f32 = 0.004;

/// One step as displayed.
pub struct Shown {
    /// Entity of its arrows.
    pub path: String,
    /// Title displayed: the models, the reduction of the error, the magnification.
    pub title: String,
}

/// Draws the arrows of every step, and those remaining after the last step once more, enlarged to be visible; returns
/// what is shown.
pub fn arrows(rec: &RecordingStream, steps: &Steps) -> Result<Vec<Shown>, ViewError> {
    let mut targets: Vec<[f32; 3]> =
        steps.models.iter().take(1).flat_map(|left| &left.residuals).map(|r| single(&r.at)).collect();
    targets.dedup();
    let targets = Points3D::new(targets).with_radii([TARGET]).with_colors([solid(paint::BALL)]);
    rec.log_static("world/residuals/targets", &targets)?;
    let mut shown = Vec::new();
    for (k, (before, after)) in steps.pairs().enumerate() {
        let scale = magnification(before.longest(), LONGEST);
        let path = format!("world/residuals/step {}", k + 1);
        rec.log_static(format!("{path}/before"), &residual_arrows(before, scale, paint::BEFORE).with_radii([FINE]))?;
        rec.log_static(format!("{path}/after"), &residual_arrows(after, scale, paint::AFTER).with_radii([BOLD]))?;
        let title = format!("{}: {:.3} to {:.3} mm (arrows x{scale})", after.name, before.rms / MM, after.rms / MM);
        shown.push(Shown { path, title });
    }
    if let Some(last) = steps.models.last() {
        let (path, scale) = ("world/residuals/left".to_owned(), magnification(last.longest(), LONGEST));
        rec.log_static(path.as_str(), &residual_arrows(last, scale, paint::AFTER).with_radii([FINE]))?;
        shown.push(Shown { path, title: format!("Residual: {:.4} mm (arrows x{scale})", last.rms / MM) });
    }
    Ok(shown)
}

/// The residuals as arrows, magnified by `scale`.
fn residual_arrows(left: &Left, scale: f64, colour: [u8; 3]) -> Arrows3D {
    let arrow = |r: &Residual| single(&(r.residual * scale));
    Arrows3D::from_vectors(left.residuals.iter().map(arrow))
        .with_origins(left.residuals.iter().map(|r| single(&r.at)))
        .with_colors([solid(colour)])
}
