//! What a service that was taught one agent's way tells others of theirs, by their last views.

use std::collections::HashMap;
use std::time::Instant;

use anyhow::Context;
use cogmap::cli::quantile;
use cogmap_client::Api;
use cogmap_lab::csv::{Choice, TableSet, Truth};
use cogmap_lab::eval::sequences::Calibration;
use cogmap_proto::{
    Descriptor, PerceptCue, Sample, SampleBatch, SampleBody, SequenceElement, SequenceQuery,
    SpaceSettings,
};
use nalgebra::Vector3;
use serde::Serialize;

use crate::cli::eval::Progress;

/// Samples of a message.
const BATCH: usize = 500;
/// What is told with this probability counts as a claim.
pub(super) const CLAIM: f64 = 0.9;

/// What is asked.
#[derive(Clone, Debug, Serialize)]
pub(super) struct SequenceQuestions {
    /// The agent whose way is remembered; the others are asked for.
    pub(super) taught: String,
    /// Views of a question, one after the other.
    pub(super) length: u32,
    /// An answer is right that is no farther off \[m\].
    pub(super) within_m: f64,
    /// What of the set is sent and asked with.
    #[serde(skip)]
    pub(super) choice: Choice,
}

/// What came of the questions.
#[derive(Debug, Serialize)]
pub(super) struct SequenceRecall {
    #[serde(flatten)]
    pub(super) asked: SequenceQuestions,
    pub(super) rows: Vec<SequenceRow>,
}

/// What became of the questions of one agent.
#[derive(Debug, Serialize)]
pub(super) struct SequenceRow {
    pub(super) agent: String,
    pub(super) questions: usize,
    /// Share of them whose likeliest answer was right.
    pub(super) right: f64,
    /// Answers that were told with 0.9 or more, and the share of these that were right.
    pub(super) claims: u32,
    pub(super) claims_right: Option<f64>,
    pub(super) ms_p50: f64,
    pub(super) ms_p99: f64,
    /// By the probability of the likeliest answer.
    pub(super) calibration: Calibration,
}

/// A view, and where it was seen.
struct View {
    percept: Descriptor,
    at: Vector3<f64>,
}

impl SequenceQuestions {
    /// Whether the set has the agent that is to be taught, and another one that is asked for.
    ///
    /// # Errors
    /// It has not.
    pub(super) fn check(&self, set: &TableSet) -> anyhow::Result<()> {
        let taught = &self.taught;
        let names = set.agents.keys().map(String::as_str).collect::<Vec<_>>();
        anyhow::ensure!(
            set.agents.contains_key(taught),
            "the set has no agent {taught}; it has {}",
            names.join(", ")
        );
        let mut others = set.agents.iter().filter(|(name, _)| *name != taught);
        anyhow::ensure!(
            others.any(|(_, log)| log.truth.is_some()),
            "nobody is left to ask for: beside {taught}, the set has no agent whose truth is known"
        );
        Ok(())
    }

    /// Makes a space of a service, teaches it, and asks for every other agent of which the truth is
    /// known.
    ///
    /// # Errors
    /// The truth of the taught agent is not known, an agent has too few views, or the service does
    /// not answer.
    pub(super) fn ask(
        &self,
        api: &Api,
        space: &str,
        settings: &SpaceSettings,
        set: &TableSet,
    ) -> anyhow::Result<SequenceRecall> {
        self.check(set)?;
        api.create_space(space, settings)?;
        let places = self.teach((api, space), set)?;
        let mut rows = Vec::new();
        for (name, log) in &set.agents {
            if let Some(truth) = log.truth.as_ref().filter(|_| *name != self.taught) {
                let views = self.views(set, name, truth)?;
                let fewest = self.length as usize + 1;
                anyhow::ensure!(
                    views.len() >= fewest,
                    "{name} has fewer than {fewest} views"
                );
                rows.push(self.ask_for((api, space), &places, (name, &views))?);
            }
        }
        Ok(SequenceRecall {
            asked: self.clone(),
            rows,
        })
    }

    /// Sends what the taught agent recorded; answers where its places are.
    fn teach(
        &self,
        (api, space): (&Api, &str),
        set: &TableSet,
    ) -> anyhow::Result<HashMap<u64, Vector3<f64>>> {
        let taught = &self.taught;
        let log = &set.agents[taught];
        let first_ns = log.rows.first().map_or(0, |row| row.stamp_ns);
        let truth = log
            .truth
            .as_ref()
            .context("the taught agent has no truth")?;
        let stream = set.stream(taught, truth.start(first_ns).as_ref(), &self.choice)?;
        for (message, samples) in (0..).zip(stream.samples().chunks(BATCH)) {
            let batch = SampleBatch {
                session: 1,
                first_seq: message * BATCH as u64,
                samples: samples.to_vec(),
            };
            api.post_samples(space, taught, &batch)?;
        }
        let places = api.places(space)?.into_iter();
        Ok(places
            .map(|place| (place.id, place.translation_m.into()))
            .collect())
    }

    /// The views of an agent, in order of time.
    fn views(&self, set: &TableSet, agent: &str, truth: &Truth) -> anyhow::Result<Vec<View>> {
        let stream = set.stream(agent, None, &self.choice)?;
        let view = |sample: &Sample| {
            let SampleBody::Descriptor(percept) = &sample.body else {
                return None;
            };
            let at = truth.at(sample.stamp_ns - TableSet::sent_ns(0))?;
            let percept = percept.clone();
            Some(View { percept, at })
        };
        Ok(stream.samples().iter().filter_map(view).collect())
    }

    /// Asks what comes next after every few views, and compares with where the next one was seen.
    fn ask_for(
        &self,
        (api, space): (&Api, &str),
        places: &HashMap<u64, Vector3<f64>>,
        (agent, views): (&str, &[View]),
    ) -> anyhow::Result<SequenceRow> {
        let length = self.length as usize;
        let questions = views.len().saturating_sub(length);
        let progress = Progress::new(questions as u64, "questions");
        let (mut right, mut claims, mut claims_right) = (0_u32, 0_u32, 0_u32);
        let mut calibration = Calibration::default();
        let mut ms = Vec::with_capacity(questions);
        for window in views.windows(length + 1) {
            let (cue, next) = window.split_at(length);
            let elements = { cue.iter() }
                .map(|view| SequenceElement::Percept(PerceptCue::Descriptor(view.percept.clone())));
            let query = SequenceQuery {
                cue: elements.collect(),
                error_rate: None,
                none_prior: None,
                limit: Some(1),
            };
            let start = Instant::now();
            let answer = api.sequence(space, &query)?;
            ms.push(start.elapsed().as_secs_f64() * 1e3);
            progress.add(1);
            let Some(best) = answer.next.first() else {
                continue;
            };
            let place =
                { places.get(&best.place) }.context("a place is told that is not listed")?;
            let is_right = (place - next[0].at).norm() <= self.within_m;
            calibration.add(best.probability, is_right);
            right += u32::from(is_right);
            if best.probability >= CLAIM {
                claims += 1;
                claims_right += u32::from(is_right);
            }
        }
        progress.finish();
        Ok(SequenceRow {
            agent: agent.to_owned(),
            questions,
            right: f64::from(right) / questions.max(1) as f64,
            claims,
            claims_right: (claims > 0).then(|| f64::from(claims_right) / f64::from(claims)),
            ms_p50: quantile(&mut ms, 0.5),
            ms_p99: quantile(&mut ms, 0.99),
            calibration,
        })
    }
}
