//! One link of the arm: its modified Denavit-Hartenberg row, its limits and its mass.

use std::f64::consts::{PI, TAU};

use nalgebra::{IsometryMatrix3, Rotation3, Translation3, Vector3};

use crate::units::{DEG, Unit};

/// A rigid transform; `world_from_tool` maps tool coordinates to world coordinates.
pub type Pose = IsometryMatrix3<f64>;

/// Axes closer to parallel than this have no usable common normal: its foot is far away and carries every error of the
/// direction. Their rows have a beta.
pub const NEARLY_PARALLEL: f64 = 1.0 * DEG;

/// Motion of a joint along or about its z axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash)]
pub enum JointKind {
    /// It turns about it; its variable is an angle, rad.
    #[default]
    Revolute,
    /// It slides along it; its variable is a length, m.
    Prismatic,
}

impl JointKind {
    /// The unit of the joint's variable in files and tables.
    pub fn unit(self) -> Unit {
        match self {
            JointKind::Revolute => Unit::DEG,
            JointKind::Prismatic => Unit::MM,
        }
    }

    /// The name in files.
    pub fn name(self) -> &'static str {
        match self {
            JointKind::Revolute => "revolute",
            JointKind::Prismatic => "prismatic",
        }
    }
}

/// Modified DH row with Hayati's beta, `T = Rx(alpha) Tx(a) Ry(beta) Rz(theta + q) Tz(d)` (paper Eq. 1); of a prismatic joint
/// `T = Rx(alpha) Tx(a) Ry(beta) Rz(theta) Tz(d + q)`.
///
/// ```
/// use std::f64::consts::FRAC_PI_2;
///
/// use calibench::nalgebra::Vector3;
/// use calibench::robot::MdhLink;
///
/// // The origin is at (a, -d sin alpha, d cos alpha), whatever the angle of the joint.
/// let row = MdhLink { alpha: FRAC_PI_2, a: 0.3, d: 0.1, ..MdhLink::default() };
/// let origin = row.transform(0.7).translation.vector;
/// assert!((origin - Vector3::new(0.3, -0.1, 0.0)).norm() < 1e-15);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MdhLink {
    /// Motion of the joint along or about its z axis.
    pub kind: JointKind,
    /// Twist about the previous x axis, rad. Written alpha_{i-1}.
    pub alpha: f64,
    /// Length along the previous x axis, m. Written a_{i-1}.
    pub a: f64,
    /// Hayati's skew about the y axis, rad; for axes that are nominally parallel. Written beta_{i-1}.
    pub beta: f64,
    /// Joint offset, rad.
    pub theta: f64,
    /// Offset along the joint's own z axis, m.
    pub d: f64,
}

impl MdhLink {
    /// The transform of this row at joint position `q` (rad, or m of a prismatic joint).
    pub fn transform(&self, q: f64) -> Pose {
        let (turned, slid) = match self.kind {
            JointKind::Revolute => (q, 0.0),
            JointKind::Prismatic => (0.0, q),
        };
        let rx = Rotation3::from_axis_angle(&Vector3::x_axis(), self.alpha);
        let ry = Rotation3::from_axis_angle(&Vector3::y_axis(), self.beta);
        let rz = Rotation3::from_axis_angle(&Vector3::z_axis(), self.theta + turned);
        let rotation = rx * ry * rz;
        let translation = rx * Vector3::new(self.a, 0.0, 0.0) + rotation * Vector3::new(0.0, 0.0, self.d + slid);
        Pose::from_parts(Translation3::from(translation), rotation)
    }
}

/// A link: geometry, joint limits, and mass with its centre in the link's own frame (kg, m).
#[derive(Debug, Clone, PartialEq)]
pub struct Link {
    /// Geometry.
    pub mdh: MdhLink,
    /// Smallest and largest joint position, rad, or m of a prismatic joint.
    pub limits: [f64; 2],
    /// Mass, kg; zero if unknown.
    pub mass: f64,
    /// Centre of mass in the link's MDH frame, m.
    pub com: Vector3<f64>,
}

impl Link {
    /// The range in which postures are drawn, rad or m: the limits, or one turn about their middle where the joint can turn
    /// twice or more. The second turn repeats every posture of the first, and an elbow cannot pass from one to the other: arm
    /// and forearm are in the way.
    ///
    /// ```
    /// use std::f64::consts::PI;
    ///
    /// use calibench::robot::built_in;
    ///
    /// let ur10 = built_in("ur10").unwrap();
    /// assert_eq!(ur10.links[2].limits, [-2.0 * PI, 2.0 * PI]);
    /// assert_eq!(ur10.links[2].drawn_range(), [-PI, PI]);
    /// ```
    pub fn drawn_range(&self) -> [f64; 2] {
        let [low, high] = self.limits;
        if self.mdh.kind == JointKind::Revolute && high - low >= 2.0 * TAU {
            let middle = 0.5 * (low + high);
            [middle - PI, middle + PI]
        } else {
            self.limits
        }
    }
}

/// Position and Rz·Ry·Rx angles of a frame, `T = Tr(x, y, z) Rz(rz) Ry(ry) Rx(rx)` (paper Eq. 2).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FramePose {
    /// Position, m.
    pub xyz: [f64; 3],
    /// Angles about z, then y, then x (KUKA's A, B, C), rad.
    pub rz_ry_rx: [f64; 3],
}

impl FramePose {
    /// The six components in the order x, y, z, rz, ry, rx.
    pub fn to_array(self) -> [f64; 6] {
        let ([x, y, z], [rz, ry, rx]) = (self.xyz, self.rz_ry_rx);
        [x, y, z, rz, ry, rx]
    }

    /// From six components in the order x, y, z, rz, ry, rx.
    pub fn from_array(v: [f64; 6]) -> Self {
        FramePose { xyz: [v[0], v[1], v[2]], rz_ry_rx: [v[3], v[4], v[5]] }
    }

    /// The transform.
    pub fn pose(&self) -> Pose {
        let [rz, ry, rx] = self.rz_ry_rx;
        Pose::from_parts(Translation3::new(self.xyz[0], self.xyz[1], self.xyz[2]), Rotation3::from_euler_angles(rx, ry, rz))
    }

    /// The frame of the product of two transforms. Exact where one of them is the identity.
    ///
    /// ```
    /// use std::f64::consts::FRAC_PI_2;
    ///
    /// use calibench::robot::FramePose;
    ///
    /// // A quarter turn about z, then 1 m along the turned x axis.
    /// let turned = FramePose { xyz: [0.0; 3], rz_ry_rx: [FRAC_PI_2, 0.0, 0.0] };
    /// let along = FramePose { xyz: [1.0, 0.0, 0.0], rz_ry_rx: [0.0; 3] };
    /// let [x, y, z] = turned.then(&along).xyz;
    /// assert!(x.abs() < 1e-15 && (y - 1.0).abs() < 1e-15 && z == 0.0);
    /// ```
    #[must_use]
    pub fn then(&self, next: &FramePose) -> FramePose {
        if *next == FramePose::default() {
            *self
        } else if *self == FramePose::default() {
            *next
        } else {
            FramePose::from_pose(&(self.pose() * next.pose()))
        }
    }

    /// The frame of the inverse transform.
    #[must_use]
    pub fn inverse(&self) -> FramePose {
        if *self == FramePose::default() { *self } else { FramePose::from_pose(&self.pose().inverse()) }
    }

    /// The frame of a transform; at gimbal lock rx is zero, as KUKA's C. Exact there as well: the rounding of one angle is
    /// compensated by the next.
    pub fn from_pose(pose: &Pose) -> Self {
        let r = pose.rotation.matrix();
        let across = r[(0, 0)].hypot(r[(1, 0)]);
        let rz = if across < LOCKED { (-r[(0, 1)]).atan2(r[(1, 1)]) } else { r[(1, 0)].atan2(r[(0, 0)]) };
        let ry = (-r[(2, 0)]).atan2(across);
        let (sin, cos) = rz.sin_cos();
        let rx = (sin * r[(0, 2)] - cos * r[(1, 2)]).atan2(cos * r[(1, 1)] - sin * r[(0, 1)]);
        let t = pose.translation.vector;
        FramePose { xyz: [t.x, t.y, t.z], rz_ry_rx: [rz, ry, rx] }
    }
}

/// Below this cosine of ry only the sum or the difference of rz and rx is defined, to rounding.
const LOCKED: f64 = 1e-13;

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    /// The error of a cosine taken as zero, and some roundings.
    const SAME: f64 = LOCKED + 2e-15;

    #[test]
    fn every_frame_comes_back_at_gimbal_lock_and_beside_it() {
        for beside in [0.0, 1e-16, 1e-12, 1e-9, 1e-6, 1e-3, 0.4] {
            for (rz, ry, rx) in [(0.3, FRAC_PI_2 - beside, -1.1), (-2.9, beside - FRAC_PI_2, 2.0), (1.2, beside, 3.1)] {
                let pose = FramePose { xyz: [0.1, -0.2, 0.3], rz_ry_rx: [rz, ry, rx] }.pose();
                let back = FramePose::from_pose(&pose);
                assert!((back.pose().to_homogeneous() - pose.to_homogeneous()).amax() < SAME, "{rz} {ry} {rx}: {back:?}");
            }
        }
        let locked = FramePose { xyz: [0.0; 3], rz_ry_rx: [0.3, FRAC_PI_2, 0.1] }.pose();
        assert!(FramePose::from_pose(&locked).rz_ry_rx[2].abs() < 1e-15, "KUKA's C is zero at B = 90");
    }
}
