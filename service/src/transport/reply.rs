//! Replies to queries: answers and problems, in the codec of the question.

use cogmap_proto::Codec;
use zenoh::Wait;
use zenoh::query::Query;

use crate::problem::{Kind, Problem};

/// Sends an answer under a key, which may wait.
pub(super) fn send(query: &Query, key: &str, codec: Codec, bytes: Vec<u8>) {
    let sent = query.reply(key, bytes).encoding(codec.encoding()).wait();
    if let Err(error) = sent {
        tracing::debug!(%error, "answer a query");
    }
}

/// Answers with a problem, which may wait.
pub(super) fn refuse(query: &Query, codec: Codec, problem: &Problem) {
    let sent = query.reply_err(codec.encode(&problem.to_wire()));
    if let Err(error) = sent.encoding(codec.encoding()).wait() {
        tracing::debug!(%error, "refuse a query");
    }
}

/// The codec of a question, and so of its answer. A question without an encoding means JSON.
pub(super) fn codec_of(query: &Query) -> Result<Codec, Problem> {
    let encoding = query.encoding().map(ToString::to_string);
    // An encoding that was not given comes as Zenoh's default.
    match encoding.as_deref() {
        None | Some("" | "zenoh/bytes") => Ok(Codec::Json),
        Some(encoding) => Ok(Codec::of_encoding(encoding)?),
    }
}

/// As many questions as may be are under way.
pub(super) fn busy() -> Problem {
    Problem::new(Kind::Busy, "too much is under way")
}
