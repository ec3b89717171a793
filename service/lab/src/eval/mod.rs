//! The seed paper's experiments in a room: protocols, measures, tables and figures.
//!
//! An [`Experiment`] is several runs of a [`Protocol`]. In each run an agent starts in the middle
//! of a room, is told where that is, and walks; the core's map learns from its odometry, and after
//! every step the memory is asked what the agent's grid code reminds it of. [`Quantity`] says
//! exactly what is measured at a step, [`MEASURES`] lists what becomes of it over a run, a
//! [`Report`] has the mean, median and largest over the runs, a [`Table`] shows them beside the
//! paper's, and [`figures`] draws them over the steps.
//!
//! # What the paper leaves open, and what is done here
//!
//! | question | answer |
//! |---|---|
//! | which random walk | steps of 0.1 m, each in a direction of its own ([`Walk::Pure`]); [`Walk::Persistent`] on request |
//! | what the walk does at a wall | draws another direction |
//! | when a place is recruited | at a step with P = 0.05, unless another place is closer than 1/32 m (the map's rule; the paper says "a previously unexplored or novel location"); it leaves 49.7 of the 50 places to be expected in env2, over 100 seeds |
//! | before or after recall | before: at the step of its recruitment a place recalls itself. [`Quantity::PredictionError`] has the other order |
//! | steps before the first place | have no error of recall and do not count, nor in the nearest place's |
//! | position of a recalled place | where the map believes that it is; the paper stores the true one. Without noise they are equal |
//! | ε of a unique location, σ of Eq. 9 | see [`Quantity`] |
//!
//! The third experiment, with objects, is in [`object`].
//!
//! The room's corner is the origin of the map, and the start is told without error. Sums are taken
//! in a fixed order, so that equal protocols and seeds give equal reports, on any number of
//! threads.
//!
//! ```
//! use std::num::NonZeroUsize;
//! use cogmap_lab::eval::{Environment, Experiment, Protocol, Report};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let protocol = Protocol::of_paper(Environment::GridAligned);
//! let experiment = Experiment::run(&protocol, 4, 1, NonZeroUsize::MIN, &|_| {})?;
//! let report = Report::of(&experiment);
//! assert!(report.mean("decoded_ate_rmse_m").unwrap() < 1e-6);
//! # Ok(())
//! # }
//! ```

mod agent;
pub mod code;
mod curve;
mod environment;
mod experiment;
pub(crate) mod figure;
mod measure;
pub mod network;
pub mod object;
mod protocol;
mod quantity;
mod report;
mod run;
pub mod sequences;
mod statistic;
mod table;
mod tally;
mod territory;

pub use environment::Environment;
pub use experiment::{Experiment, ExperimentError};
pub use figure::{Figure, FigureError, figures};
pub use measure::{MEASURES, Measure};
pub use protocol::{
    Correct, Explored, InvalidProtocol, PAPER_P_NEW, Percept, Protocol, SightingSettings,
    ViewSettings, Walk,
};
pub use quantity::Quantity;
pub use report::{PaperAte, Report};
pub use run::{Path, RunError};
pub use statistic::Statistic;
pub use table::Table;

#[cfg(test)]
mod tests;
