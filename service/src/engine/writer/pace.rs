//! How much a round may do: as many records as lately took as long as a round should.

use std::time::Duration;

/// How long a round should take: as long may an estimate be held up by the other samples of its
/// round, and a reader by a round. Fewer records a round give more blocks, and change nothing else.
const ROUND: Duration = Duration::from_millis(20);
/// Most records of a round.
const RECORDS_MAX: usize = 16_384;
/// Fewest: what rounds cost beside their records stays small.
const RECORDS_MIN: usize = 64;

/// Measures rounds and bounds the next one.
#[derive(Debug)]
pub(super) struct Pace {
    records: usize,
}

impl Pace {
    pub(super) fn new() -> Self {
        Self {
            records: RECORDS_MAX,
        }
    }

    /// Whether a round that has so many records after so long is to take no more.
    pub(super) fn is_over(&self, records: usize, took: Duration) -> bool {
        records >= self.records || took >= ROUND
    }

    /// Notes what a round did and how long it took. Slower takes effect at once, faster by and by.
    pub(super) fn note(&mut self, records: usize, took: Duration) {
        if records < RECORDS_MIN {
            return;
        }
        let possible = records as f64 * ROUND.as_secs_f64() / took.as_secs_f64().max(1e-6);
        let possible = possible.clamp(RECORDS_MIN as f64, RECORDS_MAX as f64);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "clamped"
        )]
        let possible = possible as usize;
        self.records = possible.min(2 * self.records);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_take_as_long_as_they_should() {
        let mut pace = Pace::new();
        for us_per_record in [50, 5, 400, 20] {
            for _ in 0..20 {
                let records = pace.records;
                pace.note(
                    records,
                    Duration::from_micros(us_per_record * records as u64),
                );
            }
            let round = Duration::from_micros(us_per_record * pace.records as u64);
            let within = Duration::from_millis(15)..Duration::from_millis(26);
            assert!(within.contains(&round), "{us_per_record} us: {round:?}");
        }
        // A round that stood still for long does not slow down those after it for long.
        pace.note(1000, Duration::from_secs(60));
        for _ in 0..10 {
            let records = pace.records;
            pace.note(records, Duration::from_micros(20 * records as u64));
        }
        assert!(pace.records > 900);
        pace.note(1, Duration::from_secs(1));
        assert!(pace.records > 900, "one record says nothing");
    }
}
