//! Programs in the style of the controllers' own editors: every position in its own tool and base, every construct that moves
//! told by its line, nothing refused without cause.

use std::f64::consts::PI;

use calibench::compensate::{Compensator, Desired, Target, Task, WorkFrame};
use calibench::robot::inverse::StatusTurn;
use calibench::robot::{FramePose, Pose, built_in};
use calibench::units::{DEG, MM};
use calibench_programs::{Dialect, Permissions, Program, Remark, RewrittenProgram, rewrite_programs};
use nalgebra::{Matrix3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::a_program_is_rewritten_and_nothing_else::{Bench, Writer, angles, of_angles, quadrant};
use crate::identified::calibration_of;

/// The targets of the programs are in frames of their own: the base link and the flange.
pub const BARE: Task = Task {
    setup: None,
    frame: WorkFrame::Base(FramePose { xyz: [0.0; 3], rz_ry_rx: [0.0; 3] }),
    tool: Some(FramePose { xyz: [0.0; 3], rz_ry_rx: [0.0; 3] }),
    payload: None,
};
/// Tools and bases by their number, X, Y, Z (mm), A, B, C (deg).
pub const TOOLS: [[f64; 6]; 3] = [[0.0; 6], [10.0, -4.0, 120.0, 0.0, 5.0, 0.0], [0.0, 35.0, 90.0, 30.0, 0.0, -20.0]];
pub const BASES: [[f64; 6]; 3] = [[0.0; 6], [300.0, -120.0, 40.0, 15.0, 0.0, 0.0], [-50.0, 210.0, 80.0, -90.0, 3.0, 1.0]];
/// Programs generated for each dialect.
pub const PROGRAMS: u64 = 6;
/// Positions of each.
pub const POSITIONS: usize = 24;

pub fn pose_of([x, y, z, a, b, c]: [f64; 6]) -> Pose {
    of_angles([x, y, z], [a, b, c])
}

pub fn rewrite(bench: &Bench, dialect: Dialect, files: &[(&str, Vec<u8>)], permissions: &Permissions) -> Vec<RewrittenProgram> {
    let mut compensator = Compensator::new(&bench.calibration, &BARE).unwrap();
    let of = |(path, bytes): &(&str, Vec<u8>)| Program { path: path.into(), dialect, bytes: bytes.clone() };
    rewrite_programs(&files.iter().map(of).collect::<Vec<_>>(), &mut compensator, permissions)
}

/// A position as it was generated: its posture, and the numbers of its tool and its base.
pub struct Made {
    pub q: Vec<f64>,
    pub tool: usize,
    pub base: usize,
}

impl Made {
    /// Its pose in its base, by arithmetic of this test alone.
    pub fn pose(&self, bench: &Bench) -> Pose {
        let link_from_flange = Compensator::new(&bench.calibration, &BARE).unwrap().nominal_pose(&self.q);
        pose_of(BASES[self.base]).inverse() * link_from_flange * pose_of(TOOLS[self.tool])
    }

    /// Asserts that `new` is what the controller must be sent so that the tool reaches `old`, both in the position's frames.
    pub fn holds(&self, bench: &Bench, old: Pose, new: Pose) {
        let frame =
            |[x, y, z, a, b, c]: [f64; 6]| FramePose { xyz: [x, y, z].map(|v| v * MM), rz_ry_rx: [a, b, c].map(|v| v * DEG) };
        let task = Task { frame: WorkFrame::Base(frame(BASES[self.base])), tool: Some(frame(TOOLS[self.tool])), ..BARE };
        let mut own = Compensator::new(&bench.calibration, &task).unwrap();
        let desired = Desired::Pose { pose: old, near: Some(self.q.clone()), status: None, turn: None };
        let target = Target { id: "t".into(), desired, payload: None, conditions: Default::default() };
        let fake = own.compensate(&target).outcome.unwrap().pose;
        let apart = fake.inverse() * new;
        let shift = (old.inverse() * new).translation.vector.norm();
        assert!(shift > 0.01 * MM, "it was rewritten");
        // The identified arm is met to 1 nm, from two starts.
        assert!(
            apart.translation.vector.norm() < 1e-5 * MM && (apart.rotation.matrix() - Matrix3::identity()).norm() < 1e-9,
            "{apart:?}"
        );
    }
}

/// What is told must be the lines expected, none of them a refusal.
pub fn told(new: &RewrittenProgram, expected: &[usize]) {
    // With other tools some postures are near a singularity, which is told as well.
    let others = new.remarks.iter().filter(|r| !r.reason.starts_with("near a singularity"));
    let lines: Vec<usize> = others.map(|r| r.line).collect();
    assert_eq!(lines, expected, "{:#?}", new.remarks);
    assert!(new.is_whole(), "{:#?}", new.remarks);
}

pub fn line(w: &Writer) -> usize {
    1 + w.bytes().iter().filter(|b| **b == b'\n').count()
}

pub struct Random(pub ChaCha8Rng);

impl Random {
    pub fn below(&mut self, most: usize) -> usize {
        self.0.random_range(0..most)
    }

    pub fn made(&mut self, bench: &Bench) -> Made {
        let q = bench.postures[self.below(bench.postures.len())].clone();
        Made { q, tool: 1 + self.below(2), base: 1 + self.below(2) }
    }
}

pub fn krl_numbers(w: &mut Writer, bench: &Bench, made: &Made) {
    let (xyz, abc) = angles(&made.pose(bench));
    for (k, (name, value)) in "XYZABC".chars().zip(xyz.into_iter().chain(abc)).enumerate() {
        w.fixed(format!("{}{name} ", if k > 0 { "," } else { "" })).number(value, 6);
    }
    let StatusTurn { status, turn } = StatusTurn::of(&bench.wrist(), made.q[..].try_into().unwrap());
    w.fixed(",S ").number(f64::from(status), 0).fixed(",T ").number(f64::from(turn), 0);
    w.fixed(",E1 0.0,E2 0.0");
}

#[test]
fn krl_of_inline_forms_and_of_experts() {
    let bench = Bench::kr6();
    for seed in 0..PROGRAMS {
        let mut random = Random(ChaCha8Rng::seed_from_u64(seed));
        let (mut src, mut dat) = (Writer::new(), Writer::new());
        let (mut in_src, mut in_dat) = (Vec::new(), Vec::new());
        let mut warned = Vec::new();
        src.fixed("&ACCESS RVP\r\n&REL 12\r\nDEF job( )\r\n;FOLD INI;%{PE}\r\n  BAS (#INITMOV,0 )\r\n;ENDFOLD (INI)\r\n");
        dat.fixed("&ACCESS RVP\r\nDEFDAT  JOB\r\nEXT  BAS (BAS_COMMAND  :IN,REAL  :IN )\r\nDECL INT SUCCESS\r\n");
        // A place for positions computed later, and one that nobody goes to.
        dat.fixed("DECL E6POS XHERE={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0,S 0,T 0,E1 0.0}\r\n");
        for k in 1..=POSITIONS {
            let made = random.made(&bench);
            let Made { tool, base, .. } = made;
            let form = |dat: &mut Writer| {
                dat.fixed(format!("DECL E6POS XP{k}={{"));
                krl_numbers(dat, &bench, &made);
                dat.fixed(format!(
                    "}}\r\nDECL FDAT FP{k}={{TOOL_NO {tool},BASE_NO {base},IPO_FRAME #BASE,POINT2[] \" \",TQ_STATE FALSE}}\r\n"
                ));
            };
            match random.below(6) {
                0 => {
                    form(&mut dat);
                    let verb = ["PTP", "LIN"][random.below(2)];
                    src.fixed(format!(
                        ";FOLD {verb} P{k} Vel=100 % PDAT{k} Tool[{tool}]:gun Base[{base}]:jig;%{{PE}}\r\n$BWDSTART=FALSE\r\nPDAT_ACT=PPDAT{k}\r\n\
                         FDAT_ACT=FP{k}\r\nBAS(#PTP_PARAMS,100)\r\n{verb} XP{k} C_DIS\r\n;ENDFOLD\r\n"
                    ));
                    in_dat.push(made);
                }
                1 => {
                    form(&mut dat);
                    let verb = ["SPTP", "SLIN"][random.below(2)];
                    src.fixed(format!(
                        "  {verb} XP{k} WITH $VEL_AXIS[1] = SVEL_JOINT(100.0), $TOOL = STOOL2(FP{k}), $BASE = SBASE(FP{k}.BASE_NO), \
                         $IPO_MODE = SIPO_MODE(FP{k}.IPO_FRAME), $LOAD = SLOAD(FP{k}.TOOL_NO), $APO = SAPO_PTP(PPDAT{k}) C_SPL\r\n"
                    ));
                    in_dat.push(made);
                }
                2 => {
                    src.fixed(format!(
                        "$TOOL=TOOL_DATA[{tool}]\r\n$BASE=BASE_DATA[{base}]\r\n{} {{",
                        ["LIN", "ptp", "SLIN"][random.below(3)]
                    ));
                    krl_numbers(&mut src, &bench, &made);
                    src.fixed("} C_DIS ; {X 1,Y 2}\r\n");
                    in_src.push(made);
                }
                3 => {
                    src.fixed(format!("BAS(#TOOL,{tool})\r\nBAS (#BASE, {base})\r\nSPLINE WITH $APO={{CDIS 5}}\r\n"));
                    for _ in 0..2 {
                        let other = Made { q: random.made(&bench).q, ..Made { q: Vec::new(), tool, base } };
                        src.fixed(format!("  {} {{E6POS: ", ["SPL", "SLIN"][random.below(2)]));
                        krl_numbers(&mut src, &bench, &other);
                        src.fixed("}\r\n");
                        in_src.push(other);
                    }
                    src.fixed("ENDSPLINE\r\n");
                }
                4 => {
                    // Whichever side is taken, the base is the same.
                    src.fixed(format!(
                        "IF $IN[3]==TRUE THEN\r\n$BASE=BASE_DATA[{base}]\r\nELSE\r\n$BASE = BASE_DATA[ {base} ]\r\nENDIF\r\n$TOOL=TOOL_DATA[{tool}]\r\nWHILE $IN[4]\r\nLIN {{"
                    ));
                    krl_numbers(&mut src, &bench, &made);
                    src.fixed("}\r\nENDWHILE\r\n");
                    in_src.push(made);
                }
                _ => {
                    warned.push(line(&src));
                    let verb = ["LIN_REL", "PTP_REL", "SLIN_REL", "SPTP_REL"][random.below(4)];
                    src.fixed(format!("{verb} {{Z 20}} #BASE\r\n"));
                    warned.push(line(&src));
                    src.fixed("LIN Approach(XHERE, 50)\r\n");
                    warned.push(line(&src));
                    src.fixed("XHERE=$POS_ACT\r\n");
                    src.fixed("LIN XHERE\r\n");
                }
            }
        }
        src.fixed("END\r\n");
        dat.fixed("ENDDAT\r\n");
        let list = |name: &str, frames: &[[f64; 6]]| {
            let one = |(k, [x, y, z, a, b, c]): (usize, &[f64; 6])| {
                format!("{name}[{k}]={{X {x},Y {y},Z {z},A {a},B {b},C {c}}}\r\n")
            };
            frames.iter().enumerate().skip(1).map(one).collect::<String>()
        };
        let config = format!("DEFDAT $CONFIG\r\n{}{}ENDDAT\r\n", list("TOOL_DATA", &TOOLS), list("BASE_DATA", &BASES));
        let files = [("job.src", src.bytes()), ("job.dat", dat.bytes()), ("$config.dat", config.clone().into_bytes())];
        let new = rewrite(&bench, Dialect::Krl, &files, &Permissions::default());
        told(&new[0], &warned);
        told(&new[1], if new[1].remarks.is_empty() { &[] } else { &[5] });
        assert_eq!(new[2].bytes, config.as_bytes());
        for (w, made, new) in [(&src, &in_src, &new[0]), (&dat, &in_dat, &new[1])] {
            let (old, numbers) = (w.old_numbers(), w.numbers_of(&new.bytes));
            let pose = |n: &[f64]| of_angles([n[0], n[1], n[2]], [n[3], n[4], n[5]]);
            assert_eq!(old.len(), 8 * made.len());
            for (k, made) in made.iter().enumerate() {
                made.holds(&bench, pose(&old[8 * k..]), pose(&numbers[8 * k..]));
            }
        }
        // Without the numbers of the frames nothing is guessed.
        let bare = rewrite(&bench, Dialect::Krl, &files[..2], &Permissions::default());
        assert!(bare.iter().all(|new| new.rewritten.is_empty()) && bare.iter().any(|new| !new.is_whole()));
    }
}

#[test]
fn rapid_of_the_pendant_and_of_offline_programming() {
    let bench = Bench::other();
    let wrist = bench.wrist();
    let status = |q: &[f64]| StatusTurn::of(&wrist, q.try_into().unwrap()).status;
    let cfx = |s: u8| f64::from((s & 1) << 2 | (!s & 2) | s >> 2 & 1);
    for seed in 0..PROGRAMS {
        let mut random = Random(ChaCha8Rng::seed_from_u64(seed));
        let mut w = Writer::new();
        w.fixed("MODULE Job\r\n");
        for (k, (tool, base)) in TOOLS.into_iter().zip(BASES).enumerate().skip(1) {
            let list = |f: [f64; 6]| {
                let q = UnitQuaternion::from_rotation_matrix(&pose_of(f).rotation);
                format!("[[{},{},{}],[{:.10},{:.10},{:.10},{:.10}]]", f[0], f[1], f[2], q.w, q.i, q.j, q.k)
            };
            w.fixed(format!("  PERS tooldata tGun{k}:=[TRUE,{},[1,[0,0,50],[1,0,0,0],0,0,0]];\r\n", list(tool)));
            w.fixed(format!("  TASK PERS wobjdata wJig{k}:=[FALSE,TRUE,\"\",[[0,0,0],[1,0,0,0]],{}];\r\n", list(base)));
        }
        w.fixed("  PERS robtarget pStore:=[[0,0,0],[1,0,0,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];\r\n");
        let numbers = |w: &mut Writer, made: &Made| {
            let pose = made.pose(&bench);
            let v = UnitQuaternion::from_rotation_matrix(&pose.rotation);
            let comma = |k: usize| if k > 0 { "," } else { "" };
            w.fixed("[[");
            pose.translation.vector.iter().enumerate().for_each(|(k, v)| _ = w.fixed(comma(k)).number(v / MM, 6));
            w.fixed("],[");
            [v.w, v.i, v.j, v.k].into_iter().enumerate().for_each(|(k, v)| _ = w.fixed(comma(k)).number(v, 10));
            w.fixed("],[");
            let q = &made.q;
            let conf = [quadrant(q[0]), quadrant(q[3]), quadrant(q[5]), cfx(status(q))];
            conf.into_iter().enumerate().for_each(|(k, v)| _ = w.fixed(comma(k)).number(v, 0));
            w.fixed("],[9E9,9E+09,9E9,9E9,9E9,9E9]]");
        };
        let mut all = Vec::new();
        for k in 0..POSITIONS {
            let made = random.made(&bench);
            w.fixed(format!("  CONST robtarget p{k}:="));
            numbers(&mut w, &made);
            w.fixed(";\r\n");
            all.push(made);
        }
        w.fixed("  PROC main()\r\n    ConfL\\Off;\r\n");
        let mut warned = Vec::new();
        for k in 0..POSITIONS {
            let (tool, base) = (format!("tGun{}", all[k].tool), format!("wJig{}", all[k].base));
            match random.below(6) {
                0 => w.fixed(format!("    MoveL p{k},v100,z10,{tool}\\WObj:={base};\r\n")),
                1 => w.fixed(format!("    IF di1=1 MoveJ p{k}, v200\\T:=3, fine, {tool} \\WObj:={base} ;\r\n")),
                2 => w.fixed(format!("    TriggL p{k},v100,tr1,z5,{tool}\\WObj:={base};\r\n")),
                3 => w.fixed(format!("    ArcL p{k},v100,sm1,wd1,fine,{tool}\\WObj:={base};\r\n")),
                4 => {
                    warned.push(line(&w));
                    w.fixed(format!("    MoveL Offs(p{k},0,0,50),v100,fine,{tool}\\WObj:={base};\r\n"))
                }
                _ => {
                    warned.push(line(&w) + 1);
                    w.fixed(format!(
                        "    SearchL\\Stop,di1,pStore,p{k},v10,{tool}\\WObj:={base};\r\n    pStore:=CRobT(\\Tool:={tool});\r\n"
                    ));
                    w.fixed(format!("    MoveL pStore,v100,fine,{tool}\\WObj:={base};\r\n"))
                }
            };
        }
        w.fixed("  ENDPROC\r\nENDMODULE\r\n");
        let new = rewrite(&bench, Dialect::Rapid, &[("job.mod", w.bytes())], &Permissions::default()).remove(0);
        // The store is told where it cannot be reached, and that several tools use it.
        let others: Vec<&Remark> = new.remarks.iter().filter(|r| r.line != 6).collect();
        assert_eq!(others.iter().map(|r| r.line).collect::<Vec<_>>(), warned, "{others:#?}");
        assert!(new.is_whole(), "{:#?}", new.remarks);
        let (old, numbers) = (w.old_numbers(), w.numbers_of(&new.bytes));
        let pose = |n: &[f64]| {
            let rotation = UnitQuaternion::from_quaternion(Quaternion::new(n[3], n[4], n[5], n[6])).to_rotation_matrix();
            Pose::from_parts(Translation3::from(Vector3::new(n[0], n[1], n[2]) * MM), rotation)
        };
        for (k, made) in all.iter().enumerate() {
            made.holds(&bench, pose(&old[11 * k..]), pose(&numbers[11 * k..]));
        }
    }
}

#[test]
fn urscript_with_several_tools() {
    let bench = Bench::ur5();
    for seed in 0..PROGRAMS {
        let mut random = Random(ChaCha8Rng::seed_from_u64(seed));
        let mut w = Writer::new();
        w.fixed("def job():\n  global store_p=p[0,0,0,0,0,0]\n");
        let (mut all, mut warned) = (Vec::new(), Vec::new());
        for k in 0..POSITIONS {
            let made = Made { base: 0, ..random.made(&bench) };
            let tool = pose_of(TOOLS[made.tool]);
            let (t, r) = (tool.translation.vector, tool.rotation.scaled_axis());
            let set = format!("set_tcp(p[{},{},{},{},{},{}])", t.x, t.y, t.z, r.x, r.y, r.z);
            let near: Vec<String> = made.q.iter().map(|q| format!("{q:.4}")).collect();
            let numbers = |w: &mut Writer| {
                let pose = made.pose(&bench);
                let (t, r) = (pose.translation.vector, pose.rotation.scaled_axis());
                w.fixed("p[");
                t.iter()
                    .chain(r.iter())
                    .enumerate()
                    .for_each(|(k, v)| _ = w.fixed(if k > 0 { ", " } else { "" }).number(*v, 9));
                w.fixed("]");
            };
            match random.below(3) {
                0 => {
                    w.fixed(format!("  if digital_in(1):\n    {set}\n  else:\n    {set}\n  end\n  movel(get_inverse_kin("));
                    numbers(&mut w);
                    w.fixed(format!(", qnear=[{}]), a=1.2, v=0.25)\n", near.join(", ")));
                }
                1 => {
                    w.fixed(format!("  global way_{k}_p="));
                    numbers(&mut w);
                    w.fixed(format!("\n  {set}\n  movel(get_inverse_kin(way_{k}_p, qnear=[{}]))\n", near.join(", ")));
                }
                _ => {
                    warned.extend([line(&w), line(&w) + 1]);
                    w.fixed("  store_p=pose_trans(store_p, p[0,0,0.1,0,0,0])\n  movel(pose_add(store_p, p[0,0,0.1,0,0,0]))\n");
                    w.fixed("  movel(store_p)\n");
                    continue;
                }
            }
            all.push(made);
        }
        w.fixed("end\n");
        let new = rewrite(&bench, Dialect::UrScript, &[("job.script", w.bytes())], &Permissions::default()).remove(0);
        // Of another tool some postures are near a singularity, which is told as well.
        let is_other = |r: &&Remark| r.line != 2 && !r.reason.starts_with("near a singularity");
        let others: Vec<&Remark> = new.remarks.iter().filter(is_other).collect();
        assert_eq!(others.iter().map(|r| r.line).collect::<Vec<_>>(), warned, "{others:#?}");
        assert!(new.is_whole(), "{:#?}", new.remarks);
        let (old, numbers) = (w.old_numbers(), w.numbers_of(&new.bytes));
        let pose =
            |n: &[f64]| Pose::from_parts(Translation3::new(n[0], n[1], n[2]), Rotation3::new(Vector3::new(n[3], n[4], n[5])));
        for (k, made) in all.iter().enumerate() {
            made.holds(&bench, pose(&old[6 * k..]), pose(&numbers[6 * k..]));
        }
    }
}

/// One program, and what is told of it: the line, whether it blocks, a word of it.
pub fn says(
    bench: &Bench,
    dialect: Dialect,
    program: &str,
    permissions: &Permissions,
    expected: &[(usize, bool, &str)],
) -> RewrittenProgram {
    let new = rewrite(bench, dialect, &[("a.x", program.into())], permissions).remove(0);
    let all: Vec<String> = new.remarks.iter().map(|r| format!("{} {} {}: {}", r.line, r.blocks, r.what, r.reason)).collect();
    assert_eq!(new.remarks.len(), expected.len(), "{all:#?}");
    for (remark, (line, blocks, word)) in new.remarks.iter().zip(expected) {
        let words = format!("{}: {}", remark.what, remark.reason);
        assert!(remark.line == *line && remark.blocks == *blocks && words.contains(word), "{word}: {all:#?}");
    }
    if new.rewritten.is_empty() {
        assert_eq!(new.bytes, program.as_bytes());
    }
    new
}

#[test]
fn what_moves_at_run_time_or_is_unknown_is_told() {
    let kr6 = Bench::kr6();
    let none = Permissions::default();
    let given = Permissions { tool_given: true, base_given: true, ..Permissions::default() };
    let ([x, y, z], [a, b, c]) =
        angles(&Compensator::new(&kr6.calibration, &BARE).unwrap().nominal_pose(&[0.3, -1.4, 1.6, 0.2, 0.7, 0.4]));
    let p = format!("X {x},Y {y},Z {z},A {a},B {b},C {c}");
    // Every motion word.
    let words: Vec<String> =
        ["PTP", "LIN", "SPTP", "SLIN", "SPL"].into_iter().map(|verb| format!("{verb} {{{p}}}\n")).collect();
    let circles: Vec<String> =
        ["CIRC", "SCIRC"].into_iter().map(|verb| format!("{verb} {{{p}}},{{{p}}},CA 90 C_DIS\n")).collect();
    let new = says(&kr6, Dialect::Krl, &format!("{}{}", words.concat(), circles.concat()), &none, &[]);
    assert_eq!(new.rewritten.len(), 9);
    let relative = "PTP_REL {A1 5}\nLIN_REL {Z 5}\nCIRC_REL {Z 5},{Z 6}\nSPTP_REL {Z 5}\nSLIN_REL {Z 5}\nSCIRC_REL {Z 5},{Z 6}\nSPL_REL {Z 5}\n";
    says(&kr6, Dialect::Krl, relative, &none, &[1, 2, 3, 4, 5, 6, 7].map(|line| (line, false, "relative")));
    for (program, permissions, expected) in [
        (format!("LIN Where(1)\nLIN {{{p}}}\n"), &none, &[(1, false, "function")][..]),
        (
            format!("$BASE=BASE_DATA[4]\nLIN {{{p}}}\n"),
            &none,
            &[(2, true, "BASE_DATA[4]: the numbers of this base are not in the files")],
        ),
        (format!("$BASE=BASE_DATA[4]\nLIN {{{p}}}\n"), &given, &[]),
        (
            format!("BASE_DATA[4].X=BASE_DATA[4].X+2\n$BASE=BASE_DATA[4]\nLIN {{{p}}}\n"),
            &given,
            &[(1, false, "BASE_DATA[4].X: the base is changed")],
        ),
        (format!("$BASE=Found()\nLIN {{{p}}}\n"), &none, &[(1, true, "computed at run time")]),
        (format!("$BASE=Found()\nLIN {{{p}}}\n"), &given, &[(1, false, "computed at run time")]),
        (
            format!("DECL E6POS H\nH={{{p}}}\nH.Z=H.Z+5\nLIN H\n"),
            &none,
            &[(3, false, "H.Z: one of its numbers is set at run time")],
        ),
        (format!("LIN {{X 1,{p}}}\n"), &none, &[(1, true, "X twice")]),
        (format!("LIN {{{p},E1 500}}\nLIN {{{p},E1 0}}\n"), &none, &[(1, true, "E1 500")]),
        (
            format!("$BASE=EK(MACHINE_DEF[2].ROOT,MACHINE_DEF[2].MECH_TYPE,{{X 1,Y 0,Z 0,A 0,B 0,C 0}})\nLIN {{{p}}}\n"),
            &given,
            &[(2, true, "external axes")],
        ),
        (
            format!(
                "IF $IN[1] THEN\n$BASE={{X 1,Y 0,Z 0,A 0,B 0,C 0}}\nELSE\n$BASE={{X 2,Y 0,Z 0,A 0,B 0,C 0}}\nENDIF\nLIN {{{p}}}\n"
            ),
            &none,
            &[(6, true, "several bases")],
        ),
    ] {
        says(&kr6, Dialect::Krl, &program, permissions, expected);
    }
    let v = UnitQuaternion::from_rotation_matrix(&of_angles([x, y, z], [a, b, c]).rotation);
    let t = format!("[[{x},{y},{z}],[{},{},{},{}],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]]", v.w, v.i, v.j, v.k);
    let job = |body: &str| {
        format!("MODULE m\nCONST robtarget p1:={t};\nPROC main()\n{body}\nENDPROC\nENDMODULE\n")
            .replace("[0,0,0,0],[9", "[x,x,x,x],[9")
    };
    let unknown = [(2, true, "tGrip: the numbers of this tool"), (2, true, "wTray: the numbers of this base")];
    says(&kr6, Dialect::Rapid, &job("MoveL p1,v1,fine,tGrip\\WObj:=wTray;"), &none, &unknown);
    assert_eq!(says(&kr6, Dialect::Rapid, &job("MoveL p1,v1,fine,tGrip\\WObj:=wTray;"), &given, &[]).rewritten.len(), 1);
    let changed = [(4, false, "wTray.oframe.trans.x: the work object is changed")];
    says(&kr6, Dialect::Rapid, &job("wTray.oframe.trans.x:=5;\nMoveL p1,v1,fine,tGrip\\WObj:=wTray;"), &given, &changed);
    let part = [(4, false, "p1.trans.z: one of its numbers")];
    assert!(says(&kr6, Dialect::Rapid, &job("p1.trans.z:=5;\nMoveL p1,v1,fine,tool0;"), &none, &part).rewritten.is_empty());
    let ur5 = Bench::ur5();
    let script = "w_p=p[0.3,0.2,0.4,0,3,0]\nw_p[2]=0.415+0.2\nmovel(w_p)\n";
    assert!(says(&ur5, Dialect::UrScript, script, &none, &[(2, false, "w_p[2]: one of its numbers")]).rewritten.is_empty());
    says(
        &ur5,
        Dialect::UrScript,
        "set_tcp(mine)\nmovel(p[0.3,0.2,0.4,0,3,0])\n",
        &none,
        &[(2, true, "mine: the numbers of this tool")],
    );
    let point = |name: &str, j: f64| {
        format!(
            "{name}{{\n GP1:\n UF : 6, UT : 5, CONFIG : 'N U T, 0, 0, 0',\n X = {x} mm, Y = {y} mm, Z = {z} mm,\n W = {c} deg, P = {b} deg, R = {a} deg\n GP2:\n UF : 1, UT : 2,\n J1= {j} deg\n}};\n"
        )
    };
    let fanuc = |motions: &str, points: &[String]| format!("/PROG A\n/MN\n{motions}/POS\n{}/END\n", points.concat());
    let still = [point("P[1]", 0.0)];
    let frames = [(5, true, "UT 5"), (5, true, "UF 6")];
    says(&kr6, Dialect::Fanuc, &fanuc(" 1:L P[1] 10mm/sec FINE ;\n", &still), &none, &frames);
    let new = says(
        &kr6,
        Dialect::Fanuc,
        &fanuc(" 1:L P[1] 10mm/sec FINE COORD ;\n", &[point("P[1]", 0.0), point("P[2]", 9.0)]),
        &given,
        &[(3, true, "coordinated with group 2"), (14, true, "group 2 moves")],
    );
    assert!(new.rewritten.is_empty());
    let twice = fanuc(" 1:L P[1] 10mm/sec FINE ;\n", &[point("P[1]", 0.0), point("P[1]", 0.0)]);
    assert!(!rewrite(&kr6, Dialect::Fanuc, &[("a.ls", twice.into_bytes())], &given)[0].is_whole());
}

#[test]
fn n_of_fanuc_bends_the_hand_down_however_the_file_counts_joint_6() {
    // The upper arm upright, the forearm level and the hand straight down: the wrist is at 25 + 365, 400 + 315 + 35 mm, and the
    // flange 80 mm below it. FANUC's joint 5 stands at -90 deg there, this file's at 90.
    let program = |letter: char| {
        let position = "X = 390 mm, Y = 0 mm, Z = 670 mm,\n W = 180 deg, P = 0 deg, R = -150 deg";
        format!(
            "/PROG A\n/MN\n 1:L P[1] 9mm/sec FINE ;\n/POS\nP[1]{{\n GP1:\n UF : 0, UT : 0, CONFIG : '{letter} U T, 0, 0, 0',\n {position}\n}};\n/END\n"
        )
    };
    let mut in_flange = built_in("kr6_r700").unwrap();
    // The same arm with the length of its hand in the flange, whose z axis points out; axis 6 still points back into the arm.
    in_flange.flange = FramePose { xyz: [0.0, 0.0, in_flange.links[5].mdh.d], rz_ry_rx: [0.0, PI, 0.0] };
    in_flange.links[5].mdh.d = 0.0;
    for robot in [built_in("kr6_r700").unwrap(), in_flange] {
        let calibration = calibration_of(robot, &["mdh"], 7);
        let bench = Bench { calibration, postures: Vec::new() };
        let rewritten = |letter: char| {
            let files = [("a.ls", program(letter).into_bytes())];
            let new = rewrite(&bench, Dialect::Fanuc, &files, &Permissions::default()).remove(0);
            new.rewritten.first().map(|one| one.fake.q.iter().map(|q| q / DEG).collect::<Vec<f64>>())
        };
        let q = rewritten('N').unwrap();
        for (k, (q, by_hand)) in q.iter().zip([0.0, -90.0, 90.0, 0.0, 90.0, 30.0]).enumerate() {
            assert!((q - by_hand).abs() < 2.0, "joint {}: {q}", k + 1);
        }
        // Flipped, joint 4 is at the half turn: refused, or there.
        assert!(rewritten('F').is_none_or(|q| q[4] < 0.0));
    }
}
