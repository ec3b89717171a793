//! What goes to the terminal: answers to standard output, everything else to standard error.

use std::io::{self, IsTerminal, Write};

use serde::Serialize;
use tracing_subscriber::EnvFilter;

use crate::config::{LogConfig, LogFormat};

/// Writes a line to standard output. A closed pipe (`| head`) is no failure.
///
/// # Errors
/// Standard output takes nothing more.
pub fn line(text: &str) -> io::Result<()> {
    match writeln!(io::stdout().lock(), "{text}") {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        result => result,
    }
}

/// Writes a text to standard output, as it is. A closed pipe is no failure.
///
/// # Errors
/// Standard output takes nothing more.
pub fn text(text: &str) -> io::Result<()> {
    match write!(io::stdout().lock(), "{text}") {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        result => result,
    }
}

/// Writes an object as one line of JSON.
///
/// # Errors
/// As [`line()`], or the object is none in JSON.
pub fn json<T: Serialize>(value: &T) -> anyhow::Result<()> {
    Ok(line(&serde_json::to_string(value)?)?)
}

/// Writes a line to standard error.
pub fn progress(text: &str) {
    // With standard error closed there is nobody left to tell.
    let _ = writeln!(io::stderr().lock(), "{text}");
}

/// Says why a command of a program failed, with all causes.
pub fn complain(program: &str, error: &anyhow::Error) {
    progress(&format!("{program}: {error:#}"));
}

/// Begins to log to standard error.
pub fn start_log(log: &LogConfig) {
    // The filter was checked with the settings.
    let filter = EnvFilter::try_new(&log.filter).unwrap_or_else(|_| EnvFilter::new("info"));
    let builder = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(io::stderr)
        .with_ansi(io::stderr().is_terminal());
    match log.format {
        LogFormat::Text => builder.init(),
        LogFormat::Json => builder.json().init(),
    }
}
