//! The tables of a set in memory.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use nalgebra::{Isometry3, Vector3};
use trajectory::{StampedPosition, Trajectory, parse_seconds};

use super::error::{TableError, TableReason};
use super::row::{Row, RowBody, name, number, require};
use super::views::Views;

/// A set: what each agent recorded, by its name, and the views.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TableSet {
    /// The agents.
    pub agents: BTreeMap<String, Log>,
    /// The views, by their channel.
    pub views: BTreeMap<String, Views>,
}

/// What one agent recorded.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Log {
    /// In order of time.
    pub rows: Vec<Row>,
    /// Where it was, if that is known.
    pub truth: Option<Truth>,
}

/// Where an agent was.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// Its positions.
    pub trajectory: Trajectory,
    /// The first heading that is known \[rad\].
    pub heading_rad: Option<f64>,
}

impl Truth {
    /// Where it was; before the first and after the last position, there.
    pub fn at(&self, stamp_ns: i64) -> Option<Vector3<f64>> {
        let span = self.trajectory.span();
        self.trajectory
            .at(stamp_ns.clamp(span.start_ns, span.end_ns))
    }

    /// Its pose at a moment, with the first heading that is known, or else none.
    pub fn start(&self, stamp_ns: i64) -> Option<Isometry3<f64>> {
        let turn = Vector3::z() * self.heading_rad.unwrap_or(0.0);
        Some(Isometry3::new(self.at(stamp_ns)?, turn))
    }
}

impl TableSet {
    /// Reads `samples.csv`, `truth.csv` if it is there, and the views that the samples name, of a
    /// directory.
    ///
    /// # Errors
    /// A file cannot be read or is not of the format.
    pub fn load(directory: &Path) -> Result<Self, TableError> {
        let text = |name: &str| {
            let file = directory.join(name);
            fs::read_to_string(&file).map_err(|source| TableError::Io {
                file: file.display().to_string(),
                source,
            })
        };
        let truth = if directory.join("truth.csv").exists() {
            text("truth.csv")?
        } else {
            String::new()
        };
        let mut set = Self::read(&text("samples.csv")?, &truth)?;
        for channel in set.channels_of_views() {
            let file = directory.join(format!("{channel}.npy"));
            let shown = file.display().to_string();
            let bytes = fs::read(&file).map_err(|source| TableError::Io {
                file: shown.clone(),
                source,
            })?;
            let views = Views::read(&bytes).ok_or(TableError::Views { file: shown })?;
            set.views.insert(channel, views);
        }
        Ok(set)
    }

    /// Reads the two tables. There are no views then.
    ///
    /// # Errors
    /// A line makes no sense, or there is no sample.
    pub fn read(samples: &str, truth: &str) -> Result<Self, TableError> {
        let mut set = Self::default();
        for_each_line(("samples.csv", SAMPLES), samples, |columns| {
            let row = Row::read(columns)?;
            let log = set.agents.entry(name(columns, 1)?).or_default();
            if log
                .rows
                .last()
                .is_some_and(|last| row.stamp_ns < last.stamp_ns)
            {
                return Err(TableReason::Backwards);
            }
            log.rows.push(row);
            Ok(())
        })?;
        if set.agents.is_empty() {
            return Err(TableError::Empty);
        }
        let mut known: BTreeMap<String, (Vec<StampedPosition>, Option<f64>)> = BTreeMap::new();
        for_each_line(("truth.csv", TRUTH), truth, |columns| {
            require(columns, 6)?;
            let (positions, heading_rad) = known.entry(name(columns, 1)?).or_default();
            // A height that is not told is that of the plane.
            let z = if columns[4].is_empty() {
                0.0
            } else {
                number(columns, 4)?
            };
            positions.push(StampedPosition {
                stamp_ns: parse_seconds(columns[0])?,
                position_m: Vector3::new(number(columns, 2)?, number(columns, 3)?, z),
            });
            if heading_rad.is_none() && !columns[5].is_empty() {
                *heading_rad = Some(number(columns, 5)?);
            }
            Ok(())
        })?;
        for (agent, (positions, heading_rad)) in known {
            let Some(log) = set.agents.get_mut(&agent) else {
                continue;
            };
            let trajectory = Trajectory::new(positions);
            let trajectory = trajectory.map_err(|source| TableError::Truth { agent, source })?;
            log.truth = Some(Truth {
                trajectory,
                heading_rad,
            });
        }
        Ok(set)
    }

    /// The channels of levels and views.
    pub fn channels(&self) -> BTreeSet<&str> {
        let rows = self.agents.values().flat_map(|log| &log.rows);
        rows.filter_map(|row| match &row.body {
            RowBody::Level(channel, _) | RowBody::Descriptor(channel, _) => Some(channel.as_str()),
            _ => None,
        })
        .collect()
    }

    /// The channels of which there are views.
    fn channels_of_views(&self) -> Vec<String> {
        let rows = self.agents.values().flat_map(|log| &log.rows);
        let mut channels: Vec<String> = rows
            .filter_map(|row| match &row.body {
                RowBody::Descriptor(channel, _) => Some(channel.clone()),
                _ => None,
            })
            .collect();
        channels.sort();
        channels.dedup();
        channels
    }
}

/// Most characters of a header that an error shows.
const HEADER_SHOWN: usize = 60;
/// What the first line of `samples.csv` begins with.
const SAMPLES: &str = "t_s,agent,kind";
/// What that of `truth.csv` begins with.
const TRUTH: &str = "t_s,agent,x,y,z,yaw";

/// Hands out the columns of each line of a file but the first, which names them.
fn for_each_line(
    (file, header): (&str, &'static str),
    text: &str,
    mut each: impl FnMut(&[&str]) -> Result<(), TableReason>,
) -> Result<(), TableError> {
    // Spreadsheets begin a text with a byte order mark.
    let text = text.trim_start_matches('\u{feff}');
    let first = text.lines().next();
    if let Some(found) = first.filter(|first| !first.starts_with(header)) {
        return Err(TableError::Header {
            file: file.to_owned(),
            expected: header,
            found: found.chars().take(HEADER_SHOWN).collect(),
        });
    }
    for (index, line) in text.lines().enumerate().skip(1) {
        let columns: Vec<&str> = line.trim_end().split(',').collect();
        each(&columns).map_err(|reason| TableError::Line {
            file: file.to_owned(),
            line: index + 1,
            reason,
        })?;
    }
    Ok(())
}
