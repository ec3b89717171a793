//! A keyframe graph as pages of bytes, and back.
//!
//! ```text
//! part  index  bytes
//! 0     0      what is new, the sweep cursor, vacant numbers, the relaxation under way
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
//! 11    page   up to 16 views of the log
//! 12    page   up to 16 cells of mean views
//! 13    page   up to 16 views that wait for their cells
//! 14    page   the particles of an agent that does not know where it is
//! 15    page   what was learned of a channel of views, with these views
//! 16    page   the particles of an agent that is tracked
//! ```

use std::collections::BTreeMap;

use super::graph::KeyframeGraph;
use super::map::KeyframeMap;
use super::settings::KeyframeSettings;
use place_recognition::{LearnedChannel, Part, ViewLog, ViewMap, ViewMatch};
use state::Digest;
use state::{CorruptState, State, StateReader, StateWriter};
use state::{NONE, PagedVec, read_list, write_list, write_page};

/// Number of the head.
const HEAD: u8 = 0;

/// A part of the graph.
macro_rules! of_graph {
    ($($field:ident).+) => {
        Stored::InGraph(|graph| &graph.$($field).+, |graph| &mut graph.$($field).+)
    };
}

/// The other parts, by number, from 1.
const PARTS: [Stored; 16] = [
    of_graph!(chains.tracks),
    of_graph!(chains.keyframes.pages),
    of_graph!(sightings.slab.pages),
    of_graph!(constraints.slab.pages),
    of_graph!(sightings.landmarks.slots.pages),
    Stored::InRecognition(Part::Views),
    Stored::InRecognition(Part::Tracks),
    Stored::InRecognition(Part::Searches),
    of_graph!(attachments.slab.pages),
    Stored::InRecognition(Part::KidnapTests),
    Stored::InRecognition(Part::Log),
    Stored::InRecognition(Part::Cells),
    Stored::InRecognition(Part::Waiting),
    Stored::InRecognition(Part::Filters),
    of_graph!(view_maps),
    Stored::InRecognition(Part::Trackers),
];

/// The parts from this one on, counted from zero, are there only where there are views: without,
/// a map has the digest that it had before there were such parts.
const OF_VIEW_MAPS: usize = 14;

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

impl KeyframePage {
    fn new(part: u8, index: usize, bytes: Vec<u8>) -> Self {
        let index = u32::try_from(index).expect("2³² items have fewer pages");
        Self { part, index, bytes }
    }
}

/// Pages that are no keyframe map: some are missing, damaged, left over or of another time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the pages are no map")]
pub struct CorruptKeyframes;

impl KeyframeGraph {
    /// Digest of a graph without a relaxation under way, as that of a relaxation is.
    pub(super) fn digest(&self, views: Option<&ViewLog>) -> Digest {
        let mut out = StateWriter::default();
        write_list(self.matches.iter(), &mut out);
        write_list(self.learned.iter(), &mut out);
        if let Some(views) = views {
            views.write_digests(&mut out);
        }
        self.chains.sweep.write(&mut out);
        self.constraints.schedule.write(&mut out);
        self.sightings.landmarks.slots.vacancy().write(&mut out);
        for vector in PARTS.iter().filter_map(Stored::in_graph) {
            vector(self).write_digests(&mut out);
        }
        out.digest()
    }
}

impl KeyframeMap {
    /// The pages that changed after `since_revision`, the head always among them; 0 gives all.
    pub fn checkpoint(&self, since_revision: u64) -> impl Iterator<Item = KeyframePage> {
        let parts = (1..).zip(&PARTS);
        let pages = parts.flat_map(move |(part, stored)| {
            let changed = stored.changed(self, since_revision);
            changed.map(move |(index, bytes)| KeyframePage::new(part, index, bytes))
        });
        std::iter::once(self.head()).chain(pages)
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
            || !{ map.pending.iter() }.all(|one| one.outcome().is_sound(graph.chains.tracks.len()))
        {
            return Err(CorruptKeyframes);
        }
        graph.chains.rebuild_index();
        let seen = &map.recognition;
        if !map.view_maps().all(|views| seen.is_view_map(views)) {
            return Err(CorruptKeyframes);
        }
        Ok(map)
    }

    fn push_page(&mut self, part: u8, bytes: &[u8]) -> Result<(), CorruptState> {
        let stored = usize::from(part).checked_sub(1);
        let stored = stored.and_then(|at| PARTS.get(at));
        match stored.ok_or(CorruptState::Invalid)? {
            Stored::InGraph(_, vector) => {
                let revision = self.graph.revision;
                vector(&mut self.graph).push(bytes, revision)
            }
            Stored::InRecognition(part) => self.recognition.push_page(*part, bytes),
        }
    }

    /// Equal maps have equal digests. Only pages that changed since the last time are hashed anew.
    pub fn digest(&self) -> Digest {
        let mut out = StateWriter::default();
        self.write_head(&mut out);
        // A map without views has the digest that it had before there was a log.
        let has_views = !self.recognition.views().is_empty() || !self.graph.matches.is_empty();
        if has_views {
            self.write_views(&mut out);
        }
        let has_cells = self.recognition.has_cells();
        if has_cells {
            self.recognition.write_cells_head(&mut out);
        }
        if let (Some(pending), Some(meanwhile)) = (&self.pending, &self.graph.meanwhile) {
            pending.write_digested(&mut out);
            meanwhile.write(&mut out);
        }
        for (number, stored) in PARTS.iter().enumerate() {
            match stored {
                _ if number >= OF_VIEW_MAPS && !has_views => {}
                Stored::InGraph(vector, _) => vector(&self.graph).write_digests(&mut out),
                Stored::InRecognition(Part::Log) if !has_views => {}
                Stored::InRecognition(Part::Cells | Part::Waiting | Part::Filters)
                    if !has_cells => {}
                Stored::InRecognition(part) => self.recognition.write_digests(*part, &mut out),
            }
        }
        out.digest()
    }

    /// Bytes of memory that it takes, without labels.
    pub fn bytes(&self) -> usize {
        let in_graph = PARTS.iter().map(|stored| match stored {
            Stored::InGraph(vector, _) => vector(&self.graph).bytes(),
            Stored::InRecognition(_) => 0,
        });
        let views: usize = self.view_maps().map(ViewMap::bytes).sum();
        in_graph.sum::<usize>() + self.recognition.bytes() + views
    }

    fn head(&self) -> KeyframePage {
        let mut out = StateWriter::default();
        self.write_head(&mut out);
        self.write_views(&mut out);
        self.recognition.write_cells_head(&mut out);
        let pending = self.pending.as_ref().zip(self.graph.meanwhile.as_deref());
        pending.is_some().write(&mut out);
        if let Some((pending, meanwhile)) = pending {
            pending.write(&mut out);
            meanwhile.write(&mut out);
        }
        KeyframePage::new(HEAD, 0, out.into_bytes())
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

    /// Writes the matches of views, and what the log has in no page.
    fn write_views(&self, out: &mut StateWriter) {
        write_list(self.graph.matches.iter(), out);
        write_list(self.graph.learned.iter(), out);
        self.recognition.views().write_head(out);
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
        graph.matches = read_list::<ViewMatch>(&mut input, NONE)?.into();
        graph.learned = read_list::<LearnedChannel>(&mut input, NONE)?.into();
        self.recognition.read_log_head(&mut input)?;
        self.recognition.read_cells_head(&mut input)?;
        if bool::read(&mut input)? {
            self.pending = Some(State::read(&mut input)?);
            self.graph.meanwhile = Some(Box::new(State::read(&mut input)?));
        }
        input.end()
    }
}

/// Where a part is.
enum Stored {
    /// In a vector of the graph, to be read or changed.
    InGraph(
        fn(&KeyframeGraph) -> &dyn Pages,
        fn(&mut KeyframeGraph) -> &mut dyn Pages,
    ),
    InRecognition(Part),
}

/// Pages by number, as bytes.
type NumberedPages<'a> = Box<dyn Iterator<Item = (usize, Vec<u8>)> + 'a>;

impl Stored {
    /// The vector of the graph, if it is there.
    fn in_graph(&self) -> Option<fn(&KeyframeGraph) -> &dyn Pages> {
        match self {
            Self::InGraph(vector, _) => Some(*vector),
            Self::InRecognition(_) => None,
        }
    }

    /// The pages that changed after a revision.
    fn changed<'a>(&self, map: &'a KeyframeMap, since_revision: u64) -> NumberedPages<'a> {
        match self {
            Self::InGraph(vector, _) => vector(&map.graph).changed(since_revision),
            Self::InRecognition(part) => map.recognition.pages(*part, since_revision),
        }
    }
}

/// A vector of pages, whatever its items are.
trait Pages {
    /// The pages that changed after a revision.
    fn changed(&self, since_revision: u64) -> NumberedPages<'_>;
    /// Appends a page.
    fn push(&mut self, bytes: &[u8], revision: u64) -> Result<(), CorruptState>;
    /// Writes the digests of all pages.
    fn write_digests(&self, out: &mut StateWriter);
    /// Bytes of memory that it takes.
    fn bytes(&self) -> usize;
}

impl<T: State + Clone, const N: usize> Pages for PagedVec<T, N> {
    fn changed(&self, since_revision: u64) -> NumberedPages<'_> {
        let pages = self.changed_pages(since_revision);
        Box::new(pages.map(|(index, _, items)| {
            let mut out = StateWriter::default();
            write_page(items, &mut out);
            (index, out.into_bytes())
        }))
    }

    fn push(&mut self, bytes: &[u8], revision: u64) -> Result<(), CorruptState> {
        self.push_page(bytes, revision)
    }

    fn write_digests(&self, out: &mut StateWriter) {
        Self::write_digests(self, out);
    }

    fn bytes(&self) -> usize {
        Self::bytes(self)
    }
}
