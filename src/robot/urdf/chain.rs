//! The serial chain between two links of a URDF file.

use std::path::Path;

use nalgebra::{Point3, Vector3};

use super::document::{JointType, UrdfDocument, UrdfJoint};
use super::rows::AxisLine;
use crate::files::{FileError, nearest_name};
use crate::robot::Pose;

/// Names of the first and last link of a chain; without a name, the root of the file and the far end of its only arm.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ChainEnds {
    /// The base link.
    pub base: Option<String>,
    /// The tool link.
    pub tool: Option<String>,
}

/// A chain from base link to tool link.
pub(super) struct UrdfChain<'a> {
    pub document: &'a UrdfDocument,
    pub base: usize,
    pub tool: usize,
    /// Joints from base to tool, by index in the document, fixed ones included.
    pub joints: Vec<usize>,
}

impl<'a> UrdfChain<'a> {
    /// # Errors
    /// With the line, if there is no such chain or one of its joints is neither fixed nor of one axis of its own.
    pub fn find(document: &'a UrdfDocument, ends: &ChainEnds, path: &Path) -> Result<Self, FileError> {
        let names: Vec<&str> = document.links.iter().map(|link| link.name.as_str()).collect();
        let link = |name: &str| {
            names.iter().position(|n| *n == name).ok_or_else(|| {
                let remedy = match nearest_name(name, names.iter().copied()) {
                    Some(near) => format!("did you mean '{near}'?"),
                    None => format!("its links are {}", names.join(", ")),
                };
                FileError::whole(path, format!("there is no link '{name}'"), remedy)
            })
        };
        let base = match &ends.base {
            Some(name) => link(name)?,
            None => root(document, path)?,
        };
        let tool = match &ends.tool {
            Some(name) => link(name)?,
            None => far_end(document, base, path)?,
        };
        let Some(joints) = path_between(document, base, tool) else {
            let problem = format!("link '{}' is not carried by link '{}'", names[tool], names[base]);
            return Err(FileError::whole(path, problem, "name the base link first, then a link that it carries"));
        };
        let chain = UrdfChain { document, base, tool, joints };
        for &j in &chain.joints {
            chain.check(&document.joints[j], path)?;
        }
        if chain.actuated().next().is_none() {
            let problem = format!("no joint moves between the links '{}' and '{}'", names[base], names[tool]);
            return Err(FileError::whole(path, problem, "name the base link and the tool link of an arm"));
        }
        Ok(chain)
    }

    fn check(&self, joint: &UrdfJoint, path: &Path) -> Result<(), FileError> {
        let wrong = |problem: String, remedy: &str| FileError {
            line: Some(joint.line),
            field: "joint".into(),
            ..FileError::whole(path, problem, remedy)
        };
        if let Some(other) = &joint.mimics {
            let problem = format!("'{}' follows joint '{other}'", joint.name);
            return Err(wrong(problem, "end the chain before it: its joints must move on their own"));
        }
        match joint.kind {
            JointType::Fixed | JointType::Revolute | JointType::Continuous | JointType::Prismatic => Ok(()),
            kind => {
                let problem = format!("'{}' is a {} joint", joint.name, kind.name());
                Err(wrong(problem, "name a chain of revolute, continuous, prismatic and fixed joints"))
            }
        }
    }

    /// The joints that turn or slide.
    pub fn actuated(&self) -> impl Iterator<Item = &'a UrdfJoint> + '_ {
        self.joints.iter().map(|&j| &self.document.joints[j]).filter(|joint| joint.kind != JointType::Fixed)
    }

    /// Poses of the links after the joints that move, at joint position zero, in the base link; then that of the tool link.
    pub fn poses(&self) -> (Vec<Pose>, Pose) {
        let mut at = Pose::identity();
        let mut after = Vec::new();
        for &j in &self.joints {
            let joint = &self.document.joints[j];
            at *= joint.origin;
            if joint.kind != JointType::Fixed {
                after.push(at);
            }
        }
        (after, at)
    }

    /// The axes of the joints that move.
    pub fn axes(&self) -> Vec<AxisLine> {
        let (after, _) = self.poses();
        let axis = |(pose, joint): (&Pose, &UrdfJoint)| AxisLine {
            point: pose.translation.vector,
            direction: nalgebra::Unit::new_unchecked(pose.rotation * joint.axis.into_inner()),
            kind: joint.kind.moves(),
        };
        after.iter().zip(self.actuated()).map(axis).collect()
    }

    /// Mass (kg) and its centre (m, base link) of everything that moves with each joint that moves and not with the next one,
    /// at joint position zero.
    pub fn masses(&self) -> Vec<(f64, Vector3<f64>)> {
        let mut bodies = vec![(0.0, Vector3::zeros()); self.actuated().count()];
        for (k, link) in self.document.links.iter().enumerate() {
            let (Some(inertial), Some((body, pose))) = (link.inertial, self.body(k)) else { continue };
            bodies[body].0 += inertial.mass;
            bodies[body].1 += (pose * Point3::from(inertial.com)).coords * inertial.mass;
        }
        let centred = |(mass, moment): (f64, Vector3<f64>)| (mass, if mass > 0.0 { moment / mass } else { Vector3::zeros() });
        bodies.into_iter().map(centred).collect()
    }

    /// The moving joint with which a link moves, and the link's pose in the base link; `None` for what stands still.
    fn body(&self, link: usize) -> Option<(usize, Pose)> {
        let way = path_between(self.document, self.base, link)?;
        let on_chain = way.iter().zip(&self.joints).take_while(|(a, b)| a == b).map(|(&j, _)| &self.document.joints[j]);
        let body = on_chain.filter(|joint| joint.kind != JointType::Fixed).count().checked_sub(1)?;
        Some((body, way.iter().fold(Pose::identity(), |at, &j| at * self.document.joints[j].origin)))
    }
}

/// The only link that is the child of no joint.
fn root(document: &UrdfDocument, path: &Path) -> Result<usize, FileError> {
    let roots: Vec<usize> =
        (0..document.links.len()).filter(|&k| document.joints.iter().all(|joint| joint.child != k)).collect();
    match roots.as_slice() {
        [root] => Ok(*root),
        // There are no loops, so there is at least one.
        several => {
            let names: Vec<&str> = several.iter().map(|&k| document.links[k].name.as_str()).collect();
            let problem = format!("several links are the child of no joint: {}", names.join(", "));
            Err(FileError::whole(path, problem, "name the base link"))
        }
    }
}

/// The far end of the arm that has more joints than any other before the first joint that is not one of an arm; of several
/// ends with the same joints, the frame `tool0` of the ROS-Industrial convention.
///
/// A prismatic joint after the last that turns is taken for a finger of a gripper, unless nothing before it turns.
fn far_end(document: &UrdfDocument, base: usize, path: &Path) -> Result<usize, FileError> {
    let turns = |joint: &UrdfJoint| matches!(joint.kind, JointType::Revolute | JointType::Continuous) && joint.mimics.is_none();
    let is_finger = |joint: &UrdfJoint| {
        let way = path_between(document, base, joint.parent).unwrap_or_default();
        let goes_on = || document.joints.iter().any(|j| turns(j) && path_between(document, joint.child, j.parent).is_some());
        way.iter().any(|&j| turns(&document.joints[j])) && !goes_on()
    };
    let is_of_arm = |joint: &UrdfJoint| match joint.kind {
        JointType::Fixed | JointType::Revolute | JointType::Continuous => joint.mimics.is_none(),
        JointType::Prismatic => joint.mimics.is_none() && !is_finger(joint),
        JointType::Planar | JointType::Floating => false,
    };
    let of_arm: Vec<bool> = document.joints.iter().map(is_of_arm).collect();
    let mut ends: Vec<(Vec<usize>, usize)> = Vec::new();
    for link in 0..document.links.len() {
        let Some(way) = path_between(document, base, link) else { continue };
        if way.iter().any(|&j| !of_arm[j]) {
            continue;
        }
        let goes_on = document.joints.iter().zip(&of_arm).any(|(joint, of_arm)| joint.parent == link && *of_arm);
        if !goes_on {
            let moving = way.into_iter().filter(|&j| document.joints[j].kind != JointType::Fixed).collect();
            ends.push((moving, link));
        }
    }
    let most = ends.iter().map(|(joints, _)| joints.len()).max().unwrap_or(0);
    ends.retain(|(joints, _)| joints.len() == most);
    let name = |link: usize| document.links[link].name.as_str();
    let same_arm = ends.windows(2).all(|pair| pair[0].0 == pair[1].0);
    let by_convention = ends.iter().find(|(_, link)| name(*link) == "tool0").filter(|_| same_arm);
    match (ends.as_slice(), by_convention) {
        ([(_, end)], _) | (_, Some((_, end))) => Ok(*end),
        _ => {
            let names: Vec<&str> = ends.iter().map(|(_, link)| name(*link)).collect();
            let problem = format!("the arm may end at each of the links {}", names.join(", "));
            Err(FileError::whole(path, problem, "name the tool link"))
        }
    }
}

/// Joints on the way from a link to one that it carries; `None` if it does not carry it.
fn path_between(document: &UrdfDocument, from: usize, to: usize) -> Option<Vec<usize>> {
    let mut way = Vec::new();
    let mut at = to;
    while at != from {
        let joint = document.joints.iter().position(|joint| joint.child == at)?;
        way.push(joint);
        at = document.joints[joint].parent;
    }
    way.reverse();
    Some(way)
}
