//! Lower bounds for the search of routes, made beside the writer.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use cognitive_map::{CognitiveMap, RouteBounds};

/// Fewest ways of a map for which bounds are worth making: in a smaller one a search takes less
/// than a millisecond without.
const WAYS_MIN: usize = 2048;
/// Most waypoints that a question brings up to date: about a millisecond. What changed more is made
/// anew beside the questions.
const FOLLOWED_MAX: usize = 2048;

/// The latest bounds of a space. They make searches shorter and change no answer.
#[derive(Debug, Default)]
pub(super) struct RouteBoundsOfSpace {
    latest: Mutex<Option<RouteBounds>>,
    is_making: AtomicBool,
}

impl RouteBoundsOfSpace {
    /// The bounds for a map, if there are any that soon are up to date. Otherwise another thread
    /// makes them from the map, for later questions.
    pub(super) fn of(self: &Arc<Self>, map: &CognitiveMap) -> Option<RouteBounds> {
        if map.way_count() < WAYS_MIN {
            return None;
        }
        // A clone shares what is not changed.
        let latest = self.latest().clone();
        if let Some(mut bounds) = latest
            && bounds.follow(map, FOLLOWED_MAX)
        {
            self.keep(bounds.clone());
            return Some(bounds);
        }
        self.make(map.clone());
        None
    }

    /// Makes bounds, unless somebody does already.
    fn make(self: &Arc<Self>, map: CognitiveMap) {
        if self.is_making.swap(true, Ordering::AcqRel) {
            return;
        }
        let this = Arc::clone(self);
        tokio::task::spawn_blocking(move || {
            // Also when the making ends with a panic.
            let making = Making(&this.is_making);
            this.keep(RouteBounds::straight(&map)); // soon made, for questions in the meantime
            this.keep(RouteBounds::of(&map));
            drop(making);
        });
    }

    /// Keeps bounds, unless there are later ones; those with pivots are kept before those without.
    fn keep(&self, bounds: RouteBounds) {
        let mut latest = self.latest();
        let rank = |bounds: &RouteBounds| (bounds.has_pivots(), bounds.revision());
        let is_better = |known: &RouteBounds| rank(known) <= rank(&bounds);
        if latest.as_ref().is_none_or(is_better) {
            *latest = Some(bounds);
        }
    }

    fn latest(&self) -> MutexGuard<'_, Option<RouteBounds>> {
        self.latest.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Somebody makes bounds, until it is dropped.
struct Making<'a>(&'a AtomicBool);

impl Drop for Making<'_> {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Release);
    }
}

#[cfg(test)]
mod tests {
    use cognitive_map::{
        AgentId, Label, Motion, PlaceId, Record, Route, RouteOptions, Sample, SampleBody, Settings,
    };

    use super::*;

    /// A robot that goes straight on, three metres each ten steps.
    fn go_on(map: &mut CognitiveMap, seqs: std::ops::Range<u64>) {
        let motion = Motion::from_increment([0.3, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], None);
        let body = SampleBody::Motion(motion.expect("finite"));
        for seq in seqs {
            let stamp_ns = i64::try_from(seq).expect("small") * 100_000_000;
            let body = body.clone();
            let record = Record::Sample {
                agent: AgentId(0),
                session: 1,
                seq,
                sample: Sample { stamp_ns, body },
            };
            map.apply(&record, &mut Vec::new());
        }
    }

    fn route(map: &CognitiveMap, bounds: Option<&RouteBounds>) -> Vec<Route> {
        let [from, to] = [3, 2000].map(|number| map.route_end_at(PlaceId(number)));
        let (from, to) = (from.expect("a place"), to.expect("a place"));
        let options = RouteOptions::default();
        let found = map.routes(&from, &to, &options, bounds, &mut || false);
        found.expect("one way leads there")
    }

    #[tokio::test]
    async fn bounds_are_made_beside_questions_and_follow_the_map() {
        let mut map = CognitiveMap::new(Settings::default());
        let name = Label::new("rover").expect("a name");
        let agent = AgentId(0);
        map.apply(&Record::Enrol { agent, name }, &mut Vec::new());
        go_on(&mut map, 0..100);
        let of_space = Arc::new(RouteBoundsOfSpace::default());
        assert!(of_space.of(&map).is_none(), "so small a map needs none");
        assert!(!of_space.is_making.load(Ordering::Acquire));
        go_on(&mut map, 100..2_200);
        assert!(of_space.of(&map).is_none(), "they are being made");
        let made = loop {
            tokio::time::sleep(std::time::Duration::from_millis(5)).await;
            // Those that are soon made come first.
            if let Some(made) = of_space.of(&map).filter(RouteBounds::has_pivots) {
                break made;
            }
        };
        assert_eq!(made.revision(), map.revision());
        let before = map.clone();
        go_on(&mut map, 2_200..2_300);
        let followed = of_space.of(&map).expect("little has changed");
        assert_eq!(followed.revision(), map.revision());
        assert_eq!(route(&map, Some(&followed)), route(&map, None));
        // A question to an earlier map has none, and spoils none.
        assert!(of_space.of(&before).is_none());
        assert!(of_space.of(&map).is_some());
    }
}
