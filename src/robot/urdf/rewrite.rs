//! The same URDF file with calibrated joint origins: everything else keeps its bytes.

use std::path::Path;

use super::chain::{ChainEnds, UrdfChain};
use super::document::{JointType, OriginPlace, UrdfDocument};
use super::rows::ChainRows;
use crate::files::{FileError, read_foreign_text};
use crate::robot::{FramePose, Pose, Robot};

/// Largest difference between the calibration's nominal robot and that of the file, m and rad.
const SAME_ROBOT: f64 = 1e-8;

/// Origin of a moving joint, calibrated.
#[derive(Debug, Clone, PartialEq)]
pub struct JointOrigin {
    /// Name of the joint.
    pub joint: String,
    /// Pose of its child in its parent at joint position zero.
    pub origin: FramePose,
}

/// The calibrated origins of the joints of a URDF file. `nominal` is the robot of the calibration, and `calibrated` the same
/// with identified rows.
///
/// # Errors
/// If the file has no such chain, or that of another robot.
pub fn joint_origins(
    path: &Path,
    ends: &ChainEnds,
    nominal: &Robot,
    calibrated: &Robot,
) -> Result<Vec<JointOrigin>, FileError> {
    let text = read_foreign_text(path)?;
    let document = UrdfDocument::read(path, &text)?;
    let chain = UrdfChain::find(&document, ends, path)?;
    Ok(origins(&chain, nominal, calibrated, path)?.into_iter().map(|(_, origin)| origin).collect())
}

/// The text of a URDF file with calibrated joint origins; see [`joint_origins`].
///
/// # Errors
/// As [`joint_origins`].
pub fn calibrated_urdf(path: &Path, ends: &ChainEnds, nominal: &Robot, calibrated: &Robot) -> Result<String, FileError> {
    let text = read_foreign_text(path)?;
    let document = UrdfDocument::read(path, &text)?;
    let chain = UrdfChain::find(&document, ends, path)?;
    let mut edits = Vec::new();
    for (j, JointOrigin { origin, .. }) in origins(&chain, nominal, calibrated, path)? {
        let FramePose { xyz: [x, y, z], rz_ry_rx: [yaw, pitch, roll] } = origin;
        let values = [("xyz", format!("{x:?} {y:?} {z:?}")), ("rpy", format!("{roll:?} {pitch:?} {yaw:?}"))];
        match &document.joints[j].origin_place {
            OriginPlace::Element { insert, xyz, rpy } => {
                for ((name, value), range) in values.into_iter().zip([xyz, rpy]) {
                    match range {
                        Some(range) => edits.push((range.clone(), value)),
                        None => edits.push((*insert..*insert, format!(" {name}=\"{value}\""))),
                    }
                }
            }
            OriginPlace::Missing { insert } => {
                let [(_, xyz), (_, rpy)] = values;
                edits.push((*insert..*insert, format!("<origin xyz=\"{xyz}\" rpy=\"{rpy}\"/>")));
            }
        }
    }
    edits.sort_by_key(|(range, _)| range.start);
    let mut written = String::with_capacity(text.len() + 64 * edits.len());
    let mut at = 0;
    for (range, value) in edits {
        written.push_str(&text[at..range.start]);
        written.push_str(&value);
        at = range.end;
    }
    written.push_str(&text[at..]);
    Ok(written)
}

/// Calibrated origins, each with the index of its joint in the document.
///
/// With `U_i` the URDF's link after joint i, `D_i` the frame of row i and `M_i` the row at zero, `U_i = D_i K_i` for constant
/// `K_i` that turn the joint's axis into z, and of a joint that turns leave it where it is. The calibrated arm keeps these: `U'_{i-1}^-1 U'_i = K_{i-1}^-1 M'_i K_i`.
fn origins(
    chain: &UrdfChain<'_>,
    nominal: &Robot,
    calibrated: &Robot,
    path: &Path,
) -> Result<Vec<(usize, JointOrigin)>, FileError> {
    let (after, tip) = chain.poses();
    let ChainRows { root, frames, rows } = ChainRows::of(&chain.axes(), &tip);
    check_same(&rows, nominal, path)?;
    let offsets: Vec<Pose> = frames.iter().zip(&after).map(|(frame, link)| frame.inverse() * link).collect();
    let mut found = Vec::with_capacity(rows.len());
    let mut before = root;
    let mut fixed = Pose::identity();
    for &j in &chain.joints {
        let joint = &chain.document.joints[j];
        if joint.kind == JointType::Fixed {
            fixed *= joint.origin;
            continue;
        }
        let i = found.len();
        let from_last_link = before * calibrated.links[i].mdh.transform(0.0) * offsets[i];
        let origin = FramePose::from_pose(&(fixed.inverse() * from_last_link));
        found.push((j, JointOrigin { joint: joint.name.clone(), origin }));
        before = offsets[i].inverse();
        fixed = Pose::identity();
    }
    Ok(found)
}

/// Checks that the calibration's nominal robot is that of the file.
fn check_same(rows: &[crate::robot::MdhLink], nominal: &Robot, path: &Path) -> Result<(), FileError> {
    let remedy = "give the URDF file from which the calibrated robot was taken";
    if rows.len() != nominal.joints() {
        let problem = format!("has {} joints where the calibrated robot has {}", rows.len(), nominal.joints());
        return Err(FileError::whole(path, problem, remedy));
    }
    let numbers = |l: &crate::robot::MdhLink| [l.alpha, l.a, l.beta, l.theta, l.d];
    let differs = |(row, link): (&crate::robot::MdhLink, &crate::robot::Link)| {
        row.kind != link.mdh.kind || numbers(row).iter().zip(numbers(&link.mdh)).any(|(a, b)| (a - b).abs() > SAME_ROBOT)
    };
    match rows.iter().zip(&nominal.links).position(differs) {
        Some(i) => {
            let problem = format!("joint {} is placed otherwise than that of the calibrated robot", i + 1);
            Err(FileError::whole(path, problem, remedy))
        }
        None => Ok(()),
    }
}
