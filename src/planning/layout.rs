//! The surroundings of the arm for further measurements.

use nalgebra::{Unit, Vector3};

use crate::measure::dataset::{Ball, Dataset};
use crate::measure::poses::free_poses::Facing;
use crate::measure::poses::pool::Margins;
use crate::robot::solids::{Solid, Surroundings};
use crate::units::{DEG, MM};

/// Radius of the datum balls (1 inch in diameter), m.
const BALL_RADIUS: f64 = 12.7 * MM;

/// The known part of a cell: its bodies, and the directions from which its balls can be approached.
#[derive(Debug, Clone)]
pub struct CellLayout {
    /// All surrounding bodies while balls are probed.
    pub surroundings: Surroundings,
    /// The surroundings without the artifact.
    pub without_artifact: Surroundings,
    /// For each ball, the central direction from which it can be approached, world axes.
    pub outward: Vec<Unit<Vector3<f64>>>,
    /// For each ball, the name of its body among the surroundings.
    pub bodies: Vec<String>,
    /// Margins that postures must keep.
    pub margins: Margins,
    /// Distance by which the gauge (TriCal) retreats from a ball, m.
    pub retreat: f64,
    /// Half-angle of the cone about the outward direction in which the retreat must lie, rad.
    pub cone: f64,
    /// Condition that the target faces the tracker; `None` if it may face anywhere.
    pub facing: Option<Facing>,
    /// True if more than the robot and the balls was taken into account.
    pub is_known: bool,
}

impl CellLayout {
    /// Builds the layout of a dataset, which contains only the robot and the balls; these are to be approached from
    /// above and from outside the artifact.
    ///
    /// ```
    /// use calibench::measure::dataset::{Ball, Dataset};
    /// use calibench::nalgebra::Vector3;
    /// use calibench::planning::pool::CellLayout;
    ///
    /// // Two balls side by side are approached from above and from outside, at 45 deg.
    /// let ball = |id: &str, y| Ball { id: id.into(), position: Vector3::new(0.5, y, 0.3), sigma: 0.0, free: false };
    /// let cell = Dataset { balls: vec![ball("A", 0.1), ball("B", -0.1)], ..Dataset::default() };
    /// let layout = CellLayout::of_dataset(&cell);
    /// let half = 0.5f64.sqrt();
    /// assert!((layout.outward[0].into_inner() - Vector3::new(0.0, half, half)).norm() < 1e-12);
    /// ```
    pub fn of_dataset(dataset: &Dataset) -> Self {
        let centre = dataset.balls.iter().map(|b| b.position).sum::<Vector3<f64>>() / dataset.balls.len().max(1) as f64;
        let up = Unit::try_new(-dataset.gravity, 1e-6).unwrap_or(Vector3::z_axis());
        let outward = |at: &Vector3<f64>| {
            let away = Unit::try_new(at - centre, 1.0 * MM).map_or(up.into_inner(), Unit::into_inner);
            // The two cancel for a ball straight below the centre.
            Unit::try_new(away + up.into_inner(), 0.1).unwrap_or(up)
        };
        let solid = |ball: &Ball| Solid::ball(&ball.id, ball.position, BALL_RADIUS);
        CellLayout {
            surroundings: Surroundings { fixed: dataset.balls.iter().map(solid).collect(), carried: Vec::new() },
            without_artifact: Surroundings::default(),
            outward: dataset.balls.iter().map(|b| outward(&b.position)).collect(),
            bodies: dataset.balls.iter().map(|ball| Solid::ball_name(&ball.id)).collect(),
            margins: Margins::default(),
            retreat: 60.0 * MM,
            cone: 70.0 * DEG,
            facing: None,
            is_known: false,
        }
    }

    /// Returns the layout with the balls displaced by `shift` (m). Of the artifact only the balls are included, as only
    /// their new positions are known.
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
