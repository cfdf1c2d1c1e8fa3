//! The controller's own base frame where it is not at the robot's base link.

use calibench::compensate::Compensator;
use calibench::robot::FramePose;
use calibench::robot::kinematics::Posture;
use calibench::robot::sites::SiteIndex;
use calibench::units::MM;

use super::frames::Frames;
use super::program::Dialect;
use super::scan::{Frame, Scan};

/// Greatest height of axis 2 over the base link, m, at which the two frames are the same.
const SAME_HEIGHT: f64 = 0.5 * MM;

/// Warns once a file where positions are in the controller's own base, which FANUC, Yaskawa and Stäubli have at the height of axis
/// 2, and the robot file has its base link elsewhere.
pub(super) fn tell_height(dialect: Dialect, scans: &mut [Scan], frames: &Frames<'_>, compensator: &Compensator<'_>) {
    if !matches!(dialect, Dialect::Fanuc | Dialect::Yaskawa | Dialect::Val3) {
        return;
    }
    let robot = &compensator.calibration().robot;
    let zero = vec![0.0; robot.joints()];
    let mut posture = Posture::new(robot);
    posture.set(robot, &FramePose::default(), &FramePose::default(), &zero, &vec![0.0; SiteIndex::new(robot.joints()).len()]);
    let height = (robot.root.pose() * nalgebra::Point3::from(posture.frame(2).o)).z;
    if height.abs() < SAME_HEIGHT {
        return;
    }
    for scan in scans {
        let bases = scan.positions.iter().filter(|position| !position.is_joints());
        let mut found = bases.flat_map(|p| p.frames[Frame::Base as usize].iter().map(move |name| (p.line, name)));
        if let Some((line, name)) = found.find(|(_, name)| frames.is_base_link(name)) {
            let shown = name.shown.clone();
            let mm = height / MM;
            let reason = format!(
                "it is taken for the robot's base link; this controller has it at the height of axis 2, {mm:.1} mm above the base link of the robot file"
            );
            let remedy =
                format!("give --base=0,0,{mm:.4},0,0,0, or these numbers by --frames FILE, if the controller has it there");
            scan.warn(line, shown, &reason, &remedy);
        }
    }
}
