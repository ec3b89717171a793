//! What the levels of a way say at a pose: the field at all of its nodes at once.

use nalgebra::{DMatrix, DVector, Isometry3, Point3, Vector3};

use crate::field::Field;
use crate::kernel::Kernel;
use crate::linear::Lower;
use crate::prediction::Support;
use crate::tuning::search as tuning;
use crate::window::Node;

/// What is remembered about a way of one channel, and what was sensed along it.
pub(super) struct ChannelOfWay {
    kernel: Kernel,
    supports: Vec<Support>,
    factor: Lower,
    /// Weights of the values that are remembered.
    weights: Vec<f64>,
    /// Where it was sensed, by motion alone, the way from there to its end \[m\], and the level
    /// less the channel's mean.
    felt: Vec<(Point3<f64>, f64, f64)>,
    /// Log density of these levels outside the map.
    anywhere: f64,
}

/// What a channel says at a pose.
pub(super) struct Expected {
    /// Levels less what is expected.
    pub(super) residuals: DVector<f64>,
    /// Covariance of that by the noise, and by what the places leave open.
    pub(super) covariance: DMatrix<f64>,
    /// Change of each level per metre along the axes of the map.
    pub(super) slopes: Vec<Vector3<f64>>,
}

/// The channels of the nodes that were sensed along a way, with the places about it if the frame of
/// motion lies at `pose`.
pub(super) fn channels(
    pose: &Isometry3<f64>,
    used: &[&Node],
    field: &dyn Field,
    most: usize,
) -> Vec<ChannelOfWay> {
    let mut channels: Vec<u8> = Vec::new();
    for felt in used.iter().flat_map(|node| &node.felt) {
        if !channels.contains(&felt.channel) && field.kernel(felt.channel).is_some() {
            channels.push(felt.channel);
        }
    }
    channels.sort_unstable();
    let lengths = channels.iter().filter_map(|&channel| field.kernel(channel));
    let Some(length_m) = lengths.map(|kernel| kernel.length_m).reduce(f64::min) else {
        return Vec::new();
    };
    let places = beside(pose, used, length_m, field, most);
    let of = |&channel: &u8| ChannelOfWay::new(channel, used, &places, field);
    channels.iter().filter_map(of).collect()
}

/// Places about a way, at most so many: those nearest to its nodes, then those nearest to points
/// beside them.
fn beside(
    pose: &Isometry3<f64>,
    used: &[&Node],
    length_m: f64,
    field: &dyn Field,
    most: usize,
) -> Vec<u32> {
    let mut places: Vec<u32> = Vec::with_capacity(most);
    let stencil = &tuning::STENCIL;
    for turn in 0..=stencil.len() {
        for (number, node) in used.iter().rev().enumerate() {
            let Some(first) = node.felt.first() else {
                continue;
            };
            if places.len() == most {
                return places;
            }
            // Each node begins with another side.
            let by = if turn == 0 {
                Vector3::zeros()
            } else {
                Vector3::from(stencil[(turn - 1 + number * tuning::STENCIL_TURN) % stencil.len()])
            };
            let at = pose * first.at + by * (tuning::BESIDE_WAY * length_m);
            if let Some(place) = field.nearest(&at)
                && !places.contains(&place)
            {
                places.push(place);
            }
        }
    }
    places
}

impl ChannelOfWay {
    fn new(channel: u8, used: &[&Node], places: &[u32], field: &dyn Field) -> Option<Self> {
        let kernel = *field.kernel(channel)?;
        let supports = places
            .iter()
            .filter_map(|&place| field.support(place, channel));
        let supports: Vec<Support> = supports.collect();
        if supports.is_empty() {
            return None;
        }
        let end_m = used.last().map_or(0.0, |node| node.way_m);
        let of_channel = |node: &&Node| {
            let felt = node.felt.iter().find(|felt| felt.channel == channel)?;
            Some((felt.at, end_m - node.way_m, felt.value - kernel.mean))
        };
        let felt: Vec<_> = used.iter().filter_map(of_channel).collect();
        let factor = Lower::factor(supports.len(), |row, column| {
            let (a, b) = (&supports[row], &supports[column]);
            let own = if row == column {
                noise_of(&kernel, a)
            } else {
                0.0
            };
            kernel.covariance((a.at - b.at).norm_squared()) + own
        })?;
        let mut weights: Vec<f64> = supports.iter().map(|s| s.value - kernel.mean).collect();
        factor.forwards(&mut weights, 1);
        factor.backwards(&mut weights, 1);
        let outside = Lower::factor(felt.len(), |row, column| {
            let noise = if row == column { kernel.nugget } else { 0.0 };
            kernel.covariance((felt[row].0 - felt[column].0).norm_squared()) + noise
        })?;
        let mut levels: Vec<f64> = felt.iter().map(|(_, _, level)| *level).collect();
        outside.forwards(&mut levels, 1);
        let anywhere = density(&levels) - outside.log_root();
        Some(Self {
            kernel,
            supports,
            factor,
            weights,
            felt,
            anywhere,
        })
    }

    /// Where each of its levels was sensed, by motion alone, and how far odometry may be off from
    /// there to the end of the way \[m\].
    pub(super) fn points(&self) -> impl Iterator<Item = (&Point3<f64>, f64)> {
        let felt = self.felt.iter();
        felt.map(|(at, way_m, _)| (at, tuning::DRIFT * way_m))
    }

    /// Log density of its levels outside the map \[nats\].
    pub(super) fn anywhere(&self) -> f64 {
        self.anywhere
    }

    /// What its levels are off by if the frame of motion lies at `pose`:
    ///
    /// ```text
    /// C = k(xᵢ, xⱼ) − kᵢᵀ K⁻¹ kⱼ + n I
    /// ```
    ///
    /// and if odometry is off by `drift`, in its deviations.
    pub(super) fn expect(&self, pose: &Isometry3<f64>, drift: &Vector3<f64>) -> Expected {
        let (n, m) = (self.supports.len(), self.felt.len());
        let points = self.points();
        let points: Vec<_> = points
            .map(|(at, drift_m)| pose * at + drift * drift_m)
            .collect();
        let squared_length = self.kernel.length_m * self.kernel.length_m;
        let mut to_points = vec![0.0; n * m];
        let mut slopes = vec![Vector3::zeros(); m];
        let mut residuals: Vec<f64> = self.felt.iter().map(|(_, _, level)| *level).collect();
        for (row, support) in self.supports.iter().enumerate() {
            for (k, at) in points.iter().enumerate() {
                let by = support.at - at;
                let covariance = self.kernel.covariance(by.norm_squared());
                to_points[row * m + k] = covariance;
                let part = self.weights[row] * covariance;
                residuals[k] -= part;
                slopes[k] += by * (part / squared_length);
            }
        }
        self.factor.forwards(&mut to_points, m);
        let mut covariance = DMatrix::zeros(m, m);
        for a in 0..m {
            for b in 0..=a {
                let prior = self
                    .kernel
                    .covariance((points[a] - points[b]).norm_squared());
                covariance[(a, b)] = prior;
            }
        }
        for row in to_points.chunks_exact(m) {
            for a in 0..m {
                for b in 0..=a {
                    covariance[(a, b)] -= row[a] * row[b];
                }
            }
        }
        for a in 0..m {
            covariance[(a, a)] = covariance[(a, a)].max(0.0) + self.kernel.nugget;
            for b in 0..a {
                covariance[(b, a)] = covariance[(a, b)];
            }
        }
        Expected {
            residuals: DVector::from_vec(residuals),
            covariance,
            slopes,
        }
    }

    /// Covariance of what may be made up of the slopes at a pose, along each axis of the map:
    ///
    /// ```text
    /// E − E P⁻¹ E        P of slopes that nothing is known of, E of their errors
    /// ```
    ///
    /// Where places tell the slope, that is E: if the field is the same along the axis, the slope
    /// is nothing but error. Where they tell nothing the slope is taken for 0, and nothing is made
    /// up of it.
    pub(super) fn made_up_slopes(&self, pose: &Isometry3<f64>) -> Option<[DMatrix<f64>; 3]> {
        let m = self.felt.len();
        let points: Vec<_> = self.points().map(|(at, _)| pose * at).collect();
        let squared_length = self.kernel.length_m * self.kernel.length_m;
        let mut all = std::array::from_fn(|_| DMatrix::zeros(0, 0));
        for (axis, made_up) in all.iter_mut().enumerate() {
            let mut rows = Vec::with_capacity(self.supports.len() * m);
            for support in &self.supports {
                rows.extend(points.iter().map(|at| {
                    let by = support.at - at;
                    by[axis] * self.kernel.covariance(by.norm_squared()) / squared_length
                }));
            }
            self.factor.forwards(&mut rows, m);
            let mut errors = DMatrix::from_fn(m, m, |a, b| {
                let by = points[a] - points[b];
                let part = (1.0 - by[axis] * by[axis] / squared_length) / squared_length;
                self.kernel.covariance(by.norm_squared()) * part
            });
            let mut unknown = errors.clone();
            for k in 0..m {
                // Slopes at neighbouring nodes are nearly one.
                unknown[(k, k)] *= 1.0 + tuning::SLOPES_APART;
            }
            for row in rows.chunks_exact(m) {
                let row = DVector::from_column_slice(row);
                errors.ger(-1.0, &row, &row, 1.0);
            }
            let owned = unknown.cholesky()?.l().solve_lower_triangular(&errors)?;
            *made_up = errors - owned.transpose() * owned;
        }
        Some(all)
    }
}

/// Variance of what a place remembers: of the sensor, and by where it was.
fn noise_of(kernel: &Kernel, support: &Support) -> f64 {
    kernel.nugget + kernel.squared_slope() * support.spread_m2
}

/// Log density of independent standard normal values, but for a constant of their number; one that
/// is far off counts as its distance, not as its square (Huber 1964).
pub(super) fn density<'a>(values: impl IntoIterator<Item = &'a f64>) -> f64 {
    let far = tuning::HUBER_SD;
    let of = |value: &f64| {
        let off = value.abs();
        if off <= far {
            -0.5 * off * off
        } else {
            far * (0.5 * far - off)
        }
    };
    values.into_iter().map(of).sum()
}
