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

use std::f64::consts::TAU;
use std::path::Path;

use nalgebra::Point3;

pub use self::chain::ChainEnds;
use self::chain::UrdfChain;
use self::document::UrdfDocument;
pub use self::meshes::{MissingMesh, missing_meshes};
pub use self::rewrite::{JointOrigin, calibrated_urdf, joint_origins};
use self::rows::ChainRows;
use super::guessed_masses::guess_masses;
use super::{FramePose, JointKind, Link, Robot};
use crate::files::{FileError, read_foreign_text};

/// Limits of a joint without any: one turn either way, rad, or some metres, m.
fn without_limits(kind: JointKind) -> [f64; 2] {
    let most = match kind {
        JointKind::Revolute => TAU,
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
    /// Names of all links of the file.
    pub links: Vec<String>,
    /// Name of the base link.
    pub base_link: String,
    /// Name of the tool link.
    pub tool_link: String,
    /// What was not taken as it is written, a sentence each.
    pub remarks: Vec<String>,
}

/// Widest limits of a joint: two turns, or a hundred metres; wider ones say that there are none.
fn widest(kind: JointKind) -> f64 {
    match kind {
        JointKind::Revolute => 2.0 * TAU,
        JointKind::Prismatic => LONGEST_SLIDE,
    }
}

/// Longest position of a rail that a robot file takes, m.
const LONGEST_SLIDE: f64 = 100.0;

/// Limits of a joint cut to what a robot file takes, with a remark if they were cut.
fn cut(joint: &document::UrdfJoint) -> ([f64; 2], Option<String>) {
    let stated = joint.limits.filter(|_| joint.kind != document::JointType::Continuous);
    let kind = joint.kind.moves();
    let Some([low, high]) = stated else { return (without_limits(kind), None) };
    let most = widest(kind);
    if low >= -most && high <= most {
        return ([low, high], None);
    }
    let cut = [low.max(-most), high.min(most)];
    let limits = if cut[0] < cut[1] { cut } else { without_limits(kind) };
    let [from, to] = limits.map(|l| crate::units::readable(l, kind.unit().si));
    let words = format!(
        "line {}: the limits of joint '{}', {low} to {high}, are cut to {from} to {to} {}",
        joint.line,
        joint.name,
        kind.unit().symbol
    );
    (limits, Some(words))
}

/// Reads the robot of a URDF file. Inertias, geometry and transmissions are not used; a joint without limits has one turn
/// either way, a prismatic one ten metres. Without masses, the robot gets [guessed](Robot::masses_guessed) ones.
///
/// # Errors
/// With the line, if the file is not a URDF, or has no such chain.
pub fn robot_from_urdf(path: &Path, ends: &ChainEnds) -> Result<UrdfRobot, FileError> {
    let text = read_foreign_text(path)?;
    let document = UrdfDocument::read(path, &text)?;
    let chain = UrdfChain::find(&document, ends, path)?;
    let (_, tip) = chain.poses();
    let ChainRows { root, rows, frames } = ChainRows::of(&chain.axes(), &tip);
    let links = chain.actuated().zip(&rows).zip(frames.iter().zip(chain.masses()));
    let link = |((joint, mdh), (frame, (mass, com))): ((&document::UrdfJoint, &_), (&super::Pose, _))| Link {
        mdh: *mdh,
        limits: cut(joint).0,
        mass,
        com: (frame.inverse() * Point3::from(com)).coords,
    };
    let name = |k: usize| document.links[k].name.clone();
    let (base_link, tool_link) = (name(chain.base), name(chain.tool));
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let flange = frames.last().map_or(tip, |last| last.inverse() * tip);
    let mut robot = Robot {
        name: document.name.clone(),
        source: format!("{file}, from link {base_link} to link {tool_link}"),
        links: links.map(link).collect(),
        gear_ratios: Vec::new(),
        solids: Vec::new(),
        root: FramePose::from_pose(&root),
        flange: FramePose::from_pose(&flange),
        masses_guessed: false,
    };
    guess_masses(&mut robot);
    let joint_names = chain.actuated().map(|joint| joint.name.clone()).collect();
    let links = document.links.iter().map(|link| link.name.clone()).collect();
    let remarks = chain.actuated().filter_map(|joint| cut(joint).1).collect();
    Ok(UrdfRobot { robot, joint_names, links, base_link, tool_link, remarks })
}
