//! What the estimator brings about: kept in the keyframe graph, and applied to landmarks and
//! places.

use nalgebra::Isometry3;

use super::CognitiveMap;
use super::apply::Fold;
use crate::estimator::{AgentSighted, Effect, Estimator, FramesMerged};
use crate::event::{Event, EventKind, LoopsClosed};
use crate::input::{AgentId, Relation};
use crate::keyframes::{LiveEstimates, Moment, Refined, RelaxationJob, ViewChannel, ViewMatch};
use crate::memory::place::PlaceId;
use pose_graph::PoseGraph;

/// Number of the frame that is the map's.
const MAP: usize = 0;

impl Fold<'_> {
    /// The agent at the sample that is being applied.
    pub(super) fn moment(&self) -> Moment {
        let agent = self.agent_id.0;
        let pose = self.estimator.in_frame(agent);
        Moment {
            agent,
            seq: self.agent.next_seq.saturating_sub(1),
            stamp_ns: self.stamp_ns,
            pose: *pose.unwrap_or(self.agent.announced.in_map()),
        }
    }

    /// Applies what the latest call of the estimator brought about to the keyframe graph and the
    /// landmark map.
    pub(super) fn apply_effects(&mut self) {
        let mut effects = std::mem::take(&mut self.effects);
        effects.sort_by_key(Effect::order);
        for effect in effects.drain(..) {
            match effect {
                Effect::SetAside { agent } => self.keyframes.set_aside(agent),
                Effect::Moved { agent, step } => {
                    let (moment, graph) = (self.moment(), &mut self.keyframes.graph);
                    let (increment, variance) = (&step.increment, &step.variance);
                    graph.motion(&moment, increment, variance, &step.calibrated);
                    if step.ends_stand() {
                        graph.end_motion(agent);
                    }
                }
                Effect::LandmarkSighted {
                    label,
                    relation: Relation::Range(range),
                    variance,
                    at,
                    is_new,
                    ..
                } => {
                    let moment = self.moment();
                    let graph = &mut self.keyframes.graph;
                    graph.landmark_range(&moment, &label, &range, variance.x, at);
                    if is_new {
                        graph.found_by_ranges();
                    }
                }
                Effect::LandmarkSighted {
                    label,
                    relation,
                    variance,
                    ..
                } => self
                    .keyframes
                    .graph
                    .landmark(&self.moment(), &label, &relation, &variance),
                Effect::AgentSighted(sighted) => self.agent_sighted(&sighted),
                Effect::LandmarksAssociated(names) => {
                    self.keyframes.graph.merge_landmarks(&names);
                    for (label, name) in &names {
                        self.landmarks.unite(label, name, self.revision);
                    }
                }
                Effect::FramesMerged(merged) => self.frames_merged(&merged),
            }
        }
        self.effects = effects;
    }

    /// Remembers a sighting of an agent that was accepted.
    fn agent_sighted(&mut self, sighted: &AgentSighted) {
        if sighted.accepted {
            self.keyframes.graph.sighted(
                sighted.observer,
                sighted.target,
                sighted.stamp_ns,
                &sighted.relation,
                &sighted.variance.fixed_rows::<3>(0).into_owned(),
            );
        }
    }

    /// Remembers where the frame of some agents lies.
    fn frames_merged(&mut self, merged: &FramesMerged) {
        for &agent in &merged.agents {
            if merged.into == MAP {
                self.keyframes.graph.placed(agent, &merged.pose);
            } else {
                self.keyframes.graph.transformed(agent, &merged.pose);
            }
        }
    }
}

impl Fold<'_> {
    /// Begins to relax the past when enough has come since the last time to pay for it and matches
    /// wait, and with a later record fuses the poses of the agents by those that are accepted.
    ///
    /// When that is depends on the records alone.
    pub(super) fn relax_matches(&mut self) {
        let (agent, stamp_ns) = (self.agent_id.0, self.stamp_ns);
        for correction in self.keyframes.go_on_relaxing(agent, stamp_ns) {
            let before = self.estimator.in_frame(correction.agent).copied();
            self.estimator
                .fuse(correction.agent, &correction.estimate, &mut self.effects);
            self.apply_effects();
            self.tell_closed_loops(correction.agent, before);
        }
        let estimator = &*self.estimator;
        self.keyframes
            .begin_relaxation(agent, stamp_ns, || estimates(estimator));
    }
}

/// Where an estimator has the agents and landmarks of the map.
fn estimates(estimator: &Estimator) -> LiveEstimates {
    let agents = 0..u32::try_from(estimator.agent_count()).unwrap_or(u32::MAX);
    let estimate = |agent: u32| {
        let (pose, covariance) = estimator.pose(agent)?;
        estimator
            .is_in_map(agent)
            .then_some((agent, pose, covariance))
    };
    let landmarks = estimator.landmarks();
    LiveEstimates {
        agents: agents.filter_map(estimate).collect(),
        landmarks: landmarks
            .map(|(label, position, covariance)| (label.clone(), position, covariance))
            .collect(),
    }
}

impl Fold<'_> {
    /// Tells that an agent was corrected by loops; `before` is its pose until then. A past that is
    /// relaxed by what many saw at the same time alone closes none.
    fn tell_closed_loops(&mut self, agent: u32, before: Option<Isometry3<f64>>) {
        let (Some(before), Some(now)) = (before, self.estimator.in_frame(agent)) else {
            return;
        };
        let graph = &self.keyframes.graph;
        let closed = LoopsClosed {
            closures: graph.n_closures_accepted(),
            view_matches: graph.n_view_matches(),
            moved_m: (now.translation.vector - before.translation.vector).norm(),
            turned_rad: now.rotation.angle_to(&before.rotation),
            position: now.translation.vector.into(),
        };
        if closed.closures + closed.view_matches > 0 {
            self.events.push(Event {
                agent: AgentId(agent),
                stamp_ns: self.stamp_ns,
                kind: EventKind::LoopsClosed(closed),
            });
        }
    }

    /// Moves some of the places that turned out to be elsewhere.
    pub(super) fn move_places(&mut self) {
        for (place, at) in self.keyframes.graph.moved_places() {
            let place = PlaceId(place);
            self.places.put(place, &at, self.revision);
            self.move_waypoint(place, &at);
        }
    }
}

impl CognitiveMap {
    /// Where all agents were and all landmarks are, by everything that was seen until now: the
    /// whole map relaxed. A function of the map alone; takes time in proportion to what is
    /// remembered.
    pub fn refined(&self) -> Refined {
        self.keyframes
            .settled()
            .refine_matched(self.keyframes.views())
    }

    /// What is remembered of the past, relaxed, as nodes and links: for other programs. As long in
    /// the making as [`refined`](Self::refined).
    pub fn pose_graph(&self) -> PoseGraph {
        self.keyframes.settled().pose_graph(self.keyframes.views())
    }

    /// The relaxation under way, of the map as it was some records ago. The map waits for its
    /// outcome at a later record, unless somebody [runs](RelaxationJob::run) it before.
    pub fn relaxation(&self) -> Option<&RelaxationJob> {
        self.keyframes.relaxation()
    }

    /// The channels on which agents of the map have seen something. Takes time in proportion to
    /// the number of views that are logged.
    pub fn view_channels(&self) -> impl Iterator<Item = ViewChannel<'_>> {
        self.keyframes.view_channels()
    }

    /// Number of loop closures that are accepted.
    pub fn closure_count(&self) -> usize {
        self.keyframes.graph.n_closures_accepted()
    }

    /// Matches of views by which the past is relaxed, as they were when it last was.
    pub fn view_matches(&self) -> &[ViewMatch] {
        self.keyframes.graph.view_matches()
    }
}
