//! The mark of a space: how far its journal was acknowledged, kept outside the journal.
//!
//! ```text
//! file  = slot, zeros up to byte 512, slot, zeros up to byte 1024
//! slot  = magic "CGMK", space: u32, blocks: u64, samples: u64, check: u64       little endian
//! ```
//!
//! The two slots are written in turn, so that one of them is whole whenever a write is cut short.
//! The larger one holds. A mark is written after each sync of the journal and before anybody is
//! told, which survives the process; the file itself is synced about once a second, which bounds
//! what a power cut takes from it. What it says was durable is durable in either case.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;
use std::path::Path;

use xxhash_rust::xxh3::xxh3_64;

use super::super::SpaceNumber;
use super::super::local::files;

/// Name of the file in the space's directory.
pub(in crate::store) const FILE: &str = "durable";

const SLOTS: u64 = 2;
/// Slots stand in sectors of their own.
const SLOT_STRIDE: u64 = 512;
const SLOT_BYTES: usize = 32;
const CHECKED_BYTES: usize = SLOT_BYTES - 8;
const MAGIC: [u8; 4] = *b"CGMK";

/// A place in a journal: what lies before it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Extent {
    /// Number of blocks.
    pub blocks: u64,
    /// Number of samples in them.
    pub samples: u64,
}

/// The mark of a space that is being written.
#[derive(Debug)]
pub(super) struct Mark {
    space: SpaceNumber,
    file: File,
    next_slot: u64,
}

impl Mark {
    /// Opens the mark in the directory of a space, and makes it anew where it is lost.
    pub(super) fn open(directory: &Path, space: SpaceNumber) -> io::Result<Self> {
        let path = directory.join(FILE);
        if read(directory, space)?.is_none() {
            create(directory, space, Extent::default())?;
        }
        let file = File::options().read(true).write(true).open(path)?;
        let slots = [0, 1].map(|slot| read_slot(&file, slot, space));
        // The smaller one is the one to write over.
        let next_slot = u64::from(slots[0] > slots[1]);
        Ok(Self {
            space,
            file,
            next_slot,
        })
    }

    /// Writes how far the journal is durable.
    pub(super) fn write(&mut self, extent: Extent) -> io::Result<()> {
        let slot = encode(extent, self.space);
        self.file
            .write_all_at(&slot, SLOT_STRIDE * self.next_slot)?;
        self.next_slot = (self.next_slot + 1) % SLOTS;
        Ok(())
    }

    /// The file, to be synced by somebody else.
    pub(super) fn file(&self) -> io::Result<File> {
        self.file.try_clone()
    }
}

/// Writes the mark of a new journal durably.
pub(in crate::store) fn create(
    directory: &Path,
    space: SpaceNumber,
    extent: Extent,
) -> io::Result<()> {
    let mut bytes = vec![0; usize::try_from(SLOTS * SLOT_STRIDE).expect("a small number")];
    bytes[..SLOT_BYTES].copy_from_slice(&encode(extent, space));
    files::replace(&directory.join(FILE), &bytes)
}

/// How far a space was acknowledged; none where the mark is missing or damaged in both slots. The
/// space may be in use.
pub(in crate::store) fn read(directory: &Path, space: SpaceNumber) -> io::Result<Option<Extent>> {
    match File::open(directory.join(FILE)) {
        Ok(file) => Ok(read_slot(&file, 0, space).max(read_slot(&file, 1, space))),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error),
    }
}

/// A slot that cannot be read is as good as a damaged one.
fn read_slot(file: &File, slot: u64, space: SpaceNumber) -> Option<Extent> {
    let mut bytes = [0; SLOT_BYTES];
    file.read_exact_at(&mut bytes, SLOT_STRIDE * slot).ok()?;
    let number = |at: usize| u64::from_le_bytes(std::array::from_fn(|i| bytes[at + i]));
    let extent = Extent {
        blocks: number(8),
        samples: number(16),
    };
    (bytes == encode(extent, space)).then_some(extent)
}

fn encode(extent: Extent, space: SpaceNumber) -> [u8; SLOT_BYTES] {
    let mut bytes = [0; SLOT_BYTES];
    bytes[..4].copy_from_slice(&MAGIC);
    bytes[4..8].copy_from_slice(&space.0.to_le_bytes());
    bytes[8..16].copy_from_slice(&extent.blocks.to_le_bytes());
    bytes[16..24].copy_from_slice(&extent.samples.to_le_bytes());
    let check = xxh3_64(&bytes[..CHECKED_BYTES]);
    bytes[CHECKED_BYTES..].copy_from_slice(&check.to_le_bytes());
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(blocks: u64) -> Extent {
        let samples = 10 * blocks;
        Extent { blocks, samples }
    }

    #[test]
    fn a_damaged_slot_costs_one_step_and_two_are_a_lost_mark() {
        let directory = tempfile::tempdir().unwrap();
        let (path, space) = (directory.path(), SpaceNumber(3));
        assert_eq!(read(path, space).unwrap(), None);
        let mut mark = Mark::open(path, space).unwrap();
        assert_eq!(read(path, space).unwrap(), Some(at(0)));
        for blocks in 1..=5 {
            mark.write(at(blocks)).unwrap();
            assert_eq!(read(path, space).unwrap(), Some(at(blocks)));
        }
        // Reopened, it writes over the older of the two.
        Mark::open(path, space).unwrap().write(at(6)).unwrap();
        assert_eq!(read(path, SpaceNumber(4)).unwrap(), None);

        let file = File::options().write(true).open(path.join(FILE)).unwrap();
        let newer =
            u64::from(read_slot(&File::open(path.join(FILE)).unwrap(), 1, space) == Some(at(6)));
        file.write_all_at(&[0xff], SLOT_STRIDE * newer + 9).unwrap();
        assert_eq!(read(path, space).unwrap(), Some(at(5)));
        file.write_all_at(&[0xff], SLOT_STRIDE * (1 - newer) + 9)
            .unwrap();
        assert_eq!(read(path, space).unwrap(), None);
    }
}
