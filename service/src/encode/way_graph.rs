//! The ways as a graph for other programs: `GraphML`, and the `GeoJSON` of Nav2's Route Server.

use std::collections::BTreeMap;
use std::fmt::Write;

use cognitive_map::{CognitiveMap, PlaceId, Reverse, ThinnedTraversal, ThinnedWay};
use nalgebra::Vector3;
use serde::Serialize;
use utoipa::ToSchema;

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

/// A graph for the Route Server of Nav2, as `GeoJSON`.
#[derive(Debug, Serialize, ToSchema)]
#[serde(tag = "type")]
pub enum RouteGraph {
    /// The graph.
    FeatureCollection {
        /// Name of the space.
        name: String,
        /// Nodes, then edges.
        features: Vec<RouteFeature>,
    },
}

/// A node or an edge of a graph for the Route Server.
#[derive(Debug, Serialize, ToSchema)]
#[serde(tag = "type")]
pub enum RouteFeature {
    /// One of both.
    Feature {
        /// What it is.
        properties: RouteProperties,
        /// Where it is.
        geometry: RouteGeometry,
    },
}

/// What a node or an edge for the Route Server is.
#[derive(Debug, Serialize, ToSchema)]
#[serde(untagged)]
pub enum RouteProperties {
    /// An edge, in one direction.
    Edge {
        /// Its number, beyond those of places.
        id: u64,
        /// Number of the place where it begins.
        startid: u32,
        /// Number of the place where it ends.
        endid: u32,
        /// More of it.
        metadata: RouteEdge,
    },
    /// A node.
    Node {
        /// Number of the place.
        id: u32,
        /// Its frame: `map`.
        frame: &'static str,
    },
}

/// What is known of an edge for the Route Server.
#[derive(Debug, Serialize, ToSchema)]
pub struct RouteEdge {
    /// How long it takes \[s\].
    abs_time_taken: f64,
    /// Length along the way that it stands for \[m\].
    length_m: f64,
    /// Whether somebody travelled all of it in this direction.
    travelled: bool,
}

/// Where a node or an edge for the Route Server is, in the plane \[m\].
#[derive(Debug, Serialize, ToSchema)]
#[serde(tag = "type", content = "coordinates")]
pub enum RouteGeometry {
    /// A node.
    Point([f64; 2]),
    /// An edge: one line from its beginning to its end.
    MultiLineString([[[f64; 2]; 2]; 1]),
}

/// The ways as a graph for the Route Server of Nav2, which takes straight edges in the plane: nodes
/// with the numbers of places, edges in each direction with the numbers after those.
pub fn nav2(space: &str, map: &CognitiveMap, tolerance_m: f64, reverse: Reverse) -> RouteGraph {
    let graph = Graph::of(map, tolerance_m, reverse);
    let nodes = graph.nodes.iter().map(|(place, at)| RouteFeature::Feature {
        properties: RouteProperties::Node {
            id: place.0,
            frame: FRAME,
        },
        geometry: RouteGeometry::Point([at.x, at.y]),
    });
    let last = graph.nodes.keys().next_back();
    let first = last.map_or(0, |last| u64::from(last.0) + 1);
    let edges = (first..).zip(graph.arcs()).filter_map(|(id, arc)| {
        let ends = [graph.nodes.get(&arc.from)?, graph.nodes.get(&arc.to)?];
        Some(RouteFeature::Feature {
            properties: RouteProperties::Edge {
                id,
                startid: arc.from.0,
                endid: arc.to.0,
                metadata: RouteEdge {
                    abs_time_taken: arc.traversal.duration_s,
                    length_m: arc.way.length_m,
                    travelled: arc.traversal.is_travelled,
                },
            },
            geometry: RouteGeometry::MultiLineString([ends.map(|end| [end.x, end.y])]),
        })
    });
    RouteGraph::FeatureCollection {
        name: space.to_owned(),
        features: nodes.chain(edges).collect(),
    }
}
