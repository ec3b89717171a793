//! The fields of a model: its surface and its levels, as its own places tell them.

use super::body::Body;
use super::field::{Field, FieldOf, LeftOut, LocalField, Site};
use super::graph::LinkGraph;
use super::neighbours::Neighbours;
use super::sides::Sides;
use super::spread::Spread;
use super::tuning::{BETWEEN_MIN, BODY_NATS, KRIGING_SURFACE, NODES_MAX, PREDICTED_NATS};
use crate::model::ModelPlace;

/// The fields of a model.
pub(crate) struct Fields {
    pub(super) surface: Surface,
    levels: Vec<(u16, Field)>,
}

/// What tells where the surface lies between the places.
pub(super) enum Surface {
    /// The places around.
    Local {
        place: Field,
        neighbours: Neighbours,
    },
    /// A body through all of them.
    Body(Box<Body>),
}

/// The fields of a model by what lies between its places, each as far as it has any.
#[derive(Default)]
pub(crate) struct FieldVariants {
    /// As the places tell for certain. None where neighbours tell little of one another, so that
    /// between them may be anything, or nothing; and of models that have too few or so many places
    /// that nothing lies between.
    pub(crate) places: Option<Fields>,
    /// Of a body, where it is uncertain whether more than the places can be felt.
    pub(crate) body: Option<Fields>,
}

impl FieldVariants {
    /// Of places with these links and a spacing \[m\], on which contacts fall so. Where they are
    /// dense, nothing lies between them; what lies beyond follows.
    pub(crate) fn learned(
        places: &[ModelPlace],
        graph: &LinkGraph,
        (spread, spacing_m): (Spread, f64),
    ) -> Self {
        let is_finite = graph.longest_m.is_finite() && graph.longest_m > 0.0;
        if !(BETWEEN_MIN..NODES_MAX).contains(&places.len()) || !is_finite {
            return Self::default();
        }
        let mut channels: Vec<u16> = { places.iter() }
            .flat_map(|place| place.levels.iter().map(|level| level.channel))
            .collect();
        channels.sort_unstable();
        channels.dedup();
        let anywhere = Neighbours::Near.left_out(places, graph);
        let level = |channel| {
            let field = Field::learned(FieldOf::Level(channel), &anywhere, places, graph)?;
            Some((channel, field.1))
        };
        let levels: Vec<(u16, Field)> = channels.into_iter().filter_map(level).collect();
        let told = levels
            .iter()
            .map(|(_, field)| field.predicted_nats(&anywhere, places));
        let told_nats = told.fold(f64::INFINITY, f64::min);
        let are_told = told_nats >= PREDICTED_NATS;
        // Nothing lies between places on which contacts fall alone.
        if !are_told && spread != Spread::Even {
            return Self::default();
        }
        let body = Surface::body(places, graph, spacing_m);
        if are_told {
            let surface = Surface::learned(&anywhere, places, graph, body);
            let places = surface.map(|surface| Fields { surface, levels });
            return Self { places, body: None };
        }
        // Who touches chosen points may do so again: between these nothing is felt.
        let surface = body.and_then(|body| Surface::learned(&anywhere, places, graph, Some(body)));
        let body = surface.filter(|surface| matches!(surface, Surface::Body(_)));
        Self {
            places: None,
            body: body.map(|surface| Fields { surface, levels }),
        }
    }
}

impl Fields {
    /// The body through all places, if it tells where the surface lies.
    pub(crate) fn body(&self) -> Option<&Body> {
        match &self.surface {
            Surface::Body(body) => Some(body),
            Surface::Local { .. } => None,
        }
    }

    /// Where the surface lies about a site, as the places near it tell, nearest first; none of a
    /// body.
    pub(super) fn place_around(
        &self,
        site: &Site,
        near: &[u32],
        places: &[ModelPlace],
    ) -> Option<LocalField> {
        let Surface::Local { place, neighbours } = &self.surface else {
            return None;
        };
        place.around(site, &neighbours.of_site(places, site, near), places)
    }

    /// The levels about a site, by channel, as the places near it tell, nearest first.
    pub(super) fn levels_around(
        &self,
        site: &Site,
        near: &[u32],
        places: &[ModelPlace],
    ) -> Vec<(u16, LocalField)> {
        let level = |(channel, field): &(u16, Field)| {
            let local = field.around(site, near, places)?;
            Some((*channel, local))
        };
        self.levels.iter().filter_map(level).collect()
    }
}

impl Surface {
    /// The body through places, if all of it was felt, and the log-likelihood of a place, each
    /// predicted by the others. None is sought where they are dense.
    fn body(places: &[ModelPlace], graph: &LinkGraph, spacing_m: f64) -> Option<(f64, Body)> {
        if graph.is_dense(spacing_m) {
            return None;
        }
        let body = Body::fitted(places, graph, spacing_m);
        body.filter(|(_, body)| body.is_felt_all_over(places))
    }

    /// The surface that tells the places best, each by the others: this body, or what is around.
    fn learned(
        anywhere: &[LeftOut],
        places: &[ModelPlace],
        graph: &LinkGraph,
        body: Option<(f64, Body)>,
    ) -> Option<Self> {
        let (log, place) = Field::learned(FieldOf::Place, anywhere, places, graph)?;
        // Edges are supposed where places follow better from those on their own side, and bends of
        // a curve where they do from those before and after.
        let other = if graph.is_curve() {
            Some(Neighbours::InRow)
        } else {
            Sides::new(places, graph).map(Neighbours::OnSide)
        };
        let other = other.and_then(|neighbours| {
            let left_out = neighbours.left_out(places, graph);
            let (own, place) = Field::learned(FieldOf::Place, &left_out, places, graph)?;
            (own > log).then_some((own, place, neighbours))
        });
        let (log, place, neighbours) = other.unwrap_or((log, place, Neighbours::Near));
        let count = places.len() as f64;
        let body = body.filter(|(own, _)| count * (own - log) > BODY_NATS);
        Some(match body {
            Some((_, body)) => Self::Body(Box::new(body)),
            None => Self::Local { place, neighbours },
        })
    }
}

/// The places about a site, nearest first.
pub(super) fn near(site: &Site, places: &[ModelPlace]) -> Vec<u32> {
    let apart = |place: &ModelPlace| (place.position_m - site.middle).norm();
    let near = places.iter().map(apart).zip(0u32..);
    let mut near: Vec<(f64, u32)> = near.collect();
    let order = |a: &(f64, u32), b: &(f64, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
    let most = 2 * KRIGING_SURFACE;
    if near.len() > most {
        near.select_nth_unstable_by(most, order);
        near.truncate(most);
    }
    near.sort_unstable_by(order);
    near.into_iter().map(|(_, number)| number).collect()
}
