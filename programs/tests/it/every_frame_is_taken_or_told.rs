//! Tools and bases however a program states them: taken with the positions that have them, or told with the positions left as
//! they are.

use std::fs;

use calibench::compensate::{Compensator, Task, WorkFrame};
use calibench::robot::inverse::StatusTurn;
use calibench::robot::{FramePose, Pose};
use calibench::units::{DEG, MM};
use calibench_programs::{Dialect, Permissions, Program, RewrittenProgram, read_frames, rewrite_programs};
use nalgebra::{Rotation3, Translation3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::a_program_is_rewritten_and_nothing_else::{Bench, angles, of_angles};
use crate::every_dialect_branches_and_calls::{Making, listed};
use crate::jobs_of_yaskawa_and_of_staubli::{HEAD, KEYS, attributes, of_val3, to_val3, val3_program};
use crate::programs_are_as_controllers_write_them::{BARE, BASES, Made, Random, TOOLS, krl_numbers, pose_of, rewrite, told};

/// Permissions with the tools and the bases of the generator by their numbers.
pub fn with_frames() -> Permissions {
    Permissions { frames: listed(), ..Permissions::default() }
}

/// A posture in this tool and this base.
pub fn made(bench: &Bench, seed: u64, [tool, base]: [usize; 2]) -> Made {
    let q = Random(ChaCha8Rng::seed_from_u64(seed)).made(bench).q;
    Made { q, tool, base }
}

/// Puts a position of KRL into a program.
pub fn krl_position(making: &mut Making, bench: &Bench, made: Made) {
    making.w.fixed("{");
    krl_numbers(&mut making.w, bench, &made);
    making.w.fixed("}\n");
    making.made.push(made);
}

/// Asserts that a program stays as it is, and that of each of these lines something is told, blocking or not.
pub fn left(old: &[u8], new: &RewrittenProgram, lines: &[(usize, &str, bool)]) {
    assert_eq!(new.bytes, old, "every byte stays");
    for (line, what, blocks) in lines {
        let is_this = |r: &&calibench_programs::Remark| r.line == *line && r.what.contains(what) && r.blocks == *blocks;
        assert!(new.remarks.iter().any(|r| is_this(&r)), "{line}: {what}: {:#?}", new.remarks);
    }
}

#[test]
fn bas_with_a_variable_is_an_unknown_frame_and_an_external_base_moves() {
    let bench = Bench::kr6();
    let of = |lines: &str, at: [usize; 2]| {
        let mut making = Making::new(format!("DEF a()\nDECL INT n\nn=2\n{lines}LIN "));
        krl_position(&mut making, &bench, made(&bench, 1, at));
        making.w.fixed("END\n");
        let new = rewrite(&bench, Dialect::Krl, &[("a.src", making.w.bytes())], &with_frames()).remove(0);
        (making, new)
    };
    for (lines, line, what) in [
        ("BAS(#TOOL,n)\nBAS(#BASE,1)\n", 6, "TOOL_DATA[N]"),
        ("BAS (#TOOL, 1)\nBAS(#BASE,n)\n", 6, "BASE_DATA[N]"),
        ("BAS(#TOOL,1)\nBAS(#EX_BASE,1)\n", 6, "#EX_BASE"),
    ] {
        let (making, new) = of(lines, [1, 1]);
        left(&making.w.bytes(), &new, &[(line, what, true)]);
    }
    let (making, new) = of("BAS(#TOOL,2)\nBAS(#EX_BASE,1)\nBAS(#BASE,1)\n", [2, 1]);
    making.holds(&bench, &new, 8, 0, false);
}

#[test]
fn the_head_of_a_block_of_splines_holds_for_its_segments() {
    let bench = Bench::kr6();
    let [two, one] = ["{X 0,Y 35,Z 90,A 30,B 0,C -20}", "{X 300,Y -120,Z 40,A 15,B 0,C 0}"];
    for head in [
        "SPLINE WITH $VEL = SVEL_CP(0.5, , LCPDAT1), $TOOL = STOOL2(FS1), $BASE = SBASE(FS1.BASE_NO), $LOAD = SLOAD(FS1.TOOL_NO)"
            .to_owned(),
        "SPLINE WITH $TOOL=TOOL_DATA[2], $BASE=BASE_DATA[1], $VEL.CP=0.2".to_owned(),
        "PTP_SPLINE C_DIS WITH $BASE=BASE_DATA[1], $TOOL=TOOL_DATA[2]".to_owned(),
        format!("SPLINE WITH $BASE={one}, $TOOL={two}"),
    ] {
        let [verb, circle] = if head.starts_with("PTP") { ["SPTP", "SPTP"] } else { ["SPL", "SLIN"] };
        let mut making = Making::new(format!(
            "DEF a()\nDECL FDAT FS1={{TOOL_NO 2,BASE_NO 1,IPO_FRAME #BASE}}\nBAS(#TOOL,1)\nBAS(#BASE,2)\n{head}\n{verb} "
        ));
        krl_position(&mut making, &bench, made(&bench, 1, [2, 1]));
        making.w.fixed(format!("{circle} "));
        krl_position(&mut making, &bench, made(&bench, 2, [2, 1]));
        // A segment may have a tool of its own, and the block ends.
        making.w.fixed(format!("{verb} "));
        let own = made(&bench, 3, [1, 1]);
        making.w.fixed("{");
        krl_numbers(&mut making.w, &bench, &own);
        making.w.fixed("} WITH $TOOL=TOOL_DATA[1]\nENDSPLINE\nLIN ");
        making.made.push(own);
        krl_position(&mut making, &bench, made(&bench, 4, [1, 2]));
        making.w.fixed("END\n");
        let new = rewrite(&bench, Dialect::Krl, &[("a.src", making.w.bytes())], &with_frames()).remove(0);
        making.holds(&bench, &new, 8, 0, false);
    }
}

#[test]
fn frames_of_val3_stand_on_the_world_given() {
    let bench = Bench::other();
    // Righty, and elbow and wrist left open.
    let in_front = |seed: u64, base: usize| {
        let front = |made: &Made| StatusTurn::of(&bench.wrist(), made.q[..].try_into().unwrap()).status & 1 == 0;
        (0..).map(|k| made(&bench, 100 * seed + k, [1, base])).find(front).unwrap()
    };
    let world = pose_of(BASES[2]);
    let value = |name: &str, kind: &str, pose: &Pose, father: &str| {
        let numbers = attributes(&KEYS, &to_val3(pose));
        format!("<Data name=\"{name}\" type=\"{kind}\">\n<Value key=\"0\"{numbers} fatherId=\"{father}[0]\"/>\n</Data>\n")
    };
    // The jig's frame is at the base link, and the table's is base 1.
    let table = world.inverse() * pose_of(BASES[1]);
    let mut making = Making::new(format!(
        "{HEAD}{}{}{}",
        value("fTable", "frame", &table, "world"),
        value("fJig", "frame", &pose_of(BASES[1]).inverse(), "fTable"),
        value("tGun", "tool", &pose_of(TOOLS[1]), "flange"),
    ));
    let mut code = String::new();
    for (k, (father, base)) in [("world", 2), ("fTable", 1), ("fJig", 0)].into_iter().enumerate() {
        let made = in_front(k as u64, base);
        let sides = [("epositive", "enegative", made.q[2]), ("wpositive", "wnegative", made.q[4])];
        let [elbow, wrist] = sides.map(|(plus, minus, q)| if q >= 0.0 { plus } else { minus });
        making.w.fixed(format!("<Data name=\"p{k}\" type=\"pointRx\">\n<Value key=\"0\""));
        for (key, value) in KEYS.iter().zip(to_val3(&made.pose(&bench))) {
            making.w.fixed(format!(" {key}=\"")).number(value, 6).fixed("\"");
        }
        making
            .w
            .fixed(format!(" shoulder=\"righty\" elbow=\"{elbow}\" wrist=\"{wrist}\" fatherId=\"{father}[0]\"/>\n</Data>\n"));
        making.made.push(made);
        code += &format!("movel(p{k},tGun,m)\n");
    }
    making.w.fixed("</Datas>\n</Database>\n");
    let files = [("a.dtx", making.w.bytes()), ("main.pgx", val3_program("main", &code))];
    let programs = files.clone().map(|(path, bytes)| Program { path: path.into(), dialect: Dialect::Val3, bytes });
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frames.toml");
    fs::write(&path, format!("format = \"calibench-frames/1\"\n[bases]\nworld = {:?}\n", BASES[2])).unwrap();
    let listed = Permissions { frames: read_frames(&path).unwrap(), ..Permissions::default() };
    let given = Permissions { base_given: true, ..Permissions::default() };
    let [x, y, z, a, b, c] = BASES[2];
    let frame = FramePose { xyz: [x, y, z].map(|v| v * MM), rz_ry_rx: [a, b, c].map(|v| v * DEG) };
    for (permissions, frame) in [(listed, FramePose::default()), (given, frame)] {
        let task = Task { frame: WorkFrame::Base(frame), ..BARE };
        let mut compensator = Compensator::new(&bench.calibration, &task).unwrap();
        let new = rewrite_programs(&programs, &mut compensator, &permissions).remove(0);
        told(&new, &[]);
        let (old, found) = (making.w.old_numbers(), making.w.numbers_of(&new.bytes));
        for (k, made) in making.made.iter().enumerate() {
            made.holds(&bench, of_val3(&old[6 * k..]), of_val3(&found[6 * k..]));
        }
    }
}

#[test]
fn a_listed_frame_that_a_program_sets_is_told() {
    let bench = Bench::kr6();
    let ([x, y, z], [a, b, c]) = angles(&made(&bench, 1, [1, 1]).pose(&bench));
    let position = |n: usize| {
        format!(
            "P[{n}]{{\n GP1:\n UF : 1, UT : 1, CONFIG : 'x',\n X = {x} mm, Y = {y} mm, Z = {z} mm,\n W = {c} deg, P = {b} deg, R = {a} deg\n}};\n"
        )
    };
    let program = |lines: &str| {
        let text = format!("/PROG A\n/MN\n{lines} 9:L P[1] 9mm/sec FINE ;\n/POS\n{}/END\n", position(1)).into_bytes();
        rewrite(&bench, Dialect::Fanuc, &[("a.ls", text)], &with_frames()).remove(0)
    };
    let plain = program(" 1:UFRAME_NUM=1 ;\n 2:UTOOL_NUM=1 ;\n");
    let set = program(" 1:UFRAME[1]=PR[5] ;\n 2:UTOOL[1]=PR[6] ;\n");
    assert_eq!(set.rewritten[0].fake, plain.rewritten[0].fake, "in the frames given");
    assert!(plain.remarks.is_empty() && set.is_whole(), "{set:#?}");
    let lines: Vec<(usize, &str)> = set.remarks.iter().map(|r| (r.line, r.what.as_str())).collect();
    assert_eq!(lines, [(3, "UFRAME[1]"), (4, "UTOOL[1]")], "{:#?}", set.remarks);
}

#[test]
fn get_inverse_kin_has_a_tool_of_its_own() {
    let bench = Bench::ur5();
    // Tool 1 of the generator, whose only angle is 5 deg about y.
    let tool = format!("p[0.01,-0.004,0.12,0,{:.12},0]", 5.0 * DEG);
    for (behind, in_1) in [
        (format!("tcp={tool}"), true),
        (format!("maxPositionError=1e-10, tcp = {tool}"), true),
        (format!("1e-10, 1e-10, {tool}"), true),
        ("tcp=grip".into(), true),
        ("1e-10, 1e-10, \"active_tcp\"".into(), false),
    ] {
        let mut making = Making::new(format!("grip={tool}\nset_tcp(p[0,0,0,0,0,0])\nmovej(get_inverse_kin("));
        let put = |making: &mut Making, tool: usize| {
            let made = made(&bench, 7, [tool, 0]);
            let pose = made.pose(&bench);
            making.w.fixed("p[");
            for (k, value) in pose.translation.vector.iter().chain(&pose.rotation.scaled_axis()).enumerate() {
                making.w.fixed(if k > 0 { "," } else { "" }).number(*value, 10);
            }
            making.w.fixed("]");
            making.made.push(made);
        };
        put(&mut making, usize::from(in_1));
        let near: Vec<String> = making.made[0].q.iter().map(|q| format!("{q:.4}")).collect();
        making.w.fixed(format!(", qnear=[{}], {behind}), a=1.2)\nmovel(get_inverse_kin(", near.join(", ")));
        put(&mut making, 0);
        making.w.fixed(format!(", [{}]))\n", near.join(", ")));
        let new = rewrite(&bench, Dialect::UrScript, &[("a.script", making.w.bytes())], &Permissions::default()).remove(0);
        told(&new, &[]);
        let (old, found) = (making.w.old_numbers(), making.w.numbers_of(&new.bytes));
        let pose = |n: &[f64]| {
            let rotation = Rotation3::from_scaled_axis(Vector3::new(n[3], n[4], n[5]));
            Pose::from_parts(Translation3::new(n[0], n[1], n[2]), rotation)
        };
        for (k, made) in making.made.iter().enumerate() {
            made.holds(&bench, pose(&old[6 * k..]), pose(&found[6 * k..]));
        }
    }
    let unknown = "movej(get_inverse_kin(p[-0.4,0.1,0.3,3.1,0,0],tcp=get_tcp_offset()))\n";
    let new = rewrite(&bench, Dialect::UrScript, &[("a.script", unknown.into())], &Permissions::default()).remove(0);
    left(unknown.as_bytes(), &new, &[(1, "tcp=get_tcp_offset()", true)]);
}

#[test]
fn urscript_that_moves_to_computed_poses_is_told() {
    let bench = Bench::ur5();
    let text = "plane=p[0.4,-0.1,0.05,0,0,0.5]\nwp=p[-0.4,0.1,0.3,3.1,0,0]\n\
                movej(get_inverse_kin(pose_trans(plane, p[-0.7,0.1,0.3,-2.7,-1.2,-0.4]), qnear=[0,-1,1,0,1,0]))\n\
                q=get_inverse_kin(pose_trans(plane, wp))\noptimovel(pose_trans(plane, wp), a=1)\noptimovej(there)\n";
    let new = rewrite(&bench, Dialect::UrScript, &[("a.script", text.into())], &Permissions::default()).remove(0);
    let lines = [
        (3, "get_inverse_kin pose_trans(plane", false),
        (4, "get_inverse_kin", false),
        (5, "optimovel", false),
        (6, "optimovej", false),
    ];
    left(text.as_bytes(), &new, &lines);
    let joints = made(&bench, 3, [0, 0]).q;
    let list: Vec<String> = joints.iter().map(|q| format!("{q:.9}")).collect();
    let of = |verb: &str| {
        let text = format!("{verb}([{}], a=1)\n", list.join(", "));
        rewrite(&bench, Dialect::UrScript, &[("a.script", text.into())], &Permissions::default()).remove(0)
    };
    let [old, new] = ["movej", "optimovej"].map(of);
    assert_eq!((new.rewritten.len(), &new.rewritten[0].fake), (1, &old.rewritten[0].fake));
}

#[test]
fn positions_made_of_names_or_within_structures_are_told() {
    let bench = Bench::kr6();
    let axes = "[9E9,9E9,9E9,9E9,9E9,9E9]";
    let text = format!(
        "MODULE M\nPROC a()\nMoveL [c1,[0,0,1,0],[0,0,0,0],{axes}],v100,fine,tool0;\n\
         MoveL [[350,10,400],o1,[0,0,0,0],{axes}],v100,fine,tool0;\nMoveL [[350,10,h1],[0,0,1,0],[0,0,0,0],{axes}],v100,fine,tool0;\n\
         MoveC [[350,10,300],[0,0,1,0],conf1,{axes}],\n[[350,10,300],[0,0,1,0],[0,0,0,0],eax1],v100,fine,tool0;\n\
         MoveAbsJ [[0,0,0,0,30,j6],{axes}],v100,fine,tool0;\nMoveAbsJ [home,{axes}],v100,fine,tool0;\nENDPROC\nENDMODULE\n"
    );
    let new = rewrite(&bench, Dialect::Rapid, &[("m.mod", text.clone().into())], &Permissions::default()).remove(0);
    let all = [(3, "[c1,"), (4, "o1"), (5, "robtarget"), (6, "conf1"), (7, "eax1"), (8, "jointtarget"), (9, "[home,")];
    left(text.as_bytes(), &new, &all.map(|(line, what)| (line, what, true)));
    assert_eq!((new.remarks.len(), new.positions), (7, 7), "{:#?}", new.remarks);

    let text = "DEF a()\nBAS(#TOOL,1)\nBAS(#BASE,1)\nLOAD_DATA[1]={M 1,CM {X 0,Y 0,Z 1,A 0,B 0,C 0},J {X 0,Y 0,Z 0}}\n\
                j={job: p {E6POS: X 1,Y 2,Z 3,A 4,B 5,C 6,S 2,T 34},n 3}\nw[1]={p {X 1,Y 2,Z 3,A 4,B 5,C 6},v 0.2}\n\
                LIN j.p\nPTP w[1].p\nEND\n";
    let new = rewrite(&bench, Dialect::Krl, &[("a.src", text.into())], &with_frames()).remove(0);
    left(text.as_bytes(), &new, &[(5, "J", true), (6, "W[1]", true)]);
    assert_eq!((new.remarks.iter().filter(|r| r.blocks).count(), new.positions), (2, 2), "{:#?}", new.remarks);
}

#[test]
fn one_element_that_is_set_leaves_the_others() {
    let bench = Bench::kr6();
    let of = |index: &str| {
        let mut making = Making::new("DEF a()\nBAS(#TOOL,1)\nBAS(#BASE,2)\n".into());
        for k in 1..=3 {
            making.w.fixed(format!("pt[{k}]="));
            krl_position(&mut making, &bench, made(&bench, k, [1, 2]));
        }
        making.w.fixed(format!("pt[{index}].Z=100\nFOR i=1 TO 3\nLIN pt[i]\nENDFOR\nEND\n"));
        let new = rewrite(&bench, Dialect::Krl, &[("a.src", making.w.bytes())], &with_frames()).remove(0);
        (making, new)
    };
    let (making, new) = of(" 1 ");
    let lines: Vec<usize> = new.rewritten.iter().map(|one| one.line).collect();
    assert_eq!((&lines[..], new.positions), (&[5, 6][..], 3), "{new:#?}");
    let (old, found) = (making.w.old_numbers(), making.w.numbers_of(&new.bytes));
    let pose = |n: &[f64]| of_angles([n[0], n[1], n[2]], [n[3], n[4], n[5]]);
    assert_eq!(old[..8], found[..8], "the first stays");
    for (k, made) in making.made.iter().enumerate().skip(1) {
        made.holds(&bench, pose(&old[8 * k..]), pose(&found[8 * k..]));
    }
    let (making, new) = of("i");
    left(&making.w.bytes(), &new, &[(7, "PT[I].Z", false)]);

    // The same in VAL 3, where the first element is number 0.
    let value = |k: u64| {
        let pose = made(&bench, k, [0, 0]).pose(&bench);
        format!("<Value key=\"{k}\"{} fatherId=\"world\"/>\n", attributes(&KEYS, &to_val3(&pose)))
    };
    let data = format!("{HEAD}<Data name=\"p\" type=\"pointRx\">\n{}{}</Data></Datas></Database>\n", value(0), value(1));
    for (index, count) in [("0", 1), ("1", 1), ("i", 0)] {
        let code = format!("p[{index}].trsf.z=5\nmovel(p[0],flange,m)\nmovel(p[1],flange,m)\n");
        let files = [("a.dtx", data.clone().into_bytes()), ("main.pgx", val3_program("main", &code))];
        let new = rewrite(&bench, Dialect::Val3, &files, &Permissions::default());
        assert_eq!((new[0].rewritten.len(), new[0].positions), (count, 2), "{index}: {new:#?}");
    }
}

#[test]
fn a_position_that_only_other_statements_use_stays() {
    let bench = Bench::kr6();
    let axes = "[9E9,9E9,9E9,9E9,9E9,9E9]";
    let data = format!("[[400,10,300],[0,0,1,0],[0,0,0,0],{axes}]");
    for (statement, line) in [
        ("g1 p10,wJig;", 3),
        ("g1 p10\\w:=wJig;", 3),
        ("there:=p10; MoveL there,v100,fine,tool0;", 3),
        ("FCPressL p10,v100,20,fine,tool0;", 3),
        ("jq:=CalcJointT(p10,tool0);", 3),
        ("MoveL Mirrored(p10),v100,fine,tool0;", 3),
    ] {
        let text = format!("MODULE M\n! p10\nCONST robtarget p10:={data};\nPROC a()\n{statement}\nENDPROC\nENDMODULE\n");
        let new = rewrite(&bench, Dialect::Rapid, &[("m.mod", text.clone().into())], &Permissions::default()).remove(0);
        left(text.as_bytes(), &new, &[(line, "P10", true)]);
        let by: String = statement.split(';').next().unwrap().to_owned();
        assert!(new.remarks.iter().any(|r| r.reason.contains(&by)), "{statement}: {:#?}", new.remarks);
    }
    // A list alone, and a position that a motion goes to as well.
    for statement in ["", "g1 j10; MoveAbsJ j10,v1,z1,tool0;"] {
        let data = format!("CONST jointtarget j10 :=[[0,-90,90,0,20,0],{axes}];");
        let text = format!("MODULE M\n{data}\nPROC a()\n{statement}\nENDPROC\nENDMODULE\n");
        let new = rewrite(&bench, Dialect::Rapid, &[("m.mod", text.into())], &Permissions::default()).remove(0);
        assert_eq!(new.rewritten.len(), 1, "{statement}: {new:#?}");
    }

    let dat = |k: u64| {
        let mut making = Making::new("DEFDAT a\nDECL E6POS XP1=".into());
        krl_position(&mut making, &bench, made(&bench, k, [1, 1]));
        making.w.fixed("ENDDAT\n");
        making
    };
    let src = "DEF a()\nBAS(#TOOL,1)\nBAS(#BASE,1)\ngo(XP1,2)\nEND\nDEF go(p:IN,b:IN)\nE6POS p\nLIN p\nEND\n";
    let making = dat(1);
    let new = rewrite(&bench, Dialect::Krl, &[("a.src", src.into()), ("a.dat", making.w.bytes())], &with_frames());
    left(&making.w.bytes(), &new[1], &[(2, "XP1", true)]);
    // A copy that a motion goes to has known frames.
    let src = "DEF a()\nE6POS q\nBAS(#TOOL,1)\nBAS(#BASE,1)\nq=XP1\nLIN q\nEND\n";
    let new = rewrite(&bench, Dialect::Krl, &[("a.src", src.into()), ("a.dat", making.w.bytes())], &with_frames());
    making.holds(&bench, &new[1], 8, 0, false);

    let pose = attributes(&KEYS, &to_val3(&made(&bench, 1, [0, 0]).pose(&bench)));
    let data = format!("{HEAD}<Data name=\"p\" type=\"pointRx\">\n<Value key=\"0\"{pose}/></Data></Datas></Database>\n");
    let files = [("a.dtx", data.clone().into_bytes()), ("main.pgx", val3_program("main", "call place(p)\n"))];
    let new = rewrite(&bench, Dialect::Val3, &files, &Permissions::default());
    left(data.as_bytes(), &new[0], &[(1 + HEAD.lines().count() + 1, "p", true)]);
}

#[test]
fn a_frame_that_breaks_off_is_no_panic() {
    let bench = Bench::kr6();
    let text = "PERS tooldata t :=[TRUE,[[0,0,9],[1,0,0,0]],[1]];\nPERS wobjdata w:=[FALSE,TRUE,\"\",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]]";
    for length in 0..text.len() {
        let program = &text.as_bytes()[..length];
        let new = rewrite(&bench, Dialect::Rapid, &[("m.mod", program.to_vec())], &Permissions::default()).remove(0);
        assert_eq!((&new.bytes[..], new.positions), (program, 0));
    }
}
