//! What the demo shows while it runs.

use std::io::{IsTerminal, stderr};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

use cogmap_proto::Estimate;
use indicatif::{MultiProgress, ProgressBar, ProgressStyle};

use crate::cli::output;

/// Seconds between lines where the output is no terminal.
const LINE_INTERVAL_S: u64 = 10;

/// Live lines in a terminal, a line now and then elsewhere.
pub(super) struct Progress {
    bars: Option<Bars>,
    seconds: u64,
    next_line_s: AtomicU64,
}

struct Bars {
    time: ProgressBar,
    robots: Vec<ProgressBar>,
    all: MultiProgress,
}

/// A robot now.
pub(super) struct RobotLine {
    pub(super) name: String,
    pub(super) sent: u64,
    pub(super) pending: u64,
    pub(super) estimate: Option<Estimate>,
    /// Distance of the estimate from the truth \[m\].
    pub(super) error_m: Option<f64>,
}

impl Progress {
    pub(super) fn new(robots: u32, duration: Duration) -> Self {
        let bars = stderr().is_terminal().then(|| {
            let all = MultiProgress::new();
            let plain = ProgressStyle::with_template("{msg}")
                .unwrap_or_else(|_| ProgressStyle::default_bar());
            let wide = ProgressStyle::with_template("[{bar:40}] {pos} of {len} s")
                .unwrap_or_else(|_| ProgressStyle::default_bar());
            let time = all.add(ProgressBar::new(duration.as_secs()).with_style(wide));
            // The arm has a line of its own.
            let robots = (0..=robots)
                .map(|_| all.add(ProgressBar::no_length().with_style(plain.clone())))
                .collect();
            Bars { time, robots, all }
        });
        Self {
            bars,
            seconds: duration.as_secs(),
            next_line_s: AtomicU64::new(0),
        }
    }

    pub(super) fn show(&self, elapsed: Duration, robots: &[RobotLine]) {
        let seconds = elapsed.as_secs();
        if let Some(bars) = &self.bars {
            bars.time.set_position(seconds.min(self.seconds));
            for (bar, robot) in bars.robots.iter().zip(robots) {
                bar.set_message(robot.text());
            }
        } else if seconds >= self.next_line_s.load(Ordering::Relaxed) {
            self.next_line_s
                .store(seconds + LINE_INTERVAL_S, Ordering::Relaxed);
            let sent: u64 = robots.iter().map(|robot| robot.sent).sum();
            let pending: u64 = robots.iter().map(|robot| robot.pending).sum();
            output::progress(&format!(
                "{seconds} of {} s: {sent} samples sent, {pending} not yet durable",
                self.seconds
            ));
        }
    }

    /// Says a line of what happens, above the live ones.
    pub(super) fn say(&self, line: &str) {
        match &self.bars {
            // A terminal that has gone takes none.
            Some(bars) => drop(bars.all.println(line)),
            None => output::progress(line),
        }
    }

    pub(super) fn finish(&self) {
        if let Some(bars) = &self.bars {
            bars.time.finish();
            // The last lines stay; a terminal that has gone takes none.
            let _ = bars.all.println("");
        }
    }
}

impl RobotLine {
    fn text(&self) -> String {
        let Some(estimate) = &self.estimate else {
            return format!("{:<8} no estimate yet", self.name);
        };
        let [x, y, z] = estimate.translation_m;
        let place = estimate
            .place
            .map_or("-".to_owned(), |place| place.to_string());
        let error = self
            .error_m
            .map_or(String::new(), |error| format!("{error:.2} m off"));
        let Self {
            name,
            sent,
            pending,
            ..
        } = self;
        format!(
            "{name:<8} at {x:>6.2} {y:>6.2} {z:>6.2}  place {place:>5}  {error:<12} \
             {sent} sent, {pending} pending"
        )
    }
}
