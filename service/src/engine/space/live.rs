//! Watching a space live: what changed from tick to tick, made of what its writer publishes.

use std::collections::{BTreeMap, VecDeque};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Weak};
use std::time::{Duration, Instant};

use cogmap_proto::{LiveAgent, LiveHealth, LiveTick};

use super::Space;
use crate::encode;
use crate::engine::agent_view::{AgentView, Lag, Readout};
use crate::engine::events::{EVENTS_KEPT, EventFollower};
use crate::engine::live::{Live, Watcher};
use crate::engine::shared::Shared;
use crate::engine::unavailable::Unavailable;

/// Time over which the rate of samples is measured.
const RATE_SPAN: Duration = Duration::from_secs(1);

/// Somebody who watches a space live. Each tick is made when it is asked for, and has what changed
/// since the one before, so a reader who is slow costs the writer nothing and misses no change.
#[derive(Debug)]
pub struct LiveFollower {
    /// The writer does not live longer because somebody watches.
    shared: Weak<Shared>,
    live: Arc<Live>,
    watcher: Watcher,
    events: EventFollower,
    told: BTreeMap<String, Told>,
    rate: Rate,
}

/// What was said of an agent last.
#[derive(Debug)]
struct Told {
    readout: Arc<Readout>,
    lag_samples: u64,
}

/// Samples applied by a time, the oldest first, for their rate.
#[derive(Debug, Default)]
struct Rate(VecDeque<(Instant, u64)>);

impl Space {
    /// Watches the space live, from now on.
    ///
    /// # Errors
    /// The space is still loading, could not be loaded, or closes.
    pub async fn watch(&self) -> Result<LiveFollower, Unavailable> {
        let events = self.follow(None)?;
        let shared = self.shared();
        let watcher = Watcher::new(&shared.live);
        // The writer keeps the sizes up to date from now on, and has not while nobody watched.
        let map = self.snapshot().await?;
        shared.live.note_counts(encode::live_counts(&map));
        Ok(LiveFollower {
            shared: Arc::downgrade(shared),
            live: Arc::clone(&shared.live),
            watcher,
            events,
            told: BTreeMap::new(),
            rate: Rate::default(),
        })
    }
}

impl LiveFollower {
    /// What changed since the last call, or all of it in the first one; nothing when the space is
    /// gone. The memory of the process is left open.
    pub fn take(&mut self, now: Instant) -> Option<LiveTick> {
        let shared = self.shared.upgrade()?;
        // Before all else, so that it promises no more than there is.
        let map_revision = shared.revision.load(Ordering::Acquire);
        let views: Vec<Arc<AgentView>> = shared.agents().values().cloned().collect();
        drop(shared);
        let totals = &self.live.totals;
        let mut health = LiveHealth {
            samples_per_s: self.rate.note(now, totals.applied.get()),
            dropped_messages: totals.dropped.get(),
            skipped_samples: totals.skipped.get(),
            duplicate_samples: totals.duplicates.get(),
            ..LiveHealth::default()
        };
        let mut before = std::mem::take(&mut self.told);
        let mut agents = Vec::new();
        for view in views {
            let Lag {
                waiting,
                not_durable,
            } = view.lag();
            health.waiting_samples += waiting;
            health.not_durable_samples += not_durable;
            let Some(readout) = view.readout() else {
                continue; // before its first sample
            };
            let lag_samples = waiting + not_durable;
            let told = before.remove(view.name());
            let is_same = told.is_some_and(|told| {
                Arc::ptr_eq(&told.readout, &readout) && told.lag_samples == lag_samples
            });
            if !is_same {
                agents.push(LiveAgent {
                    lag_samples,
                    contacts: readout.contacts,
                    session_ended: readout.session_ended,
                    heard_ago_s: view.heard_ago_s(),
                    ..LiveAgent::of(&readout.estimate)
                });
            }
            let told = Told {
                readout,
                lag_samples,
            };
            self.told.insert(view.name().to_owned(), told);
        }
        let followed = self.events.take(EVENTS_KEPT);
        Some(LiveTick {
            map_revision,
            agents,
            removed: before.into_keys().collect(),
            events: { followed.events.iter() }
                .map(|event| (**event).clone())
                .collect(),
            missed: followed.missed,
            sightings: self.watcher.take_sightings(),
            counts: self.live.counts(),
            health,
        })
    }

    /// Returns when the space is gone.
    pub async fn gone(&mut self) {
        self.events.gone().await;
    }
}

impl Rate {
    /// Notes the number of samples until now, and gives their rate \[1/s\] since the latest time
    /// that is at least [`RATE_SPAN`] ago, or the first one.
    fn note(&mut self, now: Instant, applied: u64) -> Option<f64> {
        let is_old = |(at, _): &(Instant, u64)| now.saturating_duration_since(*at) >= RATE_SPAN;
        while self.0.get(1).is_some_and(is_old) {
            self.0.pop_front();
        }
        let rate = self.0.front().and_then(|(at, before)| {
            let seconds = now.saturating_duration_since(*at).as_secs_f64();
            (seconds > 0.0).then(|| applied.saturating_sub(*before) as f64 / seconds)
        });
        self.0.push_back((now, applied));
        rate
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rate_is_that_of_about_the_last_second() {
        let (mut rate, start) = (Rate::default(), Instant::now());
        let at = |ms: u64| start + Duration::from_millis(ms);
        assert_eq!(rate.note(at(0), 500), None);
        assert_eq!(rate.note(at(500), 550), Some(100.0));
        for tick in 1..=40 {
            rate.note(at(500 + 100 * tick), 550 + 20 * tick);
        }
        // Twenty in a tenth of a second, for four seconds by now.
        assert_eq!(rate.note(at(4600), 1370), Some(200.0));
        assert!(rate.0.len() < 14, "{}", rate.0.len());
        assert_eq!(rate.note(at(9600), 1370), Some(0.0));
    }
}
