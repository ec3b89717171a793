//! Tracking among the views of a map. Lengths are in ranges of the channel.

/// Particles of an agent, and most agents that are tracked.
pub(crate) const COUNT: usize = 1000;
pub(crate) const AGENTS_MAX: usize = 256;
/// Width of the kernel by which views are of one place.
pub(crate) const WIDTH: f64 = 0.5;
/// Farthest view that counts, in widths.
pub(crate) const KERNEL_REACH: f64 = 3.0;
/// Side of the cells in which a view is as probable everywhere.
pub(crate) const CELL: f64 = 0.25;
/// Turns of the body in which it is as probable everywhere: as many to a full one.
pub(crate) const CELLS_TURNED: f64 = 24.0;
/// Part that a turn leaves at least where it changes nothing.
pub(crate) const UNTURNED: f64 = 0.95;
/// Classes of how many views are about a position: up to 2⁸.
pub(crate) const CLASS_MAX: usize = 16;
/// ε: probability that a view shows something else.
pub(crate) const ELSE: f64 = 0.05;
/// Largest evidence of a view for a position \[nats\].
pub(crate) const NATS_MAX: f64 = 50.0;
/// Weight of views that nobody took.
pub(crate) const UNKNOWN: f64 = 0.5;
/// Part of its evidence that a view counts: neighbours err alike, and so does the map.
pub(crate) const PART: f64 = 0.1;
/// Least and largest noise of a heading \[rad/√s\]: of a gyroscope, and of an animal.
pub(crate) const NOISE_RAD: (f64, f64) = (0.005, 0.5);
/// Standard deviation by which its logarithm changes with a view.
pub(crate) const NOISE_STEP: f64 = 0.05;
/// Standard deviation of the factor of lengths, and of a position, as a part of the way.
pub(crate) const SCALE_SD: f64 = 0.1;
pub(crate) const POSITION_PART: f64 = 0.15;
/// An estimate that is so far from where motion leads was put elsewhere: ranges, and part of
/// the way; and \[rad\].
pub(crate) const PUT_RANGES: f64 = 0.1;
pub(crate) const PUT_PART: f64 = 0.2;
pub(crate) const PUT_RAD: f64 = 0.3;
/// Particles that stay when an estimate was put elsewhere.
pub(crate) const KEPT: usize = 750;
/// Rate at which the mean fit of views follows, and the one \[nats\] below which an agent is
/// where nothing was seen: between ln ε there, and zero of one that may be anywhere in the map.
pub(crate) const FIT_RATE: f64 = 0.1;
pub(crate) const FIT_ELSEWHERE: f64 = -1.0;
/// Standard deviation below which a position is known.
pub(crate) const NEAR: f64 = 4.0;
/// Standard deviation below which nobody gets by views: that of the map.
pub(crate) const FLOOR: f64 = 0.25;
/// Largest gain of one view that counts for the fit, either way \[nats\].
pub(crate) const GAIN_MAX: f64 = 3.0;
/// Longest time between two views by which headings are spread \[s\].
pub(crate) const SECONDS_MAX: f64 = 3600.0;
/// Records of a space after which an agent that has shown nothing makes room for another one.
pub(crate) const IDLE_RECORDS: u64 = 65_536;
/// Largest standard deviation of a component of an estimate about which particles are drawn.
pub(crate) const SD_MAX: f64 = 1e6;
