//! What came out of a replay.

use std::collections::BTreeMap;

use cogmap_proto::{Evidence, StampedPose};
use geometry::PoseCovariance;
use serde::Serialize;

/// What came out of a replay.
#[derive(Debug, Default)]
pub(super) struct Outcome {
    /// Each robot, by name.
    pub(super) robots: BTreeMap<String, RobotOutcome>,
    pub(super) samples: u64,
    pub(super) digest: String,
    pub(super) places: u64,
    pub(super) trips: u64,
    pub(super) landmarks: u64,
    /// Closures that are believed in the end, of a replay straight into the core.
    pub(super) closures: Option<u64>,
    /// Of a replay straight into the core: matches of views that the map holds in the end.
    pub(super) view_matches: Vec<MatchedViews>,
    /// What each sample took in the core \[s\]; nothing of a replay through a service.
    pub(super) times_s: Vec<f64>,
    /// What each relaxation of the past took beside them \[s\]; likewise.
    pub(super) relaxations_s: Vec<f64>,
}

/// What came out of a replay for one robot.
#[derive(Debug, Default)]
pub(super) struct RobotOutcome {
    /// Each pose as it was known when its sample was applied.
    pub(super) causal: Vec<StampedPose>,
    /// Its past by all that was seen until the end; between two poses it moved evenly.
    pub(super) refined: Vec<StampedPose>,
    pub(super) evidence: Evidence,
    /// Of a replay straight into the core: poses in the map with the covariance that they had, a
    /// second apart.
    pub(super) beliefs: Vec<(StampedPose, PoseCovariance)>,
}

/// Two views that are held to be of one place.
#[derive(Clone, Debug)]
pub(super) struct MatchedViews {
    /// The robot that saw each, and when \[ns\].
    pub(super) seen: [(String, i64); 2],
    /// How far apart views of one place are at most \[m\].
    pub(super) range_m: f64,
    /// That they are, as the map has it.
    pub(super) probability: f64,
}

/// Times that samples, or relaxations of the past, took in the core \[ms\].
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Timing {
    pub(super) count: usize,
    pub(super) mean: f64,
    pub(super) p50: f64,
    pub(super) p99: f64,
    pub(super) max: f64,
    #[serde(skip)]
    pub(super) total_s: f64,
}

impl Timing {
    /// Of the time of each \[s\]; none without any.
    pub(super) fn of(mut times_s: Vec<f64>) -> Option<Self> {
        times_s.sort_by(f64::total_cmp);
        let quantile = |part: f64| {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a part of a length"
            )]
            let index = (part * (times_s.len().saturating_sub(1)) as f64) as usize;
            times_s.get(index).copied()
        };
        let total_s: f64 = times_s.iter().sum();
        Some(Self {
            count: times_s.len(),
            mean: total_s / times_s.len() as f64 * 1e3,
            p50: quantile(0.5)? * 1e3,
            p99: quantile(0.99)? * 1e3,
            max: quantile(1.0)? * 1e3,
            total_s,
        })
    }
}
