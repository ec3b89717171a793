//! The pose as it was known when it arrived.

use geometry::{PoseCovariance, upper_triangle};
use nalgebra::{Isometry3, Matrix3, Matrix6};
use pose_graph::{ExpectedPose, Freedom, IncrementalRelaxation, IncrementalSettings, Innovation};

use super::consistency::Consistency;
use super::growth::{Growth, Lead};
use super::judgement::{Verdict, gate, judge};
use super::recording::{Matches, Measured, Recording};

/// Doubtful matches that are judged together at least: fewer agree by chance.
const JUDGED_TOGETHER_MIN: usize = 16;

/// … and at least this share of all matches so far, so that all judgements together cost a few
/// times the last.
const JUDGED_TOGETHER_SHARE: f64 = 0.25;

/// As many doubtful measurements for one that was believed make the map itself doubtful: even where
/// every second match is false, true ones fit a map that is right.
const DOUBTFUL_MEASUREMENTS: usize = 3;

/// The same for recognised places. Their matches wait for one another where the map does not know
/// the place, so as many as were believed are to be judged.
const DOUBTFUL_RECOGNISED: usize = 1;

/// A match of recognised places says nothing by fitting where the map does not know the place this
/// many times better or as well as the match does: it waits for others to agree with it.
const UNSHARP: f64 = 2.0;

/// Variance of what motion did not measure \[m², rad²\].
const UNKNOWN: f64 = 1e6;

/// A recording that arrives pose by pose.
///
/// Motion is believed. Before a match enters the map it is held against what the map expects: one
/// that is farther off than [`GATE_DEVIATIONS`](super::GATE_DEVIATIONS) allows is left out. When
/// such matches have become many beside those that were let in, it may be the map that is wrong.
/// All are then judged together, the map is begun anew from what holds, and who was wrong before
/// comes back in.
#[derive(Debug)]
pub struct CausalRun<'a> {
    growth: Growth<'a>,
    live: IncrementalRelaxation,
    causal: Vec<Isometry3<f64>>,
    innovations: Vec<Option<Innovation>>,
    doubted_since: usize,
    believed_since: usize,
    n_judgements: usize,
}

impl<'a> CausalRun<'a> {
    /// Before the first step.
    pub fn new(recording: &'a Recording) -> Self {
        Self {
            growth: Growth::new(recording),
            live: IncrementalRelaxation::new(IncrementalSettings::default()),
            causal: Vec::with_capacity(recording.steps.len()),
            innovations: Vec::new(),
            doubted_since: 0,
            believed_since: 0,
            n_judgements: 0,
        }
    }

    /// Takes in the next pose and all that comes with it, and returns where the pose is then
    /// believed to be.
    pub fn step(&mut self) -> Option<Isometry3<f64>> {
        let recording = self.growth.recording;
        let index = self.growth.poses.len();
        let step = recording.steps.get(index)?;
        let lead = self.growth.lead();
        let kernel = self.growth.kernel();
        // What is expected is asked of the map as it was before this step.
        let expected: Vec<Option<(Innovation, bool)>> = step
            .measured
            .iter()
            .enumerate()
            .map(|(k, measured)| {
                let lead = lead.as_ref().filter(|lead| lead.index != k)?;
                self.expected(index, lead, measured)
            })
            .collect();
        self.growth.add_pose();
        for (measured, expected) in step.measured.iter().zip(expected) {
            let holds = match expected {
                Some((innovation, is_sharp)) => {
                    is_sharp && innovation.squared <= gate(recording.matches, innovation.degrees)
                }
                None => matches!(recording.matches, Matches::Measurements),
            };
            if !self.growth.add(measured, kernel, holds) {
                continue;
            }
            self.innovations
                .push(expected.map(|(innovation, _)| innovation));
            if holds {
                self.believed_since += 1;
            } else {
                self.doubted_since += 1;
            }
        }
        self.live.update(&mut self.growth.map);
        if self.is_judgement_due() {
            self.judge();
        }
        let pose = *self.growth.map.pose(self.growth.poses[index]);
        self.causal.push(pose);
        Some(pose)
    }

    /// The poses so far, each as it was known when it arrived.
    pub fn poses(&self) -> &[Isometry3<f64>] {
        &self.causal
    }

    /// Which matches hold by now.
    pub fn verdict(&self) -> Verdict {
        let on = |judged: &super::growth::Judged| self.growth.map.is_on(judged.link);
        Verdict(self.growth.judged.iter().map(on).collect())
    }

    /// χ² of the map now, with the matches that hold.
    pub fn chi_squared(&self) -> f64 {
        self.growth.map.chi_squared()
    }

    /// How often all matches were judged anew.
    pub fn n_judgements(&self) -> usize {
        self.n_judgements
    }

    /// The innovations of all matches that could be expected and were found to hold: by a verdict
    /// of the same recording.
    pub fn consistency(&self, verdict: &Verdict) -> Consistency {
        let mut consistency = Consistency::default();
        for (innovation, holds) in self.innovations.iter().zip(&verdict.0) {
            if let (Some(innovation), true) = (innovation, holds) {
                consistency.add(*innovation);
            }
        }
        consistency
    }

    /// Covariance of the newest pose. `None` if nothing ties it to the first.
    pub fn newest_covariance(&self) -> Option<PoseCovariance> {
        let newest = *self.growth.poses.last()?;
        self.live.marginals(&self.growth.map).pose(newest)
    }

    /// How far a measurement of the next step is from what the map expects, and whether the map
    /// knows enough for that to say something. `None` if it expects nothing.
    fn expected(
        &self,
        new: usize,
        lead: &Lead<'_>,
        measured: &Measured,
    ) -> Option<(Innovation, bool)> {
        let marginals = self.live.marginals(&self.growth.map);
        let before = self.growth.poses[lead.from];
        let noise = self.noise(lead);
        match measured {
            Measured::Relative {
                from,
                to,
                transform,
                information,
                is_motion: false,
            } => {
                let old = if *to == new { *from } else { *to };
                let expected = marginals
                    .expected_pose(*self.growth.poses.get(old)?, before)?
                    .after(&lead.transform, &noise);
                let expected = if *to == new {
                    expected
                } else {
                    expected.reversed()
                };
                let innovation = expected.innovation(transform, information)?;
                Some((innovation, self.is_sharp(&expected, information.matrix())))
            }
            Measured::Sighting {
                from,
                landmark,
                position,
                information,
            } if *from == new => {
                let point = self.growth.landmarks[*landmark]?;
                let expected = marginals
                    .expected_position(before, point)?
                    .seen_after(&lead.transform, &noise);
                Some((expected.innovation(position, information)?, true))
            }
            _ => None,
        }
    }

    /// Whether an expectation is so narrow that a match which fits it has said something.
    fn is_sharp(&self, expected: &ExpectedPose, information: &Matrix6<f64>) -> bool {
        if matches!(self.growth.recording.matches, Matches::Measurements) {
            return true;
        }
        let own = information.fixed_view::<3, 3>(0, 0).trace();
        let covariance = expected.covariance.matrix();
        let spread: Matrix3<f64> = covariance.fixed_view::<3, 3>(0, 0).into_owned();
        // Both as squares of a position's deviation along the axes that were measured.
        let n_measured = (0..3).filter(|&k| information[(k, k)] > 0.0).count() as f64;
        spread.trace() * own <= (UNSHARP * n_measured).powi(2)
    }

    /// Covariance of what a new pose was led by.
    fn noise(&self, lead: &Lead<'_>) -> PoseCovariance {
        let matrix = lead.information.matrix();
        let is_planar = self.growth.recording.freedom == Freedom::Planar;
        let mut regular = *matrix;
        for k in 0..6 {
            if matrix[(k, k)] <= 0.0 {
                let across = is_planar && (2..5).contains(&k);
                regular[(k, k)] = if across { 1.0 } else { 1.0 / UNKNOWN };
            }
        }
        let mut covariance = regular
            .try_inverse()
            .unwrap_or_else(|| Matrix6::identity() * UNKNOWN);
        if is_planar {
            for k in 2..5 {
                covariance.row_mut(k).fill(0.0);
                covariance.column_mut(k).fill(0.0);
            }
        }
        PoseCovariance::from_upper_triangle(&upper_triangle(&covariance))
    }

    fn is_judgement_due(&self) -> bool {
        let share = JUDGED_TOGETHER_SHARE * self.growth.judged.len() as f64;
        let per_believed = match self.growth.recording.matches {
            Matches::Measurements => DOUBTFUL_MEASUREMENTS,
            Matches::Recognised(_) => DOUBTFUL_RECOGNISED,
        };
        self.doubted_since >= JUDGED_TOGETHER_MIN
            && self.doubted_since as f64 >= share
            && self.doubted_since >= per_believed * self.believed_since
    }

    /// Begins the map anew from the matches that hold together.
    fn judge(&mut self) {
        let growth = &mut self.growth;
        let (judged, verdict) = judge(growth.recording, growth.poses.len());
        growth.switch(&verdict.0);
        growth.take_places(&judged);
        self.live = IncrementalRelaxation::new(IncrementalSettings::default());
        self.live.update(&mut growth.map);
        self.n_judgements += 1;
        (self.doubted_since, self.believed_since) = (0, 0);
    }
}
