//! The normal equations of a whole graph.

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
        self.with_blocks(link, |blocks| self.add_blocks(link, blocks, front));
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

    fn add_blocks(&self, link: u32, blocks: &NormalBlocks, front: &mut Front<'_>) {
        let link = &self.map.links[link as usize].link;
        let (from, to) = link.nodes();
        let axes = |node: u32| self.map.nodes[node as usize].axes();
        let (from, to) = ((from, axes(from)), (to, axes(to)));
        front.add(to, to, &blocks.to_to);
        front.add_right(to.0, to.1, 0, (-blocks.to_gradient).as_slice());
        if from.0 != to.0 {
            front.add(from, from, &blocks.from_from);
            front.add(to, from, &blocks.to_from);
            front.add_right(from.0, from.1, 0, (-blocks.from_gradient).as_slice());
        }
        if let Some((node, blocks)) = link.calibration().zip(blocks.by_calibration.as_ref()) {
            let own = (node, axes(node));
            front.add(own, own, &blocks.own);
            front.add(from, own, &blocks.from);
            front.add(to, own, &blocks.to);
            front.add_right(own.0, own.1, 0, (-blocks.gradient).as_slice());
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

    /// Hands out the blocks of a link, unless it is switched off.
    fn with_blocks(&self, link: u32, each: impl FnOnce(&NormalBlocks)) {
        match self.kept.get() {
            Some(kept) => kept[link as usize].as_ref().map(each),
            None => self.linearised(link).as_ref().map(each),
        };
    }

    /// The blocks of a link; `None` if it is switched off.
    fn linearised(&self, link: u32) -> Option<NormalBlocks> {
        let slot = &self.map.links[link as usize];
        if !slot.is_on {
            return None;
        }
        let weigh = |s| slot.kernel.cost_and_weight(s, self.widening).1;
        let place = |node: u32| &self.poses[node as usize];
        Some(slot.link.normal_blocks(place, weigh))
    }

    /// Hands out the nodes and the blocks of every link that is on; and the node of its
    /// calibration, if it has one.
    pub(super) fn for_each_link(&self, mut each: impl FnMut([u32; 2], Option<u32>, &NormalBlocks)) {
        for (link, slot) in (0..).zip(&self.map.links) {
            let (from, to) = slot.link.nodes();
            let calibration = slot.link.calibration();
            self.with_blocks(link, |blocks| each([from, to], calibration, blocks));
        }
    }
}
