//! What an agent of a set would have sent.

use std::collections::BTreeSet;

use cogmap_proto::{Descriptor, Level, Relation, SampleBody, Target};
use nalgebra::{Isometry3, Vector6};

use super::data_set::TableSet;
use super::error::TableError;
use super::row::RowBody;
use crate::stream::{Stream, motion_noise, seen_pose};

/// Earliest stamp of a set that begins at zero \[ns\]: a start pose comes before it.
const FIRST_NS: i64 = 1_000_000_000;
/// Least standard deviation that a motion states \[m, rad\].
const SD_MIN: f64 = 1e-6;
/// Shorter gaps between two moments at one place say nothing that odometry does not \[ns\].
const GAP_NS: i64 = 10_000_000_000;
/// How far apart two samples of one place are taken, along each axis \[m\] …
const POSITION_SD_M: f64 = 0.5;
/// … and in heading \[rad\].
const HEADING_SD_RAD: f64 = 0.2;

/// What of a set is sent.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Choice {
    /// Channels that are left out.
    pub without: BTreeSet<String>,
    /// Motions go without the noise that the set states, so that the space's odometry noise holds.
    pub unstated_noise: bool,
}

impl TableSet {
    /// What an agent would have sent, from a start pose on if it is known where it was at its first
    /// row: a motion there has led it to that. Stamps are a second later than in the set. A view of
    /// which all numbers are zero is none.
    ///
    /// # Errors
    /// It names a view that is not there.
    pub fn stream(
        &self,
        agent: &str,
        start: Option<&Isometry3<f64>>,
        choice: &Choice,
    ) -> Result<Stream, TableError> {
        let mut stream = Stream::default();
        let rows = self.agents.get(agent).map_or(&[][..], |log| &log.rows);
        let first_ns = rows.first().map_or(0, |row| Self::sent_ns(row.stamp_ns));
        match start {
            Some(start) => {
                let motion = rows.first().and_then(|row| row.body.motion());
                let before = start * motion.unwrap_or_default().inverse();
                stream.start(first_ns - 1, &before);
            }
            None => stream.begin(first_ns - 1),
        }
        // Stamps and numbers of the motions.
        let mut motions: Vec<(i64, u64)> = Vec::new();
        for row in rows {
            let stamp_ns = Self::sent_ns(row.stamp_ns);
            match &row.body {
                RowBody::Increment(motion, sd) => {
                    let noise = (!choice.unstated_noise).then(|| motion_noise(&at_least(sd)));
                    let number = stream.increment(stamp_ns, motion, noise);
                    motions.push((stamp_ns, number));
                }
                RowBody::Velocity(velocity, duration_s) => {
                    let number = stream.velocity(stamp_ns, *velocity, *duration_s);
                    motions.push((stamp_ns, number));
                }
                RowBody::Level(channel, value) if !choice.without.contains(channel) => {
                    let level = Level {
                        channel: channel.clone(),
                        value: *value,
                        offset_m: [0.0; 3],
                        normal: None,
                    };
                    stream.push(stamp_ns, SampleBody::Level(level));
                }
                RowBody::Descriptor(channel, row) if !choice.without.contains(channel) => {
                    if let Some(vector) = self.view(channel, *row)? {
                        let channel = channel.clone();
                        let view = Descriptor { channel, vector };
                        stream.push(stamp_ns, SampleBody::Descriptor(view));
                    }
                }
                RowBody::Level(..) | RowBody::Descriptor(..) => {}
                RowBody::Range(target, range_m, sd_m) => {
                    stream.sighting(stamp_ns, target.clone(), at_distance(*range_m, *sd_m));
                }
                RowBody::Revisit(then_ns) => {
                    let then_ns = Self::sent_ns(*then_ns);
                    let nearest = motions.iter().min_by_key(|(at, _)| at.abs_diff(then_ns));
                    if let (Some((at_ns, number)), Some((now_ns, _))) = (nearest, motions.last())
                        && now_ns - at_ns > GAP_NS
                    {
                        stream.sighting(stamp_ns, Target::OwnSample(*number), same_place());
                    }
                }
            }
        }
        Ok(stream)
    }

    /// The stamp with which a row is sent.
    pub fn sent_ns(stamp_ns: i64) -> i64 {
        stamp_ns.saturating_add(FIRST_NS)
    }

    /// A view, scaled to length 1; none of nothing.
    fn view(&self, channel: &str, row: usize) -> Result<Option<Vec<f32>>, TableError> {
        let view = self.views.get(channel).and_then(|views| views.row(row));
        let view = view.ok_or_else(|| TableError::NoView {
            channel: channel.to_owned(),
            row,
        })?;
        let length = view.iter().map(|x| x * x).sum::<f64>().sqrt();
        #[expect(
            clippy::cast_possible_truncation,
            reason = "views are of single precision"
        )]
        let scaled = || view.iter().map(|x| (x / length) as f32).collect();
        Ok((length > 0.0).then(scaled))
    }
}

fn at_least(sd: &Vector6<f64>) -> Vector6<f64> {
    let [x, y, z, _, _, yaw] = (*sd).into();
    Vector6::new(
        x.max(SD_MIN),
        y.max(SD_MIN),
        z.max(SD_MIN),
        0.0,
        0.0,
        yaw.max(SD_MIN),
    )
}

/// A distance without a direction.
fn at_distance(range_m: f64, range_sd_m: f64) -> Relation {
    Relation::Range {
        range_m,
        range_sd_m,
        offset_m: [0.0; 3],
    }
}

fn same_place() -> Relation {
    let mut sd = Vector6::zeros();
    (sd[0], sd[1], sd[5]) = (POSITION_SD_M, POSITION_SD_M, HEADING_SD_RAD);
    seen_pose(&Isometry3::identity(), &sd)
}
