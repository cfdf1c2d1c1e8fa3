//! Numbers of a position, and what they stand for.

use std::ops::Range;

/// A number and its place in the file.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Number {
    pub at: Range<usize>,
    pub value: f64,
}

/// Numbers of a position, in the order in which the controller writes them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Layout {
    /// X, Y, Z (mm), A, B, C (deg): `Rz(A) Ry(B) Rx(C)`.
    KukaFrame,
    /// x, y, z (m) and a rotation vector (rad).
    UrPose,
    /// x, y, z (mm) and a quaternion, the scalar first.
    AbbTarget,
    /// X, Y, Z (mm), W, P, R (deg): `Rz(R) Ry(P) Rx(W)`.
    FanucPose,
    /// x, y, z (mm), rx, ry, rz (deg) of VAL 3: `Rx(rx) Ry(ry) Rz(rz)`.
    ValPose,
    /// Joint angles of VAL 3, deg.
    ValJoints,
    /// Joint angles, deg.
    Degrees,
    /// Joint angles, rad.
    Radians,
}

impl Layout {
    /// The keys of the numbers that a program may leave out where they are zero; none for most dialects.
    pub fn keys(self) -> &'static [&'static str] {
        match self {
            Layout::ValPose => &["x", "y", "z", "rx", "ry", "rz"],
            Layout::ValJoints => &["j1", "j2", "j3", "j4", "j5", "j6"],
            _ => &[],
        }
    }
}

/// Posture that a program states for a pose.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Configuration {
    /// Nothing.
    Any,
    /// Something that cannot be understood.
    Unreadable,
    /// Joints (rad) near which the controller looks for the posture.
    Near(Vec<f64>),
    /// KUKA's status and turn.
    Kuka { status: Option<Number>, turn: Option<Number> },
    /// ABB's cf1, cf4, cf6, cfx.
    Abb([Number; 4]),
    /// Yaskawa's RCONF: no-flip, lower arm, rear, and R, T, S beyond half a turn.
    Yaskawa { no_flip: bool, lower: bool, back: bool, beyond: [bool; 3] },
    /// VAL 3's shoulder, elbow and wrist: righty, positive; none where a program leaves it open.
    Val3 { righty: Option<bool>, elbow: Option<bool>, wrist: Option<bool> },
    /// FANUC's CONFIG.
    Fanuc { flip: bool, down: bool, back: bool, turns: [Number; 3] },
}
