//! Routes.

use cogmap_proto as wire;
use cognitive_map::{CognitiveMap, Route, RouteStep, StepKind, Traversals, Way, Waypoint};
use nalgebra::Point3;

use super::FRAME;

/// Millionths of a cost's unit.
const MICRO: f64 = 1e6;
/// Most poses of a path: some 15 MB of JSON.
const POSES_MAX: f64 = 100_000.0;

/// The cheapest route and its alternatives; with paths where a distance of their poses is given
/// \[m\].
///
/// # Panics
/// There is no route.
pub fn routes(
    space: &str,
    map: &CognitiveMap,
    found: &[Route],
    spacing_m: Option<f64>,
) -> wire::RouteAnswer {
    let mut routes = found.iter().map(|found| route(map, found, spacing_m));
    let best = routes.next().expect("who finds no route answers so");
    wire::RouteAnswer {
        space: space.to_owned(),
        frame: FRAME.to_owned(),
        map_revision: map.revision(),
        cost: best.cost,
        length_m: best.length_m,
        duration_s: best.duration_s,
        sd_m: best.sd_m,
        steps: best.steps,
        path: best.path,
        alternatives: routes.collect(),
    }
}

fn route(map: &CognitiveMap, route: &Route, spacing_m: Option<f64>) -> wire::Route {
    wire::Route {
        cost: route.cost_micro as f64 / MICRO,
        length_m: route.length_m,
        duration_s: route.duration_s,
        sd_m: route.sd_m,
        steps: route.steps.iter().map(|of| step(map, of)).collect(),
        path: spacing_m.map(|spacing_m| path(route, spacing_m)),
    }
}

pub(super) fn step(map: &CognitiveMap, step: &RouteStep) -> wire::RouteStep {
    let leg = step.leg.filter(|(trip, _)| map.trip(*trip).is_some());
    wire::RouteStep {
        place: step.place.map(|place| place.0.into()),
        translation_m: step.position.into(),
        rotation_xyzw: step.rotation.coords.into(),
        tolerance_m: step.tolerance_m,
        sd_m: step.sd_m,
        way: match step.kind {
            StepKind::Travelled => wire::RouteWay::Travelled,
            StepKind::Reversed => wire::RouteWay::Reversed,
            StepKind::Shortcut => wire::RouteWay::Shortcut,
            StepKind::Approach => wire::RouteWay::Approach,
        },
        length_m: step.length_m,
        duration_s: step.duration_s,
        traversals: step.traversals,
        last_stamp_ns: step.last_stamp_ns,
        trip: leg.map(|(trip, _)| trip.0.into()),
        leg: leg.map(|(_, leg)| leg.into()),
    }
}

/// A way as the wire has it; `None` without its places, which every way has.
pub fn way(map: &CognitiveMap, way: &Way) -> Option<wire::Way> {
    let [from, to] = way.ends();
    let places = map.places_of_way(way)?;
    let [from_m, to_m] = [from, to].map(|end| map.waypoint(end));
    let position = |end: &Waypoint| end.pose().translation.vector.into();
    let rotation = |end: &Waypoint| end.pose().rotation.coords.into();
    let variance = way.measurement_variance().map(|x| x.max(0.0).sqrt());
    let relative = way.relative();
    Some(wire::Way {
        from: from.0.into(),
        to: to.0.into(),
        from_m: position(from_m?),
        to_m: position(to_m?),
        from_rotation_xyzw: rotation(from_m?),
        to_rotation_xyzw: rotation(to_m?),
        measurements: way.measurements(),
        length_m: way.length_m(&places),
        there: traversals(way.travelled_from(from)),
        back: traversals(way.travelled_from(to)),
        translation_m: relative.translation.vector.into(),
        rotation_xyzw: relative.rotation.coords.into(),
        translation_sd_m: [variance[0], variance[1], variance[2]],
        rotation_sd_rad: [variance[3], variance[4], variance[5]],
        disagrees: way.disagrees_with(&places),
        strength: map.way_strength(way),
    })
}

fn traversals(of: &Traversals) -> wire::WayTraversals {
    wire::WayTraversals {
        times: of.times(),
        fastest_s: of.fastest_s(),
        mean_s: of.mean_s(),
        last_stamp_ns: of.last_stamp_ns(),
    }
}

/// Whether an answer may hold a path of a length.
pub fn fits_in_path(length_m: f64, spacing_m: f64) -> bool {
    length_m / spacing_m <= POSES_MAX
}

/// Poses along the straight lines from step to step, at equal distances; the last one is where the
/// last step leads. Each faces along the line that it is on.
fn path(route: &Route, spacing_m: f64) -> Vec<wire::RoutePose> {
    let Some(last) = route.steps.last() else {
        return Vec::new();
    };
    let pose = |at: Point3<f64>, step: &RouteStep| wire::RoutePose {
        translation_m: at.into(),
        rotation_xyzw: step.rotation.coords.into(),
    };
    let mut poses = Vec::new();
    // How far the next pose lies from the beginning of the line.
    let (mut from, mut next_m) = (route.start, 0.0);
    for step in &route.steps {
        let way = step.position - from;
        let length_m = way.norm();
        while next_m < length_m {
            poses.push(pose(from + way * (next_m / length_m), step));
            next_m += spacing_m;
        }
        (from, next_m) = (step.position, next_m - length_m);
    }
    poses.push(pose(last.position, last));
    poses
}
