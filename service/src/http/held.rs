//! Bodies that keep something as long as they are being sent.

use std::pin::Pin;
use std::task::{Context, Poll};

use axum::body::{Body, Bytes, HttpBody};
use http_body::{Frame, SizeHint};

/// Most bytes of a body that are sent at once: the system takes them whole.
const SHORT: u64 = 16 << 10;

/// A body that drops `held` when it has been sent, or nobody wants it any more. A short one does
/// not keep it.
pub(crate) fn holding<T: Send + Unpin + 'static>(body: Body, held: T) -> Body {
    if body.size_hint().exact().is_some_and(|bytes| bytes <= SHORT) {
        return body;
    }
    Body::new(Holding { body, _held: held })
}

struct Holding<T> {
    body: Body,
    _held: T,
}

impl<T: Unpin> HttpBody for Holding<T> {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        Pin::new(&mut self.body).poll_frame(context)
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}
