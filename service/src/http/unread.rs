//! Bodies that are answered before they have been read.
//!
//! A request may be refused by its head alone. What is left of its body then stands before the next
//! request of the connection. Left there, the connection ends with it, and a client that keeps
//! connections finds that out only when it sends its next request.

use std::pin::Pin;
use std::task::{Context, Poll};
use std::time::Duration;

use axum::body::{Body, Bytes, HttpBody};
use axum::extract::Request;
use axum::http::header::{CONNECTION, EXPECT};
use axum::http::{HeaderValue, Response};
use cogmap_proto::limits::MESSAGE_BYTES_MAX;
use http_body::{Frame, SizeHint};
use http_body_util::BodyExt;
use tokio::sync::oneshot;

/// Most bytes that are read and thrown away: a body that is a little too long is answered, too.
const REST_BYTES_MAX: usize = 2 * MESSAGE_BYTES_MAX;
/// How long the rest of a body is waited for.
const REST_TIMEOUT: Duration = Duration::from_secs(1);

/// What has become of a request's body.
pub(crate) enum Rest {
    /// There was none.
    Empty,
    /// It comes back from whoever reads it.
    Lent(oneshot::Receiver<Option<Body>>),
    /// The same, but the client waits for a word before it sends it (`Expect: 100-continue`), and
    /// reading would be that word.
    Asked(oneshot::Receiver<Option<Body>>),
}

/// A body that is given back by who drops it, as far as it was not read.
struct Lent {
    body: Option<Body>,
    back: Option<oneshot::Sender<Option<Body>>>,
}

/// The request, whose body is looked after.
pub(crate) fn lend(request: Request) -> (Request, Rest) {
    if request.body().is_end_stream() {
        return (request, Rest::Empty);
    }
    let (back, rest) = oneshot::channel();
    let rest = if request.headers().contains_key(EXPECT) {
        Rest::Asked(rest)
    } else {
        Rest::Lent(rest)
    };
    let lent = request.map(|body| {
        Body::new(Lent {
            body: Some(body),
            back: Some(back),
        })
    });
    (lent, rest)
}

impl Rest {
    /// The answer, once the body has been read to its end; or one that says that the connection
    /// ends with it, where the body is too long, too slow, or still being read.
    pub(crate) async fn settle(self, mut response: Response<Body>) -> Response<Body> {
        let ended = match self {
            Self::Empty => true,
            Self::Asked(mut back) => matches!(back.try_recv(), Ok(None)),
            Self::Lent(mut back) => match back.try_recv() {
                Ok(None) => true,
                Ok(Some(rest)) => tokio::time::timeout(REST_TIMEOUT, is_read_out(rest))
                    .await
                    .unwrap_or(false),
                Err(_) => false,
            },
        };
        if !ended {
            let close = HeaderValue::from_static("close");
            response.headers_mut().insert(CONNECTION, close);
        }
        response
    }
}

/// Reads what is left of a body; whether it came to its end.
async fn is_read_out(mut rest: Body) -> bool {
    let mut bytes = 0;
    while let Some(frame) = rest.frame().await {
        let Ok(frame) = frame else {
            return false;
        };
        bytes += frame.data_ref().map_or(0, Bytes::len);
        if bytes > REST_BYTES_MAX {
            return false;
        }
    }
    true
}

impl HttpBody for Lent {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        let Some(body) = &mut self.body else {
            return Poll::Ready(None);
        };
        let frame = Pin::new(body).poll_frame(context);
        if matches!(frame, Poll::Ready(None)) {
            self.body = None;
        }
        frame
    }

    fn is_end_stream(&self) -> bool {
        self.body.as_ref().is_none_or(HttpBody::is_end_stream)
    }

    fn size_hint(&self) -> SizeHint {
        let read = SizeHint::with_exact(0);
        self.body.as_ref().map_or(read, HttpBody::size_hint)
    }
}

impl Drop for Lent {
    fn drop(&mut self) {
        if let Some(back) = self.back.take() {
            let rest = self.body.take().filter(|body| !body.is_end_stream());
            // Where nobody waits for it any more, the connection has ended.
            let _ = back.send(rest);
        }
    }
}
