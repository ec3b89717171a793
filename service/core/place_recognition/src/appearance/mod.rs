//! What is expected to be seen where, by the views that were taken about there; and the pose of an
//! agent by what it sees.

mod batch_alignment;
mod descriptor_process;
mod view_alignment;

pub(crate) use batch_alignment::BatchPose;
pub(crate) use descriptor_process::{DescriptorProcess, ReferenceView, ReferenceViews};
pub(crate) use view_alignment::{
    AlignedPose, Evidence, LocalQuery, Prior, ViewAlignment, log_odds, mixture, weighted,
};
