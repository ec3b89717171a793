//! What a recording through the experience map came to.

use serde::Serialize;

use cogmap::cli::output;
use cogmap::cli::quantile;

/// One run. What the data do not tell, or was not run, is null.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    /// Of the refined map.
    pub(super) digest: String,
    pub(super) poses: usize,
    pub(super) landmarks: usize,
    pub(super) links: usize,
    pub(super) closures: Closures,
    pub(super) false_share: Option<f64>,
    /// Of the refined map, over motion and the accepted closures.
    pub(super) chi2_half: f64,
    /// Of the map that fits all closures best, false or not.
    pub(super) chi2_half_of_all: Option<f64>,
    /// Of the map at the end of the causal run.
    pub(super) chi2_half_causal: Option<f64>,
    pub(super) causal_ate_rmse_m: Option<f64>,
    pub(super) causal_aligned_ate_rmse_m: Option<f64>,
    pub(super) refined_ate_rmse_m: Option<f64>,
    pub(super) refined_aligned_ate_rmse_m: Option<f64>,
    pub(super) update_ms: Option<UpdateMs>,
    /// How often all closures were judged anew in the causal run.
    pub(super) judgements: Option<usize>,
    pub(super) batch_s: f64,
    pub(super) real_time_factor: Option<f64>,
    pub(super) consistency: ConsistencyReport,
}

/// Matches, and sightings of landmarks that were seen before.
#[derive(Debug, Serialize)]
pub(super) struct Closures {
    pub(super) accepted: usize,
    pub(super) rejected: usize,
}

/// Elapsed time of an update: of taking in a pose and all that comes with it.
#[derive(Debug, Serialize)]
pub(super) struct UpdateMs {
    mean: f64,
    p50: f64,
    p99: f64,
    max: f64,
}

/// Squared errors in standard deviations over their degrees of freedom; 1 is right, more is too
/// sure.
#[derive(Debug, Serialize)]
pub(super) struct ConsistencyReport {
    /// Of accepted closures, against what was expected before they came.
    pub(super) nis_per_degree: Option<f64>,
    pub(super) nis_count: usize,
    /// Of newest positions, against the truth.
    pub(super) nees_per_degree: Option<f64>,
    pub(super) nees_count: usize,
}

impl UpdateMs {
    pub(super) fn of(times_ms: &[f64]) -> Self {
        let mut sorted = times_ms.to_vec();
        Self {
            mean: times_ms.iter().sum::<f64>() / times_ms.len().max(1) as f64,
            p50: quantile(&mut sorted, 0.5),
            p99: quantile(&mut sorted, 0.99),
            max: quantile(&mut sorted, 1.0),
        }
    }
}

impl Report {
    pub(super) fn print(&self) -> anyhow::Result<()> {
        let Closures { accepted, rejected } = &self.closures;
        output::line(&format!(
            "{} poses, {} landmarks, {} links; {accepted} closures accepted, {rejected} rejected",
            self.poses, self.landmarks, self.links
        ))?;
        if let Some(share) = self.false_share {
            output::line(&format!("{:.1} % of the matches are false", 100.0 * share))?;
        }
        let all = self.chi2_half_of_all;
        let all = all.map_or(String::new(), |all| format!(", with all closures {all:.4}"));
        output::line(&format!("chi2/2 {:.4}{all}", self.chi2_half))?;
        output::line("                 plain    aligned    RMSE of position [m]")?;
        for (name, plain, aligned) in [
            (
                "causal",
                self.causal_ate_rmse_m,
                self.causal_aligned_ate_rmse_m,
            ),
            (
                "refined",
                self.refined_ate_rmse_m,
                self.refined_aligned_ate_rmse_m,
            ),
        ] {
            let (plain, aligned) = (cell(plain), cell(aligned));
            output::line(&format!("{name:<10}{plain:>12}{aligned:>11}"))?;
        }
        if let Some(ms) = &self.update_ms {
            output::line(&format!(
                "update: mean {:.2} ms, p50 {:.2}, p99 {:.2}, max {:.2}; {} judgements",
                ms.mean,
                ms.p50,
                ms.p99,
                ms.max,
                self.judgements.unwrap_or(0)
            ))?;
        }
        let factor = self.real_time_factor;
        let factor = factor.map_or(String::new(), |factor| {
            format!("; the causal run was {factor:.0} times as fast as the recording")
        });
        output::line(&format!("whole map: {:.2} s{factor}", self.batch_s))?;
        let ConsistencyReport {
            nis_per_degree,
            nees_per_degree,
            ..
        } = &self.consistency;
        output::line(&format!(
            "errors in standard deviations, squared: NIS {} of accepted closures, NEES {} of newest positions",
            cell(*nis_per_degree),
            cell(*nees_per_degree)
        ))?;
        output::line(&format!("digest {}", self.digest))?;
        Ok(())
    }
}

fn cell(value: Option<f64>) -> String {
    value.map_or_else(|| "unknown".to_owned(), |value| format!("{value:.4}"))
}
