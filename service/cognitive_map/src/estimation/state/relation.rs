//! The bytes of where a target was seen.

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
                let (at, turn) = <([f64; 3], [f64; 4])>::read(input)?;
                let (linear, angular) = <([f64; 3], [f64; 3])>::read(input)?;
                PoseNoise::new(linear, angular)
                    .and_then(|noise| RelativePose::new(at, turn, noise))
                    .map(Self::Pose)
            }
            _ => return Err(CorruptState::Invalid),
        };
        relation.map_err(|_| CorruptState::Invalid)
    }
}

/// A relation that comes back from its bytes to the last bit: quaternions are normalised anew there.
pub(in crate::estimation) fn normalised(relation: &Relation) -> Relation {
    let Relation::Pose(seen) = relation else {
        return *relation;
    };
    let mut seen = *seen;
    for _ in 0..8 {
        let (shift, turn) = (seen.pose().translation.vector, seen.pose().rotation.coords);
        match RelativePose::new(shift.into(), turn.into(), *seen.noise()) {
            Ok(next) if next != seen => seen = next,
            _ => break,
        }
    }
    Relation::Pose(seen)
}
