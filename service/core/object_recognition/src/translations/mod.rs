//! Hypotheses where the rotation is one of a few: sums of Gaussians over translations.

mod background;
mod candidates;
mod continuation;
mod gaussian_sum;
mod hypothesis;
mod mass_histogram;
mod merge;
mod prefilter;
mod prefilter_group;
mod second_search;
mod shared_error;
mod split;
mod touch_update;
mod unexplored;
mod unknown_contact;

pub(crate) use background::UnknownLogs;
pub(crate) use gaussian_sum::GaussianSum;
pub(crate) use hypothesis::{Falls, TranslationHypothesis};
