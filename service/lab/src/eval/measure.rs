//! The figures of merit of a run, by the names that they have in JSON.

use super::environment::Environment;
use super::quantity::Quantity;
use super::run::Run;

/// How the values of a run's steps become one number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Over {
    /// Mean over the steps that have a value.
    Mean,
    /// Root of the mean square over the same steps (seed Eq. 12).
    Rmse,
    /// The largest.
    Max,
    /// The last.
    End,
}

/// A figure of merit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Measure {
    /// Its name in JSON, with its unit at the end.
    pub name: &'static str,
    /// Its name in a table.
    pub label: &'static str,
    source: Source,
    paper: [&'static str; 2],
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Source {
    Steps(Quantity, Over),
    GrowthLastQuarter,
    RefinedRmse,
    Closures,
}

/// What the paper shows in a figure without a number.
const SHOWN_HIGH: &str = "\"high\"";
/// What the paper has no figure or number for.
const SILENT: &str = "";

/// All figures of merit, in the order of the table.
pub const MEASURES: [Measure; 33] = {
    use Over::{End, Max, Mean, Rmse};
    use Quantity as Q;
    [
        of_steps(
            "recall_ate_mean_m",
            "recall by grid code, mean ATE [m]",
            Q::RecallError,
            Mean,
            ["\"low\"", "0.42"],
        ),
        of_steps(
            "recall_ate_rmse_m",
            "recall by grid code, RMSE [m]",
            Q::RecallError,
            Rmse,
            [SILENT, "0.46"],
        ),
        of_steps(
            "oracle_ate_mean_m",
            "nearest stored place, mean [m]",
            Q::OracleError,
            Mean,
            [SILENT; 2],
        ),
        of_steps(
            "oracle_ate_rmse_m",
            "nearest stored place, RMSE [m]",
            Q::OracleError,
            Rmse,
            [SILENT; 2],
        ),
        of_steps(
            "prediction_error_mean_m",
            "recall before the step is learned, mean [m]",
            Q::PredictionError,
            Mean,
            ["\"low\"", SILENT],
        ),
        of_steps(
            "prediction_error_rmse_m",
            "recall before the step is learned, RMSE [m]",
            Q::PredictionError,
            Rmse,
            [SILENT; 2],
        ),
        of_steps(
            "live_ate_mean_m",
            "place that answers live, mean [m]",
            Q::LiveError,
            Mean,
            [SILENT; 2],
        ),
        of_steps(
            "live_ate_rmse_m",
            "place that answers live, RMSE [m]",
            Q::LiveError,
            Rmse,
            [SILENT; 2],
        ),
        of_steps(
            "live_share",
            "steps at which a place answers live [share]",
            Q::LiveAnswers,
            Mean,
            [SILENT; 2],
        ),
        of_steps(
            "decoded_ate_rmse_m",
            "position decoded from the code, RMSE [m]",
            Q::DecodedError,
            Rmse,
            [SILENT; 2],
        ),
        of_steps(
            "decoded_ate_max_m",
            "position decoded from the code, largest [m]",
            Q::DecodedError,
            Max,
            [SILENT; 2],
        ),
        of_steps(
            "causal_ate_mean_m",
            "published pose, mean ATE [m]",
            Q::CausalError,
            Mean,
            [SILENT; 2],
        ),
        of_steps(
            "causal_ate_rmse_m",
            "published pose, RMSE [m]",
            Q::CausalError,
            Rmse,
            [SILENT; 2],
        ),
        of_steps(
            "position_nees_mean",
            "published position, squared error over promised",
            Q::PositionNees,
            Mean,
            [SILENT; 2],
        ),
        of_steps(
            "rotation_nees_mean",
            "published rotation, squared error over promised",
            Q::RotationNees,
            Mean,
            [SILENT; 2],
        ),
        of_steps(
            "pose_nees_mean",
            "published pose, squared error over promised",
            Q::PoseNees,
            Mean,
            [SILENT; 2],
        ),
        Measure {
            name: "refined_ate_rmse_m",
            label: "pose refined by the whole walk, RMSE [m]",
            source: Source::RefinedRmse,
            paper: [SILENT; 2],
        },
        Measure {
            name: "closures",
            label: "revisits that are believed at the end",
            source: Source::Closures,
            paper: [SILENT; 2],
        },
        of_steps(
            "dead_reckoning_ate_mean_m",
            "dead reckoning, mean ATE [m]",
            Q::DeadReckoningError,
            Mean,
            [SILENT; 2],
        ),
        of_steps(
            "dead_reckoning_ate_rmse_m",
            "dead reckoning, RMSE [m]",
            Q::DeadReckoningError,
            Rmse,
            [SILENT; 2],
        ),
        of_steps(
            "cosine_mean",
            "cosine score (Eq. 10), mean",
            Q::Cosine,
            Mean,
            [SHOWN_HIGH; 2],
        ),
        of_steps(
            "pseudo_activation_mean",
            "pseudo-activation (Eq. 9), mean",
            Q::PseudoActivation,
            Mean,
            [SHOWN_HIGH, SILENT],
        ),
        of_steps(
            "confidence_mean",
            "recall confidence (Eq. 8), mean",
            Q::Confidence,
            Mean,
            [SHOWN_HIGH; 2],
        ),
        of_steps(
            "interference_mean",
            "interference score (Eqs. 4, 5), mean",
            Q::InterferenceScore,
            Mean,
            [SILENT, SHOWN_HIGH],
        ),
        of_steps("places", "places at the end", Q::Places, End, [SILENT; 2]),
        Measure {
            name: "places_growth_last_quarter",
            label: "growth of places in the last quarter [share]",
            source: Source::GrowthLastQuarter,
            paper: ["\"levels off\""; 2],
        },
        of_steps(
            "unique_locations",
            "unique locations at the end",
            Q::UniqueLocations,
            End,
            [SILENT, "\"levels off\""],
        ),
        of_steps(
            "revisits",
            "steps that ended at a known location",
            Q::Revisits,
            End,
            [SILENT; 2],
        ),
        of_steps(
            "view_recall_ate_mean_m",
            "recall by a view alone, mean ATE [m]",
            Q::ViewRecallError,
            Mean,
            [SILENT; 2],
        ),
        of_steps(
            "view_recall_ate_rmse_m",
            "recall by a view alone, RMSE [m]",
            Q::ViewRecallError,
            Rmse,
            [SILENT; 2],
        ),
        of_steps(
            "view_surprise_mean",
            "surprise of views, 1 - cosine, mean",
            Q::ViewSurprise,
            Mean,
            [SILENT; 2],
        ),
        of_steps(
            "landmarks",
            "landmarks at the end",
            Q::Landmarks,
            End,
            [SILENT; 2],
        ),
        of_steps(
            "places_per_step_at_end",
            "places recruited a step, over the last tenth",
            Q::Growth,
            End,
            ["0.05 or less"; 2],
        ),
    ]
};

const fn of_steps(
    name: &'static str,
    label: &'static str,
    quantity: Quantity,
    over: Over,
    paper: [&'static str; 2],
) -> Measure {
    Measure {
        name,
        label,
        source: Source::Steps(quantity, over),
        paper,
    }
}

impl Measure {
    /// What the paper says of it, a number or a word in quotes; empty where it says nothing.
    pub fn paper(&self, environment: Environment) -> &'static str {
        match environment {
            Environment::GridAligned => self.paper[0],
            Environment::ObstacleRich => self.paper[1],
        }
    }

    /// Its value for a run; `None` where no step had one.
    pub(super) fn value(&self, run: &Run) -> Option<f64> {
        match self.source {
            Source::GrowthLastQuarter => run.growth_last_quarter,
            Source::RefinedRmse => run.refined_rmse_m,
            Source::Closures => run.refined_rmse_m.map(|_| run.closures as f64),
            Source::Steps(quantity, over) => {
                let tally = &run.tallies[quantity];
                match over {
                    Over::Mean => tally.mean(),
                    Over::Rmse => tally.rmse(),
                    Over::Max => tally.max(),
                    Over::End => tally.last(),
                }
            }
        }
    }
}
