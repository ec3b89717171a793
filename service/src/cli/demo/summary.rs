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
    pub(super) dead_reckoning_ate_rmse_m: f64,
    /// Mean over the robots.
    pub(super) causal_ate_rmse_m: f64,
    pub(super) places: u64,
    pub(super) trips: u64,
    pub(super) landmarks: u64,
    pub(super) localise: LatencySummary,
    pub(super) recall: LatencySummary,
    pub(super) digest: String,
    pub(super) robots: Vec<RobotSummary>,
}

#[derive(Debug, Serialize)]
pub(super) struct RobotSummary {
    pub(super) name: String,
    pub(super) samples: u64,
    pub(super) dead_reckoning_ate_rmse_m: f64,
    pub(super) causal_ate_rmse_m: f64,
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
        output::line("error [m]    dead reckoning   causal")?;
        for robot in &self.robots {
            output::line(&format!(
                "  {:<10} {:>14.3} {:>8.3}",
                robot.name, robot.dead_reckoning_ate_rmse_m, robot.causal_ate_rmse_m
            ))?;
        }
        output::line(&format!(
            "  {:<10} {:>14.3} {:>8.3}",
            "mean", self.dead_reckoning_ate_rmse_m, self.causal_ate_rmse_m
        ))?;
        Ok(())
    }
}
