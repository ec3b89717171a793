//! What a code told of the places.

use std::fmt::{self, Display, Formatter};
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::ScopedJoinHandle;

use cognitive_map::{CognitiveMap, InvalidSample};
use serde::Serialize;

use super::condition::Condition;
use super::cue::{CueSource, Damage};
use super::protocol::CodeProtocol;
use super::survey::survey;
use super::theory::CodeTheory;
use crate::eval::experiment::ExperimentError;
use crate::eval::protocol::InvalidProtocol;

/// An answer farther from the truth than this is another part of the room \[m\].
const FAR_M: f64 = 0.5;

/// Why a code was not measured.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CodeError {
    /// The protocol makes no sense.
    #[error(transparent)]
    Protocol(#[from] InvalidProtocol),
    /// A run in a room failed.
    #[error(transparent)]
    Experiment(#[from] ExperimentError),
    /// The map refused a sample.
    #[error("the survey made a sample that the map refuses: {0}")]
    Sample(#[from] InvalidSample),
}

/// A code and how well it told places apart.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CodeReport {
    /// Number of grid modules.
    pub grid_modules: usize,
    /// Spacing of the finest grid module \[m\].
    pub grid_spacing_m: f64,
    /// Ratio of the spacings of neighbouring modules.
    pub grid_ratio: f64,
    /// Number of places.
    pub places: u64,
    /// Standard deviation of noise on each phase component of a noisy code \[turns\].
    pub phase_noise_turns: f64,
    /// Standard deviation, along each axis, of a jittered code's position from the place \[m\].
    pub jitter_m: f64,
    /// Seed of places and cues.
    pub seed: u64,
    /// What follows from the spacings.
    pub theory: CodeTheory,
    /// One for each [`Condition`] that the code allows.
    pub rows: Vec<CodeRow>,
}

/// What was measured under one condition.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CodeRow {
    /// What was wrong with the codes.
    pub condition: &'static str,
    /// Number of cues.
    pub queries: u64,
    /// Share of the cues that recalled the place nearest to the true position.
    pub right: f64,
    /// The same share for the choice of erased modules that has the lowest.
    pub right_worst: f64,
    /// Share of the cues that recalled a place more than half a metre from the true position.
    pub beyond_half_m: f64,
    /// Mean number of places elsewhere that answered nearly as well (the map's `rivals`).
    pub rivals: f64,
}

/// What one kind of damage did.
#[derive(Clone, Copy, Debug, Default)]
struct Count {
    queries: u64,
    right: u64,
    beyond: u64,
    rivals: u64,
}

impl CodeReport {
    /// Builds the map and recalls its places, on so many threads; the outcome does not depend on
    /// their number. `recalled` is called from any of them with the number of cues since it was
    /// last called there.
    ///
    /// # Errors
    /// The protocol makes no sense.
    pub fn measure(
        protocol: &CodeProtocol,
        threads: NonZeroUsize,
        recalled: &(impl Fn(u64) + Sync),
    ) -> Result<Self, CodeError> {
        Self::measure_under(&Condition::ALL, protocol, threads, recalled)
    }

    /// [`CodeReport::measure`] under some of the conditions.
    ///
    /// # Errors
    /// The protocol makes no sense.
    pub fn measure_under(
        conditions: &[Condition],
        protocol: &CodeProtocol,
        threads: NonZeroUsize,
        recalled: &(impl Fn(u64) + Sync),
    ) -> Result<Self, CodeError> {
        protocol.check()?;
        let settings = protocol.map_settings()?;
        let theory = CodeTheory::of(&settings, protocol.phase_noise_turns, protocol.places);
        let map = survey(protocol.places, settings, protocol.seed)?;
        let mut jobs = Vec::new();
        for (row, condition) in conditions.iter().enumerate() {
            let damages = condition.damages(protocol);
            let queries = u64::from(protocol.queries).div_ceil(damages.len().max(1) as u64);
            jobs.extend(damages.into_iter().map(|damage| (row, damage, queries)));
        }
        let next = AtomicUsize::new(0);
        let work = || {
            let mut done = Vec::new();
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                let Some((row, damage, queries)) = jobs.get(index) else {
                    return done;
                };
                let cues = CueSource::new(protocol.seed, index as u64);
                done.push((index, *row, Count::of(&map, cues, damage, *queries)));
                recalled(*queries);
            }
        };
        let mut done = std::thread::scope(|scope| {
            let threads = threads.get().min(jobs.len());
            let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
            let finished = workers.into_iter().map(ScopedJoinHandle::join);
            finished
                .flat_map(|done| done.unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
                .collect::<Vec<_>>()
        });
        done.sort_by_key(|(index, ..)| *index);
        let rows = conditions
            .iter()
            .enumerate()
            .filter_map(|(row, condition)| {
                let of_row = done.iter().filter(|(_, of, _)| *of == row);
                CodeRow::of(condition.name, of_row.map(|(_, _, count)| *count))
            });
        Ok(Self {
            grid_modules: protocol.settings.grid_modules,
            grid_spacing_m: protocol.settings.grid_spacing_m,
            grid_ratio: protocol.settings.grid_ratio,
            places: protocol.places,
            phase_noise_turns: protocol.phase_noise_turns,
            jitter_m: protocol.jitter_m,
            seed: protocol.seed,
            theory,
            rows: rows.collect(),
        })
    }

    /// Number of cues that a measurement under some conditions takes, for those who watch.
    pub fn queries(conditions: &[Condition], protocol: &CodeProtocol) -> u64 {
        let of_condition = |condition: &Condition| {
            let damages = condition.damages(protocol).len() as u64;
            damages * u64::from(protocol.queries).div_ceil(damages.max(1))
        };
        conditions.iter().map(of_condition).sum()
    }

    /// The row of a condition, by name.
    pub fn row(&self, condition: &str) -> Option<&CodeRow> {
        self.rows.iter().find(|row| row.condition == condition)
    }
}

impl Count {
    fn of(map: &CognitiveMap, mut cues: CueSource, damage: &Damage, queries: u64) -> Self {
        let mut count = Self::default();
        for _ in 0..queries {
            let Some(drawn) = cues.draw(map, damage) else {
                continue;
            };
            count.queries += 1;
            let recalled = map.recall(&drawn.cue);
            let Some(best) = recalled.first() else {
                continue;
            };
            let nearest = map.nearest_place(&drawn.position);
            count.right += u64::from(nearest.is_some_and(|(id, _)| id == best.place));
            let near = map
                .place(best.place)
                .is_some_and(|place| (place.position() - drawn.position).norm() <= FAR_M);
            count.beyond += u64::from(!near);
            let rivals = map.rivals(&drawn.cue, best);
            count.rivals += rivals.map_or(0, |rivals| rivals.count as u64);
        }
        count
    }
}

impl CodeRow {
    /// Of the counts of all choices; `None` when there is none.
    fn of(condition: &'static str, counts: impl Iterator<Item = Count>) -> Option<Self> {
        let mut sum = Count::default();
        let mut right_worst = f64::INFINITY;
        for count in counts {
            sum.queries += count.queries;
            sum.right += count.right;
            sum.beyond += count.beyond;
            sum.rivals += count.rivals;
            right_worst = right_worst.min(count.right as f64 / count.queries as f64);
        }
        let share = |part: u64| part as f64 / sum.queries as f64;
        (sum.queries > 0).then(|| Self {
            condition,
            queries: sum.queries,
            right: share(sum.right),
            right_worst,
            beyond_half_m: share(sum.beyond),
            rivals: share(sum.rivals),
        })
    }
}

impl Display for CodeReport {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self { theory, .. } = self;
        writeln!(
            f,
            "{} modules, finest spacing {} m, ratio {}: spacings {} m",
            self.grid_modules,
            self.grid_spacing_m,
            self.grid_ratio,
            theory
                .spacings_m
                .iter()
                .map(|spacing_m| format!("{spacing_m:.2}"))
                .collect::<Vec<_>>()
                .join(", ")
        )?;
        writeln!(
            f,
            "{} places; jitter {} m along each axis, noise {} turns on each phase component",
            self.places, self.jitter_m, self.phase_noise_turns
        )?;
        writeln!(
            f,
            "\n{:<22} {:>8} {:>9} {:>13} {:>9} {:>9}",
            "code", "queries", "right", "worst choice", "> 0.5 m", "rivals"
        )?;
        for row in &self.rows {
            writeln!(
                f,
                "{:<22} {:>8} {:>9.4} {:>13.4} {:>9.4} {:>9.3}",
                row.condition,
                row.queries,
                row.right,
                row.right_worst,
                row.beyond_half_m,
                row.rivals
            )?;
        }
        let [whole, one, two] = theory.expected_better;
        writeln!(
            f,
            "\nwith that noise:\n\
             Fisher information along each axis [1/m²]    {:>10.1}\n\
             least standard deviation along each axis [m] {:>10.4}\n\
             unique within [m]                            {:>10.1}\n\
             places far away that explain a code better   {whole:>10.1e} (one erased {one:.1e}, two {two:.1e})\n\
             score falls with distance alone up to [m]    {:>10.2}",
            theory.fisher_information_per_m2,
            theory.position_sd_m,
            theory.unique_range_m,
            theory.monotone_m
        )
    }
}
