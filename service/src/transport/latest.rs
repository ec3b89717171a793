//! What was published last, for whoever asks: `get` on the keys of estimates and watermarks.

use std::sync::Arc;

use cogmap_proto::{Codec, durable_key, estimate_key};
use tokio::runtime::Handle;
use tokio::sync::Semaphore;
use zenoh::Session;
use zenoh::key_expr::KeyExpr;
use zenoh::query::{Query, Queryable};

use super::reply::{busy, codec_of, refuse, send};
use super::session::TransportError;
use crate::answer::{agent_named, space_named};
use crate::engine::{AgentView, Engine};
use crate::problem::{Kind, Problem};

/// What is published of each agent.
#[derive(Clone, Copy, Debug)]
enum Latest {
    Estimate,
    Watermark,
}

impl Latest {
    fn key(self, space: &str, agent: &str) -> String {
        match self {
            Self::Estimate => estimate_key(space, agent),
            Self::Watermark => durable_key(space, agent),
        }
    }

    /// What there is of an agent; no estimate before its first sample.
    fn encoded(self, view: &AgentView, codec: Codec) -> Option<Vec<u8>> {
        match self {
            Self::Estimate => view.estimate().map(|estimate| codec.encode(&estimate)),
            Self::Watermark => Some(codec.encode(&view.watermark())),
        }
    }
}

/// Answers for every agent of a space, or of every one.
pub(super) async fn declare(
    space: &str,
    session: &Session,
    engine: &Engine,
    room: &Arc<Semaphore>,
) -> Result<Vec<Queryable<()>>, TransportError> {
    let mut queryables = Vec::new();
    for latest in [Latest::Estimate, Latest::Watermark] {
        let (engine, runtime, room) = (engine.clone(), Handle::current(), Arc::clone(room));
        let queryable = session
            .declare_queryable(latest.key(space, "*"))
            .complete(true)
            // The callback runs on a receiving thread: the answer is made elsewhere, on a thread
            // that may wait for a congested link.
            .callback(move |query| {
                let engine = engine.clone();
                let permit = Arc::clone(&room).try_acquire_owned().ok();
                runtime.spawn_blocking(move || {
                    reply(&engine, latest, &query, permit.is_some());
                    drop((query, permit));
                });
            })
            .await?;
        queryables.push(queryable);
    }
    Ok(queryables)
}

fn reply(engine: &Engine, latest: Latest, query: &Query, has_room: bool) {
    let (codec, answered) = match codec_of(query) {
        Err(problem) => (Codec::Json, Err(problem)),
        Ok(codec) if !has_room => (codec, Err(busy())),
        Ok(codec) if query.key_expr().is_wild() => {
            reply_all(engine, latest, query, codec);
            (codec, Ok(()))
        }
        Ok(codec) => (codec, reply_one(engine, latest, query, codec)),
    };
    if let Err(problem) = answered {
        refuse(query, codec, &problem);
    }
}

/// Answers for the one agent that the key names.
fn reply_one(engine: &Engine, latest: Latest, query: &Query, codec: Codec) -> Result<(), Problem> {
    let mut names = query.key_expr().as_str().split('/').skip(1);
    let mut name = || names.next().unwrap_or_default();
    let space = space_named(engine, name())?;
    let view = agent_named(&space, name())?;
    let bytes = latest.encoded(&view, codec).ok_or_else(|| {
        let detail = format!("the agent {:?} has no sample yet", view.name());
        Problem::new(Kind::UnknownAgent, detail)
    })?;
    send(query, query.key_expr().as_str(), codec, bytes);
    Ok(())
}

/// Answers for all agents whose keys the query matches.
fn reply_all(engine: &Engine, latest: Latest, query: &Query, codec: Codec) {
    for space in engine.spaces() {
        for view in space.agents_after(None, usize::MAX) {
            let key = latest.key(space.name(), view.name());
            let asked = KeyExpr::try_from(&*key).is_ok_and(|key| query.key_expr().intersects(&key));
            if asked && let Some(bytes) = latest.encoded(&view, codec) {
                send(query, &key, codec, bytes);
            }
        }
    }
}
