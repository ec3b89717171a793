//! Sequences: what is asked about, and what the map answers.

use std::sync::Arc;

use cogmap_proto::{SequenceAnswer, SequenceQuery};
use cognitive_map::CognitiveMap;

use crate::decode::{self, InvalidSequenceQuery};
use crate::encode;
use crate::engine::Space;
use crate::problem::Problem;

/// Which trips of a space as it is now a sequence looks like, and what comes next.
///
/// # Errors
/// Says which rule the query breaks, or what in it is unknown; or the space cannot be asked, or not
/// now.
pub async fn sequence_in(
    space: &Arc<Space>,
    query: SequenceQuery,
) -> Result<SequenceAnswer, Problem> {
    let name = space.name().to_owned();
    let found = space.sequence(move |map, gives_up| sequence(&name, map, &query, gives_up));
    Ok(found.await??)
}

/// Which trips a sequence looks like, and what comes next. `gives_up` is asked about now and then.
///
/// # Errors
/// Says which rule the query breaks, or what in it is unknown.
pub fn sequence(
    space: &str,
    map: &CognitiveMap,
    query: &SequenceQuery,
    gives_up: &mut dyn FnMut() -> bool,
) -> Result<SequenceAnswer, InvalidSequenceQuery> {
    let cue = decode::sequence(map, query)?;
    let recalled = map.recall_sequence(&cue, gives_up);
    let recalled = recalled.ok_or(InvalidSequenceQuery::GivenUp)?;
    Ok(encode::sequence(space, map, &recalled))
}
