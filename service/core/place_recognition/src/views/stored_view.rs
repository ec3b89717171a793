//! A remembered view.

use nalgebra::{Isometry3, Point3};

use super::channel_model::Distance;
use crate::keyframes::SampleKey;
use state::{Counted, state_of_struct};

/// A view as it is remembered.
#[derive(Clone, Debug)]
pub(crate) struct StoredView {
    /// Number of the channel.
    pub(crate) channel: u8,
    pub(crate) sample: SampleKey,
    /// Its number among the agent's views of the channel.
    pub(crate) ordinal: u32,
    /// Pose by motion alone since the session began.
    pub(crate) in_odom: Isometry3<f64>,
    /// Position in the map when it was stored.
    pub(crate) in_map: Point3<f64>,
    /// Uncertainty then: roots of the traces of the covariances of position and rotation \[m,
    /// rad\].
    pub(crate) spread: [f64; 2],
    /// The descriptor, a unit vector.
    pub(crate) vector: Box<[f32]>,
}

impl StoredView {
    /// Whether it is of the same agent and session as a sample, and not earlier.
    pub(crate) fn is_since(&self, since: SampleKey) -> bool {
        let own = self.sample;
        (own.agent, own.session) == (since.agent, since.session) && own.seq >= since.seq
    }
}

state_of_struct!(SampleKey {
    agent,
    session,
    seq
});

state_of_struct!(StoredView {
    channel,
    sample,
    ordinal,
    in_odom,
    in_map,
    spread,
    vector as Counted<u16>,
});

/// A remembered view that is similar to a query, and their distance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SimilarView {
    pub(crate) sample: SampleKey,
    pub(crate) distance: Distance,
}

state_of_struct!(SimilarView { sample, distance });

/// One of an agent's latest views.
#[derive(Clone, Debug)]
pub(crate) struct RecentView {
    pub(crate) in_odom: Isometry3<f64>,
    pub(crate) vector: Box<[f32]>,
}

state_of_struct!(RecentView {
    in_odom,
    vector as Counted<u16>,
});
