//! Long questions to a space's map.

use std::sync::Arc;
use std::time::Duration;

use cognitive_map::{CognitiveMap, Identified, Label, Localization, RouteBounds, Sample, Touch};
use object_recognition::{ObjectId, Orientation};
use tokio::sync::oneshot;

use super::Space;
use crate::engine::question::QuestionError;

/// Longest time until an answer: less than the ten seconds after which Zenoh and the Python client
/// stop waiting for one.
const TIME_MAX: Duration = Duration::from_secs(8);
/// The same for a route or a sequence: whoever waits for one stands still.
const ROUTE_TIME_MAX: Duration = Duration::from_secs(2);

impl Space {
    /// Where samples were taken, and the map that says so. What is already in the map answers; it
    /// learns nothing.
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
    pub(in crate::engine) async fn localize_within(
        &self,
        samples: Vec<Sample>,
        time_max: Duration,
    ) -> Result<(Arc<CognitiveMap>, Localization), QuestionError> {
        self.ask(time_max, move |map, is_wanted| {
            map.localize(samples.iter().take_while(|_| is_wanted()))
        })
        .await
    }

    /// What `work` finds out about routes in the map as it is. It is given bounds that make
    /// searches shorter, and whether to give up.
    ///
    /// # Errors
    /// See [`QuestionError`].
    pub async fn routes<T: Send + 'static>(
        &self,
        work: impl FnOnce(&CognitiveMap, Option<&RouteBounds>, &mut dyn FnMut() -> bool) -> T
        + Send
        + 'static,
    ) -> Result<T, QuestionError> {
        let bounds = Arc::clone(&self.shared.route_bounds);
        let answered = self.ask(ROUTE_TIME_MAX, move |map, is_wanted| {
            let bounds = bounds.of(map);
            work(map, bounds.as_ref(), &mut || !is_wanted())
        });
        Ok(answered.await?.1)
    }

    /// What `work` finds out about sequences in the map as it is. It is told whether to give up.
    ///
    /// # Errors
    /// See [`QuestionError`].
    pub async fn sequence<T: Send + 'static>(
        &self,
        work: impl FnOnce(&CognitiveMap, &mut dyn FnMut() -> bool) -> T + Send + 'static,
    ) -> Result<T, QuestionError> {
        let answered = self.ask(ROUTE_TIME_MAX, move |map, is_wanted| {
            work(map, &mut || !is_wanted())
        });
        Ok(answered.await?.1)
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

    /// For which other object one would be taken, and how probably.
    ///
    /// # Errors
    /// See [`QuestionError`].
    pub async fn alike(
        &self,
        name: Label,
    ) -> Result<(Arc<CognitiveMap>, Option<(ObjectId, f64)>), QuestionError> {
        self.ask(TIME_MAX, move |map, _| {
            map.object_alike(map.object_by_name(&name)?)
        })
        .await
    }

    /// Answers a question by the map as it is. Who no longer waits for the answer lets the work end
    /// when it next looks whether it is wanted; until then it takes up its room.
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
