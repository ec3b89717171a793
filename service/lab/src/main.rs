//! The program `cogmap-lab`: recorded data sets, the seed paper's experiments, and benchmarks.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::main()
}
