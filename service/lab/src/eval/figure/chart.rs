//! A chart of quantities over the steps of a walk.

use plotters::coord::Shift;
use plotters::prelude::*;

use super::colour::{self, GRID, INK, PALE_INK, PAPER};
use super::picture::{Figure, FigureError};
use crate::eval::experiment::Experiment;
use crate::eval::quantity::Quantity;
use crate::eval::statistic::quantile;

/// Width and height of a figure \[px\].
pub(crate) const SIZE: (u32, u32) = (960, 600);
/// Height of the title and subtitle \[px\].
pub(crate) const HEADER: i32 = 66;
/// Height of one line of the legend \[px\].
const LEGEND_LINE: i32 = 22;
/// A point is drawn where at least this share of the runs has a value: a mean over fewer jumps.
const RUNS_SHARE_MIN: f64 = 0.25;
/// Air above the largest value, as a share of it.
const AIR: f64 = 0.06;

/// A chart, before it is drawn.
#[derive(Clone, Debug)]
pub(super) struct Chart {
    pub(super) name: &'static str,
    pub(super) title: &'static str,
    pub(super) y_label: &'static str,
    pub(super) y_axis: YAxis,
    pub(super) lines: Vec<Line>,
    pub(super) marks: Vec<Mark>,
}

/// What a y axis spans.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum YAxis {
    /// From 0 as far as the data need it.
    FromZero,
    /// From 0 to 1.
    Share,
    /// From below the lowest value to 1, for scores that are all near it.
    UpToOne,
}

/// A quantity as a line.
#[derive(Clone, Debug)]
pub(super) struct Line {
    quantity: Quantity,
    label: &'static str,
    banded: bool,
}

/// A straight line that the paper states.
#[derive(Clone, Debug)]
pub(super) struct Mark {
    /// Its value before the first step.
    pub(super) start: f64,
    /// Its rise.
    pub(super) per_step: f64,
    pub(super) label: String,
}

impl Line {
    /// A line with a band around it.
    pub(super) fn banded(quantity: Quantity, label: &'static str) -> Self {
        Self {
            quantity,
            label,
            banded: true,
        }
    }

    /// A line alone.
    pub(super) fn plain(quantity: Quantity, label: &'static str) -> Self {
        Self {
            quantity,
            label,
            banded: false,
        }
    }
}

impl Mark {
    /// A constant.
    pub(super) fn level(value: f64, label: String) -> Self {
        Self {
            start: value,
            per_step: 0.0,
            label,
        }
    }
}

/// What is drawn of a line: step, mean, 10th and 90th percentile of the runs.
type Point = (f64, f64, f64, f64);

impl Chart {
    /// Draws it.
    pub(super) fn draw(
        &self,
        experiment: &Experiment,
        subtitle: &str,
    ) -> Result<Figure, FigureError> {
        let mut svg = String::new();
        self.draw_on(&mut svg, experiment, subtitle)
            .map_err(|error| FigureError {
                figure: self.name,
                reason: error.to_string(),
            })?;
        Ok(Figure {
            name: self.name,
            svg,
        })
    }

    fn draw_on(
        &self,
        svg: &mut String,
        experiment: &Experiment,
        subtitle: &str,
    ) -> Result<(), Box<dyn std::error::Error>> {
        let lines: Vec<Vec<Point>> = self
            .lines
            .iter()
            .map(|line| points(experiment, line.quantity))
            .collect();
        let steps = experiment.protocol.steps as f64;
        let (y_min, y_max) = match self.y_axis {
            YAxis::FromZero => (0.0, self.top(&lines, steps)),
            YAxis::Share => (0.0, 1.0),
            YAxis::UpToOne => (bottom(&lines), 1.0),
        };

        let root = SVGBackend::with_string(svg, SIZE).into_drawing_area();
        root.fill(&WHITE)?;
        header(&root, self.title, subtitle)?;
        let legend_lines = i32::try_from(self.lines.len() + self.marks.len())?;
        self.legend(&root)?;
        let (_, body) = root.split_vertically(HEADER + legend_lines * LEGEND_LINE + 4);
        let mut chart = ChartBuilder::on(&body)
            .margin_left(14)
            .margin_right(28)
            .margin_bottom(8)
            .margin_top(8)
            .x_label_area_size(52)
            .y_label_area_size(78)
            .build_cartesian_2d(0.0..steps, y_min..y_max)?;
        chart
            .configure_mesh()
            .x_desc("step of 0.1 m")
            .y_desc(self.y_label)
            .axis_desc_style(("sans-serif", 19).into_font().color(&INK))
            .label_style(("sans-serif", 17).into_font().color(&INK))
            .x_labels(8)
            .y_labels(6)
            .x_label_formatter(&|x| format!("{x:.0}"))
            .y_label_formatter(&|y| tick(*y, y_max - y_min))
            .light_line_style(TRANSPARENT)
            .bold_line_style(GRID)
            .axis_style(PALE_INK)
            .draw()?;
        for ((line, points), colour) in self.lines.iter().zip(&lines).zip(colour::LINES) {
            if line.banded {
                let upper = points.iter().map(|(x, _, _, high)| (*x, high.min(y_max)));
                let lower = points.iter().rev().map(|(x, _, low, _)| (*x, *low));
                let band: Vec<_> = upper.chain(lower).collect();
                chart.draw_series([Polygon::new(band, colour.mix(0.2).filled())])?;
            }
            let means = points.iter().map(|(x, mean, ..)| (*x, *mean));
            chart.draw_series(LineSeries::new(means, colour.stroke_width(3)))?;
        }
        for (mark, colour) in self.marks.iter().zip(PAPER) {
            // Cut where it would leave the chart.
            let room = (y_max - mark.start) / mark.per_step.max(f64::MIN_POSITIVE);
            let end = steps.min(room);
            let ends = [(0.0, mark.start), (end, mark.start + mark.per_step * end)];
            let style = colour.stroke_width(2);
            chart.draw_series(DashedLineSeries::new(ends, 10, 7, style))?;
        }
        drop(chart);
        body.present()?;
        Ok(())
    }

    /// End of the y axis that shows everything.
    fn top(&self, lines: &[Vec<Point>], steps: f64) -> f64 {
        let of_lines = self.lines.iter().zip(lines).flat_map(|(line, points)| {
            let high = |(_, mean, _, high): &Point| if line.banded { *high } else { *mean };
            points.iter().map(high)
        });
        let of_marks = self
            .marks
            .iter()
            .map(|mark| mark.start + mark.per_step * steps);
        let top = of_lines.chain(of_marks).fold(0.0, f64::max);
        if top > 0.0 { top * (1.0 + AIR) } else { 1.0 }
    }

    /// Draws what each line means, one below the other.
    fn legend(
        &self,
        root: &DrawingArea<SVGBackend<'_>, Shift>,
    ) -> Result<(), Box<dyn std::error::Error>> {
        let mut y = HEADER + LEGEND_LINE / 2;
        let text = ("sans-serif", 17).into_font().color(&INK);
        for (line, colour) in self.lines.iter().zip(colour::LINES) {
            if line.banded {
                let corners = [(24, y - 7), (62, y + 7)];
                root.draw(&Rectangle::new(corners, colour.mix(0.2).filled()))?;
            }
            root.draw(&PathElement::new(
                [(24, y), (62, y)],
                colour.stroke_width(3),
            ))?;
            root.draw(&Text::new(line.label, (72, y - 8), &text))?;
            y += LEGEND_LINE;
        }
        for (mark, colour) in self.marks.iter().zip(PAPER) {
            for x in [24, 41, 58] {
                let dash = [(x, y), (x + 8, y)];
                root.draw(&PathElement::new(dash, colour.stroke_width(2)))?;
            }
            root.draw(&Text::new(mark.label.as_str(), (72, y - 8), &text))?;
            y += LEGEND_LINE;
        }
        Ok(())
    }
}

/// Draws title and subtitle.
pub(crate) fn header(
    root: &DrawingArea<SVGBackend<'_>, Shift>,
    title: &str,
    subtitle: &str,
) -> Result<(), Box<dyn std::error::Error>> {
    let large = ("sans-serif", 28).into_font().color(&INK);
    let small = ("sans-serif", 17).into_font().color(&PALE_INK);
    root.draw(&Text::new(title, (24, 12), &large))?;
    root.draw(&Text::new(subtitle, (24, 42), &small))?;
    Ok(())
}

/// Mean and band of a quantity at each bin of the walk.
fn points(experiment: &Experiment, quantity: Quantity) -> Vec<Point> {
    let curves: Vec<_> = experiment
        .runs
        .iter()
        .map(|run| &run.curves[quantity])
        .collect();
    let bins = curves.iter().map(|curve| curve.len()).max().unwrap_or(0);
    let enough = RUNS_SHARE_MIN * curves.len() as f64;
    let point = |bin: usize| {
        let mut values: Vec<f64> = curves.iter().filter_map(|curve| curve.mean(bin)).collect();
        values.sort_unstable_by(f64::total_cmp);
        let drawn = !values.is_empty() && values.len() as f64 >= enough;
        drawn.then(|| {
            let mean = values.iter().sum::<f64>() / values.len() as f64;
            let middle = curves.first().map_or(0.0, |curve| curve.middle(bin));
            (middle, mean, quantile(&values, 0.1), quantile(&values, 0.9))
        })
    };
    (0..bins).filter_map(point).collect()
}

/// Start of a y axis that ends at 1 and shows all lines and bands.
fn bottom(lines: &[Vec<Point>]) -> f64 {
    // A few outliers may pull the mean below the band.
    let lows = lines
        .iter()
        .flatten()
        .map(|(_, mean, low, _)| low.min(*mean));
    let deficit = 1.0 - lows.fold(1.0, f64::min);
    // The smallest span keeps the ticks of an axis without any deficit apart.
    1.0 - (deficit * (1.0 + AIR)).max(1e-4)
}

/// A number on the y axis, with as many decimals as an axis of this span needs.
fn tick(value: f64, span: f64) -> String {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "from 0 to 8"
    )]
    let decimals = (1.0 - span.log10().floor()).clamp(0.0, 8.0) as usize;
    format!("{value:.decimals$}")
}
