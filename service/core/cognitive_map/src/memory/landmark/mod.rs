//! Landmarks: things seen from several poses, whose positions are learned, never assumed.

mod map;

use nalgebra::{Matrix3, Point3};

pub(crate) use map::LandmarkMap;

use crate::estimator::Observers;
use crate::input::Label;
use state::{state_of_newtype, state_of_struct};

/// A position with its covariance, both in `map`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PositionEstimate {
    /// Position \[m\].
    pub(crate) position: Point3<f64>,
    /// Covariance \[m²\], exactly symmetric.
    pub(crate) covariance: Matrix3<f64>,
}

state_of_struct!(PositionEstimate {
    position,
    covariance
});

/// A landmark, counted from 0 in the order of learning.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LandmarkId(pub u32);

/// A landmark.
#[derive(Clone, Debug, PartialEq)]
pub struct Landmark {
    label: Label,
    estimate: PositionEstimate,
    sightings: u64,
    first_stamp_ns: i64,
    last_stamp_ns: i64,
    observers: Observers,
}

state_of_struct!(Landmark {
    label,
    estimate,
    sightings,
    first_stamp_ns,
    last_stamp_ns,
    observers
});

impl Landmark {
    /// A landmark seen for the first time.
    pub(crate) fn learn(
        label: Label,
        estimate: PositionEstimate,
        stamp_ns: i64,
        observers: Observers,
    ) -> Self {
        Self {
            label,
            estimate,
            sightings: 1,
            first_stamp_ns: stamp_ns,
            last_stamp_ns: stamp_ns,
            observers,
        }
    }

    /// The landmark was seen again, by an agent of this number.
    pub(crate) fn see(&mut self, stamp_ns: i64, agent: u32) {
        self.sightings += 1;
        self.observers.note(agent);
        // The clocks of two agents may differ, so a later sighting may carry an earlier stamp.
        self.last_stamp_ns = self.last_stamp_ns.max(stamp_ns);
    }

    /// It was also seen as often as another one, which is the same.
    pub(crate) fn join(&mut self, other: &Self) {
        self.sightings = self.sightings.saturating_add(other.sightings);
        self.first_stamp_ns = self.first_stamp_ns.min(other.first_stamp_ns);
        self.last_stamp_ns = self.last_stamp_ns.max(other.last_stamp_ns);
        self.observers.join(&other.observers);
    }

    /// The agents that have seen it.
    pub(crate) fn observers(&self) -> &Observers {
        &self.observers
    }

    /// Label.
    pub fn label(&self) -> &Label {
        &self.label
    }

    /// Position in `map` \[m\].
    pub fn position(&self) -> &Point3<f64> {
        &self.estimate.position
    }

    /// Covariance of the position, along the axes of `map` \[m²\].
    pub fn covariance(&self) -> &Matrix3<f64> {
        &self.estimate.covariance
    }

    /// Times it was seen.
    pub fn sightings(&self) -> u64 {
        self.sightings
    }

    /// Stamp of the first sighting \[ns\].
    pub fn first_stamp_ns(&self) -> i64 {
        self.first_stamp_ns
    }

    /// Latest stamp of a sighting \[ns\].
    pub fn last_stamp_ns(&self) -> i64 {
        self.last_stamp_ns
    }
}

state_of_newtype!(LandmarkId);
