//! Placement: which node a shard belongs to, by rendezvous hashing (Thaler & Ravishankar 1998).
//!
//! Each node has a weight for each shard, a hash of both; the heaviest of those that are there has
//! the shard. All nodes that see the same nodes agree, and a node that comes or goes moves no shard
//! between others.

use xxhash_rust::xxh3::xxh3_64;

use crate::store::{NodeId, ShardNumber};

/// The node that a shard belongs to; none without nodes.
pub(super) fn owner<'a>(
    shard: ShardNumber,
    nodes: impl IntoIterator<Item = &'a NodeId>,
) -> Option<&'a NodeId> {
    // Two nodes of one name have one weight; the later session decides, everywhere alike.
    let weight = |node: &&NodeId| (weight(shard, &node.name), (*node).clone());
    nodes.into_iter().max_by_key(weight)
}

fn weight(shard: ShardNumber, node: &str) -> u64 {
    xxh3_64(format!("{shard} {node}").as_bytes())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    fn nodes(names: &[&str]) -> Vec<NodeId> {
        let node = |name: &&str| NodeId {
            name: (*name).to_owned(),
            session: "1".to_owned(),
        };
        names.iter().map(node).collect()
    }

    fn owners(names: &[&str]) -> Vec<String> {
        let nodes = nodes(names);
        let owner = |shard| owner(ShardNumber(shard), &nodes).map(|node| node.name.clone());
        (0..600)
            .map(|shard| owner(shard).expect("there are nodes"))
            .collect()
    }

    #[test]
    fn shards_spread_and_move_only_to_or_from_whom_comes_or_goes() {
        let (two, three) = (owners(&["ada", "bob"]), owners(&["cy", "bob", "ada"]));
        for (before, after) in two.iter().zip(&three) {
            assert!(before == after || after == "cy", "{before} to {after}");
        }
        let mut counts = BTreeMap::new();
        for owner in &three {
            *counts.entry(owner.as_str()).or_insert(0) += 1;
        }
        // Each has 200 on average, with a standard deviation of 12.
        assert!(
            counts.values().all(|count| (150..250).contains(count)),
            "{counts:?}"
        );
        assert_eq!(owner(ShardNumber(0), []), None);
    }

    #[test]
    fn of_two_nodes_of_one_name_one_has_all() {
        let mut nodes = nodes(&["ada", "ada"]);
        nodes[1].session = "2".to_owned();
        for shard in 0..20 {
            assert_eq!(owner(ShardNumber(shard), &nodes), Some(&nodes[1]));
            assert_eq!(
                owner(ShardNumber(shard), nodes.iter().rev()),
                Some(&nodes[1])
            );
        }
    }
}
