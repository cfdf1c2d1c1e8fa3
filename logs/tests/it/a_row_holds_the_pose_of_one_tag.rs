//! Several tags are recorded: those on the tool are points of it, and share a row; of those in the room that a camera on the hand sees,
//! a row holds the one that most rests show, and the others are named. No row has the place of one and the orientation of another.

use calibench::nalgebra::{IsometryMatrix3, Rotation3, UnitQuaternion, Vector3};
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::{FramePose, Robot, built_in};
use calibench_logs::{JointTrack, Log, LogOptions, MeasuredPoses, Track, still_poses};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Rests of the recording.
const RESTS: usize = 30;
/// Rests that show the second tag.
const OF_SECOND: usize = 20;
/// Length of a motion, and of the rest after it, s.
const LENGTHS: [f64; 2] = [1.0, 1.5];
/// Readings a second.
const RATE: f64 = 20.0;

/// Two tags, on the tool or in the room, in a recording of one clock.
fn recorded(robot: &Robot, are_on_tool: bool) -> Log {
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let postures: Vec<Vec<f64>> = (0..RESTS).map(|_| (0..6).map(|_| random.random_range(-1.2..1.2)).collect()).collect();
    let at = |t: f64| -> Vec<f64> {
        let k = ((t / (LENGTHS[0] + LENGTHS[1])) as usize).min(RESTS - 1);
        let share = ((t - k as f64 * (LENGTHS[0] + LENGTHS[1])) / LENGTHS[0]).clamp(0.0, 1.0);
        let share = share * share * (3.0 - 2.0 * share);
        let before = &postures[k.saturating_sub(1)];
        before.iter().zip(&postures[k]).map(|(a, b)| a + (b - a) * share).collect()
    };
    let base = FramePose { xyz: [1.5, -0.7, 0.4], rz_ry_rx: [0.6, 0.0, 0.1] };
    let mount = FramePose { xyz: [0.03, -0.02, 0.11], rz_ry_rx: [0.3, 0.1, -0.2] };
    let tag = |x: f64, turn: f64| {
        IsometryMatrix3::from_parts(Vector3::new(x, 0.1, 0.05).into(), Rotation3::from_euler_angles(0.2, turn, 0.0))
    };
    let tags = if are_on_tool { [tag(0.0, 0.0), tag(0.15, 0.9)] } else { [tag(0.8, 0.0), tag(1.3, 0.9)] };
    let titles: Vec<String> = ["x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"].map(str::to_owned).into();
    let track = |name: &str| Track { name: name.into(), titles: titles.clone(), ..Track::default() };
    let mut tracks = vec![track("/tf camera>tag_1"), track("/tf camera>tag_2")];
    let mut joints = JointTrack {
        name: "joints".into(),
        joints: (1..=6).map(|j| format!("joint_{j}")).collect(),
        is_si: true,
        ..JointTrack::default()
    };
    let end = RESTS as f64 * (LENGTHS[0] + LENGTHS[1]);
    for k in 0..(end * RATE) as usize {
        let t = k as f64 / RATE;
        joints.times.stated.push(t);
        joints.times.recorded.push(t);
        joints.positions.extend(at(t));
        let hand = world_from_tool(robot, &base, &mount, &at(t));
        let hand = IsometryMatrix3::from_parts(hand.translation, hand.rotation);
        for (n, (track, tag)) in tracks.iter_mut().zip(&tags).enumerate() {
            if n == 1 && t > OF_SECOND as f64 * (LENGTHS[0] + LENGTHS[1]) {
                continue;
            }
            let seen = if are_on_tool { hand * tag } else { hand.inverse() * tag };
            track.times.stated.push(t);
            track.times.recorded.push(t);
            track.values.extend(seen.translation.vector.iter());
            track.values.extend(UnitQuaternion::from_rotation_matrix(&seen.rotation).coords.iter());
        }
    }
    Log { joints: vec![joints], tracks, ..Log::default() }
}

fn stills(are_on_tool: bool, order: [usize; 2]) -> MeasuredPoses {
    let robot = built_in("ur5").unwrap();
    let log = recorded(&robot, are_on_tool);
    let measured = order.map(|n| log.tracks[n].name.clone()).into();
    still_poses(&log, &robot, &LogOptions { measured, ..LogOptions::default() }).unwrap()
}

#[test]
fn of_two_tags_in_the_room_one_is_used_and_the_other_named() {
    for order in [[0, 1], [1, 0]] {
        let found = stills(false, order);
        assert_eq!((found.measured(), found.rows), (["/tf camera>tag_1".to_owned()].as_slice(), RESTS), "{:?}", found.said);
        let table = found.table();
        let titles = table.lines().next().unwrap();
        assert!(titles.ends_with(",x_m,y_m,z_m,qx,qy,qz,qw"), "{titles}");
        let told = found.said.join("\n");
        assert!(told.contains("/tf camera>tag_2 (20 rests) is not used") && told.contains("30 rests"), "{told}");
        assert!(told.contains("--measured '/tf camera>tag_2'"), "{told}");
    }
}

#[test]
fn two_tags_on_the_tool_are_points_of_it() {
    let found = stills(true, [0, 1]);
    assert_eq!(found.measured(), ["/tf camera>tag_1", "/tf camera>tag_2"]);
    let table = found.table();
    let titles = table.lines().next().unwrap();
    assert!(titles.ends_with(",x1_m,y1_m,z1_m,qx,qy,qz,qw,x2_m,y2_m,z2_m"), "{titles}");
    assert!(!found.said.iter().any(|said| said.contains("not used")), "{:?}", found.said);
}
