//! Nodes on the body of an object.

use nalgebra::{Point3, Unit};

use super::body::Body;
use super::field::{LocalField, Site};
use super::fields::{Fields, near};
use super::graph::LinkGraph;
use super::sides;
use super::taken::Taken;
use super::tuning::{
    BODY_APART, BODY_POINTS, EXPLORED_REACH, NODE_ERROR, NODE_FIELD, NODES_GROWTH, NODES_MAX,
};
use crate::indexed_place::{Across, IndexedPlace, Prediction};
use crate::model::ModelPlace;
use crate::tuning::NODE_STEP;

/// The nodes on a body within reach of the places of a model that have these links.
pub(super) fn on_body(
    places: &[ModelPlace],
    graph: &LinkGraph,
    (fields, body): (&Fields, &Body),
    spacing_m: f64,
) -> Vec<IndexedPlace> {
    let room = NODES_MAX.saturating_sub(places.len());
    let reach_m = EXPLORED_REACH * graph.typical_m;
    let mut explored = Taken::new(reach_m, places.len());
    for place in places {
        explored.add(place.position_m);
    }
    let points = body.points(BODY_POINTS);
    let points: Vec<Point3<f64>> = points.filter(|at| explored.holds(at)).collect();
    // Finer steps than these never fit, or say no more.
    let finest_m = f64::max(
        graph.longest_m / NODES_MAX as f64,
        body.typical_error_m / NODE_ERROR,
    );
    let mut step_m = f64::max(NODE_STEP * spacing_m, finest_m);
    let chosen = loop {
        if let Some(chosen) = spread(&points, places, step_m, room) {
            break chosen;
        }
        step_m *= NODES_GROWTH;
    };
    let field_m = NODE_FIELD * step_m;
    let node = |at: Point3<f64>| {
        let (error_m2, normal) = body.surface(&at);
        let across = Unit::try_new(normal, 1e-9)?;
        let site = Site {
            middle: at,
            axes: sides::along(&across),
            of: Vec::new(),
            row: None,
        };
        let near = near(&site, places);
        let levels = fields.levels_around(&site, &near, places);
        let level = |(channel, local): &(u16, LocalField)| {
            let mut memory = local.memory(&at, *channel, places)?;
            memory.noise += local.scatter(&at, (&site.axes, field_m), *channel, places)?;
            Some(memory)
        };
        let nearest = near.first().map(|own| &places[*own as usize]);
        // On the side from which the nearest place was felt.
        let felt = nearest.and_then(ModelPlace::normal);
        let normal = felt.map(|felt| {
            if felt.dot(&normal) < 0.0 {
                -across
            } else {
                across
            }
        });
        Some(IndexedPlace {
            position: at,
            normal,
            variance_m2: field_m * field_m + error_m2,
            prediction: Some(Prediction {
                error_m: error_m2.sqrt(),
                across: Across::new(site.axes.iter()),
                bend_m2: 0.0,
            }),
            levels: levels.iter().filter_map(level).collect(),
            descriptors: nearest.map_or_else(Vec::new, |own| own.descriptors.clone()),
        })
    };
    chosen.into_iter().filter_map(node).collect()
}

/// Those of some points that lie about a step from one another and from the places; `None` if they
/// are more than there is room for.
fn spread(
    points: &[Point3<f64>],
    places: &[ModelPlace],
    step_m: f64,
    room: usize,
) -> Option<Vec<Point3<f64>>> {
    let mut taken = Taken::new(BODY_APART * step_m, places.len() + room);
    for place in places {
        taken.add(place.position_m);
    }
    let mut chosen = Vec::new();
    for at in points {
        if !taken.holds(at) {
            if chosen.len() == room {
                return None;
            }
            taken.add(*at);
            chosen.push(*at);
        }
    }
    Some(chosen)
}
