//! Queries over Zenoh: `cogmap/{space}/query/{verb}`, with the bodies of HTTP.

use std::sync::Arc;

use cogmap_proto::{
    Codec, FeltQuery, IdentifyQuery, LocalizeQuery, PredictQuery, RecallQuery, RouteQuery,
    SESSION_PARAMETER, SequenceQuery, Verb, WatermarkQuery, query_key,
};
use serde::de::DeserializeOwned;
use tokio::runtime::Handle;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use zenoh::Session;
use zenoh::query::{Query, Queryable};

use super::latest;
use super::reply::{busy, codec_of, refuse, send};
use super::session::TransportError;
use crate::answer;
use crate::decode::{self, InvalidPrediction, InvalidQuery};
use crate::encode;
use crate::engine::Engine;
use crate::problem::{Kind, Problem};

/// Most queries under way; further ones are told to come back.
const QUERIES_MAX: usize = 64;

/// Room for the queries under way, of all spaces.
pub(crate) fn room() -> Arc<Semaphore> {
    Arc::new(Semaphore::new(QUERIES_MAX))
}

/// Answers every verb for a space, or for every one.
pub(crate) async fn declare(
    space: &str,
    session: &Session,
    engine: &Engine,
    room: &Arc<Semaphore>,
) -> Result<Vec<Queryable<()>>, TransportError> {
    let mut queryables = Vec::new();
    for verb in Verb::ALL {
        let (engine, runtime, room) = (engine.clone(), Handle::current(), Arc::clone(room));
        let queryable = session
            .declare_queryable(query_key(space, verb.as_str()))
            .complete(true)
            // The callback runs on a receiving thread: the answer is made elsewhere.
            .callback(move |query| {
                let engine = engine.clone();
                let permit = Arc::clone(&room).try_acquire_owned().ok();
                runtime.spawn(async move { reply(&engine, verb, query, permit).await });
            })
            .await?;
        queryables.push(queryable);
    }
    queryables.extend(latest::declare(space, session, engine, room).await?);
    Ok(queryables)
}

async fn reply(engine: &Engine, verb: Verb, query: Query, permit: Option<OwnedSemaphorePermit>) {
    let (codec, answered) = match (codec_of(&query), &permit) {
        (Err(problem), _) => (Codec::Json, Err(problem)),
        (Ok(codec), None) => (codec, Err(busy())),
        (Ok(codec), Some(_)) => (codec, answer(engine, verb, &query, codec).await),
    };
    // Zenoh waits where the link to whoever asked is congested, also to say that the answer is
    // complete, which it does when the query is dropped: not on a thread that others wait for.
    let sending = tokio::task::spawn_blocking(move || {
        match answered {
            Ok(bytes) => send(&query, query.key_expr().as_str(), codec, bytes),
            Err(problem) => refuse(&query, codec, &problem),
        }
        drop((query, permit));
    });
    if sending.await.is_err() {
        tracing::error!("answering a query ended with a panic");
    }
}

async fn answer(
    engine: &Engine,
    verb: Verb,
    query: &Query,
    codec: Codec,
) -> Result<Vec<u8>, Problem> {
    let key = query.key_expr().as_str();
    let space = answer::space_named(engine, key.split('/').nth(1).unwrap_or_default())?;
    match verb {
        Verb::Recall => {
            let body: RecallQuery = body(query, codec)?;
            let map = space.snapshot().await?;
            let recall = move || answer::recall(space.name(), &map, &body);
            Ok(codec.encode(&beside(recall).await?))
        }
        Verb::Watermark => {
            let body: WatermarkQuery = body(query, codec)?;
            if let Some(session) = session(query)? {
                space.check_session(&body.agent, session)?;
            }
            Ok(codec.encode(&answer::agent_named(&space, &body.agent)?.watermark()))
        }
        Verb::Predict => {
            let body: PredictQuery = body(query, codec)?;
            let name = body.agent.as_deref().ok_or(InvalidPrediction::NoAgent)?;
            let view = answer::agent_named(&space, name)?;
            let map = space.snapshot().await?;
            let predicted = answer::predict(space.name(), &map, view.id(), &body)?;
            Ok(codec.encode(&predicted))
        }
        Verb::Identify => {
            let body: IdentifyQuery = body(query, codec)?;
            let (orientation, touches) = decode::touches_to_identify(&body)?;
            let (map, identified) = space.identify(orientation, touches).await?;
            let answer = encode::identification(space.name(), &map, &identified);
            Ok(codec.encode(&answer))
        }
        Verb::Localize => {
            let body: LocalizeQuery = body(query, codec)?;
            let samples = decode::samples_to_localize(&body)?;
            let (map, found) = space.localize(samples).await?;
            let answer = encode::localization(space.name(), &map, &found);
            Ok(codec.encode(&answer))
        }
        Verb::Route => {
            let body: RouteQuery = body(query, codec)?;
            Ok(codec.encode(&answer::route_in(&space, body).await?))
        }
        Verb::Sequence => {
            let body: SequenceQuery = body(query, codec)?;
            Ok(codec.encode(&answer::sequence_in(&space, body).await?))
        }
        Verb::Felt => {
            let body: FeltQuery = body(query, codec)?;
            let map = space.snapshot().await?;
            let felt = move || answer::felt(space.name(), &map, &body);
            Ok(codec.encode(&beside(felt).await?))
        }
    }
}

/// What may look at every place, not on a thread that others wait for.
async fn beside<T: Send + 'static>(
    work: impl FnOnce() -> Result<T, InvalidQuery> + Send + 'static,
) -> Result<T, Problem> {
    let answered = tokio::task::spawn_blocking(work).await;
    Ok(answered.map_err(|_| Problem::interrupted())??)
}

/// The session that a robot asks as, if it says so: the service tells whether it may begin.
fn session(query: &Query) -> Result<Option<u64>, Problem> {
    let Some(session) = query.parameters().get(SESSION_PARAMETER) else {
        return Ok(None);
    };
    let session = session.parse().map(Some);
    session.map_err(|_| {
        let detail = format!("{SESSION_PARAMETER} is an unsigned 64-bit number");
        Problem::new(Kind::InvalidParameter, detail)
    })
}

fn body<T: DeserializeOwned>(query: &Query, codec: Codec) -> Result<T, Problem> {
    let payload = query
        .payload()
        .map(|payload| payload.to_bytes())
        .unwrap_or_default();
    Ok(codec.decode(&payload)?)
}
