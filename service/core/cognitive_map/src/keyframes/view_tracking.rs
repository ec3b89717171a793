//! Where the views of a relaxed map are, for agents that are tracked among them.

use place_recognition::{SampleKey, Tracked, View, ViewMap};

use super::graph::KeyframeGraph;
use super::map::KeyframeMap;

impl KeyframeMap {
    /// Where an agent is by the view that was remembered last, in a map that views hold together;
    /// `None` if that does not say. `stamp_ns` is that of the sample.
    pub fn track(&mut self, view: &View<'_>, stamp_ns: i64) -> Option<Tracked> {
        let graph = &self.graph;
        if graph.matches.is_empty() || graph.is_tied_by_sightings() {
            return None;
        }
        let maps = graph.view_maps.iter();
        self.recognition.track(view, stamp_ns, maps)
    }

    /// All views of maps, those of a relaxation under way among them.
    pub(super) fn view_maps(&self) -> impl Iterator<Item = &ViewMap> {
        let pending = self.pending.iter();
        let pending = pending.filter_map(|pending| pending.outcome().view_maps.as_ref());
        self.graph.view_maps.iter().chain(pending.flatten())
    }
}

impl KeyframeGraph {
    /// What later views are compared with, where the keyframes have it.
    pub(super) fn located_view_maps(&self) -> Vec<ViewMap> {
        if self.is_tied_by_sightings() {
            return Vec::new(); // nobody is tracked among them
        }
        let pose = |sample: SampleKey| self.chains.pose_of(&self.chains.at_sample(sample)?);
        let mut maps: Vec<ViewMap> = self.view_maps.iter().cloned().collect();
        for map in &mut maps {
            map.locate(pose);
        }
        maps
    }

    /// Replaces what later views are compared with.
    pub(super) fn set_view_maps(&mut self, view_maps: Vec<ViewMap>) {
        let revision = self.revision;
        while self.view_maps.len() > view_maps.len() {
            self.view_maps.pop(revision);
        }
        for (number, view_map) in view_maps.into_iter().enumerate() {
            match self.view_maps.get_mut(number, revision) {
                Some(slot) => *slot = view_map,
                None => self.view_maps.push(view_map, revision),
            }
        }
    }
}
