//! What a grid code can tell: measured on a map full of places, beside what theory says.
//!
//! A [`CodeProtocol`] names a code (number of modules, finest spacing, ratio), a number of places
//! and how codes are damaged. A [`CodeReport`] has how often the right place wins by a whole code,
//! by one of a position beside the place, by a noisy one, without any one or two of its modules,
//! and by codes damaged twice; and the [`CodeTheory`] of the code. A [`CodeComparison`] sets
//! several codes side by side, with their errors in the two rooms. The model is described in
//! `docs/recall.md`.
//!
//! ```
//! use std::num::NonZeroUsize;
//! use cogmap_lab::eval::code::{CodeProtocol, CodeReport};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let protocol = CodeProtocol { places: 300, queries: 30, ..CodeProtocol::default() };
//! let report = CodeReport::measure(&protocol, NonZeroUsize::MIN, &|_| {})?;
//! assert_eq!(report.rows[0].condition, "whole");
//! assert!(report.rows[0].right >= 1.0);
//! # Ok(())
//! # }
//! ```

mod comparison;
mod condition;
mod cue;
mod protocol;
mod report;
mod survey;
mod theory;

pub use comparison::{CANDIDATES, Candidate, CodeComparison, Compared};
pub use condition::Condition;
pub use cue::{CueSource, Damage, DrawnCue};
pub use protocol::CodeProtocol;
pub use report::{CodeError, CodeReport, CodeRow};
pub use survey::survey;
pub use theory::CodeTheory;

#[cfg(test)]
mod tests;
