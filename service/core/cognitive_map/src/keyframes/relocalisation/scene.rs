//! A search among what was seen.

use nalgebra::{Point3, Vector3};

use super::positions::Positions;
use super::problem::{Problem, Spot};
use super::search::Search;
use crate::keyframes::field::{Glimpse, Scene, Seen, Views};
use crate::keyframes::graph::KeyframeGraph;

/// How far relaxation may have moved a view since it was seen, for it to be found quickly \[m\].
const DISPLACED_M: f64 = 5.0;

/// The looks of a search among everything that the team has seen.
pub(super) fn scene<'a>(
    problem: &Problem,
    search: &'a Search,
    chronicle: &'a KeyframeGraph,
    positions: &'a Positions<'a>,
) -> Scene<'a, impl Fn(&[Point3<f64>]) -> Views<'a>> {
    let glimpse = |spot: &Spot| {
        let look = &search.looks[spot.look];
        Glimpse {
            at: spot.at,
            drift_m: spot.drift_m,
            channel: look.channel,
            kernel: chronicle.revisits.kernel(look.channel),
            vector: &look.vector,
        }
    };
    let glimpses: Vec<Glimpse<'a>> = problem.spots.iter().map(glimpse).collect();
    let lengths_m = glimpses.iter().filter_map(|glimpse| glimpse.kernel);
    let longest_m = lengths_m.map(|kernel| kernel.length_m).fold(0.0, f64::max);
    Scene {
        glimpses,
        views: move |way: &[Point3<f64>]| views(way, 2.0 * longest_m, search, chronicle, positions),
        is_planar: problem.is_planar,
    }
}

/// The views near a way, with their channels.
fn views<'a>(
    way: &[Point3<f64>],
    about_m: f64,
    search: &Search,
    chronicle: &'a KeyframeGraph,
    positions: &Positions<'_>,
) -> Views<'a> {
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
    let views = chronicle.revisits.views.iter();
    let near = views.filter(|view| is_within(&view.in_map, DISPLACED_M) && !search.is_own(view));
    near.filter_map(|view| {
        let at = positions.at(view.agent, view.session, view.seq)?;
        let vector = &*view.vector;
        is_within(&at, 0.0).then_some((view.channel, Seen { at, vector }))
    })
    .collect()
}
