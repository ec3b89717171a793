//! Integrated odometry of the last few seconds.
//!
//! A sighting may arrive after later motions of the agents in it; the history says how far each has
//! moved since its stamp.

use std::collections::VecDeque;

use nalgebra::Isometry3;

use super::tuning::{HISTORY_INTERVAL_NS, HISTORY_LEN};
use geometry::se3;

/// Integrated odometry of an agent's session: its latest pose, and those of the last few seconds.
#[derive(Clone, Debug, Default)]
pub(super) struct OdometryHistory {
    /// Stamps \[ns\] and poses, oldest first.
    pub(super) instants: VecDeque<(i64, Isometry3<f64>)>,
    /// The latest of all, which need not be among them; `None` before the session's first motion.
    pub(super) latest: Option<(i64, Isometry3<f64>)>,
}

impl OdometryHistory {
    /// Pose by motion alone since the session began.
    #[inline]
    pub(super) fn pose(&self) -> Isometry3<f64> {
        self.latest
            .map_or_else(Isometry3::identity, |(_, pose)| pose)
    }

    /// Stamp of the session's latest motion \[ns\].
    #[inline]
    pub(super) fn stamp_ns(&self) -> Option<i64> {
        self.latest.map(|(stamp_ns, _)| stamp_ns)
    }

    /// Integrates a motion.
    pub(super) fn advance(&mut self, stamp_ns: i64, increment: &Isometry3<f64>) {
        let mut pose = self.pose();
        pose *= increment;
        // One Newton step: products of unit quaternions leave the unit sphere by rounding alone.
        pose.rotation.renormalize_fast();
        self.latest = Some((stamp_ns, pose));
        let is_due = |&(last, _): &(i64, _)| stamp_ns.saturating_sub(last) >= HISTORY_INTERVAL_NS;
        if self.instants.back().is_none_or(is_due) {
            if self.instants.len() == HISTORY_LEN {
                self.instants.pop_front();
            }
            self.instants.push_back((stamp_ns, pose));
        }
    }

    /// Forgets everything, as a new session begins.
    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }

    /// Motion from an instant until the latest one; `None` when the instant is too long ago or not
    /// yet over.
    pub(super) fn motion_since(&self, stamp_ns: i64) -> Option<Isometry3<f64>> {
        let (last_ns, last) = self.latest?;
        if stamp_ns == last_ns {
            return Some(Isometry3::identity());
        }
        if stamp_ns > last_ns {
            return None;
        }
        let after = self
            .instants
            .partition_point(|&(stamp, _)| stamp <= stamp_ns);
        let (start_ns, start) = *self.instants.get(after.checked_sub(1)?)?;
        let (end_ns, end) = self.instants.get(after).copied().unwrap_or((last_ns, last));
        if start_ns == stamp_ns || end_ns <= start_ns {
            return Some(start.inv_mul(&last));
        }
        let share = (stamp_ns - start_ns) as f64 / (end_ns - start_ns) as f64;
        let (linear, angular) = se3::log(&start.inv_mul(&end));
        let then = start * se3::exp(&(linear * share), &(angular * share));
        Some(then.inv_mul(&last))
    }
}
