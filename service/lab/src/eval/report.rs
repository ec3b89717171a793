//! The outcome of an experiment in numbers.

use std::collections::BTreeMap;

use cognitive_map::Recruitment;
use serde::Serialize;

use super::experiment::Experiment;
use super::measure::MEASURES;
use super::protocol::{Percept, Walk};
use super::quantity::Quantity;
use super::statistic::Statistic;

/// What was done and what came out, as it is printed in JSON.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// `env1` or `env2`.
    pub environment: &'static str,
    /// Number of runs.
    pub runs: usize,
    /// Seed of the first run; the others follow.
    pub seed: u64,
    /// Steps of each run.
    pub steps: u64,
    /// `pure` or `persistent`.
    pub walk: &'static str,
    /// `bernoulli` or `novelty`.
    pub recruit: &'static str,
    /// Probability of a new place at a step, with `bernoulli`.
    pub p_new: Option<f64>,
    /// Number of grid modules.
    pub grid_modules: usize,
    /// Spacing of the finest grid module \[m\].
    pub grid_spacing_m: f64,
    /// Ratio of the spacings of neighbouring modules.
    pub grid_ratio: f64,
    /// Radius of a place's field \[m\].
    pub field_radius_m: f64,
    /// Most places in memory.
    pub places_max: u32,
    /// `none`, `descriptor` or `sightings`.
    pub percept: &'static str,
    /// `none`, `places`, `landmarks` or `all`, in a room that was explored before.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub correct: Option<&'static str>,
    /// Odometry noise, as a share of a step.
    pub translation_noise: f64,
    /// Standard deviation of the constant scale errors of odometry.
    pub scale_bias: f64,
    /// Rotation noise \[°/step\].
    pub rotation_noise_deg: f64,
    /// Standard deviation of the constant rotation errors \[°/step\].
    pub gyro_bias_deg: f64,
    /// Runs whose memory stayed empty, so that they have no errors of recall; the statistics of
    /// recall are over the others.
    pub runs_without_recall: usize,
    /// The mean and RMSE of ATE that the paper states for this environment \[m\].
    pub paper: Option<PaperAte>,
    /// Each of [`MEASURES`] by name, over the runs that have it; `None` where none has.
    #[serde(flatten)]
    pub measures: BTreeMap<&'static str, Option<Statistic>>,
}

/// The paper's Table 1, last row.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PaperAte {
    /// Mean ATE \[m\].
    pub recall_ate_mean_m: f64,
    /// RMSE of the ATE \[m\].
    pub recall_ate_rmse_m: f64,
}

impl Report {
    /// Sums an experiment up.
    pub fn of(experiment: &Experiment) -> Self {
        let Experiment { protocol, runs } = experiment;
        let (recruit, p_new) = match protocol.settings.recruitment {
            Recruitment::Novelty => ("novelty", None),
            Recruitment::Bernoulli { probability } => ("bernoulli", Some(probability)),
        };
        let without_recall =
            |run: &&super::run::Run| run.tallies[Quantity::RecallError].mean().is_none();
        let paper = protocol.environment.paper_ate_m();
        let measures = MEASURES.iter().map(|measure| {
            let values = runs.iter().filter_map(|run| measure.value(run));
            (measure.name, Statistic::of(values))
        });
        Self {
            environment: protocol.environment.name(),
            runs: runs.len(),
            seed: runs.first().map_or(0, |run| run.seed),
            steps: protocol.steps,
            walk: match protocol.walk {
                Walk::Pure => "pure",
                Walk::Persistent => "persistent",
            },
            recruit,
            p_new,
            grid_modules: protocol.settings.grid_modules,
            grid_spacing_m: protocol.settings.grid_spacing_m,
            grid_ratio: protocol.settings.grid_ratio,
            field_radius_m: protocol.settings.field_radius_m,
            places_max: protocol.settings.places_max,
            percept: match protocol.percept {
                Percept::None => "none",
                Percept::Descriptor(_) => "descriptor",
                Percept::Sightings(_) => "sightings",
            },
            correct: protocol.explored.map(|explored| explored.correct.name()),
            translation_noise: protocol.odometry.translation_share,
            scale_bias: protocol.odometry.scale_bias,
            rotation_noise_deg: protocol.odometry.rotation_sd_rad.to_degrees(),
            gyro_bias_deg: protocol.odometry.gyro_bias_rad.to_degrees(),
            runs_without_recall: runs.iter().filter(without_recall).count(),
            paper: paper.map(|(recall_ate_mean_m, recall_ate_rmse_m)| PaperAte {
                recall_ate_mean_m,
                recall_ate_rmse_m,
            }),
            measures: measures.collect(),
        }
    }

    /// Mean over the runs of a measure, by name.
    pub fn mean(&self, measure: &str) -> Option<f64> {
        let statistic = self.measures.get(measure)?.as_ref()?;
        Some(statistic.mean)
    }
}
