//! A frame in the world given by its axes and origin, single or batched.

use nalgebra::{Matrix3, Rotation3, Translation3, UnitQuaternion, Vector3};
use pulp::Simd;

use super::{FramePose, Pose};
use crate::math::simd::{Axes, Group, Vector};

/// A frame as its three axes and its origin, in the world.
///
/// ```
/// use std::f64::consts::FRAC_PI_2;
///
/// use calibench::nalgebra::Vector3;
/// use calibench::robot::{Frame, FramePose};
///
/// // Turned by a quarter about z: its x axis points along the world's y.
/// let frame = Frame::from_pose(&FramePose { xyz: [1.0, 0.0, 0.0], rz_ry_rx: [FRAC_PI_2, 0.0, 0.0] }.pose());
/// assert!((frame.point(&Vector3::new(2.0, 0.0, 0.0)) - Vector3::new(1.0, 2.0, 0.0)).norm() < 1e-15);
/// assert!((frame.components(&Vector3::y()) - Vector3::x()).norm() < 1e-15);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Unit vector of the x axis.
    pub x: Vector3<f64>,
    /// Unit vector of the y axis.
    pub y: Vector3<f64>,
    /// Unit vector of the z axis.
    pub z: Vector3<f64>,
    /// Origin, m.
    pub o: Vector3<f64>,
}

impl Frame {
    /// The world frame.
    pub fn identity() -> Self {
        Frame { x: Vector3::x(), y: Vector3::y(), z: Vector3::z(), o: Vector3::zeros() }
    }

    /// The frame of a transform.
    pub fn from_pose(pose: &Pose) -> Self {
        let r = pose.rotation.matrix();
        Frame {
            x: r.column(0).into_owned(),
            y: r.column(1).into_owned(),
            z: r.column(2).into_owned(),
            o: pose.translation.vector,
        }
    }

    /// The transform from this frame to the world.
    pub fn pose(&self) -> Pose {
        let r = Matrix3::from_columns(&[self.x, self.y, self.z]);
        Pose::from_parts(Translation3::from(self.o), Rotation3::from_matrix_unchecked(r))
    }

    /// World coordinates of a point given in this frame.
    #[inline]
    pub fn point(&self, p: &Vector3<f64>) -> Vector3<f64> {
        self.o + self.direction(p)
    }

    /// World components of a vector given in this frame.
    #[inline]
    pub fn direction(&self, v: &Vector3<f64>) -> Vector3<f64> {
        self.x * v.x + self.y * v.y + self.z * v.z
    }

    /// Components in this frame of a vector given in the world.
    #[inline]
    pub fn components(&self, v: &Vector3<f64>) -> Vector3<f64> {
        Vector3::new(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }

    /// This frame displaced by `Tr(x, y, z) Rz Ry Rx` along its own axes.
    pub(super) fn displaced(&self, v: &[f64]) -> Frame {
        let d = FramePose { xyz: [v[0], v[1], v[2]], rz_ry_rx: [v[3], v[4], v[5]] }.pose();
        Frame::from_pose(&(self.pose() * d))
    }
}

/// Vectors of a batch of `L` postures, laid out so that a loop over the lanes fills a processor's registers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vectors<const L: usize> {
    /// x of each posture.
    pub x: [f64; L],
    /// y of each posture.
    pub y: [f64; L],
    /// z of each posture.
    pub z: [f64; L],
}

impl<const L: usize> Vectors<L> {
    /// All zero.
    pub const ZERO: Self = Vectors { x: [0.0; L], y: [0.0; L], z: [0.0; L] };

    /// The vector of one posture.
    #[inline(always)]
    pub fn at(&self, lane: usize) -> Vector3<f64> {
        Vector3::new(self.x[lane], self.y[lane], self.z[lane])
    }

    /// Replaces the vector of one posture.
    #[inline(always)]
    pub fn put(&mut self, lane: usize, v: &Vector3<f64>) {
        (self.x[lane], self.y[lane], self.z[lane]) = (v.x, v.y, v.z);
    }

    /// The vectors of a group.
    #[inline(always)]
    pub(super) fn of<S: Simd>(&self, group: Group<S>) -> Vector<S> {
        Vector { x: group.of(&self.x), y: group.of(&self.y), z: group.of(&self.z) }
    }

    /// Replaces the vectors of a group.
    #[inline(always)]
    pub(super) fn put_all<S: Simd>(&mut self, group: Group<S>, v: Vector<S>) {
        group.put(&mut self.x, v.x);
        group.put(&mut self.y, v.y);
        group.put(&mut self.z, v.z);
    }
}

/// Frames of a batch of `L` postures.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(super) struct Frames<const L: usize> {
    pub x: Vectors<L>,
    pub y: Vectors<L>,
    pub z: Vectors<L>,
    pub o: Vectors<L>,
}

impl<const L: usize> Frames<L> {
    /// The world frame in each lane.
    pub fn identity() -> Self {
        let mut frames = Frames { x: Vectors::ZERO, y: Vectors::ZERO, z: Vectors::ZERO, o: Vectors::ZERO };
        (0..L).for_each(|lane| frames.put(lane, &Frame::identity()));
        frames
    }

    /// The frame of one posture.
    #[inline(always)]
    pub fn at(&self, lane: usize) -> Frame {
        Frame { x: self.x.at(lane), y: self.y.at(lane), z: self.z.at(lane), o: self.o.at(lane) }
    }

    /// Replaces the frame of one posture.
    #[inline(always)]
    pub fn put(&mut self, lane: usize, frame: &Frame) {
        self.x.put(lane, &frame.x);
        self.y.put(lane, &frame.y);
        self.z.put(lane, &frame.z);
        self.o.put(lane, &frame.o);
    }

    /// The frames of a group.
    #[inline(always)]
    pub fn of<S: Simd>(&self, group: Group<S>) -> Axes<S> {
        Axes { x: self.x.of(group), y: self.y.of(group), z: self.z.of(group), o: self.o.of(group) }
    }

    /// Replaces the frames of a group.
    #[inline(always)]
    pub fn put_all<S: Simd>(&mut self, group: Group<S>, axes: &Axes<S>) {
        self.x.put_all(group, axes.x);
        self.y.put_all(group, axes.y);
        self.z.put_all(group, axes.z);
        self.o.put_all(group, axes.o);
    }
}
/// The rotation vector of a rotation, rad. By its quaternion: from the trace of the matrix small angles would come out with an error
/// of 1e-8 rad.
///
/// ```
/// use calibench::nalgebra::{Rotation3, Vector3};
/// use calibench::robot::rotation_vector;
///
/// let turned = Rotation3::from_axis_angle(&Vector3::z_axis(), 0.3);
/// assert!((rotation_vector(&turned) - Vector3::new(0.0, 0.0, 0.3)).norm() < 1e-15);
/// ```
pub fn rotation_vector(rotation: &Rotation3<f64>) -> Vector3<f64> {
    UnitQuaternion::from_rotation_matrix(rotation).scaled_axis()
}

/// Distance (m) and angle (rad) between two poses.
pub(crate) fn apart(a: &Pose, b: &Pose) -> (f64, f64) {
    ((b.translation.vector - a.translation.vector).norm(), angle_between(&a.rotation, &b.rotation))
}

/// Angle between two rotations, rad; of the same ones zero, where the trace of their quotient may exceed three by rounding.
pub(crate) fn angle_between(a: &Rotation3<f64>, b: &Rotation3<f64>) -> f64 {
    rotation_vector(&(a.inverse() * b)).norm()
}
