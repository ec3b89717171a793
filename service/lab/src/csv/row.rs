//! One row of `samples.csv`.

use cogmap_proto::{Name, Target};
use nalgebra::{Isometry3, Vector3, Vector6};
use trajectory::parse_seconds;

use super::error::TableReason;

/// What a robot did or sensed at a moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// When \[ns\].
    pub stamp_ns: i64,
    /// What.
    pub body: RowBody,
}

/// What a robot did or sensed.
#[derive(Clone, Debug, PartialEq)]
pub enum RowBody {
    /// It moved by this, give or take standard deviations \[m, m, m, rad, rad, rad\].
    Increment(Isometry3<f64>, Vector6<f64>),
    /// It moved at this velocity and angular velocity \[m/s, rad/s\] for so long \[s\].
    Velocity([Vector3<f64>; 2], f64),
    /// It felt a value on a channel.
    Level(String, f64),
    /// It saw, on a channel, the view of this row.
    Descriptor(String, usize),
    /// It saw something at a distance, give or take a standard deviation \[m\].
    Range(Target, f64, f64),
    /// It was where it had been at this moment \[ns\].
    Revisit(i64),
}

impl RowBody {
    /// The motion that ends at the row, if it is one.
    pub(super) fn motion(&self) -> Option<Isometry3<f64>> {
        match self {
            Self::Increment(motion, _) => Some(*motion),
            Self::Velocity([linear, angular], duration_s) => {
                let (linear, angular) = (linear * *duration_s, angular * *duration_s);
                Some(geometry::se3::exp(&linear, &angular))
            }
            _ => None,
        }
    }
}

impl Row {
    /// Reads the columns of a line.
    ///
    /// # Errors
    /// They make no sense.
    pub(super) fn read(columns: &[&str]) -> Result<Self, TableReason> {
        require(columns, 5)?;
        let stamp_ns = parse_seconds(columns[0])?;
        let body = match columns[2] {
            "increment" => increment(columns)?,
            "velocity" => {
                require(columns, 7)?;
                let linear = Vector3::new(number(columns, 3)?, number(columns, 4)?, 0.0);
                let angular = Vector3::z() * number(columns, 5)?;
                RowBody::Velocity([linear, angular], not_negative(columns, 6)?)
            }
            "level" => RowBody::Level(name(columns, 3)?, number(columns, 4)?),
            "descriptor" => {
                let row = columns[4].parse();
                let row = row.map_err(|_| TableReason::NotARow { column: 5 })?;
                RowBody::Descriptor(name(columns, 3)?, row)
            }
            "sighting" => sighting(columns)?,
            other => return Err(TableReason::Kind(other.to_owned())),
        };
        Ok(Self { stamp_ns, body })
    }
}

fn increment(columns: &[&str]) -> Result<RowBody, TableReason> {
    require(columns, 10)?;
    let moved = Vector3::new(
        number(columns, 3)?,
        number(columns, 4)?,
        number(columns, 5)?,
    );
    let motion = Isometry3::new(moved, Vector3::z() * number(columns, 6)?);
    let [flat, upright, yaw] = [
        not_negative(columns, 7)?,
        not_negative(columns, 8)?,
        not_negative(columns, 9)?,
    ];
    let sd = Vector6::new(flat, flat, upright, 0.0, 0.0, yaw);
    Ok(RowBody::Increment(motion, sd))
}

fn sighting(columns: &[&str]) -> Result<RowBody, TableReason> {
    let target = match columns[3] {
        "own_sample_at_s" => return Ok(RowBody::Revisit(parse_seconds(columns[4])?)),
        "landmark" => Target::Landmark(columns[4].to_owned()),
        "agent" => Target::Agent(name(columns, 4)?),
        other => return Err(TableReason::Kind(other.to_owned())),
    };
    require(columns, 8)?;
    if columns[5] != "range" {
        return Err(TableReason::Kind(columns[5].to_owned()));
    }
    let range_m = not_negative(columns, 6)?;
    Ok(RowBody::Range(target, range_m, not_negative(columns, 7)?))
}

/// A name, by the rule that the service has for agents and channels.
pub(super) fn name(columns: &[&str], column: usize) -> Result<String, TableReason> {
    Name::check(columns[column])?;
    Ok(columns[column].to_owned())
}

pub(super) fn require(columns: &[&str], expected: usize) -> Result<(), TableReason> {
    if columns.len() < expected {
        let found = columns.len();
        return Err(TableReason::Columns { expected, found });
    }
    Ok(())
}

pub(super) fn number(columns: &[&str], column: usize) -> Result<f64, TableReason> {
    let number = columns[column].parse::<f64>().ok();
    let finite = number.filter(|number| number.is_finite());
    finite.ok_or(TableReason::NotANumber { column: column + 1 })
}

fn not_negative(columns: &[&str], column: usize) -> Result<f64, TableReason> {
    let number = number(columns, column)?;
    if number < 0.0 {
        return Err(TableReason::Negative { column: column + 1 });
    }
    Ok(number)
}
