#![doc = include_str!("../README.md")]

mod bytes;
mod codec;
mod digest;
mod macros;
mod matrix;
mod moments;
mod page_version;
mod paged;
mod slab;
mod sparse;
mod summary;
mod teachers;

pub use bytes::{CorruptState, ITEMS_MAX, State, StateReader, StateWriter, read_list, write_list};
pub use codec::{Codec, Counted, Unstored};
pub use digest::{Digest, InvalidDigest};
pub use moments::Moments;
pub use paged::{PagedVec, write_page};
pub use slab::{NONE, Slab, Slot};
pub use sparse::{PageItems, SparseVec};
pub use summary::{Summary, SummaryTree, merged};
pub use teachers::Teachers;
