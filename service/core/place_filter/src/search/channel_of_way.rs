//! What the levels of a way say at a pose: the field at all of its nodes at once.

use nalgebra::{DMatrix, Isometry3, Point3, Vector3};

use super::points::{Lanes, Points, put_from};
use crate::field::Field;
use crate::kernel::Kernel;
use crate::linear::{LANES, Lower, Row, subtract_products};
use crate::prediction::Support;
use crate::tuning::search as tuning;
use crate::window::Node;

const _: () = assert!(tuning::NODES <= LANES, "the nodes of a way are a row");

/// What is remembered about a way of one channel, and what was sensed along it.
pub(super) struct ChannelOfWay {
    kernel: Kernel,
    supports: Points,
    factor: Lower,
    /// Weights of the values that are remembered.
    weights: Vec<f64>,
    felt: Vec<FeltAt>,
    /// Log density of its levels outside the map.
    anywhere: f64,
}

/// A level of the way.
pub(super) struct FeltAt {
    /// Where it was sensed, by motion alone \[m\].
    pub(super) at: Point3<f64>,
    /// How far odometry may be off from there to the end of the way \[m\].
    pub(super) drift_m: f64,
    /// The level less the channel's mean.
    level: f64,
}

/// What a channel says at a pose, of each of its levels; the lanes after them must not be
/// read.
pub(super) struct Expected {
    /// Levels less what is expected.
    pub(super) residuals: Row,
    /// Covariance of that by the noise, and by what the places leave open.
    pub(super) covariance: [Row; LANES],
    /// Change of each level per metre along each axis of the map.
    pub(super) slopes: Lanes,
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
            Some(FeltAt {
                at: felt.at,
                drift_m: tuning::DRIFT * (end_m - node.way_m),
                level: felt.value - kernel.mean,
            })
        };
        let felt: Vec<FeltAt> = used.iter().filter_map(of_channel).collect();
        let points = Points::new(supports.iter().map(|support| &support.at));
        let factor = factor(&kernel, &points, |row| noise_of(&kernel, &supports[row]))?;
        let mut weights: Vec<f64> = supports.iter().map(|s| s.value - kernel.mean).collect();
        factor.solve(&mut weights);
        Some(Self {
            anywhere: anywhere(&kernel, &felt)?,
            kernel,
            supports: points,
            factor,
            weights,
            felt,
        })
    }

    /// Its levels.
    pub(super) fn felt(&self) -> &[FeltAt] {
        &self.felt
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
        let mut points = [[0.0; LANES]; 3];
        let mut residuals = [0.0; LANES];
        for (lane, felt) in self.felt.iter().enumerate() {
            put_from(&mut points, lane, &(pose * felt.at + drift * felt.drift_m));
            residuals[lane] = felt.level;
        }
        let mut expected = Expected {
            residuals,
            covariance: [[0.0; LANES]; LANES],
            slopes: [[0.0; LANES]; 3],
        };
        let mut to_points = vec![[0.0; LANES]; self.supports.len()];
        simd::dispatch(
            #[inline(always)]
            || self.fill(&points, &mut to_points, &mut expected),
        );
        expected
    }

    /// Works out what is expected at these points.
    #[expect(
        clippy::inline_always,
        reason = "compiled for the vectors of a dispatch"
    )]
    #[inline(always)]
    fn fill(&self, points: &Lanes, to_points: &mut [Row], expected: &mut Expected) {
        for (number, row) in to_points.iter_mut().enumerate() {
            let at = self.supports.at(number);
            *row = self.kernel.covariances(&at, points);
            for lane in 0..LANES {
                let part = self.weights[number] * row[lane];
                expected.residuals[lane] -= part;
                for axis in 0..3 {
                    expected.slopes[axis][lane] += part * (at[axis] - points[axis][lane]);
                }
            }
        }
        let squared_length = self.kernel.length_m * self.kernel.length_m;
        for slope in expected.slopes.iter_mut().flatten() {
            *slope /= squared_length;
        }
        self.factor.forwards_inline(to_points);
        for (lane, row) in expected.covariance.iter_mut().enumerate() {
            *row = self
                .kernel
                .covariances(&points.map(|axis| axis[lane]), points);
        }
        subtract_products(to_points, &mut expected.covariance);
        for (lane, row) in expected.covariance.iter_mut().enumerate() {
            row[lane] = row[lane].max(0.0) + self.kernel.nugget;
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
        let mut points = [[0.0; LANES]; 3];
        for (lane, felt) in self.felt.iter().enumerate() {
            put_from(&mut points, lane, &(pose * felt.at));
        }
        let squared_length = self.kernel.length_m * self.kernel.length_m;
        let mut all = std::array::from_fn(|_| DMatrix::zeros(0, 0));
        for (axis, made_up) in all.iter_mut().enumerate() {
            let by_axis = |at: &[f64; 3], factor: &dyn Fn(f64) -> f64| -> Row {
                let mut row = self.kernel.covariances(at, &points);
                for (entry, along) in row.iter_mut().zip(&points[axis]) {
                    *entry *= factor(at[axis] - along) / squared_length;
                }
                row
            };
            let mut rows: Vec<Row> = (0..self.supports.len())
                .map(|number| by_axis(&self.supports.at(number), &|by| by))
                .collect();
            self.factor.forwards(&mut rows);
            let mut errors: [Row; LANES] = std::array::from_fn(|lane| {
                let at = points.map(|axis| axis[lane]);
                by_axis(&at, &|by| 1.0 - by * by / squared_length)
            });
            let mut unknown = symmetric(&errors, m);
            for k in 0..m {
                // Slopes at neighbouring nodes are nearly one.
                unknown[(k, k)] *= 1.0 + tuning::SLOPES_APART;
            }
            subtract_products(&rows, &mut errors);
            let errors = symmetric(&errors, m);
            let owned = unknown.cholesky()?.l().solve_lower_triangular(&errors)?;
            *made_up = errors - owned.transpose() * owned;
        }
        Some(all)
    }
}

/// The factor of the covariance of levels at some points, with the noise of each.
fn factor(kernel: &Kernel, points: &Points, noise: impl Fn(usize) -> f64) -> Option<Lower> {
    Lower::factor(
        points.len(),
        #[inline(always)]
        |row, first| {
            let mut entries = kernel.covariances(&points.at(row), points.from(first));
            if let Some(own) = row.checked_sub(first).and_then(|own| entries.get_mut(own)) {
                *own += noise(row);
            }
            entries
        },
    )
}

/// Log density of levels outside the map \[nats\].
fn anywhere(kernel: &Kernel, felt: &[FeltAt]) -> Option<f64> {
    let points = Points::new(felt.iter().map(|felt| &felt.at));
    let outside = factor(kernel, &points, |_| kernel.nugget)?;
    let mut levels: Vec<Row> = felt.iter().map(|felt| [felt.level; LANES]).collect();
    outside.forwards(&mut levels);
    Some(density(levels.iter().map(|row| &row[0])) - outside.log_root())
}

/// Variance of what a place remembers: of the sensor, and by where it was.
fn noise_of(kernel: &Kernel, support: &Support) -> f64 {
    kernel.nugget + kernel.squared_slope() * support.spread_m2
}

/// The symmetric matrix of which a diagonal is given, and what is right of that.
pub(super) fn symmetric(upper: &[Row; LANES], n: usize) -> DMatrix<f64> {
    DMatrix::from_fn(n, n, |a, b| upper[a.min(b)][a.max(b)])
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
