//! `calibench-compensation/1`, printed by `compensate`.

use calibench::robot::{FramePose, Pose};
use calibench::units::{DEG, MM};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{OutsideRange, format_tag};

format_tag!(CompensationFormat, "calibench-compensation/1");

/// A frame: `Tr(x, y, z) Rz(a) Ry(b) Rx(c)`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Frame {
    /// x, mm.
    pub x_mm: f64,
    /// y, mm.
    pub y_mm: f64,
    /// z, mm.
    pub z_mm: f64,
    /// Rotation about z, deg.
    pub a_deg: f64,
    /// Rotation about the new y, deg.
    pub b_deg: f64,
    /// Rotation about the new x, deg.
    pub c_deg: f64,
}

impl From<&Pose> for Frame {
    fn from(pose: &Pose) -> Self {
        let FramePose { xyz, rz_ry_rx } = FramePose::from_pose(pose);
        let ([x_mm, y_mm, z_mm], [a_deg, b_deg, c_deg]) = (xyz.map(|v| v / MM), rz_ry_rx.map(|v| v / DEG));
        Frame { x_mm, y_mm, z_mm, a_deg, b_deg, c_deg }
    }
}

/// A fake target: the pose commanded to the controller so that the tool reaches the target.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Fake {
    /// The pose.
    pub fake: Frame,
    /// Joint angles at the pose, deg; null for prismatic joints.
    pub q_deg: Vec<Option<f64>>,
    /// Positions of prismatic joints at the pose, mm, null for those that turn; only of an arm that has such joints.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub q_mm: Option<Vec<Option<f64>>>,
    /// KUKA's status; null for other arms.
    pub s: Option<u8>,
    /// KUKA's turn; null for other arms.
    pub t: Option<u8>,
    /// Predicted one-sigma along the worst axis, mm; null beyond the ranges in which joints were measured.
    pub sigma_worst_mm: Option<f64>,
    /// Predicted one-sigma in space, mm; null beyond the ranges in which joints were measured.
    pub sigma_3d_mm: Option<f64>,
    /// Distance from target to fake target, mm.
    pub shift_mm: f64,
}

/// Outcome of a target.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum TargetOutcome {
    /// It was compensated.
    Ok(Fake),
    /// It was refused.
    Refused {
        /// The reason in words.
        why: String,
    },
}

/// A target.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CompensatedTarget {
    /// Id of the target.
    pub id: String,
    /// `ok`, or the name of the reason for the refusal.
    pub status: String,
    /// Names of warnings.
    pub warnings: Vec<String>,
    /// The target itself.
    pub target: Frame,
    /// Outcome of the target.
    #[serde(flatten)]
    pub outcome: TargetOutcome,
}

/// The part of a calibration that a URDF or robot file cannot hold.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RigidPart {
    /// Effects left out.
    pub left_out_effects: Vec<String>,
    /// Mean displacement of the TCP by these, mm.
    pub left_out_mean_mm: f64,
    /// Largest displacement, mm.
    pub left_out_max_mm: f64,
}

/// Targets compensated by a calibration, and the robot written out.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Compensation {
    /// Format tag.
    pub format: CompensationFormat,
    /// Name of the robot.
    pub robot: String,
    /// The compensated targets; absent where only the robot was written.
    #[serde(flatten)]
    pub targets: Option<CompensatedTargets>,
    /// The rewritten programs; absent where none was given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub programs: Option<CompensatedPrograms>,
    /// The part of the calibration left out of URDF and robot file; absent where none was written.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rigid: Option<RigidPart>,
}

/// Compensated targets.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CompensatedTargets {
    /// Number of targets that were not refused.
    pub compensated: usize,
    /// The controller's base frame.
    pub base: Frame,
    /// The controller's tool frame.
    pub tool: Frame,
    /// Assumptions, in words.
    pub assumed: Vec<String>,
    /// The targets.
    pub targets: Vec<CompensatedTarget>,
    /// Targets outside the identified joint ranges; null if there are none.
    pub outside_range: Option<OutsideRange>,
}

/// Compensated robot programs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CompensatedPrograms {
    /// The controller's base frame.
    pub base: Frame,
    /// The controller's tool frame.
    pub tool: Frame,
    /// Assumptions, in words.
    pub assumed: Vec<String>,
    /// The programs.
    pub files: Vec<CompensatedProgram>,
    /// Positions outside the identified joint ranges; null if there are none.
    pub outside_range: Option<OutsideRange>,
}

/// A compensated robot program.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CompensatedProgram {
    /// The file that was given.
    pub file: String,
    /// The file that was written; null if none was.
    pub written: Option<String>,
    /// Number of positions found.
    pub positions: usize,
    /// Number of positions rewritten.
    pub rewritten: usize,
    /// Statements that were not rewritten, or are right only under a condition, by line.
    pub not_rewritten: Vec<NotRewritten>,
    /// Largest distance from a position to the one written, mm; null if there are none.
    pub largest_shift_mm: Option<f64>,
    /// The positions rewritten, in their order.
    #[serde(default)]
    pub shifts: Vec<PositionShift>,
}

/// The shift of a position that was rewritten.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PositionShift {
    /// Line, counted from 1.
    pub line: usize,
    /// The position, or the instruction that has it.
    pub what: String,
    /// The desired position of the TCP in the base of the position, mm; null for a position of joints.
    pub xyz_mm: Option<[f64; 3]>,
    /// From the desired position to the one written, along the axes of that base, mm; null for a position of joints.
    pub shift_xyz_mm: Option<[f64; 3]>,
    /// Distance between the two, mm.
    pub shift_mm: f64,
    /// True if a joint is outside the range that was measured.
    pub outside_range: bool,
    /// True if small motions of the tool are large ones of the joints there.
    pub near_singular: bool,
}

/// Something in a program that was not rewritten.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NotRewritten {
    /// Line, counted from 1.
    pub line: usize,
    /// The position or the instruction.
    pub what: String,
    /// True if a position stays uncompensated, or may be wrong; false for a warning.
    pub blocks: bool,
    /// The reason.
    pub reason: String,
    /// The remedy.
    pub remedy: String,
}

impl Compensation {
    /// A document without targets.
    #[must_use]
    pub fn of_robot(robot: &str) -> Self {
        Compensation { format: CompensationFormat::Current, robot: robot.into(), targets: None, programs: None, rigid: None }
    }
}
