//! What came out, in numbers and in lines.

use std::collections::BTreeMap;
use std::fmt::{self, Display, Formatter, Write as _};

use serde::Serialize;

use super::run::TouchExperiment;
use crate::eval::object::{Outcomes, TouchTimes, Trace, means, object_id};

/// Millimetres in a metre.
const MM_PER_M: f64 = 1e3;

/// What was done and what came out, as it is printed in JSON.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TouchReport {
    /// Number of objects.
    pub objects: usize,
    /// Explorations of each.
    pub trials: u32,
    /// Standard deviation of a position along each axis \[mm\].
    pub noise_mm: f64,
    /// Standard deviation of a level, in its own unit.
    pub noise_level: f64,
    /// `none`, `24` or `so3`.
    pub rotate: &'static str,
    /// Most touches of an exploration.
    pub max_touches: usize,
    /// Probability at which an answer was given.
    pub sure: f64,
    /// Seed.
    pub seed: u64,
    /// Share of right first choices after each number of touches; ties count by their share, and an
    /// exploration that is over with its last choice.
    pub top1_after: BTreeMap<usize, f64>,
    /// How the explorations ended.
    #[serde(flatten)]
    pub outcomes: Option<Outcomes>,
    /// Mean number of hypotheses, each an object and a pose, that hold 99 % of the evidence, after
    /// each touch.
    pub live_hypotheses: Vec<f64>,
    /// How long touches took.
    #[serde(flatten)]
    pub times: Option<TouchTimes>,
}

impl TouchReport {
    /// Sums an experiment up.
    pub fn of(experiment: &TouchExperiment) -> Self {
        let TouchExperiment {
            protocol,
            names,
            trials,
        } = experiment;
        let traces: Vec<&Trace> = trials.iter().map(|trial| &trial.trace).collect();
        let explored = trials
            .iter()
            .map(|trial| (object_id(trial.object), &trial.trace));
        Self {
            objects: names.len(),
            trials: protocol.trials,
            noise_mm: protocol.noise.position_sd_m * MM_PER_M,
            noise_level: protocol.noise.level_sd,
            rotate: protocol.rotate.name(),
            max_touches: protocol.touches_max,
            sure: protocol.sure,
            seed: protocol.seed,
            top1_after: (1..).zip(means(&traces, |step| step.right)).collect(),
            outcomes: Outcomes::of(explored),
            live_hypotheses: means(&traces, |step| step.live_hypotheses),
            times: TouchTimes::of(traces.iter().copied()),
        }
    }
}

impl TouchExperiment {
    /// All touches of all explorations as CSV, each with what cogmap's first choice after it was
    /// worth, for other programs to recognise the same.
    pub fn csv(&self) -> String {
        let mut text = "trial,object,touch,x_mm,y_mm,z_mm,level,right\n".to_owned();
        for (number, trial) in self.trials.iter().enumerate() {
            let steps = trial.trace.steps.iter();
            for (index, (touch, step)) in trial.episode.touches.iter().zip(steps).enumerate() {
                let mm = touch.position_m * MM_PER_M;
                writeln!(
                    text,
                    "{number},{},{},{:.6},{:.6},{:.6},{:.6},{}",
                    self.name(trial.object),
                    index + 1,
                    mm.x,
                    mm.y,
                    mm.z,
                    touch.level,
                    step.right
                )
                .expect("writing to a string does not fail");
            }
        }
        text
    }
}

impl Display for TouchReport {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{} objects, {} explorations of each, noise {} mm and {} of the level, turns: {}",
            self.objects, self.trials, self.noise_mm, self.noise_level, self.rotate
        )?;
        writeln!(f, "\n{:>8} {:>22}", "touches", "right first choices [%]")?;
        for (touches, share) in &self.top1_after {
            writeln!(f, "{touches:>8} {:>22.1}", 100.0 * share)?;
        }
        if let Some(outcomes) = &self.outcomes {
            let percent = |share: f64| 100.0 * share;
            writeln!(
                f,
                "\nwith an answer at {}: {:.1} % right, {:.1} % wrong, {:.1} % called unknown, {:.1} % without an answer",
                self.sure,
                percent(outcomes.accuracy),
                percent(outcomes.wrong_rate),
                percent(outcomes.unknown_rate),
                percent(outcomes.undecided_rate)
            )?;
            if let (Some(mean), Some(sd)) = (outcomes.steps_mean, outcomes.steps_sd) {
                writeln!(f, "touches before the answer: {mean:.2} ± {sd:.2}")?;
            }
        }
        if let Some(times) = &self.times {
            writeln!(
                f,
                "a touch with its answer: p50 {:.0} us, p99 {:.0} us",
                times.touch_us_p50, times.touch_us_p99
            )?;
        }
        Ok(())
    }
}
