//! Samples over HTTP.

use axum::body::Body;
use axum::http::Response;
use cogmap_proto::{Codec, DecodeError, IngestAnswer, Rejection, SampleBatch, SkipReason};

use super::extract::{AgentName, AgentParams, Encoded, NoQuery};
use super::json;
use super::problem::{Problem, SequenceProblem};
use super::reply;
use crate::decode;

/// Most refused samples of a request that are explained.
const EXPLAINED_MAX: usize = 16;

/// Send samples.
///
/// Answers when they are on disk. Samples that had been there before are counted and otherwise
/// ignored, so a request may be sent again after a broken connection. Samples that make no sense
/// are refused one by one and listed in the watermark, and so are those whose time goes back;
/// `refused` says which field is wrong.
#[utoipa::path(post, path = "/v1/spaces/{space}/agents/{agent}/samples", tag = "agents",
    operation_id = "send_samples", params(AgentParams),
    request_body(content(
        (SampleBatch = "application/json"),
        (SampleBatch = "application/cbor"),
        (Vec<u8> = "application/vnd.cogmap.postcard;v1")),
        description = "Consecutive samples of the agent"),
    responses(
        (status = 200, description = "The samples are on disk", body = IngestAnswer),
        (status = 404, description = "There is no such space"),
        (status = 409, description = "Earlier samples are missing, a newer session has taken the \
            agent over, or the space has its full number of agents",
            body = SequenceProblem, content_type = "application/problem+json"),
        (status = 422, description = "The batch is empty, too large, or breaks another rule as a whole; or the \
            session lies in the future: its number is the Unix time of its start in nanoseconds"),
        (status = 507, description = "The store is full")))]
pub(crate) async fn post(
    AgentName(space, agent): AgentName,
    _: NoQuery,
    body: Encoded,
) -> Result<Response<Body>, Problem> {
    let batch = read(&body)?;
    let (session, first_seq) = (batch.session, batch.first_seq);
    let mut answer: IngestAnswer = space.ingest(&agent, batch).await?;
    let end_seq = answer
        .watermark
        .rejected
        .last()
        .map_or(0, |last| last.range.to);
    if answer.watermark.session == session && end_seq > first_seq {
        answer.refused = explained(&body, &answer.watermark.rejected);
    }
    Ok(reply::json(&answer))
}

fn read(body: &Encoded) -> Result<SampleBatch, DecodeError> {
    match body.codec {
        Codec::Json => json::batch(&body.bytes),
        Codec::Cbor | Codec::Postcard => body.codec.decode_batch(&body.bytes),
    }
}

/// Why samples of a body are refused. It is read a second time, so that one of which none is
/// refused pays nothing.
fn explained(body: &Encoded, rejected: &[Rejection]) -> Vec<String> {
    let Ok(batch) = read(body) else {
        return Vec::new();
    };
    // Of those before the body and of earlier ranges than the listed ones the answer knows nothing.
    let goes_back = |seq: u64| {
        let mut back = rejected
            .iter()
            .filter(|one| one.reason == SkipReason::TimeBackwards);
        back.any(|one| (one.range.from..one.range.to).contains(&seq))
    };
    let mut latest_ns = i64::MIN;
    let refused = batch.samples.iter().zip(batch.first_seq..).enumerate();
    let refused = refused.filter_map(|(at, (sample, seq))| {
        if let Some(why) = decode::refusal(sample) {
            return Some(format!("samples[{at}].{why}"));
        }
        let stamp_ns = sample.stamp_ns;
        if stamp_ns < latest_ns || goes_back(seq) {
            return Some(format!(
                "samples[{at}].stamp_ns: {stamp_ns} is before the stamp of an earlier sample"
            ));
        }
        latest_ns = stamp_ns;
        None
    });
    refused.take(EXPLAINED_MAX).collect()
}
