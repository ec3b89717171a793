//! The pages of a checkpoint.

use state::{CorruptState, PagedVec, State, StateReader, StateWriter, write_page};

use super::PlaceRecognition;
use crate::tuning::tracking::AGENTS_MAX;

/// A paged part of the state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Remembered views, 16 a page.
    Views,
    /// All views of agents of the map, 16 a page.
    Log,
    /// The latest views of an agent on a channel.
    Tracks,
    /// The search of an agent that does not know where it is.
    Searches,
    /// The views that contradict where an agent is believed to be.
    KidnapTests,
    /// Mean views of cells, 16 a page.
    Cells,
    /// Views that wait until they are added to cells, 16 a page.
    Waiting,
    /// The particles of an agent that does not know where it is.
    Filters,
    /// The particles of an agent that is tracked.
    Trackers,
}

/// Number of a page, and its bytes.
type Page = (usize, Vec<u8>);

impl PlaceRecognition {
    /// The pages of a part that changed after a revision.
    pub fn pages(&self, part: Part, since_revision: u64) -> Box<dyn Iterator<Item = Page> + '_> {
        match part {
            Part::Views => Box::new(pages_of(&self.views.stored, since_revision)),
            Part::Log => Box::new(pages_of(&self.views.log.views, since_revision)),
            Part::Tracks => Box::new(pages_of(&self.views.tracks, since_revision)),
            Part::Searches => Box::new(pages_of(&self.searches, since_revision)),
            Part::KidnapTests => Box::new(pages_of(&self.kidnap_tests, since_revision)),
            Part::Cells => Box::new(pages_of(&self.waking.cells.all, since_revision)),
            Part::Waiting => Box::new(pages_of(&self.waking.waiting, since_revision)),
            Part::Filters => Box::new(pages_of(&self.waking.filters, since_revision)),
            Part::Trackers => Box::new(pages_of(&self.trackers, since_revision)),
        }
    }

    /// Reads the next page of a part.
    ///
    /// # Errors
    /// The bytes are no such page.
    pub fn push_page(&mut self, part: Part, bytes: &[u8]) -> Result<(), CorruptState> {
        let revision = self.revision;
        match part {
            Part::Views => self.views.stored.push_page(bytes, revision),
            Part::Log => self.views.log.views.push_page(bytes, revision),
            Part::Tracks => self.views.tracks.push_page(bytes, revision),
            Part::Searches => self.searches.push_page(bytes, revision),
            Part::KidnapTests => self.kidnap_tests.push_page(bytes, revision),
            Part::Cells => self.waking.cells.all.push_page(bytes, revision),
            Part::Waiting => self.waking.waiting.push_page(bytes, revision),
            Part::Filters => self.waking.filters.push_page(bytes, revision),
            Part::Trackers => self.trackers.push_page(bytes, revision),
        }
    }

    /// Writes the digests of a part's pages.
    pub fn write_digests(&self, part: Part, out: &mut StateWriter) {
        match part {
            Part::Views => self.views.stored.write_digests(out),
            Part::Log => self.views.log.views.write_digests(out),
            Part::Tracks => self.views.tracks.write_digests(out),
            Part::Searches => self.searches.write_digests(out),
            Part::KidnapTests => self.kidnap_tests.write_digests(out),
            Part::Cells => self.waking.cells.all.write_digests(out),
            Part::Waiting => self.waking.waiting.write_digests(out),
            Part::Filters => self.waking.filters.write_digests(out),
            Part::Trackers => self.trackers.write_digests(out),
        }
    }

    /// Writes what is in no page.
    pub fn write_head(&self, out: &mut StateWriter) {
        self.views.write_head(out);
    }

    /// Reads what [`write_head`](Self::write_head) wrote, after all pages.
    ///
    /// # Errors
    /// The bytes are no such head.
    pub fn read_head(&mut self, input: &mut StateReader<'_>) -> Result<(), CorruptState> {
        self.views.read_head(input, self.revision)
    }

    /// Reads what the log of views has in no page.
    ///
    /// # Errors
    /// The bytes are no such head.
    pub fn read_log_head(&mut self, input: &mut StateReader<'_>) -> Result<(), CorruptState> {
        self.views.log.read_head(input)
    }

    /// Whether views have taught cells.
    pub fn has_cells(&self) -> bool {
        !self.waking.is_empty()
    }

    /// Writes what was learned of cells and is in no page.
    pub fn write_cells_head(&self, out: &mut StateWriter) {
        self.waking.write_head(out);
    }

    /// Reads what [`write_cells_head`](Self::write_cells_head) wrote, after all pages.
    ///
    /// # Errors
    /// The bytes are no such head.
    pub fn read_cells_head(&mut self, input: &mut StateReader<'_>) -> Result<(), CorruptState> {
        self.waking.read_head(input, self.revision)
    }

    /// Whether everything that the state names is there, among so many agents.
    pub fn is_sound(&self, agents: usize) -> bool {
        let is_channel = |channel, length| self.views.is_channel(channel, length);
        let mut searches = self.searches.iter();
        let mut tests = self.kidnap_tests.iter();
        let mut trackers = self.trackers.iter();
        self.views.is_sound(agents)
            && self.waking.is_sound(agents)
            && self.trackers.len() <= AGENTS_MAX
            && trackers.all(|tracker| tracker.is_sound(agents))
            && searches.all(|search| search.is_sound(agents, is_channel))
            && tests.all(|test| test.is_sound(agents, is_channel))
    }
}

fn pages_of<T: State, const N: usize>(
    items: &PagedVec<T, N>,
    since_revision: u64,
) -> impl Iterator<Item = Page> {
    items
        .changed_pages(since_revision)
        .map(|(index, _, items)| {
            let mut out = StateWriter::default();
            write_page(items, &mut out);
            (index, out.into_bytes())
        })
}
