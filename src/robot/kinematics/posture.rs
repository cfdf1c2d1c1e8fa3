//! A single posture of the arm: the interface for callers that work on one at a time.

use nalgebra::Vector3;

use super::{BatchInput, Postures};
use crate::robot::sites::Site;
use crate::robot::{Frame, FramePose, Pose, Robot};

/// The arm in one posture.
pub type Posture = Postures<1>;

impl Posture {
    /// Moves the arm to joints `q` (N, rad or m) on `base` with TCP `tool`, deviating by `deviations` (one SI value per site,
    /// see [`SiteIndex`](crate::robot::sites::SiteIndex)).
    #[inline]
    pub fn set(&mut self, robot: &Robot, base: &FramePose, tool: &FramePose, q: &[f64], deviations: &[f64]) {
        let (base, tool) = (base.to_array().map(|x| [x]), tool.xyz.map(|x| [x]));
        let (q, deviations) = (q.as_chunks().0, deviations.as_chunks().0);
        self.set_all(robot, &BatchInput { base: &base, tool: &tool, q, deviations });
    }

    /// Turns the joints to `q` (rad or m, N) with base, tool and links as last set: only the deviations of the joints' angles
    /// may differ from those given then.
    #[inline]
    pub fn turn_to(&mut self, robot: &Robot, q: &[f64], deviations: &[f64]) {
        self.turn_all(robot, q.as_chunks().0, deviations.as_chunks().0);
    }

    /// World position of the TCP, m.
    #[inline]
    pub fn tcp(&self) -> Vector3<f64> {
        self.tcp.at(0)
    }

    /// `world_from_frame` k: 0 is the base, k the frame of link k (counted from 1).
    #[inline]
    pub fn frame(&self, k: usize) -> Frame {
        self.frame_at(0, k)
    }

    /// The last frame, which carries the flange and the tool.
    #[inline]
    pub fn flange(&self) -> Frame {
        self.frame_at(0, self.lines.len())
    }

    /// `world_from_tool`, the tool's axes rotated in the flange as given by `tool`.
    pub fn world_from_tool(&self, tool: &FramePose) -> Pose {
        self.world_from_turned(&FramePose { xyz: [0.0; 3], ..*tool }.pose())
    }

    /// `world_from_tool`, the tool's axes rotated in the flange by `turned`.
    pub fn world_from_turned(&self, turned: &Pose) -> Pose {
        Frame { o: self.tcp(), ..self.flange() }.pose() * turned
    }

    /// Axis and origin of joint `i` (counted from 0) in the world.
    #[inline]
    pub fn joint_axis(&self, i: usize) -> (Vector3<f64>, Vector3<f64>) {
        self.joint_axis_at(0, i)
    }

    /// d(TCP)/d(site), m per SI unit of the site; for a target site, d(target)/d(site) with the sign of the model side.
    ///
    /// The residual is `target - tcp`, so a target site counts negatively here.
    #[inline(always)]
    pub fn column(&self, site: Site) -> Vector3<f64> {
        self.column_at(0, site)
    }

    /// Axis in the world about which a site turns the flange, rad per SI unit of the site; zero if it only shifts it.
    pub fn turning(&self, site: Site) -> Vector3<f64> {
        self.turning_at(0, site)
    }

    /// d(TCP)/d(q) of joint `i` (counted from 0), m per rad, or per m of a prismatic joint.
    #[inline(always)]
    pub fn motion(&self, i: usize) -> Vector3<f64> {
        self.motion_at(0, i)
    }
}
