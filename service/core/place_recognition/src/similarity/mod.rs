//! How alike views are as a function of where they were taken, learned for each channel from the
//! views themselves; and which of them are likely to be of one place.

mod centres;
mod learned_channel;
mod log_odds;
mod matching;
mod neighbours;
mod runs;
mod sequence_odds;
mod turned;
mod two_covariance;
mod view_log;

pub use learned_channel::LearnedChannel;
pub use matching::{Similarity, ViewMatch};
pub(crate) use runs::gap;
pub use turned::Turned;
pub(crate) use two_covariance::single;
pub use view_log::ViewLog;
pub(crate) use view_log::{LoggedView, logged};
