//! A journal as it lies on disk: its segments in order, with every damage named and passed over.

use std::io;
use std::path::{Path, PathBuf};

use super::super::SpaceNumber;
use super::super::local::files;
use super::frame::Header;
use super::segment::{Flaw, Piece, SegmentReader, file_name, first_block};

/// Blocks that cannot be read, one behind the other.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Damage {
    /// First block that cannot be read.
    pub block: u64,
    /// The next block that can, if there is one.
    pub next: Option<u64>,
    /// Samples in the blocks between, where the next block tells.
    pub samples: Option<u64>,
    /// Name of the file in the space's directory.
    pub file: String,
    /// Where in the file it begins \[bytes\].
    pub offset: u64,
    /// What is wrong there.
    pub flaw: Flaw,
}

/// What comes next in a journal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::store) enum Item {
    /// A block as it was written; [`LogReader::payload`] has its bytes.
    Block(Header),
    /// Blocks that cannot be read.
    Damage(Damage),
}

/// Reads the journal in a space's directory. The space may be in use: what is being appended is
/// then a damage at the end.
#[derive(Debug)]
pub(in crate::store) struct LogReader {
    directory: PathBuf,
    space: SpaceNumber,
    /// First blocks of the segments that are still to be read, the next one last.
    segments: Vec<u64>,
    segment: Option<(String, SegmentReader)>,
    /// Number of the next block, if none is missing.
    expected: u64,
    /// Samples of the journal through the latest block.
    total: u64,
    /// A damage whose end has not been found yet.
    damage: Option<Damage>,
    /// A block that has been read and waits for the damage before it to be told.
    held: Option<Header>,
    payload: Vec<u8>,
}

impl LogReader {
    /// Reads from block `from` on. Earlier blocks of the same segment are passed over unread.
    pub(in crate::store) fn open(
        directory: &Path,
        space: SpaceNumber,
        from: u64,
    ) -> io::Result<Self> {
        let names = files::names(directory)?;
        // The names are in the order of the numbers.
        let mut segments: Vec<_> = names.iter().filter_map(|name| first_block(name)).collect();
        let begin = segments.partition_point(|first| *first <= from);
        segments.drain(..begin.saturating_sub(1));
        let expected = segments.first().map_or(from, |first| from.min(*first));
        segments.reverse();
        let mut reader = Self {
            directory: directory.to_owned(),
            space,
            segments,
            segment: None,
            expected,
            total: 0,
            damage: None,
            held: None,
            payload: Vec::new(),
        };
        reader.pass_to(from)?;
        Ok(reader)
    }

    /// The segment of the latest block, and where in it the block ends \[bytes\].
    pub(in crate::store) fn position(&self) -> Option<(&str, u64)> {
        let (name, segment) = self.segment.as_ref()?;
        Some((name, segment.at()))
    }

    /// Bytes of the latest block.
    pub(in crate::store) fn payload(&self) -> &[u8] {
        &self.payload
    }

    /// The next block, or the damage before it; none at the end.
    ///
    /// # Errors
    /// The directory or a file in it cannot be opened.
    pub(in crate::store) fn next(&mut self) -> io::Result<Option<Item>> {
        if let Some(header) = self.held.take() {
            return Ok(Some(self.arrive(header)));
        }
        loop {
            let Some((name, segment)) = &mut self.segment else {
                if self.open_segment()? {
                    continue;
                }
                return Ok(self.damage.take().map(Item::Damage));
            };
            let offset = segment.at();
            let flaw = match segment.next(&mut self.payload) {
                None => {
                    self.segment = None;
                    continue;
                }
                Some(Piece::Flawed(flaw)) => flaw,
                Some(Piece::Block(header)) if header.block < self.expected => Flaw::Order,
                Some(Piece::Block(header)) if header.block == self.expected => {
                    return Ok(Some(match self.damage.take() {
                        Some(damage) => self.end_damage(damage, header),
                        None => self.arrive(header),
                    }));
                }
                Some(Piece::Block(header)) => {
                    let damage = Damage {
                        block: self.expected,
                        next: None,
                        samples: None,
                        file: name.clone(),
                        offset,
                        flaw: Flaw::Missing,
                    };
                    let damage = self.damage.take().unwrap_or(damage);
                    return Ok(Some(self.end_damage(damage, header)));
                }
            };
            if self.damage.is_none() {
                self.damage = Some(Damage {
                    block: self.expected,
                    next: None,
                    samples: None,
                    file: name.clone(),
                    offset,
                    flaw,
                });
            }
        }
    }

    fn arrive(&mut self, header: Header) -> Item {
        self.expected = header.block.saturating_add(1);
        self.total = header.total;
        Item::Block(header)
    }

    /// Tells a damage now, and the block behind it next.
    fn end_damage(&mut self, damage: Damage, header: Header) -> Item {
        self.held = Some(header);
        let before = header.total.saturating_sub(header.samples);
        Item::Damage(Damage {
            next: Some(header.block),
            samples: Some(before.saturating_sub(self.total)),
            ..damage
        })
    }

    /// Opens the next segment; says whether there was one.
    fn open_segment(&mut self) -> io::Result<bool> {
        let Some(first) = self.segments.pop() else {
            return Ok(false);
        };
        let name = file_name(first);
        let reader = SegmentReader::open(&self.directory.join(&name), self.space)?;
        self.segment = Some((name, reader));
        Ok(true)
    }

    /// Passes over valid headers of blocks before `from`.
    fn pass_to(&mut self, from: u64) -> io::Result<()> {
        if self.expected >= from || !self.open_segment()? {
            return Ok(());
        }
        while let Some((_, segment)) = &mut self.segment
            && self.expected < from
            && let Some(header) = segment.peek()
            && header.block == self.expected
        {
            segment.pass(&header);
            (self.expected, self.total) = (self.expected + 1, header.total);
        }
        Ok(())
    }
}
