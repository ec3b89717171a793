//! What the score of two views says: the range within which views are alike, and the log-odds that
//! two views lie within it of one another.

use nalgebra::{DMatrix, Matrix3, Vector3};

use super::neighbours::{NeighbourPair, Neighbours};
use super::runs::Runs;
use super::turned::Turned;
use super::two_covariance::{TwoCovariance, single};
use crate::tuning::similarity as tuning;

/// What was learned of a channel.
pub(super) struct Learned {
    /// Distance at which the similarity of views has fallen halfway to that of far ones, as the
    /// deviation of a Gaussian \[m\].
    pub(super) range_m: f64,
    /// Whether it was seen to fall so far: or else the range is that of the farthest neighbours,
    /// and may be more.
    pub(super) is_range_seen: bool,
    /// Distance of views one after the other \[m\].
    pub(super) spacing_m: f64,
    /// What a turn of the body changes in how alike views are.
    pub(super) turned: Turned,
    /// Share of the evidence of a view that is its own: neighbours say nearly the same.
    pub(super) independence: f64,
    /// Log-odds of all pairs of views.
    pub(super) log_odds: DMatrix<f32>,
    /// Weights of a score, of both backgrounds together and of a constant in the log-odds.
    weights: Vector3<f64>,
    /// How alike the most similar far views of each view are.
    backgrounds: Vec<f64>,
}

impl Learned {
    /// Whether views are alike over more than so many metres, and over many views of a way: farther
    /// apart than they are alike, views would show the same range. Or over as much of a way as was
    /// compared: as long as few views were seen, some mixture of their numbers changes slowly along
    /// any way.
    pub(super) fn is_coarse(&self, least_m: f64) -> bool {
        !self.is_range_seen || self.range_m > least_m.max(tuning::COARSE_SPACINGS * self.spacing_m)
    }

    /// From the scores of all pairs of views and of neighbours; `None` if there are no far views,
    /// or near ones are no more alike.
    pub(super) fn of(
        runs: &Runs<'_>,
        neighbours: &[NeighbourPair],
        mut scores: DMatrix<f32>,
    ) -> Option<Self> {
        let far = far_pairs(runs);
        if far.len() < tuning::FAR_PAIRS / 100 {
            return None;
        }
        let base = mean(&far, &scores);
        let LearnedRange {
            range_m,
            is_seen,
            spacing_m,
        } = range(neighbours, base)?;
        let backgrounds = backgrounds(runs, &scores);
        let near = near_features(neighbours, range_m, &backgrounds);
        let distant = far_features(&far, &scores, &backgrounds);
        let weights = logistic(&near, &distant)?;
        let mut learned = Self {
            range_m,
            is_range_seen: is_seen,
            spacing_m,
            turned: Turned::of(neighbours, range_m, base),
            independence: 1.0,
            log_odds: DMatrix::zeros(0, 0),
            weights,
            backgrounds,
        };
        for column in 0..runs.len() {
            for row in 0..runs.len() {
                let score = &mut scores[(row, column)];
                *score = learned.log_odds_by(*score, (row, column));
            }
        }
        learned.independence = independence(runs, &scores, &far);
        learned.log_odds = scores;
        Some(learned)
    }

    /// Log-odds by the score of two views, each one of those that were compared, or beside it.
    pub(super) fn log_odds_by(&self, score: f32, beside: (usize, usize)) -> f32 {
        let both = self.backgrounds[beside.0] + self.backgrounds[beside.1];
        let odds = self.weights.dot(&Vector3::new(f64::from(score), both, 1.0));
        let [low, high] = [tuning::LOG_ODDS.0, tuning::LOG_ODDS.1];
        single(odds).clamp(low, high)
    }
}

/// What the log-odds of two far views depend on: their score, and how alike everything is to them.
fn far_features(
    pairs: &[(usize, usize)],
    scores: &DMatrix<f32>,
    backgrounds: &[f64],
) -> Vec<Vector3<f64>> {
    let feature = |&(a, b): &(usize, usize)| {
        let score = f64::from(scores[(a, b)]);
        Vector3::new(score, backgrounds[a] + backgrounds[b], 1.0)
    };
    pairs.iter().map(feature).collect()
}

/// The same of neighbours within a range.
fn near_features(
    neighbours: &[NeighbourPair],
    range_m: f64,
    backgrounds: &[f64],
) -> Vec<Vector3<f64>> {
    let near = { neighbours.iter() }.filter(|pair| pair.lag >= 2 && pair.distance_m < range_m);
    let feature = |pair: &NeighbourPair| {
        let (a, b) = pair.about;
        Vector3::new(pair.score, backgrounds[a] + backgrounds[b], 1.0)
    };
    near.map(feature).collect()
}

/// Mean log-odds of neighbours within a range \[nats\], of the later half of the views by what is
/// learned of the earlier half: what was learned of the same pairs would flatter it.
pub(super) fn information_nats(
    runs: &Runs<'_>,
    neighbours: &Neighbours<'_>,
    views: &DMatrix<f64>,
    range_m: f64,
) -> f64 {
    validated_nats(runs, neighbours, views, range_m).unwrap_or(0.0)
}

fn validated_nats(
    runs: &Runs<'_>,
    neighbours: &Neighbours<'_>,
    views: &DMatrix<f64>,
    range_m: f64,
) -> Option<f64> {
    let half = runs.len() / 2;
    let matched = neighbours.of_matched(views);
    let within = neighbours.within(views, half)?;
    let model = TwoCovariance::of(within, &matched.rows(0, half).into_owned())?;
    let components = model.components(views);
    let (scores, score_sd) = model.scores(&neighbours.of_matched(&components));
    let backgrounds = backgrounds(runs, &scores);
    let pairs = neighbours.pairs(&model, &components, score_sd);
    let (later, earlier): (Vec<_>, Vec<_>) = { pairs.into_iter() }
        .filter(|pair| pair.about.0 >= half || pair.about.1 < half)
        .partition(|pair| pair.about.0 >= half);
    let far = far_pairs(runs).into_iter();
    let far: Vec<_> = far.filter(|&(a, b)| a < half && b < half).collect();
    let weights = logistic(
        &near_features(&earlier, range_m, &backgrounds),
        &far_features(&far, &scores, &backgrounds),
    )?;
    let later = near_features(&later, range_m, &backgrounds);
    let [low, high] = [tuning::LOG_ODDS.0, tuning::LOG_ODDS.1].map(f64::from);
    let odds = later.iter().map(|one| weights.dot(one).clamp(low, high));
    (!later.is_empty()).then(|| odds.sum::<f64>() / later.len() as f64)
}

/// Pairs of views that are far from one another along the way, drawn evenly.
fn far_pairs(runs: &Runs<'_>) -> Vec<(usize, usize)> {
    let n = runs.len();
    let least = tuning::FAR_MIN.max(n / tuning::FAR_PART);
    // Weyl's sequence of two irrational steps covers all pairs evenly.
    let part = |number: usize, step: f64| (number as f64 * step).fract();
    let pairs = (1..=tuning::FAR_PAIRS).map(|number| {
        [0.754_877_666_246_692_7, 0.569_840_290_998_053_2].map(|step| {
            let at = part(number, step) * n as f64;
            floor(at).min(n - 1)
        })
    });
    let is_far = |&[a, b]: &[usize; 2]| a.abs_diff(b) > least;
    pairs.filter(is_far).map(|[a, b]| (a, b)).collect()
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a number of views is neither negative nor large"
)]
fn floor(value: f64) -> usize {
    value as usize
}

/// Mean score of some pairs.
fn mean(pairs: &[(usize, usize)], scores: &DMatrix<f32>) -> f64 {
    let sum: f64 = pairs.iter().map(|&pair| f64::from(scores[pair])).sum();
    sum / pairs.len() as f64
}

/// What neighbours along the way say of the range of a channel.
struct LearnedRange {
    range_m: f64,
    /// Whether similarity falls halfway among them.
    is_seen: bool,
    /// Distance of the nearest of them \[m\].
    spacing_m: f64,
}

/// The range of a channel, from its views' neighbours along the way; `base` is the mean score of
/// far views.
fn range(neighbours: &[NeighbourPair], base: f64) -> Option<LearnedRange> {
    let mut pairs: Vec<(f64, f64)> = { neighbours.iter() }
        .map(|pair| (pair.distance_m, pair.score))
        .collect();
    if pairs.len() < tuning::NEIGHBOURS_MIN {
        return None;
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    let size = pairs.len().div_ceil(tuning::CLASSES);
    let mean = |class: &[(f64, f64)]| {
        let n = class.len() as f64;
        let sum = |sum: (f64, f64), pair: &(f64, f64)| (sum.0 + pair.0, sum.1 + pair.1);
        let (distance, score) = class.iter().fold((0.0, 0.0), sum);
        (distance / n, score / n)
    };
    let classes: Vec<(f64, f64)> = pairs.chunks(size).map(mean).collect();
    let half = base + 0.5 * (classes[0].1 - base);
    if half <= base {
        return None;
    }
    let falls = classes.iter().find(|class| class.1 < half);
    let range_m = match falls {
        Some(class) => class.0 / tuning::HALF_HEIGHT,
        None => classes[classes.len() - 1].0,
    };
    (range_m > 0.0).then_some(LearnedRange {
        range_m,
        is_seen: falls.is_some(),
        spacing_m: classes[0].0,
    })
}

/// How alike the most similar far views of each view are: log of their mean odds.
fn backgrounds(runs: &Runs<'_>, scores: &DMatrix<f32>) -> Vec<f64> {
    let n = runs.len();
    let most = 5.max(n / tuning::BACKGROUND_PART);
    let background = |index: usize| {
        let column = scores.column(index);
        let far = (0..n).filter(|other| other.abs_diff(index) > tuning::FAR_MIN);
        let mut far: Vec<f32> = far.map(|other| column[other]).collect();
        let n_far = far.len();
        if n_far > most {
            far.select_nth_unstable_by(n_far - most, f32::total_cmp);
            far.drain(..n_far - most);
        }
        // One order for one set of values: the sum is the same on any way there.
        far.sort_unstable_by(f32::total_cmp);
        let largest = far.last().map_or(0.0, |largest| f64::from(*largest));
        let sum: f64 = far.iter().map(|s| (f64::from(*s) - largest).exp()).sum();
        largest + (sum / far.len().max(1) as f64).ln()
    };
    (0..n).map(background).collect()
}

/// Weights of a logistic regression of near against far pairs, both with the same weight.
fn logistic(near: &[Vector3<f64>], far: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    const STEPS: usize = 25;
    const RIDGE: f64 = 1e-6;
    if near.is_empty() || far.is_empty() {
        return None;
    }
    let mut weights = Vector3::zeros();
    for _ in 0..STEPS {
        let mut gradient = -RIDGE * weights;
        let mut curvature = Matrix3::from_diagonal_element(RIDGE);
        for (features, is_near) in [(near, 1.0), (far, 0.0)] {
            let share = 0.5 / features.len() as f64;
            for feature in features {
                let odds = feature.dot(&weights).clamp(-30.0, 30.0);
                let probability = 1.0 / (1.0 + (-odds).exp());
                gradient += feature * (share * (is_near - probability));
                let slope = share * probability * (1.0 - probability);
                curvature += feature * feature.transpose() * slope;
            }
        }
        weights += curvature.try_inverse()? * gradient;
    }
    weights
        .iter()
        .all(|weight| weight.is_finite())
        .then_some(weights)
}

/// (1 − c) / (1 + c) with the correlation c of the log-odds of far pairs and of their successors.
fn independence(runs: &Runs<'_>, log_odds: &DMatrix<f32>, far: &[(usize, usize)]) -> f64 {
    let next = |(a, b): (usize, usize)| Some((runs.after(a, 1)?, runs.after(b, 1)?));
    let (mut n, mut x, mut y, mut xx, mut yy, mut xy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for &pair in far {
        let Some(next) = next(pair) else {
            continue;
        };
        let [a, b] = [pair, next].map(|pair| f64::from(log_odds[pair]));
        n += 1.0;
        x += a;
        y += b;
        xx += a * a;
        yy += b * b;
        xy += a * b;
    }
    let spread = ((n * xx - x * x) * (n * yy - y * y)).max(0.0).sqrt();
    if spread <= 0.0 {
        return 1.0;
    }
    let correlation = ((n * xy - x * y) / spread).clamp(0.0, 0.99);
    (1.0 - correlation) / (1.0 + correlation)
}
