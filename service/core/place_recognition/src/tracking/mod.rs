//! Tracking among the views of a map: where an agent that knows about where it is goes on, by
//! what it sees.

mod expected;
mod tracker;
mod view_field;
mod view_map;

pub use tracker::Tracked;
pub(crate) use tracker::Tracker;
pub use view_map::ViewMap;
pub(crate) use view_map::{ReferenceView, SessionCentre, ViewModel};

#[cfg(test)]
mod tests;
