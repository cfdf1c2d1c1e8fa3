//! An imported table is held in memory once, whatever is checked meanwhile: a million rows within a gigabyte.
#![cfg(target_os = "linux")]

use std::fmt::Write;
use std::fs;
use std::process::{Command, Stdio};
use std::time::Duration;

use calibench::robot::kinematics::world_from_tool;
use calibench::robot::{FramePose, built_in};
use calibench::units::MM;

/// Number of rows of the table.
const ROWS: usize = 40_000;
/// Largest memory of a row, bytes, without that of the program itself: a million rows at this rate are 960 MB.
const MOST_BYTES_A_ROW: usize = 940;
/// Memory of the program itself, kB.
const PROGRAM_KB: usize = 24_000;

const MAP: &str = "format = \"calibench-import/1\"\n[columns]\n
q1 = { column = \"j1\", unit = \"rad\" }\nq2 = { column = \"j2\", unit = \"rad\" }\nq3 = { column = \"j3\", unit = \"rad\" }
q4 = { column = \"j4\", unit = \"rad\" }\nq5 = { column = \"j5\", unit = \"rad\" }\nq6 = { column = \"j6\", unit = \"rad\" }
x = { column = \"x\", unit = \"m\" }\ny = { column = \"y\", unit = \"m\" }\nz = { column = \"z\", unit = \"m\" }
[dataset]\nrobot = \"ur5\"\n[dataset.tool]\nx_mm = 0.0\ny_mm = 0.0\nz_mm = 28.0\n[dataset.noise]\npoint_um = 50.0\n";

#[test]
fn rows_are_held_once() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("map.toml"), MAP).unwrap();
    let robot = built_in("ur5").unwrap();
    let tool = FramePose { xyz: [0.0, 0.0, 28.0 * MM], ..FramePose::default() };
    let mut table = String::from("j1,j2,j3,j4,j5,j6,x,y,z\n");
    for k in 0..ROWS {
        let q: Vec<f64> = (1..=6).map(|i| 6.0 * ((k * (2 * i + 1)) as f64 * 0.618_033_988_7).fract() - 3.0).collect();
        let seen = world_from_tool(&robot, &FramePose::default(), &tool, &q).translation.vector;
        q.iter().for_each(|q| write!(table, "{q:.8},").unwrap());
        writeln!(table, "{:.7},{:.7},{:.7}", seen.x, seen.y, seen.z).unwrap();
    }
    // One row twice, which the digests of the rows must show.
    let last = table.trim_end().rsplit('\n').next().unwrap().to_owned();
    writeln!(table, "{last}").unwrap();
    fs::write(folder.path().join("table.csv"), table).unwrap();
    let mut child = Command::new(env!("CARGO_BIN_EXE_calibench"))
        .current_dir(&folder)
        .args(["import", "generic", "table.csv", "--map", "map.toml", "-o", "set", "--json"])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut peak_kb: usize = 0;
    while child.try_wait().unwrap().is_none() {
        let status = fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
        let peak = status.lines().find_map(|l| l.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB")?.parse().ok());
        peak_kb = peak.unwrap_or(0).max(peak_kb);
        std::thread::sleep(Duration::from_millis(10));
    }
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success());
    let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(told["samples"].as_u64(), Some(ROWS as u64), "{told}");
    let per_row = (peak_kb.saturating_sub(PROGRAM_KB) << 10) / ROWS;
    println!("{peak_kb} kB at most, {per_row} bytes a row");
    assert!(peak_kb > PROGRAM_KB && per_row < MOST_BYTES_A_ROW, "{peak_kb} kB, {per_row} bytes a row");
}
