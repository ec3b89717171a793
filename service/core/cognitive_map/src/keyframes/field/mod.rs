//! What is to be seen where, by what was seen about there; and where somebody is, by what they see.

mod neighbourhood;
mod scene;
mod whole;

pub(super) use neighbourhood::{Neighbourhood, Seen};
/// Views with the numbers of their channels.
pub(super) type Views<'a> = Vec<(u8, Seen<'a>)>;

pub(super) use scene::{Evidence, Glimpse, Prior, Scene, Settled, together, told, weighed};
pub(super) use whole::Laid;
