//! Which connections have a request under way, and which wait.

use std::collections::BTreeMap;
use std::convert::Infallible;
use std::future::Future;
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::{Context, Poll};

use axum::Router;
use axum::body::Body;
use axum::extract::Request;
use axum::http::Response;
use axum::serve::IncomingStream;
use futures_util::task::AtomicWaker;
use tower::Service;

use super::held::holding;
use super::listener::BoundedListener;

/// The connections that wait, the one that has waited longest first.
#[derive(Debug, Default)]
pub(crate) struct Seats(Mutex<Waiting>);

#[derive(Debug, Default)]
struct Waiting {
    next: u64,
    seats: BTreeMap<u64, Arc<Seat>>,
}

/// What is known of a connection beside its bytes.
#[derive(Debug)]
pub(crate) struct Seat {
    seats: Arc<Seats>,
    /// Its key among those that wait; none while a request is under way. Changes under their lock.
    key: AtomicU64,
    requests: AtomicU64,
    sent_away: AtomicBool,
    gone: AtomicBool,
    waker: AtomicWaker,
}

/// A key that no connection has.
const NONE: u64 = u64::MAX;

impl Seats {
    /// A seat for a new connection.
    pub(crate) fn seat(self: &Arc<Self>) -> Arc<Seat> {
        let seat = Arc::new(Seat {
            seats: Arc::clone(self),
            key: AtomicU64::new(NONE),
            requests: AtomicU64::new(0),
            sent_away: AtomicBool::new(false),
            gone: AtomicBool::new(false),
            waker: AtomicWaker::new(),
        });
        self.lock().insert(&seat);
        seat
    }

    /// Sends the connection away that has waited longest, if one waits.
    pub(crate) fn send_away(&self) {
        let longest = self.lock().seats.pop_first();
        if let Some((_, seat)) = longest {
            seat.sent_away.store(true, Ordering::Release);
            seat.waker.wake();
        }
    }

    // A panic while the lock is held cannot leave half a change behind.
    fn lock(&self) -> MutexGuard<'_, Waiting> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Waiting {
    fn insert(&mut self, seat: &Arc<Seat>) {
        seat.key.store(self.next, Ordering::Release);
        self.seats.insert(self.next, Arc::clone(seat));
        self.next += 1;
    }

    fn remove(&mut self, seat: &Seat) {
        self.seats.remove(&seat.key.swap(NONE, Ordering::AcqRel));
    }
}

impl Seat {
    /// Whether a request is under way.
    pub(crate) fn has_request(&self) -> bool {
        self.key.load(Ordering::Acquire) == NONE
    }

    /// How many requests have begun.
    pub(crate) fn requests(&self) -> u64 {
        self.requests.load(Ordering::Acquire)
    }

    /// Whether the connection is to end; wakes the task when it is.
    pub(crate) fn is_sent_away(&self, context: &Context<'_>) -> bool {
        self.waker.register(context.waker());
        self.sent_away.load(Ordering::Acquire)
    }

    /// The connection has ended.
    pub(crate) fn leave(&self) {
        let mut waiting = self.seats.lock();
        self.gone.store(true, Ordering::Release);
        waiting.remove(self);
    }

    fn begin(self: &Arc<Self>) -> UnderWay {
        self.seats.lock().remove(self);
        self.requests.fetch_add(1, Ordering::AcqRel);
        UnderWay(Arc::clone(self))
    }
}

/// A request under way, from its head until its answer has been sent.
#[derive(Debug)]
struct UnderWay(Arc<Seat>);

impl Drop for UnderWay {
    fn drop(&mut self) {
        let mut waiting = self.0.seats.lock();
        if !self.0.gone.load(Ordering::Acquire) {
            waiting.insert(&self.0);
        }
    }
}

/// Makes the service of each connection: the routes, with a note of each request.
#[derive(Clone, Debug)]
pub(crate) struct Noting(pub(crate) Router);

/// The routes for one connection.
#[derive(Clone, Debug)]
pub(crate) struct Noted {
    router: Router,
    seat: Arc<Seat>,
}

impl Service<IncomingStream<'_, BoundedListener>> for Noting {
    type Response = Noted;
    type Error = Infallible;
    type Future = std::future::Ready<Result<Noted, Infallible>>;

    fn poll_ready(&mut self, _: &mut Context<'_>) -> Poll<Result<(), Infallible>> {
        Poll::Ready(Ok(()))
    }

    fn call(&mut self, stream: IncomingStream<'_, BoundedListener>) -> Self::Future {
        std::future::ready(Ok(Noted {
            router: self.0.clone(),
            seat: Arc::clone(stream.io().seat()),
        }))
    }
}

impl Service<Request> for Noted {
    type Response = Response<Body>;
    type Error = Infallible;
    type Future = Pin<Box<dyn Future<Output = Result<Response<Body>, Infallible>> + Send>>;

    fn poll_ready(&mut self, _: &mut Context<'_>) -> Poll<Result<(), Infallible>> {
        Poll::Ready(Ok(())) // as the router always is
    }

    fn call(&mut self, request: Request) -> Self::Future {
        let under_way = self.seat.begin();
        let answer = self.router.call(request);
        Box::pin(async move {
            let response = answer.await?;
            Ok(response.map(|body| holding(body, under_way)))
        })
    }
}
