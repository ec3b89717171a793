//! Woken up elsewhere: an agent that does not know where it is finds itself in what the team has seen.
//!
//! It gathers *looks*: views with where it was by motion alone. How alike a look is to a remembered view says how far apart
//! they were taken (as for [`revisit`](super::revisit)), so that every look is a trilateration. From places that several looks
//! point to, poses of the agent in the map are begun ([`birth`]) and laid to rest among all distances. What counts for a pose is
//! not how many views are like the looks, but that along its way nothing contradicts it ([`scene`]): where the map is thin it
//! says nothing. A pose is believed when no place elsewhere explains the looks about as well. Where exactly that is, all looks at
//! once say, and the map must know it surely enough look by look, too ([`places`]).

mod astray;
mod birth;
mod doubt;
mod places;
mod positions;
mod problem;
mod relocalise;
mod scene;
mod search;

pub(super) use doubt::Doubts;
pub use relocalise::{Guess, Relocalised};
pub(super) use search::Searches;
