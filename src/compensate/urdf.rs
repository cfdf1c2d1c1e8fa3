//! The rigid part of an identified arm as a URDF: one static transform before every joint, exact.
//!
//! A row of the MDH table is `Rx(alpha) Tx(a) Ry(beta) Rz(q + theta) Tz(d)`, and rotation and translation along one axis
//! commute, so the joint's origin is the row at q = 0 and its axis is z (paper Eq. 1).

use std::fmt::Write;

use super::flange::flange_frame;
use super::rigid::RigidRobot;
use crate::robot::{FramePose, Pose};
use crate::units::MM;

/// The text of the URDF: links `world`, `base_link`, `link_1` ... `link_N`, `flange` (the manufacturer's) and `tcp`.
pub fn urdf(rigid: &RigidRobot) -> String {
    let RigidRobot { robot, base, tool, .. } = rigid;
    let mut text = String::from("<?xml version=\"1.0\"?>\n<!--\n");
    let name = plain(&robot.name);
    text += &head(rigid);
    text.push_str("  Effort and velocity are not known here and written as 0; no inertia is given.\n-->\n");
    _ = writeln!(text, "<robot name=\"{name}\">");
    text.push_str("  <link name=\"world\"/>\n  <link name=\"base_link\"/>\n");
    fixed(&mut text, "base", "world", "base_link", &base.pose());
    for (i, link) in robot.links.iter().enumerate() {
        let parent = if i == 0 { "base_link".into() } else { format!("link_{i}") };
        let k = i + 1;
        _ = writeln!(text, "  <link name=\"link_{k}\"/>");
        _ = writeln!(text, "  <joint name=\"joint_{k}\" type=\"{}\">", link.mdh.kind.name());
        _ = writeln!(text, "    <parent link=\"{parent}\"/>\n    <child link=\"link_{k}\"/>");
        origin(&mut text, &link.mdh.transform(0.0));
        let [low, high] = link.limits;
        _ = writeln!(
            text,
            "    <axis xyz=\"0 0 1\"/>\n    <limit lower=\"{low:?}\" upper=\"{high:?}\" effort=\"0\" velocity=\"0\"/>"
        );
        text.push_str("  </joint>\n");
    }
    let last = format!("link_{}", robot.joints());
    text.push_str("  <link name=\"flange\"/>\n  <link name=\"tcp\"/>\n");
    fixed(&mut text, "flange", &last, "flange", &flange_frame(robot).pose());
    fixed(&mut text, "tcp", &last, "tcp", &tool.pose());
    text.push_str("</robot>\n");
    text
}

/// What a chain of links is of, and what of the calibration it does not hold, as lines of a comment.
pub(super) fn head(rigid: &RigidRobot) -> String {
    let RigidRobot { robot, effects, left_out, .. } = rigid;
    let mut text = format!("  {}\n", comment(&robot.source));
    if effects.is_empty() {
        _ = writeln!(text, "  The calibration holds nothing that a chain of links does not.");
    } else {
        _ = writeln!(
            text,
            "  NOT IN THIS FILE, since a chain of links cannot hold it: {}.\n  Over {} postures in the joint limits that moves the TCP by {:.3} mm in the mean, {:.3} mm at most.",
            comment(&effects.join(", ")),
            left_out.postures,
            left_out.mean / MM,
            left_out.max / MM
        );
    }
    text
}

fn fixed(text: &mut String, name: &str, parent: &str, child: &str, pose: &Pose) {
    _ = writeln!(text, "  <joint name=\"{name}\" type=\"fixed\">");
    _ = writeln!(text, "    <parent link=\"{parent}\"/>\n    <child link=\"{child}\"/>");
    origin(text, pose);
    text.push_str("  </joint>\n");
}

/// URDF's roll, pitch and yaw are the angles about x, y and z of `Rz Ry Rx`.
fn origin(text: &mut String, pose: &Pose) {
    let FramePose { xyz: [x, y, z], rz_ry_rx: [yaw, pitch, roll] } = FramePose::from_pose(pose);
    _ = writeln!(text, "    <origin xyz=\"{x:?} {y:?} {z:?}\" rpy=\"{roll:?} {pitch:?} {yaw:?}\"/>");
}

/// The name with all characters except letters, digits and `_` replaced.
pub(super) fn plain(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect()
}

/// Two dashes would end a comment.
fn comment(text: &str) -> String {
    text.chars()
        .map(|c| {
            if c.is_control() {
                ' '
            } else if c == '-' {
                '\u{2010}'
            } else {
                c
            }
        })
        .collect()
}
