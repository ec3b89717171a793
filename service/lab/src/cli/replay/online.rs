//! A replay through a running service: in over Zenoh, out over HTTP.
//!
//! One sender keeps the whole team's order, which a robot's own client would not: the order in
//! which robots meet the shared map is part of what the map becomes.

use std::collections::{BTreeMap, VecDeque};
use std::time::{Duration, Instant};

use anyhow::{Context, bail, ensure};
use cogmap_client::{Api, open_session};
use cogmap_proto::{Codec, SampleBatch, SpaceSettings, Watermark, durable_key, samples_key};
use std::sync::mpsc::{Receiver, channel};
use zenoh::qos::CongestionControl;
use zenoh::{Session, Wait};

use super::outcome::{Outcome, RobotOutcome};
use super::team::TeamBatch;

/// Bytes under way: so few of a robot wait at the service in the order in which they came, beside
/// those of other robots. Of who sends more, the service takes some at a time.
const BYTES_AHEAD_MAX: usize = 64 << 10;
/// What a message counts beside its bytes.
const MESSAGE_BYTES: usize = 64;
/// Without an acknowledgement for this long the replay gives up.
const PATIENCE: Duration = Duration::from_secs(30);
/// Longest wait for the service to be there.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(10);

/// The service.
pub(super) struct Target<'a> {
    pub(super) endpoint: &'a str,
    pub(super) http: &'a str,
    pub(super) token: Option<&'a str>,
    pub(super) space: &'a str,
}

/// Sends the batches, in order, waits until all are durable, and reads what became of them.
pub(super) fn replay(
    batches: &[TeamBatch],
    settings: &SpaceSettings,
    target: &Target<'_>,
) -> anyhow::Result<Outcome> {
    let api = Api::new(target.http, target.token);
    let space = target.space;
    ensure!(
        api.space(space).is_err(),
        "the space {space:?} exists: its map would not be that of the replay alone"
    );
    api.create_space(space, settings)
        .context("create the space")?;
    let session = open_session(&[target.endpoint], CONNECT_TIMEOUT)?;
    let samples = send(&session, space, batches)?;
    session.close().wait().map_err(anyhow::Error::from_boxed)?;
    let info = api.space(space)?;
    let mut robots = BTreeMap::new();
    for agent in api.agents(space)? {
        let robot = RobotOutcome {
            causal: api.trajectory(space, &agent.name)?.poses,
            refined: api.refined_trajectory(space, &agent.name)?.poses,
            evidence: api.agent(space, &agent.name)?.evidence,
            beliefs: Vec::new(),
        };
        robots.insert(agent.name, robot);
    }
    Ok(Outcome {
        robots,
        samples,
        digest: info.digest,
        places: info.places,
        trips: info.trips,
        landmarks: info.landmarks,
        closures: None,
        view_matches: Vec::new(),
        times_s: Vec::new(),
        relaxations_s: Vec::new(),
    })
}

fn send(session: &Session, space: &str, batches: &[TeamBatch]) -> anyhow::Result<u64> {
    let (note, watermarks) = channel();
    let _subscriber = session
        .declare_subscriber(durable_key(space, "*"))
        .callback(move |sample| {
            let robot = sample
                .key_expr()
                .as_str()
                .split('/')
                .nth(2)
                .unwrap_or_default()
                .to_owned();
            let encoding = sample.encoding().to_string();
            let watermark = Codec::of_encoding(&encoding)
                .and_then(|codec| codec.decode::<Watermark>(&sample.payload().to_bytes()));
            if let Ok(watermark) = watermark {
                // The replay may be over.
                let _ = note.send((robot, watermark));
            }
        })
        .wait()
        .map_err(anyhow::Error::from_boxed)?;
    let mut sent: BTreeMap<&str, u64> = BTreeMap::new();
    let mut durable: BTreeMap<String, u64> = BTreeMap::new();
    let mut ahead = Ahead::default();
    let mut samples = 0;
    for batch in batches {
        let next = sent.entry(&batch.robot).or_default();
        let message = SampleBatch {
            session: 1,
            first_seq: *next,
            samples: batch.samples.clone(),
        };
        *next += batch.samples.len() as u64;
        samples += batch.samples.len() as u64;
        let message = Codec::Postcard.encode(&message);
        let bytes = message.len() + MESSAGE_BYTES;
        if ahead.bytes + bytes > BYTES_AHEAD_MAX {
            await_durable(&watermarks, &mut durable, &mut ahead, BYTES_AHEAD_MAX / 2)?;
        }
        session
            .put(samples_key(space, &batch.robot), message)
            .encoding(Codec::Postcard.encoding())
            .congestion_control(CongestionControl::Block)
            .wait()
            .map_err(anyhow::Error::from_boxed)?;
        ahead.bytes += bytes;
        ahead.messages.push_back((&batch.robot, *next, bytes));
    }
    await_durable(&watermarks, &mut durable, &mut ahead, 0)?;
    Ok(samples)
}

/// Messages that are not yet durable.
#[derive(Default)]
struct Ahead<'a> {
    /// Robot, the number after its last sample, and bytes of each.
    messages: VecDeque<(&'a str, u64, usize)>,
    bytes: usize,
}

/// Waits until messages of at most `left` bytes are not yet durable.
fn await_durable(
    watermarks: &Receiver<(String, Watermark)>,
    durable: &mut BTreeMap<String, u64>,
    ahead: &mut Ahead<'_>,
    left: usize,
) -> anyhow::Result<()> {
    let mut deadline = Instant::now() + PATIENCE;
    while ahead.bytes > left {
        let patience = deadline.saturating_duration_since(Instant::now());
        let Ok((robot, watermark)) = watermarks.recv_timeout(patience) else {
            bail!(
                "{} messages were not acknowledged within {PATIENCE:?}",
                ahead.messages.len()
            );
        };
        if let Some(gap) = watermark.gap {
            bail!(
                "samples {} to {} of {robot} did not arrive",
                gap.from,
                gap.to
            );
        }
        durable.insert(robot, watermark.durable);
        let before = ahead.bytes;
        while let Some((robot, next, bytes)) = ahead.messages.front()
            && durable.get(*robot).is_some_and(|durable| durable >= next)
        {
            ahead.bytes -= bytes;
            ahead.messages.pop_front();
        }
        if ahead.bytes < before {
            deadline = Instant::now() + PATIENCE;
        }
    }
    Ok(())
}
