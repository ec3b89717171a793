//! The bytes of where a target was seen.

use nalgebra::Isometry3;

use crate::sample::{PoseNoise, RangeBearing, Relation, RelativePose, RelativePosition};
use crate::state::{CorruptState, State, StateReader, StateWriter};

impl State for Relation {
    fn write(&self, out: &mut StateWriter) {
        match self {
            Self::Position(seen) => {
                0u8.write(out);
                (*seen.translation_m(), *seen.sd_m()).write(out);
            }
            Self::RangeBearing(seen) => {
                1u8.write(out);
                let direction = [seen.azimuth_rad(), seen.elevation_rad()];
                let sd = [seen.range_sd_m(), seen.bearing_sd_rad()];
                (seen.range_m(), (direction, sd)).write(out);
            }
            Self::Pose(seen) => {
                2u8.write(out);
                (*seen.pose(), *seen.noise().sd()).write(out);
            }
        }
    }

    fn read(input: &mut StateReader<'_>) -> Result<Self, CorruptState> {
        let relation = match u8::read(input)? {
            0 => {
                let (at, sd) = <([f64; 3], [f64; 3])>::read(input)?;
                RelativePosition::new(at, sd).map(Self::Position)
            }
            1 => {
                let (range, (direction, sd)) = <(f64, ([f64; 2], [f64; 2]))>::read(input)?;
                let [azimuth, elevation] = direction;
                RangeBearing::new(range, azimuth, elevation, sd[0], sd[1]).map(Self::RangeBearing)
            }
            2 => {
                let pose = Isometry3::read(input)?;
                let (at, turn) = (pose.translation.vector, pose.rotation.coords);
                let (linear, angular) = <([f64; 3], [f64; 3])>::read(input)?;
                PoseNoise::new(linear, angular)
                    .and_then(|noise| RelativePose::new(at.into(), turn.into(), noise))
                    .map(|checked| Self::Pose(checked.exactly(pose)))
            }
            _ => return Err(CorruptState::Invalid),
        };
        relation.map_err(|_| CorruptState::Invalid)
    }
}
