//! Drives the team and the arm in time, and tells what comes of it.

use std::collections::BTreeMap;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use anyhow::Context;
use cogmap_client::{Api, open_session};
use cogmap_proto::{Codec, Estimate, Event, RecallQuery, events_key};
use cogmap_worlds::{ARM, Act, AgentTick, ReadingBody, Scenario, ScenarioSettings};
use zenoh::pubsub::Subscriber;
use zenoh::{Session, Wait};

use super::Stop;
use super::agents::{DemoAgent, TIMEOUT, Traffic, remove};
use super::progress::Progress;
use super::story::Story;
use super::summary::{Latency, RobotSummary, Summary};

/// Pause between two looks at the service, as an operator's screen would take them.
const LOOK_INTERVAL: Duration = Duration::from_millis(200);
/// How long the service may take to say its last after everything is durable.
const LAST_WORD: Duration = Duration::from_millis(300);

/// The scenario, its connections, and what has come of it.
pub(super) struct Drive {
    scenario: Scenario,
    api: Api,
    session: Session,
    space: String,
    agents: BTreeMap<String, DemoAgent>,
    story: Story,
    estimates: (Sender<Estimate>, Receiver<Estimate>),
    events: Receiver<Event>,
    /// Dropping it undeclares.
    subscriber: Subscriber<()>,
    localise: Latency,
    recall: Latency,
    /// Of agents that have been switched off.
    ended: BTreeMap<String, RobotSummary>,
    traffic: Traffic,
    progress: Progress,
}

impl Drive {
    /// Connects with so many robots, a seed and a duration \[s\].
    pub(super) fn connect(
        api: Api,
        endpoint: &str,
        space: &str,
        (n_robots, seed, duration_s): (u32, u64, f64),
    ) -> anyhow::Result<Self> {
        let now = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .context("read the clock")?;
        let epoch_ns = i64::try_from(now.as_nanos()).context("read the clock")?;
        let scenario = Scenario::new(ScenarioSettings {
            seed,
            n_robots,
            epoch_ns,
            duration_s,
        })?;
        let session = open_session(&[endpoint], TIMEOUT)?;
        let (told, events) = channel();
        let subscriber = session
            .declare_subscriber(events_key(space))
            .callback(move |message| {
                let codec = Codec::of_encoding(&message.encoding().to_string());
                let event =
                    codec.and_then(|codec| codec.decode::<Event>(&message.payload().to_bytes()));
                // What cannot be read is of a service of another version; nobody may listen.
                if let Ok(event) = event {
                    let _ = told.send(event);
                }
            })
            .wait()
            .map_err(anyhow::Error::from_boxed)?;
        let story = Story::new(epoch_ns, scenario.world().side_m());
        Ok(Self {
            story,
            progress: Progress::new(n_robots, Duration::from_secs_f64(duration_s)),
            scenario,
            api,
            session,
            space: space.to_owned(),
            agents: BTreeMap::new(),
            estimates: channel(),
            events,
            subscriber,
            localise: Latency::default(),
            recall: Latency::default(),
            ended: BTreeMap::new(),
            traffic: Traffic::default(),
        })
    }

    /// Drives to the end on the robots' clock, which goes so many times as fast as real time, or
    /// until `stop` is set.
    pub(super) fn run(&mut self, speed: f64, stop: &Stop) -> anyhow::Result<()> {
        let pause = Duration::from_secs_f64(1.0 / (Scenario::RATE_HZ * speed));
        let start = Instant::now();
        let (mut due, mut next_look, mut looked_at) = (start, start, 0);
        self.set_out();
        while self.scenario.has_more() && !stop.load(Ordering::Relaxed) {
            self.tick()?;
            self.listen();
            if Instant::now() >= next_look {
                self.look(looked_at)?;
                looked_at += 1;
                next_look = Instant::now() + LOOK_INTERVAL;
                let lines: Vec<_> = self.agents.values().map(DemoAgent::line).collect();
                let elapsed = Duration::from_secs_f64(self.scenario.elapsed_s());
                self.progress.show(elapsed, &lines);
            }
            due += pause;
            std::thread::sleep(due.saturating_duration_since(Instant::now()));
        }
        self.progress.finish();
        Ok(())
    }

    fn set_out(&self) {
        let told: Vec<_> = self.scenario.told_robots().collect();
        let verb = if told.len() == 1 { "sets" } else { "set" };
        let text = format!(
            "{} {verb} out in a hall of {} m with {} tags, told where they start",
            told.join(", "),
            self.scenario.world().side_m(),
            self.scenario.world().beacons().len()
        );
        let line = self.story.line(self.scenario.stamp_ns(), &text);
        self.progress.say(&line);
    }

    fn tick(&mut self) -> anyhow::Result<()> {
        let stamp_ns = self.scenario.stamp_ns();
        let tick = self.scenario.tick();
        for act in &tick.acts {
            let (Act::SwitchedOff { robot } | Act::WokenUp { robot }) = act else {
                continue;
            };
            self.switch_off(robot)?;
            remove(&self.api, &self.space, robot)?;
        }
        for act in &tick.acts {
            let robot = match act {
                Act::CarriedOff { robot, .. } | Act::WokenUp { robot } => Some(robot),
                _ => None,
            };
            let truth = robot.and_then(|robot| {
                let agent = tick.agents.iter().find(|agent| agent.name == *robot)?;
                Some(agent.truth.pose.translation.vector)
            });
            let line = self.story.act(act, stamp_ns, truth);
            self.progress.say(&line);
        }
        for agent in &tick.agents {
            self.send(agent)?;
        }
        Ok(())
    }

    fn send(&mut self, of_agent: &AgentTick) -> anyhow::Result<()> {
        let name = &of_agent.name;
        if !self.agents.contains_key(name) {
            let heard = self.estimates.0.clone();
            let agent = DemoAgent::switch_on(&self.session, &self.space, of_agent, heard)?;
            self.agents.insert(name.clone(), agent);
        }
        for reading in &of_agent.readings {
            if matches!(reading.body, ReadingBody::Contact { .. }) {
                self.story.contact(reading.stamp_ns);
            }
        }
        match self.agents.get_mut(name) {
            Some(agent) => agent.send(of_agent),
            None => Ok(()),
        }
    }

    /// Hears what the service has said since, and tells what is worth it.
    fn listen(&mut self) {
        while let Ok(estimate) = self.estimates.1.try_recv() {
            let agent = self.agents.get(&estimate.agent);
            if let Some(error_m) = agent.and_then(|agent| agent.error_m(&estimate))
                && let Some(line) = self.story.estimate(&estimate, error_m)
            {
                self.progress.say(&line);
            }
        }
        while let Ok(event) = self.events.try_recv() {
            if let Some(line) = self.story.event(&event) {
                self.progress.say(&line);
            }
        }
    }

    /// Asks where a robot is, and which places are near it, and notes how long that took.
    fn look(&mut self, number: usize) -> anyhow::Result<()> {
        let names: Vec<_> = self.agents.keys().filter(|name| *name != ARM).collect();
        let Some(name) = names.get(number % names.len().max(1)) else {
            return Ok(());
        };
        let start = Instant::now();
        let Ok(agent) = self.api.agent(&self.space, name) else {
            return Ok(()); // its first samples are still on their way
        };
        self.localise.note(start.elapsed());
        let Some(estimate) = agent.estimate else {
            return Ok(());
        };
        let query = RecallQuery {
            position_m: Some(estimate.translation_m),
            ..RecallQuery::default()
        };
        let start = Instant::now();
        self.api.recall(&self.space, &query)?;
        self.recall.note(start.elapsed());
        Ok(())
    }

    fn switch_off(&mut self, name: &str) -> anyhow::Result<()> {
        let Some(agent) = self.agents.remove(name) else {
            return Ok(());
        };
        let (robot, traffic) = agent.switch_off(&self.api, &self.space)?;
        self.traffic.add(&traffic);
        if name != ARM {
            self.ended.insert(name.to_owned(), robot);
        }
        Ok(())
    }

    /// Waits until everything is durable, and sums up.
    pub(super) fn finish(mut self) -> anyhow::Result<Summary> {
        for agent in self.agents.values() {
            agent.flush()?;
        }
        std::thread::sleep(LAST_WORD);
        self.listen();
        let names: Vec<String> = self.agents.keys().cloned().collect();
        for name in &names {
            self.switch_off(name)?;
        }
        let info = self.api.space(&self.space)?;
        drop(self.subscriber);
        self.session
            .close()
            .wait()
            .map_err(anyhow::Error::from_boxed)?;
        let (searches, objects) = self.story.end();
        // A robot that is switched off when the demo ends is summed up as it was then.
        let robots: Vec<_> = self.ended.into_values().collect();
        let mean = |of: fn(&RobotSummary) -> Option<f64>| {
            let errors: Vec<f64> = robots.iter().filter_map(of).collect();
            (!errors.is_empty()).then(|| errors.iter().sum::<f64>() / errors.len() as f64)
        };
        Ok(Summary {
            samples_sent: self.traffic.sent,
            samples_applied: self.traffic.applied,
            samples_durable: self.traffic.durable,
            samples_resent: self.traffic.resent,
            duplicates: None,
            dead_reckoning_ate_rmse_m: mean(|robot| robot.dead_reckoning_ate_rmse_m),
            causal_ate_rmse_m: mean(|robot| robot.causal_ate_rmse_m),
            places: info.places,
            trips: info.trips,
            landmarks: info.landmarks,
            localise: self.localise.summary(),
            recall: self.recall.summary(),
            digest: info.digest,
            robots,
            searches,
            objects,
        })
    }
}
