//! The thread that publishes: estimates, watermarks and events out.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use cogmap_proto::{Codec, EventRecord, durable_key, estimate_key, events_key, json_key};
use serde::Serialize;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::{Session, Wait};

use super::board::{Board, Notice};
use super::session::TransportError;
use crate::engine::{AgentView, Messages};

/// Nobody else's messages have this priority, so what others send never stands before these in the
/// queue of a link. One for all three: a link keeps the order of messages of one priority, and
/// clients rely upon an estimate before the watermark that covers its samples.
const PRIORITY: Priority = Priority::InteractiveHigh;

/// The thread's state.
#[derive(Debug)]
pub(super) struct PublishingThread {
    session: Session,
    codec: Codec,
    estimates: JsonListeners,
    watermarks: JsonListeners,
    events: JsonListeners,
}

/// Whether anybody listens to the JSON form of a kind of message. Nothing is encoded or put while
/// nobody does.
#[derive(Debug)]
struct JsonListeners {
    listening: Arc<AtomicBool>,
    /// Held for its effect: Zenoh tells it who listens.
    _publisher: zenoh::pubsub::Publisher<'static>,
}

impl JsonListeners {
    async fn watch(session: &Session, key: &str) -> Result<Self, TransportError> {
        let publisher = session.declare_publisher(json_key(key)).await?;
        let listening = Arc::new(AtomicBool::new(false));
        let heard = Arc::clone(&listening);
        publisher
            .matching_listener()
            .callback(move |status| heard.store(status.matching(), Ordering::Relaxed))
            .background()
            .await?;
        Ok(Self {
            listening,
            _publisher: publisher,
        })
    }

    fn is_heard(&self) -> bool {
        self.listening.load(Ordering::Relaxed)
    }
}

impl PublishingThread {
    /// Publishes in `codec`.
    pub(super) async fn declare(session: Session, codec: Codec) -> Result<Self, TransportError> {
        Ok(Self {
            estimates: JsonListeners::watch(&session, &estimate_key("*", "*")).await?,
            watermarks: JsonListeners::watch(&session, &durable_key("*", "*")).await?,
            events: JsonListeners::watch(&session, &events_key("*")).await?,
            session,
            codec,
        })
    }

    /// Publishes what the board has until it is closed.
    pub(super) fn run(&self, board: &Board) {
        let mut notices = Vec::new();
        while board.wait(&mut notices) {
            for notice in notices.drain(..) {
                match notice {
                    Notice::Event(event) => self.event(&event),
                    Notice::Agent(space, agent) => self.agent(&space, &agent),
                }
            }
        }
    }

    fn event(&self, EventRecord { id, event }: &EventRecord) {
        let (key, id) = (events_key(&event.space), id.to_string());
        self.put(&key, event, &self.events, Some(&id));
    }

    /// Publishes what is due of an agent, the estimate first. The watermark is read before the
    /// estimate, which therefore covers at least the same samples.
    fn agent(&self, space: &str, agent: &AgentView) {
        let due = agent.take_due(Messages::BOTH);
        let watermark = due.contain(Messages::WATERMARK).then(|| agent.watermark());
        // One that became due since may cover samples of this watermark.
        let estimate = due.contain(Messages::ESTIMATE)
            || (watermark.is_some()
                && agent
                    .take_due(Messages::ESTIMATE)
                    .contain(Messages::ESTIMATE));
        if estimate {
            let key = estimate_key(space, agent.name());
            agent.read_estimate(|estimate| self.put(&key, estimate, &self.estimates, None));
        }
        if let Some(watermark) = watermark {
            let key = durable_key(space, agent.name());
            self.put(&key, &watermark, &self.watermarks, None);
        }
    }

    /// Publishes a message under its key, and as JSON beside it if that is heard.
    fn put<T: Serialize>(
        &self,
        key: &str,
        message: &T,
        json: &JsonListeners,
        attachment: Option<&str>,
    ) {
        self.put_as(self.codec, key, message, attachment);
        if json.is_heard() {
            self.put_as(Codec::Json, &json_key(key), message, attachment);
        }
    }

    fn put_as<T: Serialize>(&self, codec: Codec, key: &str, message: &T, attachment: Option<&str>) {
        let put = self
            .session
            .put(key, codec.encode(message))
            .encoding(codec.encoding())
            .attachment(attachment)
            .congestion_control(CongestionControl::Drop)
            .priority(PRIORITY)
            .wait();
        if let Err(error) = put {
            tracing::debug!(%error, "publish");
        }
    }
}
