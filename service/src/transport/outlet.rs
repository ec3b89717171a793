//! Estimates, watermarks and events out.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use cogmap_proto::{
    Codec, Estimate, EventRecord, Watermark, durable_key, estimate_key, events_key, json_key,
};
use serde::Serialize;
use zenoh::pubsub::Publisher;
use zenoh::qos::CongestionControl;
use zenoh::{Session, Wait};

use super::session::TransportError;
use crate::engine::Outlet;

/// Publishes over Zenoh. What a congested link cannot take is dropped: the next estimate supersedes
/// it, and a client that misses a watermark asks for it.
#[derive(Debug)]
pub struct ZenohOutlet {
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
    _publisher: Publisher<'static>,
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

impl ZenohOutlet {
    /// Publishes in `codec`.
    ///
    /// # Errors
    /// The declarations fail.
    pub async fn declare(session: Session, codec: Codec) -> Result<Self, TransportError> {
        Ok(Self {
            estimates: JsonListeners::watch(&session, &estimate_key("*", "*")).await?,
            watermarks: JsonListeners::watch(&session, &durable_key("*", "*")).await?,
            events: JsonListeners::watch(&session, &events_key("*")).await?,
            session,
            codec,
        })
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
            .wait();
        if let Err(error) = put {
            tracing::debug!(%error, "publish");
        }
    }
}

impl Outlet for ZenohOutlet {
    fn estimate(&self, estimate: &Estimate) {
        let key = estimate_key(&estimate.space, &estimate.agent);
        self.put(&key, estimate, &self.estimates, None);
    }

    fn watermark(&self, space: &str, agent: &str, watermark: &Watermark) {
        let key = durable_key(space, agent);
        self.put(&key, watermark, &self.watermarks, None);
    }

    fn event(&self, event: &EventRecord) {
        let key = events_key(&event.event.space);
        let id = event.id.to_string();
        self.put(&key, &event.event, &self.events, Some(&id));
    }
}
