//! A listener that keeps to a number of connections, and the connections.

use std::io;
use std::net::SocketAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};
use std::time::Duration;

use axum::serve::Listener;
use metrics::{Counter, counter};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::{Instant, Sleep};

use super::activity::{Activity, IdleConnections};
use super::settings::HttpSettings;
use crate::metrics::HTTP_CLOSED_CONNECTIONS;

/// How long is waited for room before one more connection is sent away.
const ROOM_PAUSE: Duration = Duration::from_millis(50);

/// Accepts connections. Where as many are open as may be, the one that has waited longest without a
/// request under way makes room; where there is none such, others wait in the system's queue.
#[derive(Debug)]
pub(crate) struct BoundedListener {
    listener: TcpListener,
    room: Arc<Semaphore>,
    idle: Arc<IdleConnections>,
    closed: ClosedCounters,
    head_timeout: Duration,
    idle_timeout: Duration,
}

/// A connection that counts as long as it lives, and lives only as long as it is used.
#[derive(Debug)]
pub(crate) struct Connection {
    stream: TcpStream,
    activity: Arc<Activity>,
    /// When bytes have passed last.
    used: Instant,
    /// Since when the head of a request is awaited: from its first byte on, or the connection's
    /// begin.
    head_since: Option<Instant>,
    /// Requests that had begun when this was looked at last.
    requests: u64,
    watch: Pin<Box<Sleep>>,
    /// Why it is being closed, once it is.
    closed: Option<Closed>,
    counters: ClosedCounters,
    head_timeout: Duration,
    idle_timeout: Duration,
    _permit: OwnedSemaphorePermit,
}

/// Why the service closes a connection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Closed {
    /// It waited, and another one came.
    Room,
    /// The head of a request did not come in its time.
    Head,
    /// Nothing passed either way in its time.
    Idle,
}

/// What is counted of each reason.
type ClosedCounters = Arc<[Counter; Closed::ALL.len()]>;

impl BoundedListener {
    pub(crate) fn new(listener: TcpListener, settings: &HttpSettings) -> Self {
        Self {
            listener,
            room: Arc::new(Semaphore::new(settings.connections_max)),
            idle: Arc::default(),
            closed: Closed::counters(),
            head_timeout: settings.head_timeout,
            idle_timeout: settings.idle_timeout,
        }
    }

    /// Room for one more connection.
    async fn make_room(&self) -> OwnedSemaphorePermit {
        if let Ok(permit) = Arc::clone(&self.room).try_acquire_owned() {
            return permit;
        }
        loop {
            self.idle.close_idlest();
            let permit = Arc::clone(&self.room).acquire_owned();
            // Where none waits now, one may soon.
            if let Ok(permit) = tokio::time::timeout(ROOM_PAUSE, permit).await {
                return permit.expect("nobody closes the semaphore");
            }
        }
    }
}

impl Listener for BoundedListener {
    type Io = Connection;
    type Addr = SocketAddr;

    async fn accept(&mut self) -> (Connection, SocketAddr) {
        // axum's own listener retries after errors, and pauses after those of the system.
        let (stream, address) = Listener::accept(&mut self.listener).await;
        let permit = self.make_room().await;
        // Answers are short and written whole: waiting for more to send would only delay them.
        if let Err(error) = stream.set_nodelay(true) {
            tracing::debug!(%error, "set TCP_NODELAY");
        }
        let now = Instant::now();
        let connection = Connection {
            stream,
            activity: self.idle.activity(),
            used: now,
            head_since: Some(now),
            requests: 0,
            watch: Box::pin(tokio::time::sleep(self.head_timeout.min(self.idle_timeout))),
            closed: None,
            counters: Arc::clone(&self.closed),
            head_timeout: self.head_timeout,
            idle_timeout: self.idle_timeout,
            _permit: permit,
        };
        (connection, address)
    }

    fn local_addr(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }
}

impl Connection {
    /// Where the connection's requests are noted.
    pub(crate) fn activity(&self) -> &Arc<Activity> {
        &self.activity
    }

    /// Ends a wait for the other side: when the connection has been sent away, a head has not come
    /// in its time, or nothing has passed either way in its time. Without it, whoever opens
    /// connections and says nothing, or hardly anything, keeps all others out.
    fn poll_patience(&mut self, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        let reason = if let Some(reason) = self.closed {
            reason
        } else {
            let reason = ready!(self.poll_close(context));
            self.counters[reason as usize].increment(1);
            *self.closed.insert(reason)
        };
        Poll::Ready(Err(reason.error_kind().into()))
    }

    /// Waits for a reason to close the connection.
    fn poll_close(&mut self, context: &mut Context<'_>) -> Poll<Closed> {
        // One whose next request came meanwhile answers it first.
        if self.activity.is_to_close(context) && !self.activity.has_request() {
            return Poll::Ready(Closed::Room);
        }
        self.look_at_requests();
        let idle = (self.used + self.idle_timeout, Closed::Idle);
        let head = self.head_since.map(|since| since + self.head_timeout);
        let head = head
            .filter(|head| *head < idle.0)
            .map(|head| (head, Closed::Head));
        let (due, reason) = head.unwrap_or(idle);
        if due < self.watch.deadline() {
            self.watch.as_mut().reset(due);
        }
        while self.watch.as_mut().poll(context).is_ready() {
            if Instant::now() >= due {
                return Poll::Ready(reason);
            }
            self.watch.as_mut().reset(due);
        }
        Poll::Pending
    }

    fn note_read(&mut self) {
        self.used = Instant::now();
        self.look_at_requests();
        if self.head_since.is_none() && !self.activity.has_request() {
            self.head_since = Some(self.used);
        }
    }

    /// Where a request has begun since, its head has come.
    fn look_at_requests(&mut self) {
        let requests = self.activity.requests();
        if requests != self.requests {
            self.requests = requests;
            self.head_since = None;
        }
    }
}

impl Closed {
    const ALL: [Self; 3] = [Self::Room, Self::Head, Self::Idle];

    fn counters() -> ClosedCounters {
        let counters =
            Self::ALL.map(|reason| counter!(HTTP_CLOSED_CONNECTIONS, "reason" => reason.name()));
        Arc::new(counters)
    }

    /// The label of its counter.
    fn name(self) -> &'static str {
        match self {
            Self::Room => "room",
            Self::Head => "head",
            Self::Idle => "idle",
        }
    }

    fn error_kind(self) -> io::ErrorKind {
        match self {
            Self::Room => io::ErrorKind::ConnectionAborted,
            Self::Head | Self::Idle => io::ErrorKind::TimedOut,
        }
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        self.activity.leave();
    }
}

impl AsyncRead for Connection {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        match Pin::new(&mut self.stream).poll_read(context, buffer) {
            Poll::Ready(read) => {
                self.note_read();
                Poll::Ready(read)
            }
            Poll::Pending => self.poll_patience(context),
        }
    }
}

impl AsyncWrite for Connection {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        match Pin::new(&mut self.stream).poll_write(context, bytes) {
            Poll::Ready(written) => {
                self.used = Instant::now();
                Poll::Ready(written)
            }
            Poll::Pending => self.poll_patience(context).map_ok(|()| 0),
        }
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        slices: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        match Pin::new(&mut self.stream).poll_write_vectored(context, slices) {
            Poll::Ready(written) => {
                self.used = Instant::now();
                Poll::Ready(written)
            }
            Poll::Pending => self.poll_patience(context).map_ok(|()| 0),
        }
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(context)
    }
}
