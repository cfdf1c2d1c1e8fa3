//! A dataset alone is replayed too: missing parts are left out, and reported once. A folder that is neither, or whose files
//! are wrong, ends in one line and exit code 2, and an existing output file is kept.

use std::fs;
use std::path::Path;
use std::process::Command;

/// A UR5 and its tool.
const DATASET: &str = r#"format = "calibench-dataset/1"
robot = "ur5"

[base]
x_mm = 0.0
y_mm = 0.0
z_mm = 0.0

[tool]
x_mm = 10.0
y_mm = 20.0
z_mm = 100.0
"#;

/// Exit code, standard output, standard error.
fn view(folder: &Path, output: &Path) -> (i32, String, String) {
    let done = Command::new(env!("CARGO_BIN_EXE_calibench-view")).arg(folder).arg("-o").arg(output).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (done.status.code().unwrap(), text(done.stdout), text(done.stderr))
}

fn refused(folder: &Path, output: &Path) -> String {
    let (code, said, why) = view(folder, output);
    assert_eq!((code, said.as_str()), (2, ""), "{why}");
    assert_eq!(why.lines().count(), 1, "{why}");
    assert!(why.starts_with("calibench-view: "), "{why}");
    why
}

/// Points of the nominal UR5 at joints that move all of them.
fn points() -> String {
    let robot = calibench::robot::built_in("ur5").unwrap();
    let tool = calibench::robot::FramePose { xyz: [0.01, 0.02, 0.1], rz_ry_rx: [0.0; 3] };
    let mut rows = String::from("id,kind,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,x_mm,y_mm,z_mm\n");
    for k in 0..60 {
        // Golden-ratio steps spread the joints evenly.
        let q: Vec<f64> = (0..6).map(|j| ((k * (j + 1)) as f64 * 0.618_034).fract() * 2.4 - 1.2).collect();
        let at = calibench::robot::kinematics::world_from_tool(&robot, &Default::default(), &tool, &q).translation.vector * 1e3;
        let degrees: Vec<String> = q.iter().map(|q| q.to_degrees().to_string()).collect();
        rows += &format!("s{k},point,{},{},{},{}\n", degrees.join(","), at.x, at.y, at.z);
    }
    rows
}

#[test]
fn a_dataset_is_replayed_and_what_it_lacks_is_said_once() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("dataset.toml"), DATASET).unwrap();
    fs::write(folder.path().join("samples.csv"), points()).unwrap();
    let output = folder.path().join("new/points.rrd");
    let (code, said, left_out) = view(folder.path(), &output);
    assert_eq!(code, 0, "{left_out}");
    assert!(said.contains("points.rrd"), "{said}");
    assert_eq!(left_out.lines().count(), 1, "{left_out}");
    for missing in ["scene.toml", "iterations.csv", "validation points"] {
        assert_eq!(left_out.matches(missing).count(), 1, "{left_out}");
    }
    assert!(fs::read(&output).unwrap().starts_with(b"RRF"), "no recording");
    let others: Vec<_> = fs::read_dir(folder.path().join("new")).unwrap().collect();
    assert_eq!(others.len(), 1, "something unfinished is left behind");
}

#[test]
fn a_folder_that_is_no_run_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("run.rrd");
    assert!(refused(folder.path(), &output).contains("neither a run nor a dataset"));
    assert!(refused(&folder.path().join("absent"), &output).contains("absent"));
    fs::write(folder.path().join("result.json"), "{}").unwrap();
    assert!(refused(folder.path(), &output).contains("result.json:1: missing field `format`"));
    assert!(!output.exists());
}

#[test]
fn a_wrong_file_is_named_and_the_old_recording_stays() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("dataset.toml"), DATASET).unwrap();
    fs::write(folder.path().join("samples.csv"), points()).unwrap();
    fs::write(folder.path().join("scene.toml"), "format = 'calibench-scene/1'\n\n[[solid]]\nname = 'plate'\n").unwrap();
    let output = folder.path().join("run.rrd");
    fs::write(&output, "old").unwrap();
    let why = refused(folder.path(), &output);
    assert!(why.contains("scene.toml:3") && why.contains("plate"), "{why}");
    assert_eq!(fs::read_to_string(&output).unwrap(), "old");
    fs::remove_file(folder.path().join("scene.toml")).unwrap();
    assert!(refused(folder.path(), folder.path()).contains("is not a file"));
    assert!(refused(folder.path(), &output.join("below a file.rrd")).contains("cannot be written"));
    assert_eq!(fs::read_to_string(&output).unwrap(), "old");
}

#[test]
fn a_journal_that_does_not_go_with_its_data_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    write("dataset.toml", DATASET);
    write("samples.csv", &points());
    write("probings.csv", "id,ball,outcome\ns0,A,centred\ns1,A,centred\n");
    let header = "probing,phase,time_s,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,r1_um,r2_um,r3_um\n";
    let first = "1,centring,1,0,0,0,0,0,0,1,1,1\n";
    let output = folder.path().join("run.rrd");
    for (cut, problem) in
        [("", "no row of probing 2"), ("2,centring,2,0,0", "iterations.csv:3"), ("2,centring,2,0,0,0,0,0,0,x,1,1\n", "'x'")]
    {
        write("iterations.csv", &format!("{header}{first}{cut}"));
        let why = refused(folder.path(), &output);
        assert!(why.contains("iterations.csv") && why.contains(problem), "{why}");
    }
    write("iterations.csv", &format!("{header}{first}2,centring,2,0,0,0,0,0,0,1,1,1\n"));
    let arm = "stop,frame,x_mm,y_mm,z_mm,rx_deg,ry_deg,rz_deg\n";
    let frames = |stop: usize, last: &str| {
        ["0", "1", "2", "3", "4", "5", "6", last].map(|frame| format!("{stop},{frame},0,0,0,0,0,0\n")).concat()
    };
    for (rows, problem) in [(frames(1, "tool"), "8 rows"), (frames(1, "tool") + &frames(2, "7"), "true_arm.csv:17: frame: '7'")]
    {
        write("true_arm.csv", &format!("{arm}{rows}"));
        let why = refused(folder.path(), &output);
        assert!(why.contains("true_arm.csv") && why.contains(problem), "{why}");
        assert!(!output.exists());
    }
    write("true_arm.csv", &format!("{arm}{}{}", frames(1, "tool"), frames(2, "tool")));
    assert_eq!(view(folder.path(), &output).0, 0);
}

#[test]
fn names_that_mean_something_to_the_viewer_or_a_terminal_are_only_names() {
    let folder = tempfile::tempdir().unwrap();
    let named = folder.path().join("a\nb\u{1b}[31m");
    fs::create_dir(&named).unwrap();
    let ball = |id: &str| format!("{DATASET}\n[[ball]]\nid = \"{id}\"\nx_mm = 300.0\ny_mm = 0.0\nz_mm = 100.0\n");
    fs::write(named.join("dataset.toml"), ball("a/../b/** + /world [x]")).unwrap();
    fs::write(named.join("samples.csv"), points()).unwrap();
    let (code, said, left_out) = view(&named, &named.join("run.rrd"));
    assert_eq!(code, 0, "{left_out}");
    assert!(
        [&said, &left_out].iter().all(|text| text.lines().count() == 1 && !text.contains('\u{1b}')),
        "{said:?} {left_out:?}"
    );
    assert!(refused(&named, &named).contains("is not a file"));
    fs::write(named.join("dataset.toml"), ball("a\\u0007")).unwrap();
    let why = refused(&named, &named.join("again.rrd"));
    assert!(why.contains("ball[0].id") && why.contains("control characters"), "{why}");
    assert!(!why.contains(['\u{7}', '\u{1b}']), "{why:?}");
}
