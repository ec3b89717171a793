//! Codes side by side.

use std::fmt::{self, Display, Formatter};
use std::num::NonZeroUsize;

use cognitive_map::SettingsValues;
use serde::Serialize;

use super::condition::Condition;
use super::protocol::CodeProtocol;
use super::report::{CodeError, CodeReport};
use crate::eval::{Environment, Experiment, ExperimentError, Protocol, Report};

/// Codes to set beside the one asked for.
pub const CANDIDATES: [Candidate; 6] = [
    Candidate::new(5, 1.0, std::f64::consts::SQRT_2),
    Candidate::new(8, 1.0, std::f64::consts::SQRT_2),
    Candidate::new(5, 1.2, 1.618),
    Candidate::new(5, 1.5, 1.618),
    Candidate::new(5, 2.0, 1.5),
    Candidate::new(6, 1.2, 1.5),
];

/// The modules of a code.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Candidate {
    /// Number of grid modules.
    pub grid_modules: usize,
    /// Spacing of the finest grid module \[m\].
    pub grid_spacing_m: f64,
    /// Ratio of the spacings of neighbouring modules.
    pub grid_ratio: f64,
}

/// How a code did. Shares are of places, the rest is of the rooms of the first two experiments.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Compared {
    /// The code.
    #[serde(flatten)]
    pub code: Candidate,
    /// The spacing of its coarsest module \[m\].
    pub coarsest_m: f64,
    /// Least standard deviation of a position along each axis, by noisy codes \[m\].
    pub position_sd_m: f64,
    /// Mean error of recall over that of the nearest place, in env1 and env2.
    pub recall_over_nearest: [f64; 2],
    /// RMSE of recall in env2 \[m\].
    pub env2_rmse_m: f64,
    /// Share of noisy codes that recalled the right place.
    pub right_noisy: f64,
    /// Share of codes without two of the modules that did.
    pub right_two_erased: f64,
    /// Share of jittered codes without two of the modules that did.
    pub right_jittered_two_erased: f64,
}

/// Several codes, the one asked for last.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CodeComparison {
    /// Number of places.
    pub places: u64,
    /// Cues of each condition.
    pub queries: u32,
    /// Runs of each experiment.
    pub runs: u32,
    /// Seed of places, cues and the first run.
    pub seed: u64,
    /// The codes.
    pub rows: Vec<Compared>,
}

impl Candidate {
    const fn new(grid_modules: usize, grid_spacing_m: f64, grid_ratio: f64) -> Self {
        Self {
            grid_modules,
            grid_spacing_m,
            grid_ratio,
        }
    }
}

impl CodeComparison {
    /// Measures the [`CANDIDATES`] and the protocol's own code. `begun` is told of each code before
    /// its turn.
    ///
    /// # Errors
    /// The protocol makes no sense.
    pub fn measure(
        protocol: &CodeProtocol,
        runs: u32,
        threads: NonZeroUsize,
        begun: &impl Fn(&Candidate),
    ) -> Result<Self, CodeError> {
        protocol.check()?;
        let own = Candidate {
            grid_modules: protocol.settings.grid_modules,
            grid_spacing_m: protocol.settings.grid_spacing_m,
            grid_ratio: protocol.settings.grid_ratio,
        };
        let mut rows = Vec::new();
        for code in CANDIDATES
            .into_iter()
            .filter(|code| *code != own)
            .chain([own])
        {
            begun(&code);
            let settings = SettingsValues {
                grid_modules: code.grid_modules,
                grid_spacing_m: code.grid_spacing_m,
                grid_ratio: code.grid_ratio,
                ..protocol.settings.clone()
            };
            let protocol = CodeProtocol {
                settings,
                ..protocol.clone()
            };
            rows.push(Compared::measure(code, &protocol, runs, threads)?);
        }
        Ok(Self {
            places: protocol.places,
            queries: protocol.queries,
            runs,
            seed: protocol.seed,
            rows,
        })
    }
}

impl Compared {
    fn measure(
        code: Candidate,
        protocol: &CodeProtocol,
        runs: u32,
        threads: NonZeroUsize,
    ) -> Result<Self, CodeError> {
        let conditions = [Condition::ALL[2], Condition::ALL[4], Condition::ALL[5]];
        let report = CodeReport::measure_under(&conditions, protocol, threads, &|_| {})?;
        let right = |condition: &Condition| {
            let row = report.row(condition.name);
            row.map_or(f64::NAN, |row| row.right)
        };
        let room = |environment| -> Result<Report, ExperimentError> {
            let paper = Protocol::of_paper(environment);
            let room = Protocol {
                settings: SettingsValues {
                    recruitment: paper.settings.recruitment,
                    ..protocol.settings.clone()
                },
                ..paper
            };
            let experiment = Experiment::run(&room, runs, protocol.seed, threads, &|_| {})?;
            Ok(Report::of(&experiment))
        };
        let mean = |report: &Report, measure: &str| report.mean(measure).unwrap_or(f64::NAN);
        let over_nearest =
            |report: &Report| mean(report, "recall_ate_mean_m") / mean(report, "oracle_ate_mean_m");
        let env1 = room(Environment::GridAligned)?;
        let env2 = room(Environment::ObstacleRich)?;
        Ok(Self {
            code,
            coarsest_m: report.theory.spacings_m.last().copied().unwrap_or(f64::NAN),
            position_sd_m: report.theory.position_sd_m,
            recall_over_nearest: [over_nearest(&env1), over_nearest(&env2)],
            env2_rmse_m: mean(&env2, "recall_ate_rmse_m"),
            right_noisy: right(&conditions[0]),
            right_two_erased: right(&conditions[1]),
            right_jittered_two_erased: right(&conditions[2]),
        })
    }
}

impl Display for CodeComparison {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{} runs in each room; {} places, {} codes of each kind\n",
            self.runs, self.places, self.queries
        )?;
        writeln!(
            f,
            "{:<18} {:>9} {:>8} {:>8} {:>8} {:>9} {:>8} {:>8} {:>10}",
            "", "coarsest", "sd of a", "env1", "env2", "env2", "noisy", "two", "two erased"
        )?;
        writeln!(
            f,
            "{:<18} {:>9} {:>8} {:>8} {:>8} {:>9} {:>8} {:>8} {:>10}",
            "modules, finest, r",
            "[m]",
            "pos. [m]",
            "ratio",
            "ratio",
            "RMSE [m]",
            "right",
            "erased",
            "+ jitter"
        )?;
        for row in &self.rows {
            let code = format!(
                "{} × {} m, {:.3}",
                row.code.grid_modules, row.code.grid_spacing_m, row.code.grid_ratio
            );
            let [env1, env2] = row.recall_over_nearest;
            writeln!(
                f,
                "{code:<18} {:>9.2} {:>8.4} {env1:>8.4} {env2:>8.4} {:>9.4} {:>8.4} {:>8.4} {:>10.4}",
                row.coarsest_m,
                row.position_sd_m,
                row.env2_rmse_m,
                row.right_noisy,
                row.right_two_erased,
                row.right_jittered_two_erased
            )?;
        }
        Ok(())
    }
}
