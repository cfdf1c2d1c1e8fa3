//! Bodies as the viewer draws them, and what stands in the cell.

use calibench::measure::{Measured, SampleSet};
use calibench::robot::{Pose, Shape, Solid};
use nalgebra::{UnitQuaternion, Vector3};
use rerun::{Boxes3D, Capsules3D, Ellipsoids3D, FillMode, Points3D, Quaternion, RecordingStream, Transform3D};

use crate::ViewError;
use crate::paint::{self, solid};
use crate::subject::Subject;

/// Radius of a drawn tracker point, m: to be seen from across the cell, and no size of anything.
const POINT_RADIUS: f32 = 0.004;

/// A point or vector as the viewer stores it: single precision, 0.06 um at 1 m.
pub fn single(v: &Vector3<f64>) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}

/// A pose as the viewer stores it.
pub fn transform(pose: &Pose) -> Transform3D {
    let turn = UnitQuaternion::from_rotation_matrix(&pose.rotation);
    let xyzw = [turn.i, turn.j, turn.k, turn.w].map(|x| x as f32);
    Transform3D::from_translation_rotation(single(&pose.translation.vector), Quaternion::from_xyzw(xyzw))
}

/// The looks of a body.
#[derive(Clone, Copy)]
pub struct Looks {
    /// Colour.
    pub colour: rerun::Color,
    /// Surface, edges, or both.
    pub fill: FillMode,
}

impl Looks {
    /// A surface of that colour.
    pub fn solid(colour: [u8; 3]) -> Self {
        Looks { colour: solid(colour), fill: FillMode::Solid }
    }
}

/// Draws a body in the frame of the entity `parent`, once for all times.
pub fn body(rec: &RecordingStream, parent: &str, body: &Solid, looks: Looks) -> Result<(), ViewError> {
    let path = format!("{parent}/{}", entity(&body.name));
    match &body.shape {
        Shape::Capsule { ends: [a, b], radius } if (a - b).norm() == 0.0 => {
            let ball = Ellipsoids3D::from_centers_and_radii([single(a)], [*radius as f32]);
            rec.log_static(path, &ball.with_colors([looks.colour]).with_fill_mode(looks.fill))?;
        }
        Shape::Capsule { ends: [a, b], radius } => {
            let capsule = Capsules3D::from_endpoints_and_radii([single(a)], [single(b)], [*radius as f32]);
            rec.log_static(path, &capsule.with_colors([looks.colour]).with_fill_mode(looks.fill))?;
        }
        Shape::Box { centre, half_size } => {
            let cuboid = Boxes3D::from_centers_and_half_sizes([single(centre)], [single(half_size)]);
            rec.log_static(path, &cuboid.with_colors([looks.colour]).with_fill_mode(looks.fill))?;
        }
    }
    Ok(())
}

/// A name as part of an entity's path: what would mean something there is escaped.
pub fn entity(name: &str) -> String {
    rerun::EntityPathPart::new(name).escaped_string()
}

/// What does not move: table, artifact, balls, tracker points.
pub fn standing(rec: &RecordingStream, subject: &Subject) -> Result<(), ViewError> {
    rec.log_static("world", &rerun::ViewCoordinates::RIGHT_HAND_Z_UP())?;
    for solid in subject.scene.iter().flat_map(|s| &s.fixed) {
        body(rec, "world/cell", solid, Looks::solid(paint::CELL))?;
    }
    let radius = calibench::cell::TriCal::PAPER.datum_radius;
    for ball in subject.dataset.balls.iter() {
        let sphere = Ellipsoids3D::from_centers_and_radii([single(&ball.position)], [radius as f32]);
        let sphere = sphere.with_colors([solid(paint::BALL)]).with_fill_mode(FillMode::Solid).with_labels([ball.id.as_str()]);
        rec.log_static(format!("world/balls/{}", entity(&ball.id)), &sphere)?;
    }
    let sets = [("fitted", SampleSet::Fit, paint::AFTER), ("validation", SampleSet::Validation, paint::BEFORE)];
    for (name, set, colour) in sets {
        let datasets = std::iter::once(&subject.dataset).chain(&subject.validation);
        let points: Vec<[f32; 3]> = datasets
            .flat_map(|d| &d.samples)
            .filter(|s| s.set == set)
            .filter_map(|s| match &s.measured {
                Measured::Point(point) => Some(single(point)),
                Measured::Ball { .. } | Measured::Distance { .. } => None,
            })
            .collect();
        if !points.is_empty() {
            let points = Points3D::new(points).with_radii([POINT_RADIUS]).with_colors([solid(colour)]);
            rec.log_static(format!("world/tracker points/{name}"), &points)?;
        }
    }
    Ok(())
}
