//! `cell check` says of speed, tool and payload what the controller has and what `measure` sets in its place, and moves nothing.
#![cfg(unix)]

use std::process::Command;

use crate::served::{Bench, Make};

const PROGRAM: &str = env!("CARGO_BIN_EXE_calibench");

/// The row of the check that begins so.
fn row(bench: &Bench, what: &str) -> String {
    let output = Command::new(PROGRAM).args(["cell", "check"]).arg(bench.path("cell.toml")).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success() && said.contains("the cell is ready"), "{said}");
    said.lines().find(|line| line.contains(what)).unwrap_or_else(|| panic!("{what}: {said}")).to_owned()
}

#[test]
fn a_universal_robots_payload_is_set_or_found_wrong() {
    let bench = Bench::small_of(Make::Ur);
    let served = bench.serve(&[]);
    let before = served.joints();
    let cell = bench.write_cell(&served, "", "", "[guards]\njoint_margin_deg = 0.0");
    let said = row(&bench, "payload kg");
    assert!(said.contains("0.000") && said.contains("measure sets 4.000"), "{said}");
    assert!(row(&bench, "tool mm").contains("measure sets"));
    assert!(row(&bench, "base mm, in its root").contains("0.000, 0.000, 0.000"));
    // Without the key the payload set on the pendant remains, and its mass is that of no payload of the dataset.
    let text = std::fs::read_to_string(&cell).unwrap();
    std::fs::write(&cell, text.replace("payload = { mass_kg = 4.0, com_mm = [25.0, 0.0, 70.0] }\n", "")).unwrap();
    let said = row(&bench, "payload kg");
    assert!(said.contains("not that of the dataset (4.000, 1.300)") && said.contains("robot.payload"), "{said}");
    assert_eq!(served.joints(), before, "nothing moved");
}
