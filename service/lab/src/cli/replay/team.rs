//! Samples of a team in the order in which they are sent, and what is known of its robots.

use std::collections::BTreeMap;

use cogmap_lab::stream::Stream;
use cogmap_proto::Sample;
use nalgebra::Isometry3;
use trajectory::{StampedPose, Trajectory};

/// Name of a robot that is alone.
pub(super) const ROBOT: &str = "robot";

/// Consecutive samples of one robot, in the order in which the team sends.
#[derive(Clone, Debug)]
pub(super) struct TeamBatch {
    pub(super) robot: String,
    pub(super) samples: Vec<Sample>,
}

/// What is known of a robot, whatever a map says.
#[derive(Clone, Debug)]
pub(super) struct Known {
    /// Where its motion alone would have brought it.
    pub(super) reckoned: Vec<StampedPose>,
    /// Where it was.
    pub(super) truth: Option<Trajectory>,
    /// Its true poses, by stamp; none where headings are not known.
    pub(super) true_poses: Vec<StampedPose>,
}

impl Known {
    /// Where motion alone would have brought it, and where it was, its headings not being known.
    pub(super) fn reckoned(reckoned: Vec<StampedPose>, truth: Option<Trajectory>) -> Self {
        Self {
            reckoned,
            truth,
            true_poses: Vec::new(),
        }
    }

    /// Its true pose at a moment, where headings are known.
    pub(super) fn true_pose(&self, stamp_ns: i64) -> Option<Isometry3<f64>> {
        let after = self
            .true_poses
            .partition_point(|pose| pose.stamp_ns <= stamp_ns);
        let before = self.true_poses.get(after.checked_sub(1)?)?;
        if before.stamp_ns == stamp_ns {
            return Some(before.pose);
        }
        Some(before.between(self.true_poses.get(after)?, stamp_ns).pose)
    }
}

/// The robots of one space.
#[derive(Clone, Debug)]
pub(super) struct Team {
    pub(super) space: String,
    pub(super) batches: Vec<TeamBatch>,
    pub(super) robots: BTreeMap<String, Known>,
}

impl Team {
    /// A team that sends these samples in this order, in batches of at most so many.
    pub(super) fn new(
        space: String,
        samples: impl IntoIterator<Item = (String, Sample)>,
        most: usize,
    ) -> Self {
        let mut batches: Vec<TeamBatch> = Vec::new();
        for (robot, sample) in samples {
            match batches.last_mut() {
                Some(last) if last.robot == robot && last.samples.len() < most => {
                    last.samples.push(sample);
                }
                _ => batches.push(TeamBatch {
                    robot,
                    samples: vec![sample],
                }),
            }
        }
        Self {
            space,
            batches,
            robots: BTreeMap::new(),
        }
    }

    /// A robot that is alone.
    pub(super) fn alone(
        space: String,
        robot: &str,
        stream: &Stream,
        truth: Option<Trajectory>,
        most: usize,
    ) -> Self {
        let samples = stream.samples().iter().cloned();
        let mut team = Self::new(
            space,
            samples.map(|sample| (robot.to_owned(), sample)),
            most,
        );
        let reckoned = stream.reckoned().to_vec();
        team.robots
            .insert(robot.to_owned(), Known::reckoned(reckoned, truth));
        team
    }

    /// How many samples a robot sends.
    pub(super) fn samples_of(&self, robot: &str) -> u64 {
        let batches = self.batches.iter().filter(|batch| batch.robot == robot);
        batches.map(|batch| batch.samples.len() as u64).sum()
    }
}
