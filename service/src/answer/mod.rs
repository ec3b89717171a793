//! Questions: whom they name, and what the map answers. Each is read by [`decode`],
//! asked, and its answer written by [`encode`]; HTTP and Zenoh ask alike.

mod named;
mod route;
mod sequence;

pub use named::{agent_named, agent_once_named, any_space_named, nobody_named, space_named};
pub use route::{errand_in, route, route_in};
pub use sequence::{sequence, sequence_in};

use cogmap_proto::{
    AgentObject, EndedEpisode, FeltAnswer, FeltQuery, PredictAnswer, PredictQuery, RecallAnswer,
    RecallQuery,
};
use cognitive_map::{AgentId, CognitiveMap};

use crate::decode::{self, InvalidPrediction, InvalidQuery};
use crate::encode;

/// The places of a space that answer a query.
///
/// # Errors
/// Says which rule the query breaks, or that an agent or channel in it is unknown.
pub fn recall(
    space: &str,
    map: &CognitiveMap,
    query: &RecallQuery,
) -> Result<RecallAnswer, InvalidQuery> {
    let cue = decode::cue(map, query)?;
    let recalled = map.recall(&cue);
    let rivals = { recalled.first() }.and_then(|best| map.rivals(&cue, best));
    Ok(encode::recall(space, map, recalled, rivals.as_ref()))
}

/// What was felt near a point of a space, and who was there.
///
/// # Errors
/// Says which rule the query breaks, or that a channel in it is unknown.
pub fn felt(
    space: &str,
    map: &CognitiveMap,
    query: &FeltQuery,
) -> Result<FeltAnswer, InvalidQuery> {
    let cue = decode::felt(map, query)?;
    Ok(encode::felt(space, map, &map.felt(&cue)))
}

/// What an agent would feel if it moved so.
///
/// # Errors
/// Says which rule the query breaks, or that the agent is not placed.
pub fn predict(
    space: &str,
    map: &CognitiveMap,
    agent: AgentId,
    query: &PredictQuery,
) -> Result<PredictAnswer, InvalidPrediction> {
    let cue = decode::prediction(map, query)?;
    let predicted = map.predict(agent, &cue.motion, &cue.offset_m, cue.channel.as_ref());
    let (predicted, agent) = predicted
        .zip(map.agent(agent))
        .ok_or(InvalidPrediction::NotPlaced)?;
    Ok(encode::prediction(
        space,
        map,
        agent.name().as_str(),
        predicted,
    ))
}

/// The episode of an agent, and the latest one that has ended.
pub fn agent_object(
    space: &str,
    map: &CognitiveMap,
    agent: AgentId,
    name: &str,
    last: Option<EndedEpisode>,
) -> AgentObject {
    let episode = map.episode(agent);
    let said = (episode.as_ref(), map.episode_contacts(agent));
    encode::agent_object(space, map, name, said, last)
}

#[cfg(test)]
mod tests;
