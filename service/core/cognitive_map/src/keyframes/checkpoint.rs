//! A chronicle as pages of bytes, and back.
//!
//! ```text
//! part  index  bytes
//! 0     0      what is waiting, where the search for what may go goes on, vacant numbers
//! 1     page   up to 4 agents
//! 2     page   up to 32 anchors
//! 3     page   up to 64 sightings
//! 4     page   up to 32 ties
//! 5     page   up to 64 landmarks
//! 6     page   up to 16 views
//! 7     page   what an agent saw lately
//! 8     page   what an agent has seen that does not know where it is
//! 9     page   up to 32 things that lie beside anchors
//! 10    page   what an agent has seen that contradicts where it is believed to be
//! ```

use std::collections::BTreeMap;

use super::graph::{KeyframeGraph, Waiting};
use super::settings::KeyframeSettings;
use super::sighting::Shown;
use state::Digest;
use state::NONE;
use state::{CorruptState, State, StateReader, StateWriter};
use state::{PagedVec, write_page};

const HEAD: u8 = 0;
const LIVES: u8 = 1;
const ANCHORS: u8 = 2;
const SIGHTINGS: u8 = 3;
const TIES: u8 = 4;
const LANDMARKS: u8 = 5;
const VIEWS: u8 = 6;
const TRACKS: u8 = 7;
const SEARCHES: u8 = 8;
const MOORINGS: u8 = 9;
const DOUBTS: u8 = 10;

/// One page of a chronicle's checkpoint. A later page of the same part and index replaces an earlier one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct KeyframePage {
    /// What the page holds.
    pub part: u8,
    /// Which of its part it is.
    pub index: u32,
    /// The bytes.
    pub bytes: Vec<u8>,
}

/// Pages that are no chronicle: some are missing, damaged, left over or of another time.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the pages are no chronicle")]
pub struct CorruptKeyframes;

impl KeyframeGraph {
    /// The pages that changed after `since_revision`, the head always among them; 0 gives all.
    pub fn checkpoint(&self, since_revision: u64) -> impl Iterator<Item = KeyframePage> {
        let since = since_revision;
        std::iter::once(self.head())
            .chain(pages_of(LIVES, &self.lives, since))
            .chain(pages_of(ANCHORS, &self.anchors.pages, since))
            .chain(pages_of(SIGHTINGS, &self.sightings.pages, since))
            .chain(pages_of(TIES, &self.ties.pages, since))
            .chain(pages_of(LANDMARKS, &self.landmarks.slots.pages, since))
            .chain(pages_of(VIEWS, &self.revisits.views, since))
            .chain(pages_of(TRACKS, &self.revisits.tracks, since))
            .chain(pages_of(SEARCHES, &self.searches, since))
            .chain(pages_of(MOORINGS, &self.moorings.pages, since))
            .chain(pages_of(DOUBTS, &self.doubts, since))
    }

    /// The chronicle of a checkpoint, which goes on like the one that wrote it. Its pages count as changed at `revision`.
    ///
    /// # Errors
    /// The pages are no chronicle.
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
        let mut chronicle = Self::new(settings);
        chronicle.revision = revision;
        let mut expected = (0, 0);
        for ((part, index), bytes) in pages {
            if index != 0 && (part, index) != expected {
                return Err(CorruptKeyframes);
            }
            expected = (part, index.wrapping_add(1));
            let pushed = match part {
                LIVES => chronicle.lives.push_page(&bytes, revision),
                ANCHORS => chronicle.anchors.pages.push_page(&bytes, revision),
                SIGHTINGS => chronicle.sightings.pages.push_page(&bytes, revision),
                TIES => chronicle.ties.pages.push_page(&bytes, revision),
                LANDMARKS => chronicle.landmarks.slots.pages.push_page(&bytes, revision),
                VIEWS => chronicle.revisits.views.push_page(&bytes, revision),
                TRACKS => chronicle.revisits.tracks.push_page(&bytes, revision),
                SEARCHES => chronicle.searches.push_page(&bytes, revision),
                MOORINGS => chronicle.moorings.pages.push_page(&bytes, revision),
                DOUBTS => chronicle.doubts.push_page(&bytes, revision),
                _ => Err(CorruptState::Invalid),
            };
            pushed.map_err(|_| CorruptKeyframes)?;
        }
        let read = chronicle.read_head(&head);
        if read.is_err() || !chronicle.landmarks.sort() || !chronicle.is_sound() {
            return Err(CorruptKeyframes);
        }
        chronicle.set_milestones();
        Ok(chronicle)
    }

    /// Equal chronicles have equal digests. Only pages that changed since the last time are hashed anew.
    pub fn digest(&self) -> Digest {
        let mut out = StateWriter::default();
        self.write_head(&mut out);
        self.lives.write_digests(&mut out);
        self.anchors.pages.write_digests(&mut out);
        self.sightings.pages.write_digests(&mut out);
        self.ties.pages.write_digests(&mut out);
        self.landmarks.slots.pages.write_digests(&mut out);
        self.revisits.views.write_digests(&mut out);
        self.revisits.tracks.write_digests(&mut out);
        self.searches.write_digests(&mut out);
        self.moorings.pages.write_digests(&mut out);
        self.doubts.write_digests(&mut out);
        out.digest()
    }

    /// Bytes of memory that it takes, without labels.
    pub fn bytes(&self) -> usize {
        self.lives.bytes()
            + self.anchors.pages.bytes()
            + self.sightings.pages.bytes()
            + self.ties.pages.bytes()
            + self.landmarks.slots.pages.bytes()
            + self.moorings.pages.bytes()
            + self.revisits.bytes()
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
        self.hand.write(out);
        (self.told, self.fresh_matches).write(out);
        self.agreed.write(out);
        self.revisits.write_head(out);
        self.anchors.vacancy().write(out);
        self.sightings.vacancy().write(out);
        self.ties.vacancy().write(out);
        self.landmarks.slots.vacancy().write(out);
        self.moorings.vacancy().write(out);
        (self.swung, self.adrift).write(out);
        (self.waiting.len() as u64).write(out);
        for waiting in &self.waiting {
            waiting.write(out);
        }
    }

    fn read_head(&mut self, bytes: &[u8]) -> Result<(), CorruptState> {
        let mut input = StateReader::new(bytes);
        self.hand = State::read(&mut input)?;
        (self.told, self.fresh_matches) = State::read(&mut input)?;
        self.agreed = State::read(&mut input)?;
        self.revisits.read_head(&mut input)?;
        self.anchors.set_vacancy(State::read(&mut input)?);
        self.sightings.set_vacancy(State::read(&mut input)?);
        self.ties.set_vacancy(State::read(&mut input)?);
        self.landmarks.slots.set_vacancy(State::read(&mut input)?);
        self.moorings.set_vacancy(State::read(&mut input)?);
        (self.swung, self.adrift) = State::read(&mut input)?;
        for _ in 0..u64::read(&mut input)? {
            self.waiting.push(Waiting::read(&mut input)?);
        }
        input.end()
    }

    /// Whether all numbers lead somewhere, and all lists come to an end.
    fn is_sound(&self) -> bool {
        let slots = self.anchors.is_sound()
            && self.sightings.is_sound()
            && self.ties.is_sound()
            && self.landmarks.slots.is_sound()
            && self.moorings.is_sound();
        let is_agent = |agent: u32| (agent as usize) < self.lives.len();
        let waiting = self
            .waiting
            .iter()
            .all(|waiting| is_agent(waiting.observer) && is_agent(waiting.target));
        slots
            && waiting
            && self.hand <= self.anchors.numbers()
            && self.revisits.is_sound(self.lives.len())
            && self.searches_are_sound()
            && self.chains_are_sound()
            && self.sightings_are_sound()
            && self.ties_are_sound()
            && self.moorings_are_sound()
    }

    fn searches_are_sound(&self) -> bool {
        let is_channel = |channel, length| self.revisits.is_channel(channel, length);
        let mut searches = self.searches.iter();
        let mut doubts = self.doubts.iter();
        searches.all(|search| search.is_sound(self.lives.len(), is_channel))
            && doubts.all(|doubt| doubt.is_sound(self.lives.len(), is_channel))
    }

    fn chains_are_sound(&self) -> bool {
        let mut visited = 0;
        for (agent, life) in (0..).zip(self.lives.iter()) {
            let (mut number, mut next) = (life.newest, NONE);
            while number != NONE {
                let Some(anchor) = self.anchors.get(number) else {
                    return false;
                };
                visited += 1;
                if anchor.next != next || anchor.agent != agent || visited > self.anchors.len() {
                    return false;
                }
                (next, number) = (number, anchor.previous);
            }
        }
        visited == self.anchors.len()
    }

    fn sightings_are_sound(&self) -> bool {
        let (mut made, mut shown, mut agents_shown) = (0, 0, 0);
        let mut of_landmark = vec![0; self.landmarks.slots.numbers() as usize];
        for (number, anchor) in self.anchors.iter() {
            let mut at = anchor.sightings;
            while at != NONE {
                let sighting = self.sightings.get(at);
                let Some(sighting) = sighting.filter(|sighting| sighting.anchor == number) else {
                    return false;
                };
                match sighting.shown {
                    Shown::Agent(..) => agents_shown += 1,
                    Shown::Landmark(landmark) => match of_landmark.get_mut(landmark as usize) {
                        Some(count) => *count += 1,
                        None => return false,
                    },
                }
                made += 1;
                if made > self.sightings.len() {
                    return false;
                }
                at = sighting.next;
            }
            let mut at = anchor.shown;
            while at != NONE {
                let shows = |sighting: &&super::sighting::Sighting| matches!(sighting.shown, Shown::Agent(target, _) if target == number);
                let Some(sighting) = self.sightings.get(at).filter(shows) else {
                    return false;
                };
                shown += 1;
                if shown > self.sightings.len() {
                    return false;
                }
                at = sighting.next_shown;
            }
        }
        let landmarks = self.landmarks.slots.iter();
        made == self.sightings.len() && shown == agents_shown && { landmarks }
            .all(|(number, landmark)| of_landmark[number as usize] == landmark.sightings)
    }

    fn ties_are_sound(&self) -> bool {
        let mut ends = 0;
        for (number, anchor) in self.anchors.iter() {
            let mut at = anchor.ties;
            while at != NONE {
                let Some(tie) = self.ties.get(at) else {
                    return false;
                };
                ends += 1;
                if (tie.from != number && tie.to != number) || ends > 2 * self.ties.len() {
                    return false;
                }
                at = self.next_tie(at, number);
            }
        }
        let expected: usize = self
            .ties
            .iter()
            .map(|(_, tie)| if tie.from == NONE { 1 } else { 2 })
            .sum();
        ends == expected
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
