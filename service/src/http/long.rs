//! Answers that take long to make or to send: made beside the asynchronous threads, a few at once.
//!
//! Whoever asks for much does not hold up whoever asks for little: each piece of the work waits for
//! its turn, and a reader who is slow to take the pieces holds none of those who make them.

use std::io;
use std::num::NonZero;
use std::sync::Arc;
use std::thread::available_parallelism;

use axum::body::{Body, Bytes};
use futures_util::stream;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use super::problem::{Kind, Problem};

/// Most long answers that are sent at once: each holds on to a whole map, or its graph.
const ANSWERS_MAX: usize = 64;
/// Bytes of a piece: about a millisecond's work.
const PIECE_BYTES: usize = 64 << 10;

/// Room for long answers, and turns for the work on them.
#[derive(Clone, Debug)]
pub(crate) struct LongAnswers {
    answers: Arc<Semaphore>,
    workers: Arc<Semaphore>,
}

impl Default for LongAnswers {
    fn default() -> Self {
        // Half of the processors, and never a single turn: one answer must not stop all others.
        let workers = available_parallelism().map_or(2, NonZero::get) / 2;
        Self {
            answers: Arc::new(Semaphore::new(ANSWERS_MAX)),
            workers: Arc::new(Semaphore::new(workers.max(2))),
        }
    }
}

impl LongAnswers {
    /// Does a piece of work when its turn comes.
    pub(crate) async fn make<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Problem> {
        let turn = Arc::clone(&self.workers).acquire_owned().await;
        // The turn goes with the work: whoever stops waiting for it does not let another one begin.
        let worked = tokio::task::spawn_blocking(move || {
            let made = work();
            drop(turn);
            made
        });
        worked.await.map_err(|_| Problem::interrupted())
    }

    /// Room for an answer that is sent piece by piece, if there is any.
    pub(crate) fn enter(&self) -> Result<OwnedSemaphorePermit, Problem> {
        let permit = Arc::clone(&self.answers).try_acquire_owned();
        permit.map_err(|_| {
            let detail = format!("{ANSWERS_MAX} long answers are being sent already");
            Problem::new(Kind::Busy, detail)
        })
    }

    /// A body of parts, a few at a time: further ones are made when those before have been taken.
    pub(crate) fn body<T: AsRef<[u8]>>(
        &self,
        room: OwnedSemaphorePermit,
        parts: impl Iterator<Item = T> + Send + 'static,
    ) -> Body {
        let begin = (self.clone(), room, parts);
        let made = stream::try_unfold(begin, |(long, room, parts)| async move {
            let made = long.make(move || piece(parts)).await;
            let (piece, parts) = made.map_err(|_| io::ErrorKind::Interrupted)?;
            let more = !piece.is_empty();
            Ok::<_, io::Error>(more.then(|| (Bytes::from(piece), (long, room, parts))))
        });
        Body::from_stream(made)
    }
}

/// The next piece, empty at the end, and the parts after it.
fn piece<T: AsRef<[u8]>, I: Iterator<Item = T>>(mut parts: I) -> (Vec<u8>, I) {
    let mut piece = Vec::new();
    while piece.len() < PIECE_BYTES
        && let Some(part) = parts.next()
    {
        piece.extend_from_slice(part.as_ref());
    }
    (piece, parts)
}
