//! The way of an agent lately, with the levels that it sensed.

use nalgebra::{Isometry3, Point3};
use state::state_of_struct;

use crate::tuning::window as tuning;

/// Mean of the levels of a channel that were sensed about a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Felt {
    pub(crate) channel: u8,
    pub(crate) count: u32,
    /// Where the sensor was, by motion alone \[m\].
    pub(crate) at: Point3<f64>,
    pub(crate) value: f64,
}

state_of_struct!(Felt {
    channel,
    count,
    at,
    value
});

/// A part of the way that is short against the field's correlation length.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Node {
    /// The body where it begins, by motion alone.
    pub(crate) in_odom: Isometry3<f64>,
    /// Way from the first node \[m\].
    pub(crate) way_m: f64,
    pub(crate) felt: Vec<Felt>,
}

state_of_struct!(Node {
    in_odom,
    way_m,
    felt
});

/// The latest nodes, the last of them under way.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Window {
    pub(crate) nodes: Vec<Node>,
}

state_of_struct!(Window { nodes });

impl Window {
    /// Takes in a level; answers whether the node before is complete by it. Levels that are sensed
    /// at rest are all of one node, so that they do not make surer.
    pub(crate) fn add(
        &mut self,
        channel: u8,
        in_odom: &Isometry3<f64>,
        at: &Point3<f64>,
        value: f64,
        step_m: f64,
    ) -> bool {
        let from = self.nodes.last().map(|node| (node.in_odom, node.way_m));
        let moved_m =
            from.map(|(from, _)| (from.translation.vector - in_odom.translation.vector).norm());
        let is_new = moved_m.is_none_or(|moved_m| moved_m >= step_m);
        if is_new {
            let way_m = from.map_or(0.0, |(_, way_m)| way_m) + moved_m.unwrap_or(0.0);
            if self.nodes.len() >= tuning::NODES {
                self.nodes.remove(0);
            }
            self.nodes.push(Node {
                in_odom: *in_odom,
                way_m,
                felt: Vec::new(),
            });
        }
        let Some(node) = self.nodes.last_mut() else {
            return false;
        };
        if let Some(felt) = node.felt.iter_mut().find(|felt| felt.channel == channel) {
            felt.count = felt.count.saturating_add(1);
            let share = 1.0 / f64::from(felt.count);
            felt.at += (at - felt.at) * share;
            felt.value += (value - felt.value) * share;
        } else if node.felt.len() < tuning::CHANNELS {
            node.felt.push(Felt {
                channel,
                count: 1,
                at: *at,
                value,
            });
        }
        is_new && self.nodes.len() >= 2
    }

    /// The nodes that are complete, oldest first.
    pub(crate) fn complete(&self) -> &[Node] {
        &self.nodes[..self.nodes.len().saturating_sub(1)]
    }
}
