//! The log engine: the journal of one space in files of its own.
//!
//! Blocks are appended as frames to segments, each with one system call and without a copy. A
//! damage takes the blocks that it lies in and no others: what a block's bytes should be is in its
//! header, and the next header is found again by its own check. Nothing of the journal is kept in
//! memory.

mod appender;
mod frame;
mod mark;
mod reader;
mod segment;
mod survey;

#[cfg(test)]
mod tests;

pub(super) use appender::{Pending, SpaceLog};
pub use mark::Extent;
pub(super) use mark::{create as create_mark, read as read_mark};
pub use reader::Damage;
pub(super) use reader::{Item, LogReader};
pub use segment::Flaw;
pub(super) use segment::file_name as segment_name;
pub use survey::Survey;
