//! Nodes: places that were not felt, between places that were.

use nalgebra::{Point3, Vector3};

use super::body_nodes::on_body;
use super::field::{LocalField, Site};
use super::fields::{Fields, Surface, near};
use super::graph::LinkGraph;
use super::taken::Taken;
use super::tuning::{NODE_APART, NODE_ERROR, NODE_FIELD, NODES_GROWTH, NODES_MAX};
use crate::indexed_place::{IndexedPlace, Prediction};
use crate::model::ModelPlace;
use crate::tuning::NODE_STEP;

/// Most parts of the side of a triangle: a thousand points lie on it then.
const PARTS_MAX: u32 = 46;

/// A place on a link or in a triangle, with the corners by which it is spanned.
struct Span {
    at: Point3<f64>,
    corners: Vec<u32>,
    /// Number of its segment or triangle.
    site: usize,
}

/// The nodes between the places of a model that have these links.
///
/// There are none where places are dense, and with them no more than `NODES_MAX` in all: their
/// distance grows until they fit.
pub(crate) fn interpolated(
    places: &[ModelPlace],
    graph: &LinkGraph,
    fields: &Fields,
    spacing_m: f64,
) -> Vec<IndexedPlace> {
    let room = NODES_MAX.saturating_sub(places.len());
    if room == 0 || graph.is_dense(spacing_m) {
        return Vec::new();
    }
    let (place, neighbours) = match &fields.surface {
        Surface::Body(body) => return on_body(places, graph, (fields, body), spacing_m),
        Surface::Local { place, neighbours } => (place, neighbours),
    };
    let sites = neighbours.sites(places, graph);
    // Finer steps than these never fit, or say no more.
    let finest_m = f64::max(
        graph.longest_m / NODES_MAX as f64,
        place.typical_error / NODE_ERROR,
    );
    let mut step_m = f64::max(NODE_STEP * spacing_m, finest_m);
    let mut spans = spans(places, &sites, step_m);
    while spans.len() > room {
        step_m *= NODES_GROWTH;
        spans = self::spans(places, &sites, step_m);
    }
    let mut nodes = Vec::with_capacity(spans.len());
    for of_site in spans.chunk_by(|a, b| a.site == b.site) {
        let site = &sites[of_site[0].site].0;
        let near = near(site, places);
        let Some(place) = fields.place_around(site, &near, places) else {
            continue;
        };
        let levels = fields.levels_around(site, &near, places);
        let local = LocalFields { place, levels };
        nodes.extend(of_site.iter().map(|span| local.node(span, places, step_m)));
    }
    nodes
}

/// Points of all sites, no two nearer than about a step.
fn spans(places: &[ModelPlace], sites: &[(Site, Vec<u32>)], step_m: f64) -> Vec<Span> {
    let mut spans: Vec<Span> = Vec::new();
    let mut taken = Taken::new(NODE_APART * step_m, places.len() + NODES_MAX);
    for place in places {
        taken.add(place.position_m);
    }
    for (number, (site, corners)) in sites.iter().enumerate() {
        let at: Vec<Vector3<f64>> = corners
            .iter()
            .map(|corner| places[*corner as usize].position_m.coords)
            .collect();
        let longest_m = { at.iter().zip(at.iter().cycle().skip(1)) }
            .map(|(a, b)| (b - a).norm())
            .fold(0.0, f64::max);
        let parts = (longest_m / step_m).ceil().max(1.0);
        // A triangle of so many points has too many of them anyway.
        let parts = crate::numeric::floor_u32(parts).min(PARTS_MAX);
        for shares in shares(at.len(), parts) {
            let point = at.iter().zip(&shares).map(|(at, share)| at * *share);
            let at = site.below(&Point3::from(point.sum::<Vector3<f64>>()));
            if !taken.holds(&at) {
                taken.add(at);
                spans.push(Span {
                    at,
                    corners: corners.clone(),
                    site: number,
                });
            }
            if spans.len() > NODES_MAX {
                return spans;
            }
        }
    }
    spans
}

/// Barycentric coordinates of an even lattice over two or three corners.
fn shares(corners: usize, parts: u32) -> Vec<Vec<f64>> {
    let part = |k: u32| f64::from(k) / f64::from(parts);
    let mut shares = Vec::new();
    for a in 0..=parts {
        if corners == 2 {
            shares.push(vec![part(a), part(parts - a)]);
            continue;
        }
        for b in 0..=parts - a {
            shares.push(vec![part(a), part(b), part(parts - a - b)]);
        }
    }
    shares
}

/// The fields of a model about a site.
struct LocalFields {
    place: LocalField,
    levels: Vec<(u16, LocalField)>,
}

impl LocalFields {
    /// A node, with what is predicted there.
    fn node(&self, span: &Span, places: &[ModelPlace], step_m: f64) -> IndexedPlace {
        let (weights, across_m2) = self.place.at(&span.at);
        let position = self.place.position(&weights, places);
        let corners = || span.corners.iter().map(|corner| &places[*corner as usize]);
        let nearest = corners().min_by(|a, b| {
            let apart = |place: &ModelPlace| (place.position_m - span.at).norm();
            apart(a).total_cmp(&apart(b))
        });
        let field_m = NODE_FIELD * step_m;
        let level = |(channel, local): &(u16, LocalField)| local.memory(&span.at, *channel, places);
        let normals: Vector3<f64> = corners().map(|place| place.normals / place.count).sum();
        IndexedPlace {
            position,
            normal: nalgebra::Unit::try_new(normals, 1e-9),
            variance_m2: field_m * field_m + across_m2,
            prediction: Some(Prediction {
                error_m: across_m2.sqrt(),
                across: self.place.across(&span.at, step_m, places),
                bend_m2: field_m * field_m,
            }),
            levels: self.levels.iter().filter_map(level).collect(),
            descriptors: nearest.map_or_else(Vec::new, |place| place.descriptors.clone()),
        }
    }
}
