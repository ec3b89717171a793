//! The fields of a model: its surface and its levels, as its own places tell them.

use super::body::Body;
use super::field::{Field, FieldOf, LeftOut, LocalField, Site};
use super::graph::LinkGraph;
use super::sides::Sides;
use crate::model::ModelPlace;
use crate::tuning::{
    BETWEEN_MIN, BODY_NATS, KRIGING_SURFACE, NODES_MAX, PREDICTED_AT_RANDOM_NATS, PREDICTED_NATS,
    RANDOM_SDS,
};

/// The fields of a model.
pub(crate) struct Fields {
    pub(super) surface: Surface,
    levels: Vec<(u16, Field)>,
}

/// What tells where the surface lies between the places.
pub(super) enum Surface {
    /// The places around.
    Local { place: Field, sides: Sides },
    /// A body through all of them.
    Body(Box<Body>),
}

impl Fields {
    /// `None` where neighbours tell little of one another, so that between them may be anything,
    /// and of models that have too few or so many places that nothing lies between.
    /// Where places are dense, `is_dense`, nothing lies between either; what lies beyond follows.
    pub(crate) fn learned(
        places: &[ModelPlace],
        graph: &LinkGraph,
        is_dense: bool,
    ) -> Option<Self> {
        let is_finite = graph.longest_m.is_finite() && graph.longest_m > 0.0;
        if !(BETWEEN_MIN..NODES_MAX).contains(&places.len()) || !is_finite {
            return None;
        }
        let mut channels: Vec<u16> = { places.iter() }
            .flat_map(|place| place.levels.iter().map(|level| level.channel))
            .collect();
        channels.sort_unstable();
        channels.dedup();
        let anywhere = Sides::none().left_out(places, graph);
        let level = |channel| {
            let field = Field::learned(FieldOf::Level(channel), &anywhere, places, graph)?;
            Some((channel, field.1))
        };
        let levels: Vec<(u16, Field)> = channels.into_iter().filter_map(level).collect();
        let told = levels
            .iter()
            .map(|(_, field)| field.predicted_nats(&anywhere, places));
        let told_nats = told.fold(f64::INFINITY, f64::min);
        let surface = Surface::learned(&anywhere, places, graph, (told_nats, is_dense))?;
        Some(Self { surface, levels })
    }

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
        let Surface::Local { place, sides } = &self.surface else {
            return None;
        };
        place.around(site, &sides.near(places, site, near), places)
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
    /// The surface that tells the places best, each by the others. `told_nats` is how much these
    /// tell of a place's levels. `None` where that is too little. No body is sought where they are
    /// dense, and none is taken of which a part was not felt.
    fn learned(
        anywhere: &[LeftOut],
        places: &[ModelPlace],
        graph: &LinkGraph,
        (told_nats, is_dense): (f64, bool),
    ) -> Option<Self> {
        let are_told = told_nats >= PREDICTED_NATS;
        if told_nats < PREDICTED_AT_RANDOM_NATS {
            return None;
        }
        let body = Some(())
            .filter(|()| !is_dense)
            .and_then(|()| Body::fitted(places, graph));
        let body = body.filter(|(_, body)| body.is_felt_all_over(places));
        // Who touches chosen points may do so again: between these nothing is felt.
        let is_random = |body: &Body| body.regularity(places).abs() < RANDOM_SDS;
        let body = body.filter(|(_, body)| are_told || is_random(body));
        if !are_told && body.is_none() {
            return None;
        }
        let (log, place) = Field::learned(FieldOf::Place, anywhere, places, graph)?;
        // Edges are supposed where places follow better from those on their own side.
        let edged = Sides::new(places, graph).and_then(|sides| {
            let left_out = sides.left_out(places, graph);
            let (own, place) = Field::learned(FieldOf::Place, &left_out, places, graph)?;
            (own > log).then_some((own, place, sides))
        });
        let (log, place, sides) = edged.unwrap_or((log, place, Sides::none()));
        let count = places.len() as f64;
        let body = body.filter(|(own, _)| count * (own - log) > BODY_NATS);
        match body {
            Some((_, body)) => Some(Self::Body(Box::new(body))),
            None => are_told.then_some(Self::Local { place, sides }),
        }
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
