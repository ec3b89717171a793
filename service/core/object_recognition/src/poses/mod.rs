//! Hypotheses where the rotation is free: poses with their evidence, several to a model.

mod goodness_of_fit;
mod hypotheses;
mod hypothesis;
mod search;

pub(crate) use hypotheses::PoseHypotheses;
pub(crate) use hypothesis::PoseHypothesis;
