//! A keyframe graph as pages of bytes, and back.
//!
//! ```text
//! part  index  bytes
//! 0     0      what is new, the sweep cursor, vacant numbers
//! 1     page   up to 4 agents
//! 2     page   up to 32 keyframes
//! 3     page   up to 64 sightings
//! 4     page   up to 32 constraints
//! 5     page   up to 64 landmarks
//! 6     page   up to 16 views
//! 7     page   what an agent saw lately
//! 8     page   what an agent has seen that does not know where it is
//! 9     page   up to 32 attachments of places
//! 10    page   what an agent has seen that contradicts its estimate
//! ```

use std::collections::BTreeMap;

use super::map::KeyframeMap;
use super::settings::KeyframeSettings;
use place_recognition::Part;
use state::Digest;
use state::{CorruptState, State, StateReader, StateWriter};
use state::{PagedVec, write_page};

const HEAD: u8 = 0;
const TRACKS_OF_AGENTS: u8 = 1;
const KEYFRAMES: u8 = 2;
const SIGHTINGS: u8 = 3;
const CONSTRAINTS: u8 = 4;
const LANDMARKS: u8 = 5;
const VIEWS: u8 = 6;
const TRACKS: u8 = 7;
const SEARCHES: u8 = 8;
const ATTACHMENTS: u8 = 9;
const KIDNAP_TESTS: u8 = 10;

/// Number of pending sightings at the end of the head: they are the estimator's.
const N_PENDING: u64 = 0;

/// One page of a checkpoint. A later page of the same part and index replaces an earlier one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeyframePage {
    /// What the page holds.
    pub part: u8,
    /// Which of its part it is.
    pub index: u32,
    /// The bytes.
    pub bytes: Vec<u8>,
}

/// Pages that are no keyframe map: some are missing, damaged, left over or of another time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the pages are no map")]
pub struct CorruptKeyframes;

impl KeyframeMap {
    /// The pages that changed after `since_revision`, the head always among them; 0 gives all.
    pub fn checkpoint(&self, since_revision: u64) -> impl Iterator<Item = KeyframePage> {
        let since = since_revision;
        let (graph, seen) = (&self.graph, &self.recognition);
        std::iter::once(self.head())
            .chain(pages_of(TRACKS_OF_AGENTS, &graph.chains.tracks, since))
            .chain(pages_of(KEYFRAMES, &graph.chains.keyframes.pages, since))
            .chain(pages_of(SIGHTINGS, &graph.sightings.slab.pages, since))
            .chain(pages_of(CONSTRAINTS, &graph.constraints.slab.pages, since))
            .chain(pages_of(
                LANDMARKS,
                &graph.sightings.landmarks.slots.pages,
                since,
            ))
            .chain(seen_pages(VIEWS, seen.pages(Part::Views, since)))
            .chain(seen_pages(TRACKS, seen.pages(Part::Tracks, since)))
            .chain(seen_pages(SEARCHES, seen.pages(Part::Searches, since)))
            .chain(pages_of(ATTACHMENTS, &graph.attachments.slab.pages, since))
            .chain(seen_pages(
                KIDNAP_TESTS,
                seen.pages(Part::KidnapTests, since),
            ))
    }

    /// The map of a checkpoint, which goes on like the one that wrote it. Its pages count as
    /// changed at `revision`.
    ///
    /// # Errors
    /// The pages are no such map.
    pub fn restore(
        settings: KeyframeSettings,
        revision: u64,
        pages: impl IntoIterator<Item = KeyframePage>,
    ) -> Result<Self, CorruptKeyframes> {
        let mut pages: BTreeMap<_, _> = pages
            .into_iter()
            .map(|page| ((page.part, page.index), page.bytes))
            .collect();
        let head = pages.remove(&(HEAD, 0)).ok_or(CorruptKeyframes)?;
        let mut map = Self::new(settings);
        map.set_revision(revision);
        let mut expected = (0, 0);
        for ((part, index), bytes) in pages {
            if index != 0 && (part, index) != expected {
                return Err(CorruptKeyframes);
            }
            expected = (part, index.wrapping_add(1));
            let pushed = map.push_page(part, &bytes);
            pushed.map_err(|_| CorruptKeyframes)?;
        }
        map.read_head(&head).map_err(|_| CorruptKeyframes)?;
        let (graph, seen) = (&mut map.graph, &map.recognition);
        if !graph.sightings.landmarks.sort()
            || !graph.is_sound()
            || !seen.is_sound(graph.chains.tracks.len())
        {
            return Err(CorruptKeyframes);
        }
        graph.chains.rebuild_index();
        Ok(map)
    }

    fn push_page(&mut self, part: u8, bytes: &[u8]) -> Result<(), CorruptState> {
        let (graph, seen) = (&mut self.graph, &mut self.recognition);
        let revision = graph.revision;
        match part {
            TRACKS_OF_AGENTS => graph.chains.tracks.push_page(bytes, revision),
            KEYFRAMES => graph.chains.keyframes.pages.push_page(bytes, revision),
            SIGHTINGS => graph.sightings.slab.pages.push_page(bytes, revision),
            CONSTRAINTS => graph.constraints.slab.pages.push_page(bytes, revision),
            LANDMARKS => graph
                .sightings
                .landmarks
                .slots
                .pages
                .push_page(bytes, revision),
            VIEWS => seen.push_page(Part::Views, bytes),
            TRACKS => seen.push_page(Part::Tracks, bytes),
            SEARCHES => seen.push_page(Part::Searches, bytes),
            ATTACHMENTS => graph.attachments.slab.pages.push_page(bytes, revision),
            KIDNAP_TESTS => seen.push_page(Part::KidnapTests, bytes),
            _ => Err(CorruptState::Invalid),
        }
    }

    /// Equal maps have equal digests. Only pages that changed since the last time are hashed anew.
    pub fn digest(&self) -> Digest {
        let mut out = StateWriter::default();
        let (graph, seen) = (&self.graph, &self.recognition);
        self.write_head(&mut out);
        graph.chains.tracks.write_digests(&mut out);
        graph.chains.keyframes.pages.write_digests(&mut out);
        graph.sightings.slab.pages.write_digests(&mut out);
        graph.constraints.slab.pages.write_digests(&mut out);
        graph
            .sightings
            .landmarks
            .slots
            .pages
            .write_digests(&mut out);
        seen.write_digests(Part::Views, &mut out);
        seen.write_digests(Part::Tracks, &mut out);
        seen.write_digests(Part::Searches, &mut out);
        graph.attachments.slab.pages.write_digests(&mut out);
        seen.write_digests(Part::KidnapTests, &mut out);
        out.digest()
    }

    /// Bytes of memory that it takes, without labels.
    pub fn bytes(&self) -> usize {
        let graph = &self.graph;
        graph.chains.tracks.bytes()
            + graph.chains.keyframes.pages.bytes()
            + graph.sightings.slab.pages.bytes()
            + graph.constraints.slab.pages.bytes()
            + graph.sightings.landmarks.slots.pages.bytes()
            + graph.attachments.slab.pages.bytes()
            + self.recognition.bytes()
    }

    fn head(&self) -> KeyframePage {
        let mut out = StateWriter::default();
        self.write_head(&mut out);
        KeyframePage {
            part: HEAD,
            index: 0,
            bytes: out.into_bytes(),
        }
    }

    fn write_head(&self, out: &mut StateWriter) {
        let graph = &self.graph;
        graph.chains.sweep.write(out);
        graph.constraints.schedule.write(out);
        self.recognition.write_head(out);
        graph.chains.keyframes.vacancy().write(out);
        graph.sightings.slab.vacancy().write(out);
        graph.constraints.slab.vacancy().write(out);
        graph.sightings.landmarks.slots.vacancy().write(out);
        graph.attachments.slab.vacancy().write(out);
        (graph.attachments.cursor, graph.attachments.n_unchecked).write(out);
        N_PENDING.write(out);
    }

    fn read_head(&mut self, bytes: &[u8]) -> Result<(), CorruptState> {
        let mut input = StateReader::new(bytes);
        let graph = &mut self.graph;
        graph.chains.sweep = State::read(&mut input)?;
        graph.constraints.schedule = State::read(&mut input)?;
        self.recognition.read_head(&mut input)?;
        graph.chains.keyframes.set_vacancy(State::read(&mut input)?);
        graph.sightings.slab.set_vacancy(State::read(&mut input)?);
        graph.constraints.slab.set_vacancy(State::read(&mut input)?);
        graph
            .sightings
            .landmarks
            .slots
            .set_vacancy(State::read(&mut input)?);
        graph.attachments.slab.set_vacancy(State::read(&mut input)?);
        (graph.attachments.cursor, graph.attachments.n_unchecked) = State::read(&mut input)?;
        if u64::read(&mut input)? != N_PENDING {
            return Err(CorruptState::Invalid);
        }
        input.end()
    }
}

/// The pages of a vector that changed.
fn pages_of<T: State, const N: usize>(
    part: u8,
    items: &PagedVec<T, N>,
    since: u64,
) -> impl Iterator<Item = KeyframePage> {
    items.changed_pages(since).map(move |(index, _, items)| {
        let mut out = StateWriter::default();
        write_page(items, &mut out);
        KeyframePage {
            part,
            index: u32::try_from(index).expect("2³² items have fewer pages"),
            bytes: out.into_bytes(),
        }
    })
}

/// Pages of place recognition.
fn seen_pages(
    part: u8,
    pages: impl Iterator<Item = (usize, Vec<u8>)>,
) -> impl Iterator<Item = KeyframePage> {
    pages.map(move |(index, bytes)| KeyframePage {
        part,
        index: u32::try_from(index).expect("2³² items have fewer pages"),
        bytes,
    })
}
