//! Points near which percepts are asked for.

use cogmap_proto as wire;
use cogmap_proto::limits::{METRES_MAX, PAGE_ITEMS_MAX};
use cognitive_map::{CognitiveMap, FeltCue, Label};

use super::channel::check_channel;
use super::cue::{InvalidQuery, position};

/// Most channels that a query names. Source: as many as a space has.
const CHANNELS_MAX: usize = 64;
/// Places of an answer when the query names no limit.
const LIMIT: u32 = 10;

/// The cue of a query.
///
/// # Errors
/// Says which rule the query breaks, or that a channel in it is unknown.
pub fn felt(map: &CognitiveMap, query: &wire::FeltQuery) -> Result<FeltCue, InvalidQuery> {
    let radius_m = query.radius_m.unwrap_or(map.settings().field_radius_m);
    // A comparison with NaN is false.
    if !(0.0..=METRES_MAX).contains(&radius_m) {
        return Err(InvalidQuery::Radius(radius_m));
    }
    let limit = query.limit.unwrap_or(LIMIT) as usize;
    if !(1..=PAGE_ITEMS_MAX).contains(&limit) {
        return Err(InvalidQuery::Limit(limit));
    }
    let names = query.channels.as_deref();
    if names.is_some_and(|names| !(1..=CHANNELS_MAX).contains(&names.len())) {
        return Err(InvalidQuery::Channels(CHANNELS_MAX));
    }
    let mut channels = Vec::new();
    for (at, name) in names.unwrap_or_default().iter().enumerate() {
        check_channel(map, name).map_err(|error| InvalidQuery::ChannelOfList(at, error))?;
        channels.extend(Label::new(name).ok());
    }
    Ok(FeltCue {
        position: position(query.position_m)?,
        radius_m,
        since_ns: query.since_ns,
        channels,
        limit,
    })
}
