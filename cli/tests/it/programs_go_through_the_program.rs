//! `compensate PROGRAM...` from the command line: files, exit codes, what is told, and nothing half-written.

use std::fs;
use std::process::Output;

use serde_json::Value;
use tempfile::TempDir;

use crate::compensate_goes_through_the_program::{calibench, run_folder};

const TOOL: &str = "--tool=0,0,125,0,0,0";
const SRC: &[u8] =
    b"DEF weld ( )\r\n$TOOL={X 0,Y 0,Z 125,A 0,B 0,C 0} ; Stra\xdfe\r\nPTP XP1\r\nLIN XP2 C_DIS\r\nLIN_REL {Z 5}\r\nEND\r\n";
const DAT: &[u8] = b"DEFDAT weld\r\nDECL E6POS XP1={X 420,Y 60,Z 400,A 170,B 10,C 175,E1 0.0}\r\nDECL FRAME XP2={X 430,Y -80,Z 380,A -175,B -5,C 180}\r\nENDDAT\r\n";

fn bench() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::copy(run_folder().join("r/trical.toml"), folder.path().join("c.toml")).unwrap();
    fs::write(folder.path().join("weld.src"), SRC).unwrap();
    fs::write(folder.path().join("weld.dat"), DAT).unwrap();
    folder
}

fn words(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

#[test]
fn a_source_and_its_data_go_into_a_folder() {
    let folder = bench();
    let told = calibench(folder.path(), &["compensate", "c.toml", "weld.src", "weld.dat", "-o", "new", TOOL]);
    assert_eq!(told.status.code(), Some(0), "{}", words(&told));
    let out = words(&told);
    for said in [
        "weld.src: 0 of 0 positions rewritten",
        "weld.dat: 2 of 2 positions rewritten, shifted by up to",
        "check: weld.src:5: LIN_REL: a relative motion",
        "assumed: the flange carries 'heavy'",
        "assumed: every pose is in the base frame above",
        "controller's tool  X 0.0000  Y 0.0000  Z 125.0000",
    ] {
        assert!(out.contains(said), "{said} is not in {out}");
    }
    assert_eq!(fs::read(folder.path().join("new/weld.src")).unwrap(), SRC, "nothing in it is a position");
    let dat = fs::read_to_string(folder.path().join("new/weld.dat")).unwrap();
    let [old, new] = [str::from_utf8(DAT).unwrap(), &dat].map(|text| text.split("\r\n").map(str::to_owned).collect::<Vec<_>>());
    assert_eq!((&new[0], &new[3..]), (&old[0], &old[3..]));
    assert!(new[1].starts_with("DECL E6POS XP1={X 4") && new[1].ends_with(",E1 0.0}") && new[1] != old[1], "{}", new[1]);

    // The same as the same targets in a table give, to the six decimals that it has.
    let table = "id,x_mm,y_mm,z_mm,a_deg,b_deg,c_deg\np-1,420,60,400,170,10,175\nlast,430,-80,380,-175,-5,180\n";
    fs::write(folder.path().join("t.csv"), table).unwrap();
    assert!(calibench(folder.path(), &["compensate", "c.toml", "t.csv", "-o", "f.csv", TOOL]).status.success());
    let file = fs::read_to_string(folder.path().join("f.csv")).unwrap();
    for (row, line) in file.lines().skip(1).zip(&new[1..]) {
        let wanted: Vec<f64> = row.split(',').skip(3).take(6).map(|f| f.parse().unwrap()).collect();
        let of =
            |name: &str| line.split(['{', ',', '}']).find_map(|f| f.strip_prefix(name)).unwrap().trim().parse::<f64>().unwrap();
        for (name, wanted) in ["X ", "Y ", "Z ", "A ", "B ", "C "].into_iter().zip(wanted) {
            assert!((of(name) - wanted).abs() < 1e-6, "{name}: {wanted} in {line}");
        }
    }
}

#[test]
fn a_program_with_a_hole_is_not_written_unless_asked() {
    let folder = bench();
    let holed = String::from_utf8(DAT.to_vec()).unwrap().replace("X 430", "X 4300");
    fs::write(folder.path().join("weld.dat"), &holed).unwrap();
    let with = |more: &[&str]| {
        let fixed = ["compensate", "c.toml", "weld.src", "weld.dat", "-o", "new", TOOL];
        calibench(folder.path(), &[&fixed[..], more].concat())
    };
    let told = with(&[]);
    assert_eq!(told.status.code(), Some(1), "{}", words(&told));
    assert!(
        words(&told).contains("not rewritten: weld.dat:3: XP2: no posture of the arm reaches it; check"),
        "{}",
        words(&told)
    );
    assert!(words(&told).contains("--partly") && !folder.path().join("new").exists());

    let document = with(&["--json", "--partly"]);
    assert_eq!(document.status.code(), Some(1));
    let document: Value = serde_json::from_slice(&document.stdout).unwrap();
    let files = document["programs"]["files"].as_array().unwrap();
    assert_eq!((&files[1]["positions"], &files[1]["rewritten"]), (&2.into(), &1.into()));
    assert_eq!(files[1]["not_rewritten"][0]["line"], 3);
    assert!(files[1]["largest_shift_mm"].as_f64().unwrap() > 0.1);
    let dat = fs::read_to_string(folder.path().join("new/weld.dat")).unwrap();
    assert_eq!(dat.lines().nth(2), holed.lines().nth(2), "what is refused stays");
    assert_ne!(dat.lines().nth(1), holed.lines().nth(1));
}

#[test]
fn wrong_calls_end_in_one_error_and_write_nothing() {
    let folder = bench();
    fs::write(folder.path().join("a.ls"), "/PROG A\n/END\n").unwrap();
    fs::write(folder.path().join("wide.src"), b"\xff\xfeD\0E\0F\0").unwrap();
    for (arguments, said) in [
        (&["weld.src", "-o", "weld.src"][..], "-o weld.src: is read by this command"),
        (&["weld.src", "weld.dat", "-o", "."], "is one of the programs themselves"),
        (&["weld.src", "a.ls", "-o", "new"], "another controller"),
        (&["weld.src", "none.dat", "-o", "new"], "none.dat"),
        (&["weld.src", "c.toml", "-o", "new"], "is not a robot program"),
        (&["wide.src", "-o", "new"], "single bytes"),
        (&["weld.src", "weld.dat", "-o", "c.toml"], "-o c.toml: is read by this command"),
        (&["weld.src", "weld.dat", "-o", "a.ls"], "name a folder"),
        (&["weld.src", "-o", "new.src", "--krl", "m"], "--krl"),
        (&["t.csv", "-o", "new.csv", "--partly"], "--partly"),
        (&["a.ls", "-o", "new"], "contains no position that is written out"),
    ] {
        let told = calibench(folder.path(), &[&["compensate", "c.toml"], arguments].concat());
        assert_eq!(told.status.code(), Some(2), "{arguments:?}: {}", words(&told));
        let error = String::from_utf8(told.stderr).unwrap();
        assert!(error.contains(said) && told.stdout.is_empty(), "{arguments:?}: {error}");
        assert!(!folder.path().join("new").exists() && fs::read(folder.path().join("weld.src")).unwrap() == SRC);
    }
    // Another tool than the one of the program: the remedy is the option to give.
    let told = calibench(folder.path(), &["compensate", "c.toml", "weld.src", "weld.dat", "-o", "new", "--tool=0,0,90,0,0,0"]);
    assert_eq!(told.status.code(), Some(1));
    assert!(
        words(&told).contains("weld.src:2: tool: the program sets another tool")
            && words(&told).contains("--tool=0,0,125,0,0,0"),
        "{}",
        words(&told)
    );
}

#[test]
fn the_document_has_the_shifts_of_the_table() {
    let folder = bench();
    let run = |more: &[&str]| {
        let fixed = ["compensate", "c.toml", "weld.src", "weld.dat", "-o", "new", TOOL];
        calibench(folder.path(), &[&fixed[..], more].concat())
    };
    let (table, document) = (words(&run(&[])), run(&["--json"]));
    let document: Value = serde_json::from_slice(&document.stdout).unwrap();
    let shifts = document["programs"]["files"][1]["shifts"].as_array().unwrap();
    assert_eq!(shifts.len(), 2);
    for (shift, line) in shifts.iter().zip([2, 3]) {
        let of = |key: &str| shift[key].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect::<Vec<f64>>();
        let all = |values: &[f64], form: fn(f64) -> String| values.iter().map(|v| form(*v)).collect::<Vec<_>>().join(" ");
        let (xyz, along, total) = (of("xyz_mm"), of("shift_xyz_mm"), shift["shift_mm"].as_f64().unwrap());
        assert!((along.iter().map(|v| v * v).sum::<f64>().sqrt() - total).abs() < 1e-9 && total > 0.1);
        let row = table.lines().find(|row| row.contains(&format!("weld.dat:{line} "))).unwrap();
        let outside = if shift["outside_range"] == true { "outside" } else { "" };
        let cells: Vec<&str> = row.split(['│', '┆']).map(str::trim).collect();
        let wanted = [
            format!("weld.dat:{line}"),
            shift["what"].as_str().unwrap().to_owned(),
            all(&xyz, |v| format!("{v:.1}")),
            all(&along, |v| format!("{v:+.3}")),
            format!("{total:.3}"),
            outside.to_owned(),
        ];
        assert_eq!(cells[1..7], wanted, "{table}");
        assert_eq!(shift["line"], line);
    }
}

#[test]
fn a_wrong_file_of_frames_is_one_error() {
    let folder = bench();
    fs::write(folder.path().join("f.toml"), "[tools]\n1 = [0, 0, 0, 0, 0, 0]\n").unwrap();
    fs::write(folder.path().join("g.dat"), "TOOL_DATA[1]={X 0,Y 0,Z 0,A 0,B 0}\n").unwrap();
    for (file, said) in [("f.toml", "f.toml: format: is missing; add"), ("g.dat", "g.dat:1: TOOL_DATA[1]: its six")] {
        let told = calibench(folder.path(), &["compensate", "c.toml", "weld.src", "weld.dat", "-o", "new", "--frames", file]);
        let error = String::from_utf8(told.stderr).unwrap();
        assert_eq!(told.status.code(), Some(2), "{error}");
        assert!(error.contains(said) && told.stdout.is_empty() && !folder.path().join("new").exists(), "{error}");
    }
}
