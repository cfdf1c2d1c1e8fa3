//! What the arm is: a chain of revolute joints in modified DH with Hayati's beta, its masses, limits and solids.

mod builtin;
mod dexterity;
mod frame;
mod inverse;
mod kinematics;
mod kr6_r700;
mod lanes;
mod link;
mod panda;
mod rel_tool;
mod rigid_fit;
mod robot_file;
mod scene_file;
mod sites;
pub mod solids;
mod spherical_wrist;
mod standing;
mod statics;
mod status_turn;
mod turns;
mod ur10;
mod ur5;

pub use builtin::{BUILT_IN, built_in};
pub use dexterity::dexterity;
pub use frame::{Frame, Vectors};
pub use inverse::{Chain, InverseKinematics, Kinematics, Outcome, Solution};
pub use kinematics::{Posture, Postures, Stances, world_from_tool};
pub use link::{FramePose, Link, MdhLink, Pose};
pub(crate) use rel_tool::screw;
pub use rel_tool::{RelTool, RelToolError, rel_tool};
pub use rigid_fit::rigid_fit;
pub use robot_file::{ROBOT_FORMAT, load_robot, robot, to_toml};
pub use sites::{Axis6, MOST_JOINTS, MdhEntry, Site, SiteIndex};
pub use solids::{Clearance, ClearanceCheck, Narrowest, Shape, Solid, Surroundings, SweptCheck, clearance};
pub use spherical_wrist::{Branch, NotSphericalWrist, SphericalWrist};
pub use standing::{InLane, Standing};
pub use statics::{DEFAULT_GRAVITY, Loads, LoadsAbreast, Payload, Weights};
pub use status_turn::StatusTurn;

/// Robot files are written with nine decimals, in mm, deg and kg: so far may two copies of one arm differ, in SI.
const ROUNDING_OF_FILES: f64 = 1e-9;

/// A robot as its maker drew it: the nominal model and the facts that no calibration changes.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot {
    /// Short name, e.g. `kr6_r700`.
    pub name: String,
    /// Where its numbers come from.
    pub source: String,
    /// Links from the base to the flange.
    pub links: Vec<Link>,
    /// Motor turns per turn of the joint; empty where unknown.
    pub gear_ratios: Vec<f64>,
    /// Bodies used for clearance.
    pub solids: Vec<Solid>,
}

impl Robot {
    /// Number of joints.
    pub fn joints(&self) -> usize {
        self.links.len()
    }

    /// Whether link masses are known, without which no gravity torque can be computed.
    pub fn has_masses(&self) -> bool {
        self.links.iter().any(|l| l.mass > 0.0)
    }

    /// Whether `other` is the same arm by its numbers (joints, geometry, limits, masses), whatever either is called.
    pub fn is_same_arm(&self, other: &Robot) -> bool {
        let numbers = |l: &Link| {
            let MdhLink { alpha, a, beta, theta, d } = l.mdh;
            [alpha, a, beta, theta, d, l.limits[0], l.limits[1], l.mass, l.com.x, l.com.y, l.com.z]
        };
        let same = |a: &Link, b: &Link| numbers(a).iter().zip(numbers(b)).all(|(a, b)| (a - b).abs() <= ROUNDING_OF_FILES);
        self.joints() == other.joints() && self.links.iter().zip(&other.links).all(|(a, b)| same(a, b))
    }

    /// The first joint (counted from 0) outside its limits by more than `margin` (rad), if any.
    pub fn outside_limits(&self, q: &[f64], margin: f64) -> Option<usize> {
        self.links.iter().zip(q).position(|(l, &q)| !(l.limits[0] - margin..=l.limits[1] + margin).contains(&q))
    }
}
