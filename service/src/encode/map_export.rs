//! A whole map as one JSON object, piece by piece.

use std::sync::Arc;

use cogmap_proto::{AgentSummary, SpaceSettings};
use cognitive_map::{CognitiveMap, LandmarkId, PlaceId, TripId};
use serde::Serialize;

use super::agent::estimate;
use super::landmark::landmark;
use super::place::place;
use super::route::way;
use super::space::space_info;
use super::trip::trip_detail;

/// Items that are written at once: an answer of any length takes the memory of this many.
const CHUNK_ITEMS: usize = 256;

/// A list of an export that can be written from any of its items on: their numbers, and them as
/// JSON.
type Section = fn(&CognitiveMap, &[AgentSummary], u32) -> Vec<(u32, String)>;

/// The lists of the map with their names.
const SECTIONS: [(&str, Section); 5] = [
    ("agents", |_, agents, first| {
        let agents = (0..).zip(agents.iter()).skip(first as usize);
        agents
            .take(CHUNK_ITEMS)
            .map(|(at, agent)| (at, text(agent)))
            .collect()
    }),
    ("places", |map, _, first| {
        let places = map.places_from(PlaceId(first)).take(CHUNK_ITEMS);
        places
            .map(|(id, of)| (id.0, text(&place(map, id, of))))
            .collect()
    }),
    ("trips", |map, _, first| {
        // A trip has up to a thousand legs.
        let trips = map.trips_from(TripId(first)).take(1);
        trips
            .map(|(id, trip)| (id.0, text(&trip_detail(map, id, trip))))
            .collect()
    }),
    ("ways", |map, _, first| {
        let ways = map.ways_from(first).take(CHUNK_ITEMS);
        ways.filter_map(|(number, of)| Some((number, text(&way(map, of)?))))
            .collect()
    }),
    ("landmarks", |map, _, first| {
        let known = (first..).map_while(|id| Some((id, map.landmark(LandmarkId(id))?)));
        // One with several names once, and those that are set aside not at all.
        let told = known.filter(|(id, landmark)| {
            let named = map.landmark_by_label(landmark.label().as_str());
            named.is_some_and(|(named, _)| named.0 == *id)
        });
        told.take(CHUNK_ITEMS)
            .map(|(id, of)| (id, text(&landmark(of))))
            .collect()
    }),
];

/// The map as JSON: space, agents, and a list of each memory. Pieces are made when they are asked
/// for.
pub fn map_export(
    space: String,
    settings: SpaceSettings,
    map: Arc<CognitiveMap>,
    agents: Vec<AgentSummary>,
) -> impl Iterator<Item = String> + Send + 'static {
    let head = {
        let map = Arc::clone(&map);
        std::iter::once_with(move || {
            let info = space_info(&space, &settings, &map);
            format!("{{\"space\":{}", text(&info))
        })
    };
    let agents: Arc<[_]> = agents.into();
    let lists = SECTIONS.into_iter().flat_map(move |(name, section)| {
        let (map, agents) = (Arc::clone(&map), Arc::clone(&agents));
        let (mut first, mut separator) = (Some(0), "");
        let items = std::iter::from_fn(move || {
            let (numbers, items): (Vec<_>, Vec<_>) =
                section(&map, &agents, first?).into_iter().unzip();
            // Numbers have gaps where something was forgotten.
            first = numbers.last()?.checked_add(1);
            let written = format!("{separator}{}", items.join(","));
            separator = ",";
            Some(written)
        });
        let open = std::iter::once(format!(",\"{name}\":["));
        open.chain(items).chain(std::iter::once("]".to_owned()))
    });
    head.chain(lists).chain(std::iter::once("}".to_owned()))
}

/// The agents of a map, by name, as it has them. Their term is 0: no owner has published them.
pub fn agent_summaries(space: &str, map: &CognitiveMap) -> Vec<AgentSummary> {
    let agents = map.agents().map(|(id, agent)| AgentSummary {
        name: agent.name().as_str().to_owned(),
        estimate: estimate(space, 0, map, id),
        session_ended: agent.session_ended(),
        heard_ago_s: None,
    });
    let mut agents: Vec<_> = agents.collect();
    agents.sort_by(|a, b| a.name.cmp(&b.name));
    agents
}

fn text<T: Serialize>(message: &T) -> String {
    serde_json::to_string(message).expect("plain data encodes")
}
