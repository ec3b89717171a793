//! What an experiment shows while it runs.

use std::io::{IsTerminal, stderr};
use std::sync::atomic::{AtomicU64, Ordering};

use indicatif::{ProgressBar, ProgressStyle};

use cogmap::cli::output;

/// Lines where the output is no terminal.
const LINES: u64 = 10;

/// A bar in a terminal, a line now and then elsewhere.
pub(in crate::cli) struct Progress {
    bar: Option<ProgressBar>,
    /// What is counted.
    what: &'static str,
    steps: u64,
    walked: AtomicU64,
}

impl Progress {
    /// Of so many steps in all, or of whatever is counted.
    pub(in crate::cli) fn new(steps: u64, what: &'static str) -> Self {
        let bar = stderr().is_terminal().then(|| {
            let style = ProgressStyle::with_template(
                "[{bar:40}] {human_pos} of {human_len} {msg}, {eta} left",
            )
            .unwrap_or_else(|_| ProgressStyle::default_bar());
            ProgressBar::new(steps).with_style(style).with_message(what)
        });
        Self {
            bar,
            what,
            steps,
            walked: AtomicU64::new(0),
        }
    }

    /// So many more steps were made.
    pub(in crate::cli) fn add(&self, steps: u64) {
        if let Some(bar) = &self.bar {
            bar.inc(steps);
            return;
        }
        let before = self.walked.fetch_add(steps, Ordering::Relaxed);
        let part =
            |walked: u64| u128::from(walked) * u128::from(LINES) / u128::from(self.steps.max(1));
        if part(before + steps) > part(before) {
            let (done, all, what) = (before + steps, self.steps, self.what);
            output::progress(&format!("{done} of {all} {what}"));
        }
    }

    pub(in crate::cli) fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
