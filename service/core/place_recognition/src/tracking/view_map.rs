//! The views of a channel where a relaxed map has them, to compare later views with.

use nalgebra::{Isometry3, Point3};

use super::view_field::{About, ViewField};
use crate::descriptor::dot;
use crate::keyframes::SampleKey;
use crate::similarity::{LoggedView, Turned, gap};
use crate::tuning::{log, tracking as tuning};
use geometry::is_somewhere;
use state::{CorruptState, Counted, State, StateReader, StateWriter, state_of_struct};

/// Least length of a view beside its mean, of its own length: about rounding errors.
const LEAST: f32 = 1e-5;

/// What was learned of a channel when its views were last matched, with these views where the map
/// that was relaxed then has them: what another view says of where it was seen.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewMap {
    pub(crate) model: ViewModel,
    references: Vec<ReferenceView>,
    /// What views show about each of them: it follows from them.
    field: ViewField,
}

/// What was learned of the views of a channel.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ViewModel {
    pub(crate) channel: u8,
    /// Views are alike within it \[m\].
    pub(crate) range_m: f64,
    /// What a turn of the body changes.
    pub(crate) turned: Turned,
    /// Difference of the ordinals of neighbours.
    pub(crate) stride: u32,
    /// About what views are taken: those of most sessions, and those of long ones.
    pub(crate) centre: Vec<f32>,
    pub(crate) centres: Vec<SessionCentre>,
    /// The projection of a centred view on its components, one after the other.
    pub(crate) projection: Vec<f32>,
    /// r: the part of the variance of each component that is of the place.
    pub(crate) correlations: Vec<f64>,
}

/// The mean of the views of a long session.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SessionCentre {
    pub(crate) agent: u32,
    pub(crate) session: u32,
    pub(crate) mean: Vec<f32>,
}

/// A view that later ones are compared with.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ReferenceView {
    pub(crate) sample: SampleKey,
    pub(crate) ordinal: u32,
    pub(crate) stretch: u32,
    /// Pose of the body where the map has it; `None` if it lies in no map.
    pub(crate) pose: Option<Isometry3<f64>>,
    pub(crate) components: Vec<f32>,
}

/// A view that lies in the map, beside another one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Similar {
    /// Pose of the body that saw it, in the map.
    pub(crate) pose: Isometry3<f64>,
    /// Log of how much more probable the other one is there than anywhere \[nats\].
    pub(crate) log_likelihood: f64,
}

state_of_struct!(SessionCentre {
    agent,
    session,
    mean as Counted<u16>
});

state_of_struct!(ReferenceView {
    sample,
    ordinal,
    stretch,
    pose,
    components as Counted<u16>,
});

state_of_struct!(ViewModel {
    channel,
    range_m,
    turned,
    stride,
    centre as Counted<u16>,
    centres,
    projection,
    correlations as Counted<u16>,
});

impl State for ViewMap {
    fn write(&self, out: &mut StateWriter) {
        self.model.write(out);
        self.references.write(out);
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        Ok(Self::new(State::read(input)?, State::read(input)?))
    }
}

impl ViewMap {
    /// Of the views of a channel.
    pub(crate) fn new(model: ViewModel, references: Vec<ReferenceView>) -> Self {
        let mut map = Self {
            model,
            references,
            field: ViewField::default(),
        };
        map.fill_field();
        map
    }

    /// Number of the channel.
    pub fn channel(&self) -> u8 {
        self.model.channel
    }

    /// Puts its views where a map has them.
    pub fn locate(&mut self, pose: impl Fn(SampleKey) -> Option<Isometry3<f64>>) {
        for reference in &mut self.references {
            let there = pose(reference.sample);
            reference.pose = there.filter(|there| is_somewhere(&there.translation.vector));
        }
        self.fill_field();
    }

    /// The components of a view; `None` of one that shows nothing but what all show.
    pub(crate) fn components(&self, view: &LoggedView) -> Option<Vec<f32>> {
        self.model.components(view)
    }

    /// Bytes of memory that its views take.
    pub fn bytes(&self) -> usize {
        let numbers = self.model.centre.len() + self.model.projection.len();
        let components = 2 * self.model.correlations.len();
        let each = size_of::<ReferenceView>() + 4 * components;
        4 * numbers + self.references.len() * each
    }

    /// How probable a view is at each of those that lie within two corners of the map, and are far
    /// along the way.
    pub(crate) fn similar(
        &self,
        components: &[f32],
        view: &LoggedView,
        [low, high]: &[Point3<f64>; 2],
    ) -> Vec<Similar> {
        let seen = self.field.at(components);
        let similar = { self.references.iter().enumerate() }.filter_map(|(number, other)| {
            let pose = other.pose?;
            let position = Point3::from(pose.translation.vector);
            let is_within = low <= &position && &position <= high;
            (is_within && self.is_apart(other, view)).then(|| Similar {
                pose,
                log_likelihood: seen.log_likelihood(number, components),
            })
        });
        similar.collect()
    }

    fn is_apart(&self, other: &ReferenceView, view: &LoggedView) -> bool {
        let least = u32::try_from(gap(self.references.len())).unwrap_or(u32::MAX);
        let sample = view.sample;
        (other.sample.agent, other.sample.session, other.stretch)
            != (sample.agent, sample.session, view.stretch)
            || other.ordinal.abs_diff(view.ordinal) >= least.saturating_mul(self.model.stride)
    }

    fn fill_field(&mut self) {
        let correlations = &self.model.correlations;
        let mut field = ViewField::new(correlations);
        let width = (tuning::WIDTH * self.model.range_m, &self.model.turned);
        for reference in &self.references {
            let others = { self.references.iter() }
                .filter_map(|other| Some((other.pose.as_ref()?, other.components.as_slice())));
            let about = match &reference.pose {
                Some(at) => About::of(at, width, correlations.len(), others),
                None => About::nothing(correlations.len()),
            };
            field.push(&about, correlations);
        }
        self.field = field;
    }

    /// Whether one that was read from a checkpoint is one: `length` is that of the views of its
    /// channel, as they are logged.
    pub(crate) fn is_sound(&self, length: Option<usize>) -> bool {
        let n = self.model.correlations.len();
        let is_reference = |one: &ReferenceView| {
            let is_there = |at: &Isometry3<f64>| {
                is_somewhere(&at.translation.vector)
                    && at.rotation.coords.iter().all(|x| x.is_finite())
            };
            one.pose.as_ref().is_none_or(is_there) && is_whole(&one.components, n)
        };
        length.is_some_and(|length| self.model.is_sound(length))
            && self.references.len() <= log::VIEWS_MAX
            && self.references.iter().all(is_reference)
    }
}

impl ViewModel {
    fn components(&self, view: &LoggedView) -> Option<Vec<f32>> {
        let of = (view.sample.agent, view.sample.session);
        let own = self
            .centres
            .iter()
            .find(|one| (one.agent, one.session) == of);
        let centre = own.map_or(&self.centre, |own| &own.mean);
        let centred: Vec<f32> = { view.vector.iter() }
            .zip(centre)
            .map(|(number, mean)| number - mean)
            .collect();
        let columns = self.projection.chunks_exact(centred.len().max(1));
        let mut components: Vec<f32> = columns.map(|column| dot(column, &centred)).collect();
        let length = dot(&components, &components).sqrt();
        // What is left of a view that is as its mean is rounding errors.
        let centred = dot(&centred, &centred).sqrt();
        let is_shown = centred > LEAST * dot(&view.vector, &view.vector).sqrt();
        if !(is_shown && length.is_normal()) {
            return None;
        }
        #[expect(clippy::cast_precision_loss, reason = "at most some hundreds")]
        let factor = (components.len() as f32).sqrt() / length;
        for component in &mut components {
            *component *= factor;
        }
        { components.iter() }
            .all(|component| component.is_finite())
            .then_some(components)
    }

    fn is_sound(&self, length: usize) -> bool {
        self.stride > 0
            && self.range_m.is_finite()
            && self.range_m > 0.0
            && self.turned.is_sound()
            && is_whole(&self.centre, length)
            && { self.centres.iter() }.all(|one| is_whole(&one.mean, length))
            && is_whole(&self.projection, self.correlations.len() * length)
            && { self.correlations.iter() }.all(|r| (0.0..1.0).contains(r))
    }
}

fn is_whole(numbers: &[f32], count: usize) -> bool {
    numbers.len() == count && numbers.iter().all(|number| number.is_finite())
}
