//! Samples in.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::{Arc, LazyLock};
use std::time::Duration;

use cogmap_proto::limits::MESSAGE_BYTES_MAX;
use cogmap_proto::{Codec, DecodeError, Name, samples_key};
use tokio::sync::Semaphore;
use tokio::task::JoinHandle;
use zenoh::Session;
use zenoh::bytes::Encoding;
use zenoh::pubsub::Subscriber;
use zenoh::query::Queryable;
use zenoh::sample::Sample;

use super::queries;
use super::session::TransportError;
use crate::cluster::Cluster;
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
        Self::of("*", session, engine, &queries::room()).await
    }

    /// Begins to take samples and queries of a space, or of all.
    async fn of(
        space: &str,
        session: &Session,
        engine: &Engine,
        room: &Arc<Semaphore>,
    ) -> Result<Self, TransportError> {
        let queries = queries::declare(space, session, engine, room).await?;
        let engine = engine.clone();
        // The callback runs on a thread that receives for the whole session: it copies the bytes to
        // the space's queue or counts a drop, and never waits.
        let samples = session
            .declare_subscriber(samples_key(space, "*"))
            .callback(move |sample| take(&engine, &sample))
            .await?;
        Ok(Self {
            _samples: samples,
            _queries: queries,
        })
    }
}

/// How often is looked whether this node takes part in the cluster.
const LOOK_INTERVAL: Duration = Duration::from_millis(250);

/// Samples and queries of the spaces that are here, while they are: those of others are for other
/// nodes. Dropping it ends all.
#[derive(Debug)]
pub struct IntakeOfSpaces(JoinHandle<()>);

impl IntakeOfSpaces {
    /// Begins to take samples and queries of each space of the engine, as long as this node takes
    /// part in the cluster: another one may own them when it does not.
    pub fn start(session: &Session, engine: &Engine, cluster: &Cluster) -> Self {
        let (session, engine, cluster) = (session.clone(), engine.clone(), cluster.clone());
        Self(tokio::spawn(async move {
            let (mut changes, room) = (engine.changes(), queries::room());
            let mut taken: BTreeMap<String, Intake> = BTreeMap::new();
            loop {
                changes.mark_unchanged();
                let spaces = if cluster.takes_part() {
                    engine.spaces()
                } else {
                    Vec::new()
                };
                taken.retain(|name, _| spaces.iter().any(|space| space.name() == name));
                for space in spaces {
                    if taken.contains_key(space.name()) {
                        continue;
                    }
                    match Intake::of(space.name(), &session, &engine, &room).await {
                        Ok(intake) => {
                            taken.insert(space.name().to_owned(), intake);
                        }
                        Err(error) => {
                            tracing::error!(space = space.name(), %error, "take samples");
                        }
                    }
                }
                tokio::select! {
                    changed = changes.changed() => if changed.is_err() {
                        return;
                    },
                    () = tokio::time::sleep(LOOK_INTERVAL) => {}
                }
            }
        }))
    }
}

impl Drop for IntakeOfSpaces {
    fn drop(&mut self) {
        self.0.abort();
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
