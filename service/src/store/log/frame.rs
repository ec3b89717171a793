//! Frames: a block of the journal on disk, with what is needed to find it and to trust it.
//!
//! ```text
//! frame   = header payload
//! header  = magic          u32   0x324d4743, "CGM2"
//!           length         u32   bytes of the payload
//!           block          u64   number of the block
//!           samples        u64   samples in the block
//!           total          u64   samples of the journal through this block
//!           durable        u64   blocks that were durable when this one was appended
//!                          u64   samples in them
//!           payload check  u64   XXH3 of the payload, seeded with the block's number
//!           header check   u64   XXH3 of the bytes before, seeded with the space's number
//! ```
//!
//! All numbers are little-endian. Since the checks are seeded, a frame is valid in its own space
//! and under its own number only. `durable` is what tells a block that was acknowledged from one
//! that a crash caught before: a valid frame that calls an earlier block durable is proof of it.

use xxhash_rust::xxh3::xxh3_64_with_seed;

use super::super::SpaceNumber;
use super::mark::Extent;

/// Bytes of a header.
pub(in crate::store) const HEADER_BYTES: usize = 64;

/// The first bytes of every frame.
pub(super) const MAGIC: [u8; 4] = *b"CGM2";

/// Bytes that the header's check is over.
const CHECKED_BYTES: usize = HEADER_BYTES - 8;

/// What precedes a block on disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::store) struct Header {
    /// Bytes of the block.
    pub(in crate::store) length: u32,
    /// Number of the block.
    pub(in crate::store) block: u64,
    /// Samples in the block.
    pub(in crate::store) samples: u64,
    /// Samples of the journal through this block.
    pub(in crate::store) total: u64,
    /// What was durable when this one was appended.
    pub(in crate::store) durable: Extent,
    /// Check of the block's bytes.
    pub(in crate::store) payload_check: u64,
}

impl Header {
    /// Bytes of the whole frame.
    pub(in crate::store) fn frame_bytes(&self) -> u64 {
        HEADER_BYTES as u64 + u64::from(self.length)
    }

    /// The header as it stands on disk in the journal of `space`.
    pub(in crate::store) fn encode(&self, space: SpaceNumber) -> [u8; HEADER_BYTES] {
        let mut bytes = [0; HEADER_BYTES];
        bytes[..4].copy_from_slice(&MAGIC);
        bytes[4..8].copy_from_slice(&self.length.to_le_bytes());
        let numbers = [
            self.block,
            self.samples,
            self.total,
            self.durable.blocks,
            self.durable.samples,
            self.payload_check,
        ];
        for (field, number) in bytes[8..].chunks_exact_mut(8).zip(numbers) {
            field.copy_from_slice(&number.to_le_bytes());
        }
        let check = header_check(&bytes, space);
        bytes[CHECKED_BYTES..].copy_from_slice(&check.to_le_bytes());
        bytes
    }

    /// The header at the beginning of `bytes`, if a valid one of `space` stands there.
    pub(in crate::store) fn decode(bytes: &[u8], space: SpaceNumber) -> Option<Self> {
        let bytes: &[u8; HEADER_BYTES] = bytes.first_chunk()?;
        let number = |at: usize| u64::from_le_bytes(std::array::from_fn(|i| bytes[at + i]));
        if bytes[..4] != MAGIC || number(CHECKED_BYTES) != header_check(bytes, space) {
            return None;
        }
        Some(Self {
            length: u32::from_le_bytes(std::array::from_fn(|i| bytes[4 + i])),
            block: number(8),
            samples: number(16),
            total: number(24),
            durable: Extent {
                blocks: number(32),
                samples: number(40),
            },
            payload_check: number(48),
        })
    }

    /// Whether `payload` is the block that the header announces.
    pub(in crate::store) fn fits(&self, payload: &[u8]) -> bool {
        payload.len() == self.length as usize
            && payload_check(self.block, payload) == self.payload_check
    }
}

/// The check of a block's bytes.
pub(in crate::store) fn payload_check(block: u64, payload: &[u8]) -> u64 {
    xxh3_64_with_seed(payload, block)
}

fn header_check(bytes: &[u8; HEADER_BYTES], space: SpaceNumber) -> u64 {
    xxh3_64_with_seed(&bytes[..CHECKED_BYTES], space.0.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: Header = Header {
        length: 3,
        block: 0x0102_0304_0506_0708,
        samples: 5,
        total: 77,
        durable: Extent {
            blocks: 9,
            samples: 60,
        },
        payload_check: 0,
    };

    #[test]
    fn a_header_comes_back_in_its_own_space_only() {
        let space = SpaceNumber(7);
        let bytes = HEADER.encode(space);
        assert_eq!(Header::decode(&bytes, space), Some(HEADER));
        assert_eq!(Header::decode(&bytes, SpaceNumber(8)), None);
        assert_eq!(Header::decode(&bytes[..HEADER_BYTES - 1], space), None);
    }

    #[test]
    fn every_flipped_bit_of_a_header_is_noticed() {
        let space = SpaceNumber(7);
        let bytes = HEADER.encode(space);
        for bit in 0..8 * HEADER_BYTES {
            let mut flipped = bytes;
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(Header::decode(&flipped, space), None, "bit {bit}");
        }
    }

    /// The bytes of format 2 as first released; they must be readable for ever.
    #[test]
    fn format_2_stays_as_it_is() {
        let payload = b"abc";
        let header = Header {
            payload_check: payload_check(HEADER.block, payload),
            ..HEADER
        };
        let bytes = header.encode(SpaceNumber(7));
        assert_eq!(
            bytes[..16],
            *b"CGM2\x03\0\0\0\x08\x07\x06\x05\x04\x03\x02\x01"
        );
        assert_eq!(bytes[48..], RELEASED);
        assert!(header.fits(payload) && !header.fits(b"abd") && !header.fits(b"ab"));
    }

    const RELEASED: [u8; 16] = [
        138, 120, 203, 56, 87, 155, 4, 55, 194, 63, 199, 73, 55, 190, 76, 151,
    ];
}
