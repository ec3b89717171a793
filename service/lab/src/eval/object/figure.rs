//! Fig. 21: how ambiguity resolves, over the touches.

use plotters::prelude::*;

use super::report::ObjectReport;
use crate::eval::figure::{GRID, HEADER, INK, LINES, PALE_INK, SIZE, header};
use crate::eval::{Figure, FigureError};

/// Height of one line of the legend \[px\].
const LEGEND_LINE: i32 = 22;
/// Most lines: as many as there are colours.
const LINES_MAX: usize = LINES.len();
/// What follows the touch after which so little changes any more is not drawn.
const SETTLED: f64 = 0.002;

/// One of the two charts.
struct Chart {
    name: &'static str,
    title: &'static str,
    y_label: &'static str,
    curve: fn(&ObjectReport) -> &[f64],
}

/// Fig. 21a, the number of active object representations, and 21b, the confidence, with a line for
/// each experiment; at most four are drawn.
///
/// # Errors
/// A figure could not be drawn.
pub fn object_figures(reports: &[ObjectReport]) -> Result<Vec<Figure>, FigureError> {
    let charts = [
        Chart {
            name: "active-objects",
            title: "Active object representations (Fig. 21a)",
            y_label: "objects with a probability above 0.01, mean",
            curve: |report| &report.live_objects,
        },
        Chart {
            name: "object-confidence",
            title: "Recognition confidence (Fig. 21b)",
            y_label: "probability of the first choice, mean",
            curve: |report| &report.confidence,
        },
    ];
    charts.iter().map(|chart| chart.draw(reports)).collect()
}

impl Chart {
    fn draw(&self, reports: &[ObjectReport]) -> Result<Figure, FigureError> {
        let mut svg = String::new();
        self.draw_on(&mut svg, reports)
            .map_err(|error| FigureError {
                figure: self.name,
                reason: error.to_string(),
            })?;
        let name = self.name;
        Ok(Figure { name, svg })
    }

    fn draw_on(
        &self,
        svg: &mut String,
        reports: &[ObjectReport],
    ) -> Result<(), Box<dyn std::error::Error>> {
        let reports = &reports[..reports.len().min(LINES_MAX)];
        let curves: Vec<&[f64]> = reports.iter().map(self.curve).collect();
        let touches = curves.iter().map(|curve| settled(curve)).max();
        let touches = touches.unwrap_or(1).max(2) as f64;
        let top = curves.iter().flat_map(|curve| curve.iter());
        let top = top.copied().fold(1.0, f64::max) * 1.06;
        let root = SVGBackend::with_string(svg, SIZE).into_drawing_area();
        root.fill(&WHITE)?;
        let subtitle = reports.first().map_or_else(String::new, |report| {
            format!(
                "env3 · {} explorations, value noise {}, motion noise {}, turns: {}",
                report.trials, report.value_noise, report.motion_noise, report.rotate
            )
        });
        header(&root, self.title, &subtitle)?;
        let text = ("sans-serif", 17).into_font().color(&INK);
        let mut y = HEADER + LEGEND_LINE / 2;
        for (report, colour) in reports.iter().zip(LINES) {
            let label = legend(report);
            root.draw(&PathElement::new(
                [(24, y), (62, y)],
                colour.stroke_width(3),
            ))?;
            root.draw(&Text::new(label, (72, y - 8), &text))?;
            y += LEGEND_LINE;
        }
        let (_, body) = root.split_vertically(y - LEGEND_LINE / 2 + 4);
        let mut chart = ChartBuilder::on(&body)
            .margin(8)
            .margin_left(14)
            .margin_right(28)
            .x_label_area_size(52)
            .y_label_area_size(78)
            .build_cartesian_2d(1.0..touches, 0.0..top)?;
        chart
            .configure_mesh()
            .x_desc("touch")
            .y_desc(self.y_label)
            .axis_desc_style(("sans-serif", 19).into_font().color(&INK))
            .label_style(("sans-serif", 17).into_font().color(&INK))
            .x_labels(8)
            .y_labels(6)
            .x_label_formatter(&|x| format!("{x:.0}"))
            .light_line_style(TRANSPARENT)
            .bold_line_style(GRID)
            .axis_style(PALE_INK)
            .draw()?;
        for (curve, colour) in curves.iter().zip(LINES) {
            let points = curve.iter().enumerate();
            let points = points.map(|(index, value)| (index as f64 + 1.0, *value));
            let drawn = points.take_while(|point| point.0 <= touches);
            chart.draw_series(LineSeries::new(drawn, colour.stroke_width(3)))?;
        }
        drop(chart);
        root.present()?;
        Ok(())
    }
}

/// What a line is, with the paper's numbers where it has some.
fn legend(report: &ObjectReport) -> String {
    let outcomes = report.outcomes.as_ref();
    let steps = outcomes.and_then(|outcomes| outcomes.steps_mean);
    let ours = steps.map_or_else(String::new, |steps| format!(", answer after {steps:.1}"));
    let paper = report.paper.map_or_else(String::new, |paper| {
        format!(" (the paper's: {})", paper.steps_mean)
    });
    format!("{} objects{ours}{paper}", report.objects)
}

/// The touch from which on a curve stays where it ends.
fn settled(curve: &[f64]) -> usize {
    let Some(end) = curve.last() else { return 0 };
    let moving = curve
        .iter()
        .rposition(|value| (value - end).abs() > SETTLED);
    moving.map_or(1, |index| index + 2)
}
