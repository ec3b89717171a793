//! A replay straight into the core.
//!
//! The past is relaxed between two samples, as soon as a relaxation begins, and is timed apart: a
//! service has threads for it. Its writer waits for one only where the outcome is needed sooner.

use std::collections::BTreeMap;
use std::time::Instant;

use cogmap_proto::{SampleBatch, SpaceSettings};
use cognitive_map::{AgentId, CognitiveMap, Record, SampleKey, ViewMatch};

use super::outcome::{MatchedViews, Outcome, RobotOutcome};
use super::team::TeamBatch;
use cogmap::decode::{core_settings, records_of, trajectory_interval_ns};
use cogmap::encode::{evidence, stamped};
use cogmap::engine::{Recorder, refined_trajectories};
use cogmap::journal::Entry;

/// Time between two beliefs that are kept \[ns\].
const BELIEF_INTERVAL_NS: i64 = 1_000_000_000;

/// Folds the batches, in order, as a service would that got them in this order.
pub(super) fn replay(batches: &[TeamBatch], settings: &SpaceSettings) -> anyhow::Result<Outcome> {
    let mut map = CognitiveMap::new(core_settings(settings)?);
    let interval_ns = trajectory_interval_ns(settings);
    let mut team: BTreeMap<&str, Robot> = BTreeMap::new();
    let mut events = Vec::new();
    let mut samples = 0;
    let mut times_s = Vec::new();
    let mut relaxations = Relaxations::default();
    for TeamBatch {
        robot,
        samples: batch,
    } in batches
    {
        samples += batch.len() as u64;
        let number = u32::try_from(team.len())?;
        let robot = team
            .entry(robot)
            .or_insert_with(|| Robot::enrol(number, robot, &mut map));
        let batch = SampleBatch {
            session: 1,
            first_seq: robot.next,
            samples: batch.clone(),
        };
        robot.next += batch.samples.len() as u64;
        let stamps_ns = batch.samples.iter().map(|sample| sample.stamp_ns);
        robot.stamps_ns.extend(stamps_ns);
        records_of(
            &Entry::Samples {
                agent: robot.agent,
                batch,
            },
            |record| {
                let begin = Instant::now();
                map.apply(&record, &mut events);
                times_s.push(begin.elapsed().as_secs_f64());
                events.clear();
                relaxations.run(&map);
                robot.note(&record, &map, interval_ns);
            },
        );
    }
    let view_matches = { map.view_matches().iter() }
        .filter_map(|found| matched_views(found, &team))
        .collect();
    let mut refined = refined_trajectories(&map);
    let finish = |(name, robot): (&str, Robot)| {
        let poses = refined.remove(name).unwrap_or_default();
        (name.to_owned(), robot.finish(&map, &poses))
    };
    Ok(Outcome {
        robots: team.into_iter().map(finish).collect(),
        samples,
        digest: map.digest().to_string(),
        places: map.place_count() as u64,
        trips: map.trip_count() as u64,
        landmarks: map.landmark_count() as u64,
        closures: Some(map.closure_count() as u64),
        view_matches,
        times_s,
        relaxations_s: relaxations.times_s,
    })
}

/// A row of a trajectory as a service answers it.
fn row(row: &trajectory::StampedPose) -> cogmap_proto::StampedPose {
    stamped(row.stamp_ns, &row.pose)
}

/// A match of views with the names of the robots and the stamps.
fn matched_views(found: &ViewMatch, team: &BTreeMap<&str, Robot>) -> Option<MatchedViews> {
    let seen = |key: &SampleKey| {
        let (name, robot) = team.iter().find(|(_, robot)| robot.agent == key.agent)?;
        let stamp_ns = robot.stamps_ns.get(usize::try_from(key.seq).ok()?)?;
        Some(((*name).to_owned(), *stamp_ns))
    };
    Some(MatchedViews {
        seen: [seen(&found.now)?, seen(&found.then)?],
        range_m: found.range_m,
        probability: found.probability(),
    })
}

/// The relaxations that a map began.
#[derive(Default)]
struct Relaxations {
    /// What each took \[s\].
    times_s: Vec<f64>,
}

impl Relaxations {
    /// Relaxes the past of the map, if that has begun and nobody has done it yet.
    fn run(&mut self, map: &CognitiveMap) {
        if let Some(job) = map.relaxation().filter(|job| !job.is_done()) {
            let begin = Instant::now();
            job.run();
            self.times_s.push(begin.elapsed().as_secs_f64());
        }
    }
}

#[derive(Default)]
struct Robot {
    agent: u32,
    next: u64,
    /// Of its samples, by their numbers.
    stamps_ns: Vec<i64>,
    recorder: Recorder,
    outcome: RobotOutcome,
}

impl Robot {
    /// Enrols a robot.
    fn enrol(agent: u32, name: &str, map: &mut CognitiveMap) -> Self {
        let name = name.into();
        records_of(&Entry::Enrol { agent, name }, |record| {
            map.apply(&record, &mut Vec::new());
        });
        Self {
            agent,
            ..Self::default()
        }
    }

    /// What came of it, with its refined trajectory.
    fn finish(mut self, map: &CognitiveMap, refined: &[trajectory::StampedPose]) -> RobotOutcome {
        let rest = self.recorder.rows();
        self.outcome.causal.extend(rest.iter().map(row));
        self.outcome.refined = refined.iter().map(row).collect();
        let agent = map.agent(AgentId(self.agent));
        self.outcome.evidence = agent.map(evidence).unwrap_or_default();
        self.outcome
    }

    /// Notes where the agent is after a record.
    fn note(&mut self, record: &Record, map: &CognitiveMap, interval_ns: i64) {
        let id = AgentId(self.agent);
        let Some((agent, covariance)) = map.agent(id).zip(map.covariance(id)) else {
            return;
        };
        if let Some(chunk) = self.recorder.note(record, agent, interval_ns) {
            self.outcome.causal.extend(chunk.rows.iter().map(row));
        }
        let Some(stamp_ns) = agent.stamp_ns().filter(|_| agent.placed()) else {
            return;
        };
        let beliefs = &mut self.outcome.beliefs;
        let is_due = |(last, _): &(cogmap_proto::StampedPose, _)| {
            stamp_ns.saturating_sub(last.stamp_ns) >= BELIEF_INTERVAL_NS
        };
        if beliefs.last().is_none_or(is_due) {
            beliefs.push((stamped(stamp_ns, agent.pose()), covariance));
        }
    }
}
