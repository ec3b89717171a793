//! The view alignment of a search: its queries among all remembered views.

use nalgebra::{Point3, Vector3};

use super::positions::Positions;
use super::problem::{Problem, QueryPoint};
use super::search::Search;
use crate::appearance::{LocalQuery, ReferenceView, ReferenceViews, ViewAlignment};
use crate::sequences::ViewMemory;
use crate::tuning::references as tuning;

/// The queries of a search, with all remembered views as references.
pub(crate) fn alignment<'a>(
    problem: &Problem,
    search: &'a Search,
    memory: &'a ViewMemory,
    positions: &'a Positions<'a>,
) -> ViewAlignment<'a, impl Fn(&[Point3<f64>]) -> ReferenceViews<'a>> {
    let query = |point: &QueryPoint| {
        let query = &search.queries[point.query];
        LocalQuery {
            at: point.at,
            drift_m: point.drift_m,
            channel: query.channel,
            kernel: memory.kernel(query.channel),
            vector: &query.vector,
        }
    };
    let queries: Vec<LocalQuery<'a>> = problem.points.iter().map(query).collect();
    let lengths_m = queries.iter().filter_map(|query| query.kernel);
    let longest_m = lengths_m.map(|kernel| kernel.length_m).fold(0.0, f64::max);
    ViewAlignment {
        queries,
        views: move |way: &[Point3<f64>]| views(way, 2.0 * longest_m, search, memory, positions),
        is_planar: problem.is_planar,
    }
}

/// The remembered views near a way, with their channels.
fn views<'a>(
    way: &[Point3<f64>],
    about_m: f64,
    search: &Search,
    memory: &'a ViewMemory,
    positions: &Positions<'_>,
) -> ReferenceViews<'a> {
    let Some(first) = way.first() else {
        return Vec::new();
    };
    let (mut low, mut high) = (*first, *first);
    for point in way {
        low = low.inf(point);
        high = high.sup(point);
    }
    let margin = Vector3::repeat(about_m);
    let (low, high) = (low - margin, high + margin);
    let is_within = |point: &Point3<f64>, more_m: f64| {
        (0..3).all(|k| point[k] >= low[k] - more_m && point[k] <= high[k] + more_m)
    };
    let more = Vector3::repeat(tuning::DISPLACED_M);
    let near = { memory.within([low - more, high + more]) }
        .filter(|view| is_within(&view.in_map, tuning::DISPLACED_M) && !search.is_own(view));
    near.filter_map(|view| {
        let at = positions.at(view.sample)?;
        let vector = &*view.vector;
        is_within(&at, 0.0).then_some((view.channel, ReferenceView { at, vector }))
    })
    .collect()
}
