//! The program `anisobond`; everything is in the library, for the Python package has the same command.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(anisobond_cli::main_from(std::env::args_os()))
}
