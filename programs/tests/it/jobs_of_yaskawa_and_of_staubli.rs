//! INFORM jobs of Yaskawa and VAL 3 projects of Stäubli in the style of their editors: positions in their tools and frames, read
//! back by arithmetic of this test alone; pulses and what the grammar leaves open refused by name.

use std::fs;

use calibench::robot::Pose;
use calibench::robot::inverse::StatusTurn;
use calibench::units::{DEG, MM};
use calibench_programs::{Dialect, NamedFrames, Permissions, read_frames};
use nalgebra::{Rotation3, Translation3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::a_program_is_rewritten_and_nothing_else::{Bench, angles};
use crate::every_dialect_branches_and_calls::{Making, listed};
use crate::programs_are_as_controllers_write_them::{
    BASES, Made, POSITIONS, PROGRAMS, Random, TOOLS, line, pose_of, rewrite, says, told,
};

#[test]
fn yaskawa_of_the_pendant() {
    let bench = Bench::other();
    let wrist = bench.wrist();
    let status = |q: &[f64]| StatusTurn::of(&wrist, q.try_into().unwrap()).status;
    // Near the border of a flag a position is refused; backward, the flag of the arm leaves two elbows.
    let is_plain =
        |q: &[f64]| status(q) & 1 == 0 && q.iter().all(|q| q.abs() < 3.0) && (q[3].abs() - 90.0 * DEG).abs() > 2.0 * DEG;
    for seed in 0..PROGRAMS {
        let mut random = Random(ChaCha8Rng::seed_from_u64(seed));
        let mut job = Making::new("/JOB\r\n//NAME WELD\r\n//POS\r\n///NPOS 24,0,0,1,0,0\r\n".into());
        for k in 0..POSITIONS {
            let made = loop {
                let made = random.made(&bench);
                if is_plain(&made.q) {
                    break made;
                }
            };
            let flags = [u8::from(made.q[3].abs() > 90.0 * DEG), u8::from(status(&made.q) & 2 == 0)];
            job.w.fixed(format!(
                "///TOOL {}\r\n///POSTYPE USER\r\n///USER {}\r\n///RECTAN\r\n///RCONF {},{},0,0,0,0,0,0\r\nC{k:05}=",
                made.tool, made.base, flags[0], flags[1]
            ));
            let (xyz, [a, b, c]) = angles(&made.pose(&bench));
            for (k, value) in xyz.into_iter().chain([c, b, a]).enumerate() {
                job.w.fixed(if k > 0 { "," } else { "" }).number(value, 4);
            }
            job.w.fixed("\r\n");
            job.made.push(made);
        }
        job.w.fixed(
            "//INST\r\n///DATE 2024/01/02 03:04\r\n///ATTR SC,RW,RJ\r\n////FRAME USER 1\r\n///GROUP1 RB1\r\nNOP\r\n*LOOP\r\n",
        );
        let told_by = |job: &mut Making, text: &str| {
            job.warned.push(line(&job.w));
            job.w.fixed(format!("{text}\r\n"));
        };
        for k in 0..POSITIONS {
            match random.below(5) {
                0 => _ = job.w.fixed(format!("MOVJ C{k:05} VJ=10.00 PL=1\r\n'MOVL P9\r\n")),
                1 => _ = job.w.fixed(format!("MOVL C{k:05} V=50.0 //SPEED\r\nCALL JOB:SUB IF IN#(1)=ON\r\n")),
                2 => _ = job.w.fixed(format!("MOVC C{k:05} V=50.0 FPT\r\nJUMP *LOOP IF B000<3\r\n")),
                3 => {
                    job.w.fixed(format!("MOVS C{k:05} V=50.0\r\n"));
                    told_by(&mut job, "IMOV P010 V=20.0 RF");
                }
                _ => {
                    told_by(&mut job, "SFTON P001 UF#(1)");
                    job.w.fixed(format!("MOVL C{k:05} V=50.0\r\nSFTOF\r\n"));
                    told_by(&mut job, "MOVL P099 V=1.0");
                    told_by(&mut job, "SETE P002 (3) D000");
                }
            }
        }
        job.w.fixed("END\r\n");
        let permissions = Permissions { frames: listed(), ..Permissions::default() };
        let new = rewrite(&bench, Dialect::Yaskawa, &[("weld.jbi", job.w.bytes())], &permissions).remove(0);
        job.holds(&bench, &new, 6, 0, true);
        let bare = rewrite(&bench, Dialect::Yaskawa, &[("weld.jbi", job.w.bytes())], &Permissions::default()).remove(0);
        assert!(bare.rewritten.is_empty() && !bare.is_whole());
    }
}

#[test]
fn what_a_job_leaves_open_is_refused_by_name() {
    let kr6 = Bench::kr6();
    let given = Permissions { tool_given: true, base_given: true, ..Permissions::default() };
    let base = Permissions { base_given: true, ..Permissions::default() };
    let apart = Permissions { external_axes_apart: true, ..given.clone() };
    let job = |headers: &str, body: &str, instructions: &str| {
        format!("/JOB\n//NAME A\n//POS\n///NPOS 1,0,0,0,0,0\n///TOOL 0\n{headers}\n{body}\n//INST\nNOP\n{instructions}\nEND\n")
    };
    let ([x, y, z], [a, b, c]) = angles(&Made { q: vec![0.3, -1.4, 1.6, 0.2, 0.7, 0.4], tool: 0, base: 0 }.pose(&kr6));
    let p = format!("{x},{y},{z},{c},{b},{a}");
    let robot = "///POSTYPE ROBOT\n///RECTAN";
    let moves = "MOVL C00000 V=1.0";
    for (program, permissions, expected) in [
        (job("///POSTYPE PULSE\n///PULSE", "C00000=1,2,3,4,5,6", moves), &given, &[(8, true, "in pulses")][..]),
        (job("///POSTYPE MTOOL\n///RECTAN", &format!("C00000={p}"), moves), &given, &[(8, true, "POSTYPE MTOOL is not read")]),
        (job("///POSTYPE USER\n///RECTAN", &format!("C00000={p}"), moves), &given, &[(8, true, "no header USER")]),
        (job(robot, &format!("C00000={p},5"), moves), &given, &[(8, true, "not six numbers")]),
        (job(robot, &format!("C00000={p}\nC0={p}"), moves), &given, &[(9, true, "twice")]),
        (job(robot, &format!("C00000={p}"), moves), &base, &[(8, true, "TOOL 0: the numbers of this tool")]),
        (job(robot, &format!("C00000={p}"), "MOVL C00000 V=1.0\nMOVL C00007 V=1.0"), &given, &[(12, false, "not in the file")]),
        (job(robot, &format!("C00000={p}\nBC00000=500"), "MOVL C00000 BC00000 V=1.0"), &given, &[(8, true, "BC00000=500")]),
        (job(robot, &format!("C00000={p}\nBC00000=500"), "MOVL C00000 BC00000 V=1.0"), &apart, &[]),
        (
            job(robot, &format!("C00000={p}"), "SMOVL C00000 V=1.0\n+MOVL EC00000"),
            &given,
            &[(11, true, "coordinated"), (12, true, "another group")],
        ),
        (
            job(
                "///USER 2\n///POSTYPE USER\n///RECTAN",
                &format!("C00000={p}"),
                "MFRAME UF#(2) C00001 C00002 C00003\nMOVL C00000 V=1.0",
            ),
            &Permissions { tool_given: true, ..Permissions::default() },
            &[(12, true, "computed at run time")],
        ),
    ] {
        says(&kr6, Dialect::Yaskawa, &program, permissions, expected);
    }
}

/// VAL 3: x, y, z (mm), rx, ry, rz (deg), about x, the new y, the new z.
pub fn of_val3(n: &[f64]) -> Pose {
    let about = |axis, angle: f64| Rotation3::from_axis_angle(&axis, angle * DEG);
    let rotation = about(Vector3::x_axis(), n[3]) * about(Vector3::y_axis(), n[4]) * about(Vector3::z_axis(), n[5]);
    Pose::from_parts(Translation3::new(n[0] * MM, n[1] * MM, n[2] * MM), rotation)
}

pub fn to_val3(pose: &Pose) -> [f64; 6] {
    let (t, r) = (pose.translation.vector / MM, pose.rotation.matrix());
    let angles = [(-r[(1, 2)]).atan2(r[(2, 2)]), r[(0, 2)].asin(), (-r[(0, 1)]).atan2(r[(0, 0)])];
    [t.x, t.y, t.z, angles[0] / DEG, angles[1] / DEG, angles[2] / DEG]
}

pub const HEAD: &str = "<?xml version=\"1.0\" encoding=\"utf-8\" ?>\n<Database xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" \
                    xmlns=\"http://www.staubli.com/robotics/VAL3/Data/2\">\n  <Datas>\n";

pub fn val3_program(name: &str, code: &str) -> Vec<u8> {
    format!(
        "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<Programs xmlns=\"http://www.staubli.com/robotics/VAL3/Program/2\">\n\
         <Program name=\"{name}\">\n<Code><![CDATA[begin\n{code}end]]></Code>\n</Program>\n</Programs>\n"
    )
    .into_bytes()
}

pub fn attributes(keys: &[&str], values: &[f64]) -> String {
    keys.iter().zip(values).map(|(key, value)| format!(" {key}=\"{value:.9}\"")).collect()
}

pub const KEYS: [&str; 6] = ["x", "y", "z", "rx", "ry", "rz"];

#[test]
fn val3_of_the_editor() {
    let bench = Bench::other();
    let wrist = bench.wrist();
    for seed in 0..PROGRAMS {
        let mut random = Random(ChaCha8Rng::seed_from_u64(seed));
        let mut data = Making::new(HEAD.into());
        // Frames and tools on others, as in cells that were taught twice.
        let [shift, one, two] = [[0.0, 0.0, 50.0, 0.0, 0.0, 0.0], BASES[1], BASES[2]];
        let lifted = pose_of(shift).inverse() * pose_of(two);
        let value = |key: usize, pose: &Pose, father: &str| {
            format!("      <Value key=\"{key}\"{} fatherId=\"{father}\"/>\n", attributes(&KEYS, &to_val3(pose)))
        };
        data.w.fixed("    <!-- <Data name=\"no\" type=\"pointRx\"><Value key=\"0\" x=\"1\"/> -->\n");
        let list = |name: &str, kind: &str| {
            format!("    <Data name=\"{name}\" access=\"public\" xsi:type=\"array\" type=\"{kind}\" size=\"2\">\n")
        };
        data.w.fixed(list("fLift", "frame")).fixed("      <Value key=\"0\" z=\"50\"/>\n    </Data>\n");
        data.w.fixed(list("fJig", "frame")).fixed(value(1, &pose_of(one), "world[0]")).fixed(value(2, &lifted, "fLift[0]"));
        data.w.fixed("    </Data>\n").fixed(list("tGun", "tool"));
        for (k, tool) in TOOLS.into_iter().enumerate().skip(1) {
            data.w.fixed(value(k, &pose_of(tool), "flange[0]"));
        }
        data.w.fixed("    </Data>\n");
        data.w.fixed(list("pHere", "pointRx")).fixed("      <Value key=\"0\" fatherId=\"fJig[1]\"/>\n    </Data>\n");
        let mut code = String::new();
        let mut warned = Vec::new();
        let first = 5;
        for k in 0..POSITIONS {
            let made = loop {
                let made = random.made(&bench);
                if StatusTurn::of(&wrist, made.q[..].try_into().unwrap()).status & 1 == 0 {
                    break made;
                }
            };
            data.w.fixed(list(&format!("pWay{k}"), "pointRx")).fixed("      <Value key=\"0\"");
            for (key, value) in KEYS.iter().zip(to_val3(&made.pose(&bench))) {
                data.w.fixed(format!(" {key}=\"")).number(value, 6).fixed("\"");
            }
            let sides = [("epositive", "enegative", made.q[2]), ("wpositive", "wnegative", made.q[4])];
            let [elbow, wrist] = sides.map(|(plus, minus, q)| if q >= 0.0 { plus } else { minus });
            let shoulder = "righty";
            data.w.fixed(format!(
                " shoulder=\"{shoulder}\" elbow=\"{elbow}\" wrist=\"{wrist}\" fatherId=\"fJig[{}]\" />\n    </Data>\n",
                made.base
            ));
            let tool = format!("tGun[{}]", made.tool);
            let at = |code: &str| first + code.lines().count();
            match random.below(5) {
                0 => code += &format!("  movej(pWay{k}, {tool}, mFast) // movel(pNo,tNo,m)\n"),
                1 => {
                    code +=
                        &format!("  while bRun\n    if bSide\n      movel(pWay{k}[0],{tool},mSlow)\n    endIf\n  endWhile\n")
                }
                2 => code += &format!("  nId=movec(pWay{k},pWay{k},{tool},mSlow)\n  call sub(\"movej(a,b,c)\")\n"),
                3 => {
                    warned.push(at(&code));
                    code += &format!("  movel(appro(pWay{k},{{0,0,-50,0,0,0}}),{tool},mSlow)\n  movel(pWay{k},{tool},mSlow)\n");
                }
                _ => {
                    warned.extend([at(&code) + 1, at(&code) + 2]);
                    code += &format!(
                        "  movej(pWay{k},{tool},mFast)\n  pHere=here({tool},fJig[1])\n  movel(compose(pNo,fJig[1],tr),{tool},m)\n"
                    );
                }
            }
            data.made.push(made);
        }
        data.w.fixed("  </Datas>\n</Database>\n");
        let files = [("job.dtx", data.w.bytes()), ("main.pgx", val3_program("main", &code))];
        let new = rewrite(&bench, Dialect::Val3, &files, &Permissions::default());
        let place = 1 + HEAD.lines().count() + 13;
        let others: Vec<usize> = new[0].remarks.iter().map(|r| r.line).filter(|line| *line != place).collect();
        assert!(others.is_empty() && new[0].is_whole(), "{:#?}", new[0].remarks);
        warned.sort_unstable();
        told(&new[1], &warned);
        assert_eq!(new[1].bytes, files[1].1);
        let (old, found) = (data.w.old_numbers(), data.w.numbers_of(&new[0].bytes));
        for (k, made) in data.made.iter().enumerate() {
            made.holds(&bench, of_val3(&old[6 * k..]), of_val3(&found[6 * k..]));
        }
    }
}

#[test]
fn val3_writes_what_is_left_out_and_tells_what_changes() {
    let bench = Bench::kr6();
    let given = Permissions { tool_given: true, ..Permissions::default() };
    let q = [0.0, -1.5, 1.6, 0.0, 0.7, 0.0];
    let joints = format!(
        "{HEAD}    <Data name=\"jHome\" type=\"jointRx\" size=\"1\">\n      <Value key=\"0\" j2=\"{}\" j3=\"{}\" j5=\"{}\" />\n    </Data>\n  </Datas>\n</Database>\n",
        q[1] / DEG,
        q[2] / DEG,
        q[4] / DEG
    );
    let files = [("a.dtx", joints.into_bytes()), ("main.pgx", val3_program("main", "movej(jHome,tGun,m)\n"))];
    let new = rewrite(&bench, Dialect::Val3, &files, &given);
    assert!(new.iter().all(|one| one.is_whole()), "{:?}", new[0].remarks);
    let text = String::from_utf8(new[0].bytes.clone()).unwrap();
    let of =
        |key: &str| -> f64 { text.split(&format!(" {key}=\"")).nth(1).unwrap().split('"').next().unwrap().parse().unwrap() };
    for (key, q) in ["j1", "j2", "j3", "j4", "j5", "j6"].into_iter().zip(&new[0].rewritten[0].fake.q) {
        assert!((of(key) - q / DEG).abs() < 1e-8 && text.matches(&format!(" {key}=")).count() == 1, "{text}");
    }
    let value = attributes(&KEYS, &to_val3(&Made { q: q.to_vec(), tool: 0, base: 0 }.pose(&bench)));
    let data = format!(
        "{HEAD}<Data name=\"p\" type=\"pointRx\">\n<Value key=\"0\"{value} fatherId=\"f[0]\"/></Data>\n\
         <Data name=\"f\" type=\"frame\"><Value key=\"0\" fatherId=\"world[0]\"/></Data>\n\
         <Data name=\"s\" type=\"pointRs\"><Value key=\"0\" x=\"1\"/></Data>\n"
    );
    for (code, permissions, data_told, code_told) in [
        ("movel(p,tGun,m)\n", &given, &[7][..], &[][..]),
        ("movel(p,tGun,m)\n", &Permissions::default(), &[5, 7], &[]),
        ("movel(p,flange[0],m)\n", &Permissions::default(), &[7], &[]),
        ("p.trsf.z=5\nmovel(p,flange,m)\n", &given, &[7], &[5]),
        ("f.trsf.z=5\nmovel(p,flange,m)\n", &given, &[7], &[5]),
        ("movel(p,flange,m)\nmovel(x_pGiven,flange,m)\n", &given, &[7], &[6]),
    ] {
        let files = [("a.dtx", data.clone().into_bytes()), ("main.pgx", val3_program("main", code))];
        let new = rewrite(&bench, Dialect::Val3, &files, permissions);
        let lines = |k: usize| new[k].remarks.iter().map(|r| r.line).collect::<Vec<_>>();
        assert_eq!(
            (&lines(0)[..], &lines(1)[..]),
            (data_told, code_told),
            "{code}: {:#?}",
            new.iter().map(|n| &n.remarks).collect::<Vec<_>>()
        );
        assert!(!new[0].is_whole(), "a SCARA's point");
    }
    let files = [("a.dtx", data.into_bytes()), ("main.pgx", val3_program("main", "setFrame(a,b,c,f)\nmovel(p,flange,m)\n"))];
    let new = rewrite(&bench, Dialect::Val3, &files, &given);
    assert!(new[0].rewritten.is_empty() && new[1].remarks.iter().any(|r| r.line == 5 && r.blocks), "{new:#?}");
}

#[test]
fn a_base_at_the_height_of_axis_2_is_told() {
    let (kr6, given) = (Bench::kr6(), Permissions { tool_given: true, ..Permissions::default() });
    let ([x, y, z], [a, b, c]) = angles(&Made { q: vec![0.3, -1.4, 1.6, 0.2, 0.7, 0.4], tool: 0, base: 0 }.pose(&kr6));
    let fanuc = |frame: &str| {
        format!(
            "/PROG A\n/MN\n 1:L P[1] 10mm/sec FINE ;\n/POS\nP[1]{{\n GP1:\n UF : {frame}, UT : 1, CONFIG : 'x',\n X = {x} mm, Y = {y} mm, Z = {z} mm,\n W = {c} deg, P = {b} deg, R = {a} deg\n}};\n/END\n"
        )
    };
    // The robot file of a KR 6 has its base link on the floor, axis 2 at 400 mm.
    let new = says(&kr6, Dialect::Fanuc, &fanuc("0"), &given, &[(5, false, "400.0 mm above the base link")]);
    assert!(new.remarks[0].remedy.contains("--base=0,0,400.0000,0,0,0"), "{}", new.remarks[0].remedy);
    says(&kr6, Dialect::Fanuc, &fanuc("0"), &Permissions { base_given: true, ..given.clone() }, &[]);
    says(
        &kr6,
        Dialect::Fanuc,
        &fanuc("F"),
        &given,
        &[(5, true, "UF F, the one that is switched on,: the numbers of this base")],
    );
    says(&kr6, Dialect::Fanuc, &fanuc("F").replace("1:L", "1: UFRAME_NUM=0 ;\n 2:L"), &given, &[(6, false, "400.0 mm")]);
    let twice = fanuc("F").replace(
        "1:L P[1] 10mm/sec FINE",
        "1: UFRAME_NUM=0 ;\n 2:L P[1] 10mm/sec FINE ;\n 3: UFRAME_NUM=2 ;\n 4:L P[1] 10mm/sec FINE",
    );
    let new = rewrite(&kr6, Dialect::Fanuc, &[("a.ls", twice.into_bytes())], &given).remove(0);
    assert!(!new.is_whole() && new.rewritten.is_empty());
}

#[test]
fn frames_of_a_list_serve_both() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("f.toml");
    fs::write(&path, "format = \"calibench-frames/1\"\n[tools]\ntGun = [0, 0, 100, 0, 0, 0]\n3 = [0, 0, 100, 0, 0, 0]\n")
        .unwrap();
    let frames: NamedFrames = read_frames(&path).unwrap();
    let bench = Bench::kr6();
    let q = vec![0.3, -1.4, 1.6, 0.2, 0.7, 0.4];
    let pose = Made { q, tool: 0, base: 0 }.pose(&bench) * pose_of([0.0, 0.0, 100.0, 0.0, 0.0, 0.0]);
    let data = format!(
        "{HEAD}<Data name=\"p\" type=\"pointRx\">\n<Value key=\"0\"{}/></Data>\n</Datas>\n",
        attributes(&KEYS, &to_val3(&pose))
    );
    let permissions = Permissions { frames, ..Permissions::default() };
    let files = [("a.dtx", data.into_bytes()), ("main.pgx", val3_program("main", "movel(p,tGun[0],m)\n"))];
    let new = rewrite(&bench, Dialect::Val3, &files, &permissions);
    assert!(new[0].is_whole() && new[0].rewritten.len() == 1, "{:?}", new[0].remarks);
    let (xyz, [a, b, c]) = angles(&pose);
    let job = format!(
        "/JOB\n//POS\n///TOOL 3\n///POSTYPE BASE\n///RECTAN\nP001={},{},{},{c},{b},{a}\n//INST\nMOVL P001 V=1\n",
        xyz[0], xyz[1], xyz[2]
    );
    assert_eq!(rewrite(&bench, Dialect::Yaskawa, &[("a.jbi", job.into_bytes())], &permissions)[0].rewritten.len(), 1);
}
