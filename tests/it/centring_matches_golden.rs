//! Auto-centring without noise goes, reading by reading, as an independent program says (true arm of Table 8, nominal controller).

use crate::works::golden;
use calibench::robot::kinematics::Posture;
use calibench::robot::rel_tool::RelTool;
use calibench::robot::sites::SiteIndex;
use calibench::robot::statics::Loads;
use calibench::units::{DEG, UM};
use nalgebra::Vector3;

/// The golden's two programs agree to 7e-15 rad; three solves of a Jacobian near a singularity amplify rounding.
const JOINT_TOLERANCE: f64 = 1e-12;
const READING_TOLERANCE: f64 = 1e-12;
/// The golden's controller.
const NEWTON_STEPS: usize = 2;

#[test]
fn eighty_centrings_match() {
    let (mut model, file) = (golden::golden_model(), golden::read("centring_80.json"));
    // The golden's controller knows no limits, and some of its poses are within a centring of one.
    model.robot.links.iter_mut().for_each(|l| l.limits = [l.limits[0] - DEG, l.limits[1] + DEG]);
    let robot = &model.robot;
    let (mut arm, mut nominal) = (Posture::new(robot), Posture::new(robot));
    let mut loads = Loads::new(robot.joints());
    let none = vec![0.0; SiteIndex::new(robot.joints()).len()];
    let mut controller = RelTool::stopping_after(robot, NEWTON_STEPS);
    let turned = calibench::robot::FramePose { xyz: [0.0; 3], ..model.tool }.pose();
    let balls: Vec<usize> = file["ball"].as_array().unwrap().iter().map(|b| b.as_u64().unwrap() as usize).collect();
    let (finals, starts) = (golden::rows(&file["q_final"]), golden::rows(&file["q_start"]));
    for (k, start) in starts.iter().enumerate() {
        let mut q = start.clone();
        let expected = golden::rows(&file["readings_m"][k]);
        for (step, expected) in expected.iter().enumerate() {
            nominal.set(robot, &model.base, &model.tool, &q, &none);
            loads.compute(robot, &nominal, &model.payload, &model.gravity, &Vector3::zeros());
            let holding: Vec<f64> = loads.tau.iter().map(|t| -t).collect();
            arm.set(robot, &model.base, &model.tool, &q, &model.deviations(&model.table8(), &holding));
            let in_flange = arm.flange().components(&(model.balls[balls[k]] - arm.tcp()));
            let reading = turned.rotation.inverse() * in_flange;
            for axis in 0..3 {
                let difference = (reading[axis] - expected[axis]).abs();
                assert!(difference < READING_TOLERANCE, "centring {k}, step {step}: off by {difference:e} m");
            }
            let nulled = reading.amax() < 3.0 * UM;
            assert_eq!(nulled, step + 1 == file["iterations"][k].as_u64().unwrap() as usize, "centring {k}, step {step}");
            if !nulled {
                controller.shift(robot, &model.base, &model.tool, &mut q, &reading).unwrap();
            }
        }
        for (ours, theirs) in q.iter().zip(&finals[k]) {
            assert!((ours - theirs).abs() < JOINT_TOLERANCE, "centring {k}: joints differ by {:e}", ours - theirs);
        }
    }
}
