//! Remembered views, and what their similarity says of the distance between them.

mod channel_model;
mod stored_view;

pub(crate) use channel_model::{ChannelModel, Distance, Kernel, Pairs, ShortText};
pub(crate) use stored_view::{RecentView, SimilarView, StoredView};
