//! What agents saw, and where they see it again.

use nalgebra::{Isometry3, Point3};

use super::passage::Passage;
use super::reach::{Distance, Kernel, Reach};
use super::track::{RECENT_MAX, Track, read_all, write_all};
use super::view::{Likeness, View, angle_rad};
use crate::input::Descriptor;
use state::PagedVec;
use state::{CorruptState, State, StateReader, StateWriter};

/// Channels whose views are remembered.
const CHANNELS_MAX: usize = 64;
/// Views that are remembered.
const VIEWS_MAX: usize = 16_384;
/// Numbers in them, all of which a view that is news is compared with: 8 MiB.
const NUMBERS_MAX: usize = 1 << 21;
/// Motion between two views that are compared \[m, rad\].
const MOVED: (f64, f64) = (0.05, 0.1);
/// Motion after which a view may be news \[m, rad\]: an anchor's.
const STEP: (f64, f64) = (0.1, 0.1);
/// A view that is like none of those so near, in reaches, shows something that is not there: somebody who passes by.
const BESIDE: f64 = 0.6;
/// Of an agent's own views those count as earlier that lie so many before the present one.
const EARLIER: u32 = 16;
/// Two views are of one place if they are nearer than so many deviations of where they were seen.
const APART_SD: f64 = 3.0;
/// Ordinals left out where an agent was put somewhere else.
const APART: u32 = 64;
/// Views that a new one is taken to be like at most, the most alike first.
pub(in crate::keyframes) const ALIKE_MAX: usize = 32;
/// Passages of an agent under way.
const PASSAGES_MAX: usize = 4;

/// What agents saw lately and long ago.
#[derive(Clone, Debug, Default)]
pub(in crate::keyframes) struct Revisits {
    reaches: Vec<Reach>,
    pub(in crate::keyframes) tracks: PagedVec<Track, 1>,
    pub(in crate::keyframes) views: PagedVec<View, 16>,
    /// Numbers in all views.
    numbers: u64,
    /// Times that every second view was forgotten.
    pub(in crate::keyframes) thinnings: u64,
}

/// Where an agent is when it sees something.
#[derive(Clone, Copy, Debug)]
pub(in crate::keyframes) struct Felt {
    pub(in crate::keyframes) agent: u32,
    pub(in crate::keyframes) session: u32,
    pub(in crate::keyframes) seq: u64,
    pub(in crate::keyframes) in_odom: Isometry3<f64>,
    pub(in crate::keyframes) in_map: Point3<f64>,
    pub(in crate::keyframes) spread: [f64; 2],
}

impl Revisits {
    /// An agent sees something; answers the passages that are over with that.
    pub(in crate::keyframes) fn feel(
        &mut self,
        felt: &Felt,
        descriptor: &Descriptor,
        revision: u64,
    ) -> Vec<Passage> {
        let vector = descriptor.vector();
        let Some(channel) = self.channel(descriptor) else {
            return Vec::new();
        };
        let at = self.track(felt, channel, revision);
        let Some(track) = self.tracks.get_mut(at, revision) else {
            return Vec::new();
        };
        let has_moved = track
            .last
            .is_none_or(|last| is_beyond(&last.inv_mul(&felt.in_odom), MOVED));
        if !has_moved {
            return Vec::new();
        }
        track.last = Some(felt.in_odom);
        let reach = &mut self.reaches[usize::from(channel)];
        let (mut is_news, mut is_stray) = (true, None);
        for (index, recent) in track.recent.iter().enumerate() {
            let angle_rad = angle_rad(&recent.vector, vector);
            let way = recent.in_odom.inv_mul(&felt.in_odom);
            let distance_m = way.translation.vector.norm();
            reach.learn(angle_rad, distance_m);
            if index + 1 == track.recent.len() {
                is_news = angle_rad > reach.news_rad() && is_beyond(&way, STEP);
            }
            if reach
                .reach_m()
                .is_some_and(|reach_m| distance_m < BESIDE * reach_m)
            {
                let is_unlike = reach.distance(angle_rad).is_none();
                is_stray = Some(is_unlike && is_stray.unwrap_or(true));
            }
        }
        if !is_news || is_stray == Some(true) {
            return Vec::new();
        }
        track.note(&felt.in_odom, vector);
        let view = View {
            channel,
            agent: felt.agent,
            session: felt.session,
            seq: felt.seq,
            ordinal: track.next,
            in_odom: felt.in_odom,
            in_map: felt.in_map,
            spread: felt.spread,
            vector: vector.into(),
        };
        track.next = track.next.saturating_add(1);
        let (alike, is_known) = self.alike(&view);
        let over = self.pass(at, &view, &alike, revision);
        if !is_known {
            self.remember(view, revision);
        }
        over
    }

    /// An agent has been put somewhere else: what it sees from now on is not beside what it saw.
    pub(in crate::keyframes) fn cut(&mut self, agent: u32, revision: u64) {
        for number in 0..self.tracks.len() {
            if self
                .tracks
                .get(number)
                .is_none_or(|track| track.agent != agent)
            {
                continue;
            }
            if let Some(track) = self.tracks.get_mut(number, revision) {
                track.recent.clear();
                track.passages.clear();
                track.next = track.next.saturating_add(APART);
            }
        }
    }

    /// The earlier views that one is like, by number, with their distances; and whether one of them is as good as the same.
    fn alike(&mut self, view: &View) -> (Vec<(usize, Distance)>, bool) {
        let reach = &mut self.reaches[usize::from(view.channel)];
        let mut alike = Vec::new();
        let mut is_known = false;
        for (number, other) in self.views.iter().enumerate() {
            let is_recent = other.agent == view.agent
                && other.session == view.session
                && other.ordinal.saturating_add(EARLIER) >= view.ordinal;
            if other.channel != view.channel || is_recent {
                continue;
            }
            let angle_rad = angle_rad(&other.vector, &view.vector);
            reach.learn_unrelated(angle_rad);
            if let Some(distance) = reach.distance(angle_rad) {
                // What looks the same somewhere else is not known here.
                let apart_m = (other.in_map - view.in_map).norm();
                let unsure_m = APART_SD * other.spread[0].hypot(view.spread[0]);
                is_known |= angle_rad < reach.news_rad() && apart_m <= distance.mean_m + unsure_m;
                alike.push((number, distance));
            }
        }
        if alike.len() > ALIKE_MAX {
            alike.sort_by(|a, b| a.1.mean_m.total_cmp(&b.1.mean_m).then(a.0.cmp(&b.0)));
            alike.truncate(ALIKE_MAX);
            alike.sort_by_key(|(number, _)| *number);
        }
        (alike, is_known)
    }

    /// Takes a view and those that it is like into the passages under way; answers those that are over.
    fn pass(
        &mut self,
        track: usize,
        view: &View,
        alike: &[(usize, Distance)],
        revision: u64,
    ) -> Vec<Passage> {
        let Some(track) = self.tracks.get_mut(track, revision) else {
            return Vec::new();
        };
        let mut is_met = vec![false; track.passages.len()];
        for &(number, distance) in alike {
            let Some(other) = self.views.get(number) else {
                continue;
            };
            let known = track
                .passages
                .iter()
                .position(|passage| passage.leads_to(other));
            match known {
                Some(index) => {
                    is_met[index] = true;
                    track.passages[index].add(view, other, distance);
                }
                None if track.passages.len() < PASSAGES_MAX => {
                    is_met.push(true);
                    track.passages.push(Passage::new(view, other, distance));
                }
                None => {}
            }
        }
        for (passage, is_met) in track.passages.iter_mut().zip(is_met) {
            if !is_met {
                passage.miss();
            }
        }
        let (over, open) = std::mem::take(&mut track.passages)
            .into_iter()
            .partition::<Vec<_>, _>(Passage::is_over);
        track.passages = open;
        let telling = over.into_iter().filter(Passage::is_telling);
        let last = track.next.saturating_sub(1);
        telling
            .map(|mut passage| {
                let count = last.saturating_sub(passage.first_now()) as usize + 1;
                let from = track.recent.len().saturating_sub(count);
                passage.looks = track.recent[from..].to_vec();
                passage
            })
            .collect()
    }

    /// Remembers a view; every second one is forgotten when there is no room for it.
    fn remember(&mut self, view: View, revision: u64) {
        self.numbers += view.vector.len() as u64;
        self.views.push(view, revision);
        if self.views.len() <= VIEWS_MAX && self.numbers <= NUMBERS_MAX as u64 {
            return;
        }
        let mut kept = 0;
        self.thinnings += 1;
        self.numbers = 0;
        for number in 0..self.views.len() {
            let Some(mut view) = self.views.get(number).cloned() else {
                continue;
            };
            if !view.ordinal.is_multiple_of(2) {
                continue;
            }
            // So that neighbours are still told by their ordinals.
            view.ordinal /= 2;
            self.numbers += view.vector.len() as u64;
            if let Some(slot) = self.views.get_mut(kept, revision) {
                *slot = view;
            }
            kept += 1;
        }
        while self.views.len() > kept {
            self.views.pop(revision);
        }
        for number in 0..self.tracks.len() {
            if let Some(track) = self.tracks.get_mut(number, revision) {
                track.next = track.next.div_ceil(2);
                track.passages.clear();
            }
        }
    }

    /// Forgets what an agent saw in a session, from a sample on.
    pub(in crate::keyframes) fn forget_since(
        &mut self,
        agent: u32,
        session: u32,
        since_seq: u64,
        revision: u64,
    ) {
        let is_gone = |view: &View| view.is_of(agent, session, since_seq);
        let Some(first) = self.views.iter().position(is_gone) else {
            return;
        };
        // Others are at other numbers from now on.
        self.thinnings += 1;
        let mut kept = first;
        for number in first..self.views.len() {
            let Some(view) = self.views.get(number) else {
                continue;
            };
            if is_gone(view) {
                self.numbers -= view.vector.len() as u64;
                continue;
            }
            let view = view.clone();
            if let Some(slot) = self.views.get_mut(kept, revision) {
                *slot = view;
            }
            kept += 1;
        }
        while self.views.len() > kept {
            self.views.pop(revision);
        }
    }

    /// The number of a descriptor's channel; a new one if there is room for it.
    fn channel(&mut self, descriptor: &Descriptor) -> Option<u8> {
        let dimension = u16::try_from(descriptor.vector().len()).ok()?;
        self.known_channel(descriptor).or_else(|| {
            if self.reaches.len() >= CHANNELS_MAX {
                return None;
            }
            let reach = Reach::new(descriptor.channel().clone(), dimension);
            self.reaches.push(reach);
            u8::try_from(self.reaches.len() - 1).ok()
        })
    }

    /// The number of the track of an agent on a channel, in its present session.
    fn track(&mut self, felt: &Felt, channel: u8, revision: u64) -> usize {
        let known = self
            .tracks
            .iter()
            .position(|track| track.agent == felt.agent && track.channel == channel);
        let Some(number) = known else {
            self.tracks
                .push(Track::new(felt.agent, channel, felt.session), revision);
            return self.tracks.len() - 1;
        };
        if let Some(track) = self.tracks.get_mut(number, revision)
            && track.session != felt.session
        {
            *track = Track::new(felt.agent, channel, felt.session);
        }
        number
    }

    /// Bytes of memory that it takes.
    pub(in crate::keyframes) fn bytes(&self) -> usize {
        let numbers = usize::try_from(self.numbers).unwrap_or(usize::MAX);
        let recent = self.tracks.iter().map(|track| {
            let numbers = track.recent.iter().map(|recent| recent.vector.len());
            numbers.sum::<usize>()
        });
        let recent: usize = recent.sum();
        self.views.bytes() + self.tracks.bytes() + 4 * (numbers + recent)
    }

    pub(in crate::keyframes) fn write_head(&self, out: &mut StateWriter) {
        write_all(&self.reaches, out);
        self.thinnings.write(out);
    }

    pub(in crate::keyframes) fn read_head(
        &mut self,
        input: &mut StateReader<'_>,
    ) -> Result<(), CorruptState> {
        self.reaches = read_all(input)?;
        self.thinnings = State::read(input)?;
        self.numbers = self.views.iter().map(|view| view.vector.len() as u64).sum();
        Ok(())
    }

    /// The remembered views from a number on that something seen on a channel is like, the most alike first.
    pub(in crate::keyframes) fn likes(
        &self,
        channel: u8,
        vector: &[f32],
        from: usize,
        is_left_out: impl Fn(&View) -> bool,
    ) -> Vec<Likeness> {
        let views = self.views.iter_from(from);
        let mut likes: Vec<Likeness> = views
            .filter(|view| view.channel == channel && !is_left_out(view))
            .filter_map(|view| {
                Some(Likeness {
                    agent: view.agent,
                    session: view.session,
                    seq: view.seq,
                    distance: self.distance(channel, angle_rad(&view.vector, vector))?,
                })
            })
            .collect();
        likes.sort_by(|a, b| a.distance.mean_m.total_cmp(&b.distance.mean_m));
        likes.truncate(ALIKE_MAX);
        likes
    }

    /// Whether two views of a channel are more alike than unrelated ones.
    pub(in crate::keyframes) fn is_alike(&self, channel: u8, one: &[f32], other: &[f32]) -> bool {
        self.distance(channel, angle_rad(one, other)).is_some()
    }

    /// How far apart two views of a channel were taken, if they are alike.
    pub(in crate::keyframes) fn distance(&self, channel: u8, angle_rad: f64) -> Option<Distance> {
        self.reaches.get(usize::from(channel))?.distance(angle_rad)
    }

    /// How the likeness of views of a channel falls with distance, if that is known.
    pub(in crate::keyframes) fn kernel(&self, channel: u8) -> Option<Kernel> {
        self.reaches.get(usize::from(channel))?.kernel()
    }

    /// Distance from which on two views of a channel are no more alike than any \[m\].
    pub(in crate::keyframes) fn reach_m(&self, channel: u8) -> Option<f64> {
        self.reaches.get(usize::from(channel))?.reach_m()
    }

    /// The number of a descriptor's channel, if anything was remembered of it.
    pub(in crate::keyframes) fn known_channel(&self, descriptor: &Descriptor) -> Option<u8> {
        let dimension = u16::try_from(descriptor.vector().len()).ok()?;
        let known = self.reaches.iter().position(|reach| {
            reach.dimension == dimension && &reach.label == descriptor.channel()
        })?;
        u8::try_from(known).ok()
    }

    /// Whether a channel has views of so many numbers.
    pub(in crate::keyframes) fn is_channel(&self, channel: u8, length: usize) -> bool {
        let reach = self.reaches.get(usize::from(channel));
        reach.is_some_and(|reach| usize::from(reach.dimension) == length)
    }

    /// Whether everything that it names is there, and all views of a channel are of one length.
    pub(in crate::keyframes) fn is_sound(&self, agents: usize) -> bool {
        let is_channel = |channel: u8, length: usize| self.is_channel(channel, length);
        let views = self.views.iter().all(|view| {
            (view.agent as usize) < agents && is_channel(view.channel, view.vector.len())
        });
        let tracks = self.tracks.iter().all(|track| {
            let mut recent = track.recent.iter();
            (track.agent as usize) < agents
                && track.recent.len() <= RECENT_MAX
                && recent.all(|recent| is_channel(track.channel, recent.vector.len()))
        });
        views && tracks
    }
}

/// Whether a motion is longer than these \[m, rad\].
fn is_beyond(motion: &Isometry3<f64>, (length_m, angle_rad): (f64, f64)) -> bool {
    !crate::keyframes::life::is_within(motion, length_m, angle_rad)
}
