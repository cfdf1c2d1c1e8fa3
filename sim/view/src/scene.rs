//! Bodies as drawn by the viewer, and the static scene of the cell.

use calibench::identify::problem::Use;
use calibench::measure::dataset::{Measured, NamedDataset};
use calibench::robot::Pose;
use calibench::robot::solids::{Shape, Solid};
use nalgebra::{UnitQuaternion, Vector3};
use rerun::{Boxes3D, Capsules3D, Ellipsoids3D, FillMode, Points3D, Quaternion, Radius, RecordingStream, Transform3D};

use crate::ViewError;
use crate::paint::{self, solid};
use crate::subject::Subject;

/// Radius of a tracker point, in points of the screen.
const POINT: f32 = 1.5;

/// A point or vector in the viewer's format: single precision, 0.06 um at 1 m.
pub fn single(v: &Vector3<f64>) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}

/// A pose in the viewer's format.
pub fn transform(pose: &Pose) -> Transform3D {
    let turn = UnitQuaternion::from_rotation_matrix(&pose.rotation);
    let xyzw = [turn.i, turn.j, turn.k, turn.w].map(|x| x as f32);
    Transform3D::from_translation_rotation(single(&pose.translation.vector), Quaternion::from_xyzw(xyzw))
}

/// Appearance of a body.
#[derive(Clone, Copy)]
pub struct Looks {
    /// Colour.
    pub colour: rerun::Color,
    /// Surface, edges, or both.
    pub fill: FillMode,
}

impl Looks {
    /// A solid surface of this colour.
    pub fn solid(colour: [u8; 3]) -> Self {
        Looks { colour: solid(colour), fill: FillMode::Solid }
    }
}

/// Draws a body in the frame of the entity `parent`, as a static part.
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

/// A name as part of an entity's path, with special characters escaped.
pub fn entity(name: &str) -> String {
    rerun::EntityPathPart::new(name).escaped_string()
}

/// Draws the static scene: table, artifact, balls, tracker points.
pub fn standing(rec: &RecordingStream, subject: &Subject) -> Result<(), ViewError> {
    rec.log_static("world", &rerun::ViewCoordinates::RIGHT_HAND_Z_UP())?;
    for solid in subject.scene.iter().flat_map(|s| &s.fixed) {
        body(rec, "world/cell", solid, Looks::solid(paint::CELL))?;
    }
    let radius = calibench::cell::TriCal::PAPER.datum_radius;
    let balls = &subject.dataset.balls;
    for ball in balls {
        let sphere = Ellipsoids3D::from_centers_and_radii([single(&ball.position)], [radius as f32]);
        let sphere = sphere.with_colors([solid(paint::BALL)]).with_fill_mode(FillMode::Solid);
        rec.log_static(format!("world/balls/{}", entity(&ball.id)), &sphere)?;
    }
    names(rec, subject, "world/names of balls", 0.04)?;
    names(rec, subject, "world/residuals/names", 0.04)?;
    points(rec, subject)
}

/// Draws the points measured by the tracker, fitted and validation points: the brighter, the larger the residual.
fn points(rec: &RecordingStream, subject: &Subject) -> Result<(), ViewError> {
    let datasets = || {
        std::iter::once(NamedDataset::new(&subject.name, &subject.dataset))
            .chain(subject.validation.as_ref().map(|d| NamedDataset::new("validation", d)))
    };
    for (name, which) in [("fitted", Use::Fit), ("validation", Use::Validation)] {
        let mut seen: Vec<(Vector3<f64>, f64)> = Vec::new();
        for named in datasets() {
            let taken: Vec<&Measured> = named.dataset.samples.iter().filter(|s| which.takes(s)).map(|s| &s.measured).collect();
            if !taken.iter().any(|m| matches!(m, Measured::Point(_))) {
                continue;
            }
            let left = subject.calibration.predict(&[named], which).map_err(|e| subject.locate(e))?.residuals;
            seen.extend(taken.iter().zip(&left).filter_map(|(measured, left)| match measured {
                Measured::Point(point) => Some((*point, left.norm())),
                Measured::Ball { .. } | Measured::Distance { .. } => None,
            }));
        }
        let most = seen.iter().map(|(_, left)| *left).fold(f64::MIN_POSITIVE, f64::max);
        if !seen.is_empty() {
            let colours = seen.iter().map(|(_, left)| paint::dim(paint::BEFORE, 0.2 + 0.8 * (left / most) as f32));
            let points = Points3D::new(seen.iter().map(|(point, _)| single(point))).with_colors(colours);
            rec.log_static(format!("world/tracker points/{name}"), &points.with_radii([Radius::new_ui_points(POINT)]))?;
        }
    }
    Ok(())
}

/// Writes the names of the balls, at this height (m) above them.
fn names(rec: &RecordingStream, subject: &Subject, path: &str, above: f64) -> Result<(), ViewError> {
    let balls = &subject.dataset.balls;
    let places = balls.iter().map(|b| single(&(b.position + Vector3::z() * above)));
    let names = Points3D::new(places).with_radii([0.0]).with_colors([solid(paint::BALL)]);
    rec.log_static(path, &names.with_labels(balls.iter().map(|b| format!("ball {}", b.id))).with_show_labels(true))?;
    Ok(())
}
