//! Which agents of a set are replayed, in which spaces, and what came of it.

use std::collections::BTreeSet;

use cogmap_lab::csv::{Choice, Log, RowBody, TableSet, Truth};
use cogmap_lab::eval::sequences::Calibration;
use cogmap_lab::stream::Stream;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use trajectory::{Alignment, StampedPosition, Trajectory};

use super::arguments::ReplayArgs;
use super::case::Case;
use super::csv_waking::{Sighted, Waking};
use super::outcome::{Outcome, RobotOutcome};
use super::report::Report;
use super::scoring::{Pairing, Scoring};
use super::team::{Known, Team};

/// Which agents share a space.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Sharing {
    /// None: each has one of its own.
    #[default]
    Nobody,
    /// All, one after the other.
    InTurn,
    /// All, in order of time.
    Together,
}

/// Which agents of a set are replayed, and what they send.
#[derive(Clone, Debug, Default)]
pub(super) struct Selection {
    /// These agents; all when empty.
    pub(super) only: Vec<String>,
    /// What of theirs is sent.
    pub(super) choice: Choice,
    /// Most agents.
    pub(super) max_agents: Option<usize>,
    /// Seed of a random order of the agents; they come in order of time when absent.
    pub(super) shuffle: Option<u64>,
    pub(super) sharing: Sharing,
    /// So many are told where they start; all when absent.
    pub(super) taught: Option<usize>,
}

/// A set, and the agents of it that are replayed.
#[derive(Debug)]
pub(super) struct Recording<'a> {
    set: &'a TableSet,
    selection: &'a Selection,
    /// In the order in which they are sent.
    agents: Vec<Agent<'a>>,
}

/// An agent of which the truth is known.
#[derive(Debug)]
struct Agent<'a> {
    name: &'a str,
    log: &'a Log,
    truth: &'a Truth,
}

/// What came of a recording.
#[derive(Debug)]
pub(super) struct Replayed {
    pub(super) case: Case,
    /// Of each space.
    pub(super) outcomes: Vec<Outcome>,
    pub(super) report: Report,
    /// What became of agents that woke up unknown, where only some were told their start.
    pub(super) waking: Option<Waking>,
}

impl Replayed {
    /// Each robot by name, what came out for it, and what is known of it.
    pub(super) fn robots(&self) -> impl Iterator<Item = (&str, &RobotOutcome, &Known)> {
        let teams = self.case.teams.iter().zip(&self.outcomes);
        teams.flat_map(|(team, outcome)| {
            let robots = team.robots.iter();
            robots
                .filter_map(|(name, known)| Some((name.as_str(), outcome.robots.get(name)?, known)))
        })
    }

    /// How probable matches of views were taken to be, and whether they were right: whether the
    /// robots were as near to one another as views of one place are at most.
    pub(super) fn view_matches(&self) -> Calibration {
        let mut calibration = Calibration::default();
        for (team, outcome) in self.case.teams.iter().zip(&self.outcomes) {
            let there = |(robot, stamp_ns): &(String, i64)| {
                let truth = team.robots.get(robot)?.truth.as_ref()?;
                truth.at(*stamp_ns)
            };
            for found in &outcome.view_matches {
                let [now, then] = &found.seen;
                if let Some((now, then)) = there(now).zip(there(then)) {
                    let is_right = (now - then).norm() <= found.range_m;
                    calibration.add(found.probability, is_right);
                }
            }
        }
        calibration
    }
}

impl<'a> Recording<'a> {
    /// Of the agents that are selected.
    ///
    /// # Errors
    /// An agent that is asked for is not there, or the truth of none is known.
    pub(super) fn new(set: &'a TableSet, selection: &'a Selection) -> anyhow::Result<Self> {
        for name in &selection.only {
            let is_there = set.agents.contains_key(name);
            anyhow::ensure!(is_there, "the set has no agent {name}");
        }
        let agents = agents(set, selection);
        anyhow::ensure!(!agents.is_empty(), "no agent of the set has a truth");
        Ok(Self {
            set,
            selection,
            agents,
        })
    }

    /// Sends all of it, and compares what comes out with the truth.
    ///
    /// # Errors
    /// A view is not there, a setting is none of a space, a service does not answer, or files
    /// cannot be written.
    pub(super) fn replay(&self, args: &ReplayArgs) -> anyhow::Result<Replayed> {
        let case = Case {
            start_pose: match self.selection.taught {
                None => "from the truth",
                Some(_) => "from the truth for those taught, none for the others",
            },
            teams: self.teams(args)?,
            scoring: Scoring {
                pairing: Pairing::Own,
                alignment: Alignment::Planar,
                is_recorded: true,
            },
        };
        let (report, outcomes) = case.outcomes(args)?;
        let waking = self
            .selection
            .taught
            .map(|taught| self.waking(taught, &outcomes));
        Ok(Replayed {
            case,
            outcomes,
            report,
            waking,
        })
    }

    /// Names of the agents that are told where they start.
    pub(super) fn taught(&self) -> BTreeSet<&'a str> {
        let taught = self.selection.taught.unwrap_or(usize::MAX);
        let agents = self.agents.iter().take(taught);
        agents.map(|agent| agent.name).collect()
    }

    /// What the agents send, by their spaces.
    fn teams(&self, args: &ReplayArgs) -> anyhow::Result<Vec<Team>> {
        let choice = &self.selection.choice;
        let (batch, space) = (args.batch(), args.space("csv"));
        let mut sent: Vec<(&str, Stream, Trajectory)> = Vec::new();
        for (index, agent) in self.agents.iter().enumerate() {
            let first = agent.log.rows.first().map_or(0, |row| row.stamp_ns);
            let is_told = self.selection.taught.is_none_or(|taught| index < taught);
            let start = agent.truth.start(first).filter(|_| is_told);
            let stream = self.set.stream(agent.name, start.as_ref(), choice)?;
            let positions = agent.truth.trajectory.positions().iter();
            let positions = positions.map(|row| StampedPosition {
                stamp_ns: TableSet::sent_ns(row.stamp_ns),
                ..*row
            });
            sent.push((agent.name, stream, Trajectory::new(positions)?));
        }
        if self.selection.sharing == Sharing::Nobody {
            let alone = sent.into_iter().map(|(name, stream, truth)| {
                Team::alone(format!("{space}-{name}"), name, &stream, Some(truth), batch)
            });
            return Ok(alone.collect());
        }
        let samples = sent.iter().flat_map(|(name, stream, _)| {
            let samples = stream.samples().iter().cloned();
            samples.map(|sample| ((*name).to_owned(), sample))
        });
        let mut samples: Vec<_> = samples.collect();
        if self.selection.sharing == Sharing::Together {
            samples.sort_by_key(|(_, sample)| sample.stamp_ns);
        }
        let mut team = Team::new(space, samples, batch);
        for (name, stream, truth) in sent {
            let known = Known::reckoned(stream.reckoned().to_vec(), Some(truth));
            team.robots.insert(name.to_owned(), known);
        }
        Ok(vec![team])
    }

    /// What became of those that were not taught.
    fn waking(&self, taught: usize, outcomes: &[Outcome]) -> Waking {
        let sighted = self.agents.iter().enumerate().map(|(index, agent)| {
            let came_out = { outcomes.iter() }.find_map(|outcome| outcome.robots.get(agent.name));
            Sighted {
                is_taught: index < taught,
                seen_at: self.seen_at(agent),
                claims: came_out.map(|robot| &robot.causal[..]).unwrap_or_default(),
                truth: agent.truth,
            }
        });
        Waking::of(&sighted.collect::<Vec<_>>())
    }

    /// Where an agent was at its views \[m\].
    fn seen_at(&self, agent: &Agent<'_>) -> Vec<nalgebra::Vector3<f64>> {
        let rows = agent.log.rows.iter();
        let views = rows.filter(|row| match &row.body {
            RowBody::Descriptor(channel, _) => !self.selection.choice.without.contains(channel),
            _ => false,
        });
        views
            .filter_map(|row| agent.truth.at(row.stamp_ns))
            .collect()
    }
}

/// The agents that are selected, in the order in which they are sent.
fn agents<'a>(set: &'a TableSet, selection: &Selection) -> Vec<Agent<'a>> {
    let is_asked_for = |name: &String| selection.only.is_empty() || selection.only.contains(name);
    let known = set.agents.iter().filter(|(name, _)| is_asked_for(name));
    let known = known.filter_map(|(name, log)| {
        let truth = log.truth.as_ref()?;
        Some(Agent { name, log, truth })
    });
    let mut agents: Vec<Agent<'a>> = known.collect();
    agents.sort_by_key(|agent| agent.log.rows.first().map(|row| row.stamp_ns));
    if let Some(seed) = selection.shuffle {
        agents.shuffle(&mut ChaCha8Rng::seed_from_u64(seed));
    }
    agents.truncate(selection.max_agents.unwrap_or(usize::MAX));
    agents
}
