//! What has come to the keyframe graph since a relaxation of it began.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Isometry3, Vector6};

use super::tuning;
use geometry::MotionSum;
use state::{CorruptState, State, StateReader, StateWriter, state_of_struct};

/// What has come since a relaxation began, of the graph as it was then.
#[derive(Clone, Debug, Default)]
pub(super) struct Meanwhile {
    /// Records.
    records: u32,
    /// What agents have done, by number.
    agents: BTreeMap<u32, AgentSince>,
    /// Numbers of keyframes that the relaxation does not concern, since they came later, or any
    /// more, since they have moved. A number may have been another one's when it began.
    pub(super) keyframes: BTreeSet<u32>,
    /// Numbers of constraints that came later.
    pub(super) constraints: BTreeSet<u32>,
}

/// What an agent has done since.
#[derive(Clone, Debug)]
struct AgentSince {
    /// Stamp of its first record \[ns\].
    first_ns: Option<i64>,
    /// Its motion; `None` if it has been put elsewhere.
    motion: Option<MotionSum>,
}

state_of_struct!(AgentSince { first_ns, motion });

impl Default for AgentSince {
    fn default() -> Self {
        Self {
            first_ns: None,
            motion: Some(MotionSum::default()),
        }
    }
}

impl Meanwhile {
    /// Counts a record of an agent, with its stamp.
    pub(super) fn note(&mut self, agent: u32, stamp_ns: i64) {
        self.records = self.records.saturating_add(1);
        let first_ns = &mut self.agents.entry(agent).or_default().first_ns;
        // A clock that begins anew with a session counts from there.
        *first_ns = Some(first_ns.map_or(stamp_ns, |first_ns| first_ns.min(stamp_ns)));
    }

    /// Whether the outcome, for a graph of so many keyframes, is to come into force with a record
    /// of an agent.
    pub(super) fn is_over(&self, agent: u32, stamp_ns: i64, n_keyframes: usize) -> bool {
        let first_ns = self.agents.get(&agent).and_then(|since| since.first_ns);
        let passed_ns = first_ns.map_or(0, |first_ns| stamp_ns.saturating_sub(first_ns));
        let longer = n_keyframes as f64 / f64::from(tuning::RELAXED_IN_TIME);
        let longer = longer.max(1.0);
        passed_ns as f64 >= longer * tuning::RELAXATION_DELAY_NS as f64
            || f64::from(self.records) >= longer * f64::from(tuning::RELAXATION_RECORDS_MAX)
    }

    /// An agent moved.
    pub(super) fn go(&mut self, agent: u32, increment: &Isometry3<f64>, variance: &Vector6<f64>) {
        if let Some(motion) = &mut self.agents.entry(agent).or_default().motion {
            motion.append(increment, variance);
        }
    }

    /// An agent may have been moved, with these variances.
    pub(super) fn inflate(&mut self, agent: u32, variance: &Vector6<f64>) {
        if let Some(motion) = &mut self.agents.entry(agent).or_default().motion {
            motion.inflate(variance);
        }
    }

    /// An agent was put elsewhere: where it was says no longer where it is.
    pub(super) fn cut(&mut self, agent: u32) {
        self.agents.entry(agent).or_default().motion = None;
    }

    /// The motion of an agent; `None` if it was put elsewhere.
    pub(super) fn motion(&self, agent: u32) -> Option<MotionSum> {
        let since = self.agents.get(&agent);
        since.map_or_else(|| Some(MotionSum::default()), |since| since.motion.clone())
    }

    /// Whether one that was read from a checkpoint of a graph with so many agents is sound.
    pub(super) fn is_sound(&self, agents: usize) -> bool {
        self.agents.keys().all(|&agent| (agent as usize) < agents)
    }
}

impl State for Meanwhile {
    fn write(&self, out: &mut StateWriter) {
        self.records.write(out);
        let count = u32::try_from(self.agents.len()).expect("agents are numbered by u32");
        count.write(out);
        for (agent, since) in &self.agents {
            agent.write(out);
            since.write(out);
        }
        for numbers in [&self.keyframes, &self.constraints] {
            numbers.iter().copied().collect::<Vec<u32>>().write(out);
        }
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let records = State::read(input)?;
        let agents: Vec<(u32, AgentSince)> = State::read(input)?;
        let keyframes: Vec<u32> = State::read(input)?;
        let constraints: Vec<u32> = State::read(input)?;
        Ok(Self {
            records,
            agents: agents.into_iter().collect(),
            keyframes: keyframes.into_iter().collect(),
            constraints: constraints.into_iter().collect(),
        })
    }
}
