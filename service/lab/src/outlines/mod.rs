//! Random objects as people make them: planar outlines with lobes, blobs, boxes, cylinders, frusta,
//! prisms and brackets.
//!
//! A [`Family`] draws [`Solid`]s: a smooth or an edged surface, and a level that varies along it. A
//! solid is taught by a few or many contacts, and touched again along a walk from an unknown start.
//! [`run`] sends both through the fold of a [`CognitiveMap`](cognitive_map::CognitiveMap) with the
//! settings that a new space has, and answers a [`Report`].

mod explore;
mod family;
mod protocol;
mod report;
mod run;
mod solid;

pub use family::{Family, Levels};
pub use protocol::{InvalidOutlineProtocol, OutlineProtocol, Teaching, Turn};
pub use report::{Answers, Report, Row};
pub use run::{drawn_lesson, run};
pub use solid::{Felt, Solid};
