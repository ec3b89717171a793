//! What views show as a function of where they are seen, and of which way an agent looks.

use nalgebra::Isometry3;

use crate::descriptor::dot;
use crate::similarity::{Turned, single};
use crate::tuning::tracking as tuning;

/// Means of the views about each of a channel's views, and how probable other views are there.
///
/// In components z whose variance is one, of which a part r is of the place, n views of a place
/// with the mean z̄ tell what it shows, and so what another view of it will show:
///
/// ```text
/// μ = n r z̄ / (n r + 1 − r)        s² = (1 − r) + r (1 − r) / (n r + 1 − r)
/// Λ(z) = Σ [ ln N(z; μ, s²) − ln N(z; 0, 1) ]
/// ```
///
/// Of n views w of each counts, by its distance, and by the part g that a turn of the body leaves:
/// w = g exp(−d² / 2h²).
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct ViewField {
    /// ½ (1/s² − 1) of each component, for each class of n.
    squares: Vec<Vec<f32>>,
    /// μ/s² and ½ Σ (μ²/s² + ln s²) of each view, with its class of n.
    means: Vec<Mean>,
}

#[derive(Clone, Debug, PartialEq)]
struct Mean {
    linear: Vec<f32>,
    constant: f32,
    class: usize,
}

/// Views of one place: the sum of their components, and how many they are.
#[derive(Clone, Debug)]
pub(super) struct About {
    sum: Vec<f32>,
    n: f64,
}

impl About {
    /// No view.
    pub(super) fn nothing(length: usize) -> Self {
        Self {
            sum: vec![0.0; length],
            n: 0.0,
        }
    }

    /// The views about a pose, within a width \[m\]: of each, its pose and its components.
    pub(super) fn of<'a>(
        at: &Isometry3<f64>,
        (width_m, turned): (f64, &Turned),
        length: usize,
        views: impl Iterator<Item = (&'a Isometry3<f64>, &'a [f32])>,
    ) -> Self {
        let mut about = Self::nothing(length);
        let reach = tuning::KERNEL_REACH * width_m;
        for (there, components) in views {
            let off = there.translation.vector - at.translation.vector;
            let squared = off.norm_squared();
            if squared > reach * reach {
                continue;
            }
            let turned = turned.part(there.rotation.angle_to(&at.rotation));
            let weight = (-0.5 * squared / (width_m * width_m)).exp() * turned;
            about.n += weight;
            let weight = single(weight);
            for (sum, component) in about.sum.iter_mut().zip(components) {
                *sum += weight * component;
            }
        }
        about
    }
}

impl ViewField {
    /// With the parts r of the components, and no view so far.
    pub(super) fn new(correlations: &[f64]) -> Self {
        let square = |class: usize| -> Vec<f32> {
            let of = |&r: &f64| single(0.5 * (variance(r, count(class)).recip() - 1.0));
            correlations.iter().map(of).collect()
        };
        Self {
            squares: (0..=tuning::CLASS_MAX).map(square).collect(),
            means: Vec::new(),
        }
    }

    /// Adds the views about the next position.
    pub(super) fn push(&mut self, about: &About, correlations: &[f64]) {
        self.means.push(Mean::of(about, correlations));
    }

    /// How probable a view is at each of the positions, for its components.
    pub(super) fn at(&self, components: &[f32]) -> View<'_> {
        let squared: Vec<f32> = components.iter().map(|z| z * z).collect();
        View {
            field: self,
            squares: { self.squares.iter() }
                .map(|square| dot(square, &squared))
                .collect(),
        }
    }
}

/// A view beside a field.
pub(super) struct View<'a> {
    field: &'a ViewField,
    /// What its squares take from Λ, for each class of n.
    squares: Vec<f32>,
}

impl View<'_> {
    /// How much more probable it is at a position than anywhere, or it shows something else:
    /// ln [ ε + (1 − ε) exp Λ ].
    pub(super) fn log_likelihood(&self, number: usize, components: &[f32]) -> f64 {
        let mean = self.field.means.get(number);
        mean.map_or(0.0, |mean| self.by_mean(mean, components))
    }

    fn by_mean(&self, mean: &Mean, components: &[f32]) -> f64 {
        let linear = dot(&mean.linear, components);
        let lambda = f64::from(linear - mean.constant - self.squares[mean.class]);
        (tuning::ELSE + (1.0 - tuning::ELSE) * lambda.min(tuning::NATS_MAX).exp()).ln()
    }
}

impl Mean {
    fn of(about: &About, correlations: &[f64]) -> Self {
        let class = class(about.n);
        let n = count(class);
        let mut constant = 0.0;
        let linear = correlations.iter().zip(&about.sum).map(|(&r, &sum)| {
            let known = if about.n > 0.0 {
                f64::from(sum) / about.n * n * r / (n * r + 1.0 - r)
            } else {
                0.0
            };
            let variance = variance(r, n);
            constant += 0.5 * (known * known / variance + variance.ln());
            single(known / variance)
        });
        Self {
            linear: linear.collect(),
            constant: single(constant),
            class,
        }
    }
}

/// s² of a component by n views.
fn variance(r: f64, n: f64) -> f64 {
    (1.0 - r) * (1.0 + r / (n * r + 1.0 - r))
}

/// The class of so many views: twice the binary logarithm.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "twice the logarithm of a number of views is neither negative nor large"
)]
fn class(n: f64) -> usize {
    let class = (2.0 * n.max(1.0).log2()) as usize;
    class.min(tuning::CLASS_MAX)
}

/// The number of views that a class stands for.
fn count(class: usize) -> f64 {
    (0.5 * class as f64).exp2()
}
