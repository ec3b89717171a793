//! Presence of the nodes of a cluster, by liveliness tokens of Zenoh.
//!
//! ```text
//! cogmap/@nodes/{node}/{session}                    the node is there
//! cogmap/@shards/{shard}/{term}/{node}/{session}    the node owns the shard
//! ```

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;
use zenoh::sample::{Sample, SampleKind};
use zenoh::{Session, Wait};

use super::session::TransportError;
use crate::cluster::{Presence, PresenceSign};
use crate::store::{NodeId, OwnerRecord, ShardNumber};

const NODES: &str = "cogmap/@nodes";
const SHARDS: &str = "cogmap/@shards";

/// Longest wait for the tokens of others.
const ASK_TIMEOUT: Duration = Duration::from_secs(1);

/// Where what is heard goes.
#[derive(Clone)]
struct Tell(Arc<dyn Fn(PresenceSign) + Send + Sync>);

impl std::fmt::Debug for Tell {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Tell")
    }
}

impl Tell {
    fn token(&self, sample: &Sample) {
        let there = sample.kind() == SampleKind::Put;
        if let Some(sign) = sign(sample.key_expr().as_str(), there) {
            (self.0)(sign);
        }
    }
}

/// The tokens of this node, and those of all others as they come and go.
#[derive(Debug)]
pub struct ZenohPresence {
    session: Session,
    node: Option<LivelinessToken>,
    shards: BTreeMap<ShardNumber, LivelinessToken>,
    tell: Tell,
    _others: [Subscriber<()>; 2],
}

impl ZenohPresence {
    /// Hears of all nodes that are there and that come and go. This one says nothing yet.
    ///
    /// # Errors
    /// The declarations fail.
    pub async fn watch(
        session: &Session,
        tell: impl Fn(PresenceSign) + Send + Sync + 'static,
    ) -> Result<Self, TransportError> {
        let tell = Tell(Arc::new(tell));
        let watch = async |below: &str| {
            let tell = tell.clone();
            let liveliness = session.liveliness();
            let tokens = liveliness
                .declare_subscriber(format!("{below}/**"))
                .history(true);
            tokens.callback(move |sample| tell.token(&sample)).await
        };
        Ok(Self {
            session: session.clone(),
            node: None,
            shards: BTreeMap::new(),
            _others: [watch(NODES).await?, watch(SHARDS).await?],
            tell,
        })
    }

    fn token(&self, key: String) -> Option<LivelinessToken> {
        let token = self.session.liveliness().declare_token(key).wait();
        // It fails only when the session is closed.
        token
            .inspect_err(|error| tracing::warn!(%error, "declare a token"))
            .ok()
    }
}

impl Presence for ZenohPresence {
    fn join(&mut self, node: &NodeId) {
        let NodeId { name, session } = node;
        self.node = self.token(format!("{NODES}/{name}/{session}"));
    }

    fn own(&mut self, owner: &OwnerRecord) {
        let OwnerRecord { shard, term, node } = owner;
        let NodeId { name, session } = node;
        let token = self.token(format!("{SHARDS}/{shard}/{term}/{name}/{session}"));
        if let Some(token) = token {
            self.shards.insert(*shard, token);
        }
    }

    fn disown(&mut self, shard: ShardNumber) {
        self.shards.remove(&shard);
    }

    fn ask(&self) {
        for below in [NODES, SHARDS] {
            let tell = self.tell.clone();
            let liveliness = self.session.liveliness();
            let asked = liveliness
                .get(format!("{below}/**"))
                .timeout(ASK_TIMEOUT)
                .callback(move |reply| {
                    if let Ok(sample) = reply.result() {
                        tell.token(sample);
                    }
                })
                .wait();
            if let Err(error) = asked {
                tracing::debug!(%error, "ask for tokens");
            }
        }
    }

    fn leave(&mut self) {
        self.shards.clear();
        self.node = None;
    }
}

/// What a token says.
fn sign(key: &str, there: bool) -> Option<PresenceSign> {
    if let Some(parts) = key.strip_prefix(NODES) {
        let mut parts = parts.split('/').skip(1);
        let node = node(&mut parts)?;
        return Some(PresenceSign::Node { node, there });
    }
    let mut parts = key.strip_prefix(SHARDS)?.split('/').skip(1);
    let owner = OwnerRecord {
        shard: ShardNumber(parts.next()?.parse().ok()?),
        term: parts.next()?.parse().ok()?,
        node: node(&mut parts)?,
    };
    Some(PresenceSign::Owner { owner, there })
}

fn node<'a>(parts: &mut impl Iterator<Item = &'a str>) -> Option<NodeId> {
    Some(NodeId {
        name: parts.next()?.to_owned(),
        session: parts.next()?.to_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_says_what_it_was_declared_for() {
        let node = NodeId {
            name: "ada.lab".to_owned(),
            session: "7f".to_owned(),
        };
        for there in [true, false] {
            let node = node.clone();
            let told = sign("cogmap/@nodes/ada.lab/7f", there);
            assert_eq!(told, Some(PresenceSign::Node { node, there }));
        }
        let owner = OwnerRecord {
            shard: ShardNumber(3),
            term: 12,
            node,
        };
        let key = "cogmap/@shards/3/12/ada.lab/7f";
        assert_eq!(
            sign(key, true),
            Some(PresenceSign::Owner { owner, there: true })
        );
        for foreign in [
            "cogmap/@shards/x/12/ada/7f",
            "cogmap/@nodes",
            "cogmap/lab/ada/samples",
        ] {
            assert_eq!(sign(foreign, true), None);
        }
    }
}
