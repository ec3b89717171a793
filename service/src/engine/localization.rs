//! Localisation of samples that belong to no agent: beside the writers, a few at once, and not for ever.

use std::sync::Arc;
use std::time::Duration;

use cognitive_map::{CognitiveMap, Localization, Sample};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, oneshot};

use super::space::{Space, Unavailable};

/// Most at once, of all spaces: each keeps a processor busy and changes a copy of what it touches of its map.
const AT_ONCE_MAX: usize = 4;

/// Longest time until an answer: less than the ten seconds after which Zenoh and the Python client stop waiting for one.
const TIME_MAX: Duration = Duration::from_secs(8);

/// Room for those that are under way. Clones share it.
#[derive(Clone, Debug)]
pub(crate) struct LocalizationRoom(Arc<Semaphore>);

/// Why samples were not localised.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LocalizeError {
    /// As many as there may be at once are under way.
    #[error("{AT_ONCE_MAX} sequences of samples are being localised already")]
    Busy,
    /// It takes too long.
    #[error("no answer within {} s; fewer samples may have one", .0.as_secs_f64())]
    Overdue(Duration),
    /// The work ended with a panic.
    #[error("the work was interrupted")]
    Interrupted,
    /// The map cannot be read.
    #[error(transparent)]
    Unavailable(#[from] Unavailable),
}

impl Default for LocalizationRoom {
    fn default() -> Self {
        Self(Arc::new(Semaphore::new(AT_ONCE_MAX)))
    }
}

impl LocalizationRoom {
    /// Room for one more, if there is any.
    pub(crate) fn enter(&self) -> Result<OwnedSemaphorePermit, LocalizeError> {
        let permit = Arc::clone(&self.0).try_acquire_owned();
        permit.map_err(|_| LocalizeError::Busy)
    }
}

impl Space {
    /// Where samples were taken, and the map that says so. What is already in the map answers; it learns nothing.
    ///
    /// # Errors
    /// See [`LocalizeError`].
    pub async fn localize(
        &self,
        samples: Vec<Sample>,
    ) -> Result<(Arc<CognitiveMap>, Localization), LocalizeError> {
        self.localize_within(samples, TIME_MAX).await
    }

    /// [`Self::localize`] with another bound of time. Who no longer waits for the answer, for that reason or another,
    /// lets the work end with the next sample; until then it takes up its room.
    pub(super) async fn localize_within(
        &self,
        samples: Vec<Sample>,
        time_max: Duration,
    ) -> Result<(Arc<CognitiveMap>, Localization), LocalizeError> {
        let permit = self.localization_room().enter()?;
        let found = async {
            let map = self.snapshot().await?;
            let (reply, found) = oneshot::channel();
            tokio::task::spawn_blocking(move || {
                let wanted = samples.iter().take_while(|_| !reply.is_closed());
                let localization = map.localize(wanted);
                drop(permit);
                // Whoever waited may have gone.
                let _ = reply.send((map, localization));
            });
            found.await.map_err(|_| LocalizeError::Interrupted)
        };
        let found = tokio::time::timeout(time_max, found).await;
        found.map_err(|_| LocalizeError::Overdue(time_max))?
    }
}
