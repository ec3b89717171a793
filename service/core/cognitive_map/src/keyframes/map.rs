//! Keyframes with what was seen from them: the graph, and place recognition.

use geometry::PoseCovariance;
use nalgebra::Isometry3;
use place_recognition::{
    Found, Guess, PlaceRecognition, Relocalised, SampleKey, SensedTurn, View, ViewLog,
};

use super::graph::KeyframeGraph;
use super::moment::Moment;
use super::pending_relaxation::PendingRelaxation;
use super::settings::KeyframeSettings;
use crate::input::{Descriptor, StartPose};

/// The past: a keyframe graph, and place recognition, which asks the graph where views were taken
/// and gives it loop closures.
///
/// What concerns both is a method of this type. A clone is a snapshot that shares all pages.
#[derive(Clone, Debug)]
pub struct KeyframeMap {
    /// The graph.
    pub graph: KeyframeGraph,
    pub(super) recognition: PlaceRecognition,
    /// The relaxation under way; the graph has what has come since it began.
    pub(super) pending: Option<PendingRelaxation>,
}

impl KeyframeMap {
    /// Without any agent.
    pub fn new(settings: KeyframeSettings) -> Self {
        Self {
            graph: KeyframeGraph::new(settings),
            recognition: PlaceRecognition::default(),
            pending: None,
        }
    }

    /// Says under which revision changes are noted from now on: a checkpoint since a revision holds
    /// the later ones.
    pub fn set_revision(&mut self, revision: u64) {
        self.graph.set_revision(revision);
        self.recognition.set_revision(revision);
    }

    /// A start pose of an agent in the map. If the agent was in the map already, it has been put
    /// there: no motion leads there from what it did before.
    pub fn start_pose(&mut self, moment: &Moment, start: &StartPose) {
        self.graph.start_pose(moment, start);
        self.recognition.cut(moment.agent);
    }

    /// An agent was detached: it begins anew in a frame of its own, and what it did and saw in the
    /// map no longer counts there.
    pub fn set_aside(&mut self, agent: u32) {
        self.graph.set_aside(agent);
        self.recognition.cut(agent);
    }

    /// An agent of the map has left. What it did stays part of the past.
    pub fn retire(&mut self, agent: u32) {
        self.forget_searches(agent);
    }

    /// Forgets an agent that was never in the map: its number is as it was when it enrolled. Walks
    /// the whole chain of the agent.
    pub fn clear(&mut self, agent: u32) {
        self.forget_searches(agent);
        self.graph.clear(agent);
    }

    fn forget_searches(&mut self, agent: u32) {
        self.recognition.end_search(agent);
        self.recognition.end_waking(agent);
        self.recognition.end_tracking(agent);
        let latest = self.graph.chains.track(agent).map_or(0, |track| track.seq);
        self.recognition.confirm_pose(agent, latest);
    }

    /// An agent sees something, with this pose by motion alone since its session began, and this
    /// covariance of its pose in the map.
    pub fn observe<'a>(
        &mut self,
        moment: &Moment,
        descriptor: &'a Descriptor,
        in_odom: Isometry3<f64>,
        covariance: PoseCovariance,
    ) -> View<'a> {
        self.graph.note(moment);
        View {
            sample: self.sample(moment),
            in_odom,
            pose: moment.pose,
            covariance,
            channel: descriptor.channel().as_str(),
            vector: descriptor.vector(),
        }
    }

    /// Remembers a view of an agent in the map, and closes the loops that end with it.
    pub fn view(&mut self, view: &View<'_>) {
        let track = self.graph.chains.track(view.sample.agent);
        if !track.is_some_and(|track| track.is_in_map() && !track.needs_keyframe) {
            return;
        }
        if self.is_coarse(view) {
            return self.recognition.remember(view);
        }
        for revisit in self.recognition.view(view, &self.graph.chains) {
            self.graph.close(&revisit);
        }
    }

    /// Whether views of this channel say too little one by one, and are weighed among the cells.
    fn is_coarse(&self, view: &View<'_>) -> bool {
        let Some(number) = self.recognition.channel_of(view) else {
            return false;
        };
        let mut learned = self.graph.learned.iter();
        learned.any(|learned| learned.channel == number && learned.is_coarse)
            && self.recognition.is_sought_among_cells(view)
    }

    /// Whether what an agent of the map saw lately contradicts its estimate.
    /// `accepted` is the number of its sightings so far that agree with that.
    pub fn is_contradicted(&mut self, view: &View<'_>, accepted: u64) -> bool {
        if self.is_coarse(view) {
            return false;
        }
        let chains = &self.graph.chains;
        // A view that fits where the agent is tracked speaks for it as a sighting does.
        let fitting = self.recognition.fitting_views(view.sample.agent);
        let accepted = accepted.wrapping_add(fitting);
        self.recognition.is_contradicted(view, accepted, chains)
    }

    /// An agent may be anywhere. What it saw since that is contradicted is forgotten where it was
    /// estimated to be, and a search begins with it.
    pub fn declare_kidnapped(&mut self, moment: &Moment) {
        self.recognition.declare_kidnapped(self.sample(moment));
        self.recognition.end_tracking(moment.agent);
        self.recognition.end_waking(moment.agent);
        self.graph.begin_stretch(moment.agent, None);
    }

    /// Whether an agent of the map may be anywhere, by what it has seen.
    pub fn is_kidnapped(&self, agent: u32) -> bool {
        self.recognition.is_kidnapped(agent)
    }

    /// The estimate of an agent is right from a sample on: by a start pose, or since it was found.
    pub fn confirm_pose(&mut self, agent: u32, seq: u64) {
        self.recognition.confirm_pose(agent, seq);
    }

    /// An agent that does not know where it is sees something. Answers where it is, once that is
    /// known to better than `sd_max_m`.
    pub fn seek(&mut self, view: &View<'_>, sd_max_m: f64) -> Option<Relocalised> {
        if self.is_coarse(view) {
            self.recognition.end_search(view.sample.agent);
            return None;
        }
        self.recognition.seek(view, sd_max_m, &self.graph.chains)
    }

    /// Learns from the view of an agent that knows where it is what views say of cells.
    /// `turn` is that of its odometry in the map as compasses tell it.
    pub fn teach_cells(&mut self, view: &View<'_>, turn: Option<SensedTurn>) {
        self.recognition.teach_cells(view, turn);
    }

    /// An agent that does not know where it is sees something. Answers where among the cells of
    /// the map it is, once that is sure. `turn` is as for [`teach_cells`](Self::teach_cells).
    pub fn wake(&mut self, view: &View<'_>, turn: Option<SensedTurn>) -> Option<Found> {
        self.recognition.wake(view, turn)
    }

    /// Whether an agent that was found among the cells is still followed there.
    pub fn is_waking(&self, agent: u32) -> bool {
        let session = self.graph.chains.session(agent);
        self.recognition.is_waking(agent, session)
    }

    /// All that agents of the map saw.
    pub fn views(&self) -> &ViewLog {
        self.recognition.views()
    }

    /// Whether an agent that was found still searches for its heading.
    pub fn is_seeking(&self, agent: u32) -> bool {
        let session = self.graph.chains.session(agent);
        self.recognition.is_seeking(agent, session)
    }

    /// An agent was found. `is_elsewhere` says that it was estimated to be in the map, but
    /// somewhere else. A loop closure ties it to what was recognised.
    pub fn relocalised(&mut self, moment: &Moment, found: &Relocalised, is_elsewhere: bool) {
        let agent = moment.agent;
        let Some(similar) = self.recognition.most_similar(agent) else {
            return;
        };
        if is_elsewhere {
            self.recognition.cut(agent);
            self.graph.begin_stretch(agent, Some(&found.pose));
        }
        if found.is_last {
            self.recognition.end_search(agent);
        }
        self.recognition.end_waking(agent);
        self.graph.close_to_recognised(agent, similar, found);
    }

    /// An agent was found by what it feels; `elsewhere` is its pose if it was estimated to be in
    /// the map already. No motion leads there from what it did before.
    pub fn found(&mut self, moment: &Moment, elsewhere: Option<&Isometry3<f64>>) {
        self.found_among_cells(moment, elsewhere);
        self.recognition.end_waking(moment.agent);
    }

    /// The same of an agent that was found among the cells, where it is still followed.
    pub fn found_among_cells(&mut self, moment: &Moment, elsewhere: Option<&Isometry3<f64>>) {
        if elsewhere.is_some() {
            self.recognition.cut(moment.agent);
            self.graph.begin_stretch(moment.agent, elsewhere);
        }
        self.recognition.end_search(moment.agent);
        self.recognition.confirm_pose(moment.agent, moment.seq);
    }

    /// An agent knows where it is, or begins anew: its search is over.
    pub fn end_search(&mut self, agent: u32) {
        self.recognition.end_search(agent);
        self.recognition.end_waking(agent);
    }

    /// Where an agent may be that searches, the most probable first.
    pub fn guesses(&self, agent: u32) -> Vec<Guess> {
        self.recognition.guesses(agent, &self.graph.chains)
    }

    fn sample(&self, moment: &Moment) -> SampleKey {
        SampleKey {
            agent: moment.agent,
            session: self.graph.chains.session(moment.agent),
            seq: moment.seq,
        }
    }
}
