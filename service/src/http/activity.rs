//! Which connections have a request under way, and which wait.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::task::Context;

use futures_util::task::AtomicWaker;

/// The connections that wait, the one that has waited longest first.
#[derive(Debug, Default)]
pub(crate) struct IdleConnections(Mutex<Waiting>);

#[derive(Debug, Default)]
struct Waiting {
    next: u64,
    idle: BTreeMap<u64, Arc<Activity>>,
}

/// What is known of a connection beside its bytes.
#[derive(Debug)]
pub(crate) struct Activity {
    idle: Arc<IdleConnections>,
    /// Its key among those that wait; none while a request is under way. Changes under their lock.
    key: AtomicU64,
    requests: AtomicU64,
    is_to_close: AtomicBool,
    gone: AtomicBool,
    waker: AtomicWaker,
}

/// A key that no connection has.
const NONE: u64 = u64::MAX;

impl IdleConnections {
    /// The activity of a new connection.
    pub(crate) fn activity(self: &Arc<Self>) -> Arc<Activity> {
        let activity = Arc::new(Activity {
            idle: Arc::clone(self),
            key: AtomicU64::new(NONE),
            requests: AtomicU64::new(0),
            is_to_close: AtomicBool::new(false),
            gone: AtomicBool::new(false),
            waker: AtomicWaker::new(),
        });
        self.lock().insert(&activity);
        activity
    }

    /// Closes the connection that has waited longest, if one waits.
    pub(crate) fn close_idlest(&self) {
        let longest = self.lock().idle.pop_first();
        if let Some((_, activity)) = longest {
            activity.is_to_close.store(true, Ordering::Release);
            activity.waker.wake();
        }
    }

    // A panic while the lock is held cannot leave half a change behind.
    fn lock(&self) -> MutexGuard<'_, Waiting> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Waiting {
    fn insert(&mut self, activity: &Arc<Activity>) {
        activity.key.store(self.next, Ordering::Release);
        self.idle.insert(self.next, Arc::clone(activity));
        self.next += 1;
    }

    fn remove(&mut self, activity: &Activity) {
        self.idle.remove(&activity.key.swap(NONE, Ordering::AcqRel));
    }
}

impl Activity {
    /// Whether a request is under way.
    pub(crate) fn has_request(&self) -> bool {
        self.key.load(Ordering::Acquire) == NONE
    }

    /// How many requests have begun.
    pub(crate) fn requests(&self) -> u64 {
        self.requests.load(Ordering::Acquire)
    }

    /// Whether the connection is to end; wakes the task when it is.
    pub(crate) fn is_to_close(&self, context: &Context<'_>) -> bool {
        self.waker.register(context.waker());
        self.is_to_close.load(Ordering::Acquire)
    }

    /// The connection has ended.
    pub(crate) fn leave(&self) {
        let mut waiting = self.idle.lock();
        self.gone.store(true, Ordering::Release);
        waiting.remove(self);
    }

    pub(crate) fn begin(self: &Arc<Self>) -> UnderWay {
        self.idle.lock().remove(self);
        self.requests.fetch_add(1, Ordering::AcqRel);
        UnderWay(Arc::clone(self))
    }
}

/// A request under way, from its head until its answer has been sent.
#[derive(Debug)]
pub(crate) struct UnderWay(Arc<Activity>);

impl Drop for UnderWay {
    fn drop(&mut self) {
        let mut waiting = self.0.idle.lock();
        if !self.0.gone.load(Ordering::Acquire) {
            waiting.insert(&self.0);
        }
    }
}
