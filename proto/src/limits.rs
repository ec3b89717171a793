//! The bounds of every message, each with its reason. A message beyond a bound is refused whole.

/// Longest encoded message \[bytes\]: 4,096 samples of motion with noise fit twice over, and a
/// thousand of these in flight still fit a small machine's memory.
pub const MESSAGE_BYTES_MAX: usize = 1 << 20;

/// Most samples in one batch: four seconds of a 1 kHz sensor.
pub const BATCH_SAMPLES_MAX: usize = 4096;

/// Farthest that the number of a sample may be ahead of the next one in order: a year and more of
/// samples at 100 Hz that a service has lost and their robot no longer has. What is farther ahead
/// is a mistake or a forgery.
pub const SEQUENCE_LEAP_MAX: u64 = 1 << 32;

/// Shortest descriptor: below this, unit vectors hardly tell places apart.
pub const DESCRIPTOR_LEN_MIN: usize = 8;

/// Longest descriptor: the widest image descriptors in use.
pub const DESCRIPTOR_LEN_MAX: usize = 4096;

/// Longest name of a space, an agent or a channel \[bytes\].
pub const NAME_BYTES_MAX: usize = 64;

/// Longest label of a landmark or a marker \[bytes\].
pub const LABEL_BYTES_MAX: usize = 128;

/// Largest coordinate, length or speed \[m, m/s\]: beyond the Earth's circumference a metre is
/// surely a wrong unit, and squares stay far from overflow.
pub const METRES_MAX: f64 = 1e8;

/// Largest angular rate \[rad/s\]: a hundred turns a second.
pub const RADIANS_PER_SECOND_MAX: f64 = 1e3;

/// Longest interval that one velocity sample may cover \[s\].
pub const DURATION_S_MAX: f64 = 3600.0;

/// Farthest a quaternion's norm may be from one: four decimal digits survive in text formats.
pub const QUATERNION_NORM_TOLERANCE: f64 = 1e-3;

/// Most items of one page of an answer.
pub const PAGE_ITEMS_MAX: usize = 1000;

/// Items of a page when the query names no limit.
pub const PAGE_ITEMS_DEFAULT: usize = 100;

/// Most grid modules of a space.
pub const GRID_MODULES_MAX: usize = 16;

/// Rejections that a watermark carries: the latest ones.
pub const WATERMARK_REJECTIONS_MAX: usize = 16;

/// Most contacts of one lesson about an object.
pub const LESSON_CONTACTS_MAX: usize = 4096;

/// Most contacts of one question which object it is: each is compared with every object.
pub const IDENTIFY_CONTACTS_MAX: usize = 256;

/// Most samples of one question where they were taken: as many as come in one batch.
pub const LOCALIZE_SAMPLES_MAX: usize = BATCH_SAMPLES_MAX;

/// Most rotations by which the frame of an episode may be turned against an object's.
pub const ROTATIONS_MAX: usize = 1000;
