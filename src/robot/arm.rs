//! The nominal robot.

use super::link::{FramePose, JointKind, Link, MdhLink};
use super::sites::{MdhEntry, Site};
use super::solids::Solid;

/// Robot files are written with nine decimals, in mm, deg and kg: two copies of one arm may differ by this, in SI.
const ROUNDING_OF_FILES: f64 = 1e-9;
/// Mass of all links together below which none is believed, kg.
pub(super) const LIGHTEST_ARM: f64 = 0.1;

/// The nominal robot: its model and the facts that no calibration changes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Robot {
    /// Short name, e.g. `kr6_r700`.
    pub name: String,
    /// Source of its data.
    pub source: String,
    /// Links from the base to the flange.
    pub links: Vec<Link>,
    /// Motor revolutions per revolution of the joint; empty if unknown.
    pub gear_ratios: Vec<f64>,
    /// Bodies used for clearance.
    pub solids: Vec<Solid>,
    /// First frame of the chain in the robot's base link, whose pose a dataset states.
    pub root: FramePose,
    /// Frame in which a dataset states its tool, in the last frame of the chain.
    pub flange: FramePose,
    /// True if nobody stated the masses of the links: they are guessed from the geometry. Gravity torques are then right in their
    /// pattern and to a factor of some two in their size, which is enough to fit compliances to them; no mass may be read off them.
    pub masses_guessed: bool,
}

impl Robot {
    /// Number of joints.
    pub fn joints(&self) -> usize {
        self.links.len()
    }

    /// True if the links have masses, [guessed](Robot::masses_guessed) or listed; without them no gravity torque can be computed.
    /// An arm that weighs grams has only masses that stand for something else, such as those of dummy links.
    pub fn has_masses(&self) -> bool {
        self.links.iter().map(|l| l.mass).sum::<f64>() >= LIGHTEST_ARM
    }

    /// True if the masses of the links are those that somebody stated.
    pub fn lists_masses(&self) -> bool {
        self.has_masses() && !self.masses_guessed
    }

    /// True if `other` is the same arm by its data (joints, geometry, limits, masses), whatever the names. Guessed masses count
    /// unless the other arm has none: the compliances of a calibration belong to the masses to which they were fitted.
    pub fn is_same_arm(&self, other: &Robot) -> bool {
        let (guessed, bare) = (self.masses_guessed || other.masses_guessed, !self.has_masses() || !other.has_masses());
        let weighed = !(guessed && bare);
        let numbers = |l: &Link| {
            let MdhLink { alpha, a, beta, theta, d, .. } = l.mdh;
            [alpha, a, beta, theta, d, l.limits[0], l.limits[1]]
        };
        let load = |l: &Link| if weighed { [l.mass, l.com.x, l.com.y, l.com.z] } else { [0.0; 4] };
        let near = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= ROUNDING_OF_FILES);
        let same = |a: &Link, b: &Link| near(&numbers(a), &numbers(b)) && near(&load(a), &load(b)) && a.mdh.kind == b.mdh.kind;
        self.joints() == other.joints() && self.links.iter().zip(&other.links).all(|(a, b)| same(a, b))
    }

    /// Kind of joint `i` (counted from 0).
    pub fn kind(&self, i: usize) -> JointKind {
        self.links.get(i).map_or(JointKind::Revolute, |link| link.mdh.kind)
    }

    /// Kinds of the joints.
    pub fn kinds(&self) -> impl ExactSizeIterator<Item = JointKind> + Clone + '_ {
        self.links.iter().map(|link| link.mdh.kind)
    }

    /// The columns of the joints' positions in files and tables: `q1_deg`, or `q1_mm` of a prismatic joint.
    pub fn joint_columns(&self) -> Vec<String> {
        self.kinds().enumerate().map(|(i, kind)| format!("q{}_{}", i + 1, kind.unit().suffix)).collect()
    }

    /// Positions of all joints in the units of their columns.
    pub fn in_columns(&self, q: &[f64]) -> Vec<f64> {
        q.iter().zip(self.kinds()).map(|(q, kind)| q / kind.unit().si).collect()
    }

    /// The first prismatic joint, counted from 0, if there is one.
    pub fn first_prismatic(&self) -> Option<usize> {
        self.kinds().position(|kind| kind == JointKind::Prismatic)
    }

    /// The site that joint `i` (counted from 0) moves: its angle, or the length of a prismatic joint.
    #[inline]
    pub fn joint_site(&self, i: usize) -> Site {
        Site::mdh(
            i,
            match self.kind(i) {
                JointKind::Revolute => MdhEntry::Theta,
                JointKind::Prismatic => MdhEntry::D,
            },
        )
    }

    /// The first joint (counted from 0) outside its limits by more than `margin` (rad and m), if any.
    ///
    /// ```
    /// use calibench::robot::built_in;
    /// use calibench::units::DEG;
    ///
    /// // KUKA's data sheet limits A1 of the KR 6 R700 to 170 deg.
    /// let robot = built_in("kr6_r700").ok_or("built in")?;
    /// let q = [171.0 * DEG, 0.0, 0.0, 0.0, 0.0, 0.0];
    /// assert_eq!(robot.outside_limits(&q, 0.0), Some(0));
    /// assert_eq!(robot.outside_limits(&q, 2.0 * DEG), None);
    /// # Ok::<(), &str>(())
    /// ```
    pub fn outside_limits(&self, q: &[f64], margin: f64) -> Option<usize> {
        self.links.iter().zip(q).position(|(l, &q)| !(l.limits[0] - margin..=l.limits[1] + margin).contains(&q))
    }
}
