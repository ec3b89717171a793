//! Samples in.

use std::borrow::Cow;
use std::sync::LazyLock;

use cogmap_proto::limits::MESSAGE_BYTES_MAX;
use cogmap_proto::{Codec, DecodeError, Name, samples_key};
use zenoh::Session;
use zenoh::bytes::Encoding;
use zenoh::pubsub::Subscriber;
use zenoh::query::Queryable;
use zenoh::sample::Sample;

use super::queries;
use super::session::TransportError;
use crate::engine::Engine;

/// The subscription to all samples, and the answers to queries. Dropping it ends both.
#[derive(Debug)]
pub struct Intake {
    _samples: Subscriber<()>,
    _queries: Vec<Queryable<()>>,
}

impl Intake {
    /// Begins to take samples and queries of every space.
    ///
    /// # Errors
    /// The declarations fail.
    pub async fn start(session: &Session, engine: &Engine) -> Result<Self, TransportError> {
        let queries = queries::declare(session, engine).await?;
        let engine = engine.clone();
        // The callback runs on a thread that receives for the whole session: it copies the bytes to
        // the space's queue or counts a drop, and never waits.
        let samples = session
            .declare_subscriber(samples_key("*", "*"))
            .callback(move |sample| take(&engine, &sample))
            .await?;
        Ok(Self {
            _samples: samples,
            _queries: queries,
        })
    }
}

fn take(engine: &Engine, sample: &Sample) {
    let Some((space, agent)) = names(sample.key_expr().as_str()) else {
        return engine.refuse_key();
    };
    let bytes = sample.payload().len();
    if bytes > MESSAGE_BYTES_MAX {
        return engine.refuse(sample.key_expr().as_str(), &DecodeError::TooLong(bytes));
    }
    match codec_of(sample.encoding()) {
        Ok(codec) => engine.offer(space, agent, codec, &sample.payload().to_bytes()),
        Err(error) => engine.refuse(sample.key_expr().as_str(), &error),
    }
}

/// The codec of a message. Almost all have one of the encodings that need no text to be built.
fn codec_of(encoding: &Encoding) -> Result<Codec, DecodeError> {
    static KNOWN: LazyLock<[(Encoding, Codec); 3]> = LazyLock::new(|| {
        [Codec::Postcard, Codec::Cbor, Codec::Json].map(|codec| (codec.encoding().into(), codec))
    });
    match KNOWN.iter().find(|(known, _)| known == encoding) {
        Some((_, codec)) => Ok(*codec),
        None => Codec::of_encoding(&Cow::from(encoding)),
    }
}

/// Space and agent of a samples key, if both are names.
fn names(key: &str) -> Option<(&str, &str)> {
    let (rest, _) = key.rsplit_once('/')?;
    let (rest, agent) = rest.rsplit_once('/')?;
    let (_, space) = rest.rsplit_once('/')?;
    (Name::check(space).is_ok() && Name::check(agent).is_ok()).then_some((space, agent))
}

#[cfg(test)]
mod tests {
    use super::names;

    #[test]
    fn only_valid_names_pass() {
        assert_eq!(names("cogmap/lab/ada/samples"), Some(("lab", "ada")));
        assert_eq!(names("cogmap/lab/.ada/samples"), None);
        assert_eq!(names("cogmap/l b/ada/samples"), None);
        assert_eq!(names("cogmap/lab/samples"), None);
        assert_eq!(names("samples"), None);
    }
}
