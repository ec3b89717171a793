//! Sequences of places or percepts that are asked about.

use std::ops::RangeInclusive;

use cogmap_proto as wire;
use cogmap_proto::limits::PAGE_ITEMS_MAX;
use cognitive_map::{CognitiveMap, PlaceId, SequenceCue, SequenceElement};

use super::cue::{InvalidQuery, checked_percept};

/// Most elements.
const ELEMENTS_MAX: usize = 64;
/// Share of wrong elements when the query names none.
const ERROR_RATE: f64 = 0.1;
/// Legal ones. With none at all one slip would leave nothing possible.
const ERROR_RATES: RangeInclusive<f64> = 0.001..=0.5;
/// Probability of a sequence that nobody travelled when the query names none.
const NONE_PRIOR: f64 = 0.05;
/// Legal ones.
const NONE_PRIORS: RangeInclusive<f64> = 0.001..=0.999;
/// Places and trips of an answer when the query names no limit.
const LIMIT: u32 = 10;

/// Why a sequence cannot be asked about.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum InvalidSequenceQuery {
    /// A percept or a channel in it breaks a rule or is unknown.
    #[error(transparent)]
    Query(#[from] InvalidQuery),
    /// A number breaks a rule.
    #[error("{0} must be {1}")]
    Number(&'static str, String),
    /// There is no such place.
    #[error("cue[{0}]: the space has no place {1}")]
    UnknownPlace(usize, u64),
    /// The search took too long.
    #[error("the sequence was not recognised in time")]
    GivenUp,
}

/// The cue of a query.
///
/// # Errors
/// Says which rule the query breaks, or what in it is unknown.
pub fn sequence(
    map: &CognitiveMap,
    query: &wire::SequenceQuery,
) -> Result<SequenceCue, InvalidSequenceQuery> {
    let n_elements = query.cue.len();
    if !(1..=ELEMENTS_MAX).contains(&n_elements) {
        let rule = format!("a list of 1 to {ELEMENTS_MAX}, not of {n_elements}");
        return Err(InvalidSequenceQuery::Number("cue", rule));
    }
    let elements = query.cue.iter().enumerate();
    let elements = elements.map(|(at, element)| match element {
        wire::SequenceElement::Place(number) => {
            let place = u32::try_from(*number).ok().map(PlaceId);
            // It may have been forgotten, and trips still lead through it.
            let place = place.filter(|place| (place.0 as usize) < map.places_recruited());
            place
                .map(SequenceElement::Place)
                .ok_or(InvalidSequenceQuery::UnknownPlace(at, *number))
        }
        wire::SequenceElement::Percept(percept) => {
            let percept = checked_percept(map, percept)?;
            Ok(SequenceElement::Percept(percept))
        }
    });
    let limit = query.limit.unwrap_or(LIMIT) as usize;
    if !(1..=PAGE_ITEMS_MAX).contains(&limit) {
        return Err(InvalidQuery::Limit(limit).into());
    }
    Ok(SequenceCue {
        elements: elements.collect::<Result<_, _>>()?,
        error_rate: number("error_rate", query.error_rate, ERROR_RATE, &ERROR_RATES)?,
        none_prior: number("none_prior", query.none_prior, NONE_PRIOR, &NONE_PRIORS)?,
        limit,
    })
}

/// A number, or its default where there is none.
fn number(
    field: &'static str,
    number: Option<f64>,
    default: f64,
    legal: &RangeInclusive<f64>,
) -> Result<f64, InvalidSequenceQuery> {
    let number = number.unwrap_or(default);
    // A comparison with NaN is false.
    if legal.contains(&number) {
        return Ok(number);
    }
    let rule = format!("{} to {}, not {number}", legal.start(), legal.end());
    Err(InvalidSequenceQuery::Number(field, rule))
}
