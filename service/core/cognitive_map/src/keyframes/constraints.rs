//! The constraints of the keyframe graph, each in the lists of its two keyframes.

use geometry::PoseCovariance;
use nalgebra::Isometry3;
use state::NONE;

use super::constraint::{ClosureState, Constraint};
use super::graph::KeyframeGraph;

impl KeyframeGraph {
    /// Constrains a keyframe to the map.
    pub(super) fn constrain_to_map(
        &mut self,
        keyframe: u32,
        at: Isometry3<f64>,
        covariance: &PoseCovariance,
        state: ClosureState,
    ) {
        let constraint = Constraint {
            from: NONE,
            to: keyframe,
            next_from: NONE,
            next_to: NONE,
            transform: at,
            covariance: *covariance,
            state,
        };
        self.add_constraint(constraint);
    }

    /// Adds a constraint; answers its number, or [`NONE`] if memory is full or an end is gone.
    pub(super) fn add_constraint(&mut self, mut constraint: Constraint) -> u32 {
        let revision = self.revision;
        let (from, to) = (constraint.from, constraint.to);
        let is_there = |number: u32| self.keyframes.get(number).is_some();
        if self.constraints.len() >= self.settings.constraints_max as usize
            || !is_there(to)
            || (from != NONE && !is_there(from))
            || from == to
        {
            return NONE;
        }
        constraint.next_to = self
            .keyframes
            .get(to)
            .map_or(NONE, |keyframe| keyframe.constraints);
        constraint.next_from = self
            .keyframes
            .get(from)
            .map_or(NONE, |keyframe| keyframe.constraints);
        let number = self.constraints.insert(constraint, revision);
        for end in [from, to] {
            if let Some(keyframe) = self.keyframes.get_mut(end, revision) {
                keyframe.constraints = number;
            }
        }
        number
    }

    /// Removes a constraint; answers it.
    pub(super) fn remove_constraint(&mut self, number: u32) -> Option<Constraint> {
        let revision = self.revision;
        let constraint = self.constraints.get(number)?.clone();
        for (end, next) in [
            (constraint.from, constraint.next_from),
            (constraint.to, constraint.next_to),
        ] {
            let Some(keyframe) = self.keyframes.get_mut(end, revision) else {
                continue;
            };
            if keyframe.constraints == number {
                keyframe.constraints = next;
                continue;
            }
            let mut at = keyframe.constraints;
            while let Some(other) = self.constraints.get_mut(at, revision) {
                let follower = if other.from == end {
                    &mut other.next_from
                } else {
                    &mut other.next_to
                };
                if *follower == number {
                    *follower = next;
                    break;
                }
                at = *follower;
            }
        }
        self.constraints.remove(number, revision)
    }

    /// The number of the constraint after another one in the list of a keyframe.
    pub(super) fn next_constraint(&self, number: u32, keyframe: u32) -> u32 {
        self.constraints.get(number).map_or(NONE, |constraint| {
            if constraint.from == keyframe {
                constraint.next_from
            } else {
                constraint.next_to
            }
        })
    }
}
