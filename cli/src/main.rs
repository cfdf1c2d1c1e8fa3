//! The program `calibench`.

use std::process::ExitCode;

fn main() -> ExitCode {
    calibench_cli::verbs::main()
}
