//! What the demo says at its end.

use std::time::Duration;

use serde::Serialize;

use crate::cli::{output, quantile};

/// The demo's result. Errors are RMSE of position on a 10 Hz grid, in the frame of the truth.
#[derive(Debug, Serialize)]
pub(super) struct Summary {
    pub(super) samples_sent: u64,
    pub(super) samples_applied: u64,
    pub(super) samples_durable: u64,
    pub(super) samples_resent: u64,
    /// Samples that the demo's own service got twice, and applied once.
    pub(super) duplicates: Option<u64>,
    /// Mean over the robots.
    pub(super) dead_reckoning_ate_rmse_m: Option<f64>,
    /// Mean over the robots; absent where none was in the map.
    pub(super) causal_ate_rmse_m: Option<f64>,
    pub(super) places: u64,
    pub(super) trips: u64,
    pub(super) landmarks: u64,
    pub(super) localise: LatencySummary,
    pub(super) recall: LatencySummary,
    pub(super) digest: String,
    pub(super) robots: Vec<RobotSummary>,
    /// Robots that woke up somewhere or were carried off, in order.
    pub(super) searches: Vec<SearchRecord>,
    /// Objects that the arm touched to recognise them, in order.
    pub(super) objects: Vec<ObjectRecord>,
}

/// A robot, since it was switched on last.
#[derive(Debug, Serialize)]
pub(super) struct RobotSummary {
    pub(super) name: String,
    pub(super) samples: u64,
    /// Of its motion alone, told where it truly started.
    pub(super) dead_reckoning_ate_rmse_m: Option<f64>,
    /// Of all rows of its trajectory, those between a carry and its notice included; absent for a
    /// robot that was never in the map.
    pub(super) causal_ate_rmse_m: Option<f64>,
    /// Distance from the truth at the end.
    pub(super) dead_reckoning_end_error_m: Option<f64>,
    pub(super) causal_end_error_m: Option<f64>,
}

/// Why a robot did not know where it was.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Cause {
    /// It woke up and was not told.
    Woken,
    /// It was carried off.
    Carried,
}

/// A robot that did not know where it was. Times are since the first sample.
#[derive(Debug, Serialize)]
pub(super) struct SearchRecord {
    pub(super) robot: String,
    pub(super) cause: Cause,
    /// When it happened.
    pub(super) at_s: f64,
    /// How far it was carried.
    pub(super) carried_m: Option<f64>,
    /// When the service first called it uncertain or lost, or else found it.
    pub(super) noticed_s: Option<f64>,
    /// When the service called it lost.
    pub(super) lost_s: Option<f64>,
    /// When the service called it localized, and that was so.
    pub(super) found_s: Option<f64>,
    /// How far from the truth then.
    pub(super) error_m: Option<f64>,
    /// Whether it was called localized somewhere else meanwhile.
    pub(super) was_false: bool,
}

impl SearchRecord {
    pub(super) fn new(robot: &str, cause: Cause, at_s: f64) -> Self {
        Self {
            robot: robot.to_owned(),
            cause,
            at_s,
            carried_m: None,
            noticed_s: None,
            lost_s: None,
            found_s: None,
            error_m: None,
            was_false: false,
        }
    }

    fn text(&self) -> String {
        let Self { robot, at_s, .. } = self;
        let after = |time_s: f64| format!("{:.1} s", time_s - at_s);
        let mut text = match self.cause {
            Cause::Woken => format!("{robot} woke up at {at_s:.0} s"),
            Cause::Carried => {
                let noticed = self
                    .noticed_s
                    .map_or("not noticed".to_owned(), |noticed_s| {
                        format!("noticed after {}", after(noticed_s))
                    });
                let way_m = self.carried_m.unwrap_or_default();
                format!("{robot} was carried {way_m:.1} m at {at_s:.0} s: {noticed}")
            }
        };
        if let (Some(lost_s), Cause::Carried) = (self.lost_s, self.cause) {
            text = format!("{text}, lost after {}", after(lost_s));
        }
        match (self.found_s, self.error_m) {
            (Some(found_s), Some(error_m)) => {
                format!("{text}, found after {}, {error_m:.2} m off", after(found_s))
            }
            _ => format!("{text}, not found"),
        }
    }
}

/// An object that the arm touched to recognise it.
#[derive(Debug, Serialize)]
pub(super) struct ObjectRecord {
    /// What it is.
    pub(super) object: String,
    /// When the arm began.
    pub(super) at_s: f64,
    /// What the service called it; absent if it did not decide.
    pub(super) recognised: Option<String>,
    /// When.
    pub(super) recognised_s: Option<f64>,
    /// After how many contacts.
    pub(super) contacts: Option<u64>,
    pub(super) probability: Option<f64>,
}

impl ObjectRecord {
    pub(super) fn new(object: &str, at_s: f64) -> Self {
        Self {
            object: object.to_owned(),
            at_s,
            recognised: None,
            recognised_s: None,
            contacts: None,
            probability: None,
        }
    }

    fn text(&self) -> String {
        match (&self.recognised, self.contacts) {
            (Some(name), Some(contacts)) => {
                let object = &self.object;
                format!("the {object} was recognised as the {name} after {contacts} contacts")
            }
            _ => format!("the {} was not recognised", self.object),
        }
    }
}

/// Times of a kind of query.
#[derive(Debug, Default)]
pub(super) struct Latency {
    ms: Vec<f64>,
}

#[derive(Debug, Serialize)]
pub(super) struct LatencySummary {
    queries: usize,
    /// Absent without queries.
    ms_p50: Option<f64>,
    ms_p99: Option<f64>,
}

impl Latency {
    pub(super) fn note(&mut self, time: Duration) {
        self.ms.push(time.as_secs_f64() * 1e3);
    }

    pub(super) fn summary(mut self) -> LatencySummary {
        let mut at = |q| (!self.ms.is_empty()).then(|| quantile(&mut self.ms, q));
        let (ms_p50, ms_p99) = (at(0.5), at(0.99));
        LatencySummary {
            queries: self.ms.len(),
            ms_p50,
            ms_p99,
        }
    }
}

impl Summary {
    pub(super) fn print(&self) -> anyhow::Result<()> {
        output::line(&format!(
            "samples      {} sent, {} applied, {} durable, {} sent again",
            self.samples_sent, self.samples_applied, self.samples_durable, self.samples_resent
        ))?;
        if let Some(duplicates) = self.duplicates {
            output::line(&format!(
                "             {duplicates} received twice, applied once"
            ))?;
        }
        output::line(&format!(
            "memory       {} places, {} trips, {} landmarks",
            self.places, self.trips, self.landmarks
        ))?;
        for (name, latency) in [("where am I", &self.localise), ("recall", &self.recall)] {
            if let (Some(p50), Some(p99)) = (latency.ms_p50, latency.ms_p99) {
                let queries = latency.queries;
                output::line(&format!(
                    "{name:<12} {queries} queries, p50 {p50:.2} ms, p99 {p99:.2} ms"
                ))?;
            }
        }
        for search in &self.searches {
            output::line(&format!("{:<12} {}", "lost", search.text()))?;
        }
        for object in &self.objects {
            output::line(&format!("{:<12} {}", "touch", object.text()))?;
        }
        output::line("error [m], root mean square over the drive and at its end")?;
        output::line("             dead reckoning   cogmap   at the end: dead reckoning   cogmap")?;
        for robot in &self.robots {
            output::line(&format!(
                "  {:<10} {:>14} {:>8} {:>27} {:>8}",
                robot.name,
                metres(robot.dead_reckoning_ate_rmse_m),
                metres(robot.causal_ate_rmse_m),
                metres(robot.dead_reckoning_end_error_m),
                metres(robot.causal_end_error_m)
            ))?;
        }
        output::line(&format!(
            "  {:<10} {:>14} {:>8}",
            "mean",
            metres(self.dead_reckoning_ate_rmse_m),
            metres(self.causal_ate_rmse_m)
        ))?;
        Ok(())
    }
}

fn metres(error_m: Option<f64>) -> String {
    error_m.map_or("-".to_owned(), |error_m| format!("{error_m:.3}"))
}
