//! A robot that keeps sending while things happen to the service, and the run that nothing
//! happened to, for comparison.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use cogmap_client::{Api, ApiError, Robot};
use cogmap_proto::{Sample, SeqRange, StampedPose};
use cogmap_tests::{Drive, LONG, Server, batch};

/// Samples in one call of the client.
const CALL_SAMPLES: usize = 25;
/// Pause between two calls: some two thousand samples a second, on an idle machine.
const CALL_PAUSE: Duration = Duration::from_millis(12);

/// A thread that sends a drive until it is told to stop.
pub(crate) struct Feeder {
    robot: Arc<Robot>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<Vec<Sample>>>,
}

impl Feeder {
    pub(crate) fn start(robot: Robot, drive: Drive) -> Self {
        let (robot, stop) = (Arc::new(robot), Arc::new(AtomicBool::new(false)));
        let thread = {
            let (robot, stop) = (Arc::clone(&robot), Arc::clone(&stop));
            thread::spawn(move || {
                let (mut drive, mut sent) = (drive, Vec::new());
                while !stop.load(Ordering::Relaxed) {
                    let samples: Vec<_> = drive.by_ref().take(CALL_SAMPLES).collect();
                    robot.send_batch(samples.clone()).unwrap();
                    sent.extend(samples);
                    thread::sleep(CALL_PAUSE);
                }
                sent
            })
        };
        Self {
            robot,
            stop,
            thread: Some(thread),
        }
    }

    pub(crate) fn robot(&self) -> &Robot {
        &self.robot
    }

    /// The largest number below which the client has been told that everything is on disk.
    pub(crate) fn told(&self) -> u64 {
        self.robot.watermark().map_or(0, |mark| mark.durable)
    }

    /// Stops sending, waits until all is durable, and returns what was sent.
    pub(crate) fn finish(mut self) -> Vec<Sample> {
        self.stop.store(true, Ordering::Relaxed);
        let sent = self.thread.take().unwrap().join().unwrap();
        self.robot.flush(LONG).unwrap();
        sent
    }
}

impl Drop for Feeder {
    fn drop(&mut self) {
        // After a failure nobody waits for the thread, but it must not send for ever.
        self.stop.store(true, Ordering::Relaxed);
    }
}

/// Whether the service still has every sample of which the client was told that it is on disk.
pub(crate) fn has_kept(api: &Api, agent: &str, session: u64, told: u64) -> Result<(), String> {
    let mark = match api.agent("default", agent) {
        Ok(agent) => agent.watermark,
        Err(ApiError::Problem(problem)) if problem.status == 404 && told == 0 => return Ok(()),
        Err(error) => return Err(error.to_string()),
    };
    if told > 0 && (mark.session != session || mark.durable < told) {
        return Err(format!("told {told} of session {session}, kept {mark:?}"));
    }
    Ok(())
}

/// What became of an agent's samples: the map and the way, with the bits of every number.
#[derive(Debug, PartialEq)]
pub(crate) struct Outcome {
    digest: String,
    map_revision: u64,
    poses: Vec<(i64, [u64; 3], [u64; 4])>,
}

impl Outcome {
    /// Reads it from a service, where the agent is the only one of the space `default`.
    pub(crate) fn read(api: &Api, agent: &str) -> Self {
        let info = api.space("default").unwrap();
        let poses = api.trajectory("default", agent).unwrap().poses;
        let bits = |pose: StampedPose| {
            let (translation, rotation) = (pose.translation_m, pose.rotation_xyzw);
            let rotation = rotation.map(f64::to_bits);
            (pose.stamp_ns, translation.map(f64::to_bits), rotation)
        };
        Self {
            digest: info.digest,
            map_revision: info.map_revision,
            poses: poses.into_iter().map(bits).collect(),
        }
    }

    /// That of a service to which nothing happens, sent the samples over HTTP, one request after
    /// the other.
    pub(crate) fn undisturbed(agent: &str, session: u64, samples: &[Sample]) -> Self {
        let mut server = Server::start(&[]);
        post_all(&server, agent, session, samples);
        let outcome = Self::read(&server.api(), agent);
        server.terminate();
        outcome
    }
}

/// Sends samples over HTTP; each request returns when its samples are durable.
pub(crate) fn post_all(server: &Server, agent: &str, session: u64, samples: &[Sample]) {
    let api = server.api();
    let mut first_seq = 0;
    for samples in samples.chunks(1000) {
        let batch = batch(session, first_seq, samples.to_vec());
        first_seq += samples.len() as u64;
        let answer = api.post_samples("default", agent, &batch).unwrap();
        assert_eq!(answer.watermark.durable, first_seq);
    }
}

/// Asserts that the service has all samples of the only agent exactly once: none lost, none
/// refused, none twice.
pub(crate) fn assert_exactly_once(server: &Server, agent: &str, session: u64, sent: usize) {
    let detail = server.api().agent("default", agent).unwrap();
    let (mark, sent) = (detail.watermark, sent as u64);
    assert_eq!(
        (mark.session, mark.applied, mark.durable),
        (session, sent, sent)
    );
    assert_eq!(
        (mark.gap, mark.rejected, detail.lag_samples),
        (None, vec![], 0)
    );
    let info = server.api().space("default").unwrap();
    // One record for the agent's enrolment, one for each sample.
    assert_eq!(info.map_revision, sent + 1);
}

/// The runs of sequence numbers in an exported journal, of one agent and session, joined.
pub(crate) fn journaled(journal: &str, session: u64) -> Vec<SeqRange> {
    let mut runs: Vec<SeqRange> = Vec::new();
    for line in journal.lines() {
        let entry: serde_json::Value = serde_json::from_str(line).unwrap();
        assert!(entry.get("Skip").is_none(), "{line}");
        let Some(samples) = entry.get("Samples") else {
            continue;
        };
        let batch = &samples["batch"];
        assert_eq!(batch["session"], session);
        let from = batch["first_seq"].as_u64().unwrap();
        let to = from + batch["samples"].as_array().unwrap().len() as u64;
        match runs.last_mut() {
            Some(last) if last.to == from => last.to = to,
            _ => runs.push(SeqRange { from, to }),
        }
    }
    runs
}

/// Number from an environment variable, for drills longer than the gate has time for.
pub(crate) fn setting(name: &str, default: u64) -> u64 {
    std::env::var(name).map_or(default, |value| value.parse().unwrap())
}
