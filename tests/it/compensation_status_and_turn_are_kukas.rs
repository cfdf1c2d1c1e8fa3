//! Status and turn of exported joints are what the forward kinematics of those joints says, and with the exported pose they lead an
//! inverse kinematics that we did not write back to the same joints: 10,000 poses.

use crate::identified::{calibration, target};
use calibench::compensate::targets_file::fake_csv;
use calibench::compensate::{Compensator, Desired, Task};
use calibench::robot::FramePose;
use calibench::robot::kinematics::Posture;
use calibench::robot::sites::SiteIndex;
use calibench::units::{DEG, MM};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rs_opw_kinematics::kinematic_traits::Kinematics;
use rs_opw_kinematics::kinematics_impl::OPWKinematics;
use rs_opw_kinematics::parameters::opw_kinematics::Parameters;

const POSES: usize = 10_000;

/// Joints within 1e-8 deg in the file, poses within 1e-6 mm and 1e-8 deg; singular values of 0.02 m/rad and more make 1e-7 rad of that.
const SAME_JOINTS: f64 = 1e-7;

/// Joints and wrists nearer than this (rad, m) to the border between two values of a bit say nothing of it.
const BORDER: f64 = 1e-7;

/// A column of the exported file, by its title.
fn column(header: &csv::StringRecord, row: &csv::StringRecord, name: &str) -> f64 {
    let place = header.iter().position(|title| title == name).unwrap();
    row[place].parse().unwrap()
}

#[test]
fn exported_joints_come_back_from_pose_status_and_turn() {
    let calibration = calibration(1);
    let robot = calibration.robot.clone();
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let mut compensator = Compensator::new(&calibration, &Task::default()).unwrap();
    let (mut targets, mut results) = (Vec::new(), Vec::new());
    while results.len() < POSES {
        let q: Vec<f64> = robot.links.iter().map(|l| random.random_range(l.limits[0]..l.limits[1])).collect();
        let desired = target(results.len().to_string(), Desired::Joints(q));
        let result = compensator.compensate(&desired);
        if result.outcome.is_ok() && !result.warnings.near_singular {
            targets.push(desired);
            results.push(result);
        }
    }
    let file = fake_csv(&calibration.robot, &targets, &results);
    let mut table = csv::Reader::from_reader(file.as_bytes());
    let header = table.headers().unwrap().clone();
    let opw = OPWKinematics::new(Parameters::kuka_kr6_r700_sixx());
    let setup = &calibration.setups[0];
    let (mut posture, none) = (Posture::new(&robot), vec![0.0; SiteIndex::new(6).len()]);
    let mut seen = [[0usize; 2]; 9];
    for row in table.records() {
        let row = row.unwrap();
        let of = |name: &str| column(&header, &row, name);
        let q: [f64; 6] = std::array::from_fn(|i| of(&format!("q{}_deg", i + 1)) * DEG);
        let (status, turn) = (of("s") as u8, of("t") as u8);

        // The geometry of the drawn arm at the exported joints.
        posture.set(&robot, &FramePose::default(), &FramePose::default(), &q, &none);
        let wrist = posture.frame(5).o;
        let shoulder = posture.frame(1);
        let before_axis_1 = shoulder.components(&(wrist - shoulder.o)).x;
        let (upper, fore) = (posture.frame(3).o - posture.frame(2).o, wrist - posture.frame(3).o);
        let bend = posture.joint_axis(2).0.dot(&upper.cross(&fore)) / (upper.norm() * fore.norm());
        let sides = [before_axis_1, -bend, q[4], q[0], q[1], q[2], q[3], q[4], q[5]];
        let bits: [u8; 9] = std::array::from_fn(|k| if k < 3 { status >> k & 1 } else { turn >> (k - 3) & 1 });
        for (k, (side, bit)) in sides.iter().zip(bits).enumerate() {
            if side.abs() > BORDER {
                assert_eq!(u8::from(*side < 0.0), bit, "bit {k} at {q:?}");
                seen[k][usize::from(bit)] += 1;
            }
        }

        // Pose, status and turn, by the other program: its flange is KUKA's, frame 6 turned by Ry(180).
        let pose = FramePose {
            xyz: ["x_mm", "y_mm", "z_mm"].map(|name| of(name) * MM),
            rz_ry_rx: ["a_deg", "b_deg", "c_deg"].map(|name| of(name) * DEG),
        };
        let kuka_flange = FramePose { rz_ry_rx: [0.0, std::f64::consts::PI, 0.0], ..FramePose::default() };
        let flange = pose.pose() * setup.tool.pose().inverse() * kuka_flange.pose();
        let solutions = opw.inverse(&theirs(&opw, &flange));
        let mut matching = Vec::new();
        for solution in solutions {
            let turned = std::array::from_fn(|i| {
                let angle = solution[i] - std::f64::consts::TAU * (solution[i] / std::f64::consts::TAU).floor();
                // In [0, 360) as it is, or a turn below, as the bit says; just under a whole turn is just under zero.
                let negative = turn >> i & 1 == 1;
                let near_whole = std::f64::consts::TAU - angle < 1e-6;
                if negative || near_whole { angle - std::f64::consts::TAU } else { angle }
            });
            let ours = compensator.status_turn(&turned).unwrap();
            if ours.status == status && robot.outside_limits(&turned, 1e-6).is_none() {
                matching.push(turned);
            }
        }
        let nearest = matching
            .iter()
            .map(|m| m.iter().zip(&q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max))
            .fold(f64::INFINITY, f64::min);
        assert!(nearest < SAME_JOINTS, "row {}: {nearest:e} rad off, of {} that match", &row[0], matching.len());
        let farther = |m: &[f64; 6]| m.iter().zip(&q).any(|(a, b)| (a - b).abs() > 1e-3);
        assert!(!matching.iter().any(farther), "row {}: status and turn name two postures", &row[0]);
    }
    // Every bit was seen both ways, so that each could have been wrong.
    assert!(seen.iter().flatten().all(|&count| count > 300), "{seen:?}");
}

/// The pose as that program writes it.
fn theirs(opw: &OPWKinematics, flange: &calibench::robot::Pose) -> rs_opw_kinematics::pose::Pose {
    let mut pose = opw.forward(&[0.0; 6]);
    let q = nalgebra::UnitQuaternion::from_rotation_matrix(&flange.rotation);
    let t = flange.translation.vector;
    (pose.translation.x, pose.translation.y, pose.translation.z) = (t.x, t.y, t.z);
    (pose.rotation.x, pose.rotation.y, pose.rotation.z, pose.rotation.w) = (q.i, q.j, q.k, q.w);
    pose
}

#[test]
fn a_posture_that_is_asked_for_is_taken() {
    let calibration = calibration(2);
    let mut compensator = Compensator::new(&calibration, &Task::default()).unwrap();
    let q = [0.3, -1.2, 1.5, 0.4, 0.7, -0.6];
    let pose = compensator.nominal_pose(&q);
    let mut found = std::collections::BTreeSet::new();
    for status in 0..8 {
        let desired = Desired::Pose { pose, near: None, status: Some(status), turn: None };
        if let Ok(fake) = compensator.compensate(&target("t", desired)).outcome {
            assert_eq!(fake.status_turn.unwrap().status, status);
            found.insert(status);
        }
    }
    assert!(found.len() >= 2 && found.contains(&compensator.status_turn(&q).unwrap().status), "{found:?}");
    // A6 at -0.6 rad or a turn above: the turn's bit chooses.
    let six: Vec<f64> = [0b100000u8, 0]
        .into_iter()
        .map(|bit| {
            let of_q = compensator.status_turn(&q).unwrap();
            let desired = Desired::Pose { pose, near: None, status: Some(of_q.status), turn: Some(of_q.turn & 0b011111 | bit) };
            compensator.compensate(&target("t", desired)).outcome.unwrap().q[5]
        })
        .collect();
    assert!((six[1] - six[0] - std::f64::consts::TAU).abs() < 1e-9, "{six:?}");
}
