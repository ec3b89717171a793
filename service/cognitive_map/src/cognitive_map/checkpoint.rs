//! Checkpoints: a map as pages of bytes, and back.
//!
//! ```text
//! kind  index                     bytes
//! 0     0                         header: version, settings' digest, revision, counts; map's digest
//! 1     page                      up to 4 agents
//! 2     page                      up to 64 places
//! 3     page                      up to 16 trips, without their legs
//! 4     trip · 64 + page          up to 16 legs
//! 5     page                      up to 64 landmarks
//! 6     page                      up to 8 channels of percepts
//! 7     channel · 2²⁶ + page      up to 64 places' memories of a channel of levels
//! 8     channel · 2²⁶ + page      up to 16 KiB of places' memories of a channel of descriptors
//! ```
//!
//! A page is a count (u16) and its items one after the other, little endian, floats as their bits. A
//! checkpoint since an earlier one has only the pages that changed in between; laid over the earlier
//! ones by kind and index, they are the whole again. Indices are rebuilt, not stored.

use std::collections::BTreeMap;

use super::CognitiveMap;
use super::header::{Header, digest_of};
use crate::digest::Digest;
use crate::paged::write_page;
use crate::percept::CHANNEL_PAGES_MAX;
use crate::settings::Settings;
use crate::state::{CorruptState, State, StateReader, StateWriter};
use crate::trip::LEG_PAGES_MAX;

/// Version of the layout above. Version 1 had no percepts.
const VERSION: u16 = 2;

const HEADER: u8 = 0;
const AGENTS: u8 = 1;
const PLACES: u8 = 2;
const TRIPS: u8 = 3;
const LEGS: u8 = 4;
const LANDMARKS: u8 = 5;
const CHANNELS: u8 = 6;
const LEVELS: u8 = 7;
const DESCRIPTORS: u8 = 8;

/// One page of a checkpoint. A later page of the same kind and index replaces an earlier one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CheckpointPage {
    /// What the page holds.
    pub kind: u8,
    /// Which of its kind it is.
    pub index: u32,
    /// The bytes.
    pub bytes: Vec<u8>,
}

/// Why pages are no checkpoint. The map can still be had by replaying the journal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CorruptCheckpoint {
    /// There is no header.
    #[error("the checkpoint has no header")]
    NoHeader,
    /// The layout is of a version that this program does not know.
    #[error("the checkpoint has version {found}, where {VERSION} is known")]
    UnknownVersion {
        /// The version found.
        found: u16,
    },
    /// The checkpoint was made with other settings.
    #[error("the checkpoint was made with other settings")]
    OtherSettings,
    /// The bytes of a page are no state.
    #[error("page {index} of kind {kind} of the checkpoint is damaged")]
    DamagedPage {
        /// Its kind.
        kind: u8,
        /// Its index.
        index: u32,
    },
    /// The pages do not add up to the map that the header describes: some are missing, damaged, or
    /// of another time.
    #[error("the checkpoint's pages do not add up to its digest")]
    DigestMismatch,
}

impl CognitiveMap {
    /// The pages that changed after `since_revision`, the header always among them; 0 gives all.
    ///
    /// The iterator encodes one page at a time and reads from a snapshot as well as from the map
    /// itself.
    pub fn checkpoint(&self, since_revision: u64) -> impl Iterator<Item = CheckpointPage> {
        let since = since_revision;
        let agents = self.agents.changed_pages(since);
        let places = self.places.places().changed_pages(since);
        let trips = self.trips.changed_pages(since);
        let landmarks = self.landmarks.landmarks().changed_pages(since);
        let channels = self.percepts.channels().changed_pages(since);
        let levels = self.percepts.changed_levels(since);
        let descriptors = self.percepts.changed_descriptors(since);
        // A leg is appended to its trip, so legs change only where their trip does.
        let legs = self
            .trips
            .changed_pages(since)
            .flat_map(move |(_, first, trips)| {
                (first..).zip(trips).flat_map(move |(trip, record)| {
                    let pages = record.changed_legs(since);
                    pages.map(move |(page, legs)| of_items(LEGS, leg_page(trip, page), legs))
                })
            });
        std::iter::once(self.header_page())
            .chain(agents.map(|(page, _, items)| of_items(AGENTS, page, items)))
            .chain(places.map(|(page, _, items)| of_items(PLACES, page, items)))
            .chain(trips.map(|(page, _, items)| of_items(TRIPS, page, items)))
            .chain(legs)
            .chain(landmarks.map(|(page, _, items)| of_items(LANDMARKS, page, items)))
            .chain(channels.map(|(page, _, items)| of_items(CHANNELS, page, items)))
            .chain(
                levels.map(|(channel, page, items)| {
                    of_items(LEVELS, channel_page(channel, page), items)
                }),
            )
            .chain(descriptors.map(|(channel, page, items)| {
                of_items(DESCRIPTORS, channel_page(channel, page), items)
            }))
    }

    /// The map of a checkpoint. It has the digest of the map that wrote it, and goes on like it.
    ///
    /// `settings` are those of the space; `pages` come in any order, and of several of the same kind
    /// and index the last one counts.
    ///
    /// # Errors
    /// A page is missing, damaged or left over, or the settings are not those of the checkpoint.
    pub fn restore(
        settings: Settings,
        pages: impl IntoIterator<Item = CheckpointPage>,
    ) -> Result<Self, CorruptCheckpoint> {
        let mut pages: BTreeMap<_, _> = pages
            .into_iter()
            .map(|page| ((page.kind, page.index), page.bytes))
            .collect();
        let header = pages
            .remove(&(HEADER, 0))
            .ok_or(CorruptCheckpoint::NoHeader)?;
        let (header, digest) = read_header(&header)?;
        if header.settings != digest_of(&settings).0 {
            return Err(CorruptCheckpoint::OtherSettings);
        }
        let mut map = Self::new(settings);
        map.revision = header.revision;
        map.framed = header.framed;
        let mut trips = Vec::new();
        let mut expected = 0;
        for ((kind, index), bytes) in pages {
            // Pages of a kind must follow one another; those of legs begin anew with each trip, those
            // of memories with each channel.
            let first = match kind {
                LEGS => index % LEG_PAGES_MAX == 0,
                LEVELS | DESCRIPTORS => index % CHANNEL_PAGES_MAX == 0,
                _ => index == 0,
            };
            let next = if first { index } else { expected };
            let restored = if index == next {
                map.restore_page(kind, index, &bytes)
            } else {
                Err(CorruptState::Invalid)
            };
            restored.map_err(|_| CorruptCheckpoint::DamagedPage { kind, index })?;
            expected = index.wrapping_add(1);
            if kind == TRIPS {
                trips.push(bytes);
            }
        }
        // A trip's page repeats the digests of its legs, which are read from their own pages.
        let again = map.trips.changed_pages(0);
        let again = again.map(|(page, _, items)| of_items(TRIPS, page, items).bytes);
        if !again.eq(trips) {
            return Err(CorruptCheckpoint::DigestMismatch);
        }
        if !map.refers_to_what_is_there() || map.digest() != digest {
            return Err(CorruptCheckpoint::DigestMismatch);
        }
        Ok(map)
    }

    /// The header, with the map's digest after it.
    fn header_page(&self) -> CheckpointPage {
        let mut out = StateWriter::default();
        VERSION.write(&mut out);
        Header::of(self).write(&mut out);
        self.digest().0.write(&mut out);
        CheckpointPage {
            kind: HEADER,
            index: 0,
            bytes: out.into_bytes(),
        }
    }

    /// Appends a page.
    fn restore_page(&mut self, kind: u8, index: u32, bytes: &[u8]) -> Result<(), CorruptState> {
        let revision = self.revision;
        match kind {
            AGENTS => self.agents.push_page(bytes, revision),
            PLACES => self.places.push_page(bytes, revision),
            TRIPS => self.trips.push_page(bytes, revision),
            LEGS => {
                let trip = self
                    .trips
                    .get_mut((index / LEG_PAGES_MAX) as usize, revision);
                trip.ok_or(CorruptState::Invalid)?
                    .push_leg_page(bytes, revision)
            }
            LANDMARKS => self.landmarks.push_page(bytes, revision),
            CHANNELS => self.percepts.push_channels(bytes, revision),
            LEVELS | DESCRIPTORS => {
                let channel = (index / CHANNEL_PAGES_MAX) as usize;
                let levels = kind == LEVELS;
                self.percepts.push_memory(channel, levels, bytes, revision)
            }
            _ => Err(CorruptState::Invalid),
        }
    }

    /// Whether all identifiers lead somewhere. The digest finds damage; this finds pages that were
    /// made up.
    fn refers_to_what_is_there(&self) -> bool {
        let places = self.places.places().len();
        let agents = self.agents.iter().all(|agent| {
            agent.body.fits(&self.modules)
                && agent
                    .place
                    .is_none_or(|(place, _)| (place.0 as usize) < places)
                && agent
                    .entered
                    .is_none_or(|place| (place.0 as usize) < places)
                && agent
                    .recorder
                    .leg
                    .as_ref()
                    .is_none_or(|leg| (leg.from().0 as usize) < places)
                && agent
                    .recorder
                    .trip
                    .is_none_or(|trip| (trip.0 as usize) < self.trips.len())
        });
        let founders = self
            .places
            .places()
            .iter()
            .all(|place| (place.founder().0 as usize) < self.agents.len());
        let trips = self.trips.iter().all(|trip| {
            (trip.agent().0 as usize) < self.agents.len()
                && trip
                    .legs()
                    .all(|leg| (leg.from().0 as usize) < places && (leg.to().0 as usize) < places)
        });
        agents && founders && trips && self.percepts.knows_only(places)
    }
}

/// A page of items.
fn of_items<T: State>(kind: u8, index: usize, items: &[T]) -> CheckpointPage {
    let mut out = StateWriter::default();
    write_page(items, &mut out);
    let index = u32::try_from(index).expect("2³² items have fewer pages");
    CheckpointPage {
        kind,
        index,
        bytes: out.into_bytes(),
    }
}

/// Index of a page of a trip's legs; the number of trips is bounded so that it fits.
fn leg_page(trip: usize, page: usize) -> usize {
    trip * LEG_PAGES_MAX as usize + page
}

/// Index of a page of a channel's memory; the numbers of channels and of their pages are bounded so
/// that it fits.
fn channel_page(channel: usize, page: usize) -> usize {
    channel * CHANNEL_PAGES_MAX as usize + page
}

/// Reads the header and the map's digest after it.
fn read_header(bytes: &[u8]) -> Result<(Header, Digest), CorruptCheckpoint> {
    let damaged = |_: CorruptState| CorruptCheckpoint::DamagedPage {
        kind: HEADER,
        index: 0,
    };
    let mut input = StateReader::new(bytes);
    let found = u16::read(&mut input).map_err(damaged)?;
    if found != VERSION {
        return Err(CorruptCheckpoint::UnknownVersion { found });
    }
    let header = Header::read(&mut input).map_err(damaged)?;
    let digest = u128::read(&mut input).map_err(damaged)?;
    input.end().map_err(damaged)?;
    Ok((header, Digest(digest)))
}
