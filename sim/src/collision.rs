//! Checks whether the true arm touches anything on its path, independently of the planner.
//!
//! It shares nothing with the planner: it takes the frames from the plant of the true arm, halves every motion until no
//! two bodies can meet in a part of it, and computes distances with parry's general query where balls around them meet.

use calibench::robot::solids::{Shape, Solid, Surroundings};
use calibench::robot::{Pose, Robot};
use calibench::units::MM;
use nalgebra::{Unit, UnitQuaternion, Vector3};
use parry3d_f64::bounding_volume::BoundingSphere;
use parry3d_f64::glamx::{DPose3, DQuat, DVec3};
use parry3d_f64::query;
use parry3d_f64::shape::{Ball, Capsule, Cuboid, SharedShape};

/// Motions are halved until no two bodies can approach by more than this within a half, mm.
const RESOLUTION: f64 = 1.0;

/// Largest distance from the socket's axis, m, of a ball that the gauge may touch: it is in the socket or in front of it.
const BESIDE_AXIS: f64 = 15.0 * MM;
/// Largest distance of such a ball in front of the socket's centre, along its axis, m.
const BEFORE_SOCKET: f64 = 90.0 * MM;
/// Largest distance of such a ball behind the socket's centre, along its axis, m.
const BEHIND_CENTRE: f64 = 8.0 * MM;

/// A body in the axes of its frame, mm.
struct Body {
    name: String,
    /// Index of the frame that carries the body: 0 is the base; `None` for a body fixed in the cell.
    frame: Option<usize>,
    shape: SharedShape,
    local: DPose3,
    /// Ball around the body, in the axes of `local`.
    around: BoundingSphere,
    /// Largest distance of the body from the frame's origin.
    reach: f64,
    /// Centre in the world, m, if this is a ball of the artifact.
    ball: Option<Vector3<f64>>,
    is_carried: bool,
}

impl Body {
    fn of(solid: &Solid, frame: Option<usize>, is_carried: bool) -> Self {
        let mm = |v: &Vector3<f64>| DVec3::new(v.x / MM, v.y / MM, v.z / MM);
        let (shape, local, reach, ball) = match &solid.shape {
            Shape::Capsule { ends: [a, b], radius } if a == b => {
                let ball = frame.is_none().then_some(*a);
                (SharedShape::new(Ball::new(radius / MM)), DPose3::from_translation(mm(a)), (a.norm() + radius) / MM, ball)
            }
            Shape::Capsule { ends: [a, b], radius } => {
                let shape = SharedShape::new(Capsule::new(mm(a), mm(b), radius / MM));
                (shape, DPose3::IDENTITY, (a.norm().max(b.norm()) + radius) / MM, None)
            }
            Shape::Box { centre, half_size } => {
                let shape = SharedShape::new(Cuboid::new(mm(half_size)));
                (shape, DPose3::from_translation(mm(centre)), (centre.norm() + half_size.norm()) / MM, None)
            }
        };
        let around = shape.compute_local_bounding_sphere();
        Body { name: solid.name.clone(), frame, shape, local, around, reach, ball, is_carried }
    }
}

/// A collision of two bodies, and the point of the motion at which it occurs.
#[derive(Debug, Clone, PartialEq)]
pub struct Collision {
    /// The bodies.
    pub between: [String; 2],
    /// Joints of the motors, rad.
    pub at: Vec<f64>,
}

/// Checks the motions of an arm for collisions.
pub struct CollisionCheck {
    bodies: Vec<Body>,
    pairs: Vec<[usize; 2]>,
    socket: Unit<Vector3<f64>>,
}

/// Returns the true frames of base and links, and of the tool, with the motors at the given angles.
pub type Frames<'a> = dyn FnMut(&[f64]) -> (Vec<Pose>, Pose) + 'a;

impl CollisionCheck {
    /// The check for an arm in its surroundings; `socket` is the direction of the opening in the axes of the tool.
    pub fn new(robot: &Robot, surroundings: &Surroundings, socket: Unit<Vector3<f64>>) -> Self {
        let mut bodies: Vec<Body> = robot.solids.iter().map(|s| Body::of(s, Some(s.frame), false)).collect();
        bodies.extend(surroundings.carried.iter().map(|s| Body::of(s, Some(robot.joints()), true)));
        bodies.extend(surroundings.fixed.iter().map(|s| Body::of(s, None, false)));
        let meets = |a: &Body, b: &Body| match (a.frame, b.frame) {
            // Neighbours touch at their joint, and the base is bolted to fixed bodies.
            (Some(a), Some(b)) => a.abs_diff(b) > 1,
            (Some(frame), None) | (None, Some(frame)) => frame > 0,
            (None, None) => false,
        };
        let pairs = (0..bodies.len())
            .flat_map(|i| (i + 1..bodies.len()).map(move |j| [i, j]))
            .filter(|&[i, j]| meets(&bodies[i], &bodies[j]))
            .collect();
        CollisionCheck { bodies, pairs, socket }
    }

    /// Returns the first collision found on the motion of the motors from `from` to `to` (rad).
    pub fn first(&self, from: &[f64], to: &[f64], frames: &mut Frames<'_>) -> Option<Collision> {
        self.within(from, to, &self.pairs, frames)
    }

    fn within(&self, from: &[f64], to: &[f64], pairs: &[[usize; 2]], frames: &mut Frames<'_>) -> Option<Collision> {
        let middle: Vec<f64> = from.iter().zip(to).map(|(a, b)| 0.5 * (a + b)).collect();
        let (links, tool) = frames(&middle);
        let placed: Vec<DPose3> = self
            .bodies
            .iter()
            .map(|body| body.frame.and_then(|f| links.get(f)).map_or(body.local, |frame| placed(frame) * body.local))
            .collect();
        // Distances between the origins of successive links, mm: a body is not further from a joint than the sum of
        // those between, plus its reach.
        let lengths: Vec<f64> =
            links.windows(2).map(|l| (l[1].translation.vector - l[0].translation.vector).norm() / MM).collect();
        let travels = |body: &Body| -> f64 {
            let Some(frame) = body.frame else { return 0.0 };
            (0..frame.min(from.len()))
                .map(|j| {
                    0.5 * (to[j] - from[j]).abs()
                        * (lengths[(j + 1).min(lengths.len())..frame].iter().sum::<f64>() + body.reach)
                })
                .sum()
        };
        let travel: Vec<f64> = self.bodies.iter().map(travels).collect();
        let around = |i: usize| self.bodies[i].around.transform_by(&placed[i]);
        let around: Vec<BoundingSphere> = (0..placed.len()).map(around).collect();
        let mut open = Vec::new();
        let mut furthest: f64 = 0.0;
        for &[i, j] in pairs {
            let bound = travel[i] + travel[j];
            if self.is_seated(i, j, &tool) {
                open.push([i, j]);
                furthest = furthest.max(bound);
                continue;
            }
            // Most pairs are so far apart that their balls are.
            let (ball, other) = (&around[i], &around[j]);
            if (ball.center - other.center).length() - ball.radius - other.radius > bound {
                continue;
            }
            // `map_or` covers shapes that parry cannot compare; there are none among these.
            let (a, b) = (&self.bodies[i], &self.bodies[j]);
            let gap = query::distance(&placed[i], a.shape.as_ref(), &placed[j], b.shape.as_ref()).map_or(0.0, |d| d.distance);
            if gap <= 0.0 {
                return Some(Collision { between: [a.name.clone(), b.name.clone()], at: middle });
            }
            if gap <= bound {
                open.push([i, j]);
                furthest = furthest.max(bound);
            }
        }
        if furthest <= RESOLUTION {
            return None;
        }
        self.within(from, &middle, &open, frames).or_else(|| self.within(&middle, to, &open, frames))
    }

    /// True if one is a ball in the socket of the other, or straight in front of it.
    fn is_seated(&self, i: usize, j: usize, tool: &Pose) -> bool {
        let (a, b) = (&self.bodies[i], &self.bodies[j]);
        let Some(ball) = (if a.is_carried { b.ball } else { None }) else { return false };
        let seen = tool.inverse_transform_point(&ball.into()).coords;
        let out = seen.dot(&self.socket);
        (-BEHIND_CENTRE..BEFORE_SOCKET).contains(&out) && (seen - self.socket.into_inner() * out).norm() < BESIDE_AXIS
    }
}

fn placed(frame: &Pose) -> DPose3 {
    let turn = UnitQuaternion::from_rotation_matrix(&frame.rotation);
    let at = frame.translation.vector / MM;
    DPose3::from_parts(DVec3::new(at.x, at.y, at.z), DQuat::from_xyzw(turn.i, turn.j, turn.k, turn.w))
}
