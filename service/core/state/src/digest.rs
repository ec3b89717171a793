//! Digests: equal digests, equal maps.

use std::fmt;
use std::str::FromStr;

/// A 128-bit digest of a map's state, written as 32 hexadecimal digits.
///
/// It is `MurmurHash3` x64 128 over the canonical bytes. That is not a cryptographic hash: it finds
/// differences and damage, but somebody who wants two different maps with the same digest can make
/// them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Digest(pub u128);

/// A text that is not 32 hexadecimal digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("a digest has 32 hexadecimal digits")]
pub struct InvalidDigest;

impl Digest {
    /// The digest of bytes.
    pub fn of(bytes: &[u8]) -> Self {
        Self(murmur3_x64_128(bytes, 0))
    }
}

impl fmt::Display for Digest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:032x}", self.0)
    }
}

impl FromStr for Digest {
    type Err = InvalidDigest;

    fn from_str(text: &str) -> Result<Self, InvalidDigest> {
        // Parsing alone would also take a sign.
        if text.len() != 32 || !text.bytes().all(|byte| byte.is_ascii_hexdigit()) {
            return Err(InvalidDigest);
        }
        u128::from_str_radix(text, 16)
            .map(Self)
            .map_err(|_| InvalidDigest)
    }
}

/// `MurmurHash3` x64 128 (Appleby 2011, public domain); the first half is the upper one.
fn murmur3_x64_128(bytes: &[u8], seed: u32) -> u128 {
    const C1: u64 = 0x87c3_7b91_1142_53d5;
    const C2: u64 = 0x4cf5_ad43_2745_937f;
    let mix_k1 = |k1: u64| k1.wrapping_mul(C1).rotate_left(31).wrapping_mul(C2);
    let mix_k2 = |k2: u64| k2.wrapping_mul(C2).rotate_left(33).wrapping_mul(C1);
    let mut h1 = u64::from(seed);
    let mut h2 = u64::from(seed);
    let (blocks, tail) = bytes.as_chunks::<16>();
    for block in blocks {
        let (k1, k2) = words(*block);
        h1 ^= mix_k1(k1);
        h1 = h1
            .rotate_left(27)
            .wrapping_add(h2)
            .wrapping_mul(5)
            .wrapping_add(0x52dc_e729);
        h2 ^= mix_k2(k2);
        h2 = h2
            .rotate_left(31)
            .wrapping_add(h1)
            .wrapping_mul(5)
            .wrapping_add(0x3849_5ab5);
    }
    // Zero is a fixed point of both mixers, so a padded tail hashes like the published switch.
    let mut block = [0; 16];
    block[..tail.len()].copy_from_slice(tail);
    let (k1, k2) = words(block);
    h1 ^= mix_k1(k1);
    h2 ^= mix_k2(k2);

    h1 ^= bytes.len() as u64;
    h2 ^= bytes.len() as u64;
    h1 = h1.wrapping_add(h2);
    h2 = h2.wrapping_add(h1);
    h1 = finalise(h1);
    h2 = finalise(h2);
    h1 = h1.wrapping_add(h2);
    h2 = h2.wrapping_add(h1);
    (u128::from(h1) << 64) | u128::from(h2)
}

/// The two little-endian words of a block.
fn words(block: [u8; 16]) -> (u64, u64) {
    let both = u128::from_le_bytes(block);
    #[expect(
        clippy::cast_possible_truncation,
        reason = "splits the block into its halves"
    )]
    let halves = (both as u64, (both >> 64) as u64);
    halves
}

/// The finaliser `fmix64`.
fn finalise(mut k: u64) -> u64 {
    k = (k ^ (k >> 33)).wrapping_mul(0xff51_afd7_ed55_8ccd);
    k = (k ^ (k >> 33)).wrapping_mul(0xc4ce_b9fe_1a85_ec53);
    k ^ (k >> 33)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The verification of the `SMHasher` suite: hashes of 256 keys, hashed once more.
    #[test]
    fn equals_the_published_verification_value() {
        let key: Vec<u8> = (0..=255).collect();
        let mut hashes = Vec::new();
        for len in 0..256u32 {
            let hash = murmur3_x64_128(&key[..len as usize], 256 - len);
            hashes.extend(((hash >> 64) as u64).to_le_bytes());
            hashes.extend((u64::try_from(hash & u128::from(u64::MAX)).unwrap()).to_le_bytes());
        }
        let hash = murmur3_x64_128(&hashes, 0);
        assert_eq!((hash >> 64) as u64 & 0xffff_ffff, 0x6384_ba69);
    }

    #[test]
    fn equals_a_published_vector() {
        let hash = murmur3_x64_128(b"The quick brown fox jumps over the lazy dog", 0);
        assert_eq!(hash, 0xe34b_bc7b_bc07_1b6c_7a43_3ca9_c49a_9347);
        assert_eq!(murmur3_x64_128(b"", 0), 0);
    }

    #[test]
    fn text_round_trips() {
        for digest in [
            Digest(0),
            Digest(1),
            Digest(u128::MAX),
            Digest::of(b"somewhere"),
        ] {
            assert_eq!(digest.to_string().len(), 32);
            assert_eq!(digest.to_string().parse(), Ok(digest));
        }
        for text in [
            "",
            "12",
            "+0000000000000000000000000000001",
            &"g".repeat(32),
        ] {
            assert_eq!(text.parse::<Digest>(), Err(InvalidDigest), "{text}");
        }
    }
}
