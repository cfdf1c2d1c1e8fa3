//! The rigid part of an identified arm as a model of MuJoCo (MJCF): one body a link, each in its parent as the row of the MDH table
//! at joint position zero, its joint about or along z.

use std::fmt::Write;

use nalgebra::UnitQuaternion;

use super::flange::flange_frame;
use super::rigid::RigidRobot;
use super::urdf::{head, plain};
use crate::robot::{JointKind, Pose};

/// Mass of a link of which none is known, kg: a moving body must have one.
const MASSLESS: f64 = 1e-3;
/// Moment of inertia of a kilogram, m²: that of a ball of 5 cm radius, since none is known.
const OF_A_KILOGRAM: f64 = 0.4 * 0.05 * 0.05;

/// The text of the model: bodies `base`, `link_1` ... `link_N`, joints `joint_1` ..., sites `flange` (the manufacturer's) and `tcp`.
pub fn mjcf(rigid: &RigidRobot) -> String {
    let RigidRobot { robot, base, tool, .. } = rigid;
    let mut text = String::from("<!--\n");
    text += &head(rigid);
    text += "  Masses are those of the nominal arm, 1 g where none is known; inertias are not known, and those of balls of 5 cm.\n-->\n";
    _ = writeln!(text, "<mujoco model=\"{}\">", plain(&robot.name));
    text += "  <compiler angle=\"radian\" autolimits=\"true\"/>\n  <worldbody>\n";
    _ = writeln!(text, "    <body name=\"base\" {}>", placed(&base.pose()));
    for (i, link) in robot.links.iter().enumerate() {
        let (k, indent) = (i + 1, "  ".repeat(i + 3));
        let (kind, [low, high]) = (link.mdh.kind, link.limits);
        let moves = if kind == JointKind::Prismatic { "slide" } else { "hinge" };
        let mass = if link.mass > 0.0 { link.mass } else { MASSLESS };
        let inertia = OF_A_KILOGRAM * mass;
        let [x, y, z]: [f64; 3] = link.com.into();
        _ = writeln!(text, "{indent}<body name=\"link_{k}\" {}>", placed(&link.mdh.transform(0.0)));
        _ = writeln!(text, "{indent}  <joint name=\"joint_{k}\" type=\"{moves}\" axis=\"0 0 1\" range=\"{low:?} {high:?}\"/>");
        _ = writeln!(
            text,
            "{indent}  <inertial pos=\"{x:?} {y:?} {z:?}\" mass=\"{mass:?}\" diaginertia=\"{inertia:?} {inertia:?} {inertia:?}\"/>"
        );
    }
    let innermost = "  ".repeat(robot.joints() + 3);
    _ = writeln!(text, "{innermost}<site name=\"flange\" {}/>", placed(&flange_frame(robot).pose()));
    _ = writeln!(text, "{innermost}<site name=\"tcp\" {}/>", placed(&tool.pose()));
    for i in (0..=robot.joints()).rev() {
        _ = writeln!(text, "{}</body>", "  ".repeat(i + 2));
    }
    text + "  </worldbody>\n</mujoco>\n"
}

/// A place as attributes.
fn placed(pose: &Pose) -> String {
    let [x, y, z]: [f64; 3] = pose.translation.vector.into();
    let turn = UnitQuaternion::from_rotation_matrix(&pose.rotation);
    format!("pos=\"{x:?} {y:?} {z:?}\" quat=\"{:?} {:?} {:?} {:?}\"", turn.w, turn.i, turn.j, turn.k)
}
