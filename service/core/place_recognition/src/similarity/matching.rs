//! Which views are likely to be of one place.

use nalgebra::{DMatrix, Point3};

use super::centres::Centres;
use super::learned_channel::LearnedChannel;
use super::log_odds::{Learned, information_nats};
use super::neighbours::Neighbours;
use super::runs::{Runs, gap};
use super::sequence_odds;
use super::turned::Turned;
use super::two_covariance::{TwoCovariance, single};
use super::view_log::ViewLog;
use crate::keyframes::SampleKey;
use crate::tracking::{ReferenceView, SessionCentre, ViewMap, ViewModel};
use crate::tuning::similarity as tuning;
use state::state_of_struct;

/// Standard deviation of the distance of two views of one place along each axis, in ranges of
/// their channel.
const RANGE_SD: f64 = 0.5;

/// Two samples at which an agent, or two, may have been at one place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewMatch {
    /// The later sample of an agent, or that of the agent with the higher number.
    pub now: SampleKey,
    /// The other one.
    pub then: SampleKey,
    /// How far apart samples of one place are at most \[m\]: the range of the channel.
    pub range_m: f64,
    /// Standard deviation of the distance between them along each axis \[m\].
    pub sd_m: f64,
    /// Log of the odds that they are of one place, as it may cost at most to leave that out.
    pub depth: f64,
}

impl ViewMatch {
    /// Probability that they are of one place.
    pub fn probability(&self) -> f64 {
        -(-self.depth).exp_m1()
    }

    /// The same in a map that is found: a match that is right with a probability p says p of what
    /// a right one does, the second derivative of −ln(1 − p + p exp(−x²/2)) where x is zero. Where
    /// matches still have to find the map, all of them pull alike.
    fn weighed(&self) -> Self {
        Self {
            sd_m: RANGE_SD * self.range_m / self.probability().sqrt(),
            ..*self
        }
    }

    /// Whether a match that was read from a checkpoint is one.
    pub fn is_sound(&self) -> bool {
        let lengths = [self.range_m, self.sd_m];
        let are_lengths = lengths.iter().all(|one| one.is_finite() && *one > 0.0);
        are_lengths && self.depth.is_finite() && self.depth >= 0.0
    }
}

state_of_struct!(ViewMatch {
    now,
    then,
    range_m,
    sd_m,
    depth
});

/// How alike the views of a channel are.
#[derive(Debug)]
pub struct Similarity<'a> {
    runs: Runs<'a>,
    learned: LearnedChannel,
    log_odds: DMatrix<f32>,
    /// The same of whole sequences of views.
    of_sequences: DMatrix<f32>,
    view_map: ViewMap,
    /// Part of the channel's views that are matched.
    share: f64,
}

impl<'a> Similarity<'a> {
    /// Of each channel of a log whose views say something, by at most so many views of each, evenly
    /// thinned.
    pub fn of_channels(log: &'a ViewLog, most: usize) -> Vec<Self> {
        let channels = log.channels().into_iter();
        channels
            .filter_map(|channel| Self::of(log, channel, most))
            .collect()
    }

    fn of(log: &'a ViewLog, channel: u8, most: usize) -> Option<Self> {
        let all = Runs::of(log, channel);
        let runs = all.thinned(most);
        if runs.len() < crate::tuning::log::VIEWS_MIN {
            return None;
        }
        let neighbours = Neighbours::of(&all, &runs);
        let centres = Centres::of(&all);
        let views = centres.centred(&all);
        let within = neighbours.within(&views, runs.len())?;
        let model = TwoCovariance::of(within, &neighbours.of_matched(&views))?;
        let components = model.components(&views);
        let matched = neighbours.of_matched(&components);
        let (scores, score_sd) = model.scores(&matched);
        let pairs = neighbours.pairs(&model, &components, score_sd);
        let learned = Learned::of(&runs, &pairs, scores)?;
        let of_sequences = if all.len() == runs.len() {
            sequence_odds::of_all(&runs, &learned.log_odds)
        } else {
            let score =
                |some: &_, others: &_| model.scores_between(some, others) / single(score_sd);
            sequence_odds::of_thinned(&neighbours, &components, score, &learned)
        };
        let known = (channel, learned.range_m, learned.turned);
        Some(Self {
            share: runs.len() as f64 / all.len() as f64,
            view_map: view_map(known, &runs, &centres, &model, &matched),
            learned: LearnedChannel {
                channel,
                views: u32::try_from(runs.len()).unwrap_or(u32::MAX),
                range_m: learned.range_m,
                turned: learned.turned,
                is_coarse: learned.is_coarse(tuning::COARSE_M.0),
                information_nats: information_nats(&runs, &neighbours, &views, learned.range_m),
                independence: learned.independence,
            },
            runs,
            log_odds: learned.log_odds,
            of_sequences,
        })
    }

    /// The samples of the views.
    pub fn samples(&self) -> impl Iterator<Item = SampleKey> + '_ {
        self.runs.views.iter().map(|view| view.sample)
    }

    /// What was learned of the channel.
    pub fn learned(&self) -> &LearnedChannel {
        &self.learned
    }

    /// What is kept of the channel to compare views with that are seen later. It lies nowhere so
    /// far.
    pub fn view_map(&self) -> &ViewMap {
        &self.view_map
    }

    /// The matches of each view with earlier ones, wherever they are.
    pub fn matches(&self) -> Vec<ViewMatch> {
        let n = self.runs.len();
        let mut matches = Vec::new();
        for index in 0..n {
            let is_earlier = |other: usize| other < index && self.is_apart(index, other);
            let candidates: Vec<usize> = (0..n).filter(|&other| is_earlier(other)).collect();
            let nowhere = tuning::NOWHERE * n as f64;
            self.best(index, candidates, nowhere, tuning::MATCHES, &mut matches);
        }
        matches
    }

    /// How much more the new views say of being where others were seen than those before them did
    /// \[nats\], by the depths of the best matches of all.
    pub fn news_nats(&self) -> f64 {
        let n = self.runs.len();
        let is_new = &self.runs.is_new;
        let nowhere = tuning::NOWHERE * n as f64;
        let (mut count, mut nats) = ([0.0; 2], [0.0; 2]);
        let mut matches = Vec::new();
        for index in 0..n {
            let is_before =
                |&other: &usize| self.is_apart(index, other) && (is_new[index] || !is_new[other]);
            let candidates: Vec<usize> = (0..n).filter(is_before).collect();
            self.best(index, candidates, nowhere, 1, &mut matches);
            let depth = matches.drain(..).map(|best| best.depth).sum::<f64>();
            count[usize::from(is_new[index])] += 1.0;
            nats[usize::from(is_new[index])] += depth;
        }
        nats[1] - nats[0] * count[1] / f64::max(count[0], 1.0)
    }

    /// The match of each view with another one, earlier or later, near to which a map has it.
    pub fn matches_near(&self, positions: &[Option<Point3<f64>>]) -> Vec<ViewMatch> {
        self.matches_within(tuning::GATE_RANGES, 1, positions)
    }

    /// The matches of each view with others, earlier or later, close to which a map has it that is
    /// right but for its details.
    pub fn matches_close(&self, positions: &[Option<Point3<f64>>]) -> Vec<ViewMatch> {
        let close = self.matches_within(tuning::CLOSE_RANGES, tuning::MATCHES, positions);
        close.iter().map(ViewMatch::weighed).collect()
    }

    /// At most so many matches of each view with others that a map has within so many ranges.
    fn matches_within(
        &self,
        ranges: f64,
        most: usize,
        positions: &[Option<Point3<f64>>],
    ) -> Vec<ViewMatch> {
        let gate_m = ranges * self.learned.range_m;
        let mut matches = Vec::new();
        for (index, position) in positions.iter().enumerate() {
            let Some(position) = position else {
                continue;
            };
            let is_near = |other: &Point3<f64>| (position - other).norm() < gate_m;
            let candidates = positions.iter().enumerate().filter(|(other, at)| {
                self.is_apart(index, *other) && at.as_ref().is_some_and(is_near)
            });
            let candidates: Vec<usize> = candidates.map(|(other, _)| other).collect();
            let nowhere = tuning::NOWHERE * candidates.len() as f64;
            self.best(index, candidates, nowhere, most, &mut matches);
        }
        matches
    }

    /// The best matches of a view among candidates.
    fn best(
        &self,
        index: usize,
        mut candidates: Vec<usize>,
        nowhere: f64,
        most: usize,
        matches: &mut Vec<ViewMatch>,
    ) {
        let odds = |other: usize| f64::from(self.of_sequences[(other, index)]);
        let whole: f64 = candidates.iter().map(|&other| odds(other).exp()).sum();
        let whole = whole + nowhere;
        for _ in 0..most {
            let best = candidates
                .iter()
                .copied()
                .max_by(|a, b| odds(*a).total_cmp(&odds(*b)).then(b.cmp(a)));
            let Some(best) = best.filter(|&best| odds(best) > 0.0) else {
                return;
            };
            let is_beside = |other: usize| {
                self.runs.is_same(best, other)
                    && best.abs_diff(other) <= tuning::BESIDE.unsigned_abs()
            };
            let beside = candidates.iter().filter(|&&other| is_beside(other));
            let mass: f64 = beside.map(|&other| odds(other).exp()).sum();
            let probability = mass / whole;
            if probability > tuning::PROBABILITY_MIN {
                matches.push(self.matched(index, best, probability));
            }
            candidates.retain(|&other| !is_beside(other));
        }
    }

    fn matched(&self, now: usize, then: usize, probability: f64) -> ViewMatch {
        let odds = probability / (1.0 - probability.min(0.999));
        ViewMatch {
            now: self.runs.views[now].sample,
            then: self.runs.views[then].sample,
            range_m: self.learned.range_m,
            sd_m: RANGE_SD * self.learned.range_m,
            depth: odds.ln_1p().clamp(tuning::DEPTH.0, tuning::DEPTH.1),
        }
    }

    /// Whether two views are so far from one another along the way that they may be matched.
    fn is_apart(&self, a: usize, b: usize) -> bool {
        let gap = gap(self.runs.len());
        !self.runs.is_same(a, b) || a.abs_diff(b) >= gap
    }

    /// Log of how much more probable the views are where a map has them than anywhere, with what
    /// they should have been like where the map has others. Each that is matched stands for those
    /// about it that are not.
    pub fn evidence(&self, positions: &[Option<Point3<f64>>]) -> f64 {
        let mut sum = 0.0;
        for (index, position) in positions.iter().enumerate() {
            let Some(position) = position else {
                continue;
            };
            let (mut expected, mut found) = (tuning::NOWHERE, tuning::NOWHERE);
            for (other, at) in positions[..index].iter().enumerate() {
                let Some(at) = at.as_ref().filter(|_| self.is_apart(index, other)) else {
                    continue;
                };
                let squared =
                    (position - at).norm_squared() / (self.learned.range_m * self.learned.range_m);
                if squared < 32.0 {
                    let weight = (-0.5 * squared).exp();
                    expected += weight;
                    found += weight * f64::from(self.log_odds[(other, index)]).exp();
                }
            }
            sum += (found / expected).ln();
        }
        sum / self.share * self.learned.independence.sqrt()
    }
}

/// What later views are compared with; the views lie nowhere so far.
fn view_map(
    (channel, range_m, turned): (u8, f64, Turned),
    runs: &Runs<'_>,
    centres: &Centres,
    model: &TwoCovariance,
    components: &DMatrix<f64>,
) -> ViewMap {
    let singles = |numbers: &mut dyn Iterator<Item = &f64>| -> Vec<f32> {
        numbers.map(|&number| single(number)).collect()
    };
    let own = { centres.own.iter() }.map(|((agent, session), mean)| SessionCentre {
        agent: *agent,
        session: *session,
        mean: singles(&mut mean.iter()),
    });
    let views = runs.views.iter().zip(components.row_iter());
    let references = views.map(|(view, components)| ReferenceView {
        sample: view.sample,
        ordinal: view.ordinal,
        stretch: view.stretch,
        pose: None,
        components: singles(&mut components.iter()),
    });
    let model = ViewModel {
        channel,
        range_m,
        turned,
        stride: runs.stride,
        centre: singles(&mut centres.whole.iter()),
        centres: own.collect(),
        projection: singles(&mut model.columns.iter()),
        correlations: model.correlations.clone(),
    };
    ViewMap::new(model, references.collect())
}

#[cfg(test)]
mod tests;
