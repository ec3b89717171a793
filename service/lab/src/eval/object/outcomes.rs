//! What many explorations came to.

use serde::Serialize;

use object_recognition::ObjectId;

use super::trace::{Answer, Trace};
use crate::eval::statistic::quantile;

/// Shares of explorations of learned objects by how they ended, and how long they took.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Outcomes {
    /// Share that was named, and right.
    pub accuracy: f64,
    /// Share that was named, and wrong.
    pub wrong_rate: f64,
    /// Share that was called unknown, although it had been learned.
    pub unknown_rate: f64,
    /// Share that had no answer until the last touch.
    pub undecided_rate: f64,
    /// Mean number of touches before an answer; `None` where none was given.
    pub steps_mean: Option<f64>,
    /// Standard deviation of that number.
    pub steps_sd: Option<f64>,
}

impl Outcomes {
    /// Of explorations, each with the object that was explored. `None` where there is none.
    pub fn of<'a>(traces: impl Iterator<Item = (ObjectId, &'a Trace)>) -> Option<Self> {
        let (mut n, mut right, mut wrong, mut unknown) = (0.0, 0.0, 0.0, 0.0);
        let mut steps = Vec::new();
        for (truth, trace) in traces {
            n += 1.0;
            let Some(decision) = &trace.decision else {
                continue;
            };
            steps.push(decision.touches as f64);
            match decision.answer {
                Answer::Object(object) if object == truth => right += 1.0,
                Answer::Object(_) => wrong += 1.0,
                Answer::Unknown => unknown += 1.0,
            }
        }
        let decided = steps.len() as f64;
        let mean = (decided > 0.0).then(|| steps.iter().sum::<f64>() / decided);
        let variance = mean.map(|mean| {
            let squares = steps.iter().map(|steps| (steps - mean).powi(2));
            squares.sum::<f64>() / decided
        });
        (n > 0.0).then(|| Self {
            accuracy: right / n,
            wrong_rate: wrong / n,
            unknown_rate: unknown / n,
            undecided_rate: (n - decided) / n,
            steps_mean: mean,
            steps_sd: variance.map(f64::sqrt),
        })
    }
}

/// Times of single touches, with the answer after each.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct TouchTimes {
    /// Half of the touches took less \[µs\].
    pub touch_us_p50: f64,
    /// All but one in a hundred took less \[µs\].
    pub touch_us_p99: f64,
}

impl TouchTimes {
    /// Of all touches of some explorations. `None` where there is none.
    pub fn of<'a>(traces: impl Iterator<Item = &'a Trace>) -> Option<Self> {
        let mut took_us: Vec<f64> = traces
            .flat_map(|trace| trace.steps.iter().map(|step| step.took_s * 1e6))
            .collect();
        took_us.sort_unstable_by(f64::total_cmp);
        (!took_us.is_empty()).then(|| Self {
            touch_us_p50: quantile(&took_us, 0.5),
            touch_us_p99: quantile(&took_us, 0.99),
        })
    }
}
