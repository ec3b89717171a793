//! What a set of recordings measures, by its kind.

use std::collections::BTreeMap;

use cogmap_client::Api;
use cogmap_lab::csv::{Choice, Log, RowBody, TableSet, Truth};
use cogmap_lab::eval::sequences::Calibration;
use serde::Serialize;

use super::arguments::ReplayArgs;
use super::csv_waking::Waking;
use super::errors::{Errors, median};
use super::position_claims::{PositionClaims, Start};
use super::recording::{Recording, Selection, Sharing};
use super::sequence_recall::{SequenceQuestions, SequenceRecall};
use super::set_kind::SetKind;
use super::setting::{Setting, settings};

/// Most sessions of a set that are sent.
const SESSIONS_MAX: usize = 300;
/// Of three sessions, so many are told where they start.
const TAUGHT_OF_THREE: usize = 2;
/// Views of a question.
const QUESTION_VIEWS: u32 = 10;
/// An answer is right that is no farther off than so many steps from one view to the next.
const RIGHT_WITHIN_STEPS: f64 = 3.0;

/// How sets are measured, whatever they hold.
#[derive(Clone, Debug)]
pub(super) struct Measuring {
    /// What of them is sent.
    pub(super) choice: Choice,
    /// Seed of the order of sessions.
    pub(super) seed: u64,
    /// The agent whose route is remembered, in sets that have it; elsewhere the first by name.
    pub(super) taught: Option<String>,
    /// Settings of spaces that are not the default.
    pub(super) setting: Vec<Setting>,
}

/// What a set measures.
#[derive(Debug, Serialize)]
pub(super) struct Measured {
    #[serde(flatten)]
    pub(super) figures: Figures,
    /// What covariances promised of live positions.
    pub(super) positions: Vec<PositionClaims>,
    /// How probable matches of views were taken to be that the maps held in the end.
    pub(super) view_matches: Calibration,
}

/// The figures of a set.
#[derive(Debug, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub(super) enum Figures {
    /// Of agents that were told where they start.
    Told { agents: BTreeMap<String, Errors> },
    /// Of agents that woke up where others had been told where they start.
    Sessions {
        taught: usize,
        #[serde(flatten)]
        waking: Waking,
    },
    /// Of agents that were recognised on another one's route.
    Route(SequenceRecall),
}

impl Measuring {
    /// Measures a set of agents with motion.
    ///
    /// # Errors
    /// The truth of no agent is known, or a view is not there.
    pub(super) fn replay(&self, set: &TableSet, kind: SetKind) -> anyhow::Result<Measured> {
        let mut selection = Selection {
            choice: self.choice.clone(),
            ..Selection::default()
        };
        if kind == SetKind::Sessions {
            let known = set.agents.values().filter(|log| log.truth.is_some());
            let sent = known.count().min(SESSIONS_MAX);
            selection.max_agents = Some(sent);
            selection.shuffle = Some(self.seed);
            selection.sharing = Sharing::InTurn;
            selection.taught = Some(TAUGHT_OF_THREE * sent / 3);
        }
        let recording = Recording::new(set, &selection)?;
        let replayed = recording.replay(&ReplayArgs::in_core(&self.setting))?;
        let mut positions = BTreeMap::<Start, PositionClaims>::new();
        let taught = recording.taught();
        for (robot, came_out, known) in replayed.robots() {
            let start = if taught.contains(robot) {
                Start::Told
            } else {
                Start::Woken
            };
            let claims = { positions.entry(start) }.or_insert_with(|| PositionClaims::new(start));
            claims.add(&replayed.case.scoring.coverage(came_out, known));
        }
        let figures = match (selection.taught, &replayed.waking) {
            (Some(taught), Some(waking)) => Figures::Sessions {
                taught,
                waking: *waking,
            },
            _ => Figures::Told {
                agents: { replayed.report.robots() }
                    .map(|(name, errors)| (name.to_owned(), *errors))
                    .collect(),
            },
        };
        Ok(Measured {
            figures,
            positions: positions.into_values().collect(),
            view_matches: replayed.view_matches(),
        })
    }

    /// Measures a set of agents on one route, in a new space of a service.
    ///
    /// # Errors
    /// An agent has too few views, or the service does not answer.
    pub(super) fn ask(&self, set: &TableSet, api: &Api, space: &str) -> anyhow::Result<Measured> {
        let known =
            { set.agents.iter() }.filter_map(|(name, log)| Some((name, log, log.truth.as_ref()?)));
        let wanted = |name: &String| self.taught.as_ref() == Some(name);
        let taught = { known.clone() }
            .find(|(name, ..)| wanted(name))
            .or_else(|| known.clone().next());
        let Some((taught, log, truth)) = taught else {
            anyhow::bail!("no agent of the set has a truth");
        };
        let questions = SequenceQuestions {
            taught: taught.clone(),
            length: QUESTION_VIEWS,
            within_m: RIGHT_WITHIN_STEPS * self.step_m(log, truth),
            choice: self.choice.clone(),
        };
        let settings = settings(&self.setting).map_err(anyhow::Error::msg)?;
        Ok(Measured {
            figures: Figures::Route(questions.ask(api, space, &settings, set)?),
            positions: Vec::new(),
            view_matches: Calibration::default(),
        })
    }

    /// How far an agent went from one view to the next \[m\], in the median.
    fn step_m(&self, log: &Log, truth: &Truth) -> f64 {
        let seen_at = log.rows.iter().filter_map(|row| match &row.body {
            RowBody::Descriptor(channel, _) if !self.choice.without.contains(channel) => {
                truth.at(row.stamp_ns)
            }
            _ => None,
        });
        let seen_at: Vec<_> = seen_at.collect();
        let steps_m = seen_at.windows(2).map(|two| (two[1] - two[0]).norm());
        median(steps_m.collect()).unwrap_or(0.0)
    }
}

impl Measured {
    /// The probabilities of answers, and whether they were right.
    pub(super) fn answers(&self) -> Calibration {
        let mut answers = Calibration::default();
        if let Figures::Route(recall) = &self.figures {
            for row in &recall.rows {
                answers.add_all(&row.calibration);
            }
        }
        answers
    }
}
