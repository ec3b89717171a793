//! Zenoh without a client: any bytes, under any key and encoding.

use std::collections::BTreeMap;
use std::thread;
use std::time::{Duration, Instant};

use cogmap_client::open_session;
use cogmap_proto::{Codec, SampleBatch, samples_key};
use zenoh::bytes::Encoding;
use zenoh::pubsub::Publisher;
use zenoh::qos::CongestionControl;
use zenoh::{Session, Wait};

use crate::wait::LONG;

/// Puts bytes on Zenoh.
#[derive(Debug)]
pub struct RawPublisher {
    session: Session,
    publishers: BTreeMap<String, Publisher<'static>>,
}

impl RawPublisher {
    /// Connects to the service at `endpoint`.
    pub fn connect(endpoint: &str) -> Self {
        let session = open_session(&[endpoint], LONG).expect("the endpoint answers");
        Self {
            session,
            publishers: BTreeMap::new(),
        }
    }

    /// The session.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Puts bytes under a key, once somebody listens to it: what is put before that is gone.
    ///
    /// The key goes along whole. A publisher would declare it and send its number, which may
    /// overtake the declaration and is then dropped (eclipse-zenoh/zenoh#980); robots send again
    /// what is not acknowledged.
    pub fn put(&mut self, key: &str, encoding: &str, bytes: Vec<u8>) {
        if !self.publishers.contains_key(key) {
            let publisher = self
                .session
                .declare_publisher(key.to_owned())
                .congestion_control(CongestionControl::Block)
                .wait()
                .expect("the key is one of Zenoh's");
            let deadline = Instant::now() + LONG;
            while !publisher
                .matching_status()
                .wait()
                .is_ok_and(|status| status.matching())
            {
                assert!(Instant::now() < deadline, "nobody listens to {key}");
                thread::sleep(Duration::from_millis(5));
            }
            self.publishers.insert(key.to_owned(), publisher);
        }
        self.put_unmatched(key, encoding, bytes);
    }

    /// Puts bytes under a key at once. Somebody must be known to listen, which they are once
    /// [`RawPublisher::put`] has put something that they listen to.
    pub fn put_unmatched(&self, key: &str, encoding: &str, bytes: Vec<u8>) {
        self.session
            .put(key, bytes)
            .encoding(Encoding::from(encoding))
            .congestion_control(CongestionControl::Block)
            .wait()
            .expect("the session is open");
    }

    /// Puts a batch of an agent, in a codec.
    pub fn put_batch(&mut self, space: &str, agent: &str, codec: Codec, batch: &SampleBatch) {
        let key = samples_key(space, agent);
        self.put(&key, codec.encoding(), codec.encode(batch));
    }

    /// Asks a query with a body; returns the bytes of the answer, which has the query's encoding.
    ///
    /// # Errors
    /// The bytes of the problem that the service answered with.
    pub fn ask(&self, key: &str, encoding: &str, body: Vec<u8>) -> Result<Vec<u8>, Vec<u8>> {
        let replies = self
            .session
            .get(key)
            .payload(body)
            .encoding(Encoding::from(encoding))
            .timeout(LONG)
            .wait()
            .expect("the session is open");
        let reply = replies.recv().expect("somebody answers");
        match reply.result() {
            Ok(sample) => {
                assert_eq!(sample.encoding().to_string(), encoding);
                Ok(sample.payload().to_bytes().into_owned())
            }
            Err(error) => Err(error.payload().to_bytes().into_owned()),
        }
    }
}
