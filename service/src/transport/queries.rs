//! Queries over Zenoh: `cogmap/{space}/query/{verb}`, with the bodies of HTTP.

use std::sync::Arc;

use cogmap_proto::{
    Codec, IdentifyQuery, LocalizeQuery, PredictQuery, Problem, RecallQuery, Verb, WatermarkQuery,
    query_key,
};
use serde::Serialize;
use serde::de::DeserializeOwned;
use tokio::runtime::Handle;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use zenoh::Session;
use zenoh::query::{Query, Queryable};

use super::session::TransportError;
use crate::answer::{self, InvalidPrediction};
use crate::engine::{Engine, QuestionError};

/// Most queries under way; further ones are told to come back.
const QUERIES_MAX: usize = 64;

/// Answers every verb for every space.
pub(crate) async fn declare(
    session: &Session,
    engine: &Engine,
) -> Result<Vec<Queryable<()>>, TransportError> {
    let mut queryables = Vec::new();
    let room = Arc::new(Semaphore::new(QUERIES_MAX));
    for verb in [
        Verb::Recall,
        Verb::Watermark,
        Verb::Predict,
        Verb::Identify,
        Verb::Localize,
    ] {
        let (engine, runtime, room) = (engine.clone(), Handle::current(), Arc::clone(&room));
        let queryable = session
            .declare_queryable(query_key("*", verb.as_str()))
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
    Ok(queryables)
}

async fn reply(engine: &Engine, verb: Verb, query: Query, permit: Option<OwnedSemaphorePermit>) {
    let codec = query.encoding().map_or(Ok(Codec::Json), |encoding| {
        Codec::of_encoding(&encoding.to_string())
    });
    let (codec, result) = match codec {
        Ok(codec) if permit.is_none() => (
            codec,
            Err(problem("busy", 503, "too much is under way".to_owned())),
        ),
        Ok(codec) => (codec, answer(engine, verb, &query, codec).await),
        Err(error) => (
            Codec::Json,
            Err(problem("unsupported-encoding", 415, error.to_string())),
        ),
    };
    let sent = match result {
        Ok(bytes) => {
            query
                .reply(query.key_expr(), bytes)
                .encoding(codec.encoding())
                .await
        }
        Err(problem) => {
            query
                .reply_err(codec.encode(&problem))
                .encoding(codec.encoding())
                .await
        }
    };
    if let Err(error) = sent {
        tracing::debug!(%error, "answer a query");
    }
}

async fn answer(
    engine: &Engine,
    verb: Verb,
    query: &Query,
    codec: Codec,
) -> Result<Vec<u8>, Problem> {
    let name = query
        .key_expr()
        .as_str()
        .split('/')
        .nth(1)
        .unwrap_or_default();
    let space = engine
        .space(name)
        .ok_or_else(|| problem("unknown-space", 404, format!("no space {name:?}")))?;
    if let Some(reason) = space.stop_reason() {
        return Err(problem("space-stopped", 503, reason.to_owned()));
    }
    match verb {
        Verb::Recall => {
            let body: RecallQuery = body(query, codec)?;
            let map = space
                .snapshot()
                .await
                .map_err(|error| problem("unavailable", 503, error.to_string()))?;
            // It may look at every place: not on a thread that others wait for.
            let recall = move || answer::recall(space.name(), &map, &body);
            let recalled = tokio::task::spawn_blocking(recall)
                .await
                .map_err(|error| problem("internal", 500, error.to_string()))?
                .map_err(|error| problem("invalid-query", 422, error.to_string()))?;
            Ok(encoded(codec, &recalled))
        }
        Verb::Watermark => {
            let body: WatermarkQuery = body(query, codec)?;
            let agent = &body.agent;
            let desk = space
                .agent(agent)
                .ok_or_else(|| problem("unknown-agent", 404, format!("no agent {agent:?}")))?;
            Ok(encoded(codec, &desk.watermark()))
        }
        Verb::Predict => {
            let body: PredictQuery = body(query, codec)?;
            let agent = body
                .agent
                .as_deref()
                .ok_or_else(|| unpredictable(&InvalidPrediction::NoAgent))?;
            let desk = space
                .agent(agent)
                .ok_or_else(|| problem("unknown-agent", 404, format!("no agent {agent:?}")))?;
            let map = space
                .snapshot()
                .await
                .map_err(|error| problem("unavailable", 503, error.to_string()))?;
            let predicted = answer::predict(space.name(), &map, desk.id(), &body);
            let predicted = predicted.map_err(|error| unpredictable(&error))?;
            Ok(encoded(codec, &predicted))
        }
        Verb::Identify => {
            let body: IdentifyQuery = body(query, codec)?;
            let (orientation, touches) = answer::touches_to_identify(&body)
                .map_err(|error| problem("invalid-query", 422, error.to_string()))?;
            let identified = space.identify(orientation, touches).await;
            let (map, identified) = identified.map_err(|error| unanswered(&error))?;
            let answer = answer::identification(space.name(), &map, &identified);
            Ok(encoded(codec, &answer))
        }
        Verb::Localize => {
            let body: LocalizeQuery = body(query, codec)?;
            let samples = answer::samples_to_localize(&body)
                .map_err(|error| problem("invalid-query", 422, error.to_string()))?;
            let found = space.localize(samples).await;
            let (map, found) = found.map_err(|error| unanswered(&error))?;
            let answer = answer::localization(space.name(), &map, &found);
            Ok(encoded(codec, &answer))
        }
    }
}

fn body<T: DeserializeOwned>(query: &Query, codec: Codec) -> Result<T, Problem> {
    let payload = query
        .payload()
        .map(|payload| payload.to_bytes())
        .unwrap_or_default();
    codec
        .decode(&payload)
        .map_err(|error| problem("malformed-body", 400, error.to_string()))
}

fn encoded<T: Serialize>(codec: Codec, message: &T) -> Vec<u8> {
    codec.encode(message)
}

fn unpredictable(error: &InvalidPrediction) -> Problem {
    match error {
        InvalidPrediction::NotPlaced => problem("not-placed", 409, error.to_string()),
        _ => problem("invalid-query", 422, error.to_string()),
    }
}

fn unanswered(error: &QuestionError) -> Problem {
    let (kind, status) = match error {
        QuestionError::Busy => ("busy", 503),
        QuestionError::Overdue(_) => ("timeout", 504),
        QuestionError::Interrupted => ("internal", 500),
        QuestionError::Unavailable(_) => ("unavailable", 503),
    };
    problem(kind, status, error.to_string())
}

fn problem(kind: &str, status: u16, detail: String) -> Problem {
    let title = kind.replace('-', " ");
    Problem {
        kind: format!("/problems/{kind}"),
        title,
        status,
        detail,
    }
}
