//! Estimates, watermarks and events out.

use cogmap_proto::{Codec, Estimate, Event, Watermark, durable_key, estimate_key, events_key};
use serde::Serialize;
use zenoh::qos::CongestionControl;
use zenoh::{Session, Wait};

use crate::engine::Outlet;

/// Publishes over Zenoh. What a congested link cannot take is dropped: the next estimate supersedes
/// it, and a client that misses a watermark asks for it.
#[derive(Debug)]
pub struct ZenohOutlet {
    session: Session,
    codec: Codec,
}

impl ZenohOutlet {
    /// Publishes in `codec`.
    pub fn new(session: Session, codec: Codec) -> Self {
        Self { session, codec }
    }

    fn put<T: Serialize>(&self, key: String, message: &T) {
        let put = self
            .session
            .put(key, self.codec.encode(message))
            .encoding(self.codec.encoding())
            .congestion_control(CongestionControl::Drop)
            .wait();
        if let Err(error) = put {
            tracing::debug!(%error, "publish");
        }
    }
}

impl Outlet for ZenohOutlet {
    fn estimate(&self, estimate: &Estimate) {
        self.put(estimate_key(&estimate.space, &estimate.agent), estimate);
    }

    fn watermark(&self, space: &str, agent: &str, watermark: &Watermark) {
        self.put(durable_key(space, agent), watermark);
    }

    fn event(&self, event: &Event) {
        self.put(events_key(&event.space), event);
    }
}
