//! A plan with its paths, and all its motions.

use calibench::measure::poses::PlannedPose;
use calibench::measure::poses::ways::{HomeWays, MasteringPlace};
use calibench_sim::planning::{Plan, plan};
use calibench_sim::scenario::Scenario;

/// All motions of a plan in the order of its campaign, to the last ball and home; to reserves by way of home; and on to the
/// mastering posture, if there is one.
pub fn motions(poses: &[PlannedPose], ways: &HomeWays) -> Vec<[Vec<f64>; 2]> {
    let mut path = vec![ways.home.clone()];
    let mut last: Option<&PlannedPose> = None;
    for pose in poses {
        match last {
            None => path.extend(ways.from_home(&pose.id).iter().cloned()),
            Some(before) if !pose.reserve && before.payload == pose.payload => path.extend(pose.via.iter().cloned()),
            Some(before) => path.extend(ways.between(&before.id, &pose.id)),
        }
        path.extend([pose.approach.clone(), pose.contact.clone(), pose.approach.clone()]);
        last = Some(pose);
    }
    path.extend(last.map(|pose| ways.home_from(&pose.id)).unwrap_or_default());
    if let Some(MasteringPlace { q: mastering, way }) = &ways.mastering {
        path.extend(way.via.iter().cloned());
        path.push(mastering.clone());
    }
    path.windows(2).map(|leg| [leg[0].clone(), leg[1].clone()]).collect()
}

pub fn planned(scenario: &Scenario, seed: u64) -> (Plan, HomeWays) {
    let plan = plan(scenario, seed).unwrap();
    let ways = plan.probing.ways.clone().unwrap();
    (plan, ways)
}
