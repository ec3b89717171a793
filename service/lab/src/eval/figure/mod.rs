//! Figures: each measure over the steps, as SVG, fit for a slide.

mod chart;
mod colour;
mod heat;
mod picture;

use chart::{Chart, Line, Mark, YAxis};
pub(crate) use chart::{HEADER, SIZE, header};
pub(crate) use colour::{GRID, INK, LINES, PALE_INK};
pub use picture::{Figure, FigureError};

use super::experiment::Experiment;
use super::protocol::PAPER_P_NEW;
use super::quantity::Quantity;
use super::report::Report;
use super::table::conditions;

/// All figures of an experiment: the paper's Figs. 12 to 20 and the errors over time.
///
/// A line is the mean over the runs, its band reaches from the 10th to the 90th percentile, and a
/// dashed line is a number that the paper states. The revisits are those of the first run.
///
/// # Errors
/// A figure could not be drawn.
pub fn figures(experiment: &Experiment) -> Result<Vec<Figure>, FigureError> {
    let protocol = &experiment.protocol;
    let report = Report::of(experiment);
    let subtitle = format!("{} · {}", report.environment, conditions(&report));
    let mut charts = measures();
    charts.iter_mut().for_each(mark);
    charts.push(prediction());
    charts.push(errors(experiment));
    let mut figures = charts
        .iter()
        .map(|chart| chart.draw(experiment, &subtitle))
        .collect::<Result<Vec<_>, _>>()?;
    if let Some(path) = experiment.path() {
        let subtitle = format!(
            "{} · seed {}, {} steps, seen from above",
            report.environment, report.seed, protocol.steps
        );
        figures.push(heat::draw(path, protocol.environment.side_m(), &subtitle)?);
    }
    figures.sort_by_key(|figure| figure.name);
    Ok(figures)
}

/// The charts of one measure each.
fn measures() -> Vec<Chart> {
    vec![
        score(
            "pseudo-activation",
            "Pseudo-activation of the recalled place",
            "pseudo-activation (Eq. 9)",
            Quantity::PseudoActivation,
        ),
        score(
            "cosine-score",
            "Cosine match score of the recalled place",
            "cosine of grid activations (Eq. 10)",
            Quantity::Cosine,
        ),
        score(
            "recall-confidence",
            "Recall confidence",
            "confidence (Eq. 8)",
            Quantity::Confidence,
        ),
        score(
            "interference-score",
            "Interference match score",
            "cosine of interference patterns (Eqs. 4, 5)",
            Quantity::InterferenceScore,
        ),
        count(
            "place-count",
            "Place neurons in memory",
            "places",
            Quantity::Places,
        ),
        count(
            "unique-visits",
            "Unique locations visited",
            "locations farther than 0.25 m from each other",
            Quantity::UniqueLocations,
        ),
        count(
            "growth",
            "Growth of place memory",
            "places recruited a step, over a tenth of the walk",
            Quantity::Growth,
        ),
    ]
}

/// Marks in a chart what the paper states.
fn mark(chart: &mut Chart) {
    let paper_growth = format!("the paper's P_new = {PAPER_P_NEW}");
    match chart.name {
        "growth" => chart.marks.push(Mark::level(PAPER_P_NEW, paper_growth)),
        "place-count" => chart.marks.push(Mark {
            start: 0.0,
            per_step: PAPER_P_NEW,
            label: paper_growth,
        }),
        // In the frame of a room's corner all patterns point much the same way.
        "interference-score" => chart.y_axis = YAxis::UpToOne,
        _ => {}
    }
}

/// The chart of the error of the recalled place.
fn prediction() -> Chart {
    Chart {
        lines: vec![
            Line::banded(
                Quantity::PredictionError,
                "recalled place before the step is learned, mean and 10 % to 90 % of the runs",
            ),
            Line::plain(Quantity::OracleError, "nearest stored place, after it"),
        ],
        ..count(
            "prediction-error",
            "Prediction error",
            "distance from the true position [m]",
            Quantity::PredictionError,
        )
    }
}

/// A chart of a number from 0 to 1.
fn score(name: &'static str, title: &'static str, y: &'static str, quantity: Quantity) -> Chart {
    Chart {
        y_axis: YAxis::Share,
        ..count(name, title, y, quantity)
    }
}

/// A chart of a number from 0 up.
fn count(name: &'static str, title: &'static str, y: &'static str, quantity: Quantity) -> Chart {
    Chart {
        name,
        title,
        y_label: y,
        y_axis: YAxis::FromZero,
        lines: vec![Line::banded(quantity, "mean, and 10 % to 90 % of the runs")],
        marks: Vec::new(),
    }
}

/// The chart of all errors over time.
fn errors(experiment: &Experiment) -> Chart {
    let noisy = experiment.protocol.odometry != cogmap_worlds::OdometryNoise::none();
    let mut lines = vec![
        Line::banded(
            Quantity::RecallError,
            "recalled place, mean and 10 % to 90 % of the runs",
        ),
        Line::plain(Quantity::OracleError, "nearest stored place"),
        Line::plain(Quantity::CausalError, "published pose"),
    ];
    if noisy {
        lines.push(Line::plain(Quantity::DeadReckoningError, "dead reckoning"));
    }
    let paper = experiment.protocol.environment.paper_ate_m();
    let marks = paper.into_iter().flat_map(|(mean_m, rmse_m)| {
        [
            Mark::level(mean_m, format!("the paper's mean ATE, {mean_m} m")),
            Mark::level(rmse_m, format!("the paper's RMSE, {rmse_m} m")),
        ]
    });
    Chart {
        name: "error-over-time",
        title: "Absolute trajectory error",
        y_label: "distance from the true position [m]",
        y_axis: YAxis::FromZero,
        lines,
        marks: marks.collect(),
    }
}
