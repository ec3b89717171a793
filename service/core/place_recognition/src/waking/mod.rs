//! Waking up by coarse views: where among the cells of a large map an agent is.

mod cells;
mod claims;
mod index;
mod logistic;
mod mode;
mod model;
mod particle;
mod particles;
mod tiles;

use geometry::PoseCovariance;
use nalgebra::Isometry3;
use state::{
    CorruptState, Counted, ITEMS_MAX, PagedVec, State, StateReader, StateWriter, read_list,
    state_of_struct, write_list,
};

use crate::keyframes::SampleKey;
use crate::similarity::logged;
use crate::tuning::log::NUMBERS_MAX;
use crate::tuning::waking as tuning;
use crate::view::{SensedTurn, View};
use crate::views::ShortText;
use cells::{Alike, Cells, key_of};
use claims::Claims;
use mode::Mode;
use model::CellModel;
use particles::{Filter, Moved};

/// A channel of views.
#[derive(Clone, Debug)]
struct Channel {
    name: Box<str>,
    dimension: u16,
    model: CellModel,
    claims: Claims,
    /// Mean cosine of views that were taken apart.
    alike: f64,
    /// Views so far.
    n_seen: u32,
}

state_of_struct!(Channel {
    name as ShortText,
    dimension,
    model,
    claims,
    alike,
    n_seen
});

/// A view that waits until it is added to the cells, so that an agent is not compared with what it
/// saw just before.
#[derive(Clone, Debug)]
pub(crate) struct Waiting {
    channel: u8,
    agent: u32,
    at: nalgebra::Point3<f64>,
    weight: f32,
    vector: Box<[f32]>,
}

state_of_struct!(Waiting { channel, agent, at, weight, vector as Counted<u16> });

/// Where an agent is that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Pose of the body in the map.
    pub pose: Isometry3<f64>,
    /// Covariance of the error on its right.
    pub covariance: PoseCovariance,
}

/// Mean views of cells, what they say, and the filters of agents that do not know where they are.
#[derive(Clone, Debug, Default)]
pub(crate) struct Waking {
    channels: Vec<Channel>,
    pub(crate) cells: Cells,
    pub(crate) waiting: PagedVec<Waiting, 16>,
    /// The oldest of those that wait.
    oldest: u32,
    pub(crate) filters: PagedVec<Filter, 1>,
}

impl Waking {
    /// Learns from the view of an agent that knows where it is.
    pub(crate) fn teach(&mut self, view: &View<'_>, turn: Option<SensedTurn>, revision: u64) {
        let diagonal = view.covariance.matrix().diagonal();
        let sd_m = diagonal.fixed_rows::<3>(0).max().max(0.0).sqrt();
        if sd_m > tuning::SD_M_MAX {
            return;
        }
        let Some(channel) = self.channel_of(view) else {
            return;
        };
        let Some(vector) = unit(view.vector) else {
            return;
        };
        let at = view.position();
        let known = &mut self.channels[usize::from(channel)];
        known.n_seen = known.n_seen.wrapping_add(1);
        let tells_little = known.model.n_views >= tuning::VIEWS_MIN && !known.model.is_telling();
        if tells_little && !known.n_seen.is_multiple_of(tuning::TRIED) {
            return;
        }
        let alike = self.cells.alike(channel, &vector);
        let own = self.cells.find(channel, key_of(&at));
        known.model.learn(&alike, own);
        if known.model.is_telling() && sd_m <= tuning::SHADOW_SD_M_MAX {
            self.shadow(view, turn, (channel, &alike), revision);
        }
        #[expect(clippy::cast_possible_truncation, reason = "a weight")]
        let weight = (1.0 / (1.0 + (sd_m / tuning::SURE_M).powi(2))) as f32;
        self.push(
            Waiting {
                channel,
                agent: view.sample.agent,
                at,
                weight,
                vector,
            },
            revision,
        );
    }

    /// Puts a view in line, and adds the oldest one to the cells.
    fn push(&mut self, view: Waiting, revision: u64) {
        if self.waiting.len() < tuning::WAITING {
            self.waiting.push(view, revision);
            return;
        }
        let Some(slot) = self.waiting.get_mut(self.oldest as usize, revision) else {
            return;
        };
        let channel = view.channel;
        let oldest = std::mem::replace(slot, view);
        if oldest.channel == channel {
            let newest = self.waiting.get(self.oldest as usize);
            let cosine = newest.map_or(0.0, |newest| crate::dot(&oldest.vector, &newest.vector));
            let known = &mut self.channels[usize::from(channel)];
            known.alike += (f64::from(cosine) - known.alike) * tuning::ALIKE_RATE;
        }
        self.oldest = (self.oldest + 1) % u32::try_from(tuning::WAITING).unwrap_or(1);
        if self.channels[usize::from(oldest.channel)].alike < tuning::ALIKE_MAX {
            let seen = (&*oldest.vector, oldest.weight);
            self.cells.add(oldest.channel, &oldest.at, seen, revision);
        }
    }

    /// Finds out with an agent that knows where it is how often a claim would be right.
    fn shadow(
        &mut self,
        view: &View<'_>,
        turn: Option<SensedTurn>,
        (channel, alike): (u8, &[Alike]),
        revision: u64,
    ) {
        let Some(number) = self.shadow_of(view.sample, channel, revision) else {
            return;
        };
        let Some(filter) = self.filters.get_mut(number, revision) else {
            return;
        };
        let known = &mut self.channels[usize::from(channel)];
        filter.seen_at = known.n_seen;
        let scores = known.model.scores(alike);
        filter.step(&Moved::of(view, turn), &scores, &self.cells);
        if let Some(mode) = filter.mode(&self.cells) {
            note_alike(filter, &mode, alike, &self.cells);
            known.claims.learn(filter, &mode, &view.pose);
        }
    }

    /// The number of the shadow of an agent: its own one while that lasts, a while later another
    /// one, so that an agent that explores alone shows as much as many do. `None` where there are
    /// none to spare.
    fn shadow_of(&mut self, sample: SampleKey, channel: u8, revision: u64) -> Option<usize> {
        let waited = |filter: &Filter| {
            let known = self.channels.get(usize::from(filter.channel));
            known.is_some_and(|known| {
                let waits = tuning::SHADOW_WAITS[usize::from(known.claims.are_many())];
                known.n_seen.wrapping_sub(filter.seen_at) > waits
            })
        };
        let is_over = |filter: &Filter| filter.n_views >= tuning::SHADOW_VIEWS;
        let new = Filter::new(sample, channel, true);
        let is_own = |filter: &Filter| {
            (filter.agent, filter.session, filter.channel) == (new.agent, new.session, new.channel)
        };
        let shadows = || {
            let filters = self.filters.iter().enumerate();
            filters.filter(|(_, filter)| filter.is_shadow)
        };
        let own = shadows().find(|(_, filter)| is_own(filter));
        match own {
            Some((number, filter)) if !is_over(filter) => return Some(number),
            Some((_, filter)) if !waited(filter) => return None,
            _ => (),
        }
        let is_free = |filter: &Filter| is_over(filter) || waited(filter);
        let free = own.or_else(|| shadows().find(|(_, filter)| is_free(filter)));
        let free = free.map(|(number, _)| number);
        let count = shadows().count();
        if let Some(number) = free {
            *self.filters.get_mut(number, revision)? = new;
            return Some(number);
        }
        (count < tuning::SHADOWS_MAX).then(|| {
            self.filters.push(new, revision);
            self.filters.len() - 1
        })
    }

    /// A view of an agent that does not know where it is; answers where, once that is sure.
    pub(crate) fn seek(
        &mut self,
        view: &View<'_>,
        turn: Option<SensedTurn>,
        revision: u64,
    ) -> Option<Found> {
        if !self.is_sought_by(view) {
            return None;
        }
        let channel = self.known_channel(view)?;
        let known = self.channels.get(usize::from(channel))?;
        let vector = unit(view.vector)?;
        let alike = self.cells.alike(channel, &vector);
        let scores = known.model.scores(&alike);
        let sample = view.sample;
        let own = { self.filters.iter() }
            .position(|filter| !filter.is_shadow && filter.agent == sample.agent);
        let number = own.unwrap_or_else(|| {
            self.filters
                .push(Filter::new(sample, channel, false), revision);
            self.filters.len() - 1
        });
        let filter = self.filters.get_mut(number, revision)?;
        if filter.session != sample.session || filter.channel != channel {
            *filter = Filter::new(sample, channel, false);
        }
        if filter.has_claimed && filter.n_views >= tuning::FOLLOWED {
            return None;
        }
        filter.step(&Moved::of(view, turn), &scores, &self.cells);
        let mode = filter.mode(&self.cells)?;
        note_alike(filter, &mode, &alike, &self.cells);
        let covariance = known.claims.claim(filter, &mode)?;
        Some(Found {
            pose: mode.pose,
            covariance,
        })
    }

    /// Whether agents that do not know where they are are sought among the cells by these views.
    pub(crate) fn is_sought_by(&self, view: &View<'_>) -> bool {
        let Some(channel) = self.known_channel(view) else {
            return false;
        };
        self.channels[usize::from(channel)].model.is_telling()
            && self.is_best(channel)
            && self.cells.has_at_least(channel, tuning::CELLS_LARGE)
    }

    /// Whether an agent was found and is still followed.
    pub(crate) fn is_following(&self, agent: u32, session: u32) -> bool {
        self.filters.iter().any(|filter| {
            !filter.is_shadow
                && (filter.agent, filter.session) == (agent, session)
                && filter.has_claimed
        })
    }

    /// Ends the search of an agent.
    pub(crate) fn end(&mut self, agent: u32, revision: u64) {
        let own = { self.filters.iter() }
            .position(|filter| !filter.is_shadow && filter.agent == agent && filter.n_views > 0);
        if let Some(filter) = own.and_then(|own| self.filters.get_mut(own, revision)) {
            let sample = SampleKey {
                agent,
                session: filter.session,
                seq: 0,
            };
            *filter = Filter::new(sample, filter.channel, false);
        }
    }

    /// Whether everything that it names is there, among so many agents.
    pub(crate) fn is_sound(&self, agents: usize) -> bool {
        let length = |channel: u8| {
            let channel = self.channels.get(usize::from(channel))?;
            Some(usize::from(channel.dimension).min(NUMBERS_MAX))
        };
        let mut waiting = self.waiting.iter();
        let mut filters = self.filters.iter();
        self.channels.len() <= tuning::CHANNELS_MAX
            && self.waiting.len() <= tuning::WAITING
            && (self.oldest as usize) < tuning::WAITING
            && self.cells.are_sound(length)
            && waiting.all(|view| {
                (view.agent as usize) < agents && length(view.channel) == Some(view.vector.len())
            })
            && filters.all(|filter| filter.is_sound(agents, self.channels.len()))
    }

    /// Whether nothing was taught.
    pub(crate) fn is_empty(&self) -> bool {
        self.channels.is_empty()
    }

    /// Writes what is in no page.
    pub(crate) fn write_head(&self, out: &mut StateWriter) {
        write_list(self.channels.iter(), out);
        self.oldest.write(out);
    }

    /// Reads what [`write_head`](Self::write_head) wrote, after all pages.
    pub(crate) fn read_head(
        &mut self,
        input: &mut StateReader<'_>,
        revision: u64,
    ) -> Result<(), CorruptState> {
        self.channels = read_list(input, ITEMS_MAX)?;
        self.oldest = State::read(input)?;
        self.cells.rebuild(revision);
        Ok(())
    }

    /// Whether no other channel tells more.
    fn is_best(&self, channel: u8) -> bool {
        let told = |channel: &Channel| channel.model.told;
        let own = self.channels.get(usize::from(channel)).map_or(0.0, told);
        self.channels.iter().all(|other| told(other) <= own)
    }

    fn known_channel(&self, view: &View<'_>) -> Option<u8> {
        let found = self.channels.iter().position(|channel| {
            *channel.name == *view.channel && usize::from(channel.dimension) == view.vector.len()
        });
        u8::try_from(found?).ok()
    }

    fn channel_of(&mut self, view: &View<'_>) -> Option<u8> {
        self.known_channel(view).or_else(|| {
            if self.channels.len() >= tuning::CHANNELS_MAX {
                return None;
            }
            self.channels.push(Channel {
                name: view.channel.into(),
                dimension: u16::try_from(view.vector.len()).ok()?,
                model: CellModel::default(),
                claims: Claims::default(),
                alike: 0.0,
                n_seen: 0,
            });
            u8::try_from(self.channels.len() - 1).ok()
        })
    }

    /// Bytes of memory that it takes.
    pub(crate) fn bytes(&self) -> usize {
        let waiting: usize = self.waiting.iter().map(|view| 4 * view.vector.len()).sum();
        let filters: usize = self.filters.iter().map(Filter::bytes).sum();
        self.cells.bytes() + self.waiting.bytes() + waiting + self.filters.bytes() + filters
    }
}

/// Notes how alike a view is where the agent is estimated to be, and anywhere.
fn note_alike(filter: &mut Filter, mode: &Mode, alike: &[Alike], cells: &Cells) {
    let at = key_of(&mode.pose.translation.vector.into());
    let number = cells.find(filter.channel, at);
    let here = number.and_then(|number| {
        let at = alike
            .binary_search_by_key(&number, |alike| alike.cell)
            .ok()?;
        Some(f64::from(alike[at].features[0]))
    });
    let most = alike.iter().map(|alike| alike.features[0]);
    let most = f64::from(most.fold(0.0, f32::max));
    let rate = (1.0 / f64::from(filter.n_views.max(1))).max(tuning::ALIKE_LATELY);
    filter.alike[0] += (here.unwrap_or(0.0) - filter.alike[0]) * rate;
    filter.alike[1] += (most - here.unwrap_or(0.0) - filter.alike[1]) * rate;
}

/// A view as cells have it: projected, of length 1.
fn unit(vector: &[f32]) -> Option<Box<[f32]>> {
    let mut vector = logged(vector);
    let length = crate::dot(&vector, &vector).sqrt();
    if !(length > 0.0 && length.is_finite()) {
        return None;
    }
    for number in &mut vector {
        *number /= length;
    }
    Some(vector)
}
