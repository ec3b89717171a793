//! Matches of views as links of a relaxation.

use nalgebra::Matrix3;
use place_recognition::ViewMatch;

use super::graph::KeyframeGraph;
use super::problem::Problem;
use pose_graph::{Kernel, Link, LinkId, PositionInformation, Scale, SightingTarget};

impl Problem {
    /// Adds the links of the graph's matches: both samples are at one place up to the standard
    /// deviation of the match, whatever their headings are.
    pub(super) fn add_matches(&mut self, graph: &KeyframeGraph) {
        let links = { graph.matches.iter() }
            .map(|matched| {
                let (link, kernel) = self.match_link(graph, matched, 1.0)?;
                self.map.add_link(link, kernel).ok()
            })
            .collect();
        self.matches = links;
    }

    /// States the standard deviation of each match as so many times what it is.
    pub(super) fn widen_matches(&mut self, graph: &KeyframeGraph, width: f64) {
        for (matched, id) in graph.matches.iter().zip(self.matches.clone()) {
            let Some((id, (link, _))) = id.zip(self.match_link(graph, matched, width)) else {
                continue;
            };
            self.map.restate(id, link).ok();
        }
    }

    /// Leaves the matches out, and all poses where they are.
    pub(super) fn switch_off_matches(&mut self) {
        let links: Vec<LinkId> = self.matches.iter().flatten().copied().collect();
        for link in links {
            self.map.switch_off(link);
        }
    }

    fn match_link(
        &self,
        graph: &KeyframeGraph,
        matched: &ViewMatch,
        width: f64,
    ) -> Option<(Link, Kernel)> {
        let [now, then] = [matched.now, matched.then].map(|sample| graph.chains.at_sample(sample));
        let (now, then) = (now?, then?);
        let sd_m = matched.sd_m * width;
        let covariance = Matrix3::from_diagonal_element(sd_m * sd_m);
        let link = Link::Sighting {
            from: self.node(now.keyframe)?,
            target: SightingTarget::PointOf(
                self.node(then.keyframe)?,
                then.motion.translation.vector,
            ),
            position: now.motion.translation.vector,
            information: PositionInformation::of_covariance(&covariance).ok()?,
        };
        let scale = Scale::new((2.0 * matched.depth).sqrt()).ok()?;
        Some((link, Kernel::GemanMcClure(scale)))
    }
}
