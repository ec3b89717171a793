//! Paths, seen from above.

use nalgebra::Vector3;
use plotters::prelude::*;

use crate::eval::figure::{GRID, HEADER, INK, LINES, PALE_INK, SIZE, header};
use crate::eval::{Figure, FigureError};

/// Width of what is beside the map \[px\].
const SIDEBAR: u32 = 250;
/// Air around the paths, as a share of their extent.
const AIR: f64 = 0.04;
/// What the axes and margins take from the map's width and height \[px\].
const AXES: (f64, f64) = (100.0, 68.0);

/// A path and what it is.
#[derive(Clone, Debug)]
pub struct Path {
    /// What it is.
    pub label: String,
    /// Positions in order \[m\].
    pub positions_m: Vec<Vector3<f64>>,
}

/// Draws at most three paths over a broad and pale one that is their yardstick, and points.
///
/// # Errors
/// The figure could not be drawn.
pub fn figure(
    title: &str,
    subtitle: &str,
    paths: &[Path],
    yardstick: Option<&Path>,
    points_m: &[Vector3<f64>],
) -> Result<Figure, FigureError> {
    let name = "paths";
    let mut svg = String::new();
    draw(&mut svg, [title, subtitle], paths, yardstick, points_m).map_err(|error| FigureError {
        figure: name,
        reason: error.to_string(),
    })?;
    Ok(Figure { name, svg })
}

fn draw(
    svg: &mut String,
    [title, subtitle]: [&str; 2],
    paths: &[Path],
    yardstick: Option<&Path>,
    points_m: &[Vector3<f64>],
) -> Result<(), Box<dyn std::error::Error>> {
    let all = paths.iter().chain(yardstick);
    let (x_m, y_m) = view(all.flat_map(|path| &path.positions_m).chain(points_m));
    let root = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    header(&root, title, subtitle)?;
    let (_, body) = root.split_vertically(HEADER);
    let (map, sidebar) = body.split_horizontally(SIZE.0 - SIDEBAR);
    let mut chart = ChartBuilder::on(&map)
        .margin(8)
        .margin_left(14)
        .x_label_area_size(52)
        .y_label_area_size(78)
        .build_cartesian_2d(x_m, y_m)?;
    chart
        .configure_mesh()
        .x_desc("x [m]")
        .y_desc("y [m]")
        .axis_desc_style(("sans-serif", 19).into_font().color(&INK))
        .label_style(("sans-serif", 17).into_font().color(&INK))
        .x_labels(6)
        .y_labels(6)
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID)
        .axis_style(PALE_INK)
        .draw()?;
    let above =
        |path: &Path| -> Vec<(f64, f64)> { path.positions_m.iter().map(|p| (p.x, p.y)).collect() };
    let text = ("sans-serif", 17).into_font().color(&INK);
    let mut y = 20;
    let mut name = |label: &str, style: ShapeStyle| {
        sidebar.draw(&PathElement::new([(12, y), (46, y)], style))?;
        sidebar.draw(&Text::new(label.to_owned(), (56, y - 8), &text))?;
        y += 24;
        Ok::<_, Box<dyn std::error::Error>>(())
    };
    if let Some(path) = yardstick {
        let style = PALE_INK.mix(0.45).stroke_width(6);
        chart.draw_series(LineSeries::new(above(path), style))?;
        name(&path.label, style)?;
    }
    let marks = points_m.iter();
    chart.draw_series(marks.map(|p| Circle::new((p.x, p.y), 2, INK.filled())))?;
    for (path, colour) in paths.iter().zip([LINES[1], LINES[0], LINES[2]]) {
        let style = colour.stroke_width(2);
        chart.draw_series(LineSeries::new(above(path), style))?;
        name(&path.label, style)?;
    }
    if !points_m.is_empty() {
        sidebar.draw(&Circle::new((29, y), 3, INK.filled()))?;
        let label = format!("a landmark, {} in all", points_m.len());
        sidebar.draw(&Text::new(label, (56, y - 8), &text))?;
    }
    drop(chart);
    root.present()?;
    Ok(())
}

/// The part of the plane that holds all positions, with metres of one length along both axes.
fn view<'a>(
    positions: impl Iterator<Item = &'a Vector3<f64>>,
) -> (std::ops::Range<f64>, std::ops::Range<f64>) {
    let mut low = Vector3::repeat(f64::INFINITY);
    let mut high = Vector3::repeat(f64::NEG_INFINITY);
    for position in positions {
        low = low.inf(position);
        high = high.sup(position);
    }
    if !(low.x.is_finite() && high.x.is_finite()) {
        return (-1.0..1.0, -1.0..1.0);
    }
    let width = f64::from(SIZE.0 - SIDEBAR) - AXES.0;
    let height = f64::from(SIZE.1) - f64::from(HEADER) - AXES.1;
    let (middle, extent) = ((low + high) / 2.0, high - low);
    let scale = (extent.x / width).max(extent.y / height).max(1e-6) * (1.0 + 2.0 * AIR);
    let (x, y) = (scale * width / 2.0, scale * height / 2.0);
    (middle.x - x..middle.x + x, middle.y - y..middle.y + y)
}
