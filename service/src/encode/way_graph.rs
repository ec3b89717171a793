//! The ways as a graph for other programs: `GraphML`, and the `GeoJSON` of Nav2's Route Server.

use std::collections::BTreeMap;
use std::fmt::Write;

use cognitive_map::{CognitiveMap, PlaceId, Reverse, ThinnedTraversal, ThinnedWay};
use nalgebra::Vector3;
use serde_json::{Value, json};

use super::FRAME;

/// A directed edge.
struct Arc<'a> {
    from: PlaceId,
    to: PlaceId,
    way: &'a ThinnedWay,
    traversal: ThinnedTraversal,
}

/// The ways as a graph.
struct Graph {
    /// The ends of edges, by number.
    nodes: BTreeMap<PlaceId, Vector3<f64>>,
    edges: Vec<ThinnedWay>,
    reverse: Reverse,
}

impl Graph {
    fn of(map: &CognitiveMap, tolerance_m: f64, reverse: Reverse) -> Self {
        let edges = map.thinned_ways(tolerance_m);
        let ends = edges
            .iter()
            .filter_map(|edge| edge.places.first().zip(edge.places.last()));
        let nodes = ends.flat_map(|(first, last)| [*first, *last]);
        let nodes = nodes.filter_map(|place| {
            let at = map.waypoint(place)?.pose().translation.vector;
            Some((place, at))
        });
        Self {
            nodes: nodes.collect(),
            edges,
            reverse,
        }
    }

    /// The edges in each direction that may be taken.
    fn arcs(&self) -> impl Iterator<Item = Arc<'_>> {
        let arcs = self.edges.iter().flat_map(|way| {
            let ends = way.places.first().copied().zip(way.places.last().copied());
            let both =
                ends.map(|(first, last)| [(first, last, way.there), (last, first, way.back)]);
            both.into_iter()
                .flatten()
                .map(move |(from, to, traversal)| Arc {
                    from,
                    to,
                    way,
                    traversal,
                })
        });
        arcs.filter(|arc| self.reverse == Reverse::Allowed || arc.traversal.is_travelled)
    }
}

/// The ways as a graph in the `GraphML` format: a node for each place where ways meet, end or
/// turn, an edge in each direction.
pub fn graphml(map: &CognitiveMap, tolerance_m: f64, reverse: Reverse) -> String {
    let graph = Graph::of(map, tolerance_m, reverse);
    let mut text = String::from(concat!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n",
        "<graphml xmlns=\"http://graphml.graphdrawing.org/xmlns\">\n",
    ));
    let keys = [
        ("node", "x_m", "double"),
        ("node", "y_m", "double"),
        ("node", "z_m", "double"),
        ("edge", "length_m", "double"),
        ("edge", "duration_s", "double"),
        ("edge", "travelled", "boolean"),
        ("edge", "ways", "int"),
    ];
    // Writing to a text does not fail.
    for (whose, name, kind) in keys {
        let _ = writeln!(
            text,
            "<key id=\"{name}\" for=\"{whose}\" attr.name=\"{name}\" attr.type=\"{kind}\"/>"
        );
    }
    let _ = writeln!(text, "<graph id=\"{FRAME}\" edgedefault=\"directed\">");
    for (place, at) in &graph.nodes {
        let _ = writeln!(
            text,
            "<node id=\"{}\"><data key=\"x_m\">{}</data><data key=\"y_m\">{}</data>\
            <data key=\"z_m\">{}</data></node>",
            place.0, at.x, at.y, at.z
        );
    }
    for arc in graph.arcs() {
        let _ = writeln!(
            text,
            "<edge source=\"{}\" target=\"{}\"><data key=\"length_m\">{}</data>\
            <data key=\"duration_s\">{}</data><data key=\"travelled\">{}</data>\
            <data key=\"ways\">{}</data></edge>",
            arc.from.0,
            arc.to.0,
            arc.way.length_m,
            arc.traversal.duration_s,
            arc.traversal.is_travelled,
            arc.way.places.len() - 1,
        );
    }
    text.push_str("</graph>\n</graphml>\n");
    text
}

/// The ways as a graph for the Route Server of Nav2, which takes straight edges in the plane: nodes
/// with the numbers of places, edges in each direction with the numbers after those.
pub fn nav2(space: &str, map: &CognitiveMap, tolerance_m: f64, reverse: Reverse) -> String {
    let graph = Graph::of(map, tolerance_m, reverse);
    let nodes = graph.nodes.iter().map(|(place, at)| {
        json!({
            "type": "Feature",
            "properties": { "id": place.0, "frame": FRAME },
            "geometry": { "type": "Point", "coordinates": [at.x, at.y] },
        })
    });
    let first = graph
        .nodes
        .keys()
        .next_back()
        .map_or(0, |last| u64::from(last.0) + 1);
    let edges = (first..).zip(graph.arcs()).filter_map(|(id, arc)| {
        let ends = [graph.nodes.get(&arc.from)?, graph.nodes.get(&arc.to)?];
        let line = ends.map(|end| [end.x, end.y]);
        Some(json!({
            "type": "Feature",
            "properties": {
                "id": id,
                "startid": arc.from.0,
                "endid": arc.to.0,
                "metadata": {
                    "abs_time_taken": arc.traversal.duration_s,
                    "length_m": arc.way.length_m,
                    "travelled": arc.traversal.is_travelled,
                },
            },
            "geometry": { "type": "MultiLineString", "coordinates": [line] },
        }))
    });
    let features: Vec<Value> = nodes.chain(edges).collect();
    let collection = json!({
        "type": "FeatureCollection",
        "name": space,
        "features": features,
    });
    collection.to_string()
}
