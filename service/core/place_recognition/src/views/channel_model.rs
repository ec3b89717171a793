//! What the similarity of two views says of the distance between them.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::tuning::channel as tuning;
use state::{
    Codec, CorruptState, Moments, State, StateReader, StateWriter, Teachers, state_of_struct,
};

/// Kernel of a channel: the expected cosine of two views at a distance d is c exp(−d² / 2ℓ²).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Kernel {
    /// c: cosine of two views of one place.
    pub(crate) cosine: f64,
    /// ℓ: length scale \[m\].
    pub(crate) length_m: f64,
    /// Effective dimension n: the cosines of unrelated views have standard deviation 1/√n.
    pub(crate) numbers: f64,
}

/// The statistics of a channel: distance by angle, and the angle of unrelated views.
#[derive(Clone, Debug)]
pub(crate) struct ChannelModel {
    pub(crate) name: Box<str>,
    pub(crate) dimension: u16,
    /// Distances of the pairs of each class \[m\].
    distances_m: [Moments; tuning::CLASSES],
    /// Angles between unrelated views \[rad\].
    unrelated: Moments,
    /// Who teaches the distances.
    teachers: Teachers,
}

/// Pairs of views that one pair stands for.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pairs {
    /// Part that they leave of what was learned before.
    kept: f64,
    /// What they count for together.
    weight: f64,
}

impl Pairs {
    const KEPT: f64 = 1.0 - 1.0 / tuning::UNRELATED;

    /// A pair that stands for itself.
    pub(crate) const ONE: Self = Self {
        kept: Self::KEPT,
        weight: 1.0,
    };

    /// So many, one at least: each fades those before.
    pub(crate) fn new(count: usize) -> Self {
        let kept = (1..count).fold(Self::KEPT, |kept, _| kept * Self::KEPT);
        let weight = (1.0 - kept) / (1.0 - Self::KEPT);
        Self { kept, weight }
    }
}

/// A distance with its standard deviation \[m\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Distance {
    pub(crate) mean_m: f64,
    pub(crate) sd_m: f64,
}

impl ChannelModel {
    /// A channel without statistics.
    pub(crate) fn new(name: Box<str>, dimension: u16) -> Self {
        Self {
            name,
            dimension,
            distances_m: [Moments::default(); tuning::CLASSES],
            unrelated: Moments::default(),
            teachers: Teachers::default(),
        }
    }

    /// Learns from two views of an agent whose distance is known from its motion. One that is much
    /// farther than views so alike are does not count if it is one agent's word against that of
    /// others: its odometry may be in another unit, or its sensor stuck.
    pub(crate) fn learn(&mut self, agent: u32, angle_rad: f64, distance_m: f64) {
        let number = class_of(angle_rad);
        let is_usual = !self.is_far(number, distance_m);
        let Some(class) = self.distances_m.get_mut(number) else {
            return;
        };
        if self.teachers.hear(agent, is_usual) {
            class.fade(1.0 - 1.0 / tuning::PAIRS);
            class.add(distance_m, 1.0);
        }
    }

    /// Whether views as alike as those of a class are known to be much nearer, and so are all that
    /// are less alike.
    fn is_far(&self, class: usize, distance_m: f64) -> bool {
        let known = self.distances_m.iter().skip(class);
        let known = known.filter(|class| class.count() >= tuning::USUAL_MIN);
        let most_m = known.map(|class| {
            let sd_m = class.sd().max(tuning::SD_M_MIN);
            tuning::FAR * (class.mean() + 3.0 * sd_m)
        });
        { most_m.reduce(f64::max) }.is_some_and(|most_m| distance_m > most_m)
    }

    /// Learns from two views that are far from one another along the way, which stand for some
    /// pairs: they count as if each of these had the angle.
    pub(crate) fn learn_unrelated(&mut self, angle_rad: f64, pairs: Pairs) {
        let unrelated = &mut self.unrelated;
        let is_known = unrelated.count() >= tuning::UNRELATED_MIN;
        if is_known && angle_rad < unrelated.mean() - tuning::RELATED * unrelated.sd() {
            return;
        }
        unrelated.fade(pairs.kept);
        unrelated.add(angle_rad, pairs.weight);
    }

    /// Angle beyond which a view is new beside another \[rad\].
    pub(crate) fn news_rad(&self) -> f64 {
        if self.unrelated.count() >= tuning::UNRELATED_MIN {
            tuning::NEWS * self.unrelated.mean()
        } else {
            tuning::NEWS * FRAC_PI_2
        }
    }

    /// The kernel, once the statistics determine it.
    pub(crate) fn kernel(&self) -> Option<Kernel> {
        let sd = self.unrelated.sd();
        if self.unrelated.count() < tuning::UNRELATED_MIN || sd <= 0.0 {
            return None;
        }
        // Least squares of ln cos = ln c − d² / 2ℓ², over the classes that say something.
        let (mut weights, mut x, mut y, mut xx, mut xy) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for (class, known) in self.distances_m.iter().enumerate() {
            let cosine = ((class as f64 + 0.5) * tuning::WIDTH_RAD).cos();
            if known.count() < tuning::PAIRS_MIN || cosine < tuning::KERNEL_COSINE_MIN {
                continue;
            }
            let squared = known.mean().powi(2);
            let weight = known.weight() * cosine * cosine;
            weights += weight;
            x += weight * squared;
            y += weight * cosine.ln();
            xx += weight * squared * squared;
            xy += weight * squared * cosine.ln();
        }
        let spread = weights * xx - x * x;
        let slope = (weights * xy - x * y) / spread;
        if slope >= 0.0 || !slope.is_finite() {
            return None;
        }
        Some(Kernel {
            cosine: ((y - slope * x) / weights)
                .exp()
                .clamp(0.5, tuning::COSINE_MAX),
            length_m: (-0.5 / slope).sqrt(),
            numbers: (1.0 / (sd * sd)).max(1.0),
        })
    }

    /// Reach: distance beyond which views are no more similar than unrelated ones \[m\], once that
    /// is known.
    pub(crate) fn reach_m(&self) -> Option<f64> {
        let unrelated = &self.unrelated;
        if unrelated.count() < tuning::UNRELATED_MIN {
            return None;
        }
        let limit = class_of(unrelated.mean() - tuning::SIMILAR_SD * unrelated.sd())
            .min(tuning::CLASSES - 1);
        let known = (0..=limit)
            .rev()
            .filter_map(|class| self.distances_m.get(class));
        let farthest = known
            .filter(|class| class.count() >= tuning::PAIRS_MIN)
            .map(Moments::mean);
        farthest
            .max_by(f64::total_cmp)
            .filter(|reach_m| *reach_m > 0.0)
    }

    /// Angle up to which views are more similar than unrelated ones \[rad\], once that is known.
    fn similar_rad(&self) -> Option<f64> {
        let unrelated = &self.unrelated;
        let is_known = unrelated.count() >= tuning::UNRELATED_MIN;
        is_known.then(|| unrelated.mean() - tuning::SIMILAR_SD * unrelated.sd())
    }

    /// Least cosine of two views that are more similar than unrelated ones, once that is known.
    pub(crate) fn similar_cosine(&self) -> Option<f32> {
        #[expect(
            clippy::cast_possible_truncation,
            reason = "rounding errors are allowed for"
        )]
        let cosine = |angle_rad: f64| angle_rad.clamp(0.0, PI).cos() as f32;
        self.similar_rad().map(cosine)
    }

    /// The distance between two views; `None` if they are no more similar than unrelated ones.
    pub(crate) fn distance(&self, angle_rad: f64) -> Option<Distance> {
        if angle_rad > self.similar_rad()? {
            return None;
        }
        let known = |class: usize| {
            let class = self.distances_m.get(class)?;
            (class.count() >= tuning::PAIRS_MIN).then(|| (class.mean(), class.sd()))
        };
        let class = class_of(angle_rad);
        let Some(own) = known(class) else {
            // Nearer than all pairs so far: the distance is interpolated down to zero.
            let (nearest, (mean_m, sd_m)) =
                (class..tuning::CLASSES).find_map(|at| Some((at, known(at)?)))?;
            let share = angle_rad / ((nearest as f64 + 0.5) * tuning::WIDTH_RAD);
            return Some(Distance::new(share * mean_m, sd_m));
        };
        // Linear interpolation between the centres of two classes.
        let within = angle_rad / tuning::WIDTH_RAD - class as f64 - 0.5;
        let other = if within < 0.0 {
            class.checked_sub(1).and_then(known)
        } else {
            known(class + 1)
        };
        let (mean_m, sd_m) = other.map_or(own, |other| {
            let share = within.abs();
            (
                own.0 + share * (other.0 - own.0),
                own.1 + share * (other.1 - own.1),
            )
        });
        Some(Distance::new(mean_m, sd_m))
    }
}

state_of_struct!(Distance { mean_m, sd_m });

impl Distance {
    fn new(mean_m: f64, sd_m: f64) -> Self {
        Self {
            mean_m,
            sd_m: sd_m.max(tuning::SHARE_MIN * mean_m).max(tuning::SD_M_MIN),
        }
    }
}

/// The class of an angle; obtuse angles lie beyond the last one.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "an angle of 0 to π is from 0 to 64 classes wide"
)]
fn class_of(angle_rad: f64) -> usize {
    (angle_rad / tuning::WIDTH_RAD) as usize
}

/// A name of at most 255 bytes.
pub(crate) struct ShortText;

impl Codec<Box<str>> for ShortText {
    fn write(name: &Box<str>, out: &mut StateWriter) {
        u8::try_from(name.len())
            .expect("a channel's name fits a byte")
            .write(out);
        out.extend(name.as_bytes());
    }

    fn read(input: &mut StateReader<'_>) -> Result<Box<str>, CorruptState> {
        let length = u8::read(input)?;
        let name = std::str::from_utf8(input.take(length.into())?);
        name.map(Into::into).map_err(|_| CorruptState::Invalid)
    }
}

state_of_struct!(ChannelModel {
    name as ShortText,
    dimension,
    distances_m,
    unrelated,
    teachers,
});

#[cfg(test)]
mod tests {
    use super::*;

    /// A channel whose angle grows by a radian a metre, up to chance.
    fn learned() -> ChannelModel {
        let mut model = ChannelModel::new("view".into(), 64);
        for step in 0..4000_u32 {
            let distance_m = f64::from(step % 100) * 0.015;
            model.learn(0, distance_m, distance_m);
            model.learn_unrelated(1.5 + 0.1 * (f64::from(step) * 0.7).sin(), Pairs::ONE);
        }
        model
    }

    #[test]
    fn a_pair_that_stands_for_many_counts_as_often() {
        let (mut many, mut one) = (learned(), learned());
        let angle_rad = 1.42;
        for _ in 0..50 {
            many.learn_unrelated(angle_rad, Pairs::new(7));
            for _ in 0..7 {
                one.learn_unrelated(angle_rad, Pairs::ONE);
            }
        }
        assert!((many.unrelated.mean() - one.unrelated.mean()).abs() < 1e-9);
        assert!((many.unrelated.sd() - one.unrelated.sd()).abs() < 1e-9);
        assert!((many.unrelated.mean() - 1.5).abs() > 1e-3, "it is learned");
    }

    #[test]
    fn the_distance_is_the_learned_one() {
        let model = learned();
        for angle_rad in [0.1, 0.33, 0.5, 0.77, 1.0] {
            let found = model.distance(angle_rad).unwrap();
            assert!((found.mean_m - angle_rad).abs() < 0.02, "{found:?}");
            assert!(found.sd_m >= 0.1 * found.mean_m && found.sd_m < 0.15);
        }
        assert_eq!(model.distance(1.45), None);
        assert!((model.news_rad() - 0.375).abs() < 0.02);
    }

    #[test]
    fn there_is_no_distance_before_unrelated_views_are_known() {
        let mut model = ChannelModel::new("view".into(), 64);
        for _ in 0..100 {
            model.learn(0, 0.2, 0.2);
        }
        assert_eq!(model.distance(0.2), None);
    }
}
