//! The watermarks of a space, each with the time when it came.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use cogmap_client::open_session;
use cogmap_proto::{Codec, Watermark, durable_key};
use cogmap_tests::LONG;
use zenoh::pubsub::Subscriber;
use zenoh::{Session, Wait};

/// A watermark, and when it came.
pub(crate) type Heard = (Instant, Watermark);

/// Listens to the watermarks of all agents of the space `default`.
pub(crate) struct Watermarks {
    heard: Arc<Mutex<BTreeMap<String, Vec<Heard>>>>,
    _subscriber: Subscriber<()>,
    _session: Session,
}

impl Watermarks {
    pub(crate) fn listen(endpoint: &str) -> Self {
        let session = open_session(&[endpoint], LONG).expect("the endpoint answers");
        let heard: Arc<Mutex<BTreeMap<String, Vec<Heard>>>> = Arc::default();
        let subscriber = {
            let heard = Arc::clone(&heard);
            session
                .declare_subscriber(durable_key("default", "*"))
                .callback(move |sample| {
                    let now = Instant::now();
                    let agent = sample.key_expr().as_str().split('/').nth(2);
                    let agent = agent.expect("a key with an agent").to_owned();
                    let bytes = sample.payload().to_bytes();
                    let watermark = Codec::Cbor.decode(&bytes).expect("a watermark");
                    let mut heard = heard.lock().unwrap_or_else(PoisonError::into_inner);
                    heard.entry(agent).or_default().push((now, watermark));
                })
                .wait()
                .expect("the key is one of Zenoh's")
        };
        Self {
            heard,
            _subscriber: subscriber,
            _session: session,
        }
    }

    /// What was heard of an agent.
    pub(crate) fn of(&self, agent: &str) -> Vec<Heard> {
        let heard = self.heard.lock().unwrap_or_else(PoisonError::into_inner);
        heard.get(agent).cloned().unwrap_or_default()
    }

    /// Longest time between two watermarks of one agent from one instant to another.
    pub(crate) fn longest_gap(&self, from: Instant, to: Instant) -> Duration {
        let heard = self.heard.lock().unwrap_or_else(PoisonError::into_inner);
        let longest = heard.values().map(|heard| {
            let inside = heard.iter().map(|(at, _)| *at);
            let mut times: Vec<_> = inside.filter(|at| (from..to).contains(at)).collect();
            times.insert(0, from);
            times.push(to);
            let gaps = times.windows(2).map(|pair| pair[1] - pair[0]);
            gaps.max().unwrap_or_default()
        });
        longest.max().unwrap_or(to - from)
    }
}
