//! Long questions to a map, such as where samples were taken and what object was touched: answered
//! beside the writers, a few at once, and not for ever.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use super::unavailable::Unavailable;

/// Most at once, of all spaces: each keeps a processor busy.
const AT_ONCE_MAX: usize = 4;

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
