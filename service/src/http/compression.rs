//! Long answers are compressed for those who take them so.

use tower_http::CompressionLevel;
use tower_http::compression::CompressionLayer;
use tower_http::compression::predicate::{NotForContentType, Predicate, SizeAbove};

/// Shortest answer that is compressed \[bytes\]: what fits into a few packets is sent sooner as it
/// is.
const BYTES_MIN: u64 = 4096;

/// Compresses texts (gzip) where the request accepts that. Each event of a stream leaves at once,
/// and images and numbers in binary would not become much shorter.
pub(crate) fn layer() -> CompressionLayer<impl Predicate> {
    let worth_it = SizeAbove::new(BYTES_MIN)
        .and(NotForContentType::SSE)
        .and(NotForContentType::IMAGES)
        .and(NotForContentType::const_new("application/octet-stream"));
    // The asynchronous threads do it: the fastest level takes a third of the time of the usual one.
    CompressionLayer::new()
        .quality(CompressionLevel::Fastest)
        .compress_when(worth_it)
}
