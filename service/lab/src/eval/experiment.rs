//! Many runs side by side.

use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread::ScopedJoinHandle;

use super::protocol::Protocol;
use super::run::{Keep, Path, Run, RunError};

/// Runs of one protocol that differ by their seeds.
#[derive(Clone, Debug)]
pub struct Experiment {
    pub(super) protocol: Protocol,
    /// In the order of their seeds; at least one.
    pub(super) runs: Vec<Run>,
}

/// Why there is no experiment.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ExperimentError {
    /// No runs.
    #[error("an experiment needs at least one run")]
    NoRuns,
    /// The last seed would be larger than any number.
    #[error("there are not as many seeds from {seed} on")]
    Seeds {
        /// The first seed.
        seed: u64,
    },
    /// A run failed.
    #[error("run with seed {seed}")]
    Run {
        /// Its seed.
        seed: u64,
        /// Why.
        source: RunError,
    },
}

impl Experiment {
    /// Makes `runs` runs with the seeds from `seed` on, on so many threads. What comes out does not
    /// depend on their number. `walked` is called from any of them, with the number of steps since
    /// it was last called there; all calls together make runs × steps.
    ///
    /// # Errors
    /// There is nothing to run, or a run failed; of several, that of the lowest seed is told.
    pub fn run(
        protocol: &Protocol,
        runs: u32,
        seed: u64,
        threads: NonZeroUsize,
        walked: &(impl Fn(u64) + Sync),
    ) -> Result<Self, ExperimentError> {
        let wrong = |source| ExperimentError::Run { seed, source };
        protocol.check().map_err(|e| wrong(RunError::from(e)))?;
        if runs == 0 {
            return Err(ExperimentError::NoRuns);
        }
        if seed.checked_add(u64::from(runs) - 1).is_none() {
            return Err(ExperimentError::Seeds { seed });
        }
        let next = AtomicU32::new(0);
        let work = || {
            let mut done = Vec::new();
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                if index >= runs {
                    return done;
                }
                let keep = if index == 0 {
                    Keep::Path
                } else {
                    Keep::Measures
                };
                let seed = seed + u64::from(index);
                done.push((seed, Run::new(protocol, seed, keep, walked)));
            }
        };
        let mut done = std::thread::scope(|scope| {
            let threads = threads.get().min(runs as usize);
            let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
            let finished = workers.into_iter().map(ScopedJoinHandle::join);
            finished
                .flat_map(|done| done.unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
                .collect::<Vec<_>>()
        });
        done.sort_by_key(|(seed, _)| *seed);
        let runs = done
            .into_iter()
            .map(|(seed, run)| run.map_err(|source| ExperimentError::Run { seed, source }))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Self {
            protocol: protocol.clone(),
            runs,
        })
    }

    /// The first run in full.
    pub fn path(&self) -> Option<&Path> {
        self.runs.first()?.path.as_ref()
    }

    /// The protocol.
    pub fn protocol(&self) -> &Protocol {
        &self.protocol
    }
}
