//! The normal equations of a whole graph.

use std::borrow::Cow;
use std::cell::OnceCell;

use nalgebra::Isometry3;

use super::elimination::{Equations, Front, number};
use super::graph::PoseGraph;
use super::normal_blocks::NormalBlocks;

/// The map's links, linearised at given poses of its nodes.
#[derive(Debug)]
pub(super) struct NormalEquations<'a> {
    pub(super) map: &'a PoseGraph,
    /// Where each node is.
    pub(super) poses: &'a [Isometry3<f64>],
    /// Of Geman–McClure kernels.
    pub(super) widening: f64,
    /// The blocks of each link, where they are used again and again.
    kept: OnceCell<Vec<Option<NormalBlocks>>>,
}

impl Equations for NormalEquations<'_> {
    const N_RIGHT: usize = 1;

    fn dimension(&self, variable: u32) -> usize {
        self.map.nodes[variable as usize].axes().len()
    }

    fn links(&self, variable: u32) -> &[(u32, [u32; 2])] {
        &self.map.links_of[variable as usize]
    }

    fn couples(&self, link: u32) -> bool {
        self.map.links[link as usize].is_on
    }

    fn add(&self, link: u32, front: &mut Front<'_>) {
        let Some(blocks) = self.blocks(link) else {
            return;
        };
        let (from, to) = self.map.links[link as usize].link.nodes();
        let axes = |node: u32| self.map.nodes[node as usize].axes();
        let (from, to) = ((from, axes(from)), (to, axes(to)));
        front.add(to, to, &blocks.to_to);
        front.add_right(to.0, to.1, 0, (-blocks.to_gradient).as_slice());
        if from.0 != to.0 {
            front.add(from, from, &blocks.from_from);
            front.add(to, from, &blocks.to_from);
            front.add_right(from.0, from.1, 0, (-blocks.from_gradient).as_slice());
        }
        let calibration = self.map.links[link as usize].link.calibration();
        if let Some((node, blocks)) = calibration.zip(blocks.by_calibration.as_ref()) {
            let own = (node, axes(node));
            front.add(own, own, &blocks.own);
            front.add(from, own, &blocks.from);
            front.add(to, own, &blocks.to);
            front.add_right(own.0, own.1, 0, (-blocks.gradient).as_slice());
        }
    }
}

impl<'a> NormalEquations<'a> {
    /// Of a map whose nodes are at these poses.
    pub(super) fn new(map: &'a PoseGraph, poses: &'a [Isometry3<f64>], widening: f64) -> Self {
        Self {
            map,
            poses,
            widening,
            kept: OnceCell::new(),
        }
    }

    /// Linearises all links once, for what goes through them several times.
    pub(super) fn keep(&self) {
        let all = || {
            let links = 0..number(self.map.links.len());
            links.map(|link| self.linearised(link)).collect()
        };
        self.kept.get_or_init(all);
    }

    /// The blocks of a link; `None` if it is switched off.
    fn blocks(&self, link: u32) -> Option<Cow<'_, NormalBlocks>> {
        match self.kept.get() {
            Some(kept) => kept[link as usize].as_ref().map(Cow::Borrowed),
            None => self.linearised(link).map(Cow::Owned),
        }
    }

    fn linearised(&self, link: u32) -> Option<NormalBlocks> {
        let slot = &self.map.links[link as usize];
        let blocks = || {
            let weigh = |s| slot.kernel.cost_and_weight(s, self.widening).1;
            slot.link
                .normal_blocks(|node| &self.poses[node as usize], weigh)
        };
        slot.is_on.then(blocks)
    }

    /// Hands out the nodes and the blocks of every link that is on; and the node of its
    /// calibration, if it has one.
    pub(super) fn for_each_link(&self, mut each: impl FnMut([u32; 2], Option<u32>, &NormalBlocks)) {
        for (link, slot) in (0..).zip(&self.map.links) {
            if let Some(blocks) = self.blocks(link) {
                let (from, to) = slot.link.nodes();
                each([from, to], slot.link.calibration(), &blocks);
            }
        }
    }
}
