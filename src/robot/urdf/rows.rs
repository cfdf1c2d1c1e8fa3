//! MDH rows with Hayati's beta for a chain of axes.

use nalgebra::{Rotation3, Translation3, Unit, Vector3};

use crate::robot::{JointKind, MdhLink, NEARLY_PARALLEL, Pose};

/// Numbers below this are the rounding of a conversion, m and rad.
const ROUNDING: f64 = 1e-14;

/// Sine of the angle between axes above which the foot of their common normal is near, within twice their distance.
const SQUARE: f64 = 0.5;

/// An axis at joint position zero, in the base link.
#[derive(Debug, Clone, Copy)]
pub(super) struct AxisLine {
    /// A point on it, m.
    pub point: Vector3<f64>,
    pub direction: Unit<Vector3<f64>>,
    pub kind: JointKind,
}

impl AxisLine {
    /// The axis of the joint after `frame`. Where a prismatic one slides along does not matter, so one that is far from square to
    /// the axis of the frame, and whose common normal may be far away, passes through its origin.
    fn after(self, frame: &Pose) -> Self {
        let is_square = z(frame).cross(&self.direction).norm() > SQUARE;
        match self.kind {
            JointKind::Prismatic if !is_square => AxisLine { point: frame.translation.vector, ..self },
            _ => self,
        }
    }
}

/// The rows of a chain of axes.
pub(super) struct ChainRows {
    /// First frame of the chain in the base link.
    pub root: Pose,
    pub rows: Vec<MdhLink>,
    /// Frames of the rows at joint position zero, in the base link.
    pub frames: Vec<Pose>,
}

impl ChainRows {
    /// Converts axes to rows. `tip` is the tool link at joint position zero: the last frame coincides with it where a row can
    /// do that.
    ///
    /// Angle and length of a row follow from the common normal of two axes; of nearly parallel ones, whose common normal may
    /// be metres away, from the plane that is perpendicular to the first.
    pub fn of(axes: &[AxisLine], tip: &Pose) -> Self {
        let Some(first) = axes.first() else {
            return ChainRows { root: Pose::identity(), rows: Vec::new(), frames: Vec::new() };
        };
        let root = root(first);
        let mut rows: Vec<MdhLink> = axes.iter().map(|axis| MdhLink { kind: axis.kind, ..MdhLink::default() }).collect();
        let mut frames = Vec::with_capacity(axes.len());
        // The frame of row i before its theta and d, which depend on the next axis.
        let mut before = root;
        for i in 0..axes.len() {
            let next = axes.get(i + 1).map(|next| next.after(&before));
            let (theta, d) = match &next {
                Some(next) => toward(&before, next),
                None => onto(&before, tip),
            };
            (rows[i].theta, rows[i].d) = (theta, d);
            let frame = before * MdhLink { theta, d, ..MdhLink::default() }.transform(0.0);
            if let Some(next) = &next {
                let MdhLink { alpha, a, beta, .. } = across(&frame, next);
                (rows[i + 1].alpha, rows[i + 1].a, rows[i + 1].beta) = (alpha, a, beta);
                before = frame * MdhLink { alpha, a, beta, ..MdhLink::default() }.transform(0.0);
            }
            frames.push(frame);
        }
        ChainRows { root, rows, frames }
    }
}

/// The first frame: its z axis is the first joint's, its origin the point of that axis closest to the base link.
fn root(first: &AxisLine) -> Pose {
    let z = first.direction;
    let o = first.point - z.into_inner() * first.point.dot(&z);
    let across = |v: Vector3<f64>| Unit::try_new(v - z.into_inner() * v.dot(&z), 0.1);
    let x = across(Vector3::x()).or_else(|| across(Vector3::y())).unwrap_or(Vector3::x_axis());
    let axes = nalgebra::Matrix3::from_columns(&[x.into_inner(), z.cross(&x), z.into_inner()]);
    let o = o.map(whole);
    if (axes - nalgebra::Matrix3::identity()).amax() < ROUNDING {
        return Pose::from_parts(Translation3::from(o), Rotation3::identity());
    }
    Pose::from_parts(
        Translation3::from(o),
        Rotation3::from_matrix_eps(&axes, 1e-16, 20, Rotation3::from_matrix_unchecked(axes)),
    )
}

/// True if the axis and the frame's z axis are nearly parallel or opposite.
fn nearly_parallel(frame: &Pose, next: &AxisLine) -> bool {
    z(frame).cross(&next.direction).norm() < NEARLY_PARALLEL.sin()
}

/// theta and d that bring the x axis of a frame onto the common normal with the next axis or, of a nearly parallel one, toward
/// the point where it crosses the frame's xy plane.
fn toward(frame: &Pose, next: &AxisLine) -> (f64, f64) {
    let o = frame.translation.vector;
    let z = z(frame);
    if nearly_parallel(frame, next) {
        let to = crossing(frame, next) - o;
        return if to.norm() > ROUNDING { (about_z_either_way(frame, &to), 0.0) } else { (0.0, 0.0) };
    }
    // Foot of the common normal on the frame's z axis, and its direction.
    let n = z.cross(&next.direction);
    let between = next.point - o;
    let d = between.cross(&next.direction).dot(&n) / n.norm_squared();
    (about_z_either_way(frame, &n), whole(d))
}

/// alpha, a and beta from a frame whose x axis leads to the next axis.
fn across(frame: &Pose, next: &AxisLine) -> MdhLink {
    let inside = frame.rotation.inverse() * next.direction;
    let to = frame.inverse() * nalgebra::Point3::from(next.point);
    if nearly_parallel(frame, next) {
        // The direction is (sin beta, -sin alpha cos beta, cos alpha cos beta).
        let a = (frame.inverse() * nalgebra::Point3::from(crossing(frame, next))).x;
        let beta = inside.x.atan2(inside.y.hypot(inside.z));
        return MdhLink { alpha: whole((-inside.y).atan2(inside.z)), a: whole(a), beta: whole(beta), ..MdhLink::default() };
    }
    // The direction is (0, -sin alpha, cos alpha), and the axis crosses the x axis.
    MdhLink { alpha: whole((-inside.y).atan2(inside.z)), a: whole(to.x - to_along(&to.coords, &inside)), ..MdhLink::default() }
}

/// x component of the way from the x axis to a point along an axis that crosses it.
fn to_along(point: &Vector3<f64>, direction: &Vector3<f64>) -> f64 {
    direction.x * (point.y * direction.y + point.z * direction.z) / (direction.y.powi(2) + direction.z.powi(2))
}

/// The point where an axis crosses the xy plane of a frame.
fn crossing(frame: &Pose, next: &AxisLine) -> Vector3<f64> {
    let z = z(frame);
    let along = (frame.translation.vector - next.point).dot(&z) / next.direction.dot(&z);
    next.point + next.direction.into_inner() * along
}

/// theta and d that bring a frame onto the tool link, if that only takes a screw along z.
fn onto(frame: &Pose, tip: &Pose) -> (f64, f64) {
    let apart = frame.inverse() * tip;
    let o = apart.translation.vector;
    let is_screw = o.xy().norm() < 1e-9 && (apart.rotation * Vector3::z() - Vector3::z()).norm() < 1e-9;
    if is_screw { (whole(about_z(frame, &(tip.rotation * Vector3::x()))), whole(o.z)) } else { (0.0, 0.0) }
}

fn z(frame: &Pose) -> Vector3<f64> {
    frame.rotation * Vector3::z()
}

/// Angle about the z axis of a frame from its x axis to a direction, rad.
fn about_z(frame: &Pose, direction: &Vector3<f64>) -> f64 {
    let inside = frame.rotation.inverse() * direction;
    whole(inside.y.atan2(inside.x))
}

/// The same to a direction or its opposite, whichever is closer: a length may be negative, as in published tables.
fn about_z_either_way(frame: &Pose, direction: &Vector3<f64>) -> f64 {
    let angle = about_z(frame, direction);
    if angle.cos() < -ROUNDING { about_z(frame, &-direction) } else { angle }
}

/// The number, or zero if it is only rounding.
fn whole(v: f64) -> f64 {
    if v.abs() < ROUNDING { 0.0 } else { v }
}
