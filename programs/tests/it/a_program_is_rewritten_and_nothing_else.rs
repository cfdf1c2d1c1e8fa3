//! Of a robot program only the numbers of its positions change; read back, they lead the controller to joints at which the
//! identified robot is where the program requires it; and what cannot be rewritten is told by its line.

use std::f64::consts::PI;

use calibench::compensate::{Compensator, Desired, Fake, Task, WorkFrame};
use calibench::identify::calibration::Calibration;
use calibench::robot::inverse::{SphericalWrist, StatusTurn};
use calibench::robot::kinematics::world_from_tool;
use calibench::robot::{FramePose, Pose, Robot, built_in};
use calibench::units::{DEG, MM, UM};
use calibench_programs::{Dialect, Permissions, Program, RewrittenProgram, rewrite_programs};
use nalgebra::{Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::identified::{EFFECTS, calibration_of, largest_error, postures, target};

/// Promised: read back to the same joints.
const SAME_JOINTS: f64 = 1e-6 * DEG;

/// Promised: the identified robot is at the desired position.
const MET: f64 = 1.0 * UM;

/// Positions of every generated program.
const POSITIONS: usize = 200;

/// A piece of a program: bytes that must stay, or a number that may change.
pub enum Piece {
    Fixed(Vec<u8>),
    Number(String),
}

/// A program in the making.
pub struct Writer {
    pieces: Vec<Piece>,
    pub random: ChaCha8Rng,
}

impl Writer {
    pub fn new() -> Self {
        Writer { pieces: Vec::new(), random: ChaCha8Rng::seed_from_u64(5) }
    }

    pub fn fixed(&mut self, text: impl AsRef<[u8]>) -> &mut Self {
        self.pieces.push(Piece::Fixed(text.as_ref().to_vec()));
        self
    }

    fn gap(&mut self, gaps: &[&str]) -> &mut Self {
        let gap = gaps[self.random.random_range(0..gaps.len())];
        self.fixed(gap)
    }

    pub fn number(&mut self, value: f64, decimals: usize) -> &mut Self {
        self.pieces.push(Piece::Number(format!("{value:.decimals$}")));
        self
    }

    pub fn bytes(&self) -> Vec<u8> {
        let of = |piece: &Piece| match piece {
            Piece::Fixed(bytes) => bytes.clone(),
            Piece::Number(text) => text.clone().into_bytes(),
        };
        self.pieces.iter().flat_map(of).collect()
    }

    /// The numbers of the same program as rewritten; panics where anything else differs.
    pub fn numbers_of(&self, mut rewritten: &[u8]) -> Vec<f64> {
        let mut numbers = Vec::new();
        for piece in &self.pieces {
            match piece {
                Piece::Fixed(bytes) => {
                    let same = rewritten.strip_prefix(&bytes[..]);
                    rewritten = same.unwrap_or_else(|| {
                        let found = String::from_utf8_lossy(&rewritten[..rewritten.len().min(80)]);
                        panic!("{found:?} in place of {:?}", String::from_utf8_lossy(bytes))
                    });
                }
                Piece::Number(_) => {
                    let length = rewritten.iter().take_while(|b| b.is_ascii_digit() || b"+-.".contains(b)).count();
                    numbers.push(str::from_utf8(&rewritten[..length]).unwrap().parse().unwrap());
                    rewritten = &rewritten[length..];
                }
            }
        }
        assert!(rewritten.is_empty(), "nothing is added");
        numbers
    }

    pub fn old_numbers(&self) -> Vec<f64> {
        let of = |piece: &Piece| match piece {
            Piece::Number(text) => Some(text.parse().unwrap()),
            Piece::Fixed(_) => None,
        };
        self.pieces.iter().filter_map(of).collect()
    }
}

/// An arm with its task: the frame of its programs is the world, the tool that of the set-up.
pub struct Bench {
    pub calibration: Calibration,
    /// Nominal joints that are compensated without ado.
    pub postures: Vec<Vec<f64>>,
}

const TASK: Task = Task { setup: None, frame: WorkFrame::World, tool: None, payload: None };

impl Bench {
    fn new(robot: Robot, candidates: Vec<Vec<f64>>) -> Self {
        let effects: Vec<&str> = EFFECTS.into_iter().filter(|e| !e.starts_with("link_bending")).collect();
        let calibration = calibration_of(robot, &effects, 7);
        let mut compensator = Compensator::new(&calibration, &TASK).unwrap();
        let mut postures = candidates;
        postures.retain(|q| {
            let found = compensator.compensate(&target("t", Desired::Joints(q.clone())));
            found.outcome.is_ok() && !found.warnings.near_singular
        });
        postures.truncate(POSITIONS);
        assert_eq!(postures.len(), POSITIONS, "enough of them are reached");
        Bench { calibration, postures }
    }

    pub fn kr6() -> Self {
        Bench::new(built_in("kr6_r700").unwrap(), postures(400, 21))
    }

    /// Another arm with a spherical wrist: its shoulder before axis 1, its forearm aside and longer.
    pub fn other() -> Self {
        let mut robot = built_in("kr6_r700").unwrap();
        robot.name = "six_axes".into();
        for (link, [a, d]) in [(1, [150.0, 0.0]), (2, [475.0, 0.0]), (3, [60.0, -600.0])] {
            (robot.links[link].mdh.a, robot.links[link].mdh.d) = (a * MM, d * MM);
        }
        robot.solids.clear();
        Bench::new(robot, postures(400, 22))
    }

    pub fn ur5() -> Self {
        let mut random = ChaCha8Rng::seed_from_u64(23);
        let mut q = || {
            let mut between = |low: f64, high: f64| random.random_range(low..high) * DEG;
            vec![
                between(-170.0, 170.0),
                between(-140.0, -40.0),
                between(40.0, 130.0),
                between(-170.0, 170.0),
                between(35.0, 145.0),
                between(-170.0, 170.0),
            ]
        };
        Bench::new(built_in("ur5").unwrap(), (0..600).map(|_| q()).collect())
    }

    /// The frames of the controller, as numbers in mm and deg.
    fn frames(&self) -> [[f64; 6]; 2] {
        let compensator = Compensator::new(&self.calibration, &TASK).unwrap();
        [compensator.flange_from_tool(), compensator.base_link_from_work()].map(|pose| {
            let FramePose { xyz: [x, y, z], rz_ry_rx: [a, b, c] } = FramePose::from_pose(&pose);
            [x / MM, y / MM, z / MM, a / DEG, b / DEG, c / DEG]
        })
    }

    fn rewrite(&self, dialect: Dialect, bytes: &[u8]) -> RewrittenProgram {
        let mut compensator = Compensator::new(&self.calibration, &TASK).unwrap();
        let permissions =
            Permissions { joints_as_in_robot_file: true, tool_given: true, base_given: true, ..Permissions::default() };
        let program = Program { path: "program".into(), dialect, bytes: bytes.to_vec() };
        rewrite_programs(&[program], &mut compensator, &permissions).remove(0)
    }

    /// The nominal pose of joints in the world, where programs have their poses.
    fn world_pose(&self, q: &[f64]) -> Pose {
        Compensator::new(&self.calibration, &TASK).unwrap().nominal_pose(q)
    }

    pub fn wrist(&self) -> SphericalWrist {
        SphericalWrist::new(&self.calibration.robot).unwrap()
    }
}

/// KUKA's and FANUC's angles: z, then y, then x.
pub fn of_angles(xyz: [f64; 3], [a, b, c]: [f64; 3]) -> Pose {
    let rotation = Rotation3::from_axis_angle(&Vector3::z_axis(), a * DEG)
        * Rotation3::from_axis_angle(&Vector3::y_axis(), b * DEG)
        * Rotation3::from_axis_angle(&Vector3::x_axis(), c * DEG);
    Pose::from_parts(Translation3::from(Vector3::from(xyz) * MM), rotation)
}

pub fn angles(pose: &Pose) -> ([f64; 3], [f64; 3]) {
    let FramePose { xyz, rz_ry_rx } = FramePose::from_pose(pose);
    (xyz.map(|v| v / MM), rz_ry_rx.map(|v| v / DEG))
}

/// The promise of every dialect: `desired` are the positions of the original program, `back` the joints to which the new
/// numbers lead.
fn holds(bench: &Bench, new: &RewrittenProgram, desired: &[Pose], back: impl Fn(usize, &Fake) -> Vec<f64>) {
    let told: Vec<String> = new.remarks.iter().map(|r| format!("{}: {} {}", r.line, r.what, r.reason)).collect();
    assert!(new.is_whole(), "{told:#?}");
    assert_eq!((new.positions, new.rewritten.len()), (desired.len(), desired.len()), "{told:#?}");
    let mut farthest: f64 = 0.0;
    for (k, one) in new.rewritten.iter().enumerate() {
        let q = back(k, &one.fake);
        let off = q.iter().zip(&one.fake.q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < SAME_JOINTS, "position {k} {}: {:e} deg", one.name, off / DEG);
        farthest = farthest.max(off);
    }
    let reached: Vec<(Vec<f64>, Pose)> =
        new.rewritten.iter().zip(desired).map(|(one, pose)| (one.fake.q.clone(), *pose)).collect();
    let error = largest_error(&bench.calibration, &reached, 0);
    let shift = new.rewritten.iter().map(|one| one.fake.shift).fold(0.0, f64::max);
    println!(
        "{} positions: joints read back to {:.1e} deg, the identified robot at them to {:.1e} um, shifted by up to {:.3} mm",
        desired.len(),
        farthest / DEG,
        error / UM,
        shift / MM
    );
    assert!(error < MET, "{error:e} m");
    assert!(shift > 0.1 * MM, "there was something to compensate");
}

const COMMENT: &[u8] = b"P\xfcnktchen {X 1,Y 2,Z 3,A 4,B 5,C 6} [[1,2,3],[1,0,0,0],[0,0,0,0],[0,0,0,0,0,0]] p[1,2,3,4,5,6]";
const GAPS: [&str; 4] = [" ", "  ", "\t", "   "];
const NO_GAPS: [&str; 3] = ["", " ", "  "];

#[test]
fn krl_keeps_all_but_its_numbers() {
    let bench = Bench::kr6();
    let mut w = Writer::new();
    let [tool, base] = bench.frames();
    w.fixed(b"\xef\xbb\xbf&ACCESS RVP\r\nDEF weld ( )\r\n;FOLD INI\r\n  BAS (#INITMOV,0 )\r\n;ENDFOLD\r\nPTP $AXIS_ACT\r\n");
    for (name, f) in [("$TOOL", tool), ("$BASE", base)] {
        let [x, y, z, a, b, c] = f;
        w.fixed(format!("{name} = {{FRAME: X {x:.4},Y {y:.4},Z {z:.4},A {a:.5},B {b:.5},C {c:.5}}}\r\n"));
    }
    w.fixed("LOAD_DATA[1]={M 5.0,CM {X 0.0,Y 0.0,Z 90.0,A 0.0,B 0.0,C 0.0},J {X 0.0,Y 0.0,Z 0.0}}\r\n");
    let wrist = bench.wrist();
    let mut kinds = Vec::new();
    for (k, q) in bench.postures.iter().enumerate() {
        let joints = k % 5 == 4;
        kinds.push(joints);
        match k % 3 {
            0 => w.fixed(format!("DECL E6{} XP{k}=", if joints { "AXIS" } else { "POS" })),
            1 => w.fixed("  ptp "),
            _ => w.fixed("SLIN "),
        };
        w.fixed("{").gap(&NO_GAPS);
        if joints {
            for (i, q) in q.iter().enumerate() {
                w.fixed(if i > 0 { "," } else { "" }).gap(&NO_GAPS).fixed(format!("A{}", i + 1)).gap(&GAPS).number(q / DEG, 4);
            }
        } else {
            let (xyz, abc) = angles(&bench.world_pose(q));
            for (i, (name, value)) in "XYZABC".chars().zip(xyz.into_iter().chain(abc)).enumerate() {
                w.fixed(if i > 0 { "," } else { "" }).gap(&NO_GAPS).fixed(name.to_string()).gap(&GAPS).number(value, 4);
            }
            let StatusTurn { status, turn } = StatusTurn::of(&wrist, q[..].try_into().unwrap());
            w.fixed(",S ").number(f64::from(status), 0).gap(&NO_GAPS).fixed(",T").gap(&GAPS).number(f64::from(turn), 0);
            w.fixed(",E1 0.0,E2 0.0");
        }
        w.gap(&NO_GAPS).fixed("}").fixed(if k % 3 == 2 { " C_DIS" } else { "" }).gap(&GAPS);
        w.fixed(if k % 4 == 0 { "; " } else { "" }).fixed(if k % 4 == 0 { COMMENT } else { b"" });
        w.fixed(if k % 7 == 0 { "\n" } else { "\r\n" });
    }
    w.fixed("END"); // Without an end of its line.
    let new = bench.rewrite(Dialect::Krl, &w.bytes());
    let (old, numbers) = (w.old_numbers(), w.numbers_of(&new.bytes));
    let mut at = 0;
    let places: Vec<usize> = kinds
        .iter()
        .map(|joints| {
            let here = at;
            at += if *joints { 6 } else { 8 };
            here
        })
        .collect();
    let pose = |n: &[f64]| of_angles([n[0], n[1], n[2]], [n[3], n[4], n[5]]);
    let deg = |n: &[f64]| n[..6].iter().map(|v| v * DEG).collect::<Vec<f64>>();
    let desired: Vec<Pose> = (kinds.iter().zip(&places))
        .map(|(joints, at)| if *joints { bench.world_pose(&deg(&old[*at..])) } else { pose(&old[*at..]) })
        .collect();
    holds(&bench, &new, &desired, |k, fake| {
        let n = &numbers[places[k]..];
        if kinds[k] {
            return deg(n);
        }
        let mut controller = Compensator::new(&bench.calibration, &TASK).unwrap();
        let bits = StatusTurn { status: n[6] as u8, turn: n[7] as u8 };
        // From far away: status and turn alone select the posture.
        let away: Vec<f64> = fake.q.iter().map(|q| q - 1.0).collect();
        controller.controller_joints(&pose(n), Some(bits), &away).unwrap()
    });
    // Joint 4 or 6 at zero turns over where it is compensated: some turns have changed.
    let turns =
        |numbers: &[f64]| kinds.iter().zip(&places).filter(|(j, _)| !**j).map(|(_, at)| numbers[at + 7]).collect::<Vec<f64>>();
    assert!(turns(&old).len() > 100 && turns(&numbers).iter().all(|t| (0.0..64.0).contains(t)));
}

#[test]
fn urscript_keeps_all_but_its_numbers() {
    let bench = Bench::ur5();
    let mut w = Writer::new();
    let [tool, _] = bench.frames();
    let tool = of_angles([tool[0], tool[1], tool[2]], [tool[3], tool[4], tool[5]]);
    let (t, r) = (tool.translation.vector, tool.rotation.scaled_axis());
    w.fixed("def weld():\n  set_payload(1.2, [0.0, 0.0, 0.05])\n");
    w.fixed(format!("  set_tcp(p[{:.6},{:.6},{:.6},{:.6},{:.6},{:.6}])\n", t.x, t.y, t.z, r.x, r.y, r.z));
    w.fixed("  limits = [1, 2, 3, 4, 5, 6]\n");
    // Joints that are only a start for the controller's search stay.
    for (k, q) in bench.postures.iter().enumerate() {
        let list: Vec<String> = q.iter().map(|q| format!("{q:.4}")).collect();
        w.fixed(format!("  global way_{k}_q = [{}]\n", list.join(", ")));
    }
    let mut kinds = Vec::new();
    for (k, q) in bench.postures.iter().enumerate() {
        let joints = k % 4 == 3;
        kinds.push(joints);
        let v = bench.world_pose(q);
        let r = v.rotation.scaled_axis();
        // Longer than half a turn, as some teach pendants write it.
        let r = if k % 9 == 0 { r * (1.0 - 2.0 * PI / r.norm()) } else { r };
        let t = v.translation.vector;
        let values = if joints { q.clone() } else { vec![t.x, t.y, t.z, r.x, r.y, r.z] };
        match k % 4 {
            3 => w.fixed("  movej("),
            2 => w.fixed("  movel(pose = get_inverse_kin(p"),
            _ => w.fixed(format!("  global way_{k}_p =").as_bytes()).gap(&NO_GAPS).fixed("p"),
        };
        w.fixed("[").gap(&NO_GAPS);
        for (i, value) in values.into_iter().enumerate() {
            w.fixed(if i > 0 { "," } else { "" }).gap(&NO_GAPS).number(value, 6);
        }
        w.gap(&NO_GAPS).fixed("]");
        match k % 4 {
            3 => w.fixed(", a=1.4, v=1.05, r=0)\n"),
            2 => w.fixed(format!(", qnear=way_{k}_q), a=1.2, v=0.25)\r\n")),
            _ => w.fixed("  # ").fixed(COMMENT).fixed(format!("\n  movel(get_inverse_kin(way_{k}_p, qnear=way_{k}_q))\n")),
        };
    }
    w.fixed("end\n");
    let new = bench.rewrite(Dialect::UrScript, &w.bytes());
    let (old, numbers) = (w.old_numbers(), w.numbers_of(&new.bytes));
    let pose =
        |n: &[f64]| Pose::from_parts(Translation3::new(n[0], n[1], n[2]), Rotation3::new(Vector3::new(n[3], n[4], n[5])));
    let desired: Vec<Pose> =
        (0..POSITIONS).map(|k| if kinds[k] { bench.world_pose(&old[6 * k..6 * k + 6]) } else { pose(&old[6 * k..]) }).collect();
    let mut controller = Compensator::new(&bench.calibration, &TASK).unwrap();
    let back: Vec<Vec<f64>> = (0..POSITIONS)
        .map(|k| {
            let n = &numbers[6 * k..6 * k + 6];
            if kinds[k] { n.to_vec() } else { controller.controller_joints(&pose(n), None, &bench.postures[k]).unwrap() }
        })
        .collect();
    holds(&bench, &new, &desired, |k, _| back[k].clone());
    for k in (0..POSITIONS).filter(|k| !kinds[*k]) {
        let jump: f64 = (3..6).map(|i| (numbers[6 * k + i] - old[6 * k + i]).abs()).sum();
        assert!(jump < 0.5, "the rotation vector stays near the one that stood there");
    }
}

/// The nominal joints for a pose that a filter lets through; it must leave one posture.
fn only(bench: &Bench, pose: &Pose, filter: impl Fn(&[f64; 6]) -> bool) -> Vec<f64> {
    let compensator = Compensator::new(&bench.calibration, &TASK).unwrap();
    // The flange of these arms looks away from their last frame.
    let flange = FramePose { xyz: [0.0; 3], rz_ry_rx: [0.0, PI, 0.0] };
    let tool = flange.pose() * compensator.flange_from_tool();
    let robot = &bench.calibration.robot;
    let q0 = [0.1, -1.0, 1.2, 0.2, 0.6, 0.3];
    let root_from_tool = world_from_tool(robot, &FramePose::default(), &FramePose::from_pose(&tool), &q0);
    let root_from_work = root_from_tool * compensator.nominal_pose(&q0).inverse();
    let mut found = Vec::new();
    bench.wrist().solutions(&(root_from_work * pose * tool.inverse()), 0.0, |q| {
        if filter(q) {
            found.push(q.to_vec());
        }
    });
    assert_eq!(found.len(), 1, "the configuration names one posture: {found:?}");
    found.remove(0)
}

/// ABB's quadrant of a joint.
pub fn quadrant(q: f64) -> f64 {
    (q / (90.0 * DEG)).floor()
}

#[test]
fn rapid_keeps_all_but_its_numbers() {
    let bench = Bench::other();
    let wrist = bench.wrist();
    let mut w = Writer::new();
    let [tool, _] = bench.frames();
    let t = of_angles([tool[0], tool[1], tool[2]], [tool[3], tool[4], tool[5]]);
    let q = UnitQuaternion::from_rotation_matrix(&t.rotation);
    w.fixed("MODULE Weld\r\n  ! ").fixed(COMMENT).fixed("\r\n");
    w.fixed(format!("  PERS tooldata gun:=[TRUE,[[{:.3},{:.3},{:.3}],", tool[0], tool[1], tool[2]));
    w.fixed(format!("[{:.8},{:.8},{:.8},{:.8}]],[1,[0,0,50],[1,0,0,0],0,0,0]];\r\n", q.w, q.i, q.j, q.k));
    w.fixed("  CONST speeddata v1:=[100,500,5000,1000];\r\n");
    let status = |q: &[f64]| StatusTurn::of(&wrist, q.try_into().unwrap()).status;
    // Wrist behind axis 1, wrist behind the lower arm, axis 5 negative; KUKA sets its second bit before the lower arm.
    let cfx = |s: u8| f64::from((s & 1) << 2 | (!s & 2) | s >> 2 & 1);
    let mut places = Vec::new();
    let mut count = 0;
    for (k, q) in bench.postures.iter().enumerate() {
        let joints = k % 5 == 4;
        places.push((joints, count));
        match (joints, k % 2) {
            (true, _) => w.fixed(format!("  CONST jointtarget j{k} :=")),
            (false, 0) => w.fixed(format!("  LOCAL CONST robtarget p{k}:=\r\n    ")),
            (false, _) => w.fixed("  MoveL ").fixed(""),
        };
        w.gap(&NO_GAPS).fixed("[[");
        let comma = |i: usize| if i > 0 { "," } else { "" };
        if joints {
            for (i, q) in q.iter().enumerate() {
                w.fixed(comma(i)).gap(&NO_GAPS).number(q / DEG, 4);
            }
            count += 6;
        } else {
            let pose = bench.world_pose(q);
            let v = UnitQuaternion::from_rotation_matrix(&pose.rotation);
            for (i, value) in pose.translation.vector.iter().enumerate() {
                w.fixed(comma(i)).gap(&NO_GAPS).number(value / MM, 3);
            }
            let sign = if k % 3 == 0 { -1.0 } else { 1.0 };
            w.fixed("],").gap(&NO_GAPS).fixed("[");
            for (i, value) in [v.w, v.i, v.j, v.k].into_iter().enumerate() {
                w.fixed(comma(i)).gap(&NO_GAPS).number(sign * value, 9);
            }
            w.fixed("],[");
            for (i, value) in [quadrant(q[0]), quadrant(q[3]), quadrant(q[5]), cfx(status(q))].into_iter().enumerate() {
                w.fixed(comma(i)).gap(&NO_GAPS).number(value, 0);
            }
            count += 11;
        }
        w.fixed("],[9E9,9E+09,9E9,9E9,9E9,9E9]]");
        w.fixed(if joints || k % 2 == 0 { ";" } else { ",v1,fine,gun;" }).fixed(if k % 4 == 0 { " ! p[1]" } else { "" });
        w.fixed("\r\n");
    }
    w.fixed("ENDMODULE\r\n");
    let new = bench.rewrite(Dialect::Rapid, &w.bytes());
    let (old, numbers) = (w.old_numbers(), w.numbers_of(&new.bytes));
    let pose = |n: &[f64]| {
        let rotation = UnitQuaternion::from_quaternion(Quaternion::new(n[3], n[4], n[5], n[6]));
        Pose::from_parts(Translation3::from(Vector3::new(n[0], n[1], n[2]) * MM), rotation.to_rotation_matrix())
    };
    let deg = |n: &[f64]| n[..6].iter().map(|v| v * DEG).collect::<Vec<f64>>();
    let desired: Vec<Pose> = (places.iter())
        .map(|(joints, at)| if *joints { bench.world_pose(&deg(&old[*at..])) } else { pose(&old[*at..]) })
        .collect();
    holds(&bench, &new, &desired, |k, _| {
        let (joints, at) = places[k];
        let n = &numbers[at..];
        if joints {
            return deg(n);
        }
        assert!((3..7).map(|i| n[i] * old[at + i]).sum::<f64>() > 0.9, "the quaternion keeps its sign");
        only(&bench, &pose(n), |q| {
            [q[0], q[3], q[5]].iter().zip(&n[7..10]).all(|(q, cf)| quadrant(*q) == *cf) && cfx(status(q)) == n[10]
        })
    });
}

#[test]
fn fanuc_keeps_all_but_its_numbers() {
    let bench = Bench::other();
    let wrist = bench.wrist();
    let turn = |q: f64| (0.5 + q / (2.0 * PI)).floor();
    let status = |q: &[f64]| StatusTurn::of(&wrist, q.try_into().unwrap()).status;
    // Hand down is N, elbow up is U, wrist in front is T; reaching backward, the elbow's letter says what geometry it likes.
    let letters =
        |s: u8| [if s & 4 == 0 { 'N' } else { 'F' }, if s & 2 != 0 { 'U' } else { 'D' }, if s & 1 == 0 { 'T' } else { 'B' }];
    let mut w = Writer::new();
    w.fixed("/PROG  WELD\r\n/ATTR\r\nCOMMENT\t\t= \"x [[1,2,3]]\";\r\nPROTECT = READ_WRITE;\r\n/MN\r\n");
    for k in 1..=POSITIONS {
        w.fixed(format!("  {k:2}:L P[{k}] 100mm/sec FINE    ;\r\n"));
    }
    w.fixed("/POS\r\n");
    let mut places = Vec::new();
    let mut count = 0;
    let front: Vec<&Vec<f64>> = bench.postures.iter().collect();
    for (k, q) in front.iter().enumerate() {
        // Backward, the letters alone leave two elbows, and the one nearest to the position before is taken.
        let joints = k % 5 == 4 || status(q) & 1 == 1;
        places.push((joints, count));
        let name = if k % 3 == 0 { format!(":\"way {k}; }}\"") } else { String::new() };
        w.fixed(format!("P[{}{name}]{{\r\n   GP1:\r\n\tUF : 0, UT : 1,", k + 1));
        if joints {
            for (i, q) in q.iter().enumerate() {
                w.fixed(if i > 0 { "," } else { "\t\r\n" }).gap(&GAPS).fixed(format!("J{}=", i + 1)).gap(&GAPS);
                w.number(q / DEG, 3).fixed(" deg");
            }
            count += 6;
        } else {
            let [n, u, t] = letters(status(q));
            w.fixed(format!("\t\tCONFIG : '{n} {u} {t}, "));
            for (i, joint) in [0, 3, 5].into_iter().enumerate() {
                w.fixed(if i > 0 { ", " } else { "" }).number(turn(q[joint]), 0);
            }
            w.fixed("',\r\n");
            let (xyz, [a, b, c]) = angles(&bench.world_pose(q));
            for (i, (name, value)) in "XYZWPR".chars().zip(xyz.into_iter().chain([c, b, a])).enumerate() {
                w.fixed(if i > 0 { "," } else { "" }).gap(&GAPS).fixed(format!("{name} =")).gap(&GAPS).number(value, 3);
                w.fixed(if i < 3 { "  mm" } else { " deg" });
            }
            count += 9;
        }
        w.fixed("\r\n};\r\n");
    }
    w.fixed("/END\r\n");
    let new = bench.rewrite(Dialect::Fanuc, &w.bytes());
    let (old, numbers) = (w.old_numbers(), w.numbers_of(&new.bytes));
    let pose = |n: &[f64]| of_angles([n[3], n[4], n[5]], [n[8], n[7], n[6]]);
    let deg = |n: &[f64]| n[..6].iter().map(|v| v * DEG).collect::<Vec<f64>>();
    let desired: Vec<Pose> = (places.iter())
        .map(|(joints, at)| if *joints { bench.world_pose(&deg(&old[*at..])) } else { pose(&old[*at..]) })
        .collect();
    assert!(places.iter().filter(|(joints, _)| !joints).count() > 80, "enough poses");
    holds(&bench, &new, &desired, |k, _| {
        let (joints, at) = places[k];
        let n = &numbers[at..];
        if joints {
            return deg(n);
        }
        let wanted = status(front[k]);
        only(&bench, &pose(n), |q| status(q) == wanted && [q[0], q[3], q[5]].iter().zip(n).all(|(q, t)| turn(*q) == *t))
    });
}

/// A program, and the lines that are told with a word of the reason; `true` where a position is refused.
fn told(bench: &Bench, dialect: Dialect, program: &str, expected: &[(usize, bool, &str)]) {
    let new = bench.rewrite(dialect, program.as_bytes());
    let found: Vec<String> = new.remarks.iter().map(|r| format!("{} {} {}: {}", r.line, r.blocks, r.what, r.reason)).collect();
    assert_eq!(new.remarks.len(), expected.len(), "{found:#?}");
    for (remark, (line, blocks, word)) in new.remarks.iter().zip(expected) {
        let said = format!("{} {}", remark.what, remark.reason);
        assert!(remark.line == *line && remark.blocks == *blocks && said.contains(word), "{word}: {found:#?}");
        assert!(!remark.remedy.is_empty());
    }
    assert_eq!(new.is_whole(), !expected.iter().any(|(_, blocks, _)| *blocks));
}

#[test]
fn what_cannot_be_rewritten_is_told_by_its_line() {
    let (kr6, ur5) = (Bench::kr6(), Bench::ur5());
    let home = "A1 0,A2 -90,A3 90,A4 0,A5 20,A6 0";
    told(
        &kr6,
        Dialect::Krl,
        &format!(
            "DEF a()\nPTP {{{home}}}\nPTP {{X 9000,Y 0,Z 0,A 0,B 0,C 0}}\nLIN {{Z 50}}\nLIN_REL {{Z 5}}\nPTP XP7\n\
             LIN XP1:{{X 0,Y 0,Z 1,A 0,B 0,C 0}}\nXP2=$POS_ACT\nLIN XP2\n\
             PTP {{A1 0,A2 X,A3 90,A4 0,A5 0,A6 0}}\nPTP {{A1 500,A2 -90,A3 90,A4 0,A5 20,A6 0}}\nEND\n"
        ),
        &[
            (3, true, "no posture"),
            (4, true, "six numbers"),
            (5, false, "relative"),
            (6, false, "not written out"),
            (7, false, "run time"),
            (8, false, "run time"),
            (9, false, "not written out"),
            (10, true, "six numbers"),
            (11, true, "limit"),
        ],
    );
    told(
        &kr6,
        Dialect::Krl,
        &format!("DEF a()\n$TOOL={{X 9,Y 9,Z 9,A 0,B 0,C 0}}\nPTP {{{home}}}\nPTP {{{home}}}\nEND\n"),
        &[(2, true, "another tool")],
    );
    told(
        &ur5,
        Dialect::UrScript,
        "def a():\n  movel(p[9, 0, 0, 0, 0, 0])\n  movej([0, x, 1, 1, 1, 1])\n  movel(pose_trans(q, p[0, 0, 0.1, 0, 0, 0]))\n\
         \x20 here = get_actual_tcp_pose()\n  movel(here, v=0.1)\n  set_tcp(p[0, 0, 0.5, 0, 0, 0])\n  free = p[0, 0, 1, 0, 0, 0]\nend\n",
        &[(2, true, "movel"), (3, true, "written out"), (4, false, "run time"), (5, false, "run time"), (6, false, "run time")],
    );
    told(
        &kr6,
        Dialect::Rapid,
        "MODULE m\nCONST robtarget p1:=[[9000,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\n\
         CONST robtarget p2:=[[x,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\n\
         CONST robtarget p3:=[[400,0,500],[1,1,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\n\
         PROC main()\nMoveL p1,v100,fine,gun;\nMoveL Offs(p1,0,0,10),v100,z10,gun;\nMoveJ p9,v100,fine,gun\\WObj:=w1;\nENDPROC\nENDMODULE\n",
        &[(2, true, "no posture"), (3, true, "written out"), (4, false, "quaternion"), (7, false, "Offs"), (8, false, "p9")],
    );
    let fanuc = "/PROG A\n/MN\n 1:J P[1] 100% FINE ;\n 2:L P[2] 10mm/sec FINE INC ;\n 3:L PR[1] 10mm/sec FINE ;\n 4:L P[1] 10mm/sec FINE Offset,PR[2] ;\n\
        \x205:  !P[7] ;\n 6:J P[9] 100% FINE ;\n/POS\nP[1]{\n GP1:\n UF : 0, UT : 1,\n J1= 0 deg, J2= -90 deg, J3= 90 deg, J4= 0 deg, J5= 20 deg, J6= 0 deg\n};\n\
        P[2]{\n GP1:\n UF : 0, UT : 1, CONFIG : 'N U T, 0, 0, 0',\n X = 1 mm, Y = 1 mm, Z = 1 mm, W = 0 deg, P = 0 deg, R = 0 deg\n};\n\
        P[3]{\n GP1:\n UF : 0, UT : 2, CONFIG : 'N U T, 0, 0, 0',\n X = 1 mm, Y = 1 mm, Z = 1 mm, W = 0 deg, P = 0 deg, R = 0 deg\n};\n\
        P[4]{\n GP1:\n UF : 0, UT : 1, CONFIG : 'N U T, 0, 0, 0',\n X = ****** mm, Y = 1 mm, Z = 1 mm, W = 0 deg, P = 0 deg, R = 0 deg\n};\n/END\n";
    let after = [
        (1, true, "several tools"),
        (4, false, "relative"),
        (5, false, "register"),
        (6, false, "offset"),
        (8, false, "not in the file"),
    ];
    let later = [(10, true, "UT 1"), (15, false, "INC"), (20, true, "UT 2"), (25, true, "not taught")];
    let mut compensator = Compensator::new(&kr6.calibration, &TASK).unwrap();
    let program = Program { path: "a.ls".into(), dialect: Dialect::Fanuc, bytes: fanuc.into() };
    let as_pendant = rewrite_programs(&[program], &mut compensator, &Permissions::default()).remove(0);
    assert!(as_pendant.remarks.iter().any(|r| r.line == 10 && r.blocks && r.reason.contains("J3 turns with J2")));
    told(&kr6, Dialect::Fanuc, fanuc, &[&after[..], &later[..]].concat());
}

#[test]
fn bytes_in_latin_1_move_nothing() {
    let kr6 = Bench::kr6();
    let program = |name: &[u8]| {
        let [before, after] = [
            &b"MODULE M\n PROC main()\n  IF "[..],
            b" MoveL [[400,10,450],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;\n ENDPROC\nENDMODULE\n",
        ];
        [before, name, after].concat()
    };
    let [plain, latin] = [&b"prets"[..], b"pr\xeats"].map(|name| kr6.rewrite(Dialect::Rapid, &program(name)));
    assert_eq!(plain.positions, 1, "{:?}", plain.remarks);
    assert_eq!((latin.rewritten, latin.remarks), (plain.rewritten, plain.remarks));
}

#[test]
fn a_number_keeps_apart_from_its_key() {
    let kr6 = Bench::kr6();
    let ([x, y, z], [a, b, c]) = angles(&kr6.world_pose(&[0.3, -1.4, 1.6, 0.2, 0.7, 0.4]));
    let krl = format!("LIN {{X{x:+},Y{y:+},Z{z:+},A{a:+},B{b:+},C{c:+}}}\n");
    let first = kr6.rewrite(Dialect::Krl, krl.as_bytes());
    assert_eq!(first.rewritten.len(), 1, "{:?}", first.remarks);
    let again = kr6.rewrite(Dialect::Krl, &first.bytes);
    assert_eq!(again.rewritten.len(), 1, "{}", String::from_utf8_lossy(&first.bytes));
}

#[test]
fn broken_programs_are_no_panic() {
    let kr6 = Bench::kr6();
    let pose = kr6.world_pose(&[0.3, -1.4, 1.6, 0.2, 0.7, 0.4]);
    let ([x, y, z], [a, b, c]) = angles(&pose);
    let v = UnitQuaternion::from_rotation_matrix(&pose.rotation);
    let target = format!("[[{x},{y},{z}],[{},{},{},{}],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]", v.w, v.i, v.j, v.k);
    let programs: [(Dialect, String); 6] = [
        (
            Dialect::Krl,
            format!(
                "DEF a()\r\n$BASE={{X 0,Y 0,Z 0,A 0,B 0,C 0}}\r\nDECL E6POS XP1={{X {x},Y {y},Z {z},A {a},B {b},C {c},S 'B010',T 2,E1 0}}\r\n\
                 LIN XP1:{{X 1}}\r\nPTP {{A1 0,A2 -90,A3 90,A4 0,A5 20,A6 0}} ;x\r\n"
            ),
        ),
        (
            Dialect::UrScript,
            "way=p[0.4,0.1,0.3,3.1,0,0]\nmovel(get_inverse_kin(way,qnear=q))\nmovej([0.1,-1.2,1.1,0.3,0.4,0.5],a=1) # x\nset_tcp(p[0,0,0,0,0,0])\n".into(),
        ),
        (
            Dialect::Rapid,
            format!(
                "CONST robtarget p{{2}}:=[{target},{target}];\nPERS tooldata t:=[TRUE,[[0,0,0],[1,0,0,0]],[1]];\nMoveL p{{1}},v1,z1,u\\WObj:=w;\n"
            ),
        ),
        (
            Dialect::Fanuc,
            format!(
                "/MN\n 1:L P[1] 10mm/sec FINE Offset,PR[2] ;\n/POS\nP[1]{{\n GP1:\n UF : 0, UT : 1, CONFIG : 'N U T, 0, 0, 0',\n \
                 X = {x} mm, Y = {y} mm, Z = {z} mm, W = {c} deg, P = {b} deg, R = {a} deg\n}};\n/END\n"
            ),
        ),
        (
            Dialect::Yaskawa,
            format!(
                "/JOB\n//POS\n///TOOL 1\n///POSTYPE BASE\n///RECTAN\n///RCONF 0,0,0,0,0,0\nC00000={x},{y},{z},{c},{b},{a}\n\
                 ///RCONF x\nC00001={x},{y},{z},{c},{b},{a}\nBC00001=0\n//INST\nMOVL C00001 BC00001 V=1\nSETE P001 (3) D0\nMFRAME UF#(2) C0\n"
            ),
        ),
        (
            Dialect::Val3,
            format!(
                "<Datas><!-- c --><Data name=\"j\" type=\"jointRx\"><Value key=\"0\" j2=\"-90\" j3=\"90\" j5=\"20\"/></Data><Data name=\"p\" type=\"pointRx\"><Value key=\"0\" x=\"400\" z=\"500\" ry=\"90\" elbow=\"esame\"/>\n\
                 </Data><Data name=\"f\" type=\"frame\"><Value key=\"0\" x=\"{}\" fatherId=\"f[1]\"/><Value key=\"1\" fatherId=\"world[0]\"/></Data>",
                0.0
            ),
        ),
    ];
    let mut random = ChaCha8Rng::seed_from_u64(9);
    let odd = b"{}[]()'\";,:=.\\!#\n\r/pP-e9\xff\0";
    for (dialect, program) in programs {
        let program = program.as_str();
        let whole = kr6.rewrite(dialect, program.as_bytes());
        assert!(!whole.rewritten.is_empty(), "{dialect:?}: {:?}", whole.remarks);
        for length in 0..program.len() {
            kr6.rewrite(dialect, &program.as_bytes()[..length]);
        }
        for _ in 0..1000 {
            let mut bytes = program.as_bytes().to_vec();
            for _ in 0..random.random_range(1..6) {
                let at = random.random_range(0..bytes.len());
                if random.random_bool(0.1) {
                    // As of a name in Latin-1, or of a file that is none.
                    let end = (at + random.random_range(1..60)).min(bytes.len());
                    bytes[at..end].fill(0xe9);
                    continue;
                }
                bytes[at] = if random.random_bool(0.7) { odd[random.random_range(0..odd.len())] } else { random.random() };
            }
            let new = kr6.rewrite(dialect, &bytes);
            if new.rewritten.is_empty() {
                assert_eq!(new.bytes, bytes, "nothing is rewritten, and nothing changes");
            }
            let positions = kr6.rewrite(dialect, &new.bytes).positions;
            assert_eq!(positions, new.positions, "{dialect:?}: {:?}", String::from_utf8_lossy(&bytes));
        }
    }
}
