//! The binary under test.

use std::path::PathBuf;
use std::process::{Command, ExitStatus};

use serde_json::Value;

/// The binary `cogmap`: `COGMAP_BIN`, or what the workspace built last in the dev profile.
pub fn binary() -> PathBuf {
    let path = std::env::var_os("COGMAP_BIN").map_or_else(
        || {
            let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(
                || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../target"),
                PathBuf::from,
            );
            target.join("debug/cogmap")
        },
        PathBuf::from,
    );
    assert!(
        path.is_file(),
        "there is no binary at {}: run `cargo build --workspace --all-targets` first, or name one \
         in COGMAP_BIN",
        path.display()
    );
    path
}

/// A command that has ended.
#[derive(Debug)]
pub struct Finished {
    /// How.
    pub status: ExitStatus,
    /// What it said on standard output.
    pub stdout: String,
    /// What it said on standard error.
    pub stderr: String,
}

/// Runs a command of `cogmap` to its end. No setting of the caller's environment reaches it.
pub fn run(args: &[&str]) -> Finished {
    finish(command(), args)
}

/// Runs a command of `cogmap-lab`, which lies beside `cogmap`, to its end.
pub fn lab(args: &[&str]) -> Finished {
    let mut command = Command::new(binary().with_file_name("cogmap-lab"));
    forget_settings(&mut command);
    finish(command, args)
}

fn finish(mut command: Command, args: &[&str]) -> Finished {
    let output = command
        .args(args)
        .output()
        .expect("the binary can be started");
    Finished {
        status: output.status,
        stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
        stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
    }
}

impl Finished {
    /// The exit code; panics where a signal ended it.
    pub fn code(&self) -> i32 {
        let code = self.status.code();
        code.unwrap_or_else(|| panic!("ended by a signal: {self:?}"))
    }

    /// What was printed, after a good end.
    pub fn text(&self) -> &str {
        assert_eq!(self.code(), 0, "{self:?}");
        &self.stdout
    }

    /// The one JSON object that was printed, after a good end.
    pub fn json(&self) -> Value {
        let text = self.text();
        serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
    }
}

/// The binary without the settings of the caller's environment.
pub(crate) fn command() -> Command {
    let mut command = Command::new(binary());
    forget_settings(&mut command);
    command
}

/// Removes the service's settings from a command's environment.
pub(crate) fn forget_settings(command: &mut Command) {
    for (name, _) in std::env::vars_os() {
        if name.to_string_lossy().starts_with("COGMAP_") {
            command.env_remove(name);
        }
    }
}
