//! What a relaxation of the keyframe graph comes to.

use nalgebra::Isometry3;
use place_recognition::{LearnedChannel, ViewLog, ViewMap, ViewMatch};

use super::agent_track::AgentTrack;
use super::constraint::{ClosureState, Constraint};
use super::graph::KeyframeGraph;
use super::keyframe::Keyframe;
use super::live_estimates::LiveEstimates;
use super::relaxation::Correction;
use super::tuning;
use crate::estimator::ExternalEstimate;
use geometry::is_somewhere;
use state::{CorruptState, Digest, NONE, State, StateReader, StateWriter};
use state::{read_list, state_of_struct, write_list};

/// What a relaxation changes in the graph that it is of. A pure function of that graph.
#[derive(Clone, Debug, Default)]
pub(super) struct RelaxationOutcome {
    /// The keyframes that lie elsewhere, by number, with their poses in the map.
    pub(super) poses: Vec<(u32, Isometry3<f64>)>,
    /// The closures that are in another state, by number.
    pub(super) states: Vec<(u32, ClosureState)>,
    /// The agents whose odometry has another noise than it had, with the factors of their
    /// rotations' noise.
    pub(super) turn_noises: Vec<(u32, f64)>,
    /// The matches of views, if they have changed.
    pub(super) matches: Option<Vec<ViewMatch>>,
    /// What was learned of the channels of views, if that has changed.
    pub(super) learned: Option<Vec<LearnedChannel>>,
    /// The views of the channels where they lie now, if that or what was learned has changed.
    pub(super) view_maps: Option<Vec<ViewMap>>,
    /// The poses of the agents, as they were in the graph.
    pub(super) corrections: Vec<Correction>,
}

impl RelaxationOutcome {
    /// Of a graph, of the views that are to be matched, and of the live estimates.
    pub(super) fn of(graph: &KeyframeGraph, views: Option<&ViewLog>, live: &LiveEstimates) -> Self {
        let mut relaxed = graph.clone();
        let corrections = relaxed.relax_matched(views, live);
        let moved = |(number, is): (u32, &Keyframe)| {
            let was = graph.chains.keyframes.get(number)?;
            let is_moved = (was.pose, was.is_in_map) != (is.pose, is.is_in_map);
            (is.is_in_map && is_moved).then_some((number, is.pose))
        };
        let judged = |(number, is): (u32, &Constraint)| {
            let was = graph.constraints.slab.get(number)?;
            (was.state != is.state).then_some((number, is.state))
        };
        let learned = |(agent, (was, is)): (u32, (&AgentTrack, &AgentTrack))| {
            (was.turn_noise.to_bits() != is.turn_noise.to_bits()).then_some((agent, is.turn_noise))
        };
        let tracks = { graph.chains.tracks.iter() }.zip(relaxed.chains.tracks.iter());
        let are_new = relaxed.matches != graph.matches;
        let view_maps = relaxed.located_view_maps();
        let turn_noises = (0..).zip(tracks).filter_map(learned).collect();
        Self {
            turn_noises,
            poses: { relaxed.chains.keyframes.iter() }
                .filter_map(moved)
                .collect(),
            states: { relaxed.constraints.slab.iter() }
                .filter_map(judged)
                .collect(),
            matches: are_new.then(|| relaxed.matches.to_vec()),
            learned: (relaxed.learned != graph.learned).then(|| relaxed.learned.to_vec()),
            view_maps: (!view_maps.iter().eq(graph.view_maps.iter())).then_some(view_maps),
            corrections,
        }
    }

    /// Whether it changes nothing.
    pub(super) fn is_empty(&self) -> bool {
        self.poses.is_empty()
            && self.states.is_empty()
            && self.turn_noises.is_empty()
            && self.matches.is_none()
            && self.view_maps.is_none()
            && self.corrections.is_empty()
    }

    /// The pose that it gives a keyframe, if it moves it.
    pub(super) fn pose(&self, keyframe: u32) -> Option<Isometry3<f64>> {
        let at = self.poses.binary_search_by_key(&keyframe, |pose| pose.0);
        Some(self.poses[at.ok()?].1)
    }

    /// Equal outcomes have equal digests.
    pub(super) fn digest(&self) -> Digest {
        let mut out = StateWriter::default();
        self.write(&mut out);
        out.digest()
    }

    /// Whether one that was read from a checkpoint of a graph with so many agents is sound.
    pub(super) fn is_sound(&self, agents: usize) -> bool {
        let is_pose = |pose: &Isometry3<f64>| {
            is_somewhere(&pose.translation.vector)
                && pose.rotation.coords.iter().all(|x| x.is_finite())
        };
        let is_correction = |correction: &Correction| {
            (correction.agent as usize) < agents && is_pose(&correction.estimate.pose)
        };
        let is_noise = |one: &(u32, f64)| {
            (one.0 as usize) < agents && tuning::TURN_NOISE_BOUNDS.contains(&one.1)
        };
        self.poses.is_sorted_by(|a, b| a.0 < b.0)
            && self.poses.iter().all(|(_, pose)| is_pose(pose))
            && self.matches.iter().flatten().all(ViewMatch::is_sound)
            && self.learned.iter().flatten().all(LearnedChannel::is_sound)
            && self.turn_noises.iter().all(is_noise)
            && self.corrections.iter().all(is_correction)
    }
}

state_of_struct!(Correction { agent, estimate });
state_of_struct!(ExternalEstimate {
    pose,
    covariance,
    calibration,
    prevails
});

impl State for RelaxationOutcome {
    fn write(&self, out: &mut StateWriter) {
        write_list(self.poses.iter(), out);
        write_list(self.states.iter(), out);
        write_list(self.turn_noises.iter(), out);
        self.matches.write(out);
        self.learned.write(out);
        self.view_maps.write(out);
        write_list(self.corrections.iter(), out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        // Each list is as long as the bytes that follow; their number is bounded by the graph's.
        let (poses, states) = (read_list(input, NONE)?, read_list(input, NONE)?);
        let turn_noises = read_list(input, NONE)?;
        let (matches, learned) = State::read(input)?;
        let view_maps = State::read(input)?;
        Ok(Self {
            poses,
            states,
            turn_noises,
            matches,
            learned,
            view_maps,
            corrections: read_list(input, NONE)?,
        })
    }
}
