//! Robots from URDF files: a serial chain of revolute, continuous, prismatic and fixed joints, as MDH rows between constant frames; and
//! the same files with calibrated joint origins.
//!
//! A row of the MDH table is `Rx(alpha) Tx(a) Ry(beta) Rz(q + theta) Tz(d)`, and rotation and translation along one axis
//! commute, so every joint can be a row: frame and URDF link differ by a constant (paper Eq. 1).

mod chain;
mod document;
mod meshes;
mod rewrite;
mod rows;

use std::path::Path;

use nalgebra::Point3;

pub use self::chain::ChainEnds;
use self::chain::UrdfChain;
use self::document::UrdfDocument;
pub use self::meshes::{MissingMesh, missing_meshes};
pub use self::rewrite::{JointOrigin, calibrated_urdf, joint_origins};
use self::rows::ChainRows;
use super::{FramePose, JointKind, Link, Robot};
use crate::files::{FileError, read_text};

/// Limits of a joint without any: one turn either way, rad, or some metres, m.
fn without_limits(kind: JointKind) -> [f64; 2] {
    let most = match kind {
        JointKind::Revolute => std::f64::consts::TAU,
        JointKind::Prismatic => 10.0,
    };
    [-most, most]
}

/// The robot of a URDF file.
#[derive(Debug, Clone)]
pub struct UrdfRobot {
    /// The robot. Its root is in the base link, its flange the tool link.
    pub robot: Robot,
    /// Names of its joints.
    pub joint_names: Vec<String>,
    /// Name of the base link.
    pub base_link: String,
    /// Name of the tool link.
    pub tool_link: String,
}

/// Reads the robot of a URDF file. Inertias, geometry and transmissions are not used; a joint without limits has one turn
/// either way, a prismatic one ten metres.
///
/// # Errors
/// With the line, if the file is not a URDF, or has no such chain.
pub fn robot_from_urdf(path: &Path, ends: &ChainEnds) -> Result<UrdfRobot, FileError> {
    let text = read_text(path)?;
    let document = UrdfDocument::read(path, &text)?;
    let chain = UrdfChain::find(&document, ends, path)?;
    let (_, tip) = chain.poses();
    let ChainRows { root, rows, frames } = ChainRows::of(&chain.axes(), &tip);
    let links = chain.actuated().zip(&rows).zip(frames.iter().zip(chain.masses()));
    let link = |((joint, mdh), (frame, (mass, com))): ((&document::UrdfJoint, &_), (&super::Pose, _))| Link {
        mdh: *mdh,
        limits: joint
            .limits
            .filter(|_| joint.kind != document::JointType::Continuous)
            .unwrap_or_else(|| without_limits(joint.kind.moves())),
        mass,
        com: (frame.inverse() * Point3::from(com)).coords,
    };
    let name = |k: usize| document.links[k].name.clone();
    let (base_link, tool_link) = (name(chain.base), name(chain.tool));
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let flange = frames.last().map_or(tip, |last| last.inverse() * tip);
    let robot = Robot {
        name: document.name.clone(),
        source: format!("{file}, from link {base_link} to link {tool_link}"),
        links: links.map(link).collect(),
        gear_ratios: Vec::new(),
        solids: Vec::new(),
        root: FramePose::from_pose(&root),
        flange: FramePose::from_pose(&flange),
    };
    let joint_names = chain.actuated().map(|joint| joint.name.clone()).collect();
    Ok(UrdfRobot { robot, joint_names, base_link, tool_link })
}
