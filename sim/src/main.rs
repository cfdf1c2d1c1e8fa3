//! The program `calibench`.

use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_sim::cli::main()
}
