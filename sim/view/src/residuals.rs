//! Residual arrows, before and after every step by which the error falls.

use calibench::units::MM;
use rerun::{Arrows3D, RecordingStream, Scalars};

use crate::ViewError;
use crate::paint::{self, solid};
use crate::scene::single;
use crate::steps::{Left, Residual};

/// Length of the longest arrow of a step, m: a third of what lies between two balls.
const LONGEST: f64 = 0.12;

/// One step as it is shown.
pub struct Shown {
    /// Entity that holds its two sets of arrows.
    pub path: String,
    /// What a reader is told: the models, the fall of the error, the magnification.
    pub title: String,
}

/// Draws the arrows of every step, and says how.
pub fn arrows(rec: &RecordingStream, steps: &[Left]) -> Result<Vec<Shown>, ViewError> {
    let mut shown = Vec::new();
    for (k, pair) in steps.windows(2).enumerate() {
        let [before, after] = pair else { continue };
        let scale = round(LONGEST / before.longest().max(f64::MIN_POSITIVE));
        let path = format!("world/residuals/step {}", k + 1);
        for (name, left, colour, radius) in [("before", before, paint::BEFORE, 0.0006), ("after", after, paint::AFTER, 0.0012)]
        {
            let arrow = |r: &Residual| single(&(r.residual * scale));
            let arrows = Arrows3D::from_vectors(left.residuals.iter().map(arrow))
                .with_origins(left.residuals.iter().map(|r| single(&r.at)))
                .with_radii([radius as f32])
                .with_colors([solid(colour)]);
            rec.log_static(format!("{path}/{name}"), &arrows)?;
        }
        let title = format!(
            "residuals x{scale:.0}: {} {:.3} mm (orange), {} {:.3} mm (blue)",
            before.name,
            before.rms / MM,
            after.name,
            after.rms / MM
        );
        shown.push(Shown { path, title });
    }
    rec.reset_time();
    for (k, left) in steps.iter().enumerate() {
        rec.set_time_sequence("rung", k as i64);
        rec.log("residual/rms um", &Scalars::single(left.rms / calibench::units::UM))?;
    }
    rec.reset_time();
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
