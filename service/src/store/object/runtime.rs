//! Waits for what is asynchronous, on threads that are not.

use std::future::Future;

use tokio::runtime::{Builder, Handle};

use super::super::StoreError;

/// Threads of the database: uploads, compaction, collection of garbage.
const THREADS: usize = 2;

/// A runtime of its own, so that a service that is busy answering delays no write.
#[derive(Debug)]
pub(super) struct Runtime(Option<tokio::runtime::Runtime>);

impl Runtime {
    /// Starts it.
    pub(super) fn start() -> Result<Self, StoreError> {
        let runtime = Builder::new_multi_thread()
            .worker_threads(THREADS)
            .thread_name("object-store")
            .enable_all()
            .build();
        let runtime = runtime.map_err(|error| StoreError::Io(error.to_string()))?;
        Ok(Self(Some(runtime)))
    }

    /// Runs a future to its end, on whichever thread asks.
    pub(super) fn wait<F: Future<Output: Send> + Send>(&self, future: F) -> F::Output {
        let runtime = self.0.as_ref().expect("it runs until it is dropped");
        if Handle::try_current().is_err() {
            return runtime.block_on(future);
        }
        // A thread that drives other futures may not wait inside a runtime.
        std::thread::scope(|scope| {
            let waiting = scope.spawn(|| runtime.block_on(future));
            waiting
                .join()
                .unwrap_or_else(|panic| std::panic::resume_unwind(panic))
        })
    }
}

impl Drop for Runtime {
    fn drop(&mut self) {
        if let Some(runtime) = self.0.take() {
            runtime.shutdown_background();
        }
    }
}
