//! Long questions to a map, such as where samples were taken and what object was touched: answered beside the writers, a few
//! at once, and not for ever.

use std::sync::Arc;
use std::time::Duration;

use cognitive_map::{CognitiveMap, Identified, Localization, Sample, Touch};
use object_recognition::Orientation;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, oneshot};

use super::space::{Space, Unavailable};

/// Most at once, of all spaces: each keeps a processor busy.
const AT_ONCE_MAX: usize = 4;

/// Longest time until an answer: less than the ten seconds after which Zenoh and the Python client stop waiting for one.
const TIME_MAX: Duration = Duration::from_secs(8);

/// Most relaxations for those who ask for the past at once, of all spaces.
const RELAXATIONS_MAX: usize = 2;

/// Room for those that are under way. Clones share it.
#[derive(Clone, Debug)]
pub(crate) struct QuestionRoom {
    questions: Arc<Semaphore>,
    relaxations: Arc<Semaphore>,
}

/// Why a question was not answered.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum QuestionError {
    /// As many as there may be at once are under way.
    #[error("{AT_ONCE_MAX} long questions are being answered already")]
    Busy,
    /// It takes too long.
    #[error("no answer within {} s; a shorter question may have one", .0.as_secs_f64())]
    Overdue(Duration),
    /// The work ended with a panic.
    #[error("the work was interrupted")]
    Interrupted,
    /// The map cannot be read.
    #[error(transparent)]
    Unavailable(#[from] Unavailable),
}

impl Default for QuestionRoom {
    fn default() -> Self {
        Self {
            questions: Arc::new(Semaphore::new(AT_ONCE_MAX)),
            relaxations: Arc::new(Semaphore::new(RELAXATIONS_MAX)),
        }
    }
}

impl QuestionRoom {
    /// Room for one more, if there is any.
    pub(crate) fn enter(&self) -> Result<OwnedSemaphorePermit, QuestionError> {
        let permit = Arc::clone(&self.questions).try_acquire_owned();
        permit.map_err(|_| QuestionError::Busy)
    }

    /// Waits until a map may be relaxed.
    pub(super) async fn relaxation(&self) -> OwnedSemaphorePermit {
        let turn = Arc::clone(&self.relaxations).acquire_owned().await;
        turn.expect("nobody closes the semaphore")
    }
}

impl Space {
    /// Where samples were taken, and the map that says so. What is already in the map answers; it learns nothing.
    ///
    /// # Errors
    /// See [`QuestionError`].
    pub async fn localize(
        &self,
        samples: Vec<Sample>,
    ) -> Result<(Arc<CognitiveMap>, Localization), QuestionError> {
        self.localize_within(samples, TIME_MAX).await
    }

    /// [`Self::localize`] with another bound of time.
    pub(super) async fn localize_within(
        &self,
        samples: Vec<Sample>,
        time_max: Duration,
    ) -> Result<(Arc<CognitiveMap>, Localization), QuestionError> {
        self.ask(time_max, move |map, is_wanted| {
            map.localize(samples.iter().take_while(|_| is_wanted()))
        })
        .await
    }

    /// Which object a sequence of contacts is of.
    ///
    /// # Errors
    /// See [`QuestionError`].
    pub async fn identify(
        &self,
        orientation: Orientation,
        touches: Vec<Touch>,
    ) -> Result<(Arc<CognitiveMap>, Identified), QuestionError> {
        self.ask(TIME_MAX, move |map, _| map.identify(&orientation, &touches))
            .await
    }

    /// Answers a question by the map as it is. Who no longer waits for the answer lets the work end when it next looks whether it
    /// is wanted; until then it takes up its room.
    async fn ask<T: Send + 'static>(
        &self,
        time_max: Duration,
        work: impl FnOnce(&CognitiveMap, &dyn Fn() -> bool) -> T + Send + 'static,
    ) -> Result<(Arc<CognitiveMap>, T), QuestionError> {
        let permit = self.question_room().enter()?;
        let answered = async {
            let map = self.snapshot().await?;
            let (reply, answer) = oneshot::channel();
            tokio::task::spawn_blocking(move || {
                let found = work(&map, &|| !reply.is_closed());
                drop(permit);
                // Whoever waited may have gone.
                let _ = reply.send((map, found));
            });
            answer.await.map_err(|_| QuestionError::Interrupted)
        };
        let answered = tokio::time::timeout(time_max, answered).await;
        answered.map_err(|_| QuestionError::Overdue(time_max))?
    }
}
