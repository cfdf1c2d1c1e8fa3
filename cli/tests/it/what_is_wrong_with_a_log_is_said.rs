//! What is wrong with a recording is one sentence that names the file and what to do; nothing is written.

use std::fs;
use std::path::{Path, PathBuf};

use crate::oracles;
use crate::program::calibench;

fn recording(name: &str) -> PathBuf {
    oracles::folder().join("logs").join(name)
}

/// The sentence by which `import log` refuses.
#[track_caller]
fn refused(at: &Path, arguments: &[&str]) -> String {
    let robot = if arguments.contains(&"--robot") { vec![] } else { vec!["--robot", "ur5"] };
    let all: Vec<&str> =
        ["import", "log"].into_iter().chain(arguments.iter().copied()).chain(robot).chain(["-o", "o"]).collect();
    let output = calibench(at, &all);
    let told = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{told}{}", String::from_utf8_lossy(&output.stdout));
    assert_eq!(told.trim_end().lines().count(), 1, "{told}");
    assert!(!at.join("o").exists(), "{told}");
    told
}

#[track_caller]
fn says(told: &str, parts: &[&str]) {
    parts.iter().for_each(|part| assert!(told.contains(part), "no '{part}' in {told}"));
}

#[test]
fn what_is_wrong_with_a_recording_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let board = recording("board.mcap");
    let board = board.to_str().unwrap();
    says(&refused(at, &["there-is-none.mcap"]), &["there-is-none.mcap"]);
    says(&refused(at, &[board, "--measured", "/tracker"]), &["'/tracker'", "/board (758 times)"]);
    says(&refused(at, &[board, "--joints-from", "/joints"]), &["'/joints'", "/joint_states"]);
    says(&refused(at, &[board, "--joints", "a,b,c,d,e,f"]), &["elbow_joint", "a, b, c, d, e, f", "--joints"]);
    says(&refused(at, &[board, "--joints", "a,b"]), &["2 names", "6 joints"]);
    says(&refused(at, &[board, "--robot", "panda"]), &["gripper", "7 joints", "--joints"]);
    says(&refused(at, &[board, "--still", "10s"]), &["never stands still", "--still"]);
    says(&refused(at, &[board, "--shift", "1000s"]), &["measured nothing", "--shift"]);
    says(&refused(at, &[board, "--map", "m.toml"]), &["--map"]);

    // Bytes that are none, and those of something else.
    fs::write(at.join("none.mcap"), b"").unwrap();
    fs::write(at.join("text.mcap"), b"q1,q2\n1,2\n").unwrap();
    fs::write(at.join("text.db3"), b"q1,q2\n1,2\n").unwrap();
    fs::write(at.join("one.bag"), b"#ROSBAG V2.0\n").unwrap();
    fs::write(at.join("bytes.csv"), [0, 1, 2, 3]).unwrap();
    fs::create_dir(at.join("empty")).unwrap();
    for (file, parts) in [
        ("none.mcap", ["none.mcap", ""]),
        ("text.mcap", ["text.mcap", "no MCAP file"]),
        ("text.db3", ["text.db3", "bag of ROS 2"]),
        ("one.bag", ["one.bag", "rosbags-convert"]),
        ("bytes.csv", ["bytes.csv", "neither"]),
        ("empty", ["empty", "no recording"]),
    ] {
        says(&refused(at, &[file]), &parts);
    }

    // Tables over time.
    let joints: String = (0..200).map(|k| format!("{},0,0,0,0,0,{}\n", f64::from(k) / 100.0, k / 50)).collect();
    fs::write(at.join("joints.csv"), format!("time_s,q1,q2,q3,q4,q5,q6\n{joints}")).unwrap();
    fs::write(at.join("untimed.csv"), format!("n,q1,q2,q3,q4,q5,q6\n{joints}")).unwrap();
    says(&refused(at, &["joints.csv"]), &["joints.csv", "no measured points", "further file"]);
    says(&refused(at, &["untimed.csv"]), &["untimed.csv", "no column of times", "time_s"]);
}

#[test]
fn a_recording_that_was_cut_off_is_used_as_far_as_it_goes() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let whole = fs::read(recording("frames/frames.mcap")).unwrap();
    let plain = fs::read(recording("board.mcap")).unwrap();
    for (name, bytes) in [("frames.mcap", whole), ("board.mcap", plain)] {
        for share in [0.001, 0.2, 0.5, 0.8, 0.99] {
            let length = (bytes.len() as f64 * share) as usize;
            fs::write(at.join(name), &bytes[..length]).unwrap();
            let output = calibench(at, &["import", "log", name, "--robot", "ur5", "-o", "o", "-v"]);
            let (said, told) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
            assert!([Some(0), Some(2)].contains(&output.status.code()), "{share}: {said}{told}");
            assert!(said.contains("cut off") || told.contains("cut off"), "{share}: {said}{told}");
        }
    }
}
