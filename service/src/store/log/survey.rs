//! A survey of a journal: what can be read of it, against how far it was acknowledged.

use std::io;
use std::path::Path;

use super::super::SpaceNumber;
use super::frame::Header;
use super::mark::{self, Extent};
use super::reader::{Damage, Item, LogReader};
use super::segment::{Flaw, file_name};

/// What is known of a journal after it has been read from one end to the other.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Survey {
    /// Blocks that can be read, and the samples in them.
    pub readable: Extent,
    /// How far the journal was acknowledged, by the mark and by what the blocks say themselves.
    pub acknowledged: Extent,
    /// Acknowledged blocks that cannot be read, and the samples in them.
    pub lost: Extent,
    /// Whether the mark itself is lost.
    pub mark_lost: bool,
    /// Damage of what was acknowledged, or may have been; in order.
    pub damage: Vec<Damage>,
    /// What stands after the last acknowledged block and cannot be read: what a crash has caught
    /// while it was written.
    pub torn_tail: Option<Damage>,
    /// What lies before the next block to be appended.
    pub end: Extent,
    /// Segment of the last block before the end, and where in it the block ends \[bytes\].
    pub(super) last: Option<(String, u64)>,
}

/// A damage, and the journal before it.
struct Found {
    damage: Damage,
    readable: Extent,
    end: Extent,
    last: Option<(String, u64)>,
}

impl Survey {
    /// Reads the journal in the directory of a space. The space may be in use: what is appended
    /// meanwhile counts as a torn tail at most.
    pub(in crate::store) fn of(directory: &Path, space: SpaceNumber) -> io::Result<Self> {
        // The mark first: what it says is in the journal by then.
        let mark = mark::read(directory, space)?;
        let mut reader = LogReader::open(directory, space, 0)?;
        let mut survey = Self {
            readable: Extent::default(),
            acknowledged: mark.unwrap_or_default(),
            lost: Extent::default(),
            mark_lost: mark.is_none(),
            damage: Vec::new(),
            torn_tail: None,
            end: Extent::default(),
            last: None,
        };
        let mut found = Vec::new();
        while let Some(item) = reader.next()? {
            match item {
                Item::Block(header) => {
                    survey.count(&header);
                    survey.last = reader.position().map(|(name, end)| (name.to_owned(), end));
                }
                Item::Damage(damage) => found.push(Found {
                    damage,
                    readable: survey.readable,
                    end: survey.end,
                    last: survey.last.clone(),
                }),
            }
        }
        survey.judge(found);
        Ok(survey)
    }

    /// Whether nothing that was acknowledged is damaged or missing.
    pub fn is_sound(&self) -> bool {
        self.damage.is_empty()
    }

    fn count(&mut self, header: &Header) {
        self.readable.blocks += 1;
        self.readable.samples = self.readable.samples.saturating_add(header.samples);
        self.end = Extent {
            blocks: header.block.saturating_add(1),
            samples: header.total,
        };
        self.acknowledged = self.acknowledged.max(header.durable);
    }

    /// Tells damage of what was acknowledged from a torn tail.
    fn judge(&mut self, found: Vec<Found>) {
        for found in found {
            // A lost mark leaves open whether the end was acknowledged, so nothing is cut then.
            if found.damage.block >= self.acknowledged.blocks && !self.mark_lost {
                // What follows was appended later, and was acknowledged even less.
                self.readable = found.readable;
                self.end = found.end;
                self.last = found.last;
                self.torn_tail = Some(found.damage);
                break;
            }
            self.lose(&found.damage, found.end);
            self.damage.push(found.damage);
        }
        let is_open = (self.damage.last()).is_some_and(|damage| damage.next.is_none());
        if self.end.blocks < self.acknowledged.blocks && !is_open {
            let (file, offset) = self.last.clone().unwrap_or_else(|| (file_name(0), 0));
            let missing = Damage {
                block: self.end.blocks,
                next: None,
                samples: None,
                file,
                offset,
                flaw: Flaw::Missing,
            };
            self.lose(&missing, self.end);
            self.damage.push(missing);
        }
    }

    /// Counts what a damage takes, of a journal that reads to `before`.
    fn lose(&mut self, damage: &Damage, before: Extent) {
        let next = damage.next.unwrap_or(self.acknowledged.blocks);
        let all = self.acknowledged.samples.saturating_sub(before.samples);
        self.lost.blocks += next.saturating_sub(damage.block);
        self.lost.samples += damage.samples.unwrap_or(all);
    }
}
