//! Tools and bases come from a list of one's own, from `$config.dat`, from a module of RAPID and from FANUC's listing; what is
//! wrong in one is a single error with file, line, field and remedy.

use std::fs;
use std::path::Path;

use calibench::compensate::Compensator;
use calibench_programs::{Dialect, NamedFrames, Permissions, Program, RewrittenProgram, read_frames, rewrite_programs};

use crate::a_program_is_rewritten_and_nothing_else::{Bench, angles};
use crate::programs_are_as_controllers_write_them::BARE;

fn read(name: &str, text: &str) -> Result<NamedFrames, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, text).unwrap();
    read_frames(&path).map_err(|e| e.to_string().replace(&format!("{}/", folder.path().display()), ""))
}

/// The programs of one call with frames from files.
fn rewritten(bench: &Bench, dialect: Dialect, text: &str, frames: NamedFrames) -> RewrittenProgram {
    let mut compensator = Compensator::new(&bench.calibration, &BARE).unwrap();
    let program = Program { path: "a.x".into(), dialect, bytes: text.into() };
    rewrite_programs(&[program], &mut compensator, &Permissions { frames, ..Permissions::default() }).remove(0)
}

const LIST: &str = "format = \"calibench-frames/1\"\n[tools]\n3 = [1, 2, 100, 0, 10, 0]\nTGUN = [1, 2, 100, 0, 10, 0]\n\
                    gun = [1, 2, 100, 0, 10, 0]\n[bases]\n4 = [5, 6, 7, 0, 0, 20]\nwJig = [5, 6, 7, 0, 0, 20]\n";
const CONFIG: &str = "DEFDAT $CONFIG\r\nTOOL_DATA[3]={X 1.0,Y 2.0,Z 100.0,A 0.0,B 10.0,C 0.0}\r\n\
                      BASE_DATA[4]={X 5.0,Y 6.0,Z 7.0,A 0.0,B 0.0,C 20.0}\r\nENDDAT\r\n";
const MODULE: &str = "MODULE BASE\n  PERS tooldata tgun:=[TRUE,[[1,2,100],[0.99619469809,0,0.08715574275,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];\n\
                      TASK PERS wobjdata wjig:=[FALSE,TRUE,\"\",[[5,6,7],[0.98480775301,0.17364817767,0,0]],[[0,0,0],[1,0,0,0]]];\nENDMODULE\n";
const LISTING: &str = "[*SYSTEM*]$MNUTOOL  Storage: CMOS  Access: RW  : ARRAY[2,10] OF POSITION\n\
    \x20    [1,1] =   Group: 1   Config: N D B, 0, 0, 0\n      X: ********   Y: ********   Z: ********\n      W: ********   P: ********   R: ********\n\
    \x20    [1,3] =   Group: 1   Config: N D B, 0, 0, 0\n      X:     1.000   Y:     2.000   Z:   100.000\n      W:      .000   P:    10.000   R:      .000\n\
    \x20    [2,3] =   Group: 2   Config: N D B, 0, 0, 0\n      X:     9.000   Y:     9.000   Z:     9.000\n      W:      .000   P:     0.000   R:      .000\n\
    [*SYSTEM*]$MNUFRAME  Storage: CMOS  Access: RW  : ARRAY[2,9] OF POSITION\n\
    \x20    [1,4] =   Group: 1   Config: N D B, 0, 0, 0\n      X:     5.000   Y:     6.000   Z:     7.000\n      W:    20.000   P:      .000   R:      .000\n\
    [*SYSTEM*]$MNUFRAMENUM  Storage: CMOS  Access: RW  : ARRAY[2] OF BYTE\n     [1] = 4\n";

#[test]
fn every_form_gives_the_same_frames() {
    let (kr6, ur5) = (Bench::kr6(), Bench::ur5());
    let ([x, y, z], [a, b, c]) =
        angles(&Compensator::new(&kr6.calibration, &BARE).unwrap().nominal_pose(&[0.3, -1.4, 1.6, 0.2, 0.7, 0.4]));
    let krl = format!("$TOOL=TOOL_DATA[3]\n$BASE=BASE_DATA[4]\nLIN {{X {x},Y {y},Z {z},A {a},B {b},C {c}}}\n");
    let fanuc = format!(
        "/PROG A\n/MN\n 1:L P[1] 10mm/sec FINE ;\n/POS\nP[1]{{\n GP1:\n UF : 4, UT : 3, CONFIG : 'x',\n X = {x} mm, Y = {y} mm, Z = {z} mm,\n W = {c} deg, P = {b} deg, R = {a} deg\n}};\n/END\n"
    );
    let q = calibench::robot::FramePose { xyz: [0.0; 3], rz_ry_rx: [a, b, c].map(f64::to_radians) }.pose().rotation;
    let q = nalgebra::UnitQuaternion::from_rotation_matrix(&q);
    let rapid = format!(
        "MODULE m\nCONST robtarget p1:=[[{x},{y},{z}],[{},{},{},{}],[x,x,x,x],[9E9,9E9,9E9,9E9,9E9,9E9]];\nPROC main()\nMoveL p1,v1,fine,tGun\\WObj:=wJig;\nENDPROC\nENDMODULE\n",
        q.w, q.i, q.j, q.k
    );
    let [tool, base] = ["tool 1,2,100,0,10,0", "base 5,6,7,0,0,20"];
    for (name, frames, dialect, program) in [
        ("own.toml", LIST, Dialect::Krl, &krl),
        ("own.toml", LIST, Dialect::Rapid, &rapid),
        ("own.toml", LIST, Dialect::Fanuc, &fanuc),
        ("$config.dat", CONFIG, Dialect::Krl, &krl),
        ("BASE.SYS", MODULE, Dialect::Rapid, &rapid),
        ("base.modx", MODULE, Dialect::Rapid, &rapid),
        ("sysframe.va", LISTING, Dialect::Fanuc, &fanuc),
        ("frames.txt", LISTING, Dialect::Fanuc, &fanuc),
    ] {
        let new = rewritten(&kr6, dialect, program, read(name, frames).unwrap());
        assert!(new.is_whole() && new.rewritten.len() == 1, "{name}: {:#?}", new.remarks);
        for frame in [tool, base] {
            assert!(new.assumed.iter().any(|sentence| sentence.ends_with(frame)), "{name}: {:#?}", new.assumed);
        }
    }
    let script = "set_tcp(gun)\nmovel(p[0.3,0.2,0.4,0,3,0])\n";
    let new = rewritten(&ur5, Dialect::UrScript, script, read("own.toml", LIST).unwrap());
    assert!(
        new.is_whole() && new.assumed.iter().any(|sentence| sentence == "gun is tool 1,2,100,0,10,0"),
        "{:#?}",
        new.assumed
    );
    assert_eq!(read("sysframe.va", LISTING).unwrap().counts(), [1, 1], "neither group 2 nor what was never set");
}

#[test]
fn what_is_wrong_is_one_error() {
    let format = "format = \"calibench-frames/1\"\n";
    let list = |body: &str| format!("{format}{body}");
    for (name, text, said) in [
        ("f.toml", "[tools]\n1 = [0, 0, 0, 0, 0, 0]\n".into(), "f.toml: format: is missing; add `format`"),
        ("f.toml", "format = \"calibench-frames/2\"\n".into(), "f.toml:1: format: is 'calibench-frames/2', not"),
        ("f.toml", list("[tool]\n1 = [0, 0, 0, 0, 0, 0]\n"), "f.toml:2: tool: there is no such key"),
        ("f.toml", list("[tools]\n1 = [0, 0, 0]\n"), "f.toml:3: tools.1: invalid length 3"),
        ("f.toml", list("[tools]\n1 = [0, 0, nan, 0, 0, 0]\n"), "f.toml:3: tools.1[2]: `nan` is not a finite number"),
        ("f.toml", list("[tools]\n1 = \"0,0,0\"\n"), "f.toml:3: tools.1: invalid type"),
        ("f.toml", list("[tools]\n1 = [0, 0, 20000, 0, 0, 0]\n"), "f.toml:3: tools.1: is more than 10000 mm away"),
        ("f.toml", list("[bases]\n\"\" = [0, 0, 0, 0, 0, 0]\n"), "has no name"),
        (
            "f.toml",
            list("[bases]\ngun = [0, 0, 1, 0, 0, 0]\nGUN = [0, 0, 2, 0, 0, 0]\n"),
            "f.toml:3: bases.gun: is the same name as `GUN`",
        ),
        (
            "f.toml",
            list("[tools]\n1 = [0, 0, 1, 0, 0, 0]\n01 = [0, 0, 2, 0, 0, 0]\n"),
            "f.toml:3: tools.1: is the same name as `01`",
        ),
        ("f.toml", format.into(), "f.toml: contains no tool and no base"),
        (
            "c.dat",
            CONFIG.replace("Z 100.0", "Z"),
            "c.dat:2: TOOL_DATA[3]: its six or seven numbers are not all written out; write plain numbers",
        ),
        ("c.dat", CONFIG.replace(",C 20.0", ""), "c.dat:3: BASE_DATA[4]: its six or seven numbers"),
        (
            "c.dat",
            CONFIG.replace("ENDDAT", "TOOL_DATA[3]={X 9,Y 2,Z 100,A 0,B 10,C 0}\r\nENDDAT"),
            "c.dat:4: TOOL_DATA[3]: has other numbers than in line 2; keep the one that holds",
        ),
        ("c.dat", "DEFDAT $CONFIG\r\nENDDAT\r\n".into(), "c.dat: contains no tool and no base"),
        ("m.mod", MODULE.replace("[[1,2,100]", "[[1,x,100]"), "m.mod:2: tgun: its six or seven numbers"),
        ("m.sys", MODULE.replace("[0.98480775301", "[0.5"), "m.sys:3: wjig: its six or seven numbers"),
        ("m.sys", "MODULE m\nENDMODULE\n".into(), "m.sys: contains no tool and no base"),
        (
            "s.va",
            LISTING.replace("2.000   Z:", "2,x00   Z:").replace("Y:     2,x", "Y:   x"),
            "s.va:6: UT 3: Y: is not a number",
        ),
        ("s.va", "[*SYSTEM*]$MNUTOOL\n".into(), "s.va: contains no tool and no base"),
    ] {
        let error = read(name, &text).unwrap_err();
        assert!(error.contains(said), "{said}\n{error}");
        assert_eq!(error.lines().count(), 1);
    }
    assert!(read_frames(Path::new("/nowhere/frames.toml")).is_err());
}
