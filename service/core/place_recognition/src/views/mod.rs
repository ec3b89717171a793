//! Remembered views, and what their likeness says of the distance between them.

mod channel_model;
mod stored_view;

pub(crate) use channel_model::{ChannelModel, Distance, Kernel};
pub(crate) use stored_view::{
    RecentView, SimilarView, StoredView, read_all, read_vector, write_all, write_vector,
};
