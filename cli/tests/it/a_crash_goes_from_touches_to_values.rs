//! `keep recover` on a cell: the touches are planned, a lost zero is found and given in the terms of the controller, and the
//! robot is found well again after mastering.

use std::fs;
use std::path::Path;
use std::process::Output;

use calibench_report::documents::{Recovery, to_value};
use serde_json::Value;

use crate::program::{calibench, done, scenario};

/// A short plan in the cell of table 8; the second is the same robot with another zero of joint 4.
const SCENARIO: &str = "format = \"calibench-scenario/1\"\nextends = \"BASE\"\n[plan]\npool_per_ball = 150\nstarts = 1\n";
const CRASHED: &str = "[truth.effects.mdh]\ntheta4_deg = -0.293\n";
const SLIP_DEG: f64 = -0.3;

fn called(folder: &Path, line: &str) -> Output {
    calibench(folder, &line.split(' ').collect::<Vec<_>>())
}

fn recovered(folder: &Path, line: &str, code: i32) -> Recovery {
    let output = called(folder, &format!("keep recover {line} --json"));
    assert_eq!(output.status.code(), Some(code), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    let value: Value = serde_json::from_slice(&output.stdout).unwrap();
    let document: Recovery = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(to_value(&document), value);
    document
}

#[test]
fn a_lost_zero_is_found_entered_and_found_well() {
    let keep = tempfile::tempdir().unwrap();
    let folder = keep.path();
    let healthy = SCENARIO.replace("BASE", &scenario("table8.toml"));
    fs::write(folder.join("cell.toml"), &healthy).unwrap();
    fs::write(folder.join("crashed.toml"), healthy + CRASHED).unwrap();
    let run = |line: &str| done(folder, &line.split(' ').collect::<Vec<_>>());
    run("plan cell.toml -o plan.toml");
    run("measure cell.toml --plan plan.toml -o then");
    run("identify then -o calibration.toml");
    run("keep recover calibration.toml then --plan 12 --of plan.toml -o touches.toml");
    run("measure crashed.toml --plan touches.toml -o touches");
    let found = recovered(folder, "calibration.toml touches --controller abb --gear 4=-80 --present 4=3.0 -o recovered", 1);
    assert_eq!(found.verdict, "moved");
    let [zero] = found.zeros.as_slice() else { panic!("{:?}", found.zeros) };
    assert_eq!(zero.joint, 4);
    // A centring knows the zero of joint 4 to a thousandth of a degree, three times over.
    assert!((zero.change - SLIP_DEG).abs() < 0.003 && zero.within_95 < 0.01, "{zero:?}");
    let entry = zero.enter.as_ref().unwrap();
    assert!(entry.is_new_value && (entry.value - (3.0 + 80.0 * zero.change.to_radians())).abs() < 1e-9, "{entry:?}");

    // The verb makes the touches as well, and says the same of them.
    let on_cell = "calibration.toml touched --cell crashed.toml --by touches.toml --visit 0";
    let again = recovered(folder, on_cell, 1);
    assert_eq!((again.zeros.len(), again.zeros[0].joint, again.zeros[0].change), (1, 4, zero.change));
    let refused = called(folder, &format!("keep recover {on_cell}"));
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("was measured already"));

    // At most twenty lines of eighty characters.
    let text = called(folder, "keep recover calibration.toml touches --controller kuka");
    let text = String::from_utf8(text.stdout).unwrap();
    assert!(text.contains("Joint 4 lost its zero") && text.contains("$MAMES[4]"), "{text}");
    assert!(text.lines().count() <= 20, "{text}");

    // The robot as it is compensates; after mastering the arm is the healthy one.
    fs::write(folder.join("t.csv"), "id,x_mm,y_mm,z_mm,a_deg,b_deg,c_deg\nnear,420,60,400,170,10,175\n").unwrap();
    run("compensate recovered/now.toml t.csv -o fake.csv");
    run("keep recover recovered/mastered.toml then --plan 3 --of plan.toml -o three.toml");
    run("measure cell.toml --plan three.toml -o three");
    assert_eq!(recovered(folder, "recovered/mastered.toml three", 0).verdict, "nothing_moved");
    run("measure cell.toml --plan touches.toml -o healthy");
    assert_eq!(recovered(folder, "calibration.toml healthy", 0).verdict, "nothing_moved");
}

#[test]
fn what_cannot_be_used_is_refused_in_one_line() {
    let keep = tempfile::tempdir().unwrap();
    let folder = keep.path();
    fs::create_dir(folder.join("d")).unwrap();
    let frame = |name: &str| format!("[{name}]\nx_mm = 0.0\ny_mm = 0.0\nz_mm = 0.0\na_deg = 0.0\nb_deg = 0.0\nc_deg = 0.0\n");
    let described = "format = \"calibench-dataset/1\"\nrobot = \"ur5\"\n".to_owned() + &frame("base") + &frame("tool");
    fs::write(folder.join("d/dataset.toml"), described + "[noise]\npoint_um = 20.0\n").unwrap();
    let header = "id,kind,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm\n";
    let row = |k: usize| format!("p{k},point,{k},-90,90,{k},40,10,400,100,{}\n", 300 + k);
    fs::write(folder.join("d/samples.csv"), header.to_owned() + &row(1) + &row(2)).unwrap();
    for (line, words) in [
        ("keep recover ur5 d", "2 touches do not tell"),
        ("keep recover ur10 d", "what was known before is of 'ur10'"),
        ("keep recover nothing.toml d", "nothing.toml"),
        ("keep recover ur5 d --controller siemens", "kuka, abb, fanuc, ur, xarm"),
        ("keep recover ur5 d --controller abb --gear 4", "4=101.5"),
        ("keep recover ur5 d --controller abb --gear 9=100", "has 6 joints"),
        ("recover ur5 d", "`calibench keep recover`"),
    ] {
        let output = called(folder, line);
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{line}: {said}");
        assert!(said.contains(words), "{line}: {said}");
    }
}
