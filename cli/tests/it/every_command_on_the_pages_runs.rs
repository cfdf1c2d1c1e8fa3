//! Every command on every page runs, and prints what the page shows; what cannot run here is at least understood by the program.
//! `tests/pages/run` tells how pages say which is which.
//!
//! `CALIBENCH_WRITE_README=1 cargo test --package calibench-cli every_command_on_the_pages_runs` writes the program's present output
//! into the pages.

#![cfg(unix)]

use std::path::Path;
use std::process::Command;

#[test]
fn every_command_on_the_pages_runs() {
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/pages/run");
    let output = match Command::new(script).arg(env!("CARGO_BIN_EXE_calibench")).output() {
        Ok(output) => output,
        Err(e) if std::env::var_os("CALIBENCH_REQUIRE_ALL").is_some() => panic!("tests/pages/run needs Python: {e}"),
        Err(e) => return println!("the pages are not run: no Python: {e}"),
    };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    print!("{}", String::from_utf8_lossy(&output.stdout));
}
