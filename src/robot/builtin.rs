//! The built-in robots.

mod kr6_r700;
mod panda;
mod rows;
mod ur10;
mod ur5;

use super::Robot;

/// Names of the built-in robots.
pub const BUILT_IN: &[&str] = &["kr6_r700", "ur10", "ur5", "panda"];

/// The built-in robot with this name.
pub fn built_in(name: &str) -> Option<Robot> {
    match name {
        "kr6_r700" => Some(kr6_r700::robot()),
        "ur10" => Some(ur10::robot()),
        "ur5" => Some(ur5::robot()),
        "panda" => Some(panda::robot()),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use nalgebra::{Rotation3, Translation3, Vector3};

    use super::*;
    use crate::robot::kinematics::{Posture, world_from_tool};
    use crate::robot::sites::SiteIndex;
    use crate::robot::solids::{ClearanceCheck, Surroundings};
    use crate::robot::statics::{Loads, Payload};
    use crate::robot::{FramePose, Pose};
    use crate::units::{DEG, MM};

    /// Half the last digit of a stated position, and some rounding, m: poses are stated to 0.1 um.
    const POSITION: f64 = 0.6e-4 * MM;
    /// Half the last digit of a stated angle, and some rounding, rad: poses are stated to 0.0001 deg.
    const ANGLE: f64 = 0.6e-4 * DEG;

    #[test]
    fn kr6_flange_stands_where_kuka_says() {
        let robot = built_in("kr6_r700").unwrap();
        let kuka_flange = FramePose { rz_ry_rx: [0.0, PI, 0.0], ..FramePose::default() };
        // Joints (deg), X Y Z (mm), A B C (deg): upright home, horizontal, stretched upwards, and one without symmetry.
        let poses = [
            ([0.0, 0.0, 0.0, 0.0, 0.0, 0.0], [785.0, 0.0, 435.0], [0.0, 90.0, 0.0]),
            ([0.0, -90.0, 90.0, 0.0, 0.0, 0.0], [470.0, 0.0, 750.0], [0.0, 90.0, 0.0]),
            ([0.0, -90.0, 0.0, 0.0, 0.0, 0.0], [-10.0, 0.0, 1160.0], [0.0, 0.0, 0.0]),
            ([30.0, -70.0, 80.0, 20.0, 40.0, 10.0], [467.7196, -290.3466, 608.8604], [179.7752, 31.9871, -149.1113]),
        ];
        for (joints, xyz, abc) in poses {
            let q = joints.map(|q| q * DEG);
            let pose = world_from_tool(&robot, &FramePose::default(), &kuka_flange, &q);
            let expected = Pose::from_parts(
                Translation3::from(Vector3::from(xyz) * MM),
                Rotation3::from_euler_angles(abc[2] * DEG, abc[1] * DEG, abc[0] * DEG),
            );
            let apart = expected.inverse() * pose;
            assert!(apart.translation.vector.norm() < 2.0 * POSITION, "{joints:?}: {pose}");
            assert!(apart.rotation.angle() < 2.0 * ANGLE, "{joints:?}: {pose}");
        }
    }

    #[test]
    fn every_robot_has_limits_masses_and_a_sensible_weight() {
        // Moving mass, kg: the scaled surrogate; the sums of the manufacturers' tables.
        for (name, moving) in [("kr6_r700", 34.09), ("ur10", 28.435), ("ur5", 17.0489), ("panda", 16.062)] {
            let robot = built_in(name).unwrap();
            assert_eq!(robot.name, name);
            assert!(robot.has_masses() && !robot.source.is_empty() && !robot.solids.is_empty());
            assert!(robot.gear_ratios.is_empty() || robot.gear_ratios.len() == robot.joints());
            assert!(robot.links.iter().all(|l| l.limits[0] < l.limits[1]));
            let mass: f64 = robot.links.iter().map(|l| l.mass).sum();
            assert!((mass - moving).abs() < 0.01, "{name} weighs {mass}");
        }
        assert!(BUILT_IN.iter().all(|name| built_in(name).is_some()) && built_in("kr5").is_none());
    }

    /// Static torques computed by hand from the published tables: arm stretched horizontally, moments of all weights beyond
    /// joint 2.
    #[test]
    fn ur10_shoulder_holds_the_stretched_arm() {
        let robot = built_in("ur10").unwrap();
        let mut posture = Posture::new(&robot);
        let none = vec![0.0; SiteIndex::new(6).len()];
        posture.set(&robot, &FramePose::default(), &FramePose::default(), &[0.0; 6], &none);
        let mut loads = Loads::new(6);
        loads.compute(&robot, &posture, &Payload::none(), &Vector3::new(0.0, 0.0, -9.81), &Vector3::zeros());
        // All links lie along -x: 12.7 kg at 0.232 m, 4.27 kg at 0.612 + 0.3323 m, the wrist's 4.365 kg at 1.1843 m.
        let moment = 9.81 * (12.7 * 0.232 + 4.27 * 0.9443 + 4.365 * 1.1843);
        // z2 points to -y, and a weight at -x rotates the arm down about -y: the load is positive.
        assert!((loads.tau[1] - moment).abs() < 1e-9, "{} against {moment}", loads.tau[1]);
    }

    #[test]
    fn no_robot_touches_itself_at_work() {
        for (name, q_deg) in [
            ("kr6_r700", vec![0.0, -90.0, 90.0, 0.0, 0.0, 0.0]),
            ("kr6_r700", vec![0.0, -90.0, 90.0, 0.0, 120.0, 0.0]),
            ("kr6_r700", vec![0.0, -90.0, 90.0, 0.0, -120.0, 0.0]),
            ("kr6_r700", vec![0.0, -146.0, 156.0, 0.0, 90.0, 0.0]), // folded transport position
            ("ur10", vec![0.0, -90.0, 90.0, -90.0, -90.0, 0.0]),
            ("ur5", vec![0.0, -90.0, 90.0, -90.0, -90.0, 0.0]),
            ("panda", vec![0.0, -45.0, 0.0, -135.0, 0.0, 90.0, 45.0]),
        ] {
            let robot = built_in(name).unwrap();
            let q: Vec<f64> = q_deg.iter().map(|q| q * DEG).collect();
            assert_eq!(robot.outside_limits(&q, 1e-9), None);
            let mut posture = Posture::new(&robot);
            let none = vec![0.0; SiteIndex::new(robot.joints()).len()];
            posture.set(&robot, &FramePose::default(), &FramePose::default(), &q, &none);
            let gap = ClearanceCheck::new(&robot, &Surroundings::default()).clearance(&posture).unwrap();
            assert!(gap.distance > 0.0, "{name} {q_deg:?}: {gap:?}");
        }
    }
}
