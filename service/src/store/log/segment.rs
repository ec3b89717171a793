//! A segment: one file of a journal, read frame by frame, damaged or not.

use std::fs::File;
use std::io::{self, ErrorKind};
use std::path::Path;

use super::super::SpaceNumber;
use super::super::local::files;
use super::frame::{HEADER_BYTES, Header, MAGIC};

/// Bytes that are read from the disk at once.
const WINDOW_BYTES: usize = 1 << 20;
/// Bytes that a disk reads whole or not at all.
const SECTOR_BYTES: u64 = 4096;

/// Ending of a segment's name.
const ENDING: &str = ".log";

/// Name of the segment that begins with block `first`.
pub(in crate::store) fn file_name(first: u64) -> String {
    format!("{first:016x}{ENDING}")
}

/// The first block of the segment of this name, if it is one's.
pub(in crate::store) fn first_block(name: &str) -> Option<u64> {
    let digits = name.strip_suffix(ENDING)?;
    let first = u64::from_str_radix(digits, 16).ok()?;
    // Only as it would have been written: not with a sign, nor with fewer digits.
    (file_name(first) == name).then_some(first)
}

/// What is wrong with bytes of a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flaw {
    /// The bytes of a block are not those that were written.
    Block,
    /// Where a block should begin, none does.
    Header,
    /// The file ends inside a block.
    CutShort,
    /// A block of another number than the next one.
    Order,
    /// The disk does not read it.
    Unreadable,
    /// The file is missing, or ends before its time.
    Missing,
}

/// What stands next in a segment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Piece {
    /// A whole block.
    Block(Header),
    /// Bytes that are no whole block, up to the next valid header or the end of the file.
    Flawed(Flaw),
}

/// Reads a segment from one end to the other.
#[derive(Debug)]
pub(super) struct SegmentReader {
    space: SpaceNumber,
    window: Window,
    at: u64,
}

impl SegmentReader {
    pub(super) fn open(path: &Path, space: SpaceNumber) -> io::Result<Self> {
        let file = File::open(path)?;
        let length = file.metadata()?.len();
        let window = Window {
            file,
            length,
            start: 0,
            bytes: Vec::new(),
            careful_to: 0,
        };
        Ok(Self {
            space,
            window,
            at: 0,
        })
    }

    /// Where the next piece begins \[bytes\].
    pub(super) fn at(&self) -> u64 {
        self.at
    }

    /// The header that stands next, if a valid one does. Reads no block.
    pub(super) fn peek(&mut self) -> Option<Header> {
        let bytes = self.window.get(self.at, HEADER_BYTES as u64).ok()??;
        Header::decode(bytes, self.space)
    }

    /// Passes over the block whose header was peeked.
    pub(super) fn pass(&mut self, header: &Header) {
        self.at += header.frame_bytes();
    }

    /// The next piece, with the bytes of a block in `payload`; none at the end.
    pub(super) fn next(&mut self, payload: &mut Vec<u8>) -> Option<Piece> {
        if self.at >= self.window.length {
            return None;
        }
        let begin = self.at;
        let header = match self.window.get(begin, HEADER_BYTES as u64) {
            Err(_) => return Some(self.search(begin + 1, Flaw::Unreadable)),
            Ok(None) => return Some(self.give_up(Flaw::CutShort)),
            Ok(Some(bytes)) => Header::decode(bytes, self.space),
        };
        let Some(header) = header else {
            return Some(self.search(begin + 1, Flaw::Header));
        };
        match self.window.get(begin, header.frame_bytes()) {
            Err(_) => {
                self.at += header.frame_bytes();
                Some(Piece::Flawed(Flaw::Unreadable))
            }
            // Later blocks may have been written over its end.
            Ok(None) => Some(self.search(begin + 1, Flaw::CutShort)),
            Ok(Some(frame)) => {
                self.at += header.frame_bytes();
                if !header.fits(&frame[HEADER_BYTES..]) {
                    return Some(Piece::Flawed(Flaw::Block));
                }
                payload.clear();
                payload.extend_from_slice(&frame[HEADER_BYTES..]);
                Some(Piece::Block(header))
            }
        }
    }

    /// Looks for the next valid header from `from` on, and stands there or at the end of the file.
    fn search(&mut self, mut from: u64, flaw: Flaw) -> Piece {
        const WHOLE: u64 = WINDOW_BYTES as u64;
        let mut step = WHOLE;
        loop {
            let left = self.window.length.saturating_sub(from);
            if left < HEADER_BYTES as u64 {
                return self.give_up(flaw);
            }
            let bytes = match self.window.get(from, left.min(step)) {
                Ok(Some(bytes)) => bytes,
                Ok(None) => return self.give_up(flaw),
                Err(_) => {
                    // Sector by sector, and past the one that is not read.
                    let next = (from / SECTOR_BYTES + 1) * SECTOR_BYTES;
                    let to_next = (next - from).max(HEADER_BYTES as u64);
                    (from, step) = if step > to_next {
                        (from, to_next)
                    } else {
                        (next, WHOLE)
                    };
                    continue;
                }
            };
            let found = (0..=bytes.len() - HEADER_BYTES).find(|&i| {
                bytes[i..].starts_with(&MAGIC) && Header::decode(&bytes[i..], self.space).is_some()
            });
            if let Some(found) = found {
                self.at = from + found as u64;
                return Piece::Flawed(flaw);
            }
            from += (bytes.len() - HEADER_BYTES + 1) as u64;
            step = step.max(SECTOR_BYTES);
        }
    }

    /// Passes over the rest of the segment.
    fn give_up(&mut self, flaw: Flaw) -> Piece {
        self.at = self.window.length;
        Piece::Flawed(flaw)
    }
}

/// A stretch of a file in memory.
#[derive(Debug)]
struct Window {
    file: File,
    length: u64,
    start: u64,
    bytes: Vec<u8>,
    /// Up to here nothing is read ahead, for something there is not read.
    careful_to: u64,
}

impl Window {
    /// `count` bytes from `at` on; none where the file ends before.
    fn get(&mut self, at: u64, count: u64) -> io::Result<Option<&[u8]>> {
        let Some(end) = at.checked_add(count).filter(|end| *end <= self.length) else {
            return Ok(None);
        };
        let held = self.start + self.bytes.len() as u64;
        if at < self.start || end > held {
            let ahead = if at < self.careful_to {
                SECTOR_BYTES
            } else {
                WINDOW_BYTES as u64
            };
            let wanted = count.max(ahead).min(self.length - at);
            let mut read = self.read(at, wanted);
            if read.is_err() && wanted > count {
                self.careful_to = self.careful_to.max(at + wanted);
                read = self.read(at, count);
            }
            if let Err(error) = read {
                self.bytes.clear();
                return match error.kind() {
                    // Cut while it was read.
                    ErrorKind::UnexpectedEof => Ok(None),
                    _ => Err(error),
                };
            }
        }
        let begin = usize::try_from(at - self.start).map_err(io::Error::other)?;
        let count = usize::try_from(count).map_err(io::Error::other)?;
        Ok(Some(&self.bytes[begin..begin + count]))
    }

    fn read(&mut self, at: u64, count: u64) -> io::Result<()> {
        let count = usize::try_from(count).map_err(io::Error::other)?;
        self.start = at;
        self.bytes.resize(count, 0);
        files::read_exact_at(&self.file, &mut self.bytes, at)
    }
}
