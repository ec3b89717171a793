//! Sequence matches: stretches of views that are similar (cf. `SeqSLAM`, Milford & Wyeth 2012).
//!
//! The similarity of two views says how far apart they were taken. Each channel learns that from
//! views of the last few metres, whose distances are known from motion. A *sequence match* collects
//! pairs of views of two stretches that are more similar than chance would have them. When it is
//! complete, the distances between both stretches are fitted like those of a trilateration, which
//! gives the relative pose of the two as far as they determine it.

mod coarse_copies;
mod memory;
mod range_alignment;
mod sequence_match;
mod track;
mod view_index;

pub(crate) use memory::ViewMemory;
pub(crate) use range_alignment::{Range, align_roughly, equations};
pub(crate) use sequence_match::SequenceMatch;
