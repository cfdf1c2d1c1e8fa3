//! Bodies of the arm and the cell, and the gaps between them.
//!
//! Clearance is computed in millimetres inside this file: parry's GJK stops on absolute tolerances that cost 17 um in
//! metres and 40 nm in millimetres. Capsules, the usual body, are compared by the closed-form distance of two segments,
//! exact in either unit.

use nalgebra::Vector3;
use parry3d_f64::glamx::{DPose3, DQuat, DVec3};
use parry3d_f64::query::{self, details::closest_points_segment_segment_with_locations_nD};
use parry3d_f64::shape::{Cuboid, Segment};

use super::kinematics::Posture;
use super::{Frame, Robot};
use crate::units::MM;

pub use solid::{Shape, Solid};
use swept::FOUND_WITHIN;
pub use swept::{Narrowest, SweptCheck};

mod solid;
mod swept;

/// Bodies that the arm must not touch, besides itself.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Surroundings {
    /// Bodies fixed in the cell, in the world: table, risers, stems, balls.
    pub fixed: Vec<Solid>,
    /// Bodies on the flange, in the last frame: the TriCal, its weight disks.
    pub carried: Vec<Solid>,
}

/// The narrowest gap of a posture.
#[derive(Debug, Clone, PartialEq)]
pub struct Clearance {
    /// Gap, m; negative if bodies overlap (then it is not a depth).
    pub distance: f64,
    /// The two bodies.
    pub between: [String; 2],
}

impl Clearance {
    /// True if the bodies touch, as far as a motion's narrowest gap is known (see [`Narrowest`]).
    pub fn is_contact(&self) -> bool {
        self.distance <= FOUND_WITHIN * MM
    }
}

/// A body placed in the world, mm.
#[derive(Debug, Clone, Copy)]
struct Placed {
    centre: DVec3,
    /// Radius of a ball about `centre` that encloses the body.
    reach: f64,
    form: Form,
}

#[derive(Debug, Clone, Copy)]
enum Form {
    Capsule { ends: [DVec3; 2], radius: f64 },
    Box { pose: DPose3, cuboid: Cuboid },
}

fn millimetres(v: &Vector3<f64>) -> DVec3 {
    DVec3::new(v.x / MM, v.y / MM, v.z / MM)
}

impl Placed {
    fn new(shape: &Shape, frame: &Frame) -> Self {
        match shape {
            Shape::Capsule { ends, radius } => {
                let ends = ends.map(|end| millimetres(&frame.point(&end)));
                let radius = radius / MM;
                let centre = (ends[0] + ends[1]) * 0.5;
                Placed { centre, reach: (ends[1] - ends[0]).length() * 0.5 + radius, form: Form::Capsule { ends, radius } }
            }
            Shape::Box { centre, half_size } => {
                let centre = millimetres(&frame.point(centre));
                let cuboid = Cuboid::new(millimetres(half_size));
                let turn = nalgebra::UnitQuaternion::from_rotation_matrix(&frame.pose().rotation);
                let pose = DPose3::from_parts(centre, DQuat::from_xyzw(turn.i, turn.j, turn.k, turn.w));
                Placed { centre, reach: cuboid.half_extents.length(), form: Form::Box { pose, cuboid } }
            }
        }
    }

    /// A lower bound of the gap, mm: that of the balls around the two bodies.
    fn at_least(&self, other: &Placed) -> f64 {
        (self.centre - other.centre).length() - self.reach - other.reach
    }

    /// Gap, mm.
    fn distance(&self, other: &Placed) -> f64 {
        match (&self.form, &other.form) {
            (Form::Capsule { ends: a, radius: r }, Form::Capsule { ends: b, radius: s }) => {
                let (at_a, at_b) = closest_points_segment_segment_with_locations_nD((&a[0], &a[1]), (&b[0], &b[1]));
                let (a, b) = (Segment::new(a[0], a[1]), Segment::new(b[0], b[1]));
                (a.point_at(&at_a) - b.point_at(&at_b)).length() - r - s
            }
            (Form::Capsule { ends, radius }, Form::Box { pose, cuboid })
            | (Form::Box { pose, cuboid }, Form::Capsule { ends, radius }) => {
                let segment = Segment::new(ends[0], ends[1]);
                // Overlap is the only other outcome of the query between two convex bodies.
                query::distance(&DPose3::IDENTITY, &segment, pose, cuboid).map_or(0.0, |d| d.distance) - radius
            }
            (Form::Box { pose: p, cuboid: a }, Form::Box { pose: q, cuboid: b }) => {
                query::distance(p, a, q, b).map_or(0.0, |d| d.distance)
            }
        }
    }
}

/// Finds the narrowest gap of postures, without allocation.
#[derive(Debug, Clone)]
pub struct ClearanceCheck {
    /// Bodies of the arm, those it carries, then those fixed in the cell.
    solids: Vec<Solid>,
    placed: Vec<Placed>,
    /// Number of moving ones.
    moving: usize,
    /// Index of the first carried one.
    carried: usize,
    /// Pairs of bodies that may collide, the earlier one first.
    pairs: Vec<[usize; 2]>,
}

impl ClearanceCheck {
    /// Creates the check for this arm in these surroundings. Bodies of neighbouring frames are not compared, as they always
    /// touch at the joint, nor is the base with the bodies of the cell, to which it is bolted.
    pub fn new(robot: &Robot, surroundings: &Surroundings) -> Self {
        let last = robot.joints();
        let carried = robot.solids.len();
        let mut solids = robot.solids.clone();
        solids.extend(surroundings.carried.iter().map(|s| Solid { frame: last, ..s.clone() }));
        let moving = solids.len();
        let mut pairs = Vec::new();
        for j in 0..moving {
            pairs.extend((0..j).filter(|&i| solids[i].frame.abs_diff(solids[j].frame) > 1).map(|i| [i, j]));
        }
        let fixed = moving..moving + surroundings.fixed.len();
        pairs.extend((0..moving).filter(|&i| solids[i].frame != 0).flat_map(|i| fixed.clone().map(move |k| [i, k])));
        solids.extend(surroundings.fixed.iter().cloned());
        let placed = solids.iter().map(|s| Placed::new(&s.shape, &Frame::identity())).collect();
        ClearanceCheck { solids, placed, moving, carried, pairs }
    }

    /// The index of a fixed body among [`Surroundings::fixed`].
    pub fn fixed_named(&self, name: &str) -> Option<usize> {
        self.solids[self.moving..].iter().position(|s| s.name == name)
    }

    /// Places the moving bodies.
    fn place(&mut self, posture: &Posture) {
        for (placed, solid) in self.placed.iter_mut().zip(&self.solids[..self.moving]) {
            *placed = Placed::new(&solid.shape, &posture.frame(solid.frame));
        }
    }

    /// A lower bound of the gap of the pair as placed, mm.
    fn at_least(&self, [i, j]: [usize; 2]) -> f64 {
        self.placed[i].at_least(&self.placed[j])
    }

    /// The gap of a pair as placed, mm.
    fn distance(&self, [i, j]: [usize; 2]) -> f64 {
        self.placed[i].distance(&self.placed[j])
    }

    /// True if no body in `posture` is within `radius` (m) of the straight line between two points of the world, m.
    pub fn is_in_sight(&mut self, posture: &Posture, ends: [Vector3<f64>; 2], radius: f64) -> bool {
        self.place(posture);
        let line = Placed::new(&Shape::Capsule { ends, radius }, &Frame::identity());
        self.placed.iter().all(|body| line.at_least(body) > 0.0 || line.distance(body) > 0.0)
    }

    fn named(&self, distance: f64, between: [usize; 2]) -> Clearance {
        Clearance { distance: distance * MM, between: between.map(|k| self.solids[k].name.clone()) }
    }

    /// The narrowest gap in `posture`; `None` if there are no two bodies to compare.
    pub fn clearance(&mut self, posture: &Posture) -> Option<Clearance> {
        self.place(posture);
        let mut best: Option<(f64, [usize; 2])> = None;
        for &pair in &self.pairs {
            let narrowest = best.map_or(f64::INFINITY, |(d, _)| d);
            if self.at_least(pair) < narrowest {
                let distance = self.distance(pair);
                if distance < narrowest {
                    best = Some((distance, pair));
                }
            }
        }
        best.map(|(distance, pair)| self.named(distance, pair))
    }

    /// True if every gap in `posture` is at least `margin` (m); carried bodies may touch the fixed body `except`.
    pub fn is_clear(&mut self, posture: &Posture, margin: f64, except: Option<usize>) -> bool {
        self.place(posture);
        let margin = margin / MM;
        let except = except.map(|k| self.moving + k);
        let may_touch = |[i, j]: [usize; 2]| Some(j) == except && i >= self.carried;
        self.pairs.iter().all(|&pair| may_touch(pair) || self.at_least(pair) >= margin || self.distance(pair) >= margin)
    }
}

/// The narrowest gap of an arm in `posture` and `surroundings`; `None` if there are no two bodies to compare.
///
/// ```
/// use calibench::nalgebra::Vector3;
/// use calibench::robot::kinematics::Posture;
/// use calibench::robot::sites::SiteIndex;
/// use calibench::robot::solids::{Solid, Surroundings, clearance};
/// use calibench::robot::{FramePose, Link, MdhLink, Robot};
///
/// // An arm that reaches 0.5 m along x, 50 mm in radius, and a post whose face is at 0.9 m.
/// let arm = Solid::capsule("arm", 1, [Vector3::zeros(), Vector3::new(0.5, 0.0, 0.0)], 0.05);
/// let post = Solid::cuboid("post", 0, Vector3::new(1.0, 0.0, 0.0), Vector3::repeat(0.1));
/// # let link = Link { mdh: MdhLink::default(), limits: [-1.0, 1.0], mass: 0.0, com: Vector3::zeros() };
/// let robot = Robot { links: vec![link], solids: vec![arm], ..Robot::default() };
/// let cell = Surroundings { fixed: vec![post], carried: Vec::new() };
/// # let mut posture = Posture::new(&robot);
/// # let nominal = vec![0.0; SiteIndex::new(1).len()];
/// # posture.set(&robot, &FramePose::default(), &FramePose::default(), &[0.0], &nominal);
/// let gap = clearance(&robot, &posture, &cell).ok_or("two bodies")?;
/// assert!((gap.distance - 0.35).abs() < 1e-6);
/// # Ok::<(), &str>(())
/// ```
pub fn clearance(robot: &Robot, posture: &Posture, surroundings: &Surroundings) -> Option<Clearance> {
    ClearanceCheck::new(robot, surroundings).clearance(posture)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::robot::sites::SiteIndex;
    use crate::robot::{FramePose, Link, MdhLink};

    /// parry's GJK in millimetres is accurate to 40 nm; everything else here is closed form.
    const TOLERANCE: f64 = 0.1e-6;

    /// Three joints in a row along x, one metre apart, all about z.
    fn planar_arm(solids: Vec<Solid>) -> Robot {
        let link = |a| Link { mdh: MdhLink { a, ..MdhLink::default() }, limits: [-3.0, 3.0], mass: 0.0, com: Vector3::zeros() };
        Robot {
            name: "planar".into(),
            source: String::new(),
            links: vec![link(0.0), link(1.0), link(1.0)],
            solids,
            ..Robot::default()
        }
    }

    fn posture(robot: &Robot, q: &[f64]) -> Posture {
        let mut posture = Posture::new(robot);
        let none = vec![0.0; SiteIndex::new(robot.joints()).len()];
        posture.set(robot, &FramePose::default(), &FramePose::default(), q, &none);
        posture
    }

    fn along_x(name: &str, frame: usize, length: f64, radius: f64) -> Solid {
        Solid::capsule(name, frame, [Vector3::zeros(), Vector3::new(length, 0.0, 0.0)], radius)
    }

    #[test]
    fn links_meet_when_the_arm_folds() {
        let robot = planar_arm(vec![along_x("first", 1, 0.5, 0.05), along_x("third", 3, 0.5, 0.05)]);
        // Straight: from (0.5, 0) to (2, 0), minus two radii.
        let straight = clearance(&robot, &posture(&robot, &[0.3, 0.0, 0.0]), &Surroundings::default()).unwrap();
        assert!((straight.distance - 1.4).abs() < TOLERANCE, "{straight:?}");
        assert_eq!(straight.between, ["first".to_owned(), "third".to_owned()]);
        // Three sides of a square: the third lies a metre from the first, antiparallel.
        let square = clearance(&robot, &posture(&robot, &[0.0, FRAC_PI_2, FRAC_PI_2]), &Surroundings::default()).unwrap();
        assert!((square.distance - 0.9).abs() < TOLERANCE, "{square:?}");
        assert!(!ClearanceCheck::new(&robot, &Surroundings::default()).is_clear(&posture(&robot, &[0.0, 3.0, 3.0]), 0.0, None));
    }

    #[test]
    fn a_carried_ball_keeps_its_distance_from_a_turned_box() {
        let robot = planar_arm(vec![Solid::cuboid("plate", 1, Vector3::zeros(), Vector3::repeat(0.1))]);
        for turn in [0.0, 0.7, -2.0] {
            let straight = posture(&robot, &[turn, 0.0, 0.0]);
            let gap_of = |x: f64, y: f64| {
                let ball = Solid::capsule("ball", 0, [Vector3::new(x - 2.0, y, 0.0); 2], 0.0127);
                clearance(&robot, &straight, &Surroundings { fixed: Vec::new(), carried: vec![ball] }).unwrap().distance
            };
            assert!((gap_of(0.3, 0.0) - (0.2 - 0.0127)).abs() < TOLERANCE, "before a face");
            assert!((gap_of(0.3, 0.3) - (0.2 * 2.0f64.sqrt() - 0.0127)).abs() < TOLERANCE, "before an edge");
        }
    }

    #[test]
    fn a_line_of_sight_ends_where_anything_stands_in_it() {
        let robot = planar_arm(vec![along_x("first", 1, 0.5, 0.05), along_x("third", 3, 0.5, 0.05)]);
        let ball = Solid::capsule("ball", 0, [Vector3::new(1.0, 2.0, 0.0); 2], 0.1);
        let mut check = ClearanceCheck::new(&robot, &Surroundings { fixed: vec![ball], carried: Vec::new() });
        let (straight, folded) = (posture(&robot, &[0.0; 3]), posture(&robot, &[0.0, FRAC_PI_2, FRAC_PI_2]));
        let mut sees = |posture, x: f64, radius| {
            let ends = [Vector3::new(x, 0.2, 0.0), Vector3::new(x, 3.0, 0.0)];
            check.is_in_sight(posture, ends, radius)
        };
        assert!(sees(&straight, 0.0, 0.005) && sees(&straight, 0.89, 0.005), "beside the ball");
        assert!(!sees(&straight, 0.91, 0.005) && !sees(&straight, 0.89, 0.015) && !sees(&straight, 1.05, 0.005), "the ball");
        // The third link lies across, from x = 1 to 0.5 at y = 1.
        assert!(sees(&folded, 0.4, 0.005) && !sees(&folded, 0.46, 0.005) && !sees(&folded, 0.8, 0.005), "the arm itself");
    }

    #[test]
    fn what_stands_in_the_cell_counts_unless_excepted() {
        let robot = planar_arm(vec![along_x("third", 3, 0.5, 0.05)]);
        let surroundings = Surroundings {
            fixed: vec![
                Solid::capsule("ball", 0, [Vector3::new(2.8, 0.0, 0.0); 2], 0.0127),
                Solid::cuboid("table", 0, Vector3::new(0.0, 0.0, -1.0), Vector3::new(5.0, 5.0, 0.5)),
            ],
            carried: Vec::new(),
        };
        let at = posture(&robot, &[0.0; 3]);
        let gap = clearance(&robot, &at, &surroundings).unwrap();
        assert!((gap.distance - (0.3 - 0.05 - 0.0127)).abs() < TOLERANCE, "{gap:?}");
        let mut check = ClearanceCheck::new(&robot, &surroundings);
        assert!(check.is_clear(&at, 0.2, None) && !check.is_clear(&at, 0.3, None));
        assert!(!check.is_clear(&at, 0.3, check.fixed_named("ball")), "what is no load touches no ball");
        let carried = Surroundings { carried: vec![along_x("gauge", 0, 0.5, 0.05)], ..surroundings };
        let mut check = ClearanceCheck::new(&planar_arm(Vec::new()), &carried);
        assert!(check.is_clear(&at, 0.2, None) && !check.is_clear(&at, 0.3, None));
        assert!(check.is_clear(&at, 0.44, check.fixed_named("ball")), "the table is 0.45 m below");
        assert!(!check.is_clear(&at, 0.46, check.fixed_named("ball")));
    }
}
