//! One method per kind of sample. Each takes the system's clock as the stamp, the `_at` variant a
//! stamp of the sensor's clock \[ns\]; use one of the two clocks throughout a session, because
//! stamps never run backwards within it.
//!
//! Every method returns the sample's sequence number and fails as [`Robot::send`] does.

use cogmap_proto::{
    Descriptor, Increment, Level, Marker, Relation, Sample, SampleBody, Sighting, StartPose,
    Target, Velocity,
};

use crate::error::ClientError;
use crate::robot::Robot;

impl Robot {
    fn send_at(&self, stamp_ns: i64, body: SampleBody) -> Result<u64, ClientError> {
        self.send(Sample { stamp_ns, body })
    }

    /// Tells where the agent stands in `map`: position \[m\] and orientation, a unit quaternion
    /// `[x, y, z, w]`, both taken as exact.
    ///
    /// # Errors
    /// As [`Robot::send`].
    pub fn start_pose(
        &self,
        translation_m: [f64; 3],
        rotation_xyzw: [f64; 4],
    ) -> Result<u64, ClientError> {
        self.send_now(start_pose(translation_m, rotation_xyzw))
    }

    /// [`Robot::start_pose`] at a stamp \[ns\].
    ///
    /// # Errors
    /// As [`Robot::send`].
    pub fn start_pose_at(
        &self,
        stamp_ns: i64,
        translation_m: [f64; 3],
        rotation_xyzw: [f64; 4],
    ) -> Result<u64, ClientError> {
        self.send_at(stamp_ns, start_pose(translation_m, rotation_xyzw))
    }

    /// Motion as a body twist \[m/s, rad/s\] that was held for the `duration_s` that end now.
    ///
    /// # Errors
    /// As [`Robot::send`].
    pub fn velocity(
        &self,
        linear_m_s: [f64; 3],
        angular_rad_s: [f64; 3],
        duration_s: f64,
    ) -> Result<u64, ClientError> {
        self.send_now(velocity(linear_m_s, angular_rad_s, duration_s))
    }

    /// [`Robot::velocity`] that ended at a stamp \[ns\].
    ///
    /// # Errors
    /// As [`Robot::send`].
    pub fn velocity_at(
        &self,
        stamp_ns: i64,
        linear_m_s: [f64; 3],
        angular_rad_s: [f64; 3],
        duration_s: f64,
    ) -> Result<u64, ClientError> {
        self.send_at(stamp_ns, velocity(linear_m_s, angular_rad_s, duration_s))
    }

    /// Motion as the body's displacement since the previous motion sample, in the body frame at
    /// its start: translation \[m\] and rotation, a unit quaternion `[x, y, z, w]`.
    ///
    /// # Errors
    /// As [`Robot::send`].
    pub fn increment(
        &self,
        translation_m: [f64; 3],
        rotation_xyzw: [f64; 4],
    ) -> Result<u64, ClientError> {
        self.send_now(increment(translation_m, rotation_xyzw))
    }

    /// [`Robot::increment`] that ended at a stamp \[ns\].
    ///
    /// # Errors
    /// As [`Robot::send`].
    pub fn increment_at(
        &self,
        stamp_ns: i64,
        translation_m: [f64; 3],
        rotation_xyzw: [f64; 4],
    ) -> Result<u64, ClientError> {
        self.send_at(stamp_ns, increment(translation_m, rotation_xyzw))
    }

    /// A scalar felt on a channel, in the channel's unit, at the body's origin.
    ///
    /// # Errors
    /// As [`Robot::send`].
    pub fn level(&self, channel: &str, value: f64) -> Result<u64, ClientError> {
        self.send_now(level(channel, value))
    }

    /// [`Robot::level`] at a stamp \[ns\].
    ///
    /// # Errors
    /// As [`Robot::send`].
    pub fn level_at(&self, stamp_ns: i64, channel: &str, value: f64) -> Result<u64, ClientError> {
        self.send_at(stamp_ns, level(channel, value))
    }

    /// A vector seen on a channel, of 8 to 4096 numbers and not zero.
    ///
    /// # Errors
    /// As [`Robot::send`].
    pub fn descriptor(&self, channel: &str, vector: Vec<f32>) -> Result<u64, ClientError> {
        self.send_now(descriptor(channel, vector))
    }

    /// [`Robot::descriptor`] at a stamp \[ns\].
    ///
    /// # Errors
    /// As [`Robot::send`].
    pub fn descriptor_at(
        &self,
        stamp_ns: i64,
        channel: &str,
        vector: Vec<f32>,
    ) -> Result<u64, ClientError> {
        self.send_at(stamp_ns, descriptor(channel, vector))
    }

    /// A target seen from the body.
    ///
    /// # Errors
    /// As [`Robot::send`].
    pub fn sighting(&self, target: Target, relation: Relation) -> Result<u64, ClientError> {
        self.send_now(SampleBody::Sighting(Sighting { target, relation }))
    }

    /// [`Robot::sighting`] at a stamp \[ns\].
    ///
    /// # Errors
    /// As [`Robot::send`].
    pub fn sighting_at(
        &self,
        stamp_ns: i64,
        target: Target,
        relation: Relation,
    ) -> Result<u64, ClientError> {
        self.send_at(
            stamp_ns,
            SampleBody::Sighting(Sighting { target, relation }),
        )
    }

    /// A named moment; with [`TripMark::Ends`] the trip under way ends here.
    ///
    /// # Errors
    /// As [`Robot::send`].
    pub fn marker(&self, label: &str, trip: TripMark) -> Result<u64, ClientError> {
        self.send_now(marker(label, trip))
    }

    /// [`Robot::marker`] at a stamp \[ns\].
    ///
    /// # Errors
    /// As [`Robot::send`].
    pub fn marker_at(
        &self,
        stamp_ns: i64,
        label: &str,
        trip: TripMark,
    ) -> Result<u64, ClientError> {
        self.send_at(stamp_ns, marker(label, trip))
    }
}

/// What a marker does to the trip under way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TripMark {
    /// The trip goes on.
    GoesOn,
    /// The trip ends.
    Ends,
}

fn start_pose(translation_m: [f64; 3], rotation_xyzw: [f64; 4]) -> SampleBody {
    SampleBody::StartPose(StartPose {
        translation_m,
        rotation_xyzw,
        noise: None,
    })
}

fn velocity(linear_m_s: [f64; 3], angular_rad_s: [f64; 3], duration_s: f64) -> SampleBody {
    SampleBody::Velocity(Velocity {
        linear_m_s,
        angular_rad_s,
        duration_s,
        noise: None,
    })
}

fn increment(translation_m: [f64; 3], rotation_xyzw: [f64; 4]) -> SampleBody {
    SampleBody::Increment(Increment {
        translation_m,
        rotation_xyzw,
        noise: None,
    })
}

fn level(channel: &str, value: f64) -> SampleBody {
    SampleBody::Level(Level {
        channel: channel.to_owned(),
        value,
        offset_m: [0.0; 3],
        normal: None,
    })
}

fn descriptor(channel: &str, vector: Vec<f32>) -> SampleBody {
    SampleBody::Descriptor(Descriptor {
        channel: channel.to_owned(),
        vector,
    })
}

fn marker(label: &str, trip: TripMark) -> SampleBody {
    SampleBody::Marker(Marker {
        label: label.to_owned(),
        ends_trip: trip == TripMark::Ends,
    })
}
