//! A file of targets is read as it is meant, or refused with one error that names line, column and remedy.

use std::path::PathBuf;

use crate::identified::setup;
use calibench::compensate::targets_file::{Expected, read_targets};
use calibench::compensate::{Desired, Target};
use calibench::files::FileError;
use calibench::robot::{FramePose, Robot, built_in};
use calibench::units::{DEG, MM};
use tempfile::TempDir;

const POSES: &str =
    "id,x_mm,y_mm,z_mm,a_deg,b_deg,c_deg,s,t,payload\np1,400,-100.5,300,10,85,-170,2,35,light\np2,410,0,300,0,90,180,,,\n";
const JOINTS: &str = "id,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\np1,0,-90,90,0,30,0\n";

fn read(text: &str, robot: &Robot, by_temperature: Option<&str>) -> Result<Vec<Target>, FileError> {
    let folder = TempDir::new().unwrap();
    let path: PathBuf = folder.path().join("targets.csv");
    std::fs::write(&path, text).unwrap();
    read_targets(&path, &Expected { robot, payloads: &setup().payloads, by_temperature })
}

fn kr6() -> Robot {
    built_in("kr6_r700").unwrap()
}

#[test]
fn poses_and_joints_are_read() {
    let targets = read(POSES, &kr6(), None).unwrap();
    assert_eq!(targets.len(), 2);
    let pose =
        FramePose { xyz: [400.0 * MM, -100.5 * MM, 300.0 * MM], rz_ry_rx: [10.0 * DEG, 85.0 * DEG, -170.0 * DEG] }.pose();
    assert_eq!(targets[0].desired, Desired::Pose { pose, near: None, status: Some(2), turn: Some(35) });
    assert_eq!(targets[0].payload.as_ref().unwrap().mass, 1.3);
    assert!(targets[1].payload.is_none());
    let joints = read(JOINTS, &kr6(), None).unwrap();
    assert_eq!(joints[0].desired, Desired::Joints([0.0, -90.0, 90.0, 0.0, 30.0, 0.0].map(|q: f64| q * DEG).to_vec()));
    // A byte-order mark, line ends of Windows, blanks, no line end at the end.
    let other = format!("\u{feff}{}", JOINTS.trim_end().replace('\n', "\r\n").replace(",", " , "));
    assert_eq!(read(&other, &kr6(), None).unwrap(), joints);
    let warm =
        read(&JOINTS.replace("id,", "id,temp_c,time_s,").replace("p1,", "p1,24.5,60,"), &kr6(), Some("thermal_growth:temp"))
            .unwrap();
    assert_eq!((warm[0].conditions.temp_c, warm[0].conditions.time_s), (Some(24.5), Some(60.0)));
}

#[test]
fn every_mistake_is_named() {
    // File, what is changed in it into what, line, column, a word of the remedy.
    let cases = [
        (POSES, "id,", "name,", 1, "name", "x_mm"),
        (POSES, "x_mm,", "x,", 1, "x", "unit"),
        (POSES, "x_mm,", "x_m,", 1, "x_m", "in that unit"),
        (POSES, "c_deg,", "", 1, "c_deg", "a target is"),
        (POSES, "y_mm", "x_mm", 1, "x_mm", "one of them"),
        (POSES, "id,x_mm", "1,x_mm", 1, "", "names the columns"),
        (POSES, "p2,410", "p1,410", 3, "id", "its own id"),
        (POSES, "p2,410", ",410", 3, "id", "fill"),
        (POSES, "p2,410", "p\u{1b}2,410", 3, "id", "plain name"),
        (POSES, "p2,410,", "p2,,", 3, "x_mm", "fill"),
        (POSES, "p2,410,", "p2,4.1e9,", 3, "x_mm", "in mm"),
        (POSES, "p2,410,", "p2,nan,", 3, "x_mm", "number"),
        (POSES, "p2,410,", "p2,inf,", 3, "x_mm", "number"),
        (POSES, "p2,410,", "p2,410mm,", 3, "x_mm", "without its unit"),
        (POSES, "p2,410,", "p2,\"4,1\",", 3, "x_mm", "decimal point"),
        (POSES, "p2,410,", "p2,", 3, "", "every column"),
        (POSES, ",2,35,", ",8,35,", 2, "s", "0 to 7"),
        (POSES, ",2,35,", ",2,64,", 2, "t", "0 to 63"),
        (POSES, ",2,35,", ",2,-1,", 2, "t", "0 to 63"),
        (POSES, "light", "lite", 2, "payload", "trical, light"),
        (POSES, "\np1,400", "\np1,400,,,,,,,,,,,", 2, "", "every column"),
        (JOINTS, "q6_deg", "q7_deg", 1, "q7_deg", "did you mean"),
        (JOINTS, ",q6_deg", "", 1, "q6_deg", "a target is"),
        (JOINTS, ",30,", ",,", 2, "q5_deg", "fill"),
        (JOINTS, ",", ";", 1, "", "commas"),
        (JOINTS, ",", "\t", 1, "", "commas"),
    ];
    for (good, old, new, line, field, remedy) in cases {
        assert!(good.contains(old), "{old}");
        let bad = if old == "," { good.replace(old, new) } else { good.replacen(old, new, 1) };
        let error = read(&bad, &kr6(), None).expect_err(&bad);
        assert_eq!((error.line, error.field.as_str()), (Some(line), field), "{old} -> {new}: {error}");
        assert!(error.remedy.contains(remedy), "{old} -> {new}: {error}");
    }
    for (text, problem) in [("", "empty"), ("id,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n", "no rows")] {
        let error = read(text, &kr6(), None).unwrap_err();
        assert!(error.problem.contains(problem), "{error}");
    }
}

#[test]
fn what_the_arm_or_the_calibration_asks_for_is_asked_for() {
    let error = read(POSES, &built_in("ur10").unwrap(), None).unwrap_err();
    assert_eq!((error.line, error.field.as_str()), (Some(1), "s"), "{error}");
    let error = read(JOINTS, &built_in("panda").unwrap(), None).unwrap_err();
    assert_eq!((error.line, error.field.as_str()), (Some(1), "q7_deg"), "{error}");
    let error = read(JOINTS, &kr6(), Some("thermal_growth:temp")).unwrap_err();
    assert_eq!((error.line, error.field.as_str()), (Some(1), "temp_c"), "{error}");
    assert!(error.remedy.contains("thermal_growth:temp"));
    let error =
        read(&JOINTS.replace("id,", "id,temp_c,").replace("p1,", "p1,,"), &kr6(), Some("thermal_growth:temp")).unwrap_err();
    assert_eq!((error.line, error.field.as_str()), (Some(2), "temp_c"), "{error}");
    let signed = JOINTS.replace("id,", "id,approach1,approach2,approach3,approach4,approach5,approach6,");
    let error = read(&signed.replace("p1,", "p1,1,2,0,0,0,0,"), &kr6(), None).unwrap_err();
    assert_eq!((error.line, error.field.as_str()), (Some(2), "approach2"), "{error}");
}
