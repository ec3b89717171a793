//! A replay straight into the core.

use std::collections::BTreeMap;

use cogmap_proto::{SampleBatch, SpaceSettings, StampedPose};
use cognitive_map::CognitiveMap;

use super::mrclam::{Outcome, TeamBatch};
use crate::engine::{Entry, Recorder, core_settings, records_of, trajectory_interval_ns};

/// Folds the batches, in order, as a service would that got them in this order.
pub(super) fn replay(batches: &[TeamBatch], settings: &SpaceSettings) -> anyhow::Result<Outcome> {
    let mut map = CognitiveMap::new(core_settings(settings)?);
    let interval_ns = trajectory_interval_ns(settings);
    let mut team: BTreeMap<&str, Robot> = BTreeMap::new();
    let mut events = Vec::new();
    let mut samples = 0;
    for TeamBatch {
        robot,
        samples: batch,
    } in batches
    {
        samples += batch.len() as u64;
        let number = u32::try_from(team.len())?;
        let robot = team.entry(robot).or_insert_with(|| {
            let name = robot.as_str().into();
            records_of(
                &Entry::Enrol {
                    agent: number,
                    name,
                },
                |record| {
                    map.apply(&record, &mut events);
                },
            );
            Robot {
                agent: number,
                ..Robot::default()
            }
        });
        let batch = SampleBatch {
            session: 1,
            first_seq: robot.next,
            samples: batch.clone(),
        };
        robot.next += batch.samples.len() as u64;
        records_of(
            &Entry::Samples {
                agent: robot.agent,
                batch,
            },
            |record| {
                map.apply(&record, &mut events);
                events.clear();
                if let Some(agent) = map.agent(cognitive_map::AgentId(robot.agent))
                    && let Some(chunk) = robot.recorder.note(&record, agent, interval_ns)
                {
                    robot.trajectory.extend(chunk.rows);
                }
            },
        );
    }
    let trajectories = team
        .into_iter()
        .map(|(name, mut robot)| {
            robot.trajectory.extend_from_slice(robot.recorder.rows());
            (name.to_owned(), robot.trajectory)
        })
        .collect();
    Ok(Outcome {
        trajectories,
        samples,
        digest: map.digest().to_string(),
        places: map.place_count() as u64,
        trips: map.trip_count() as u64,
        landmarks: map.landmark_count() as u64,
    })
}

#[derive(Default)]
struct Robot {
    agent: u32,
    next: u64,
    recorder: Recorder,
    trajectory: Vec<StampedPose>,
}
