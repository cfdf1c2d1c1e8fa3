//! Joints by their names: in the order of the robot, whatever the order in a table or a message.

use std::path::Path;

use crate::robot::Robot;
use crate::robot::robot_file::RobotReference;
use crate::robot::urdf::robot_from_urdf;

/// Names of the joints of Universal Robots' arms from the base on; their driver states them in another order.
const UNIVERSAL_ROBOTS: [&str; 6] = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"];

/// The places of the robot's joints, from the base on, among names that were found: by the names of its URDF, or by those of
/// Universal Robots' driver if `names` is empty; `None` if they do not tell.
#[must_use]
pub fn order(found: &[String], robot: &Robot, names: &[String]) -> Option<Vec<usize>> {
    if !names.is_empty() {
        return by_names(found, names);
    }
    let universal: Vec<String> = UNIVERSAL_ROBOTS.iter().map(|&name| name.to_owned()).collect();
    if robot.joints() == universal.len() { by_names(found, &universal) } else { None }
}

/// The columns of the joints among columns with titles, by the names of the joints.
pub(super) fn columns(titled: &[(usize, String)], robot: &Robot, names: &[String]) -> Option<Vec<usize>> {
    let titles: Vec<String> = titled.iter().map(|(_, title)| title.clone()).collect();
    let order = order(&titles, robot, names).filter(|order| order.len() == robot.joints())?;
    Some(order.into_iter().map(|k| titled[k].0).collect())
}

/// Names of the joints of the robot that a reference names, from the base on; empty if it is not a URDF.
pub(super) fn names_of(reference: &str) -> Vec<String> {
    let RobotReference { name, ends } = RobotReference::parse(reference);
    let path = Path::new(name);
    let is_urdf = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("urdf"));
    if is_urdf { robot_from_urdf(path, &ends).map_or_else(|_| Vec::new(), |urdf| urdf.joint_names) } else { Vec::new() }
}

/// A name without what drivers and tables put around it.
#[must_use]
pub fn bare(name: &str) -> String {
    let mut rest_of: String = name.to_lowercase().replace(['/', '.', ' ', '-', '[', ']', '(', ')'], "_");
    while let Some(rest) =
        ["_deg", "_rad", "_m", "_mm", "_pos", "_position", "_joint", "_"].iter().find_map(|end| rest_of.strip_suffix(end))
    {
        rest_of = rest.to_owned();
    }
    rest_of
}

/// The places of these names: equal ones, or else the only ones that end so, as where a prefix tells two arms apart.
fn by_names(found: &[String], names: &[String]) -> Option<Vec<usize>> {
    let bare_found: Vec<String> = found.iter().map(|name| bare(name)).collect();
    let place = |name: &String| {
        let name = bare(name);
        let ends = |longer: &str, end: &str| longer.strip_suffix(end).is_some_and(|rest| rest.ends_with('_'));
        let equal: Vec<usize> = (0..found.len()).filter(|&k| bare_found[k] == name).collect();
        let like: Vec<usize> =
            (0..found.len()).filter(|&k| ends(&bare_found[k], &name) || ends(&name, &bare_found[k])).collect();
        match (equal.as_slice(), like.as_slice()) {
            ([place], _) | ([], [place]) => Some(*place),
            _ => None,
        }
    };
    let order: Vec<usize> = names.iter().map(place).collect::<Option<_>>()?;
    let mut different = order.clone();
    different.sort_unstable();
    different.dedup();
    (different.len() == order.len()).then_some(order)
}
