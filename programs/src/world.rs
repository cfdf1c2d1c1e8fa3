//! The controller's own base frame where it is not at the robot's base link, and frames that stand on others.

use std::collections::{BTreeSet, HashMap};

use calibench::compensate::Compensator;
use calibench::robot::kinematics::Posture;
use calibench::robot::sites::SiteIndex;
use calibench::robot::{FramePose, Pose};
use calibench::units::MM;

use super::frames::{Frames, Given, are_same};
use super::program::Dialect;
use super::scan::{Frame, Scan, Setting, Stands};

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

/// Puts frames that stand on others (VAL 3) where these are: as a file of frames has them, else as the programs do. The base
/// given moves the world, and all frames on it, unless it is the one frame that positions are in.
pub(super) fn stand(scans: &mut [Scan], given: &mut Given<'_>) {
    let known: Vec<Setting> = scans.iter().flat_map(|scan| scan.settings.iter().cloned()).collect();
    if !known.iter().any(|setting| matches!(setting.stands, Stands::On(..))) {
        return;
    }
    let mut fathers = Fathers { known: HashMap::new(), world: None };
    for setting in known.into_iter().chain(given.listed.iter().cloned()) {
        fathers.known.entry((setting.frame, setting.name.key.clone())).or_default().push(setting.stands);
    }
    for setting in given.listed {
        // What a file of frames gives comes before what the programs say.
        fathers.known.insert((setting.frame, setting.name.key.clone()), vec![setting.stands.clone()]);
    }
    if fathers.is_world_given(scans, given) {
        fathers.world = Some(given.own[Frame::Base as usize]);
        given.is[Frame::Base as usize] = false;
    }
    for setting in scans.iter_mut().flat_map(|scan| &mut scan.settings) {
        setting.stands = match (&setting.stands, fathers.world) {
            (Stands::On(pose, father), _) => fathers.stands(setting.frame, pose, father),
            (Stands::Null, Some(world)) if setting.frame == Frame::Base => Stands::At(world),
            (stands, _) => stands.clone(),
        };
    }
}

/// Frames by kind and name, and where the world is, if the user gave that.
struct Fathers {
    known: HashMap<(Frame, String), Vec<Stands>>,
    world: Option<Pose>,
}

impl Fathers {
    /// Where a frame is whose pose on its father this is.
    fn stands(&self, frame: Frame, pose: &Pose, father: &str) -> Stands {
        let (mut pose, mut father) = (*pose, father);
        // As many steps as there are frames: a chain that is longer goes round.
        for _ in 0..=self.known.len() {
            let Some(above) = self.known.get(&(frame, father.to_owned())) else { return Stands::Computed };
            if above.contains(&Stands::Computed) {
                return Stands::Computed;
            }
            match above.first() {
                Some(Stands::Null) => {
                    let world = self.world.filter(|_| frame == Frame::Base);
                    return Stands::At(world.map_or(pose, |world| world * pose));
                }
                Some(Stands::At(above)) => return Stands::At(above * pose),
                Some(Stands::On(above, next)) => (pose, father) = (above * pose, next),
                _ => return Stands::Computed,
            }
        }
        Stands::Computed
    }

    /// True if the base given is the world, and not the only frame in which positions are.
    fn is_world_given(&self, scans: &[Scan], given: &Given<'_>) -> bool {
        let base = Frame::Base as usize;
        let has_world = self.known.iter().any(|((frame, _), all)| *frame == Frame::Base && all.contains(&Stands::Null));
        let positions = scans.iter().flat_map(|scan| scan.positions.iter().chain(&scan.left)).filter(|p| !p.is_joints());
        let used: BTreeSet<&str> = positions.flat_map(|p| p.frames[base].iter().map(|name| name.key.as_str())).collect();
        let is_given = |key: &str| match self.known.get(&(Frame::Base, key.to_owned())).map(Vec::as_slice) {
            Some([Stands::On(pose, father)]) => match self.stands(Frame::Base, pose, father) {
                Stands::At(pose) => are_same(&pose, &given.own[base]),
                _ => true,
            },
            _ => true,
        };
        let is_the_only_one = used.len() <= 1 && used.iter().all(|key| is_given(key));
        given.is[base] && has_world && !is_the_only_one
    }
}
