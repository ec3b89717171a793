//! The binary `cogmap`.

use std::process::ExitCode;

fn main() -> ExitCode {
    cogmap::cli::main()
}
