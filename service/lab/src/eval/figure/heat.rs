//! Where a walk has been, seen from above.

use std::collections::BTreeMap;

use plotters::prelude::*;

use super::chart::{HEADER, SIZE, header};
use super::colour::{GRID, INK, PALE_INK, PAPER, of_share};
use super::picture::{Figure, FigureError};
use crate::eval::run::Path;

/// Edge of a column in which visits are counted \[m\]: the field radius.
const COLUMN_M: f64 = 0.25;
/// Air around the walk \[m\].
const AIR_M: f64 = 0.5;
/// Width of what is beside the map \[px\].
const SIDEBAR: u32 = 330;
/// Steps of the colour scale.
const SCALE_STEPS: i32 = 64;

/// Draws the visits of columns, the obstacles and the places.
pub(super) fn draw(path: &Path, side_m: f64, subtitle: &str) -> Result<Figure, FigureError> {
    let name = "revisits";
    let mut svg = String::new();
    draw_on(&mut svg, path, side_m, subtitle).map_err(|error| FigureError {
        figure: name,
        reason: error.to_string(),
    })?;
    Ok(Figure { name, svg })
}

fn draw_on(
    svg: &mut String,
    path: &Path,
    side_m: f64,
    subtitle: &str,
) -> Result<(), Box<dyn std::error::Error>> {
    let columns = columns(path);
    let most = columns.values().copied().max().unwrap_or(1);
    let (x_m, y_m) = view(path, side_m);

    let root = SVGBackend::with_string(svg, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    header(&root, "Position revisits", subtitle)?;
    let (_, body) = root.split_vertically(HEADER);
    let (map, sidebar) = body.split_horizontally(SIZE.0 - SIDEBAR);
    let mut chart = ChartBuilder::on(&map)
        .margin(8)
        .margin_left(14)
        .x_label_area_size(52)
        .y_label_area_size(78)
        .build_cartesian_2d(x_m.clone(), y_m.clone())?;
    chart
        .configure_mesh()
        .x_desc("x [m]")
        .y_desc("y [m]")
        .axis_desc_style(("sans-serif", 19).into_font().color(&INK))
        .label_style(("sans-serif", 17).into_font().color(&INK))
        .x_labels(6)
        .y_labels(6)
        .x_label_formatter(&|x| format!("{x:.1}"))
        .y_label_formatter(&|y| format!("{y:.1}"))
        .light_line_style(TRANSPARENT)
        .bold_line_style(GRID)
        .axis_style(PALE_INK)
        .draw()?;
    let inside = |x: f64, y: f64| (x.clamp(x_m.start, x_m.end), y.clamp(y_m.start, y_m.end));
    let boxed = |x: f64, y: f64, edge: f64| [inside(x, y), inside(x + edge, y + edge)];
    chart.draw_series(columns.iter().map(|(&(i, j), &visits)| {
        let corners = boxed(i as f64 * COLUMN_M, j as f64 * COLUMN_M, COLUMN_M);
        Rectangle::new(corners, of_share(share(visits, most)).filled())
    }))?;
    chart.draw_series(path.cubes.iter().filter_map(|cube| {
        let half = cube.edge_m / 2.0;
        let corners = boxed(cube.centre_m.x - half, cube.centre_m.y - half, cube.edge_m);
        let seen = corners[0].0 < corners[1].0 && corners[0].1 < corners[1].1;
        seen.then(|| Rectangle::new(corners, PALE_INK.mix(0.45).stroke_width(1)))
    }))?;
    chart.draw_series(path.places_m.iter().filter_map(|place| {
        let (x, y) = (place.x, place.y);
        let seen = x_m.contains(&x) && y_m.contains(&y);
        seen.then(|| Circle::new((x, y), 4, PAPER[0].filled()))
    }))?;
    drop(chart);

    draw_sidebar(&sidebar, path, most)?;
    body.present()?;
    Ok(())
}

/// The scale of colours, and what the marks on the map are.
fn draw_sidebar(
    sidebar: &DrawingArea<SVGBackend<'_>, plotters::coord::Shift>,
    path: &Path,
    most: u64,
) -> Result<(), Box<dyn std::error::Error>> {
    let text = ("sans-serif", 17).into_font().color(&INK);
    let (top, height) = (40, 300);
    for step in 0..SCALE_STEPS {
        let y = |k: i32| top + height - height * k / SCALE_STEPS;
        let colour = of_share(f64::from(step) / f64::from(SCALE_STEPS - 1));
        let corners = [(20, y(step + 1)), (48, y(step))];
        sidebar.draw(&Rectangle::new(corners, colour.filled()))?;
    }
    sidebar.draw(&Text::new("steps that ended in a column", (20, 8), &text))?;
    sidebar.draw(&Text::new(most.to_string(), (58, top - 8), &text))?;
    sidebar.draw(&Text::new("1", (58, top + height - 8), &text))?;
    let places = top + height + 34;
    sidebar.draw(&Circle::new((34, places), 4, PAPER[0].filled()))?;
    let label = format!("a place, {} in all", path.places_m.len());
    sidebar.draw(&Text::new(label, (58, places - 8), &text))?;
    if !path.cubes.is_empty() {
        let corners = [(24, places + 24), (44, places + 44)];
        sidebar.draw(&Rectangle::new(corners, PALE_INK.mix(0.45).stroke_width(1)))?;
        let label = "an obstacle, at any height";
        sidebar.draw(&Text::new(label, (58, places + 26), &text))?;
    }
    Ok(())
}

/// Numbers of visits by column.
fn columns(path: &Path) -> BTreeMap<(i64, i64), u64> {
    let mut columns = BTreeMap::new();
    for pose in &path.truth {
        let at = pose.pose.translation.vector / COLUMN_M;
        #[expect(clippy::cast_possible_truncation, reason = "rooms have few columns")]
        let column = (at.x.floor() as i64, at.y.floor() as i64);
        *columns.entry(column).or_insert(0) += 1;
    }
    columns
}

/// Where a number of visits lies on the scale; one visit is at its beginning.
fn share(visits: u64, most: u64) -> f64 {
    (visits.saturating_sub(1)) as f64 / (most.saturating_sub(1)).max(1) as f64
}

/// The square of the room that holds the whole walk, along x and y \[m\].
fn view(path: &Path, side_m: f64) -> (std::ops::Range<f64>, std::ops::Range<f64>) {
    let positions = || path.truth.iter().map(|pose| pose.pose.translation.vector);
    let bounds = |axis: usize| {
        let along = positions().map(|p| p[axis]);
        along.fold((side_m, 0.0_f64), |(low, high), x| {
            (low.min(x), high.max(x))
        })
    };
    let ((x_low, x_high), (y_low, y_high)) = (bounds(0), bounds(1));
    let half = (((x_high - x_low).max(y_high - y_low)) / 2.0 + AIR_M).min(side_m / 2.0);
    let around = |low: f64, high: f64| {
        let centre = f64::midpoint(low, high).clamp(half, side_m - half);
        centre - half..centre + half
    };
    (around(x_low, x_high), around(y_low, y_high))
}
