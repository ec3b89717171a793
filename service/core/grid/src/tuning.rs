//! Width of grid fields.

/// Tuning width σ of every cell as a share of its module's spacing.
///
/// Half the distance between neighbouring preferred phases, so that neighbours' fields overlap and
/// the activation varies smoothly between them, while a field (full width at half height 2.35 σ =
/// 0.39 spacings) stays clear of the next one of the same cell.
pub const TUNING_WIDTH: f64 = 1.0 / 6.0;
