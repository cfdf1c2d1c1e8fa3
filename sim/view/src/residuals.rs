//! Residual arrows, before and after every step by which the error falls.

use calibench::units::MM;
use rerun::{Arrows3D, Points3D, RecordingStream};

use crate::ViewError;
use crate::paint::{self, solid};
use crate::scene::single;
use crate::steps::{Left, Residual};

/// Length of the longest arrow of a step, m: a third of what lies between two balls.
const LONGEST: f64 = 0.15;

/// Radius of the dot that stands for a ball or point, m: a whole ball would hide what is left after a step.
const TARGET: f32 = 0.002;

/// One step as it is shown.
pub struct Shown {
    /// Entity that holds its two sets of arrows.
    pub path: String,
    /// What a reader is told: the models, the fall of the error, the magnification.
    pub title: String,
}

/// Draws the arrows of every step, and says how.
pub fn arrows(rec: &RecordingStream, steps: &[Left]) -> Result<Vec<Shown>, ViewError> {
    let mut targets: Vec<[f32; 3]> = steps.iter().take(1).flat_map(|left| &left.residuals).map(|r| single(&r.at)).collect();
    targets.dedup();
    let targets = Points3D::new(targets).with_radii([TARGET]).with_colors([solid(paint::BALL)]);
    rec.log_static("world/residuals/targets", &targets)?;
    let mut shown = Vec::new();
    for (k, pair) in steps.windows(2).enumerate() {
        let [before, after] = pair else { continue };
        let scale = round(LONGEST / before.longest().max(f64::MIN_POSITIVE));
        let path = format!("world/residuals/step {}", k + 1);
        for (name, left, colour, radius) in [("before", before, paint::BEFORE, 0.0015), ("after", after, paint::AFTER, 0.004)] {
            let arrow = |r: &Residual| single(&(r.residual * scale));
            let arrows = Arrows3D::from_vectors(left.residuals.iter().map(arrow))
                .with_origins(left.residuals.iter().map(|r| single(&r.at)))
                .with_radii([radius as f32])
                .with_colors([solid(colour)]);
            rec.log_static(format!("{path}/{name}"), &arrows)?;
        }
        let title = format!("{}: {:.3} to {:.3} mm (x{scale:.0})", after.name, before.rms / MM, after.rms / MM);
        shown.push(Shown { path, title });
    }
    Ok(shown)
}

/// Rounded down to one leading digit of 1, 2 or 5.
fn round(scale: f64) -> f64 {
    let ten = 10f64.powf(scale.log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|lead| lead * ten).find(|&x| x <= scale).unwrap_or(ten)
}

#[cfg(test)]
mod tests {
    #[test]
    fn magnifications_are_round() {
        // Powers of ten are rounded.
        let near = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-12, "{a} {b}");
        near(super::round(23.4), 20.0);
        near(super::round(1999.0), 1000.0);
        near(super::round(0.7), 0.5);
    }
}
