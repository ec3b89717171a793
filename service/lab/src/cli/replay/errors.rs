//! Errors of position.

use serde::Serialize;

use super::outcome::RobotOutcome;
use super::scoring::Scoring;
use super::team::Known;

/// RMSE of position \[m\], in the frame of the truth and after the best rigid motion.
#[derive(Clone, Copy, Debug, Serialize)]
pub(super) struct Errors {
    #[serde(rename = "dead_reckoning_ate_rmse_m")]
    pub(super) dead_reckoning: Option<f64>,
    #[serde(rename = "dead_reckoning_aligned_ate_rmse_m")]
    pub(super) dead_reckoning_aligned: Option<f64>,
    #[serde(rename = "causal_ate_rmse_m")]
    pub(super) causal: Option<f64>,
    #[serde(rename = "causal_aligned_ate_rmse_m")]
    pub(super) causal_aligned: Option<f64>,
    #[serde(rename = "refined_ate_rmse_m")]
    pub(super) refined: Option<f64>,
    #[serde(rename = "refined_aligned_ate_rmse_m")]
    pub(super) refined_aligned: Option<f64>,
}

impl Errors {
    /// Of a robot.
    pub(super) fn of(scoring: &Scoring, known: &Known, came_out: &RobotOutcome) -> Self {
        let truth = known.truth.as_ref();
        let [reckoned, reckoned_aligned] = scoring.errors_m(&known.reckoned, truth);
        let [causal, causal_aligned] = scoring.errors_of_rows_m(&came_out.causal, truth);
        let [refined, refined_aligned] = scoring.errors_of_rows_m(&came_out.refined, truth);
        Self {
            dead_reckoning: reckoned,
            dead_reckoning_aligned: reckoned_aligned,
            causal,
            causal_aligned,
            refined,
            refined_aligned,
        }
    }

    /// Means of each.
    pub(super) fn means(all: &[&Self]) -> Self {
        Self::each(all, |values| mean(values.into_iter()))
    }

    /// Medians of each.
    pub(super) fn medians(all: &[&Self]) -> Self {
        Self::each(all, median)
    }

    fn each(all: &[&Self], middle: fn(Vec<f64>) -> Option<f64>) -> Self {
        let of = |value: fn(&Self) -> Option<f64>| {
            middle(all.iter().filter_map(|errors| value(errors)).collect())
        };
        Self {
            dead_reckoning: of(|errors| errors.dead_reckoning),
            dead_reckoning_aligned: of(|e| e.dead_reckoning_aligned),
            causal: of(|errors| errors.causal),
            causal_aligned: of(|errors| errors.causal_aligned),
            refined: of(|errors| errors.refined),
            refined_aligned: of(|errors| errors.refined_aligned),
        }
    }

    /// As cells of a table.
    pub(super) fn cells(&self) -> String {
        let metres =
            |value: Option<f64>| value.map_or("  never".to_owned(), |m| format!("{m:7.3}"));
        format!(
            "{}  {}     {}  {}    {}  {}",
            metres(self.dead_reckoning),
            metres(self.dead_reckoning_aligned),
            metres(self.causal),
            metres(self.causal_aligned),
            metres(self.refined),
            metres(self.refined_aligned),
        )
    }
}

/// Mean; none of nothing.
pub(super) fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0u32);
    for value in values {
        sum += value;
        count += 1;
    }
    (count > 0).then(|| sum / f64::from(count))
}

/// The middle value, or the mean of the two in the middle.
pub(super) fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let half = values.len() / 2;
    let upper = values.get(half)?;
    Some(match values.len() % 2 {
        1 => *upper,
        _ => f64::midpoint(values[half - 1], *upper),
    })
}

#[cfg(test)]
mod tests {
    use super::median;

    #[test]
    fn a_median_is_between_the_middle_two() {
        assert_eq!(median(vec![]), None);
        assert_eq!(median(vec![3.0, 1.0, 2.0]), Some(2.0));
        assert_eq!(median(vec![4.0, 1.0, 2.0, 3.0]), Some(2.5));
    }
}
