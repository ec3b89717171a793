//! The third experiment in numbers.

use std::fmt::{self, Display, Formatter};

use serde::Serialize;

use super::outcomes::{Outcomes, TouchTimes};
use super::protocol::{Normals, ObjectProtocol};
use super::run::ObjectExperiment;
use super::trace::{Answer, TouchStep, Trace};

/// What was done and what came out, as it is printed in JSON.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ObjectReport {
    /// Always `env3`.
    pub environment: &'static str,
    /// Number of objects.
    pub objects: u32,
    /// Standard deviation of a felt level, as a share of the range of levels.
    pub value_noise: f64,
    /// Standard deviation of a move's measured displacement, as a share of its length.
    pub motion_noise: f64,
    /// `none`, `24` or `so3`.
    pub rotate: &'static str,
    /// Whether contacts told the surface's normal.
    pub normals: bool,
    /// Explorations of learned objects.
    pub trials: u32,
    /// Probability at which an answer was given.
    pub sure: f64,
    /// Most touches of an exploration.
    pub touches_max: usize,
    /// Seed.
    pub seed: u64,
    /// Places learned of an object, on average.
    pub places_per_object: f64,
    /// Touches to learn an object, on average.
    pub learning_touches_per_object: f64,
    /// How the explorations of learned objects ended.
    #[serde(flatten)]
    pub outcomes: Option<Outcomes>,
    /// Share of objects never learned that were named as one that was.
    pub false_known_rate: Option<f64>,
    /// Share of objects never learned that were called unknown; the rest had no answer.
    pub unknown_caught_rate: Option<f64>,
    /// Mean number of hypotheses, each an object and a pose, that hold 99 % of the evidence, after
    /// each touch. An exploration that is over counts with its last number, here and below.
    pub live_hypotheses: Vec<f64>,
    /// Mean number of objects with a probability above one in a hundred, after each touch (Fig.
    /// 21a).
    pub live_objects: Vec<f64>,
    /// Mean probability of the first choice, after each touch (Fig. 21b).
    pub confidence: Vec<f64>,
    /// Share of right first choices, after each touch.
    pub top1_after: Vec<f64>,
    /// How long touches took.
    #[serde(flatten)]
    pub times: Option<TouchTimes>,
    /// What the paper states for as many objects.
    pub paper: Option<PaperRow>,
}

/// A row of the paper's Table 2.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PaperRow {
    /// Share that was recognised.
    pub accuracy: f64,
    /// Mean steps to convergence.
    pub steps_mean: f64,
    /// Their standard deviation.
    pub steps_sd: f64,
}

impl PaperRow {
    /// For so many objects, if the paper has them.
    pub fn of(objects: u32) -> Option<Self> {
        ObjectProtocol::paper(objects).map(|(percent, steps_mean, steps_sd)| Self {
            accuracy: percent / 100.0,
            steps_mean,
            steps_sd,
        })
    }
}

impl ObjectReport {
    /// Sums an experiment up.
    pub fn of(experiment: &ObjectExperiment) -> Self {
        let ObjectExperiment {
            protocol, learned, ..
        } = experiment;
        let traces: Vec<&Trace> = learned.iter().map(|(_, trace)| trace).collect();
        let strangers = &experiment.strangers;
        let share = |is: &dyn Fn(Answer) -> bool| {
            let ended = strangers.iter().filter_map(|trace| trace.decision);
            let count = ended.filter(|decision| is(decision.answer)).count();
            (!strangers.is_empty()).then(|| count as f64 / strangers.len() as f64)
        };
        let per_object = |count: usize| count as f64 / f64::from(protocol.objects.max(1));
        Self {
            environment: "env3",
            objects: protocol.objects,
            value_noise: protocol.noise.value,
            motion_noise: protocol.noise.motion,
            rotate: protocol.rotate.name(),
            normals: protocol.normals == Normals::Told,
            trials: protocol.trials,
            sure: protocol.sure,
            touches_max: protocol.touches_max,
            seed: protocol.seed,
            places_per_object: per_object(experiment.places),
            learning_touches_per_object: per_object(experiment.learning_touches),
            outcomes: Outcomes::of(learned.iter().map(|(truth, trace)| (*truth, trace))),
            false_known_rate: share(&|answer| matches!(answer, Answer::Object(_))),
            unknown_caught_rate: share(&|answer| answer == Answer::Unknown),
            live_hypotheses: means(&traces, |step| step.live_hypotheses),
            live_objects: means(&traces, |step| step.live_objects),
            confidence: means(&traces, |step| step.confidence),
            top1_after: means(&traces, |step| step.right),
            times: TouchTimes::of(traces.iter().copied()),
            paper: PaperRow::of(protocol.objects),
        }
    }
}

/// Mean of a number after each touch, up to the longest exploration.
pub(crate) fn means(traces: &[&Trace], number: impl Fn(&TouchStep) -> f64) -> Vec<f64> {
    let touches = traces.iter().map(|trace| trace.steps.len()).max();
    let mean = |touches| {
        let values = traces.iter().filter_map(|trace| trace.after(touches));
        let (sum, n) = values.fold((0.0, 0.0), |(sum, n), step| (sum + number(step), n + 1.0));
        sum / n
    };
    (1..=touches.unwrap_or(0)).map(mean).collect()
}

/// Table 2 of one or more experiments, ours beside the paper's.
#[derive(Clone, Debug)]
pub struct ObjectTable<'a>(pub &'a [ObjectReport]);

impl Display for ObjectTable<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(f, "Environment 3: objects of coloured voxels, by touch")?;
        if let Some(report) = self.0.first() {
            let turned = match report.rotate {
                "none" => "as they were learned",
                "24" => "turned in one of 24 ways",
                _ => "turned in any way",
            };
            writeln!(
                f,
                "{} explorations, objects {turned}, value noise {}, motion noise {}, an answer at {}",
                report.trials, report.value_noise, report.motion_noise, report.sure
            )?;
        }
        writeln!(
            f,
            "\n{:<8} {:>10} {:>16} {:>9} {:>11} {:>12} {:>12} {:>11}   paper",
            "Table 2",
            "right [%]",
            "touches",
            "unknown",
            "false known",
            "undecided",
            "touch p50",
            "p99 [us]"
        )?;
        for report in self.0 {
            let Some(outcomes) = &report.outcomes else {
                continue;
            };
            let touches = match (outcomes.steps_mean, outcomes.steps_sd) {
                (Some(mean), Some(sd)) => format!("{mean:.2} ± {sd:.2}"),
                _ => "none".to_owned(),
            };
            let percent = |share: f64| format!("{:.2}", 100.0 * share);
            let time = |us: fn(&TouchTimes) -> f64| report.times.as_ref().map_or(0.0, us);
            let paper = report.paper.map_or_else(String::new, |paper| {
                let right = 100.0 * paper.accuracy;
                format!(
                    "{right:.1} %, {} ± {} steps",
                    paper.steps_mean, paper.steps_sd
                )
            });
            let row = format!(
                "{:<8} {:>10} {touches:>16} {:>9} {:>11} {:>12} {:>12.0} {:>11.0}   {paper}",
                report.objects,
                percent(outcomes.accuracy),
                percent(outcomes.unknown_rate),
                report.false_known_rate.map_or_else(String::new, percent),
                percent(outcomes.undecided_rate),
                time(|times| times.touch_us_p50),
                time(|times| times.touch_us_p99),
            );
            writeln!(f, "{}", row.trim_end())?;
        }
        Ok(())
    }
}
