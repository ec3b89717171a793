//! The outcome of an experiment as a table for people.

use std::fmt::{self, Display, Formatter};

use super::environment::Environment;
use super::experiment::Experiment;
use super::measure::MEASURES;
use super::report::Report;

/// The other rows of the paper's Table 1, as the paper states them: system, mean ATE and RMSE
/// \[m\]. The first two are of obstacle-rich environments, the third of irregular terrain. They
/// were not measured here, nor by the paper in this room.
const PAPER_SLAM: [(&str, &str, &str); 3] = [
    ("ORB-SLAM2", "0.12 – 0.20", "0.15 – 0.25"),
    ("RTAB-Map", "0.18 – 0.30", "0.22 – 0.35"),
    ("Visual-Inertial SLAM", "0.10 – 0.25", "0.15 – 0.30"),
];

/// A table of all measures, ours beside the paper's.
#[derive(Clone, Debug)]
pub struct Table {
    environment: Environment,
    report: Report,
}

impl Table {
    /// Of an experiment.
    pub fn of(experiment: &Experiment) -> Self {
        Self {
            environment: experiment.protocol.environment,
            report: Report::of(experiment),
        }
    }
}

impl Display for Table {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let report = &self.report;
        writeln!(f, "{}", self.environment.title())?;
        writeln!(f, "{}", conditions(report))?;
        writeln!(
            f,
            "\n{:<46} {:>11} {:>11} {:>11}   paper",
            "over the runs", "mean", "median", "largest"
        )?;
        for measure in &MEASURES {
            let Some(Some(statistic)) = report.measures.get(measure.name) else {
                continue;
            };
            let [mean, median, max] =
                [statistic.mean, statistic.median, statistic.max].map(significant);
            let paper = measure.paper(self.environment);
            let row = format!(
                "{:<46} {mean:>11} {median:>11} {max:>11}   {paper}",
                measure.label
            );
            writeln!(f, "{}", row.trim_end())?;
        }
        if let (Some(recall), Some(oracle)) = (
            report.mean("recall_ate_mean_m"),
            report.mean("oracle_ate_mean_m"),
        ) && oracle > 0.0
        {
            let label = "recall over nearest, ratio of the mean errors";
            writeln!(f, "{label:<46} {:>11.4}", recall / oracle)?;
        }
        if report.runs_without_recall > 0 {
            let n = report.runs_without_recall;
            writeln!(
                f,
                "\n{n} of {} runs recruited no place and recall nothing.",
                report.runs
            )?;
        }
        if self.environment == Environment::ObstacleRich {
            write_table_1(f, report)?;
        }
        Ok(())
    }
}

/// The paper's Table 1 with our row.
fn write_table_1(f: &mut Formatter<'_>, report: &Report) -> fmt::Result {
    writeln!(
        f,
        "\n{:<46} {:>13} {:>13}",
        "Table 1", "mean ATE [m]", "RMSE [m]"
    )?;
    for (system, mean, rmse) in PAPER_SLAM {
        writeln!(
            f,
            "{:<46} {mean:>13} {rmse:>13}",
            format!("{system} (as the paper states)")
        )?;
    }
    if let Some(paper) = &report.paper {
        let (mean, rmse) = (paper.recall_ate_mean_m, paper.recall_ate_rmse_m);
        writeln!(
            f,
            "{:<46} {mean:>13.2} {rmse:>13.2}",
            "grid-place model, the paper's"
        )?;
    }
    for (label, mean, rmse) in [
        (
            "cogmap, recalled place",
            "recall_ate_mean_m",
            "recall_ate_rmse_m",
        ),
        (
            "cogmap, published pose",
            "causal_ate_mean_m",
            "causal_ate_rmse_m",
        ),
    ] {
        if let (Some(mean), Some(rmse)) = (report.mean(mean), report.mean(rmse)) {
            let (mean, rmse) = (significant(mean), significant(rmse));
            writeln!(f, "{label:<46} {mean:>13} {rmse:>13}")?;
        }
    }
    Ok(())
}

/// What was done, in a line.
pub(super) fn conditions(report: &Report) -> String {
    let runs = if report.runs == 1 {
        "1 run".to_owned()
    } else {
        format!("{} runs", report.runs)
    };
    let recruit = match report.p_new {
        Some(p) => format!("a new place with probability {p}"),
        None => "a new place where none answers".to_owned(),
    };
    let perfect = [
        report.translation_noise,
        report.scale_bias,
        report.rotation_noise_deg,
        report.gyro_bias_deg,
    ]
    .iter()
    .all(|noise| *noise == 0.0);
    let odometry = if perfect { "perfect" } else { "noisy" };
    let sightings = if report.percept == "sightings" {
        ", obstacles sighted"
    } else {
        ""
    };
    format!(
        "{runs} of {} steps, {} walk, {recruit}, {odometry} odometry{sightings}",
        report.steps, report.walk
    )
}

/// Four significant digits; whole numbers and large ones without needless ones.
fn significant(value: f64) -> String {
    let magnitude = value.abs();
    if magnitude == 0.0 || (magnitude >= 1000.0 && value.fract() == 0.0) {
        format!("{value}")
    } else if magnitude >= 100.0 {
        format!("{value:.1}")
    } else if magnitude >= 10.0 {
        format!("{value:.2}")
    } else if magnitude >= 1e-3 {
        format!("{value:.4}")
    } else {
        format!("{value:.1e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_their_digits() {
        for (value, text) in [
            (0.0, "0"),
            (0.42, "0.4200"),
            (-0.42, "-0.4200"),
            (1.5e-9, "1.5e-9"),
            (52.346, "52.35"),
            (1000.0, "1000"),
            (-123.456, "-123.5"),
        ] {
            assert_eq!(significant(value), text);
        }
    }
}
