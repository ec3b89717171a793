//! Checkpoints: a map as pages of bytes, and back.
//!
//! ```text
//! kind  index                     bytes
//! 0     0                         header: version, digests of settings and map, revision, counts
//! 1     page                      up to 4 agents
//! 2     page                      up to 64 places
//! 3     page                      up to 16 trips, without their legs
//! 4     trip · 64 + page          up to 16 legs
//! 5     page                      up to 64 landmarks
//! 6     page                      up to 8 channels of percepts
//! 7     channel · 2²⁶ + page      up to 64 places' memories of a channel of levels
//! 8     channel · 2²⁶ + page      up to 16 KiB of places' memories of a channel of descriptors
//! 9     0                         the joint estimate of agents and landmarks
//! 10..  page                      the keyframe graph, by part
//! 32    0                         objects: counts, names of channels
//! 33    object                    an object
//! 40    0                         ways: vacancies, what was spared
//! 41    page                      up to 16 ways
//! 42    page                      up to 16 waypoints
//! 43    0                         instructions: blockages, followed routes, pinned trips
//! ```
//!
//! A page is a count (u16) and its items one after the other, little endian, floats as their bits.
//! Where items can be missing (places, trips, memories of levels), a mask (u64) of those that are
//! there stands for the count. A checkpoint since an earlier one has only the pages that changed in
//! between; laid over the earlier ones by kind and index, they are the whole again. A page of no
//! bytes says that there is no such page any more. Indices are rebuilt, not stored.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::CognitiveMap;
use super::header::{Header, digest_of};
use crate::agent::Agent;
use crate::estimator::{Estimator, Parameters};
use crate::input::AgentId;
use crate::keyframes::{KeyframeMap, KeyframePage, KeyframeSettings};
use crate::memory::percept::CHANNEL_PAGES_MAX;
use crate::memory::place::PlaceId;
use crate::memory::trip::LEG_PAGES_MAX;
use crate::settings::Settings;
use state::Digest;
use state::PageItems;
use state::write_page;
use state::{CorruptState, State, StateReader, StateWriter};

/// Version of the layout above, and of what the fold makes of records: with either this number
/// grows. A checkpoint of another version is not read, because a map that goes on from it would not
/// be the one that the journal gives; the map is made anew from that.
const VERSION: u16 = 47;

const HEADER: u8 = 0;
const AGENTS: u8 = 1;
const PLACES: u8 = 2;
const TRIPS: u8 = 3;
const LEGS: u8 = 4;
const LANDMARKS: u8 = 5;
const CHANNELS: u8 = 6;
const LEVELS: u8 = 7;
const DESCRIPTORS: u8 = 8;
const ESTIMATE: u8 = 9;
/// Part 0 of the keyframe graph; its other parts are the next kinds.
const KEYFRAMES: u8 = 10;
const OBJECTS: u8 = 32;
const OBJECT: u8 = 33;
pub(super) const WAY_HEAD: u8 = 40;
pub(super) const WAYS: u8 = 41;
pub(super) const WAYPOINTS: u8 = 42;
pub(super) const GUIDANCE: u8 = 43;

/// One page of a checkpoint. A later page of the same kind and index replaces an earlier one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CheckpointPage {
    /// What the page holds.
    pub kind: u8,
    /// Which of its kind it is.
    pub index: u32,
    /// The bytes; none where an earlier page is no more. A store may remove it then.
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
        let legs = self.trips.changed_legs(since);
        let landmarks = self.landmarks.landmarks().changed_pages(since);
        let ways = self.ways.changed_ways(since);
        let waypoints = self.ways.changed_waypoints(since);
        let channels = self.percepts.channels().changed_pages(since);
        let levels = self.percepts.changed_levels(since);
        let descriptors = self.percepts.changed_descriptors(since);
        std::iter::once(self.header_page())
            .chain(agents.map(|(page, _, items)| of_items(AGENTS, page, items)))
            .chain(places.map(|(page, items)| of_sparse(PLACES, page, &items)))
            .chain(trips.map(|(page, items)| of_sparse(TRIPS, page, &items)))
            .chain(legs.map(|(trip, page, items)| of_items(LEGS, leg_page(trip, page), items)))
            .chain(landmarks.map(|(page, _, items)| of_items(LANDMARKS, page, items)))
            .chain(channels.map(|(page, _, items)| of_items(CHANNELS, page, items)))
            .chain(levels.map(|(channel, page, items)| {
                of_sparse(LEVELS, channel_page(channel, page), &items)
            }))
            .chain(descriptors.map(|(channel, page, items)| {
                of_items(DESCRIPTORS, channel_page(channel, page), items)
            }))
            .chain(self.estimate_page(since))
            .chain(self.keyframe_pages(since))
            .chain(self.object_pages(since))
            .chain(self.way_head(since))
            .chain(ways.map(|(page, _, items)| of_items(WAYS, page, items)))
            .chain(waypoints.map(|(page, _, items)| of_items(WAYPOINTS, page, items)))
            .chain(self.guidance_page(since))
    }

    /// The map of a checkpoint. It has the digest of the map that wrote it, and goes on like it.
    ///
    /// `settings` are those of the space; `pages` come in any order, and of several of the same
    /// kind and index the last one counts.
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
        pages.retain(|_, bytes| !bytes.is_empty());
        let header = pages
            .remove(&(HEADER, 0))
            .ok_or(CorruptCheckpoint::NoHeader)?;
        let (header, digest) = read_header(&header)?;
        if header.settings != digest_of(&settings).0 {
            return Err(CorruptCheckpoint::OtherSettings);
        }
        let mut map = Self::new(settings);
        map.revision = header.revision;
        map.is_map_defined = header.is_map_defined;
        // A map of more would have had a page for each 64 of them, and its digest is another one.
        let count = |count: u64| usize::try_from(count).unwrap_or(usize::MAX);
        map.places.skip_to(count(header.places));
        map.trips.skip_to(count(header.trips));
        let guidance = pages.remove(&(GUIDANCE, 0));
        let ways = pages.split_off(&(WAY_HEAD, 0));
        map.restore_ways(ways)?;
        let objects = pages.split_off(&(OBJECTS, 0));
        map.restore_objects(objects)?;
        let keyframes = pages.split_off(&(KEYFRAMES, 0));
        map.restore_keyframes(keyframes)?;
        let trips = map.restore_memories(pages)?;
        map.restore_guidance(guidance.as_deref())?;
        // A trip's page repeats the digests of its legs, which are read from their own pages.
        let again = map.trips.changed_pages(0);
        let again = again.map(|(page, items)| of_sparse(TRIPS, page, &items).bytes);
        if !again.eq(trips) || !map.refers_to_what_is_there() || map.digest() != digest {
            return Err(CorruptCheckpoint::DigestMismatch);
        }
        map.derive_indices();
        Ok(map)
    }

    /// Reads agents, places, trips, landmarks, percepts and the estimate; answers the pages of
    /// trips.
    fn restore_memories(
        &mut self,
        pages: BTreeMap<(u8, u32), Vec<u8>>,
    ) -> Result<Vec<Vec<u8>>, CorruptCheckpoint> {
        let mut trips = Vec::new();
        let mut expected = 0;
        for ((kind, index), bytes) in pages {
            // Pages of a kind without gaps must follow one another; those of legs begin anew with
            // each trip, those of descriptors with each channel.
            let is_first = match kind {
                PLACES | TRIPS | LEVELS => true,
                LEGS => index % LEG_PAGES_MAX == 0,
                DESCRIPTORS => index % CHANNEL_PAGES_MAX == 0,
                _ => index == 0,
            };
            let restored = if is_first || index == expected {
                self.restore_page(kind, index, &bytes)
            } else {
                Err(CorruptState::Invalid)
            };
            restored.map_err(|_| CorruptCheckpoint::DamagedPage { kind, index })?;
            expected = index.wrapping_add(1);
            if kind == TRIPS {
                trips.push(bytes);
            }
        }
        Ok(trips)
    }

    /// Derives what a checkpoint does not hold: summaries of trips, names, which places are held.
    fn derive_indices(&mut self) {
        self.trips.summarise_all();
        let mut names = BTreeMap::new();
        for (id, agent) in self.agents() {
            names.entry(agent.name().clone()).or_insert(id);
        }
        self.names = Arc::new(names);
        for place in self.agents.iter().flat_map(Agent::holds).flatten() {
            self.places.hold(place);
        }
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

    /// The joint estimate. It may change with every record.
    fn estimate_page(&self, since_revision: u64) -> Option<CheckpointPage> {
        (self.revision > since_revision).then(|| {
            let mut out = StateWriter::default();
            self.estimator.write(&mut out);
            page_of(ESTIMATE, 0, out)
        })
    }

    /// The pages of the keyframe graph that changed.
    fn keyframe_pages(&self, since_revision: u64) -> impl Iterator<Item = CheckpointPage> {
        let is_new = self.revision > since_revision;
        let pages = is_new.then(|| self.keyframes.checkpoint(since_revision));
        pages.into_iter().flatten().map(|page| CheckpointPage {
            kind: KEYFRAMES + page.part,
            index: page.index,
            bytes: page.bytes,
        })
    }

    /// Reads the keyframe graph; a map in which nothing has happened has none.
    fn restore_keyframes(
        &mut self,
        pages: BTreeMap<(u8, u32), Vec<u8>>,
    ) -> Result<(), CorruptCheckpoint> {
        let Some(&(kind, index)) = pages.keys().next() else {
            return Ok(());
        };
        let pages = pages
            .into_iter()
            .map(|((kind, index), bytes)| KeyframePage {
                part: kind - KEYFRAMES,
                index,
                bytes,
            });
        let settings = KeyframeSettings::of(&self.settings);
        let keyframes = KeyframeMap::restore(settings, self.revision, pages)
            .map_err(|_| CorruptCheckpoint::DamagedPage { kind, index })?;
        self.keyframes = Arc::new(keyframes);
        Ok(())
    }

    /// The objects that changed.
    fn object_pages(&self, since_revision: u64) -> impl Iterator<Item = CheckpointPage> {
        let is_new = self.revision > since_revision && !self.objects.is_untouched();
        let head = is_new.then(|| {
            let mut out = StateWriter::default();
            self.objects.write_head(&mut out);
            page_of(OBJECTS, 0, out)
        });
        let objects = self.objects.changed_since(since_revision);
        head.into_iter()
            .chain(objects.map(|(index, bytes)| CheckpointPage {
                kind: OBJECT,
                index,
                bytes,
            }))
    }

    /// Reads the objects; a map in which nothing has happened has none.
    fn restore_objects(
        &mut self,
        mut pages: BTreeMap<(u8, u32), Vec<u8>>,
    ) -> Result<(), CorruptCheckpoint> {
        let damaged = |kind, index| CorruptCheckpoint::DamagedPage { kind, index };
        let Some(head) = pages.remove(&(OBJECTS, 0)) else {
            return match pages.keys().next() {
                None => Ok(()),
                Some(&(kind, index)) => Err(damaged(kind, index)),
            };
        };
        let count = self.objects.read_head(&head);
        let count = count.map_err(|_| damaged(OBJECTS, 0))?;
        let mut objects = BTreeMap::new();
        for ((kind, index), bytes) in pages {
            if kind != OBJECT {
                return Err(damaged(kind, index));
            }
            objects.insert(index, bytes);
        }
        if objects.len() != count as usize {
            return Err(CorruptCheckpoint::DigestMismatch);
        }
        let restored = self.objects.restore(&objects);
        restored.map_err(|_| damaged(OBJECT, 0))
    }

    /// Adds a page.
    fn restore_page(&mut self, kind: u8, index: u32, bytes: &[u8]) -> Result<(), CorruptState> {
        let revision = self.revision;
        match kind {
            AGENTS => self.agents.push_page(bytes, revision),
            PLACES => self.places.restore_page(index as usize, bytes, revision),
            TRIPS => self.trips.restore_page(index as usize, bytes, revision),
            LEGS => {
                let trip = (index / LEG_PAGES_MAX) as usize;
                self.trips.restore_legs(trip, bytes, revision)
            }
            LANDMARKS => self.landmarks.push_page(bytes, revision),
            CHANNELS => self.percepts.push_channels(bytes, revision),
            LEVELS | DESCRIPTORS => {
                let channel = (index / CHANNEL_PAGES_MAX) as usize;
                let page = (index % CHANNEL_PAGES_MAX) as usize;
                let levels = kind == LEVELS;
                self.percepts
                    .restore_memory(channel, page, levels, bytes, revision)
            }
            ESTIMATE => {
                let mut input = StateReader::new(bytes);
                let estimator = Estimator::read(&mut input)?;
                input.end()?;
                self.estimator =
                    Arc::new(estimator.with_parameters(Parameters::of(&self.settings)));
                Ok(())
            }
            _ => Err(CorruptState::Invalid),
        }
    }

    /// Whether all identifiers lead somewhere, those that may be of forgotten places and trips
    /// included. The digest finds damage; this finds pages that were made up.
    fn refers_to_what_is_there(&self) -> bool {
        let (recruited, recorded) = (self.places_recruited(), self.trips.recorded());
        let is_there = |place| self.places.get(place).is_some();
        let was_there = |place: PlaceId| (place.0 as usize) < recruited;
        let is_agent = |agent: AgentId| (agent.0 as usize) < self.agents.len();
        let agents = self.agents.iter().all(|agent| {
            agent.announced.fits(&self.modules)
                && agent.holds().into_iter().flatten().all(was_there)
                && agent.entered.is_none_or(was_there)
                && agent.home.is_none_or(was_there)
                && agent
                    .recorder
                    .trip
                    .is_none_or(|trip| (trip.0 as usize) < recorded)
        });
        let graph = &self.keyframes.graph;
        let is_attached = |id: PlaceId, attachment| graph.is_attached(attachment, id.0);
        let places = self.places().all(|(id, place)| {
            is_agent(place.founder())
                && place.trip.is_none_or(|trip| (trip.0 as usize) < recorded)
                && place
                    .attachment
                    .is_none_or(|attachment| is_attached(id, attachment))
        });
        let attached = self
            .places()
            .filter(|(_, place)| place.attachment.is_some());
        let forgotten = self.waypoints().filter(|waypoint| {
            waypoint.attachment.is_some() && self.places.is_forgotten(waypoint.place())
        });
        let attached = attached.count() + forgotten.count();
        let places = places && attached == graph.n_attachments();
        let ways = self.waypoints().all(|waypoint| {
            let place = waypoint.place();
            was_there(place) && { waypoint.attachment }.is_none_or(|attachment| {
                self.places.is_forgotten(place) && is_attached(place, attachment)
            })
        });
        let trips = self.trips().all(|(_, trip)| {
            is_agent(trip.agent())
                && trip
                    .legs()
                    .all(|leg| was_there(leg.from()) && was_there(leg.to()))
        });
        let enrolled = self.estimator.agent_count() == self.agents.len();
        enrolled && agents && places && trips && ways && self.percepts.knows_only(is_there)
    }
}

/// A page of items.
fn of_items<T: State>(kind: u8, index: usize, items: &[T]) -> CheckpointPage {
    let mut out = StateWriter::default();
    write_page(items, &mut out);
    page_of(kind, index, out)
}

/// A page of items that may be missing.
fn of_sparse<T: State>(kind: u8, index: usize, items: &PageItems<'_, T>) -> CheckpointPage {
    let mut out = StateWriter::default();
    items.write(&mut out);
    page_of(kind, index, out)
}

/// A page of bytes.
pub(super) fn page_of(kind: u8, index: usize, out: StateWriter) -> CheckpointPage {
    CheckpointPage {
        kind,
        index: u32::try_from(index).expect("2³² items have fewer pages"),
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
