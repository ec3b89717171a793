//! The memory of views, and the sequence matches among them.

use nalgebra::{Isometry3, Point3};

use super::sequence_match::SequenceMatch;
use super::track::ViewTrack;
use super::view_index::ViewIndex;
use crate::descriptor::angle_rad;
use crate::keyframes::SampleKey;
use crate::similarity::{LoggedView, ViewLog, logged};
use crate::tuning::memory as tuning;
use crate::view::View;
use crate::views::{ChannelModel, Distance, Kernel, Pairs, SimilarView, StoredView};
use state::{Codec, CorruptState, Counted, PagedVec, State, StateReader, StateWriter};

/// The remembered views of all agents.
#[derive(Clone, Debug, Default)]
pub(crate) struct ViewMemory {
    pub(crate) channels: Vec<ChannelModel>,
    pub(crate) tracks: PagedVec<ViewTrack, 1>,
    pub(crate) stored: PagedVec<StoredView, 16>,
    /// Where to look for them; derived.
    index: ViewIndex,
    /// Numbers in all descriptors.
    numbers: u64,
    /// All views of agents of the map.
    pub(crate) log: ViewLog,
    /// Times that views were renumbered.
    pub(crate) thinnings: u64,
    /// The view that was added last, whether the log keeps it or not, until it is taken: no part
    /// of the state, since it is taken with the record that brings it.
    pub(crate) taken: Option<LoggedView>,
}

impl ViewMemory {
    /// Remembers a view; answers the sequence matches that end with it.
    pub(crate) fn add(&mut self, view: &View<'_>, revision: u64) -> Vec<SequenceMatch> {
        self.taken = None;
        let vector = view.vector;
        let Some(channel) = self.channel_of(view) else {
            return Vec::new();
        };
        let at = self.track(view.sample, channel, revision);
        let Some(track) = self.tracks.get_mut(at, revision) else {
            return Vec::new();
        };
        let has_moved = track
            .last
            .is_none_or(|last| is_beyond(&last.inv_mul(&view.in_odom), tuning::MOVED));
        if !has_moved {
            return Vec::new();
        }
        track.last = Some(view.in_odom);
        let (ordinal, stretch) = (track.logged, track.stretch);
        track.logged = track.logged.saturating_add(1);
        let seen = LoggedView {
            channel,
            sample: view.sample,
            ordinal,
            stretch,
            in_odom: view.in_odom,
            vector: logged(vector),
        };
        self.taken = Some(seen.clone());
        self.log.add(seen, revision);
        let model = &mut self.channels[usize::from(channel)];
        let (mut is_news, mut is_outlier) = (true, None);
        for (index, recent) in track.recent.iter().enumerate() {
            let angle_rad = angle_rad(&recent.vector, vector);
            let way = recent.in_odom.inv_mul(&view.in_odom);
            let distance_m = way.translation.vector.norm();
            model.learn(view.sample.agent, angle_rad, distance_m);
            if index + 1 == track.recent.len() {
                is_news = angle_rad > model.news_rad() && is_beyond(&way, tuning::STEP);
            }
            if model
                .reach_m()
                .is_some_and(|reach_m| distance_m < tuning::BESIDE * reach_m)
            {
                let is_unlike = model.distance(angle_rad).is_none();
                is_outlier = Some(is_unlike && is_outlier.unwrap_or(true));
            }
        }
        if !is_news || is_outlier == Some(true) {
            return Vec::new();
        }
        track.note(&view.in_odom, vector);
        let stored = StoredView {
            channel,
            sample: view.sample,
            ordinal: track.next,
            in_odom: view.in_odom,
            in_map: view.position(),
            spread: view.spread(),
            vector: vector.into(),
        };
        track.next = track.next.saturating_add(1);
        let (similar, is_known) = self.similar_earlier(&stored);
        let over = self.extend_matches(at, &stored, &similar, revision);
        if !is_known {
            self.remember(stored, revision);
        }
        over
    }

    /// An agent was put somewhere else: what it sees from now on is not beside what it saw.
    pub(crate) fn cut(&mut self, agent: u32, revision: u64) {
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
                track.matches.clear();
                track.next = track.next.saturating_add(tuning::APART);
                track.stretch = track.stretch.saturating_add(1);
            }
        }
    }

    /// The similar earlier views, by number, with their distances; and whether one of them makes
    /// the view redundant.
    ///
    /// A few of a channel are all compared. What unrelated views are like is learned from the
    /// coarse copies of some of many, spread evenly, others with each view, and each for as many as
    /// are not. Of the rest only those are looked at that may be similar.
    fn similar_earlier(&mut self, view: &StoredView) -> (Vec<(usize, Distance)>, bool) {
        let model = &mut self.channels[usize::from(view.channel)];
        let earliest = view.ordinal.saturating_sub(tuning::EARLIER);
        let is_recent = |number: &usize| self.index.is_recent(*number, &view.sample, earliest);
        let mut similar = Vec::new();
        let mut is_known = false;
        let mut note = |model: &ChannelModel, number: usize, other: &StoredView, angle_rad: f64| {
            if let Some(distance) = model.distance(angle_rad) {
                // A similar view somewhere else does not make it redundant.
                let apart_m = (other.in_map - view.in_map).norm();
                let unsure_m = tuning::APART_SD * other.spread[0].hypot(view.spread[0]);
                is_known |= angle_rad < model.news_rad() && apart_m <= distance.mean_m + unsure_m;
                similar.push((number, distance));
            }
        };
        let count = self.index.count(view.channel);
        if count <= tuning::COMPARED {
            let of_channel = self.index.of_channel(view.channel);
            for number in of_channel.filter(|number| !is_recent(number)) {
                let Some(other) = self.stored.get(number) else {
                    continue;
                };
                let angle_rad = angle_rad(&other.vector, &view.vector);
                model.learn_unrelated(angle_rad, Pairs::ONE);
                note(model, number, other, angle_rad);
            }
        } else if let Some(copies) = self.index.copies(view.channel) {
            let stride = count.div_ceil(tuning::DRAWN);
            let pairs = Pairs::new(stride);
            let first = view.ordinal as usize % stride;
            for (number, angle_rad) in copies.angles_rad(&view.vector, first, stride) {
                if !is_recent(&number) {
                    model.learn_unrelated(angle_rad, pairs);
                }
            }
            let cosine = model.similar_cosine();
            let alike = cosine.map(|cosine| copies.alike(&view.vector, cosine, 0));
            let alike = alike.into_iter().flatten();
            for number in alike.filter(|number| !is_recent(number)) {
                if let Some(other) = self.stored.get(number) {
                    let angle_rad = angle_rad(&other.vector, &view.vector);
                    note(model, number, other, angle_rad);
                }
            }
        }
        if similar.len() > tuning::SIMILAR_MAX {
            similar.sort_by(|a, b| a.1.mean_m.total_cmp(&b.1.mean_m).then(a.0.cmp(&b.0)));
            similar.truncate(tuning::SIMILAR_MAX);
            similar.sort_by_key(|(number, _)| *number);
        }
        (similar, is_known)
    }

    /// Adds a view and its similar views to the sequence matches of a track; answers those that are
    /// complete.
    fn extend_matches(
        &mut self,
        track: usize,
        view: &StoredView,
        similar: &[(usize, Distance)],
        revision: u64,
    ) -> Vec<SequenceMatch> {
        let Some(track) = self.tracks.get_mut(track, revision) else {
            return Vec::new();
        };
        let mut is_met = vec![false; track.matches.len()];
        for &(number, distance) in similar {
            let Some(other) = self.stored.get(number) else {
                continue;
            };
            let known = track
                .matches
                .iter()
                .position(|matched| matched.leads_to(other));
            match known {
                Some(index) => {
                    is_met[index] = true;
                    track.matches[index].add(view, other, distance);
                }
                None if track.matches.len() < tuning::MATCHES_MAX => {
                    is_met.push(true);
                    track
                        .matches
                        .push(SequenceMatch::new(view, other, distance));
                }
                None => {}
            }
        }
        for (matched, is_met) in track.matches.iter_mut().zip(is_met) {
            if !is_met {
                matched.miss();
            }
        }
        let (over, open) = std::mem::take(&mut track.matches)
            .into_iter()
            .partition::<Vec<_>, _>(SequenceMatch::is_over);
        track.matches = open;
        let telling = over.into_iter().filter(SequenceMatch::is_telling);
        let last = track.next.saturating_sub(1);
        telling
            .map(|mut matched| {
                let count = last.saturating_sub(matched.first_now()) as usize + 1;
                let from = track.recent.len().saturating_sub(count);
                matched.queries = track.recent[from..].to_vec();
                matched
            })
            .collect()
    }

    /// Remembers a view; every second one is forgotten when there is no room for it.
    fn remember(&mut self, view: StoredView, revision: u64) {
        self.numbers += view.vector.len() as u64;
        self.index.push(&view, revision);
        self.stored.push(view, revision);
        if self.stored.len() <= tuning::VIEWS_MAX && self.numbers <= tuning::NUMBERS_MAX as u64 {
            return;
        }
        self.compact(0, revision, |mut view| {
            // Neighbours still have consecutive ordinals.
            let is_kept = view.ordinal.is_multiple_of(2);
            view.ordinal /= 2;
            is_kept.then_some(view)
        });
        for number in 0..self.tracks.len() {
            if let Some(track) = self.tracks.get_mut(number, revision) {
                track.next = track.next.div_ceil(2);
                track.matches.clear();
            }
        }
    }

    /// Forgets what an agent saw in a session, from a sample on.
    pub(crate) fn forget_since(&mut self, since: SampleKey, revision: u64) {
        self.log.forget_since(since, revision);
        let is_gone = |view: &StoredView| view.is_since(since);
        let Some(first) = self.stored.iter().position(is_gone) else {
            return;
        };
        self.compact(first, revision, |view| (!is_gone(&view)).then_some(view));
    }

    /// Replaces the views from a number on by what `kept` makes of each, and closes the gaps that
    /// it leaves.
    fn compact(
        &mut self,
        first: usize,
        revision: u64,
        kept: impl Fn(StoredView) -> Option<StoredView>,
    ) {
        let mut next = first;
        for number in first..self.stored.len() {
            let view = self.stored.get(number).cloned();
            let Some(view) = view.and_then(&kept) else {
                continue;
            };
            if let Some(slot) = self.stored.get_mut(next, revision) {
                *slot = view;
            }
            next += 1;
        }
        while self.stored.len() > next {
            self.stored.pop(revision);
        }
        // Later views have changed their numbers.
        self.thinnings += 1;
        self.derive(revision);
    }

    /// Derives what follows from the stored views.
    fn derive(&mut self, revision: u64) {
        let views = self.stored.iter();
        self.numbers = views.map(|view| view.vector.len() as u64).sum();
        self.index = ViewIndex::of(self.stored.iter(), revision);
    }

    /// The number of a descriptor's channel; a new one if there is room for it.
    fn channel_of(&mut self, view: &View<'_>) -> Option<u8> {
        let dimension = u16::try_from(view.vector.len()).ok()?;
        self.known_channel(view).or_else(|| {
            if self.channels.len() >= tuning::CHANNELS_MAX {
                return None;
            }
            let model = ChannelModel::new(view.channel.into(), dimension);
            self.channels.push(model);
            u8::try_from(self.channels.len() - 1).ok()
        })
    }

    /// The number of the track of an agent on a channel, in its present session.
    fn track(&mut self, sample: SampleKey, channel: u8, revision: u64) -> usize {
        let known = self
            .tracks
            .iter()
            .position(|track| track.agent == sample.agent && track.channel == channel);
        let Some(number) = known else {
            self.tracks.push(
                ViewTrack::new(sample.agent, channel, sample.session),
                revision,
            );
            return self.tracks.len() - 1;
        };
        if let Some(track) = self.tracks.get_mut(number, revision)
            && track.session != sample.session
        {
            *track = ViewTrack::new(sample.agent, channel, sample.session);
        }
        number
    }

    /// Bytes of memory that it takes.
    pub(crate) fn bytes(&self) -> usize {
        let numbers = usize::try_from(self.numbers).unwrap_or(usize::MAX);
        let recent = self.tracks.iter().map(|track| {
            let numbers = track.recent.iter().map(|recent| recent.vector.len());
            numbers.sum::<usize>()
        });
        let recent: usize = recent.sum();
        let pages = self.stored.bytes() + self.tracks.bytes() + self.log.bytes();
        pages + self.index.bytes() + 4 * (numbers + recent)
    }

    pub(crate) fn write_head(&self, out: &mut StateWriter) {
        Counted::<u64>::write(&self.channels, out);
        self.thinnings.write(out);
    }

    /// Reads what [`write_head`](Self::write_head) wrote, after all pages.
    pub(crate) fn read_head(
        &mut self,
        input: &mut StateReader<'_>,
        revision: u64,
    ) -> Result<(), CorruptState> {
        self.channels = Counted::<u64>::read(input)?;
        self.thinnings = State::read(input)?;
        self.derive(revision);
        Ok(())
    }

    /// The similar views from a number on, the most similar first.
    pub(crate) fn similar_views(
        &self,
        channel: u8,
        vector: &[f32],
        from: usize,
        is_left_out: impl Fn(&StoredView) -> bool,
    ) -> Vec<SimilarView> {
        let model = self.channels.get(usize::from(channel));
        let cosine = model.and_then(ChannelModel::similar_cosine);
        let copies = self.index.copies(channel);
        let alike =
            { copies.zip(cosine) }.map(|(copies, cosine)| copies.alike(vector, cosine, from));
        let mut similar: Vec<SimilarView> = { alike.into_iter().flatten() }
            .filter_map(|number| self.stored.get(number))
            .filter(|view| !is_left_out(view))
            .filter_map(|view| {
                Some(SimilarView {
                    sample: view.sample,
                    distance: self.distance(channel, angle_rad(&view.vector, vector))?,
                })
            })
            .collect();
        similar.sort_by(|a, b| a.distance.mean_m.total_cmp(&b.distance.mean_m));
        similar.truncate(tuning::SIMILAR_MAX);
        similar
    }

    /// The views that were stored within the corners of a box \[m\], and some beside it, in order.
    pub(crate) fn within(&self, corners: [Point3<f64>; 2]) -> impl Iterator<Item = &StoredView> {
        let numbers = self.index.within(corners);
        numbers.filter_map(|number| self.stored.get(number))
    }

    /// The views of the earlier stretch of a match, or beside it, in order.
    pub(crate) fn beside(&self, matched: &SequenceMatch) -> impl Iterator<Item = &StoredView> {
        let numbers = self.index.among(matched.ordinals());
        let views = numbers.filter_map(|number| self.stored.get(number));
        views.filter(|view| matched.is_beside(view))
    }

    /// Whether two views of a channel are more similar than unrelated ones.
    pub(crate) fn is_similar(&self, channel: u8, one: &[f32], other: &[f32]) -> bool {
        self.distance(channel, angle_rad(one, other)).is_some()
    }

    /// The distance between two views of a channel, if they are similar.
    pub(crate) fn distance(&self, channel: u8, angle_rad: f64) -> Option<Distance> {
        self.channels.get(usize::from(channel))?.distance(angle_rad)
    }

    /// The kernel of a channel, once it is known.
    pub(crate) fn kernel(&self, channel: u8) -> Option<Kernel> {
        self.channels.get(usize::from(channel))?.kernel()
    }

    /// Reach of a channel \[m\], once it is known.
    pub(crate) fn reach_m(&self, channel: u8) -> Option<f64> {
        self.channels.get(usize::from(channel))?.reach_m()
    }

    /// The number of a descriptor's channel, if anything was remembered of it.
    pub(crate) fn known_channel(&self, view: &View<'_>) -> Option<u8> {
        let dimension = u16::try_from(view.vector.len()).ok()?;
        let known = self
            .channels
            .iter()
            .position(|channel| channel.dimension == dimension && &*channel.name == view.channel)?;
        u8::try_from(known).ok()
    }

    /// Whether a channel has views of so many numbers.
    pub(crate) fn is_channel(&self, channel: u8, length: usize) -> bool {
        let model = self.channels.get(usize::from(channel));
        model.is_some_and(|model| usize::from(model.dimension) == length)
    }

    /// Numbers of a view of a channel, as it is logged.
    pub(crate) fn logged_length(&self, channel: u8) -> Option<usize> {
        let model = self.channels.get(usize::from(channel))?;
        Some(usize::from(model.dimension).min(crate::tuning::log::NUMBERS_MAX))
    }

    /// Whether everything that it names is there, and all views of a channel are of one length.
    pub(crate) fn is_sound(&self, agents: usize) -> bool {
        let is_channel = |channel: u8, length: usize| self.is_channel(channel, length);
        let views = self.stored.iter().all(|view| {
            (view.sample.agent as usize) < agents && is_channel(view.channel, view.vector.len())
        });
        let tracks = self.tracks.iter().all(|track| {
            let mut recent = track.recent.iter();
            (track.agent as usize) < agents
                && track.recent.len() <= crate::tuning::track::RECENT_MAX
                && recent.all(|recent| is_channel(track.channel, recent.vector.len()))
        });
        let length = |channel: u8| {
            let model = self.channels.get(usize::from(channel))?;
            Some(usize::from(model.dimension))
        };
        views && tracks && self.log.is_sound(agents, length)
    }
}

/// Whether a motion is longer than these \[m, rad\].
fn is_beyond(motion: &Isometry3<f64>, (length_m, angle_rad): (f64, f64)) -> bool {
    !geometry::is_within(motion, length_m, angle_rad)
}

#[cfg(test)]
mod tests;
