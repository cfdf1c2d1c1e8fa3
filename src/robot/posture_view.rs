//! The posed arm, alone or in a batch, as seen by the equations of effects.

use std::fmt::Debug;

use nalgebra::Vector3;

use super::Frame;
use super::kinematics::Postures;
use super::sites::Site;

/// An arm in a posture.
pub trait PostureView: Debug {
    /// `world_from_frame` k: 0 is the base, k the frame of link k (counted from 1).
    fn frame(&self, k: usize) -> Frame;

    /// The last frame, which carries the flange and the tool.
    fn flange(&self) -> Frame;

    /// Axis and origin of joint `i` (counted from 0) in the world.
    fn joint_axis(&self, i: usize) -> (Vector3<f64>, Vector3<f64>);

    /// World position of the TCP, m.
    fn tcp(&self) -> Vector3<f64>;
}

/// One posture of a batch.
#[derive(Debug, Clone, Copy)]
pub struct LanePosture<'a, const L: usize> {
    /// The batch.
    pub postures: &'a Postures<L>,
    /// Index of the posture.
    pub lane: usize,
}

impl<const L: usize> LanePosture<'_, L> {
    /// Axis about which a site turns the flange, as for a single [`Posture`](super::kinematics::Posture).
    pub fn turning(&self, site: Site) -> Vector3<f64> {
        self.postures.turning_at(self.lane, site)
    }

    /// d(TCP)/d(q) of joint `i` (counted from 0), as for a single [`Posture`](super::kinematics::Posture).
    #[inline]
    pub fn motion(&self, i: usize) -> Vector3<f64> {
        self.postures.motion_at(self.lane, i)
    }
}

impl<const L: usize> PostureView for LanePosture<'_, L> {
    fn frame(&self, k: usize) -> Frame {
        self.postures.frame_at(self.lane, k)
    }

    fn flange(&self) -> Frame {
        self.postures.frame_at(self.lane, self.postures.joints())
    }

    fn joint_axis(&self, i: usize) -> (Vector3<f64>, Vector3<f64>) {
        self.postures.joint_axis_at(self.lane, i)
    }

    fn tcp(&self) -> Vector3<f64> {
        self.postures.tcps().at(self.lane)
    }
}

impl PostureView for Postures<1> {
    fn frame(&self, k: usize) -> Frame {
        self.frame_at(0, k)
    }

    fn flange(&self) -> Frame {
        self.frame_at(0, self.joints())
    }

    fn joint_axis(&self, i: usize) -> (Vector3<f64>, Vector3<f64>) {
        self.joint_axis_at(0, i)
    }

    fn tcp(&self) -> Vector3<f64> {
        self.tcps().at(0)
    }
}
