//! Agents whose sightings contradict the estimate.
//!
//! An agent's *doubt* counts, in halves, its refused sightings and by half those that are taken in
//! but do not fit, less those that fit.
//!
//! - From [`DOUBT_MIN`] on the agent is doubted: its sightings correct itself alone, and sightings
//!   of it correct only it, as in a Schmidt-Kalman filter.
//! - At [`DOUBT_MAX`] it is *set aside*: it begins anew in a frame of its own, and landmarks that
//!   only it has seen are hidden from the others. An agent whose pose may be anywhere is set aside
//!   at once.
//! - It returns to the map as a newcomer does: by landmarks that lie as the map has them, or by a
//!   start pose. It then has the doubt [`DOUBT_ON_RETURN`]; once that is zero, its landmarks count
//!   again.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Isometry3, Matrix6};

use super::agent_filter::AgentFilter;
use super::agent_slot::{AgentState, Detached};
use super::effect::Effect;
use super::frame::{Frame, LandmarkState};
use super::joint::{Estimator, MAP};
use super::observers::Observers;
use super::recent_sightings::RecentSightings;
use super::tuning::{
    DOUBT_BY_OUTLIER, DOUBT_BY_SIGHTING, DOUBT_MAX, DOUBT_MIN, DOUBT_ON_RETURN, DOUBT_TO_SEARCH,
    POSITION_SD_MAX_M,
};
use crate::input::Label;
use geometry::is_somewhere;

impl AgentState {
    /// Whether its sightings contradict the estimate, so that they correct the agent alone.
    pub(super) fn is_doubted(&self) -> bool {
        self.doubt >= DOUBT_MIN
    }

    /// A sighting was refused; `is_confirmed` says whether its target is known to be where it was
    /// expected.
    pub(super) fn refuse(&mut self, is_confirmed: bool) {
        self.refused += u32::from(is_confirmed || self.doubt >= DOUBT_TO_SEARCH);
        self.doubt = (self.doubt + DOUBT_BY_SIGHTING).min(DOUBT_MAX);
    }

    /// A sighting was taken in; `fits` says whether all of its components are about where they were
    /// expected.
    pub(super) fn accept(&mut self, fits: bool) {
        self.refused = 0;
        self.doubt = if fits {
            self.doubt.saturating_sub(DOUBT_BY_SIGHTING)
        } else {
            (self.doubt + DOUBT_BY_OUTLIER).min(DOUBT_MAX)
        };
    }
}

impl Frame {
    /// The components that a sighting of a landmark corrects.
    pub(super) fn corrected_by(&self, observer: usize) -> Range<usize> {
        if self.members[observer].state.is_doubted() {
            self.members[observer].components()
        } else {
            self.covariance.all()
        }
    }

    /// The components that a sighting of another member corrects, and whether it speaks for or
    /// against the observer.
    pub(super) fn corrected_between(&self, observer: usize, target: usize) -> (Range<usize>, bool) {
        let is_doubted = |index: usize| self.members[index].state.is_doubted();
        match (is_doubted(observer), is_doubted(target)) {
            (false, false) => (self.covariance.all(), true),
            (false, true) => (self.members[target].components(), false),
            (true, _) => (self.members[observer].components(), true),
        }
    }

    /// Whether a landmark's position is out of bounds or of unbounded variance.
    fn is_nowhere(&self, landmark: &LandmarkState) -> bool {
        let axes = landmark.offset..landmark.offset + 3;
        let variance: f64 = axes.map(|k| self.covariance.variance(k)).sum();
        !(is_somewhere(&landmark.position.coords) && variance <= POSITION_SD_MAX_M.powi(2))
    }
}

impl Estimator {
    /// Whether an agent is in the map, or was there when it was set aside.
    pub fn has_been_in_map(&self, agent: u32) -> bool {
        self.is_in_map(agent) || self.is_aside(agent)
    }

    /// Whether an agent was set aside because what it said was absurd, and has said nothing since
    /// that fits.
    pub fn is_aside(&self, agent: u32) -> bool {
        self.slot(agent).is_some_and(|slot| slot.is_aside)
    }

    /// Whether an agent's sightings contradict the estimate, or did before it was set aside and
    /// have not fitted since it is back.
    pub fn is_doubted(&self, agent: u32) -> bool {
        self.agent_state(agent).is_some_and(AgentState::is_doubted)
    }

    /// The agents that have seen a landmark of the map that is estimated jointly now.
    pub(crate) fn observers_of(&self, label: &Label) -> Option<&Observers> {
        Some(&self.frame(MAP).landmarks.get(label)?.observers)
    }

    /// Whether a landmark of a frame was seen only by others that are set aside: then it is not
    /// there for this agent.
    pub(super) fn is_aside_for(&self, agent: u32, number: usize, label: &Label) -> bool {
        let frame = self.frame(number);
        let is_other = |other: u32| other != agent && self.is_aside(other);
        match frame.landmarks.get(label) {
            Some(landmark) => landmark.observers.are_all(is_other),
            None => frame
                .archive
                .get(label)
                .and_then(|landmark| landmark.only)
                .is_some_and(is_other),
        }
    }

    /// Whether an agent was set aside for its refused sightings, and not for its covariance alone.
    pub(super) fn was_contradicted(&self, agent: u32) -> bool {
        let slot = self.slot(agent);
        slot.is_some_and(|slot| slot.is_aside && slot.evidence.refused > 0)
    }

    /// The doubt with which an agent comes back to the map.
    pub(super) fn doubt_of_return(&self, agent: u32) -> u32 {
        if self.was_contradicted(agent) {
            return DOUBT_ON_RETURN;
        }
        let doubt = self.agent_state(agent).map_or(0, |known| known.doubt);
        doubt.min(DOUBT_MIN)
    }

    /// Sets an agent aside if its evidence is absurd, and lets one be again whose evidence fits.
    pub(super) fn judge_evidence(&mut self, agent: u32, effects: &mut Vec<Effect>) {
        let Some((slot, state)) = self.slot(agent).zip(self.agent_state(agent)) else {
            return;
        };
        if state.doubt >= DOUBT_MAX {
            self.set_aside(agent, effects);
        } else if slot.is_aside && slot.frame == MAP && state.doubt == 0 {
            self.slot_mut(agent).is_aside = false;
        }
    }

    /// Sets those members of a frame aside whose poses say nothing, and forgets such landmarks.
    pub(super) fn sweep(&mut self, number: usize, effects: &mut Vec<Effect>) {
        let frame = self.frame(number);
        let members = frame.members.iter();
        let lost = members.filter(|member| member.filter().is_nowhere());
        let lost: Vec<u32> = lost.map(|member| member.agent).collect();
        let landmarks = frame.landmarks.iter();
        let nowhere = landmarks.filter(|(_, landmark)| frame.is_nowhere(landmark));
        let nowhere: Vec<Label> = nowhere.map(|(label, _)| label.clone()).collect();
        for label in nowhere {
            self.frame_mut(number).forget(&label);
        }
        for agent in lost {
            self.set_aside(agent, effects);
        }
    }

    /// Lets an agent begin anew, in a frame of its own.
    pub(super) fn set_aside(&mut self, agent: u32, effects: &mut Vec<Effect>) {
        let Some((from, state)) = self.leave(agent) else {
            return;
        };
        self.depart(from);
        if from != MAP {
            // Its number may become another one's.
            self.frame_mut(from).forget_observer(agent);
        }
        // There are as many frames beside the map's as agents, and the others are in one each at
        // most.
        let empty = (MAP + 1..self.frames.len()).find(|&number| self.frame(number).population == 0);
        let number = empty.unwrap_or(from);
        *self.frame_mut(number) = Frame {
            population: 1,
            ..Frame::default()
        };
        let mut state = Arc::unwrap_or_clone(state);
        // Numbers of landmarks change.
        state.forget_targets();
        let filter = state.filter;
        let mut anew = AgentFilter::new(Isometry3::identity(), &Matrix6::zeros(), &self.parameters);
        anew.history = filter.history;
        anew.is_planar = filter.is_planar;
        anew.noise = filter.noise;
        anew.noise.forget_anchors();
        let state = AgentState {
            filter: anew,
            sensor: state.sensor,
            range_sensor: state.range_sensor,
            // All that they know is relative to the agent.
            ranging: state.ranging,
            recent: RecentSightings::default(),
            refused: 0,
            doubt: 0,
            too_long: 0,
        };
        let slot = self.slot_mut(agent);
        slot.frame = number;
        slot.detached = Some(Detached::new(Arc::new(state)));
        slot.evidence.refused_in_a_row = 0;
        slot.is_aside |= from == MAP;
        self.forget_pending(agent);
        effects.push(Effect::SetAside { agent });
    }

    /// One agent fewer is in a frame.
    pub(super) fn depart(&mut self, from: usize) {
        self.frame_mut(from).population -= 1;
        if from != MAP && self.frame(from).population == 0 {
            // Without an agent no sighting can align this frame any more.
            *self.frame_mut(from) = Frame::default();
            self.forget_cross_sightings(from);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::parameters::Parameters;
    use super::super::tests::{polar, start};
    use super::*;
    use crate::input::{Relation, RelativePosition};
    use nalgebra::{Point3, Vector3};

    fn label(number: usize) -> Label {
        Label::new(&format!("post-{number}")).unwrap()
    }

    /// Where a post is that is seen from the identity.
    fn post(number: usize) -> Point3<f64> {
        let (row, column) = (number / 10, number % 10);
        Point3::new(column as f64 - 4.5, row as f64 + 2.0, 0.0)
    }

    /// Two agents at the identity of the map: one that has seen posts, and one that has seen none.
    fn two(posts: usize) -> (Estimator, u32, u32) {
        let mut estimator = Estimator::new(Parameters::default());
        let (honest, liar) = (estimator.enrol(), estimator.enrol());
        assert!(estimator.found(honest));
        for number in 0..posts {
            see(&mut estimator, honest, number, &post(number));
        }
        estimator.start_pose(liar, &start(&Isometry3::identity(), 0.1), &mut Vec::new());
        (estimator, honest, liar)
    }

    /// A post that is archived.
    fn archived(frame: &Frame) -> usize {
        let archived = (0..100).find(|&number| frame.archive.contains(&label(number)));
        archived.unwrap()
    }

    /// An agent at the identity sees a post where it is or is not.
    fn see(estimator: &mut Estimator, agent: u32, number: usize, at: &Point3<f64>) {
        let relation = polar(&Isometry3::identity(), at);
        estimator.landmark(agent, 0, &label(number), &relation, &mut Vec::new());
    }

    /// An agent sees a post where it cannot be, again and again.
    fn lie(estimator: &mut Estimator, liar: u32, number: usize, times: u32) {
        for _ in 0..times {
            see(estimator, liar, number, &Point3::new(-300.0, -300.0, 0.0));
        }
    }

    #[test]
    fn an_archived_landmark_is_not_moved_by_a_doubted_agent() {
        let (mut estimator, honest, liar) = two(100);
        lie(&mut estimator, liar, 50, DOUBT_MIN / DOUBT_BY_SIGHTING);
        assert!(estimator.is_doubted(liar) && !estimator.is_doubted(honest));
        let number = archived(estimator.frame(MAP));
        let archived = estimator.frame(MAP).archive.get(&label(number)).unwrap();
        let archived = archived.clone();
        let beside = post(number) + Vector3::new(0.7, 0.0, 0.0);
        see(&mut estimator, liar, number, &beside);
        let frame = estimator.frame(MAP);
        let restored = &frame.landmarks[&label(number)];
        assert!((restored.position - archived.position).norm() < 1e-9);
        let lost = archived.covariance - frame.landmark_covariance(restored);
        assert!(lost.amax() < 1e-6 * archived.covariance.amax(), "{lost}");
        let pose = estimator.in_frame(honest).unwrap();
        assert!(pose.translation.vector.norm() < 1e-9);
    }

    /// However soon the settings let errors lose weight, those that a sensor states raise no doubt.
    #[test]
    fn errors_as_large_as_stated_raise_no_doubt() {
        let mut estimator = Estimator::new(Parameters {
            soft: 0.5,
            ..Parameters::default()
        });
        let agent = estimator.enrol();
        assert!(estimator.found(agent));
        let random = &mut random::Seeded(1);
        for seen in 0..400 {
            let number = seen / 2 % 4;
            let off = Vector3::from_fn(|_, _| 0.1 * random.normal());
            let at = post(number).coords + off;
            let seen_at = RelativePosition::new(at.into(), [0.1; 3]).unwrap();
            let relation = Relation::Position(seen_at);
            estimator.landmark(agent, 0, &label(number), &relation, &mut Vec::new());
            assert!(!estimator.is_doubted(agent), "{seen}");
        }
    }

    #[test]
    fn who_was_set_aside_comes_back_on_probation() {
        let (mut estimator, _, liar) = two(10);
        lie(&mut estimator, liar, 5, DOUBT_MAX / DOUBT_BY_SIGHTING);
        assert!(estimator.is_aside(liar) && !estimator.is_in_map(liar));
        let known: Vec<_> = estimator.landmarks().map(|(_, at, _)| at).collect();
        let mut sightings = 0;
        while !estimator.is_in_map(liar) {
            see(&mut estimator, liar, sightings % 10, &post(sightings % 10));
            sightings += 1;
            assert!(sightings < 20, "what it sees lies as the map has it");
        }
        assert!(estimator.is_doubted(liar) && estimator.is_aside(liar));
        let after: Vec<_> = estimator.landmarks().map(|(_, at, _)| at).collect();
        assert_eq!(known, after, "it corrects itself alone");
        for number in 0..(DOUBT_ON_RETURN / DOUBT_BY_SIGHTING) as usize {
            assert!(estimator.is_aside(liar), "{number}");
            see(&mut estimator, liar, number % 10, &post(number % 10));
        }
        assert!(!estimator.is_doubted(liar) && !estimator.is_aside(liar));
        // After a start pose it is doubted no less.
        lie(&mut estimator, liar, 5, 2 * DOUBT_MAX / DOUBT_BY_SIGHTING);
        assert!(estimator.is_aside(liar));
        estimator.start_pose(liar, &start(&Isometry3::identity(), 0.1), &mut Vec::new());
        assert!(estimator.is_in_map(liar) && estimator.is_doubted(liar));
    }

    #[test]
    fn a_number_that_is_given_anew_has_seen_no_archived_landmark() {
        let mut estimator = Estimator::new(Parameters::default());
        let (one, other) = (estimator.enrol(), estimator.enrol());
        for number in 0..100 {
            see(&mut estimator, one, number, &post(number));
        }
        let frame = estimator.frame_of(one).unwrap();
        let number = archived(estimator.frame(frame));
        let only = |estimator: &Estimator| {
            let archive = &estimator.frame(frame).archive;
            archive.get(&label(number)).unwrap().only
        };
        assert_eq!(only(&estimator), Some(one));
        // The other one stays in the frame when the number goes.
        let own = estimator.frame_of(other).unwrap();
        estimator.frame_mut(own).population = 0;
        estimator.slot_mut(other).frame = frame;
        estimator.frame_mut(frame).population += 1;
        estimator.clear(one);
        assert_eq!(only(&estimator), None);
    }
}
