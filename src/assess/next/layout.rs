//! What stands around the arm when more is to be measured.

use nalgebra::{Unit, Vector3};

use crate::measure::{Ball, Dataset, Facing, Margins};
use crate::robot::{Solid, Surroundings};
use crate::units::{DEG, MM};

/// Radius of the balls, 1 inch across, m.
const BALL_RADIUS: f64 = 12.7 * MM;

/// A cell, as far as it is known: what stands in it, and from where its balls can be approached.
#[derive(Debug, Clone)]
pub struct CellLayout {
    /// All that stands around while balls are probed.
    pub surroundings: Surroundings,
    /// What is left when the artifact has been taken away.
    pub without_artifact: Surroundings,
    /// Of each ball, the middle of the directions from which it can be approached, world.
    pub outward: Vec<Unit<Vector3<f64>>>,
    /// Of each ball, the name of its body among the surroundings.
    pub bodies: Vec<String>,
    /// How far to keep from trouble.
    pub margins: Margins,
    /// How far the TriCal retreats from a ball, m.
    pub retreat: f64,
    /// Half-angle of the cone about the outward direction, rad.
    pub cone: f64,
    /// Where the reflector must look when a tracker measures; `None` for anywhere.
    pub facing: Option<Facing>,
    /// Whether anything but robot and balls was looked at.
    pub is_known: bool,
}

impl CellLayout {
    /// Of a dataset, which knows of nothing but robot and balls: these are to be approached from above and from outside the artifact.
    pub fn of_dataset(dataset: &Dataset) -> Self {
        let centre = dataset.balls.iter().map(|b| b.position).sum::<Vector3<f64>>() / dataset.balls.len().max(1) as f64;
        let up = Unit::try_new(-dataset.gravity, 1e-6).unwrap_or(Vector3::z_axis());
        let outward = |at: &Vector3<f64>| {
            let away = Unit::try_new(at - centre, 1.0 * MM).map_or(up.into_inner(), Unit::into_inner);
            // Straight below the middle the two cancel.
            Unit::try_new(away + up.into_inner(), 0.1).unwrap_or(up)
        };
        let bodies: Vec<String> = dataset.balls.iter().map(|b| format!("ball {}", b.id)).collect();
        let solid = |(b, name): (&Ball, &String)| Solid::capsule(name.as_str(), 0, [b.position, b.position], BALL_RADIUS);
        CellLayout {
            surroundings: Surroundings { fixed: dataset.balls.iter().zip(&bodies).map(solid).collect(), carried: Vec::new() },
            without_artifact: Surroundings::default(),
            outward: dataset.balls.iter().map(|b| outward(&b.position)).collect(),
            bodies,
            margins: Margins::default(),
            retreat: 60.0 * MM,
            cone: 70.0 * DEG,
            facing: None,
            is_known: false,
        }
    }

    /// With the balls `shift` (m) from where they were; of the artifact's own body only the balls are known to have come along.
    pub(super) fn shifted(&self, dataset: &Dataset, shift: &Vector3<f64>) -> Self {
        let mut layout = self.clone();
        layout.surroundings = self.without_artifact.clone();
        let ball = |(b, name): (&Ball, &String)| {
            let at = b.position + shift;
            Solid::capsule(name.as_str(), 0, [at, at], BALL_RADIUS)
        };
        layout.surroundings.fixed.extend(dataset.balls.iter().zip(&self.bodies).map(ball));
        layout
    }
}
