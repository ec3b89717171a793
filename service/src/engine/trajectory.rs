//! Causal trajectories: each pose as it was known when its sample was applied.
//!
//! ```text
//! chunk  = version:u8  row*            at most 256 rows
//! row    = stamp_ns:i64  x y z qx qy qz qw : f64        little endian, 64 bytes
//! ```

use ::trajectory::StampedPose;
use cognitive_map::{Agent, CognitiveMap, Record, SampleBody};

use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

/// Rows of a full chunk.
const CHUNK_ROWS: usize = 256;
/// Version of chunks that this build writes.
const VERSION: u8 = 1;
const ROW_BYTES: usize = 64;

/// The part of an agent's trajectory that is not yet a full chunk.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Recorder {
    session: u64,
    /// The last of them may be provisional: the newest pose, until one that is far enough from the
    /// row before takes its place.
    rows: Vec<StampedPose>,
    /// Stamp of the latest row of the session that stays, also after its chunk has been handed out.
    latest_ns: Option<i64>,
}

/// A recorder as it is stored: session, stamp of the latest row that stays, and rows as a chunk has
/// them.
type PlainRecorder = (u64, Option<i64>, Vec<u8>);

/// Rows that are complete: a full chunk, or the rest of an ended session.
#[derive(Clone, Debug, PartialEq)]
pub struct Chunk {
    /// Session.
    pub session: u64,
    /// Rows; at least one.
    pub rows: Vec<StampedPose>,
}

/// Rows of an agent's trajectory, oldest first.
#[derive(Clone, Debug, PartialEq)]
pub struct TrajectoryPage {
    /// Session of a causal trajectory; the current one where it is refined.
    pub session: u64,
    /// Revision of the relaxed map that a refined trajectory is of; none of a causal one.
    pub revision: Option<u64>,
    /// The rows.
    pub poses: Vec<StampedPose>,
    /// Stamp of the first row of the next page, if there is one \[ns\].
    pub next_from_ns: Option<i64>,
}

/// The poses on both sides of a stamp.
#[derive(Clone, Debug, PartialEq)]
pub struct Around {
    /// Session of a causal trajectory; the current one where it is refined.
    pub session: u64,
    /// Revision of the relaxed map that a refined trajectory is of; none of a causal one.
    pub revision: Option<u64>,
    /// The latest one that is not after the stamp.
    pub before: StampedPose,
    /// The earliest one that is not before it.
    pub after: StampedPose,
}

impl Around {
    /// The ones among rows in the order of their stamps; `None` where they do not reach.
    pub(crate) fn of(
        rows: &[StampedPose],
        session: u64,
        revision: Option<u64>,
        stamp_ns: i64,
    ) -> Option<Self> {
        let next = rows.partition_point(|row| row.stamp_ns < stamp_ns);
        let after = *rows.get(next)?;
        let before = if after.stamp_ns == stamp_ns {
            after
        } else {
            *rows.get(next.checked_sub(1)?)?
        };
        Some(Self {
            session,
            revision,
            before,
            after,
        })
    }
}

/// Chunk bytes that cannot be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("malformed trajectory chunk")]
pub(crate) struct CorruptChunk;

impl Recorder {
    /// Notes the pose of `agent` after a record has been applied to it, if the record moved or
    /// corrected it. Rows that stay are at least `interval_ns` apart; a pose that is nearer to the
    /// latest of them is the last row until the next one. A start pose or a sighting at the stamp
    /// of the latest row replaces that row. An agent that is not placed has no pose in the map, and
    /// no rows. Returns a chunk when one is complete, and what is left when the session has ended
    /// or the agent is removed.
    pub fn note(&mut self, record: &Record, agent: &Agent, interval_ns: i64) -> Option<Chunk> {
        let (session, sample) = match record {
            Record::Sample {
                session, sample, ..
            } => (session, sample),
            Record::Remove { .. } => {
                let rest = self.take();
                *self = Self::default();
                return rest;
            }
            _ => return None,
        };
        let jumped = match sample.body {
            SampleBody::Motion(_) => false,
            SampleBody::StartPose(_) | SampleBody::Sighting(_) => true,
            _ => return None,
        };
        let mut complete = None;
        if *session != self.session {
            complete = self.take();
            self.session = *session;
            self.latest_ns = None;
        }
        if !agent.placed() {
            return complete;
        }
        let row = StampedPose {
            stamp_ns: sample.stamp_ns,
            pose: *agent.pose(),
        };
        match self.latest_ns {
            Some(latest) if jumped && latest == sample.stamp_ns => match self.rows.last_mut() {
                Some(last) => *last = row,
                None => return complete, // the replaced row is already in a chunk: keep the first
            },
            Some(latest) if sample.stamp_ns <= latest => return complete,
            Some(latest) if sample.stamp_ns.saturating_sub(latest) < interval_ns => {
                self.drop_provisional();
                self.rows.push(row);
                return complete;
            }
            _ => {
                self.drop_provisional();
                self.rows.push(row);
                self.latest_ns = Some(sample.stamp_ns);
            }
        }
        if self.rows.len() == CHUNK_ROWS {
            self.take()
        } else {
            complete
        }
    }

    /// Session of the rows.
    pub fn session(&self) -> u64 {
        self.session
    }

    /// Rows that are not yet in a chunk, up to the newest pose.
    pub fn rows(&self) -> &[StampedPose] {
        &self.rows
    }

    fn drop_provisional(&mut self) {
        let last_ns = self.rows.last().map(|row| row.stamp_ns);
        if last_ns.is_some() && last_ns != self.latest_ns {
            self.rows.pop();
        }
    }

    fn take(&mut self) -> Option<Chunk> {
        if self.rows.is_empty() {
            return None;
        }
        Some(Chunk {
            session: self.session,
            rows: std::mem::take(&mut self.rows),
        })
    }

    /// Bytes of the recorders of all agents, for a checkpoint.
    pub(crate) fn write_all(recorders: &[Self]) -> Vec<u8> {
        let plain: Vec<_> = recorders
            .iter()
            .map(|r| (r.session, r.latest_ns, chunk_bytes(&r.rows)))
            .collect();
        postcard::to_stdvec(&plain).expect("plain data encodes")
    }

    /// Reads what [`Recorder::write_all`] wrote, and gives the bytes after it.
    pub(crate) fn read_all(bytes: &[u8]) -> Result<(Vec<Self>, &[u8]), CorruptChunk> {
        let (plain, rest): (Vec<PlainRecorder>, _) =
            postcard::take_from_bytes(bytes).map_err(|_| CorruptChunk)?;
        let recorders: Result<_, _> = plain
            .into_iter()
            .map(|(session, latest_ns, rows)| {
                Ok(Self {
                    session,
                    rows: chunk_rows(&rows)?,
                    latest_ns,
                })
            })
            .collect();
        Ok((recorders?, rest))
    }
}

/// A map whose trajectories are noted as it grows: what the engine and an offline replay share.
pub(crate) fn note_all(
    recorders: &mut Vec<Recorder>,
    map: &CognitiveMap,
    record: &Record,
    interval_ns: i64,
) -> Option<(u32, Chunk)> {
    let (Record::Sample { agent, .. } | Record::Remove { agent }) = record else {
        return None;
    };
    // First, for a number that nobody has says nothing of how many there are.
    let of_map = map.agent(*agent)?;
    let index = agent.0 as usize;
    if recorders.len() <= index {
        recorders.resize_with(index + 1, Recorder::default);
    }
    let chunk = recorders[index].note(record, of_map, interval_ns)?;
    Some((agent.0, chunk))
}

/// Bytes of a chunk.
pub(crate) fn chunk_bytes(rows: &[StampedPose]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(1 + rows.len() * ROW_BYTES);
    bytes.push(VERSION);
    for row in rows {
        bytes.extend_from_slice(&row.stamp_ns.to_le_bytes());
        let (position, rotation) = (&row.pose.translation.vector, &row.pose.rotation.coords);
        for number in position.iter().chain(rotation) {
            bytes.extend_from_slice(&number.to_le_bytes());
        }
    }
    bytes
}

/// Rows of a chunk.
pub(super) fn chunk_rows(bytes: &[u8]) -> Result<Vec<StampedPose>, CorruptChunk> {
    let (&version, rows) = bytes.split_first().ok_or(CorruptChunk)?;
    if version != VERSION || rows.len() % ROW_BYTES != 0 {
        return Err(CorruptChunk);
    }
    let eight = |row: &[u8], at: usize| -> [u8; 8] {
        row[8 * at..8 * at + 8].try_into().expect("eight bytes")
    };
    Ok(rows
        .chunks_exact(ROW_BYTES)
        .map(|row| {
            let number = |at| f64::from_le_bytes(eight(row, at));
            let [i, j, k, w] = [4, 5, 6, 7].map(number);
            // It was one when it was written, and is to be the same to the last bit.
            let rotation = UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k));
            let translation = Translation3::from([1, 2, 3].map(number));
            StampedPose {
                stamp_ns: i64::from_le_bytes(eight(row, 0)),
                pose: Isometry3::from_parts(translation, rotation),
            }
        })
        .collect())
}
